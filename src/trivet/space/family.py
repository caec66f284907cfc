"""Continuous families of poses with one, two or three coordinates: along a path, over a surface, in a block; a grid in each.

A family says where the platform is for any coordinates, so that what a grid of poses shows can be sought further between them
(`space.search`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
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

    def some(self, index: Array) -> Places:
        """Some of them, by index."""
        return Places(*(None if values is None else values[index] for values in self))  # type: ignore[arg-type]

    def frames(self) -> Frame:
        """Platform frames, components (m,); the roll must be known."""
        return zyz_frame(self.position, self.azimuth, self.tilt, self.roll)


class Axis(NamedTuple):
    """What a coordinate is told by."""

    name: str
    unit: str = ""
    """As people read it."""
    factor: float = 1.0
    """By which the coordinate is in that unit."""


def _millimetres(names: str) -> tuple[Axis, ...]:
    return tuple(Axis(name, "mm", 1e3) for name in names)


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
    axes: tuple[Axis, ...]
    """Of the d coordinates."""
    nearest: Callable[[Array], Array]
    """Coordinates (m, d) moved onto the edge where they are beyond it."""

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

    def nearest(coordinates: Array) -> Array:
        flat = np.hypot(*coordinates.T)[:, None]
        return coordinates * np.where(flat > radius, radius / np.maximum(flat, radius), 1.0)

    return Family(points.name, points.position[:, :2], np.full(2, radius / steps), places, _millimetres("xy"), nearest)


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
        InputError: for a size below zero or without any extent, steps below one, or too many points.
    """
    for axis, length, count in zip("xyz", size, steps, strict=True):
        if not (length >= 0 and math.isfinite(length)):
            raise InputError(f"size of the block along {axis}: {length * 1e3:g} mm; must be finite, not below zero")
        if count < 1:
            raise InputError(f"steps along {axis}: {count}; at least 1 is needed")
    if not np.all(np.isfinite([*centre, azimuth, tilt])):
        raise InputError(f"centre {centre}, azimuth {azimuth}, tilt {tilt} of the block: must be finite")
    open_axes = [k for k in range(3) if size[k] > 0]
    if not open_axes:
        raise InputError("size of the block: 0 mm along all axes; at least one must be above zero")
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
    axes = _millimetres("".join("xyz"[k] for k in open_axes))
    return Family(name, grid[:, open_axes], spacing, places, axes, lambda c: np.clip(c, low[open_axes], high[open_axes]))


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
    if not (length > 0 and math.isfinite(length)):
        raise InputError(f"length of the path: {length}; must be above zero")
    if not 2 <= count <= MOST_POINTS:
        raise InputError(f"poses along the path: {count}; expected 2 to {MOST_POINTS}")

    def places(coordinates: Array) -> Places:
        at = coordinates[:, 0]
        inside = (at >= -WITHIN * length) & (at <= length * (1 + WITHIN))
        found = np.where(inside[:, None], pose_at(np.clip(at, 0, length)), np.nan)
        return Places(found[:, :3], found[:, 3], found[:, 4], found[:, 5])

    grid, spacing = np.linspace(0, length, count)[:, None], np.array([length / (count - 1)])
    return Family(name, grid, spacing, places, (Axis("along the path"),), lambda c: np.clip(c, 0, length))
