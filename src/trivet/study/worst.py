"""The pose of a family at which a dynamic stiffness is least, sought between the points of its grid too."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.space.family import Family, Places
from trivet.space.search import lowest
from trivet.study.responses import DynamicRoll, Responses
from trivet.study.roll_policy import RollPolicy

Array = NDArray[Any]

AT_END = 1e-9
"""Distance of a frequency from an end of the range, against it, that is none."""
NEAR = 4
"""Places next to a new one whose best rolls are tried there."""


class Worst(NamedTuple):
    """The pose at which a dynamic stiffness is least."""

    entry: str
    stiffness: float
    """N/m, N, N/rad, N m/rad; infinite where H is nothing but rounding everywhere, with NaN for the rest."""
    frequency: float
    """Hz."""
    position: tuple[float, float, float]
    """m in {O}."""
    azimuth: float
    tilt: float
    roll: float
    """rad."""
    on_grid: float
    """The least at a point of the grid."""
    is_at_end: bool
    """Whether the frequency is an end of the range: a peak may lie beyond it."""


def rolled(asked: Responses, policy: RollPolicy | None, places: Places) -> Places:
    """Places with their rolls; NaN outside the family, and where the policy reaches nothing."""
    if policy is None:
        return places
    known: Array = np.all(np.isfinite(places.position), axis=1)
    rolls = np.full(len(known), np.nan)
    if known.any():
        rolls[known] = policy.choose(asked.machine, places.some(np.flatnonzero(known)).surface("family"), asked.signs)
    return places._replace(roll=rolls)


def worst(
    asked: Responses,
    policy: RollPolicy | None,
    family: Family,
    places: Places,
    on_grid: Array,
    progress: Callable[[int, int], None],
) -> Worst:
    """The worst pose along one entry.

    Args:
        asked: the responses along that entry alone.
        policy: for the roll; None where the family gives it.
        family: over what.
        places: of its grid, with their rolls.
        on_grid: (n,) least dynamic stiffness there, NaN where a pose is not reached.
        progress: called with what is done of the search, and all of it.
    """

    def value(coordinates: Array, bound: Array) -> Array:
        return asked.stiffness(rolled(asked, policy, family.places(coordinates)))[0][:, 0]

    if isinstance(policy, DynamicRoll) and policy.responses.entries == asked.entries:
        greatest = _GreatestOverRolls(policy, family, places)
        found = lowest(family, on_grid, greatest, progress)
        there = family.places(found.coordinates[None])._replace(roll=greatest.rolls_near(found.coordinates[None])[:, 0])
    else:
        found = lowest(family, on_grid, value, progress)
        there = rolled(asked, policy, family.places(found.coordinates[None]))
    return _told(asked, there, on_grid)


def worst_of_points(asked: Responses, places: Places, on_grid: Array) -> Worst:
    """The worst of the grid's own points along one entry; arguments as of `worst`."""
    return _told(asked, places.some(np.array([np.nanargmin(on_grid)])), on_grid)


def unbounded(entry: str) -> Worst:
    """Along an entry that is nothing but rounding at all points: there is no worst pose."""
    nan = float("nan")
    return Worst(entry, float("inf"), nan, (nan, nan, nan), nan, nan, nan, float("inf"), False)


def _told(asked: Responses, there: Places, on_grid: Array) -> Worst:
    stiffness, frequency = asked.stiffness(there)
    assert there.roll is not None
    x, y, z = there.position[0].tolist()
    azimuth, tilt, roll = (float(a[0]) for a in (there.azimuth, there.tilt, there.roll))
    (name,) = asked.names
    least, at = float(stiffness[0, 0]), float(frequency[0, 0])
    is_at_end = min(abs(at / asked.low - 1), abs(at / asked.high - 1)) < AT_END
    return Worst(name, least, at, (x, y, z), azimuth, tilt, roll, float(np.nanmin(on_grid)), is_at_end)


class _GreatestOverRolls:
    """The dynamic stiffness at the best roll, as a function of coordinates.

    Where it is to be less than a bound, one roll at which it is not settles the matter, and mostly the best roll of a place
    nearby is such a roll: hardly any place wants the whole search.
    """

    def __init__(self, policy: DynamicRoll, family: Family, places: Places) -> None:
        assert places.roll is not None
        known = np.isfinite(places.roll)
        self.policy, self.family = policy, family
        self.coordinates, self.rolls = family.coordinates[known], places.roll[known]

    def __call__(self, coordinates: Array, bound: Array) -> Array:
        found = self.policy.search(self.family.places(coordinates), self.rolls_near(coordinates), 1 / bound)
        stiffness: Array = 1 / found.value
        lower = stiffness < bound
        self.coordinates = np.concatenate([self.coordinates, coordinates[lower]])
        self.rolls = np.concatenate([self.rolls, found.angle[lower]])
        return stiffness

    def rolls_near(self, coordinates: Array) -> Array:
        """Best rolls (m, up to NEAR) of the places that are known, the nearest first; where one is known, its own."""
        apart = (coordinates[:, None] - self.coordinates) / self.family.spacing
        return self.rolls[np.argsort(np.square(apart).sum(axis=-1), axis=1, kind="stable")[:, :NEAR]]
