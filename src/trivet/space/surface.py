"""Families of poses: surfaces of check points on which the platform lies tangent, its roll left free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError

MOST_POINTS = 5_000_000


@dataclass(frozen=True)
class Surface:
    """Check points; the platform centre touches each with its normal along the surface normal."""

    name: str
    position: NDArray[Any]
    """(n, 3) in {O}, m."""
    azimuth: NDArray[Any]
    """(n,) alpha of the normal, rad."""
    tilt: NDArray[Any]
    """(n,) beta, angle of the normal from z, rad."""

    def __len__(self) -> int:
        return len(self.tilt)


def hemisphere(height: float, radius: float, steps: int = 10) -> Surface:
    """The upper hemisphere about (0, 0, height): the points of a square lattice of radius/steps, lifted onto it.

    With ten steps these are the paper's 317 check points (lattice points with x^2 + y^2 <= 10^2 steps, the 12 on the rim
    included), an inference that reproduces its numbers.

    Args:
        height: of the centre above {O}, m.
        radius: m.
        steps: lattice steps from the pole to the rim; the number of points grows as pi steps^2.

    Raises:
        InputError: for a radius or a number of steps that leaves no points, or too many of them.
    """
    if not radius > 0:
        raise InputError(f"radius of the hemisphere: {radius * 1e3:g} mm; must be greater than zero")
    if steps < 1:
        raise InputError(f"steps: {steps} leaves the surface without points; at least 1 is needed")
    if 3.2 * steps * steps > MOST_POINTS:
        raise InputError(f"steps: {steps} makes more than {MOST_POINTS} points; at most {int((MOST_POINTS / 3.2) ** 0.5)}")
    grid = np.arange(-steps, steps + 1)
    i, j = (a.ravel() for a in np.meshgrid(grid, grid, indexing="ij"))
    inside = i * i + j * j <= steps * steps
    i, j = i[inside], j[inside]
    # From integers, so that the rim has exactly zero height and 90 degrees of tilt.
    rise = radius / steps * np.sqrt((steps * steps - i * i - j * j).astype(float))
    flat = radius / steps * np.hypot(i, j)
    position = np.stack([radius * i / steps, radius * j / steps, height + rise], axis=1)
    return Surface(f"hemisphere of {radius * 1e3:g} mm", position, np.arctan2(j, i).astype(float), np.arctan2(flat, rise))
