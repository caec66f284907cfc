"""Parts from STEP files.

Where a part lies in its file is agreed: its axis runs along +x, from (0, 0, 0), the end nearer to the ground, to (length, 0,
0); its y and z are those of the beam; at either end it has flat faces across the axis, by which it is held, and the axis passes
through their middle.  The unit is the file's.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile

import numpy as np

from trivet.errors import InputError, one_line
from trivet.solids.grid import Grid, grid

LARGEST_FILE = 50_000_000
"""Bytes."""
LONGEST = 300
"""Seconds that gmsh gets for a mesh."""
MOST_MEMORY = 4_000_000_000
"""Bytes that gmsh gets, as address space."""
EXHAUSTED = ("out of memory", "bad_alloc", "memoryerror")
"""What it and its libraries say when that is not enough, among other things."""
NO_NUMBER = re.compile(rb"'[^']*'|/\*.*?\*/|(?<=[(,])\s*([-+]?(?:nan|inf|\d\.#)\w*)", re.IGNORECASE | re.DOTALL)
"""What is no number, as programs write it, in its group; texts and comments are passed over.  gmsh would never end."""
FITS = 1e-3
"""Difference of a part's length from that of its beam, against the latter, up to which it is that beam."""


def from_step(name: str, file: str, length: float, fineness: float) -> Grid:
    """The mesh of a part that stands for a beam.

    Args:
        name: the beam, as messages call it.
        file: STEP.
        length: of the beam, m.
        fineness: 1, or more for smaller elements.

    Raises:
        InputError: the file cannot be read, holds no single solid, or one that does not lie as agreed or has another length; it
            cannot be meshed; gmsh is not installed.
    """
    _check(file)
    with tempfile.TemporaryDirectory() as folder:
        result = os.path.join(folder, "mesh.npz")
        program = [sys.executable, "-m", "trivet.solids.tetrahedra"]
        command = [*program, os.path.abspath(file), repr(fineness), result, str(MOST_MEMORY)]
        alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # each thread would reserve memory
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, errors="replace", timeout=LONGEST, check=False, env=alone
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"{file}: no mesh within {LONGEST} s; make the part simpler") from None
        if done.returncode and any(word in (done.stdout + done.stderr).lower() for word in EXHAUSTED):
            raise InputError(
                f"{file}: meshing takes more than {MOST_MEMORY / 1e9:g} GB of memory; give a coarser mesh (--fineness) or a "
                "simpler part"
            )
        if done.returncode == 2 and done.stdout.strip():
            raise InputError(f"{file}: {done.stdout.strip().splitlines()[-1]}")
        if done.returncode:
            raise InputError(f"{file}: gmsh broke down over it (exit code {done.returncode}); is it a sound STEP file?")
        with np.load(result) as made:
            points, elements, size = (made[key] for key in ("points", "elements", "size"))
    found = float(np.ptp(points[0]))
    if abs(found - length) > FITS * length:
        raise InputError(
            f"{file}: the part is {1e3 * found:.6g} mm long, {name} {1e3 * length:.6g} mm at this pose; they may differ by "
            f"{100 * FITS:g} %"
        )
    return grid(f"{file} for {name}", "tetrahedra", points, elements, found, float(size))


def _check(file: str) -> None:
    try:
        size = os.stat(file).st_size
    except (OSError, ValueError) as error:  # a name with a NUL in it
        raise InputError(f"{one_line(file)}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not file.lower().endswith((".step", ".stp")):
        raise InputError(f"{file}: a part is a STEP file, .step or .stp")
    if not os.path.isfile(file):
        raise InputError(f"{file}: is no file")
    if not 0 < size <= LARGEST_FILE:
        raise InputError(f"{file}: {size / 1e6:.0f} MB; expected more than nothing and at most {LARGEST_FILE / 1e6:.0f} MB")
    with open(file, "rb") as opened:
        wrong = next((found[1] for found in NO_NUMBER.finditer(opened.read()) if found[1]), None)
    if wrong is not None:
        raise InputError(f"{file}: {wrong.decode()} where a number was expected; export the part again")
