"""Where to hold drives so that the least of a measure over poses is greatest.

First a grid: every chain is worked out by itself at coordinates within the travel of its held drives, those which do not reach
all poses are left out, and what is left is combined.  From the best of it the search goes on in the epigraph form,

    greatest t  with  measure(pose) >= t  and  margin(chain, pose) >= 0  at all poses,

by sequential quadratic programming (D. Kraft, SLSQP, DFVLR-FB 88-28, 1988), whose constraints make the worst of several poses a
smooth matter.  A look around of shrinking steps ends it, where slopes have no meaning.  Rolls that are free are variables too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.held import Held
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled
from trivet.study.lock_measures import Measure

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
STEPS = 60
"""Of sequential quadratic programming, at most."""
FINEST = 1e-6
"""Part of the travel at which a look around ends."""
BEYOND = 1e-9
"""Margin of travel below zero that is rounding."""
FAR = 10.0
"""A margin or measure, as a part, beyond which it is cut off: there a chain is far from closing."""


@dataclass(frozen=True)
class Poses:
    """Poses of a task."""

    frames: Frame
    """Components (p,), at roll zero where the roll is known: the tangent frames."""
    rolls: Array | None
    """(p,) rad; None where they are free."""

    def __len__(self) -> int:
        return len(self.frames.origin.x)

    def some(self, index: Array) -> Poses:
        """Some of them."""
        return Poses(picked(self.frames, index), None if self.rolls is None else self.rolls[index])

    def with_more(self, more: Poses) -> Poses:
        """These, and others."""
        frames = jax.tree.map(lambda a, b: np.concatenate([a, b]), self.frames, more.frames)
        return Poses(frames, None if self.rolls is None or more.rolls is None else np.concatenate([self.rolls, more.rolls]))


class Place(NamedTuple):
    """Where the spare drives are held, and what that gives over poses."""

    ways: tuple[Held, ...]
    """Per chain."""
    values: Array
    """(d,) coordinates, m or rad, chain by chain."""
    rolls: Array
    """(p,) rad."""
    least: Array
    """(p,) the measure at every pose."""

    @property
    def value(self) -> float:
        """The least over the poses."""
        return float(self.least.min())


class Miss(NamedTuple):
    """A pose that a chain does not reach, held where it serves best for all."""

    pose: int
    reason: str


def picked(frames: Frame, index: Array) -> Frame:
    """Some of the frames (p,)."""
    found: Frame = jax.tree.map(lambda c: np.asarray(c)[index], frames)
    return found


def turned(frames: Frame, rolls: Array) -> Frame:
    """Frames (m,) turned about their normals."""
    return rolled(frames, Angle(np.cos(rolls), np.sin(rolls)))


def split(ways: Sequence[Held], values: Array) -> list[Array]:
    """Coordinates (..., d) chain by chain."""
    ends = np.cumsum([len(way.low) for way in ways])[:-1]
    return np.split(values, ends, axis=-1)


def looked(asked: Measure, ways: Sequence[Held], values: Array, frames: Frame, rolls: Array) -> tuple[Array, Array]:
    """The measure (m, k) and margins of travel (m, chains) at coordinates (m, d) and poses (m,) with rolls (m,)."""
    own = [way.rows(asked.piece, v, frames, rolls) for way, v in zip(ways, split(ways, values), strict=True)]
    margins = np.stack([margin for _, margin in own], axis=1)
    return asked.values([piece for piece, _ in own], turned(frames, rolls)), margins


def values_at(asked: Measure, ways: Sequence[Held], values: Array, frames: Frame, rolls: Array) -> Array:
    """(m,) the least of the measure; minus infinity where a chain is outside its travel."""
    found, margins = looked(asked, ways, values, frames, rolls)
    inside = np.all(margins >= -BEYOND, axis=1) & np.all(np.isfinite(found), axis=1)
    return np.where(inside, np.where(np.isfinite(found), found, 0.0).min(axis=1), -np.inf)


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
    lines = [np.linspace(low, high, count) for low, high in zip(way.low, way.high, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines)) if lines else np.zeros((1, 0))


def table(asked: Measure, ways: Sequence[Held], poses: Poses) -> Table | Miss:
    """A chain held in several ways over the grid, or why it reaches no place that serves for all poses."""
    rolls = _rolls(poses)
    parts, nearest = [], (-math.inf, ways[0], np.zeros(0), np.zeros(1))
    for way in ways:
        grid = grid_of(way)
        for _ in range(3):
            pieces, margins = _over(asked, way, grid, poses, rolls)
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


def _over(asked: Measure, way: Held, grid: Array, poses: Poses, rolls: Array) -> tuple[Any, Array]:
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
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))


def _best_roll(asked: Measure, way: Held, values: Array, poses: Poses, pose: int) -> Array:
    rolls = _rolls(poses)[pose]
    _, margins = _over(asked, way, values[None], poses.some(np.array([pose])), rolls[None])
    return rolls[[int(np.argmax(margins[0, 0]))]]


def starts(asked: Measure, tables: Sequence[Table], poses: Poses, most: int = STARTS) -> list[Place]:
    """The best combinations of the tables, at most so many of them, the best first; none where no combination reaches."""
    rolls = _rolls(poses)
    per_row = rolls.size
    looks = max(int(asked.rows / per_row), 3 ** len(tables))
    each = max(int(looks ** (1 / max(sum(len(t.values) > 1 for t in tables), 1)) + 1e-9), 3)
    index = [np.unique(np.linspace(0, len(t.values) - 1, min(each, len(t.values))).round().astype(int)) for t in tables]
    whole = np.array(list(product(*index)))
    chunk = max(AT_ONCE // per_row, 1)
    at, least = np.zeros((len(whole), len(poses)), dtype=int), np.full((len(whole), len(poses)), -np.inf)
    for start in range(0, len(whole), chunk):
        part = whole[start : start + chunk]
        found = combined(asked, tables, part, poses, rolls)
        at[start : start + chunk], least[start : start + chunk] = found.argmax(axis=2), found.max(axis=2)
    worst = least.min(axis=1)
    chosen: list[Place] = []
    for k in np.argsort(-worst, kind="stable"):
        if not np.isfinite(worst[k]) or len(chosen) == most:
            break
        ways = tuple(t.ways[g] for t, g in zip(tables, whole[k], strict=True))
        values = np.concatenate([t.values[g] for t, g in zip(tables, whole[k], strict=True)])
        if all(_is_apart(ways, values, other) for other in chosen):
            chosen.append(Place(ways, values, rolls[np.arange(len(poses)), at[k]], least[k]))
    return chosen


def _is_apart(ways: tuple[Held, ...], values: Array, other: Place) -> bool:
    if any(a is not b for a, b in zip(ways, other.ways, strict=True)):
        return True
    return bool(np.any(np.abs(values - other.values) > APART * span(ways)))


def span(ways: Sequence[Held]) -> Array:
    """(d,) travel of the held drives."""
    return np.concatenate([way.high - way.low for way in ways])


def combined(asked: Measure, tables: Sequence[Table], part: Array, poses: Poses, rolls: Array) -> Array:
    """(c, p, r) the measure of combinations (c, chains); minus infinity outside the travel."""
    shape = (len(part), *rolls.shape)
    inside = np.all([t.inside[part[:, k]] for k, t in enumerate(tables)], axis=0)
    c, p, r = np.nonzero(inside)
    found = np.full(shape, -np.inf)
    if len(c):
        pieces = [jax.tree.map(lambda a, k=k: a[part[c, k], p, r], t.pieces) for k, t in enumerate(tables)]
        values = asked.values(pieces, turned(picked(poses.frames, p), rolls[p, r])).min(axis=1)
        found[c, p, r] = np.where(np.isfinite(values), values, -np.inf)
    return found


def polished(asked: Measure, places: Sequence[Place], poses: Poses) -> Place:
    """The best near some places, never worse than any of them."""
    tried = [*places, *(_programmed(asked, place, poses) for place in places)]
    best = max(tried, key=lambda place: place.value)
    return best if asked.rows < AT_ONCE else _around(asked, best, poses)


def _programmed(asked: Measure, place: Place, poses: Poses) -> Place:
    from scipy.optimize import minimize

    ways, width, count = place.ways, span(place.ways), len(place.values)
    free = poses.rolls is None
    low, high = np.concatenate([w.low for w in ways]), np.concatenate([w.high for w in ways])
    size = max(abs(place.value), 1e-12)
    program = _Program(asked, ways, poses, size, width, place.rolls)
    rolls = place.rolls if free else np.zeros(0)
    start = np.concatenate([place.values / width, rolls, [place.value / size]])
    bounds = [*zip(low / width, high / width, strict=True), *[(None, None)] * (len(rolls) + 1)]
    with np.errstate(all="ignore"):
        done = minimize(
            lambda x: -x[-1], start, jac=lambda x: -np.eye(len(x))[-1], method="SLSQP", bounds=bounds,
            constraints=[{"type": "ineq", "fun": program.spare, "jac": program.slopes}],
            options={"maxiter": STEPS, "ftol": asked.precision},
        )  # fmt: skip
    found = np.where(np.isfinite(done.x), done.x, start)
    values = np.clip(found[:count] * width, low, high)
    turns = found[count:-1] if free else place.rolls
    # Constraints are met to rounding; what is beyond an end of travel is pulled back towards the start.
    for back in (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        own = values + back * (place.values - values)
        own_rolls = turns + back * (place.rolls - turns)
        least = values_at(asked, ways, np.tile(own, (len(poses), 1)), poses.frames, own_rolls)
        if np.all(np.isfinite(least)):
            return Place(ways, own, np.mod(own_rolls, 2 * math.pi), least)
    return place


class _Program:
    """The constraints, and their slopes, as SciPy asks for them: of the last variables."""

    def __init__(self, asked: Measure, ways: tuple[Held, ...], poses: Poses, size: float, width: Array, rolls: Array) -> None:
        self.asked, self.ways, self.poses, self.size, self.width, self.rolls = asked, ways, poses, size, width, rolls

    def _case(self, x: Array) -> tuple[Array, Array]:
        d, p = len(self.width), len(self.poses)
        return np.tile(x[:d] * self.width, (p, 1)), x[d:-1] if self.poses.rolls is None else self.rolls

    def spare(self, x: Array) -> Array:
        """How far every constraint is met."""
        values, rolls = self._case(x)
        found, margins = looked(self.asked, self.ways, values, self.poses.frames, rolls)
        both = np.concatenate([(found / self.size - x[-1]).ravel(), margins.ravel()])
        return np.clip(np.nan_to_num(both, nan=-FAR), -FAR, FAR)

    def slopes(self, x: Array) -> Array:
        """(constraints, variables)."""
        values, rolls = self._case(x)
        d, p = len(self.width), len(self.poses)
        measure, margins = slopes_at(self.asked, self.ways, values, self.poses.frames, rolls, self.poses.rolls is None)
        k, chains = measure.shape[1], margins.shape[1]
        out = np.zeros((p * (k + chains), len(x)))
        for first, part, width in ((0, measure / self.size, k), (p * k, margins, chains)):
            rows = first + np.arange(p * width).reshape(p, width)
            out[rows, :d] = part[..., :d] * self.width
            if self.poses.rolls is None:
                out[rows, d + np.arange(p)[:, None]] = part[..., d]
        out[: p * k, -1] = -1
        return np.nan_to_num(out, nan=0.0, posinf=0.0, neginf=0.0)


def slopes_at(
    asked: Measure, ways: Sequence[Held], values: Array, frames: Frame, rolls: Array, by_roll: bool
) -> tuple[Array, Array]:
    """Slopes of the measure (m, k, v) and of the margins (m, chains, v) by the d coordinates, and by the roll if asked."""
    parts, m = split(ways, values), len(values)
    pieces = [way.rows(asked.piece, v, frames, rolls)[0] for way, v in zip(ways, parts, strict=True)]
    nothing = [jax.tree.map(np.zeros_like, piece) for piece in pieces]
    pushed, margins = [], []
    for k, (way, own) in enumerate(zip(ways, parts, strict=True)):
        for j in range(own.shape[1]):
            along = np.zeros_like(own)
            along[:, j] = 1
            change, margin = way.pushed(asked.piece, own, frames, rolls, along, np.zeros(m))
            pushed.append([*nothing[:k], change, *nothing[k + 1 :]])
            margins.append(np.stack([margin if i == k else np.zeros(m) for i in range(len(ways))], axis=1))
    if by_roll:
        both = [
            way.pushed(asked.piece, own, frames, rolls, np.zeros_like(own), np.ones(m))
            for way, own in zip(ways, parts, strict=True)
        ]
        pushed.append([change for change, _ in both])
        margins.append(np.stack([margin for _, margin in both], axis=1))
    return asked.slopes(pieces, turned(frames, rolls), pushed), np.stack(margins, axis=-1)


def _around(asked: Measure, place: Place, poses: Poses) -> Place:
    """Looks around of shrinking steps, rolls kept."""
    width = span(place.ways)
    low, high = (np.concatenate([getattr(w, end) for w in place.ways]) for end in ("low", "high"))
    ahead = np.eye(len(width)) if len(width) > 4 else np.array([v for v in product((-1, 0, 1), repeat=len(width)) if any(v)])
    directions = np.concatenate([ahead, -ahead]) if len(width) > 4 else ahead
    random, step, found = np.random.default_rng(0), 0.02, place
    while step > FINEST and len(width):
        turn, _ = np.linalg.qr(random.normal(size=(len(width), len(width))))
        tried = np.clip(found.values + step * width * (directions @ turn), low, high)
        least = over_poses(asked, place.ways, tried, poses.frames, found.rolls)
        best = int(np.argmax(least.min(axis=1)))
        if least[best].min() > found.value:
            found = found._replace(values=tried[best], least=least[best])
        else:
            step *= 0.4
    return found


def over_poses(asked: Measure, ways: Sequence[Held], values: Array, frames: Frame, rolls: Array) -> Array:
    """(m, p) the measure at coordinates (m, d), each at all poses (p,)."""
    m, p = (a.ravel() for a in np.indices((len(values), len(rolls))))
    return values_at(asked, ways, values[m], picked(frames, p), rolls[p]).reshape(len(values), len(rolls))


def with_best_rolls(asked: Measure, place: Place, poses: Poses, levels: int = 10) -> Place:
    """The same coordinates at poses of their own, with the best rolls where these are free."""
    if poses.rolls is not None:
        least = over_poses(asked, place.ways, place.values[None], poses.frames, poses.rolls)[0]
        return Place(place.ways, place.values, poses.rolls, least)
    step = 2 * math.pi / (3 * ROLLS)
    centre, offsets = np.zeros(len(poses)), step * np.arange(3 * ROLLS)
    best, least = centre, np.full(len(poses), -np.inf)
    for _ in range(levels + 1):
        tried = centre[:, None] + offsets
        p, r = (a.ravel() for a in np.indices(tried.shape))
        values = np.tile(place.values, (len(p), 1))
        found = values_at(asked, place.ways, values, picked(poses.frames, p), tried[p, r]).reshape(tried.shape)
        top = found.argmax(axis=1)
        here = found[np.arange(len(top)), top]
        best, least = np.where(here > least, tried[np.arange(len(top)), top], best), np.maximum(here, least)
        centre, step = best, step / 3
        offsets = step * np.arange(-4, 5)
    return Place(place.ways, place.values, np.mod(best, 2 * math.pi), least)
