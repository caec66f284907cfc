"""STEP files of parts, made by gmsh's kernel in a process of its own; lengths in mm, the axis along x."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HEAD = """
import gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
make = gmsh.model.occ
"""
TAIL = """
make.synchronize()
gmsh.write({path!r})
gmsh.finalize()
"""
TUBE = """
outer, inner = make.addCylinder(0, 0, 0, {length}, 0, 0, 9.5), make.addCylinder(0, 0, 0, {length}, 0, 0, 7)
make.cut([(3, outer)], [(3, inner)])
"""
BAR = "make.addBox(0, -5, -10, {length}, 10, 20)"  # 10 mm along y, 20 mm along z
EYES = """
bar = make.addBox(0, -5, -10, {length}, 10, 20)
eyes = [(3, make.addCylinder(x, -5, 0, 0, 10, 0, 6)) for x in (15, {length} - 15)]
make.cut([(3, bar)], eyes)
"""
HOLES = """
bar = make.addBox(0, -5, -10, {length}, 10, 20)
make.cut([(3, bar)], [(3, make.addCylinder(10 + 5 * k, -5, 0, 0, 10, 0, 0.3)) for k in range(12)])
"""
AHEAD = "make.addBox(-20, -5, -10, {length}, 10, 20)"
BESIDE = "make.addBox(0, 7, -10, {length}, 10, 20)"
SLANTED = """
bar = make.addBox(0, -5, -10, {length}, 10, 20)
make.cut([(3, bar)], [(3, make.addBox({length} - 30, 0, -10, 40, 10, 20))])
"""  # its far end is half as wide, to one side
ROUND = "make.addSphere({length} / 2, 0, 0, {length} / 2)"
TWO = "make.addBox(0, -5, -10, {length} / 2, 10, 20), make.addBox({length} / 2 + 1, -5, -10, {length} / 2 - 1, 10, 20)"
FACE = "make.addRectangle(0, 0, 0, {length}, 10)"


def step_file(folder: Path, what: str, length: float, name: str = "part.step") -> str:
    """The file."""
    path = folder / name
    program = HEAD + what.format(length=length) + TAIL.format(path=str(path))
    subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, timeout=60)
    return str(path)
