"""Sweeps over designs against the same written by hand."""

from __future__ import annotations

import dataclasses
import multiprocessing
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import loop
from benchmarks.kernels import Row, quartiles
from benchmarks.pairs import paired
from trivet.design.evaluation import Evaluation
from trivet.design.study import Study, study_of
from trivet.design.study_file import GivenPoses, GivenSweep, GivenVariable, StudyFile
from trivet.model import Machine, load
from trivet.study.stiffness_map import surface_of

ROLLS, DESIGNS = 360, 512
RANGES = {"link.length": (0.206, 0.224), "guide.radius": (0.155, 0.17), "guide.stiffness": (2e6, 4e6)}
CORES = os.cpu_count() or 1


def study(quantities: list[str], count: int, free: bool = True, chunk: int | None = None) -> Study:
    """The paper's machine of which three numbers vary."""
    variables = [
        GivenVariable(of=path, low=f"{low} {unit}", high=f"{high} {unit}")
        for (path, (low, high)), unit in zip(RANGES.items(), ("m", "m", "N/m"), strict=True)
    ]
    given = StudyFile(
        machines=["azulay"], variables=variables, quantities=quantities, poses=GivenPoses(rolls=ROLLS),
        sweep=GivenSweep(count=count, chunk=chunk),
    )  # fmt: skip
    return study_of(given, [load("azulay").with_spherical("free" if free else "clamped")])


def designs(count: int) -> np.ndarray:
    points = np.random.default_rng(0).random((count, len(RANGES)))
    low, high = np.array(list(RANGES.values())).T
    return low + points * (high - low)


# The peer: one process per core, each with the loop on one core.

_GUIDE, _LENGTH, _BY_GUIDE = 9, 10, 11
"""Where the three numbers stand among what the loop takes: radius, length, compliance."""
_worker: dict[str, Any] = {}


def _begin(clamped: bool) -> None:
    machine = load("azulay")
    _worker["call"] = loop.make(clamped, parallel=False)
    _worker["given"] = list(_arguments(machine))
    _mean(designs(1)[0])


def _arguments(machine: Machine) -> tuple[Any, ...]:
    return loop.arguments(machine, surface_of(machine), ROLLS)


def _changed(given: list[Any], design: np.ndarray) -> list[Any]:
    given = list(given)
    given[_LENGTH], given[_GUIDE], given[_BY_GUIDE] = design[0], design[1], 1 / design[2]
    return given


def _mean(design: np.ndarray) -> float:
    found = _worker["call"](*_changed(_worker["given"], design))
    return float(found[found >= 0].mean())


def by_numpy(given: list[Any], design: np.ndarray) -> float:
    """The same in plain NumPy, ball joints free: all poses of a design at once."""
    (x, y, z, azimuth, tilt, c, s, ax, ay, foot, length, by_guide, by_slide, by_area, by_inertia, by_torsion, low, high,
     sine_low, sine_high) = _changed(given, design)  # fmt: skip
    ca, sa, cb, sb = (f(a)[:, None] for a in (azimuth, tilt) for f in (np.cos, np.sin))
    ux, uy, uz = ca * cb * c - sa * s, sa * cb * c + ca * s, -sb * c
    vx, vy, vz = -ca * cb * s - sa * c, -sa * cb * s + ca * c, sb * s
    total, inside = 0.0, True
    for k in range(3):
        px = x[:, None] + ax[k] * ux + ay[k] * vx
        py = y[:, None] + ax[k] * uy + ay[k] * vy
        pz = z[:, None] + ax[k] * uz + ay[k] * vz
        square = px * px + py * py
        sine = pz / length
        cosine = np.sqrt(1 - sine * sine)
        b = np.sqrt(square) + length * cosine - foot
        inside = inside & (b >= low) & (b <= high) & (sine >= sine_low) & (sine <= sine_high)
        arm, bend, twist = length * cosine, b * by_inertia, b * by_torsion
        end, slope = b * b * bend / 3, b * bend / 2
        along = length * by_area + cosine * cosine * (by_slide + b * by_area) + end * sine * sine
        across = by_guide + length**3 * by_inertia / 3 + end - 2 * slope * arm + bend * arm * arm + twist * pz * pz
        total = total + py * py / square / across + cosine * cosine * px * px / square / along
    best = np.where(inside, total, -1.0).max(axis=1)
    return float(best[best >= 0].mean())


def sweep_of_designs() -> Iterator[Row]:
    """Mean best-roll K_xx over 317 x 360 poses of many designs."""
    some = designs(DESIGNS)
    for free in (True, False):
        ours, given = Evaluation(study(["mean K_xx"], DESIGNS, free)), list(_arguments(load("azulay")))
        with multiprocessing.get_context("spawn").Pool(CORES, _begin, (not free,)) as pool:
            theirs = np.array(pool.map(_mean, some, chunksize=16))
            assert np.allclose(ours(some).values[:, 0], theirs, rtol=1e-11), "the same numbers"
            found = paired(lambda: ours(some), lambda: pool.map(_mean, some, chunksize=16), pairs=11, calls=2)  # noqa: B023
        balls = "free" if free else "clamped"
        rate, their = (DESIGNS / np.median(times) for times in (found.ours, found.peer))
        yield (
            f"sweep, mean best-roll K_xx over 317 × 360 poses, ball joints {balls}: ratio to numba on {CORES} processes",
            f"{quartiles(found)}; {rate:.0f} against {their:.0f} designs/s; a third of the rolls looked at, by symmetry",
            "≥ 1.0",
        )
        every = Evaluation(_without_symmetry(study(["mean K_xx"], DESIGNS, free)))
        with multiprocessing.get_context("spawn").Pool(CORES, _begin, (not free,)) as pool:
            found = paired(lambda: every(some), lambda: pool.map(_mean, some, chunksize=16), pairs=11, calls=2)  # noqa: B023
        yield f"the same, ball joints {balls}, all rolls looked at", f"{quartiles(found)}", "≥ 1.0"
        if free:
            few = some[:8]
            assert np.allclose(ours(some).values[:8, 0], [by_numpy(given, one) for one in few], rtol=1e-11), "the same numbers"
            plain = paired(lambda: ours(some), lambda: [by_numpy(given, one) for one in few], pairs=5, calls=1)  # noqa: B023
            ratio = plain.ratio[0] * DESIGNS / len(few)
            yield f"the same, ball joints {balls}: ratio to plain NumPy in one process", f"{ratio:.0f}", ""
    yield from _whole_sweeps()


def _without_symmetry(asked: Study) -> Study:
    """A study that looks all round, whatever the machine looks like after a part of a turn."""
    subjects = tuple(one._replace(points=one.points._replace(symmetry=1)) for one in asked.subjects)
    return dataclasses.replace(asked, subjects=subjects)


def _whole_sweeps() -> Iterator[Row]:
    """Time and memory of whole sweeps into a store, at ever more designs."""
    import resource

    from trivet.design.sweep import sweep

    with tempfile.TemporaryDirectory() as folder:
        sweep(study(["home K_xx", "mass"], 10), Path(folder) / "warm.zarr")
        sweep(study(["mean K_xx"], 16), Path(folder) / "warm-map.zarr")
        begun = time.perf_counter()
        sweep(study(["mean K_xx"], 20_000), Path(folder) / "map.zarr")
        rate = 20_000 / (time.perf_counter() - begun)
        yield "sweep of 2e+04 designs, mean best-roll K_xx, into a store, all that it does", f"{rate:.0f} designs/s", ""
        for count in (1_000, 10_000, 100_000, 1_000_000, 10_000_000):
            begun = time.perf_counter()
            sweep(study(["home K_xx", "mass"], count), Path(folder) / f"{count}.zarr")
            took, peak = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            yield (
                f"sweep of {count:.0e} designs at home into a store",
                f"{took:.2f} s; peak so far {peak:.0f} MiB",
                "linear, constant",
            )
