"""Which poles are those of the structure: they come back in models of every order, those that only noise asks for do not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from trivet.measure.modal.least_squares_complex import OrderPoles

IN_FREQUENCY, IN_DAMPING = 0.01, 0.2
"""A pole is that of the order below within these relative differences of frequency and damping."""
IN_VECTOR = 0.9
"""Least square of the part of a participation vector that lies in the space of those of the order below."""
HEAVY = 0.2
"""Damping ratio from which a pole is that of no mode."""
PRESENCE = 0.35
"""Least part of the upper half of the orders in which a mode is stable."""
LINKED, CLOSE = 0.25, 2e-4
"""Poles of two orders are of one cluster within this part of their half bandwidth and this part of their frequency."""


@dataclass(frozen=True)
class Stabilisation:
    """Poles of all orders, stable in time and near the band."""

    order: np.ndarray
    """(c,)"""
    poles: np.ndarray
    """(c,) rad/s"""
    participation: np.ndarray
    """(c, i) unit vectors"""
    in_frequency: np.ndarray
    """(c,) whether the frequency is that of a pole of the order below, each taken once."""
    in_damping: np.ndarray
    """(c,) whether the damping is, too."""
    in_vector: np.ndarray
    """(c,) whether the participation vector lies in the space of those near, too; as it always does with one reference."""

    @property
    def frequency(self) -> np.ndarray:
        """(c,) Hz, undamped."""
        found: np.ndarray = np.abs(self.poles) / (2 * math.pi)
        return found

    @property
    def damping(self) -> np.ndarray:
        """(c,) ratio"""
        found: np.ndarray = -self.poles.real / np.abs(self.poles)
        return found

    @property
    def stable(self) -> np.ndarray:
        """(c,) in all."""
        found: np.ndarray = self.in_frequency & self.in_damping & self.in_vector
        return found


class Chosen(NamedTuple):
    """Poles that were chosen, each a different one."""

    poles: np.ndarray
    """(R,) rad/s"""
    participation: np.ndarray
    """(i, R)"""


def stabilisation(found: Sequence[OrderPoles], low: float, high: float) -> Stabilisation:
    """The diagram of poles of rising orders with frequencies (rad/s) between two."""
    kept, flags = [], []
    below: OrderPoles | None = None
    for one in found:
        size = np.abs(one.poles)
        good = (one.poles.real < 0) & (-one.poles.real < HEAVY * size) & (one.poles.imag > 0)
        good &= (size >= low) & (size <= high)
        level = OrderPoles(one.order, one.poles[good], one.participation[good])
        kept.append(level)
        flags.append(_compared(level, below))
        below = level
    references = found[0].participation.shape[1] if found else 1
    marks = np.concatenate([np.zeros((0, 3), dtype=bool), *flags])
    return Stabilisation(
        np.concatenate([np.zeros(0, dtype=int), *(np.full(len(one.poles), one.order) for one in kept)]),
        np.concatenate([np.zeros(0, dtype=complex), *(one.poles for one in kept)]),
        np.concatenate([np.zeros((0, references), dtype=complex), *(one.participation for one in kept)]),
        marks[:, 0],
        marks[:, 1],
        marks[:, 2],
    )


def _compared(level: OrderPoles, below: OrderPoles | None) -> np.ndarray:
    """(r, 3) whether poles are those of the order below in frequency, damping and participation; no pole is taken twice."""
    marks = np.zeros((len(level.poles), 3), dtype=bool)
    if below is None or not len(below.poles) or not len(level.poles):
        return marks
    size, other = np.abs(level.poles), np.abs(below.poles)
    apart = np.abs(level.poles[:, None] - below.poles) / size[:, None]
    own, theirs = linear_sum_assignment(np.minimum(apart, 1.0))
    marks[own, 0] = np.abs(size[own] - other[theirs]) <= IN_FREQUENCY * size[own]
    before, after = below.poles.real[theirs] / other[theirs], level.poles.real[own] / size[own]
    marks[own, 1] = marks[own, 0] & (np.abs(before - after) <= IN_DAMPING * np.abs(after))
    near = np.abs(size[:, None] - other) <= IN_FREQUENCY * size[:, None]
    for k in np.flatnonzero(marks[:, 1]):
        space = _space(below.participation[near[k]])
        marks[k, 2] = np.linalg.norm(space.conj().T @ level.participation[k]) ** 2 >= IN_VECTOR
    return marks


def _space(vectors: np.ndarray) -> np.ndarray:
    """(i, m) orthonormal basis of unit vectors (k, i), without directions in which they hardly differ."""
    left, values, _ = np.linalg.svd(vectors.T, full_matrices=False)
    return left[:, values > 0.1 * values[0]]


def automatic(diagram: Stabilisation) -> Chosen:
    """Poles that are stable in enough orders.

    Stable poles are gathered into clusters; a cluster has as many modes as it has poles per order, so that pairs come out as
    two.  They are taken from the order whose poles lie nearest to the middle of the cluster.
    """
    stable = np.flatnonzero(diagram.stable)
    half = diagram.order > diagram.order.max(initial=0) / 2
    orders = max(1, len(np.unique(diagram.order[half])))
    kept: list[int] = []
    for members in _clusters(diagram, stable):
        upper = members[half[members]]
        levels, counts = np.unique(diagram.order[upper], return_counts=True)
        if len(levels) < max(2, PRESENCE * orders):
            continue
        count = int(np.median(counts))
        kept += _representative(diagram, upper, levels[counts == count] if count in counts else levels)
    return _chosen(diagram, kept)


def _clusters(diagram: Stabilisation, stable: np.ndarray) -> list[np.ndarray]:
    """Stable poles in chains whose links are short."""
    poles = diagram.poles[stable]
    order = np.argsort(np.abs(poles))
    names = np.arange(len(poles))
    size = np.abs(poles)
    for at, k in enumerate(order):
        for j in order[at + 1 :]:
            if size[j] - size[k] > IN_FREQUENCY * size[k]:
                break
            reach = LINKED * -min(poles[k].real, poles[j].real) + CLOSE * size[k]
            if abs(poles[j] - poles[k]) <= reach and names[j] != names[k]:
                names[names == names[j]] = names[k]
    return [stable[names == name] for name in dict.fromkeys(names[order].tolist())]


def _representative(diagram: Stabilisation, members: np.ndarray, levels: np.ndarray) -> list[int]:
    """Those of a cluster in one order."""
    middle = np.median(diagram.poles[members].real) + 1j * np.median(diagram.poles[members].imag)
    sets = [members[diagram.order[members] == level] for level in levels]
    return min(sets, key=lambda one: float(abs(diagram.poles[one].mean() - middle))).tolist()


def _chosen(diagram: Stabilisation, kept: Sequence[int]) -> Chosen:
    order = sorted(kept, key=lambda k: abs(diagram.poles[k]))
    return Chosen(diagram.poles[order], diagram.participation[order].T)


def nearest(diagram: Stabilisation, wanted: Sequence[float]) -> Chosen:
    """The stable poles nearest to frequencies (Hz): a frequency that is given twice takes two.

    All are taken from one order, in which each is a pole of its own; the highest of those that fit best.
    """
    best: tuple[float, list[int]] = (math.inf, [])
    for level in np.unique(diagram.order)[::-1]:
        members = np.flatnonzero((diagram.order == level) & diagram.stable)
        if len(members) < len(wanted):
            continue
        apart = np.abs(diagram.frequency[members] - np.asarray(wanted)[:, None]) / np.asarray(wanted)[:, None]
        rows, columns = linear_sum_assignment(apart)
        worst = float(np.max(apart[rows, columns]))
        if worst < 0.9 * best[0]:
            best = worst, [int(members[k]) for k in columns]
    return _chosen(diagram, best[1])
