"""Fronts that evolve and are polished by slopes against fronts that evolve alone, at equal wall time."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from benchmarks.kernels import Row
from trivet.design.aims import aims_of
from trivet.design.front.evolution import Evolution, evolved
from trivet.design.front.front import Front, told
from trivet.design.front.polisher import Polishing
from trivet.design.front.problem import Asked
from trivet.design.front.search import searched
from trivet.design.front.volume import compared
from trivet.design.machine_problem import MachineProblem
from trivet.design.study import study_of
from trivet.design.study_file import StudyFile
from trivet.model import load

SECONDS, SEEDS, ENDLESS = 60.0, (11, 12, 13), 100_000_000
POINTS, POPULATION = 40, 64
EVOLVING = 0.5
"""The part of its time in which what is polished evolves."""
POSES = {"steps": 10, "rolls": 360}

TUBE = {
    "of": ["sections.tube.outer_diameter", "sections.tube.inner_diameter"],
    "name": "tube",
    "choices": [["16 mm", "12 mm"], ["19 mm", "14 mm"], ["22 mm", "17 mm"], ["25 mm", "19 mm"], ["28 mm", "22 mm"]],
}


def _between(of: str, low: str, high: str) -> dict[str, Any]:
    return {"of": of, "low": low, "high": high}


_CARRIAGES = [
    _between("guide.radius", "140 mm", "180 mm"),
    _between("link.length", "190 mm", "240 mm"),
    _between("platform_joint.radius", "14 mm", "30 mm"),
    _between("guide.stiffness", "2 N/um", "4 N/um"),
    _between("platform.disc.thickness", "5 mm", "12 mm"),
    _between("platform.disc.radius", "16 mm", "24 mm"),
]

STUDIES: dict[str, dict[str, Any]] = {
    "azulay, stiffness against mass": {
        "machines": ["azulay"],
        "variables": [
            *_CARRIAGES,
            _between("workpiece.height", "90 mm", "150 mm"),
            _between("slide.stiffness", "2 N/um", "4 N/um"),
            _between("sections.tube.outer_diameter", "16 mm", "26 mm"),
            _between("sections.tube.inner_diameter", "10 mm", "15 mm"),
        ],
        "optimise": {
            "maximise": ["mean K_xx"],
            "minimise": ["mass"],
            "limits": [
                {"quantity": "greatest outer radius", "at_most": "215 mm"},
                {"quantity": "least travel margin", "at_least": 0.02},
            ],
        },
    },
    "eclipse, the softest of its check points against size, tubes from a catalogue": {
        "machines": ["eclipse"],
        "variables": [
            *_CARRIAGES,
            _between("workpiece.height", "150 mm", "250 mm"),
            _between("column.stiffness", "2 N/um", "4 N/um"),
            TUBE,
        ],
        "optimise": {
            "maximise": ["least K_xx"],
            "minimise": ["greatest outer radius"],
            "limits": [{"quantity": "mass", "at_most": "1 kg"}, {"quantity": "least travel margin", "at_least": 0.02}],
        },
    },
    "glozman, one stiffness against another, its elbow's links apart": {
        "machines": ["glozman"],
        "variables": [
            *(one for one in _CARRIAGES if one["of"] != "link.length"),
            _between("workpiece.height", "120 mm", "200 mm"),
            _between("shoulder.stiffness", "15000 N m/rad", "30000 N m/rad"),
            _between("link-1.length", "110 mm", "150 mm"),
            _between("link-2.length", "110 mm", "150 mm"),
            TUBE,
        ],
        "optimise": {
            "maximise": ["mean K_xx", "least K_zz"],
            "limits": [
                {"quantity": "mass", "at_most": "0.9 kg"},
                {"quantity": "greatest outer radius", "at_most": "180 mm"},
            ],
        },
    },
}


def _problem(described: dict[str, Any]) -> MachineProblem:
    given = TypeAdapter(StudyFile).validate_python(described | {"poses": POSES})
    asked, aims = aims_of(study_of(given, [load(name) for name in given.machines]))
    return MachineProblem(asked, 0, aims)


def _alone(problem: MachineProblem, start: np.ndarray, seed: int, seconds: float) -> tuple[Front, int]:
    """The front of NSGA-II alone, and designs looked at."""
    asked = Asked(problem, {}, POPULATION)
    how = Evolution(ENDLESS, seconds=seconds, population=POPULATION, seed=seed)
    return told(problem, evolved(asked, how, start), POINTS), asked.count


def _polished(problem: MachineProblem, start: np.ndarray, seed: int) -> Front:
    """What `trivet optimise` finds."""
    evolution = Evolution(ENDLESS, seconds=EVOLVING * SECONDS, population=POPULATION, seed=seed)
    return searched(problem, evolution, Polishing(POINTS, (1 - EVOLVING) * SECONDS), start=start)


def fronts() -> Iterator[Row]:
    """Hypervolumes in one box about both fronts, over the paper's 317 check points and 360 rolls."""
    for name, described in STUDIES.items():
        problem = _problem(described)
        start = problem.study.described_of(0)[None]
        _warm(problem, start[0])
        for seed in SEEDS:
            begun = time.monotonic()
            polished = _polished(problem, start, seed)
            took = time.monotonic() - begun  # all of it is what the other may take
            alone, count = _alone(problem, start, seed, took)
            found = compared(polished.values.objectives, alone.values.objectives)
            ours, theirs = found.volumes
            dominated = [f"{100 * share:.0f} %" for share in reversed(found.dominated)]
            yield (
                f"{name}, seed {seed}: hypervolumes of a polished front and of one of NSGA-II alone, {took:.0f} s each",
                f"{ours:.4f} against {theirs:.4f} ({count} designs); it dominates {dominated[0]} of the other's "
                f"{len(alone.designs)} points, which dominate {dominated[1]} of its {len(polished.designs)}",
                "greater",
            )


def _warm(problem: MachineProblem, design: np.ndarray) -> None:
    """Compiles all that either way calls."""
    for many in (64, 4):
        Asked(problem, {}, many)(design[None])
    model = problem.model(design)
    model.rows(design)
    model.slopes(design)
