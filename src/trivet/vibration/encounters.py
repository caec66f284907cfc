"""Where branches of modes meet: they cross, touch, or veer away from each other and exchange their shapes.

Two modes that are coupled do not come to one frequency when a parameter changes: they veer (A. W. Leissa, ZAMP 25:99, 1974;
N. C. Perkins and C. D. Mote, J. Sound Vib. 106:451, 1986), and while they do each takes the shape of the other.  With a
constant coupling, and squares of frequencies that would go straight without it, the square of their difference is a parabola.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Literal, NamedTuple

import numpy as np

EXCHANGED = math.radians(45.0)
"""Turn of two shapes into each other from which on two branches are said to veer; 90 deg is a whole exchange."""


class Encounter(NamedTuple):
    """Two branches where they are nearest."""

    kind: Literal["cross", "touch", "veer"]
    place: float
    first: int
    """Number of the branch."""
    second: int
    frequency: float
    """In their middle, Hz."""
    gap: float
    """Between them, Hz."""
    exchange: float
    """By which angle they turn into each other there, rad; zero where they cross or touch."""


@dataclass(frozen=True)
class Pace:
    """What becomes of modes in one step."""

    branch: np.ndarray
    """(r,) those that go on."""
    mac: np.ndarray
    """(r,)."""
    cosines: np.ndarray
    """(r, r): inner products of the modes before (rows) and after."""

    def angles(self, names: np.ndarray) -> np.ndarray:
        """(k, k): by how much (rad) a branch turns into another one, of k branches; zero for those that do not go on."""
        own = np.diag(self.cosines)
        turned = np.arctan2((self.cosines - self.cosines.T) / 2, (own[:, None] + own) / 2)
        found = np.zeros((len(names), len(names)))
        _, to, of = np.intersect1d(names, self.branch, return_indices=True)
        found[np.ix_(to, to)] = turned[np.ix_(of, of)]
        return found


def encounters(place: np.ndarray, frequency: np.ndarray, run: np.ndarray, angles: Sequence[np.ndarray]) -> list[Encounter]:
    """Encounters of k branches, by place.

    Args:
        place: (f,) rising.
        frequency: (f, k) Hz; NaN where there is none.
        run: (f, k): the same number at a place for branches that coincide there.
        angles: per step (k, k): by how much branches turn into one another, rad.
    """
    turned = np.array(angles)
    found: list[Encounter] = []
    for first, second in combinations(range(frequency.shape[1]), 2):
        both = np.flatnonzero(np.isfinite(frequency[:, first] + frequency[:, second]))
        # A branch that is lost for a while goes on as another one: what is left is without gaps.
        if len(both) < 2:
            continue
        part = slice(int(both[0]), int(both[-1]) + 1)
        steps = turned[part.start : part.stop - 1, first, second]
        pair = _Pair(first, second, place[part], frequency[part, first], frequency[part, second])
        together = run[part, first] == run[part, second]
        found += _meetings(pair, together) + _veerings(pair, together, steps)
    return sorted(found)


class _Pair(NamedTuple):
    first: int
    second: int
    place: np.ndarray
    one: np.ndarray
    other: np.ndarray

    def at(self, kind: Literal["cross", "touch", "veer"], place: float, gap: float, exchange: float) -> Encounter:
        """An encounter; the gap is one of the squares of frequencies, Hz^2."""
        middle = float(np.interp(place, self.place, (self.one + self.other) / 2))
        return Encounter(kind, place, self.first, self.second, middle, gap / (2 * middle), exchange)


def _meetings(pair: _Pair, together: np.ndarray) -> list[Encounter]:
    """Where two branches come to one frequency: they change places there, or come back."""
    order = np.where(together, 0.0, np.sign(pair.one - pair.other))
    apart = np.flatnonzero(order)
    found = []
    for before, after in pairwise(apart):
        crosses = order[before] != order[after]
        if not crosses and after == before + 1:
            continue
        if after > before + 1:
            place = (pair.place[before + 1] + pair.place[after - 1]) / 2
        else:
            gaps = pair.one[[before, after]] - pair.other[[before, after]]
            place = pair.place[before] + gaps[0] / (gaps[0] - gaps[1]) * (pair.place[after] - pair.place[before])
        found.append(pair.at("cross" if crosses else "touch", float(place), 0.0, 0.0))
    return found


def _veerings(pair: _Pair, together: np.ndarray, steps: np.ndarray) -> list[Encounter]:
    """Where two branches come near each other, exchange their shapes and go apart."""
    gap = np.where(together, 0.0, np.abs(pair.one**2 - pair.other**2))
    inner = gap[1:-1]
    lowest = np.flatnonzero((inner < gap[:-2]) & (inner <= gap[2:]) & (inner > 0)) + 1
    widest = np.flatnonzero((inner >= gap[:-2]) & (inner > gap[2:])) + 1
    order = np.sign(pair.one - pair.other)
    found = []
    for k in lowest:
        if order[k - 1] != order[k] or order[k] != order[k + 1]:
            continue
        start = max([0, *widest[widest < k]])
        end = min([len(gap) - 1, *widest[widest > k]])
        exchange = abs(float(np.sum(steps[start:end])))
        if exchange >= EXCHANGED:
            found.append(pair.at("veer", *_least(pair.place[k - 1 : k + 2], gap[k - 1 : k + 2]), exchange))
    return found


def _least(place: np.ndarray, gap: np.ndarray) -> tuple[float, float]:
    """Place and value of the least gap, from three of which the middle one is the least: its square is a parabola."""
    curve = np.polynomial.Polynomial.fit(place, gap**2, 2)
    at = float(np.clip(curve.deriv().roots()[0].real, place[0], place[-1]))
    square = float(curve(at))
    return (at, math.sqrt(square)) if 0 < square <= gap[1] ** 2 else (float(place[1]), float(gap[1]))
