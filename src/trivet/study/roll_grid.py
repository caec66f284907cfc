"""A grid of rolls along a path of poses: which of them are allowed, what they are worth, and the best way through."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.model import Machine
from trivet.reach.margins import clearance, control, travel_margin
from trivet.reach.scene import FAR, Ball, Scene
from trivet.reach.touch import Touch
from trivet.reach.ways import Way, farthest, widest
from trivet.space.batches import in_batches
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled, tangent_axes, zyz_frame
from trivet.statics.compliance import platform_stiffness
from trivet.statics.objective import Objective

Array = NDArray[Any]

LARGEST_GRID = 5_000_000
"""Poses, at most."""
RESERVE_TRAVEL, RESERVE_GAP = 0.005, 5e-5
"""What a way keeps in hand, of half a joint's travel and of the distance of bodies (m): on the edge nothing can be proven."""
FINER, LEVELS = 2, 3
"""How much finer the grid becomes about a way, and how often."""
AROUND = 2.0
"""Cells of the grid by which a way keeps off a place where it could not be proven."""
ALLOWANCES = (2.0, 1.0, 0.5, 0.25, 0.125)
"""How far corners may be cut, in steps of the first grid, the boldest first."""
KEPT = 0.98
"""Part of its least value which a way keeps when corners are cut."""
SAMPLES = 2
"""Places at which the values of a way are told, per step of the grid."""


class Aim(NamedTuple):
    """A value that is to be great at the worst place of a way."""

    name: str
    """"sigma_min", or an objective of the stiffness."""
    scalar: Objective | None
    """Of the stiffness; None for sigma_min."""
    unit: float
    """What counts as one, SI; of several aims the worst value over its unit decides."""


class Rules(NamedTuple):
    """What a way has to keep to."""

    machine: Machine
    signs: Any
    """(n_chains, 2) working mode."""
    scene: Scene | None
    """Bodies that must stay apart; None when they need not."""
    workpiece: Ball | None
    radius: float
    """Of the spheres that the poses touch, m."""
    limits: bool
    """Whether joints must stay inside their travel."""
    aims: tuple[Aim, ...]
    least_sigma: float = 0.0
    """sigma_min below which a pose is not allowed."""

    @property
    def gap(self) -> float:
        """The least distance of bodies, m."""
        return float(self.machine.apart.clearance)


class RollGrid(NamedTuple):
    """A path and rolls."""

    path: Touch
    """(rows,) its poses, with the rolls from which those of the grid count."""
    step: float
    """Of the roll, rad."""
    columns: int
    poses: Array | None = None
    """(rows,) of a path through given poses where each row is, counted in these from 1; None for a tilt in one direction."""

    @property
    def marks(self) -> Array:
        """(rows,) what tells the rows: the number of the pose, or the tilt in degrees."""
        return np.degrees(self.path.tilt) if self.poses is None else self.poses

    def mark(self, row: float) -> str:
        """A place along the path in words."""
        value = float(np.interp(row, np.arange(self.shape[0]), self.marks))
        return f"tilt {value:.4g} deg" if self.poses is None else f"pose {round(value, 3):.8g} of {self.poses[-1]:.8g}"

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.path.roll), self.columns

    def at(self, rows: Array, columns: Array) -> Touch:
        """Poses (k,) at places along rows and columns, between those of the grid as well."""
        there = Touch(*(np.interp(rows, np.arange(len(c)), c) for c in self.path))
        return there._replace(roll=there.roll + columns * self.step)

    def frames(self, rows: Array, columns: Array, radius: float) -> Frame:
        """Platform frames (k,) at nodes; as `frames_of` at them, but worked out once for every row and every column."""
        level = frames_of(self.path, radius)
        turn = np.arange(self.columns) * self.step
        return rolled(some(level, rows), Angle(np.cos(turn)[columns], np.sin(turn)[columns]))

    def place_of(self, touch: Touch) -> tuple[float, float]:
        """Row and column of a pose (numbers) that lies on the path but for its roll."""
        fine = np.linspace(0, self.shape[0] - 1, 8 * self.shape[0])
        there = self.at(fine, np.zeros(len(fine)))
        off = sum((own - c) ** 2 for own, c in zip(there[:5], touch[:5], strict=True))
        row = int(np.argmin(off))
        return float(fine[row]), float((touch.roll - there.roll[row]) / self.step)

    def is_near(self, places: Sequence[tuple[float, float]], rows: Array | None = None, columns: Array | None = None) -> Array:
        """Which nodes are nearer than `AROUND` cells to some places; of other rows and columns where these are given."""
        own_rows = np.arange(self.shape[0]) if rows is None else rows
        own_columns = np.arange(self.columns) if columns is None else columns
        found = np.zeros((len(own_rows), len(own_columns)), dtype=bool)
        for row, column in places:
            off = (own_columns - column + self.columns / 2) % self.columns - self.columns / 2
            found |= np.hypot(own_rows[:, None] - row, off) < AROUND
        return found

    @property
    def corners(self) -> Array:
        """Rows at which the path turns, in its coordinates, but for its ends."""
        turns: Array = np.abs(np.diff(np.stack(self.path), 2)).max(axis=0) > 1e-12
        return np.flatnonzero(turns) + 1


class Field(NamedTuple):
    """Values over a grid, (rows, columns)."""

    value: Array
    """What is to be great; minus infinity where the pose is not allowed."""
    side: Array
    """Sign of det J_x where the pose is allowed, else 0."""


class Along(NamedTuple):
    """What is met along a way, at samples (n,)."""

    touch: Touch
    rows: Array
    """Where they are along the rows of the grid."""
    value: Array
    """Minus infinity where the pose is not allowed."""
    travel: Array
    clearance: Array
    """m; infinite where bodies are not looked at."""
    sigma_min: Array


def frames_of(touch: Touch, radius: float) -> Frame:
    """Platform frames, as NumPy arrays (n,)."""
    normal, _, _ = tangent_axes(touch.azimuth, touch.tilt)
    place = np.stack([c + radius * n for c, n in zip(touch[:3], normal, strict=True)], axis=-1)
    return zyz_frame(place, *touch[3:])


def some(poses: Frame, which: Any) -> Frame:
    """Some of the poses (n,)."""
    return jax.tree.map(lambda c: c[which], poses)


def field_of(rules: Rules, grid: RollGrid, mask: Array | None = None) -> Field:
    """Values over a grid; only where a mask (rows, columns) is set, when there is one."""
    rows, columns = np.nonzero(np.ones(grid.shape, dtype=bool) if mask is None else mask)
    value, side = np.full(grid.shape, -np.inf), np.zeros(grid.shape)
    poses = grid.frames(rows, columns, rules.radius)
    if rules.limits:
        good = travel_margin(rules.machine, poses, rules.signs) > RESERVE_TRAVEL
        rows, columns, poses = rows[good], columns[good], some(poses, good)
    if rules.scene is not None and len(rows):
        good = clearance(rules.machine, rules.scene, poses, rules.signs, rules.workpiece) > rules.gap + RESERVE_GAP
        rows, columns, poses = rows[good], columns[good], some(poses, good)
    if len(rows):
        found = control(rules.machine, poses, rules.signs)
        worth = _worth(rules, poses, found.sigma_min)
        good = (found.side != 0) & (found.sigma_min >= rules.least_sigma) & np.isfinite(worth)
        value[rows, columns] = np.where(good, worth, -np.inf)
        side[rows, columns] = np.where(good, found.side, 0.0)
    return Field(value, side)


def _worth(rules: Rules, poses: Frame, sigma: Array) -> Array:
    """The least of all aims, each over its unit; minus infinity where one of them is not known."""
    least = np.full(len(sigma), np.inf)
    for aim in rules.aims:
        own = sigma
        if aim.scalar is not None:
            mechanism = jax.tree.map(jnp.asarray, rules.machine.mechanism)
            own = in_batches(partial(_stiffness, mechanism, signs=rules.signs, scalar=aim.scalar), poses)
        least = np.minimum(least, np.where(np.isfinite(own), own, -np.inf) / aim.unit)
    return least


@partial(jax.jit, static_argnames="scalar")
def _stiffness(mechanism: Any, poses: Frame, *, signs: Any, scalar: Objective) -> Any:
    return jax.vmap(lambda pose: scalar(platform_stiffness(mechanism, pose, signs)[0]))(poses)


def best_way(field: Field, start: Array, *, all_round: bool) -> tuple[Way | None, int, float]:
    """The widest way on one side of all Type 2 singularities, from a start in the first row to the last row.

    Returns:
        The way; the last row to which any way leads, -1 for none; and the side.
    """
    end = np.zeros(field.value.shape, dtype=bool)
    end[-1] = True
    found = []
    for side in (-1.0, 1.0):
        way = widest(np.where(field.side == side, field.value, -np.inf), start, end, all_round=all_round)
        if way is not None:
            found.append((way, len(end) - 1, side))
    if found:
        return max(found, key=lambda one: one[0].value)
    row, side = max((farthest(field.side == side, start, all_round=all_round), -side) for side in (-1.0, 1.0))
    return None, row, -side


def refined(
    rules: Rules, grid: RollGrid, way: Way, side: float, start: Array, blocked: Sequence[tuple[float, float]]
) -> tuple[Array, Array]:
    """A way sought again on grids that become finer about it: places (k,) along the rows and columns of the first grid."""
    from scipy.ndimage import binary_dilation

    rows, columns, scale = way.rows, way.columns, 1
    allowed = np.flatnonzero(start[0])
    for _ in range(LEVELS):
        fine = scale * FINER
        low = (columns.min() - 2) * FINER
        shape = (grid.shape[0] - 1) * fine + 1, int((columns.max() + 2) * FINER - low + 1)
        if math.prod(shape) > LARGEST_GRID:  # a way that goes round and round, say
            break
        mask = np.zeros(shape, dtype=bool)
        mask[rows * FINER, columns * FINER - low] = True
        mask = binary_dilation(mask, np.ones((4 * FINER + 1, 4 * FINER + 1)))
        own = (low + np.arange(mask.shape[1])) / fine
        mask &= ~grid.is_near(blocked, np.arange(mask.shape[0]) / fine, own)
        places = grid.at(np.arange(mask.shape[0]) / fine, np.full(mask.shape[0], low / fine))
        field = field_of(rules, RollGrid(places, grid.step / fine, mask.shape[1]), mask)
        first, last = np.zeros(mask.shape, dtype=bool), np.zeros(mask.shape, dtype=bool)
        first[0], last[-1] = (len(allowed) == grid.columns) | np.isin(own % grid.columns, allowed), True
        found = widest(np.where(field.side == side, field.value, -np.inf), first, last, all_round=False)
        if found is None:  # closed between the nodes of the coarser grid
            break
        rows, columns, scale = found.rows, found.columns + low, fine
    return rows / scale, columns / scale


def simplified(rules: Rules, grid: RollGrid, rows: Array, columns: Array) -> tuple[Touch, Array]:
    """Knots of a way, with as many of its corners cut as its least value allows, and their places along the rows."""
    least = along(rules, grid.at(rows, columns), rows, grid.step).value.min()
    for allowance in ALLOWANCES:
        keep = straightened(rows, columns, allowance)
        keep = np.union1d(keep, np.searchsorted(rows, grid.corners))
        knots = grid.at(rows[keep], columns[keep])
        if along(rules, knots, rows[keep], grid.step).value.min() >= KEPT * least:
            return knots, rows[keep]
    return grid.at(rows, columns), rows


def straightened(rows: Array, columns: Array, allowance: float) -> Array:
    """Which nodes of a line to keep so that none is farther off than an allowance (Ramer 1972, Douglas and Peucker 1973)."""
    line = np.stack([rows, columns], axis=-1)
    keep, todo = {0, len(line) - 1}, [(0, len(line) - 1)]
    while todo:
        low, high = todo.pop()
        if high - low < 2:
            continue
        ahead, inner = line[high] - line[low], line[low + 1 : high] - line[low]
        part = np.clip(inner @ ahead / max(float(ahead @ ahead), 1e-300), 0.0, 1.0)
        off = np.linalg.norm(inner - part[:, None] * ahead, axis=1)
        if off.max() > allowance:
            middle = low + 1 + int(off.argmax())
            keep.add(middle)
            todo += [(low, middle), (middle, high)]
    return np.array(sorted(keep))


def along(rules: Rules, knots: Touch, rows: Array, step: float) -> Along:
    """What is met along straight pieces through knots (k,), at places along rows (k,); `step` as for `sampled`."""
    parts, _ = sampled(rules, knots, step)
    return met(rules, knots_at(knots, parts), np.interp(parts, np.arange(len(rows)), rows))


def sampled(rules: Rules, knots: Touch, step: float) -> tuple[Array, Array]:
    """Where samples are along straight pieces through knots (k,), counted in these, and which samples the knots are.

    Two lie in every turn by `step` (rad), and in every move by that part of the machine's size.
    """
    change = np.abs(np.diff(np.stack(knots), axis=1))
    change[:3] /= float(rules.machine.characteristic_length)
    counts = np.maximum(np.ceil(SAMPLES * change.max(axis=0) / step), SAMPLES).astype(int)
    ends = np.append(0, np.cumsum(counts))
    return np.interp(np.arange(ends[-1] + 1), ends, np.arange(len(ends))), ends


def knots_at(knots: Touch, parts: Array) -> Touch:
    """Poses (n,) between knots, at places counted in these."""
    return Touch(*(np.interp(parts, np.arange(len(c)), c) for c in knots))


def met(rules: Rules, samples: Touch, rows: Array) -> Along:
    """What is met at poses (n,) that hang together, at places along rows (n,)."""
    poses = frames_of(samples, rules.radius)
    travel, gap = travel_margin(rules.machine, poses, rules.signs), np.full(len(samples.roll), FAR)
    if rules.scene is not None:
        gap = clearance(rules.machine, rules.scene, poses, rules.signs, rules.workpiece)
    found = control(rules.machine, poses, rules.signs)
    is_allowed = found.side == found.side[0]
    if rules.limits:
        is_allowed &= travel >= 0
    if rules.scene is not None:
        is_allowed &= gap >= rules.gap
    value = np.where(is_allowed, _worth(rules, poses, found.sigma_min), -np.inf)
    return Along(samples, rows, value, travel, gap, found.sigma_min)


def degrees_of(touch: Touch, k: int) -> str:
    """Tilt and roll of a pose in words."""
    return f"tilt {math.degrees(touch.tilt[k]):.4g} deg, roll {math.degrees(touch.roll[k]) % 360:.4g} deg"
