"""Spare drives as functions of a path: splines, the best way over a grid of coordinates, and what slopes make of either."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.held import Held
from trivet.study.lock_measures import Measure
from trivet.study.lock_search import FAR, Poses, Table, combined, looked, picked, slopes_at, span, values_at

Array = NDArray[Any]

KNOTS, DEGREE = 8, 3
"""Coefficients of a spline, at most, and its degree."""
GRID = 15
"""Coordinates of a spare drive on the grid, at most."""
STEPS, FEW_STEPS = 80, 20
"""Of sequential quadratic programming, at most; fewer where a look costs much."""
AT_ONCE = 1024
"""Combinations of coordinates that are worked out at a time."""


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

    width, count = span(ways), len(stretch.part)
    most = int(np.clip((asked.rows / count) ** (1 / len(span(ways))), 3, GRID))
    lines = [_lines(asked, way, stretch, most) for way in ways]
    if any(own is None for own in lines):
        return None
    tables = [_table(asked, way, own or [], stretch) for way, own in zip(ways, lines, strict=True)]
    every = [line for own in lines for line in own or []]
    index = np.array(list(product(*(range(len(t.values)) for t in tables))))
    found = [
        combined(asked, tables, index[start : start + AT_ONCE], stretch.poses, stretch.rolls[:, None])[..., 0]
        for start in range(0, len(index), AT_ONCE)
    ]
    heights = np.concatenate(found).T.reshape(count, *(len(line) for line in every))
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
    cells = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
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
    grid = _mesh(fine)
    g, p = (a.ravel() for a in np.indices((len(grid), len(stretch.part))))
    _, margins = way.rows(asked.piece, grid[g], picked(stretch.poses.frames, p), stretch.rolls[p])
    used = grid[np.any(margins.reshape(len(grid), -1) >= 0, axis=1)]
    return [np.linspace(low, high, count) for low, high in zip(used.min(0), used.max(0), strict=True)] if len(used) else None


def _table(asked: Measure, way: Held, lines: list[Array], stretch: Stretch) -> Table:
    grid = _mesh(lines) if lines else np.zeros((1, 0))
    shape = (len(grid), len(stretch.part), 1)
    g, p = (a.ravel() for a in np.indices(shape[:2]))
    pieces, margins = way.rows(asked.piece, grid[g], picked(stretch.poses.frames, p), stretch.rolls[p])
    return Table(
        [way] * len(grid), grid, jax.tree.map(lambda c: c.reshape(*shape, *c.shape[1:]), pieces), margins.reshape(shape) >= 0
    )


def _mesh(lines: list[Array]) -> Array:
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))


@dataclass(frozen=True)
class Program:
    """Coefficients of splines, (count, d) in travels, with the least of the measure, in units of a level, behind them."""

    asked: Measure
    ways: tuple[Held, ...]
    stretch: Stretch
    matrix: Array
    """(p, count)."""
    level: float

    def _coordinates(self, x: Array) -> Array:
        width = span(self.ways)
        return self.matrix @ (x[:-1].reshape(-1, len(width)) * width)

    def spare(self, x: Array) -> Array:
        """How far every constraint is met."""
        poses = self.stretch
        found, margins = looked(self.asked, self.ways, self._coordinates(x), poses.poses.frames, poses.rolls)
        both = np.concatenate([(found / self.level - x[-1]).ravel(), margins.ravel()])
        return np.clip(np.nan_to_num(both, nan=-FAR), -FAR, FAR)

    def slopes(self, x: Array) -> Array:
        """(constraints, variables)."""
        own, width = self.stretch, span(self.ways)
        measure, margins = slopes_at(self.asked, self.ways, self._coordinates(x), own.poses.frames, own.rolls, by_roll=False)
        parts = [
            np.einsum("pkd,pc->pkcd", part * width, self.matrix).reshape(-1, len(x) - 1)
            for part in (measure / self.level, margins)
        ]
        least = np.concatenate([np.full(len(parts[0]), -1.0), np.zeros(len(parts[1]))])
        return np.nan_to_num(np.column_stack([np.vstack(parts), least]), nan=0.0, posinf=0.0, neginf=0.0)


def programmed(program: Program, spline: Spline, start: Array, rate: float) -> Array:
    """Coefficients (count, d), m or rad, from others on; constraints are met to rounding where the search ends well."""
    from scipy.optimize import minimize

    ways, asked, width = program.ways, program.asked, span(program.ways)
    pace = np.kron(spline.rates, np.eye(len(width)))
    pace = np.column_stack([pace, np.zeros(len(pace))])
    first = program.stretch.values(asked, ways, program.matrix @ start).min() / program.level
    begun = np.append((start / width).ravel(), first if np.isfinite(first) else 0.0)
    low, high = (np.concatenate([getattr(w, end) for w in ways]) for end in ("low", "high"))
    with np.errstate(all="ignore"):
        done = minimize(
            lambda x: -x[-1], begun, jac=lambda x: -np.eye(len(x))[-1], method="SLSQP",
            bounds=[*list(zip(low / width, high / width, strict=True)) * spline.count, (None, None)],
            constraints=[
                {"type": "ineq", "fun": program.spare, "jac": program.slopes},
                {"type": "ineq", "fun": lambda x: rate - pace @ x, "jac": lambda x: -pace},
                {"type": "ineq", "fun": lambda x: rate + pace @ x, "jac": lambda x: pace},
            ],
            options={"maxiter": STEPS if asked.rows > AT_ONCE * 2 else FEW_STEPS, "ftol": asked.precision},
        )  # fmt: skip
    return np.asarray(done.x[:-1].reshape(-1, len(width)) * width if np.all(np.isfinite(done.x)) else start)
