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
    function: Callable[[Array], Array],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Lowest:
    """The least value of a function over a family, sought from the lowest points of its grid (a pattern search).

    Args:
        family: over what.
        values: (n,) the function on the grid; NaN where it has no value.
        function: its values (m,) at coordinates (m, d).
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
        found = function(tried.reshape(-1, tried.shape[-1])).reshape(tried.shape[:2])
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


class LowestAngle(NamedTuple):
    """Where functions of an angle are least; NaN for a function without values."""

    angle: Array
    """(n,) rad in [0, 2 pi)."""
    value: Array
    """(n,)."""


VALLEYS = 2
"""Lowest valleys of a grid of angles that are gone down."""
FINEST_ANGLE = 1e-7
"""rad at which that ends."""


def lowest_angles(function: Callable[[Array, Array], Array], count: int, steps: int) -> LowestAngle:
    """The least values of n functions over the circle: a grid shows the valleys, the lowest are gone down (Chandrupatla).

    Where a function ends, as at a limit of a joint, the way down ends there.

    Args:
        function: values (m,) of functions by index (m,) at angles (m,), rad; NaN where it has none.
        count: how many functions.
        steps: angles of the grid; valleys narrower than 2 pi / steps can be missed.
    """
    from scipy.optimize import elementwise

    step = 2 * math.pi / steps
    which, place = (a.ravel() for a in np.indices((count, steps)))
    grid = function(which, step * place).reshape(count, steps)
    values = np.where(np.isfinite(grid), grid, np.inf)
    is_valley = (values <= np.roll(values, 1, axis=1)) & (values < np.roll(values, -1, axis=1)) & np.isfinite(values)
    # Of a grid on which all values are equal its first column serves.
    is_valley[:, 0] |= ~is_valley.any(axis=1) & np.isfinite(values[:, 0])
    ranked = np.argsort(np.where(is_valley, values, np.inf), axis=1, kind="stable")[:, :VALLEYS]
    lane, column = np.nonzero(np.take_along_axis(is_valley, ranked, axis=1))
    angle, value = np.full(count, np.nan), np.full(count, np.nan)
    if not len(lane):
        return LowestAngle(angle, value)
    middle = step * ranked[lane, column]
    # What has no value stands higher than all that has.
    wall = 2 * np.abs(np.where(np.isfinite(grid), grid, 0)).max(axis=1) + 1

    def walled(x: Array, lane: Array) -> Array:
        found = function(lane.astype(int), x)
        return np.where(np.isfinite(found), found, wall[lane.astype(int)])

    tolerances = {"xatol": FINEST_ANGLE, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0}
    found = elementwise.find_minimum(
        walled, (middle - step, middle, middle + step), args=(lane,), tolerances=tolerances, maxiter=60
    )
    # The highest first, so that the lowest stays.
    order = np.argsort(-found.f_x, kind="stable")
    angle[lane[order]], value[lane[order]] = np.mod(found.x[order], 2 * math.pi), found.f_x[order]
    return LowestAngle(angle, value)
