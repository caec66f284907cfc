"""Poles of symmetric machines that are one pole twice: told from close ones by what the measurement can tell.

Where two poles coincide their shapes are any two of a plane, and so are their participation vectors: each alone has no meaning,
and the two poles that a free fit finds are the eigenvalues of a random matrix about the true one, which repel each other.  Such
a pair is fitted as one pole with a plane of shapes.  Whether it may be is asked by a score test (Rao, Proc. Cambridge Phil.
Soc. 44 (1948) 50): of the directions in which the poles of the plane would come apart, D in psi (s - lambda - D)^-1 l^T
without its trace, none may pull more than noise does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from trivet.measure.modal.maximum_likelihood import Refined, covariance, directions, information, refine
from trivet.measure.modal.residues import Band, Modes

LEVEL = 0.01
"""Of the test: one double pole in a hundred is taken for two poles."""
NEAR = 8.0
"""Standard deviations within which two poles are asked whether they are one."""
NARROW = 0.1
"""Or this part of the half bandwidth."""
PARALLEL = 1e-3
"""Sine of the angle of participation vectors below which a pair is not a plane."""
ROUNDING = 1e-9


class Apart(NamedTuple):
    """How far the poles of a group come apart when they are let."""

    chance: float
    """Probability of such a pull or more where they are one."""
    split: float
    """rad/s: greatest distance of two poles after a step."""


def apart(band: Band, at: Refined, members: np.ndarray) -> Apart:
    """The test of one group, at its best fit."""
    found = information(band, at, directions(at.modes, at.shapes, members))
    count, size = len(members), found.matrix.shape[0] // 2
    step = found.step()
    chance = float(chi2.sf(2 * step @ found.pull, 2 * (count**2 - 1)))
    free = (step[:size] + 1j * step[size:])[size - count**2 + 1 :]
    moved = np.append(free, 0).reshape(count, count)
    moved[-1, -1] = -np.trace(moved)
    roots = np.linalg.eigvals(moved)
    return Apart(chance, float(np.max(np.abs(roots[:, None] - roots))))


def joined(band: Band, at: Refined) -> Refined:
    """The same fit with poles made one where the measurement cannot tell them apart, the nearest first."""
    while True:
        for k, other in _near(band, at):
            tried = refine(band, _as_one(at.modes, k, other), at.weight)
            members = tried.modes.groups[k]
            told = apart(band, tried, members)
            if told.chance >= LEVEL or told.split <= ROUNDING * abs(tried.modes.poles[members[0]]):
                at = tried
                break
        else:
            return at


def _as_one(modes: Modes, k: int, other: int) -> Modes:
    """Modes with two groups, k below the other, made one; its number is k."""
    group = np.where(modes.group == other, k, modes.group)
    poles = np.where(group == k, modes.poles[group == k].mean(), modes.poles)
    return Modes(poles, modes.participation, np.unique(group, return_inverse=True)[1]).orthonormal()


def _near(band: Band, at: Refined) -> list[tuple[int, int]]:
    """Pairs of groups that may be one, the nearest first."""
    groups = at.modes.groups
    poles = np.array([at.modes.poles[members[0]] for members in groups])
    spread = np.diag(covariance(information(band, at, directions(at.modes, at.shapes))))
    half = len(spread) // 2
    deviation = np.sqrt(np.maximum(spread[: len(groups)] + spread[half : half + len(groups)], 0))
    inside = (np.abs(poles) >= band.omega[0]) & (np.abs(poles) <= band.omega[-1])
    found = []
    for k in range(len(groups)):
        for other in range(k + 1, len(groups)):
            distance = abs(poles[k] - poles[other])
            reach = max(NEAR * np.hypot(deviation[k], deviation[other]), NARROW * -min(poles[k].real, poles[other].real))
            vectors = at.modes.participation[:, np.append(groups[k], groups[other])]
            if not (inside[k] and inside[other]) or distance > reach or vectors.shape[1] > len(vectors):
                continue
            if np.linalg.svd(vectors, compute_uv=False)[-1] > PARALLEL:
                found.append((distance, k, other))
    return [(k, other) for _, k, other in sorted(found)]
