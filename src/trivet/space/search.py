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


LEVELS = 4
"""How often the grid is halved about its lowest points."""
KEPT = 32
"""Lowest points about which it is."""
STARTS = 6
"""Lowest points then, no two of them neighbours, from which a minimum is sought."""
NEIGHBOURS = 1.5
"""Distance in spacings of the grid up to which points are neighbours."""
FINEST = 1e-5
"""Step, against the spacing of the grid, at which the search ends."""
SHORTER, LONGER = 0.6, 3.0
"""Change of all steps after a look around that found nothing lower, and of those along what led down after one that did."""
MOST_LOOKS = 300
"""Looks around at most."""
PATIENCE = 60
"""After so many looks the lower half of the starts goes on alone."""


def lowest(
    family: Family,
    values: Array,
    function: Callable[[Array, Array], Array],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Lowest:
    """The least value of a function over a family.

    The grid is halved about its lowest points, for valleys are narrow.  From the lowest of all a pattern search goes on; its
    directions are turned at random every time, for valleys are sharp (Audet and Dennis, SIAM J. Optim. 17:188, 2006), and its
    steps grow along what led down, for valleys are long (as in Hansen and Ostermeier, Evol. Comput. 9:159, 2001).

    Args:
        family: over what.
        values: (n,) the function on the grid; NaN where it has no value.
        function: its values (m,) at coordinates (m, d), given bounds (m,): where it is not below its bound, any value that is
            not either will do.
        progress: called with the looks around that are done, and all of them, of which the last are seldom needed.
    """
    points, values = family.coordinates, np.where(np.isfinite(values), values, np.inf)
    if not np.any(np.isfinite(values)):
        return Lowest(np.full(len(family.spacing), np.nan), float("nan"))

    def look(tried: Array, bound: Array) -> Array:
        found = function(tried, bound)
        return np.where(np.isfinite(found), found, np.inf)

    around = np.stack(np.meshgrid(*[(-1, 0, 1)] * len(family.spacing), indexing="ij"), axis=-1).reshape(-1, len(family.spacing))
    around = around[np.any(around != 0, axis=1)]
    step, total = family.spacing.copy(), LEVELS + MOST_LOOKS
    for level in range(LEVELS):
        step = step / 2
        best = np.argsort(values, kind="stable")[:KEPT]
        best = best[np.isfinite(values[best])]
        tried = family.nearest((points[best, None] + around * step).reshape(-1, len(step)))
        _, first = np.unique(np.round(np.concatenate([points, tried]) / step), axis=0, return_index=True)
        tried = np.concatenate([points, tried])[first[first >= len(points)]]
        bound = np.full(len(tried), values[best[-1]] if len(best) == KEPT else np.inf)
        points, values = np.concatenate([points, tried]), np.concatenate([values, look(tried, bound)])
        progress(level + 1, total)
    here, there = _apart(points, values, family.spacing)
    found = _gone_down(family, here, there, step, around, look, lambda done: progress(LEVELS + done, total))
    progress(total, total)
    return found


def _apart(points: Array, values: Array, spacing: Array) -> tuple[Array, Array]:
    """The lowest points, no two of them neighbours, and their values."""
    starts = list[int]()
    for k in np.argsort(values, kind="stable"):
        apart = np.abs((points[k] - points[starts]) / spacing).max(axis=1, initial=0.0)
        if np.isfinite(values[k]) and len(starts) < STARTS and np.all(apart > NEIGHBOURS):
            starts.append(int(k))
    return points[starts].copy(), values[starts].copy()


def _gone_down(
    family: Family,
    here: Array,
    there: Array,
    step: Array,
    around: Array,
    look: Callable[[Array, Array], Array],
    progress: Callable[[int], None],
) -> Lowest:
    """From points (s, d) with values (s,) down to the lowest that is met."""
    random = np.random.default_rng(0)
    shape = np.tile(np.diag(step), (len(here), 1, 1))
    for done in range(MOST_LOOKS):
        likely = np.argsort(there, kind="stable")[: -(-len(there) // 2 ** (done // PATIENCE))]
        active = likely[np.any(np.abs(shape[likely]) > FINEST * family.spacing, axis=(1, 2))]
        if not len(active):
            break
        turn, _ = np.linalg.qr(random.normal(size=(len(step), len(step))))
        directions = around @ turn
        tried = family.nearest((here[active, None] + directions @ shape[active]).reshape(-1, len(step)))
        tried = tried.reshape(len(active), -1, len(step))
        found = look(tried.reshape(-1, len(step)), np.repeat(there[active], len(around))).reshape(tried.shape[:2])
        best = found.argmin(axis=1)
        lower = np.take_along_axis(found, best[:, None], 1)[:, 0]
        is_lower = lower < there[active]
        moved, way = active[is_lower], directions[best[is_lower]]
        here[moved], there[moved] = tried[is_lower, best[is_lower]], lower[is_lower]
        along = way / np.linalg.norm(way, axis=1, keepdims=True)
        shape[moved] += (LONGER - 1) * along[:, :, None] * (along[:, None] @ shape[moved])
        shape[active[~is_lower]] *= SHORTER
        progress(done + 1)
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
