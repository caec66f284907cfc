"""Modes in words: what the platform does, which parts yield, how much of the machine's mass takes part."""

from __future__ import annotations

import dataclasses
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from trivet.statics.objective import AXES
from trivet.study.modes import ModesReport, PartShare

DOUBLE = 1e-6
"""Relative difference of frequencies below which modes are as good as any mixture of them."""
NAMED = 0.1
"""Components of a motion that reach this share of the largest are named."""
HARDLY = 0.02
"""Motion of the platform, against the largest anywhere, below which it hardly moves."""
NOISE = 1e-6
"""Motion of the platform, against the largest anywhere, that is rounding."""
MORE = 2
"""Modes to work out beyond those that are told, so that double and triple ones are whole when they are turned."""
LEFT = 1e-3
"""Share of a motion below which nothing is left to turn a mode to."""


class ModeSummary(NamedTuple):
    """One mode in short."""

    number: int
    """From 1."""
    frequency: float
    """Hz."""
    motion: str
    """Motion of the platform, "x with ry", rotations made comparable by the mean radius of the platform joints."""
    yielding: tuple[PartShare, ...]
    """The three parts with the greatest shares of the strain energy."""
    mass_fraction: tuple[float, float, float]
    """Effective mass along x, y and z over the mass that vibrates."""


def summaries(report: ModesReport) -> list[ModeSummary]:
    """Every mode in short."""
    moved, most = comparable(report), largest(report)
    fractions = report.effective_mass[:3] / total_mass(report)
    return [
        ModeSummary(
            k + 1,
            float(report.frequency[k]),
            motion_words(moved[:, k], float(most[k])),
            tuple(sorted(report.shares[k], key=lambda s: (-round(s.share, 6), s.part))[:3]),
            (float(fractions[0, k]), float(fractions[1, k]), float(fractions[2, k])),
        )
        for k in range(len(report.frequency))
    ]


def motion_words(moved: np.ndarray, most: float) -> str:
    """A motion of the platform in words.

    Args:
        moved: (6,) along and, times a length, about x, y, z.
        most: the largest displacement anywhere.
    """
    sizes = np.abs(moved)
    if sizes.max() < HARDLY * most:
        return "hardly moves"
    first, *others = sorted(range(6), key=lambda k: -sizes[k])
    named = [AXES[k] for k in others if sizes[k] >= NAMED * sizes[first]]
    return f"{AXES[first]} with {', '.join(named)}" if named else AXES[first]


def comparable(report: ModesReport) -> np.ndarray:
    """(6, m): twists of the platform, rotations times the mean radius of the platform joints."""
    length = report.modes.structure.scale
    scaled: np.ndarray = report.platform * np.repeat([1.0, length], 3)[:, None]
    return scaled


def largest(report: ModesReport) -> np.ndarray:
    """(m,): the largest displacement of any node."""
    sizes: np.ndarray = np.linalg.norm(report.modes.displacements[:, :3], axis=1).max(axis=0)
    return sizes


def total_mass(report: ModesReport) -> float:
    """Mass that vibrates, kg, what stands on the ground included; of the rods of slides what is out."""
    mesh = report.modes.mesh
    along = np.zeros(mesh.inertia.shape[0])
    along[: 6 * len(mesh.structure.nodes) : 6] = 1.0
    return float(along @ (mesh.inertia @ along))


def aligned(report: ModesReport, count: int | None = None) -> ModesReport:
    """The same modes, but double ones turned so that the first moves the platform along x (y, z, …) and the others do not.

    Only the first `count` are kept: of a report on `MORE` modes than those, where one of the last may lack its twin.

    Where frequencies coincide any mixture of the modes is a mode, and rounding chooses one; a machine of threefold symmetry has
    most of its modes in such pairs.  The sign of a mode, just as arbitrary, makes its largest motion of the platform positive.
    """
    shapes = report.modes.shapes.copy()
    moved, most = comparable(report), largest(report)
    for group in _coinciding(report.modes.mesh_frequency):
        turn = _along_axes(moved[:, group], NOISE * float(most[group].max()))
        shapes[:, group], moved[:, group] = shapes[:, group] @ turn, moved[:, group] @ turn
    shapes *= np.where(moved[np.argmax(np.abs(moved), axis=0), np.arange(moved.shape[1])] < 0, -1.0, 1.0)
    kept = report.modes.mesh_frequency[:count]
    return ModesReport(report.at, dataclasses.replace(report.modes, mesh_frequency=kept, shapes=shapes[:, :count]))


def _coinciding(frequency: np.ndarray) -> list[slice]:
    """Runs of frequencies that are alike."""
    apart = np.flatnonzero(np.diff(frequency) > DOUBLE * frequency[1:]) + 1
    ends = [0, *(int(k) for k in apart), len(frequency)]
    return [slice(a, b) for a, b in pairwise(ends)]


def _along_axes(moved: np.ndarray, noise: float) -> np.ndarray:
    """(g, g) orthogonal: turns g mixtures with motions (6, g) so that each in turn has all that is left along some axis."""
    size, rest_as_it_is = np.linalg.norm(moved), np.eye(moved.shape[1])
    rows = np.concatenate([moved / size, rest_as_it_is]) if size > noise else rest_as_it_is
    chosen: list[np.ndarray] = []
    for row in rows:
        left = row - sum((row @ q) * q for q in chosen)
        if np.linalg.norm(left) > LEFT:
            chosen.append(left / np.linalg.norm(left))
    return np.array(chosen).T
