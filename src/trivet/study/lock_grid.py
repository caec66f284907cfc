"""Where a chain can be held for all poses, over a grid of coordinates, and the best combinations of such chains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.held import Held
from trivet.study.lock_measures import Measure
from trivet.study.lock_values import Holding, Poses, picked, span, turned

Array = NDArray[Any]

GRID = {0: 1, 1: 41, 2: 13}
"""Coordinates along each travel of a chain with so many held drives."""
FEWEST = 7
"""The same beyond them."""
ROLLS = 24
"""Rolls of the grid where the roll is free."""
AT_ONCE = 32_768
"""Rows that are combined at a time."""
STARTS = 3
"""Best places of the grid from which the search goes on, no two of them neighbours in one working mode."""
APART = 0.1
"""Parts of the travel within which places are neighbours."""


class Miss(NamedTuple):
    """A pose that a chain does not reach, held where it serves best for all."""

    pose: int
    reason: str


class Table(NamedTuple):
    """A chain at the coordinates of its grid that reach all poses."""

    ways: list[Held]
    """(g,)."""
    values: Array
    """(g, s)."""
    pieces: Any
    """(g, p, r, ...)."""
    inside: Array
    """(g, p, r) whether all joints are inside their travel."""


def grid_of(way: Held) -> Array:
    """(g, s) coordinates within the travel."""
    count = GRID.get(len(way.low), FEWEST)
    return mesh([np.linspace(low, high, count) for low, high in zip(way.low, way.high, strict=True)])


def mesh(lines: Sequence[Array]) -> Array:
    """(g, s) all combinations of coordinates along s lines."""
    return np.array(list(product(*lines)), dtype=float)


def table(asked: Measure, ways: Sequence[Held], poses: Poses) -> Table | Miss:
    """A chain held in several ways over the grid, or why it reaches no place that serves for all poses."""
    rolls = _rolls(poses)
    parts, nearest = [], (-math.inf, ways[0], np.zeros(0), np.zeros(1))
    for way in ways:
        grid = grid_of(way)
        for _ in range(3):
            pieces, margins = over_grid(asked, way, grid, poses, rolls)
            at_best = margins.max(axis=2)
            keep = np.flatnonzero(at_best.min(axis=1) >= 0)
            best = int(np.argmax(np.where(np.isfinite(at_best), at_best, -1e9).min(axis=1)))
            found = float(at_best[best].min())
            if found > nearest[0] or not len(nearest[2]):
                nearest = (found, way, grid[best], at_best[best])
            if len(keep) or not len(way.low):
                break
            grid = _finer(way, grid[best], grid)  # a window narrower than the grid
        if len(keep):
            parts.append(([way] * len(keep), grid[keep], jax.tree.map(lambda c, k=keep: c[k], pieces), margins[keep] >= 0))
    if not parts:
        _, way, values, margins = nearest
        pose = int(np.argmin(margins))
        frame = turned(picked(poses.frames, np.array([pose])), _best_roll(asked, way, values, poses, pose))
        return Miss(pose, way.miss(values, jax.tree.map(lambda c: float(c[0]), frame)))
    held, grids, pieces, inside = zip(*parts, strict=True)
    whole = jax.tree.map(lambda *c: np.concatenate(c), *pieces)
    return Table([w for own in held for w in own], np.concatenate(grids), whole, np.concatenate(inside))


def _rolls(poses: Poses) -> Array:
    """(p, r) rolls that are tried."""
    if poses.rolls is not None:
        return poses.rolls[:, None]
    return np.tile(2 * math.pi / ROLLS * np.arange(ROLLS), (len(poses), 1))


def over_grid(asked: Measure, way: Held, grid: Array, poses: Poses, rolls: Array) -> tuple[Any, Array]:
    """Pieces (g, p, r, ...) and margins (g, p, r) of a chain at coordinates (g, s) and at poses with rolls (p, r)."""
    shape = (len(grid), *rolls.shape)
    g, p, r = (a.ravel() for a in np.indices(shape))
    pieces, margins = way.rows(asked.piece, grid[g], picked(poses.frames, p), rolls[p, r])
    return jax.tree.map(lambda c: c.reshape(*shape, *c.shape[1:]), pieces), margins.reshape(shape)


def _finer(way: Held, centre: Array, grid: Array) -> Array:
    """A grid about a place, of a third of the steps."""
    count = max(round(len(grid) ** (1 / len(centre))), 2)
    lines = [
        np.unique(np.clip(c + np.linspace(-1, 1, 13) * np.ptp(g) / (count - 1), low, high))
        for c, g, low, high in zip(centre, grid.T, way.low, way.high, strict=True)
    ]
    return mesh(lines)


def _best_roll(asked: Measure, way: Held, values: Array, poses: Poses, pose: int) -> Array:
    rolls = _rolls(poses)[pose]
    _, margins = over_grid(asked, way, values[None], poses.some(np.array([pose])), rolls[None])
    return rolls[[int(np.argmax(margins[0, 0]))]]


def starts(asked: Measure, tables: Sequence[Table], poses: Poses, most: int = STARTS) -> list[Holding]:
    """The best combinations of the tables, at most so many of them, the best first; none where no combination reaches."""
    rolls = _rolls(poses)
    looks = max(int(asked.rows / rolls.size), 3 ** len(tables))
    each = max(int(looks ** (1 / max(sum(len(t.values) > 1 for t in tables), 1)) + 1e-9), 3)
    index = [np.unique(np.linspace(0, len(t.values) - 1, min(each, len(t.values))).round().astype(int)) for t in tables]
    whole = np.array(list(product(*index)))
    parts = [(found.argmax(axis=2), found.max(axis=2)) for found in combined(asked, tables, whole, poses, rolls)]
    at, least = (np.concatenate(own) for own in zip(*parts, strict=True))
    worst = least.min(axis=1)
    chosen: list[Holding] = []
    for k in np.argsort(-worst, kind="stable"):
        if not np.isfinite(worst[k]) or len(chosen) == most:
            break
        ways = tuple(t.ways[g] for t, g in zip(tables, whole[k], strict=True))
        values = np.concatenate([t.values[g] for t, g in zip(tables, whole[k], strict=True)])
        if all(_is_apart(ways, values, other) for other in chosen):
            chosen.append(Holding(ways, values, rolls[np.arange(len(poses)), at[k]], least[k]))
    return chosen


def _is_apart(ways: tuple[Held, ...], values: Array, other: Holding) -> bool:
    if any(a is not b for a, b in zip(ways, other.ways, strict=True)):
        return True
    return bool(np.any(np.abs(values - other.values) > APART * span(ways)))


def combined(asked: Measure, tables: Sequence[Table], whole: Array, poses: Poses, rolls: Array) -> Iterator[Array]:
    """(c, p, r) the measure of combinations (c, chains), some at a time; minus infinity outside the travel."""
    chunk = max(AT_ONCE // rolls.size, 1)
    for start in range(0, len(whole), chunk):
        yield _combined(asked, tables, whole[start : start + chunk], poses, rolls)


def _combined(asked: Measure, tables: Sequence[Table], part: Array, poses: Poses, rolls: Array) -> Array:
    shape = (len(part), *rolls.shape)
    inside = np.all([t.inside[part[:, k]] for k, t in enumerate(tables)], axis=0)
    c, p, r = np.nonzero(inside)
    found = np.full(shape, -np.inf)
    if len(c):
        pieces = [jax.tree.map(lambda a, k=k: a[part[c, k], p, r], t.pieces) for k, t in enumerate(tables)]
        values = asked.values(pieces, turned(picked(poses.frames, p), rolls[p, r])).min(axis=1)
        found[c, p, r] = np.where(np.isfinite(values), values, -np.inf)
    return found
