"""Continuous families of poses with one, two or three coordinates: along a path, over a surface, in a block; a grid in each.

A family says where the platform is for any coordinates, so that what a grid of poses shows can be sought further between them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.space.surface import MOST_POINTS, Surface, hemisphere

Array = NDArray[Any]

WITHIN = 1e-9
"""Distance beyond the edge of a family, against its size, that is rounding."""


class Places(NamedTuple):
    """Where the platform is, m of them; NaN outside the family."""

    position: Array
    """(m, 3) in {O}, m."""
    azimuth: Array
    """(m,) rad."""
    tilt: Array
    """(m,) rad."""
    roll: Array | None
    """(m,) rad; None where it is free."""

    def surface(self, name: str) -> Surface:
        """The places as check points, their rolls left out."""
        return Surface(name, self.position, self.azimuth, self.tilt)


@dataclass(frozen=True)
class Family:
    """A continuous family of poses."""

    name: str
    coordinates: Array
    """(n, d) those of the grid."""
    spacing: Array
    """(d,) distance between neighbours of the grid along each coordinate."""
    places: Callable[[Array], Places]
    """Where the platform is for coordinates (m, d)."""

    def __len__(self) -> int:
        return len(self.coordinates)


def over_hemisphere(height: float, radius: float, steps: int = 10) -> Family:
    """The upper hemisphere about (0, 0, height), the platform tangent to it; coordinates x and y, m.

    The grid is that of `hemisphere`, arguments and errors are as there.
    """
    points = hemisphere(height, radius, steps)

    def places(coordinates: Array) -> Places:
        flat = np.hypot(*coordinates.T)
        part = np.where(flat <= radius * (1 + WITHIN), np.minimum(flat / radius, 1), np.nan)
        rise = np.sqrt(1 - part * part)
        position = np.where(np.isfinite(part)[:, None], np.column_stack([coordinates, height + radius * rise]), np.nan)
        azimuth = np.arctan2(coordinates[:, 1], coordinates[:, 0])
        return Places(position, azimuth, np.arctan2(part, rise), None)

    return Family(points.name, points.position[:, :2], np.full(2, radius / steps), places)


def in_block(
    centre: tuple[float, float, float],
    size: tuple[float, float, float],
    steps: tuple[int, int, int],
    azimuth: float = 0.0,
    tilt: float = 0.0,
) -> Family:
    """A block of positions with one direction of the normal; coordinates x, y and z, m.

    Args:
        centre: of the block in {O}, m.
        size: along x, y and z, m; zero for none.
        steps: from one side to the other; none along a size of zero.
        azimuth, tilt: of the normal, rad.

    Raises:
        InputError: for a size below zero, steps below one, or too many points.
    """
    for axis, length, count in zip("xyz", size, steps, strict=True):
        if not length >= 0:
            raise InputError(f"size of the block along {axis}: {length * 1e3:g} mm; must not be below zero")
        if count < 1:
            raise InputError(f"steps along {axis}: {count}; at least 1 is needed")
    open_axes = [k for k in range(3) if size[k] > 0]
    counts = [steps[k] + 1 if k in open_axes else 1 for k in range(3)]
    if np.prod(np.array(counts, dtype=float)) > MOST_POINTS:
        raise InputError(f"steps: {' × '.join(map(str, steps))} make more than {MOST_POINTS} points")
    low, high = (np.add(centre, np.multiply(side, size)) for side in (-0.5, 0.5))
    lines = [np.linspace(low[k], high[k], counts[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)

    def places(coordinates: Array) -> Places:
        position = np.tile(np.asarray(centre, dtype=float), (len(coordinates), 1))
        position[:, open_axes] = coordinates
        slack = WITHIN * np.max(size, initial=0.0)
        inside = np.all((position >= low - slack) & (position <= high + slack), axis=1)
        position = np.where(inside[:, None], np.clip(position, low, high), np.nan)
        return Places(position, np.full(len(position), azimuth), np.full(len(position), tilt), None)

    spacing = np.array([size[k] / steps[k] for k in open_axes])
    name = f"block of {' × '.join(f'{1e3 * length:g}' for length in size)} mm"
    return Family(name, grid[:, open_axes], spacing, places)


def along(name: str, pose_at: Callable[[Array], Array], length: float, count: int) -> Family:
    """Poses along a path, rolls included; the coordinate runs from 0 to a length.

    Args:
        name: of the path.
        pose_at: (m, 6) centre (m), azimuth, tilt and roll (rad) at coordinates (m,).
        length: where the path ends.
        count: poses of the grid, both ends included.

    Raises:
        InputError: for fewer than two poses, or too many.
    """
    if not 2 <= count <= MOST_POINTS:
        raise InputError(f"poses along the path: {count}; expected 2 to {MOST_POINTS}")

    def places(coordinates: Array) -> Places:
        at = coordinates[:, 0]
        inside = (at >= -WITHIN * length) & (at <= length * (1 + WITHIN))
        found = np.where(inside[:, None], pose_at(np.clip(at, 0, length)), np.nan)
        return Places(found[:, :3], found[:, 3], found[:, 4], found[:, 5])

    return Family(name, np.linspace(0, length, count)[:, None], np.array([length / (count - 1)]), places)


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


def lowest(family: Family, values: Array, function: Callable[[Array], Array]) -> Lowest:
    """The least value of a function over a family, sought from the lowest points of its grid (a pattern search).

    The function need not be smooth, as least values and best rolls are not.

    Args:
        family: over what.
        values: (n,) the function on the grid; NaN where it has no value.
        function: its values (m,) at coordinates (m, d).
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
    first = int(np.argmin(there))
    return Lowest(here[first], float(there[first]))
