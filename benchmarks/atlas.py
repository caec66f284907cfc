"""The atlas of frequency responses against superposition of modes pose by pose, its slopes, its memory."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import numpy as np

from benchmarks.kernels import Row, quartiles
from benchmarks.pairs import Paired, paired
from benchmarks.superposition import SOLVERS, Choice, Ready, fastest, matrices
from benchmarks.vibration import ETA, FREQUENCY, HEIGHT, LEAST, choices, milliseconds, setting
from trivet.space.pose import zyz_frame
from trivet.space.surface import hemisphere
from trivet.statics.assembly import Structure, assemble
from trivet.vibration.directional import Asked, Entries, greatest, receptances
from trivet.vibration.least import least

FEW = 10
"""Poses at which the peers are timed."""
ENTRIES = Entries.named([("x", "x"), ("y", "y"), ("z", "z")])
WHAT = "atlas of 317 poses × 2,000 frequencies, xx yy zz, azulay"
MEMORY = """
import resource, sys
import numpy as np
from trivet.model import load
from trivet.kinematics.mode import parse_mode
from trivet.space.pose import zyz_frame
from trivet.vibration.directional import Asked, Entries, receptances
count = int(sys.argv[1])
machine = load("azulay").with_spherical("free")
random = np.random.default_rng(0)
place = np.array([0, 0, 0.13]) + random.uniform(-0.004, 0.004, (count, 3))
poses = zyz_frame(place, random.uniform(-3, 3, count), random.uniform(0, 0.3, count), random.uniform(-1, 1, count))
asked = Asked.of(machine, poses, parse_mode(machine), Entries.named([("x", "x")]))
most = max(float(np.abs(values).max()) for _, values in receptances(asked, np.linspace(5, 3000, 2000)))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def poses() -> Any:
    """The paper's 317 check points about home, without roll."""
    points = hemisphere(HEIGHT - 0.004, 0.004)
    return zyz_frame(points.position, points.azimuth, points.tilt, -points.azimuth)


def asked(count: int | None = None) -> Asked:
    found = setting()
    return Asked.of(found.machine, jax.tree.map(lambda c: c[:count], poses()), found.signs, ENTRIES, ETA)


def structures() -> list[Structure]:
    """At poses spread over the check points."""
    found, all_poses = setting(), poses()
    picked = np.linspace(0, len(all_poses.origin.x) - 1, FEW).astype(int)
    return [assemble(found.machine, jax.tree.map(lambda c, k=k: c[k], all_poses), found.signs) for k in picked]


def diagonal(structure: Structure, choice: Choice) -> np.ndarray:
    """Three responses (3, n) of one pose by superposition of modes, the matrices put together by hand."""
    ready = Ready.of(matrices(structure, choice.radial, choice.link), choice.solver)
    squares, shapes = SOLVERS[choice.solver](ready.stiffness, ready.mass, choice.modes)
    factors = 1 / (squares * (1 + 1j * ETA) - np.square(2 * np.pi * FREQUENCY)[:, None])
    return (factors @ np.square(shapes[:3]).T).T


def against_modes() -> Iterator[Row]:
    some, whole = structures(), asked()
    uncorrected = [choice for choice in choices(LEAST, tuple(range(2, 17))) if not choice.corrected]
    best = fastest(setting().structure, uncorrected, FREQUENCY, ETA)

    def ours() -> None:
        for _ in receptances(whole, FREQUENCY):
            pass

    def theirs() -> None:
        for structure in some:
            diagonal(structure, best)

    result = paired(ours, theirs, pairs=7, calls=1)
    scaled = Paired(result.ours / len(whole), result.peer / FEW)
    yield (
        f"{WHAT}, per pose: ratio to SciPy pose by pose ({best}), extrapolated from {FEW} poses",
        f"{quartiles(scaled)}×; {milliseconds(scaled.ours)} against {milliseconds(scaled.peer)}",
        "≥ 10",
    )


def least_and_slopes() -> Iterator[Row]:
    """The least dynamic stiffness with its slopes in every dimension against the value alone."""
    for count in (2, 64):
        own = asked(count)
        value = partial(greatest, own, 5.0, 3000.0, ETA)
        result = paired(value, partial(least, own, 5.0, 3000.0, ETA), pairs=7, calls=3)
        scaled = Paired(result.ours / count, result.peer / count)
        yield (
            f"least dynamic stiffness along x, y, z at {count} poses: with slopes, against the value",
            f"{quartiles(scaled)}×; {milliseconds(scaled.peer)} against {milliseconds(scaled.ours)} per pose",
            "≤ 4",
        )


def memory() -> Iterator[Row]:
    """Peak memory against the number of poses."""
    found = []
    for count in (300, 3000, 30000):
        done = subprocess.run([sys.executable, "-c", MEMORY, str(count)], capture_output=True, text=True, check=True)
        found.append(f"{float(done.stdout):.0f}")
    yield "peak memory of an atlas of 300, 3,000 and 30,000 poses × 2,000 frequencies", f"{', '.join(found)} MB", "constant"


def atlas() -> Iterator[Row]:
    """All of them."""
    for part in (against_modes, least_and_slopes, memory):
        yield from part()
