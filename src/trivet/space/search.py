"""Least values of functions that need not be smooth, as least values over frequency and best rolls are not."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.space.family import Family

Array = NDArray[Any]


class Lowest(NamedTuple):
    """Where a function over a family is least."""

    coordinates: Array
    """(d,)."""
    value: float


STARTS = 4
"""Lowest points of a grid, no two of them neighbours, from which a minimum is sought."""
NEIGHBOURS = 1.5
"""Distance in spacings up to which points are neighbours."""
FINEST = 1e-5
"""Step, against the spacing of the grid, at which the search ends."""
MOST_MOVES = 200
"""Looks around at most: some 17 halvings, and what a path down a valley takes."""


def lowest(
    family: Family,
    values: Array,
    function: Callable[[Array, Array], Array],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Lowest:
    """The least value of a function over a family, sought from the lowest points of its grid (a pattern search).

    Args:
        family: over what.
        values: (n,) the function on the grid; NaN where it has no value.
        function: its values (m,) at coordinates (m, d), given bounds (m,): where it is not below its bound, any value that is
            not either will do.
        progress: called with the halvings of steps that are done, and of all.
    """
    values = np.where(np.isfinite(values), values, np.inf)
    starts = list[int]()
    for k in np.argsort(values, kind="stable"):
        apart = (family.coordinates[k] - family.coordinates[starts]) / family.spacing
        if np.isfinite(values[k]) and len(starts) < STARTS and np.all(np.abs(apart).max(axis=1, initial=0.0) > NEIGHBOURS):
            starts.append(int(k))
    here, there = family.coordinates[starts].copy(), values[starts].copy()
    if not starts:
        return Lowest(np.full(len(family.spacing), np.nan), float("nan"))
    around = np.stack(np.meshgrid(*[(-1, 0, 1)] * len(family.spacing), indexing="ij"), axis=-1).reshape(-1, len(family.spacing))
    around = around[np.any(around != 0, axis=1)]
    step = np.full(len(starts), 0.5)
    total = int(len(step) * math.log2(0.5 / FINEST))
    for _ in range(MOST_MOVES):
        (active,) = np.nonzero(step > FINEST)
        if not len(active):
            break
        tried = here[active, None] + step[active, None, None] * around * family.spacing
        bounds = np.repeat(there[active], len(around))
        found = function(tried.reshape(-1, tried.shape[-1]), bounds).reshape(tried.shape[:2])
        found = np.where(np.isfinite(found), found, np.inf)
        best = found.argmin(axis=1)
        lower = np.take_along_axis(found, best[:, None], 1)[:, 0]
        is_lower = lower < there[active]
        moved = active[is_lower]
        here[moved], there[moved] = tried[is_lower, best[is_lower]], lower[is_lower]
        step[active[~is_lower]] /= 2
        progress(int(np.log2(0.5 / np.maximum(step, FINEST)).sum()), total)
    first = int(np.argmin(there))
    return Lowest(here[first], float(there[first]))


VALLEYS = 4
"""Lowest valleys of a grid of angles that are gone down."""
FINEST_ANGLE = 1e-7
"""rad at which that ends."""


class LowestAngles(NamedTuple):
    """Where functions of an angle are least; NaN for a function without values."""

    angle: Array
    """(n,) rad, from zero to the period."""
    value: Array
    """(n,)."""


def lowest_angles(
    function: Callable[[Array, Array], Array],
    count: int,
    steps: int,
    *,
    period: float = 2 * math.pi,
    tried: Array | None = None,
    enough: Array | None = None,
) -> LowestAngles:
    """The least values of n functions of an angle: a grid shows the valleys, the lowest are gone down (Chandrupatla).

    Where a function ends, as at a limit of a joint, the way down ends there.

    Args:
        function: values (m,) of functions by index (m,) at angles (m,), rad; NaN where it has none.
        count: how many functions.
        steps: angles of the grid; valleys narrower than period / steps can be missed.
        period: after which the functions repeat themselves, rad.
        tried: (n, t) angles to try before the grid.
        enough: (n,) value at which, or below which, the search for a function may end.
    """
    found = LowestAngles(np.full(count, np.nan), np.full(count, np.inf))
    enough = np.full(count, -np.inf) if enough is None else enough

    def left() -> Array:
        return np.flatnonzero(~(found.value <= enough))

    def look(which: Array, angle: Array) -> Array:
        """Values (m, a) of functions (m,) at angles (m, a)."""
        values = function(np.repeat(which, angle.shape[1]), angle.ravel()).reshape(angle.shape)
        values = np.where(np.isfinite(values), values, np.inf)
        keep(which, np.take_along_axis(angle, values.argmin(axis=1)[:, None], 1)[:, 0], values.min(axis=1))
        return values

    def keep(which: Array, angle: Array, value: Array) -> None:
        """What is lower than before."""
        # The highest first, so that the lowest stays where a function comes twice.
        order = np.argsort(-value, kind="stable")
        order = order[value[order] < found.value[which[order]]]
        found.angle[which[order]], found.value[which[order]] = np.mod(angle[order], period), value[order]

    if tried is not None:
        look(np.arange(count), tried)
    which, step = left(), period / steps
    if len(which):
        values = look(which, np.tile(step * np.arange(steps), (len(which), 1)))
        open_still = np.isin(which, left())
        keep(*_descended(function, which[open_still], values[open_still], step))
    return LowestAngles(found.angle, np.where(np.isfinite(found.value), found.value, np.nan))


def _descended(
    function: Callable[[Array, Array], Array], which: Array, values: Array, step: float
) -> tuple[Array, Array, Array]:
    """Functions, angles and values (b,): the bottoms of the lowest valleys of a closed grid (m, steps); infinite for none."""
    from scipy.optimize import elementwise

    is_valley = (values <= np.roll(values, 1, axis=1)) & (values < np.roll(values, -1, axis=1)) & np.isfinite(values)
    ranked = np.argsort(np.where(is_valley, values, np.inf), axis=1, kind="stable")[:, :VALLEYS]
    row, order = np.nonzero(np.take_along_axis(is_valley, ranked, axis=1))
    if not len(row):
        return which[row], np.zeros(0), np.zeros(0)
    # What has no value stands higher than all that has.
    wall = 2 * np.abs(np.where(np.isfinite(values), values, 0)).max(axis=1) + 1

    def walled(x: Array, row: Array) -> Array:
        own = row.astype(int)
        found = function(which[own], x)
        return np.where(np.isfinite(found), found, wall[own])

    middle = step * ranked[row, order]
    tolerances = {"xatol": FINEST_ANGLE, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0}
    bracket = middle - step, middle, middle + step
    bottom = elementwise.find_minimum(walled, bracket, args=(row,), tolerances=tolerances, maxiter=60)
    return which[row], bottom.x, bottom.f_x
