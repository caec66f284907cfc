"""Tilt: how far a platform can lean while it touches a sphere, with the best roll (paper section 3.1).

The poses are those of a grid of azimuth, tilt and roll.  Neighbours on the grid that are both reached and on the same side of
every Type 2 singularity are connected; what lies between them is not looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.model import Machine
from trivet.reach.margins import clearance, side, travel_margin, travel_margin_on_grid
from trivet.reach.scene import Ball, Scene
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled, tangent_axes
from trivet.space.vector import Vec

Array = NDArray[Any]

ASKEW = 0.382
"""Of a step, by which the rolls of a grid are off the symmetries of machines: at a roll of symmetry a carriage can stand where
it would jump to either side, and a pose which is reached there and at no roll beside it is of no use."""
HALVINGS = 14
"""Of the last step of tilt, where the edge is refined."""
ZOOMS = 6
"""Of the roll about the best of a grid, four-fold each: from two degrees to below a thousandth."""
HILLS = 3
"""Best rolls of a grid about which it is looked closer."""
OUTSIDE = -0.05
"""Margin of travel below which distances of bodies are not looked at."""


class Grid(NamedTuple):
    """Poses on a sphere: the platform centre touches it, the platform normal is that of the sphere."""

    centre: tuple[float, float, float]
    """In {O}, m."""
    radius: float
    """m."""
    azimuths: Array
    """(a,) rad, evenly all round from zero."""
    tilts: Array
    """(b,) rad, from zero."""
    rolls: Array
    """(c,) rad, evenly all round, c a multiple of a: at the pole all azimuths then meet in the same poses."""

    @classmethod
    def of(cls, centre: tuple[float, float, float], radius: float, azimuths: int, step: float, most: float, rolls: int) -> Grid:
        """A grid.

        Args:
            centre, radius: of the sphere, m.
            azimuths: how many.
            step: of the tilt, rad.
            most: greatest tilt, rad.
            rolls: at least so many.
        """
        turns = azimuths * max(1, -(-rolls // azimuths))
        return cls(
            centre,
            radius,
            2 * np.pi / azimuths * np.arange(azimuths),
            np.unique([*(step * np.arange(int(most / step + 1e-9) + 1)), most]),
            2 * np.pi / turns * (np.arange(turns) + ASKEW),
        )

    def frames(self, azimuth: Array, tilt: Array) -> Frame:
        """Poses without roll at azimuths and tilts (n,)."""
        normal, x, y = tangent_axes(azimuth, tilt)
        return Frame(Vec(*(c + self.radius * v for c, v in zip(self.centre, normal, strict=True))), x, y, normal)


class Reached(NamedTuple):
    """What of a grid is reached."""

    inside: Array
    """(a, b, c) whether all joints are inside their travel and all bodies apart."""
    roll: Array
    """(a, b) index of the roll with the greatest margin of travel among those that are reached; -1 where there is none."""


class Looked(NamedTuple):
    """How a grid is looked at."""

    machine: Machine
    signs: Any
    """(n_chains, 2) working mode."""
    scene: Scene | None
    """Bodies that must stay apart; None when they need not."""
    workpiece: Ball | None


def inside(looked: Looked, grid: Grid, progress: Callable[[int], None] = lambda azimuths: None) -> Reached:
    """Which poses of a grid are reached."""
    found, rolls = [], []
    for azimuth in grid.azimuths:
        frames = grid.frames(np.full(len(grid.tilts), azimuth), grid.tilts)
        margin = travel_margin_on_grid(looked.machine, frames, grid.rolls, looked.signs)
        good = margin >= 0
        rows, columns = np.nonzero(good)
        good[rows, columns] = is_clear(looked, turned(frames, rows, grid.rolls[columns]))
        best = np.where(good, margin, -np.inf)
        rolls.append(np.where(good.any(axis=1), best.argmax(axis=1), -1))
        found.append(good)
        progress(1)
    return Reached(np.stack(found), np.stack(rolls))


def is_clear(looked: Looked, poses: Frame) -> Array:
    """Whether all bodies are far enough apart, at poses (n,)."""
    count = len(poses.origin.x)
    if looked.scene is None or not count:
        return np.ones(count, dtype=bool)
    least = float(looked.machine.apart.clearance)
    clear: Array = clearance(looked.machine, looked.scene, poses, looked.signs, looked.workpiece) >= least
    return clear


def best_rolls(looked: Looked, frames: Frame, rolls: Array) -> tuple[Array, Array]:
    """Per frame (n,) the reached roll with the greatest margin of travel, and that margin; -1 and minus infinity for none.

    Bodies are looked at only for the best roll, and for the next best where they touch there: cones and strokes of joints end
    most motions before a collision does.
    """
    margin = travel_margin_on_grid(looked.machine, frames, rolls, looked.signs)
    margin[margin < 0] = -np.inf
    rows = np.arange(len(margin))
    best = margin.argmax(axis=1)
    todo = rows[np.isfinite(margin[rows, best])]
    while len(todo):
        clear = is_clear(looked, turned(frames, todo, rolls[best[todo]]))
        touching = todo[~clear]
        margin[touching, best[touching]] = -np.inf
        best[touching] = margin[touching].argmax(axis=1)
        todo = touching[np.isfinite(margin[touching, best[touching]])]
    value = margin[rows, best]
    return np.where(np.isfinite(value), best, -1), value


def turned(frames: Frame, rows: Array, rolls: Array) -> Frame:
    """Some of the frames (n,), by their numbers, each turned about its own normal by a roll (rad)."""
    return rolled(_of(frames, rows), Angle(np.cos(rolls), np.sin(rolls)))


def _of(frames: Frame, rows: Array) -> Frame:
    return Frame(*(Vec(*(np.broadcast_to(c, len(frames.origin.x))[rows] for c in v)) for v in frames))


def unbroken(reached: Array) -> Array:
    """(a,) the last of the tilts up to which all are reached, as an index; -1 where the pole itself is not.  Takes (a, b)."""
    return np.where(reached.all(axis=1), reached.shape[1], (~reached).argmax(axis=1)) - 1


def refined(looked: Looked, grid: Grid, last: Array) -> Array:
    """(a,) tilt (rad) up to which all is reached, with rolls and tilts between those of the grid, by halving.

    Args:
        looked, grid: as for `inside`.
        last: (a,) the last tilt of the grid up to which all are reached, see `unbroken`.
    """
    top = len(grid.tilts) - 1
    last, rising = last.copy(), (last >= 0) & (last < top)
    while rising.any():  # a window of rolls can be narrower than the grid's step and go on nevertheless
        rows = np.flatnonzero(rising)
        rising[rows] = _some_roll(looked, grid, grid.azimuths[rows], grid.tilts[last[rows] + 1])
        last += rising
        rising &= last < top
    low = np.where(last >= 0, grid.tilts[last], np.nan)
    high = np.where((last == top) | (last < 0), low, grid.tilts[np.minimum(last + 1, top)])
    rows = np.flatnonzero(low < high)
    for _ in range(HALVINGS if len(rows) else 0):
        middle = (low[rows] + high[rows]) / 2
        good = _some_roll(looked, grid, grid.azimuths[rows], middle)
        low[rows], high[rows] = np.where(good, middle, low[rows]), np.where(good, high[rows], middle)
    return low


def _some_roll(looked: Looked, grid: Grid, azimuth: Array, tilt: Array) -> Array:
    """Whether some roll reaches poses (n,) of a sphere: one of the grid, or one about its best."""
    frames = grid.frames(azimuth, tilt)
    found: Array = best_rolls(looked, frames, grid.rolls)[0] >= 0
    rows = np.flatnonzero(~found)
    if len(rows):
        found[rows] = freest_roll(looked, _of(frames, rows), grid.rolls)[1] >= 0
    return found


def freest_roll(looked: Looked, frames: Frame, rolls: Array) -> tuple[Array, Array]:
    """(n,) of frames (n,) the roll with the greatest `freedom`, between those of a grid as well, and that freedom."""
    count, step = len(frames.origin.x), 2 * np.pi / len(rolls)
    values = freedom(looked, frames, np.broadcast_to(rolls, (count, len(rolls))))
    tops = np.where((values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1)), values, -np.inf)
    best = rolls[np.argsort(-tops, axis=1, kind="stable")[:, :HILLS]]
    for level in range(1, ZOOMS + 1):
        tried = best[:, :, None] + step * 0.25**level * np.arange(-4, 5)
        values = freedom(looked, frames, tried.reshape(count, -1)).reshape(tried.shape)
        best = np.take_along_axis(tried, values.argmax(axis=2)[:, :, None], 2)[:, :, 0]
    value, rows = values.max(axis=2), np.arange(count)
    hill = value.argmax(axis=1)
    return best[rows, hill], value[rows, hill]


def freedom(looked: Looked, frames: Frame, rolls: Array) -> Array:
    """(n, m) how free frames (n,) are at rolls (n, m): the lesser of the margin of travel and the distance of bodies to spare.

    The distance counts in parts of the machine's size; where a joint is well outside its travel it is not looked at.
    """
    count, many = rolls.shape
    rows = np.repeat(np.arange(count), many)
    margin = travel_margin(looked.machine, turned(frames, rows, rolls.ravel()), looked.signs)
    near = np.flatnonzero(margin > OUTSIDE)
    if looked.scene is not None and len(near):
        gap = clearance(
            looked.machine, looked.scene, turned(frames, rows[near], rolls.ravel()[near]), looked.signs, looked.workpiece
        )
        spare = gap - float(looked.machine.apart.clearance)
        margin[near] = np.minimum(margin[near], spare / float(looked.machine.characteristic_length))
    return margin.reshape(count, many)


def hanging_together(sides: Array, start: int) -> Array:
    """(a, b, c) what hangs together with azimuth 0, tilt 0 and a roll (an index).

    Args:
        sides: (a, b, c) the side of every singularity on which a pose is, 1 or -1; others are not reached.  Azimuth and roll go
            all round, and c is a multiple of a.
        start: the roll.
    """
    from scipy.ndimage import label
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    labels, count = np.zeros(sides.shape, dtype=np.int64), 0
    for sign in (-1, 1):
        own, many = label(sides == sign)
        labels[own > 0] = own[own > 0] + count
        count += many
    if not labels[0, 0, start]:
        return np.zeros(sides.shape, dtype=bool)
    seams = [(labels[-1], labels[0], sides[-1] == sides[0]), (labels[..., -1], labels[..., 0], sides[..., -1] == sides[..., 0])]
    # At the pole a pose depends on azimuth and roll together.
    shift = sides.shape[2] // sides.shape[0]
    turned_labels, turned_sides = (np.stack([np.roll(of[i, 0], i * shift) for i in range(len(of))]) for of in (labels, sides))
    pole = np.broadcast_to(turned_labels[0], turned_labels[1:].shape)
    seams.append((turned_labels[1:], pole, turned_sides[1:] == turned_sides[0]))
    first = np.concatenate([a[(a > 0) & (b > 0) & same] for a, b, same in seams])
    second = np.concatenate([b[(a > 0) & (b > 0) & same] for a, b, same in seams])
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(count + 1, count + 1))
    _, component = connected_components(graph, directed=False)
    found: Array = (component[labels] == component[labels[0, 0, start]]) & (labels > 0)
    return found


def sides_of(looked: Looked, grid: Grid, inside: Array) -> Array:
    """(a, b, c) sign of det J_x where a pose of a grid is inside, zero where not."""
    found = np.zeros(inside.shape)
    for i, azimuth in enumerate(grid.azimuths):
        rows, columns = np.nonzero(inside[i])
        if len(rows):
            frames = grid.frames(np.full(len(grid.tilts), azimuth), grid.tilts)
            found[i, rows, columns] = side(looked.machine, turned(frames, rows, grid.rolls[columns]), looked.signs)
    return found
