"""Spare drives as functions of a path: splines, and the best way over a grid of coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.held import Held
from trivet.study.lock_grid import Table, combined, mesh, over_grid
from trivet.study.lock_measures import Measure
from trivet.study.lock_values import Poses, span, values_at

Array = NDArray[Any]

KNOTS, DEGREE = 8, 3
"""Coefficients of a spline, at most, and its degree."""
GRID = 15
"""Coordinates of a spare drive on the grid, at most."""


class Stretch(NamedTuple):
    """Poses along a path."""

    part: Array
    """(p,) of the path, from 0 at its start to 1 at its end."""
    poses: Poses
    """Their rolls known."""

    @property
    def rolls(self) -> Array:
        """(p,) rad."""
        assert self.poses.rolls is not None
        return self.poses.rolls

    def values(self, asked: Measure, ways: Sequence[Held], coordinates: Array) -> Array:
        """(p,) the measure at coordinates (p, d); minus infinity outside the travel."""
        return values_at(asked, ways, coordinates, self.poses.frames, self.rolls)


class Spline:
    """Cubic functions of the path (de Boor, A Practical Guide to Splines, 1978): values are a matrix times coefficients."""

    def __init__(self, places: int) -> None:
        """With as many coefficients as so many places can tell."""
        self.count = min(KNOTS, max(places // 2, DEGREE + 1))
        self.knots = np.concatenate([np.zeros(DEGREE), np.linspace(0, 1, self.count - DEGREE + 1), np.ones(DEGREE)])

    def matrix(self, part: Array) -> Array:
        """(n, count) at parts of the path."""
        from scipy.interpolate import BSpline

        found: Array = BSpline.design_matrix(np.clip(part, 0, 1), self.knots, DEGREE).toarray()
        return found

    @property
    def rates(self) -> Array:
        """(count - 1, count): from coefficients to those of the derivative, between which it stays."""
        wide = self.knots[DEGREE + 1 : DEGREE + self.count] - self.knots[1 : self.count]
        return DEGREE / wide[:, None] * np.diff(np.eye(self.count), axis=0)


def way_over_grid(asked: Measure, ways: Sequence[Held], stretch: Stretch, rate: float) -> Array | None:
    """Coordinates (p, d) of the way over a grid whose least is greatest, a bottleneck path; None where there is none.

    From a pose to the next a coordinate goes no farther than its rate (travels along the path) allows, or one step of the grid.
    """
    from scipy.ndimage import maximum_filter

    width, count, rolls = span(ways), len(stretch.part), stretch.rolls[:, None]
    most = int(np.clip((asked.rows / count) ** (1 / len(width)), 3, GRID))
    lines = [_lines(asked, way, stretch, most) for way in ways]
    if any(own is None for own in lines):
        return None
    tables = []
    for way, own in zip(ways, lines, strict=True):
        grid = mesh(own or [])
        pieces, margins = over_grid(asked, way, grid, stretch.poses, rolls)
        tables.append(Table([way] * len(grid), grid, pieces, margins >= 0))
    every = [line for own in lines for line in own or []]
    index = np.array(list(product(*(range(len(t.values)) for t in tables))))
    found = np.concatenate(list(combined(asked, tables, index, stretch.poses, rolls)))
    heights = found[..., 0].T.reshape(count, *(len(line) for line in every))
    steps = np.array([line[1] - line[0] for line in every])
    reach = [np.maximum(rate * width * gap / np.maximum(steps, 1e-12), 1).astype(int) for gap in np.diff(stretch.part)]
    ahead = [heights[-1]]
    for height, cells in zip(heights[-2::-1], reach[::-1], strict=True):
        best = maximum_filter(ahead[0], size=tuple(2 * cells + 1), mode="constant", cval=-np.inf)
        ahead.insert(0, np.minimum(height, best))
    if not np.isfinite(ahead[0].max()):
        return None
    return np.array([[line[k] for line, k in zip(every, cell, strict=True)] for cell in _followed(ahead, reach)])


def _followed(ahead: list[Array], reach: list[Array]) -> list[Array]:
    """The cells of the best way, the nearest of those that are as good."""
    shape = ahead[0].shape
    cells = np.moveaxis(np.indices(shape), 0, -1)
    gone = [np.array(np.unravel_index(int(np.argmax(ahead[0])), shape))]
    for after, far in zip(ahead[1:], reach, strict=True):
        away = np.abs(cells - gone[-1])
        near = np.all(away <= far, axis=-1)
        rank = np.where(near & (after >= after[near].max()), away.sum(axis=-1), np.inf)
        gone.append(np.array(np.unravel_index(int(np.argmin(rank)), shape)))
    return gone


def _lines(asked: Measure, way: Held, stretch: Stretch, count: int) -> list[Array] | None:
    """Coordinates along each travel of a chain, over what reaches some pose; None where nothing does."""
    fine = [np.linspace(low, high, 4 * count) for low, high in zip(way.low, way.high, strict=True)]
    if not fine:
        return []
    grid = mesh(fine)
    _, margins = over_grid(asked, way, grid, stretch.poses, stretch.rolls[:, None])
    used = grid[np.any(margins >= 0, axis=(1, 2))]
    return [np.linspace(low, high, count) for low, high in zip(used.min(0), used.max(0), strict=True)] if len(used) else None
