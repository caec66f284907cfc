"""Workspace: where the platform centre can go, with one orientation, with some of a set, or with all of them.

Space is cut into columns along z. In each the places where it begins and ends are sampled and then found by halving, so that a
volume is a sum of lengths, not of cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.reach.margins import side, travel_margin, travel_margin_on_grid
from trivet.reach.tilt import Looked, is_clear
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled, tangent_axes
from trivet.space.vector import Vec

Array = NDArray[Any]

Kind = Literal["constant", "reachable", "total"]

HALVINGS = 14
"""Of a sample's height, to find where a column enters or leaves."""
POINTS = 16_384
"""Places looked at per call."""
COARSE = (24, 48, 96)
"""Cells per axis of the lattices with which it is found where the workspace lies; finer ones where the first find nothing."""


LAYERS = 4
"""Of places, in the layer about a region that is looked at for more of a workspace."""
CLOSER = (16.0, 128.0, 1024.0)
"""Parts of the whole region that lattices about home take up, where the whole shows nothing."""


class Orientations(NamedTuple):
    """A set of orientations: directions of the platform normal, each with rolls of which any will do."""

    azimuth: Array
    """(d,) rad."""
    tilt: Array
    """(d,) rad."""
    rolls: Array
    """(d, m) rad."""

    @classmethod
    def one(cls, azimuth: float, tilt: float, roll: float) -> Orientations:
        """A single one."""
        return cls(np.array([azimuth]), np.array([tilt]), np.array([[roll]]))

    @classmethod
    def cone(cls, most: float, step: float, rolls: Array) -> Orientations:
        """All directions within an angle (rad) of z, about evenly spaced by a step; each with any of the rolls (m,)."""
        tilts = np.linspace(0.0, most, max(2, int(np.ceil(most / step)) + 1))
        azimuth, tilt = [], []
        for own in tilts:
            count = max(1, int(np.ceil(2 * np.pi * np.sin(own) / step - 1e-9)))
            azimuth.append(2 * np.pi / count * np.arange(count))
            tilt.append(np.full(count, own))
        directions = np.concatenate(azimuth), np.concatenate(tilt)
        return cls(*directions, np.broadcast_to(rolls, (len(directions[0]), len(rolls))))

    def one_by_one(self) -> Orientations:
        """Every roll of every direction as a direction of its own, so that none will do for another."""
        many = self.rolls.shape[1]
        return Orientations(np.repeat(self.azimuth, many), np.repeat(self.tilt, many), self.rolls.reshape(-1, 1))


class Region(NamedTuple):
    """A box in {O}, m."""

    low: Array
    """(3,)."""
    high: Array
    """(3,)."""


class Columns(NamedTuple):
    """A workspace in columns."""

    x: Array
    """(a,) middles of the columns, m."""
    y: Array
    """(b,)."""
    spans: tuple[tuple[Array, Array], ...]
    """Per column, x by x, the heights at which the workspace begins and ends, m."""

    @property
    def lengths(self) -> Array:
        """(a, b) how much of each column belongs to the workspace, m."""
        own = [float(np.sum(high - low)) for low, high in self.spans]
        return np.array(own).reshape(len(self.x), len(self.y))

    @property
    def cell(self) -> float:
        """Cross-section of a column, m^2."""
        return float((self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))

    @property
    def volume(self) -> float:
        """m^3."""
        return float(self.lengths.sum() * self.cell)

    @property
    def error(self) -> float:
        """Estimate of the volume's error, m^3: the larger of two.

        Half the greatest difference from what one column in four tells, of four ways to take them, for the error of a lattice
        falls faster than its spacing; and what it makes if the step between any two neighbours lies anywhere between them, by
        the same chance everywhere.
        """
        lengths = self.lengths
        parts = [lengths[i::2, j::2].mean() * lengths.size for i in (0, 1) for j in (0, 1)]
        quarters = max(abs(part - lengths.sum()) for part in parts) / 2
        steps = math.sqrt(sum(float(np.sum(np.diff(lengths, axis=axis) ** 2)) for axis in (0, 1)) / 12)
        return float(max(quarters, steps) * self.cell)


def reached(looked: Looked, points: Array, kind: Kind, orientations: Orientations) -> Array:
    """Whether places (n, 3) of the platform centre (m) belong to a workspace."""
    found = []
    for start in range(0, len(points), POINTS):
        found.append(_reached(looked, points[start : start + POINTS], kind, orientations))
    return np.concatenate(found) if found else np.zeros(0, dtype=bool)


def _reached(looked: Looked, points: Array, kind: Kind, orientations: Orientations) -> Array:
    """Direction by direction, only where it is still open; the greatest tilts first, which are the hardest."""
    wanted = kind == "reachable"
    found = np.full(len(points), not wanted)
    for azimuth, tilt, rolls in list(zip(*orientations, strict=True))[:: 1 if kind == "reachable" else -1]:
        todo = np.flatnonzero(found != wanted) if wanted else np.flatnonzero(found)
        if not len(todo):
            break
        found[todo] = _with_some_roll(looked, points[todo], azimuth, tilt, rolls)
    return found


def _with_some_roll(looked: Looked, points: Array, azimuth: float, tilt: float, rolls: Array) -> Array:
    normal, x, y = tangent_axes(np.full(len(points), azimuth), np.full(len(points), tilt))
    frames = Frame(Vec(*points.T), x, y, normal)
    if len(rolls) == 1:
        poses = rolled(frames, Angle(np.cos(rolls[0]), np.sin(rolls[0])))
        good = travel_margin(looked.machine, poses, looked.signs) >= 0
        inside = np.flatnonzero(good)
        good[inside] = is_clear(looked, _some(poses, inside))
        return good
    margin = travel_margin_on_grid(looked.machine, frames, rolls, looked.signs)
    good = np.zeros(len(points), dtype=bool)
    for column in np.argsort(-margin, axis=1).T:
        todo = np.flatnonzero(~good & (margin[np.arange(len(points)), column] >= 0))
        if not len(todo):
            break
        own = rolls[column[todo]]
        good[todo] = is_clear(looked, rolled(_some(frames, todo), Angle(np.cos(own), np.sin(own))))
    return good


def _some(frames: Frame, rows: Array) -> Frame:
    return Frame(*(Vec(*(np.broadcast_to(c, len(frames.origin.x))[rows] for c in v)) for v in frames))


def found_region(within: Callable[[Array], Array], around: Region, home: Array) -> Region | None:
    """The part of a region in which a workspace lies, as a coarse lattice sees it, with a cell to spare; None for nothing.

    Where lattices over the region find nothing, smaller ones about home (3,) may: a long slide can make the region much larger
    than the workspace is.
    """
    looks = [(around, count) for count in COARSE]
    size = around.high - around.low
    looks += [(Region(home - size / part, home + size / part), COARSE[0]) for part in CLOSER]
    for region, count in looks:
        cell = (region.high - region.low) / count
        points = _lattice(region, [count] * 3)
        good = points[within(points)]
        if len(good):
            break
    else:
        return None
    # Not evenly: four quarters of a symmetric lattice would agree, and tell nothing of the error.
    return Region(good.min(axis=0) - 1.37 * cell, good.max(axis=0) + 1.81 * cell)


def grown(within: Callable[[Array], Array], region: Region, around: Region, count: int) -> Region:
    """A region made larger, up to a greatest one, until nothing is found in a layer about it, looked at as finely as columns.

    Petals of a workspace can be so thin that a coarse lattice sees none of their ends.
    """
    low, high = np.maximum(region.low, around.low), np.minimum(region.high, around.high)
    growing = True
    while growing:
        growing, layer = False, (high - low) / 6
        for axis in range(3):
            for end in (0, 1):
                inner = (low, high)[end][axis]
                outer = max(inner - layer[axis], around.low[axis]) if end == 0 else min(inner + layer[axis], around.high[axis])
                if abs(outer - inner) <= 1e-9 * layer[axis]:
                    continue
                first, last = np.maximum(low - layer, around.low), np.minimum(high + layer, around.high)
                first[axis], last[axis] = min(inner, outer), max(inner, outer)
                if within(_lattice(Region(first, last), [LAYERS if k == axis else count for k in range(3)])).any():
                    (low, high)[end][axis] = outer
                    growing = True
    return Region(low, high)


def _lattice(region: Region, counts: Sequence[int]) -> Array:
    """Middles of the cells of a region, (n, 3)."""
    axes = [
        low + (high - low) / count * (np.arange(count) + 0.5)
        for low, high, count in zip(region.low, region.high, counts, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def columns(
    within: Callable[[Array], Array],
    region: Region,
    count: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Columns:
    """A workspace in a region, in count x count columns of count samples each."""
    size = (region.high - region.low) / count
    x, y, z = (region.low[k] + size[k] * (np.arange(count) + 0.5) for k in range(3))
    heights = np.concatenate([region.low[2:], z, region.high[2:]])
    parts = []
    for i, own_x in enumerate(x):
        points = np.stack(np.meshgrid([own_x], y, z, indexing="ij"), axis=-1).reshape(-1, 3)
        padded = np.pad(within(points).reshape(count, count), ((0, 0), (1, 1)))
        row, edge = np.nonzero(padded[:, 1:] != padded[:, :-1])
        parts.append((np.full(len(row), i), row, edge, padded[row, edge]))
        progress(i + 1, count)
    column, row, edge, starts_inside = (np.concatenate(part) for part in zip(*parts, strict=True))
    at = _edges(within, x[column], y[row], heights[edge], heights[edge + 1], starts_inside)
    bounds = np.searchsorted(column * count + row, np.arange(count * count + 1))
    spans = tuple((at[low:high:2], at[low + 1 : high : 2]) for low, high in pairwise(bounds))
    return Columns(x, y, spans)


def joined(looked: Looked, columns: Columns, axes: Frame, home: Array) -> float:
    """The part of a workspace of one orientation that hangs together with a place, without a Type 2 singularity between.

    Args:
        looked: six actuators and six constraints.
        columns: the workspace.
        axes: the orientation; its origin is not looked at.
        home: (3,) the place, m.

    Returns:
        As cells of a lattice as fine as the columns tell; zero where the place does not belong to the workspace.
    """
    from scipy.ndimage import label

    count, (a, b) = len(columns.x), (len(columns.x), len(columns.y))
    ends = [end for span in columns.spans for edges in span for end in edges]
    z = np.linspace(min(ends), max(ends), 2 * count)
    inside = np.zeros((a, b, len(z)), dtype=bool)
    for column, (lows, highs) in enumerate(columns.spans):
        for low, high in zip(lows, highs, strict=True):
            inside[column // b, column % b] |= (z >= low) & (z <= high)
    i, j, k = np.nonzero(inside)
    sides = np.zeros(inside.shape)
    places = Vec(columns.x[i], columns.y[j], z[k])
    turn = (Vec(*(np.full(len(i), float(c)) for c in axis)) for axis in axes[1:])
    sides[i, j, k] = side(looked.machine, Frame(places, *turn), looked.signs)
    nearest = tuple(int(np.argmin(np.abs(own - c))) for own, c in zip((columns.x, columns.y, z), home, strict=True))
    if not sides[nearest]:
        return 0.0
    pieces, _ = label(sides == sides[nearest])
    return float(np.mean(pieces[i, j, k] == pieces[nearest]))


def _edges(within: Callable[[Array], Array], x: Array, y: Array, low: Array, high: Array, starts_inside: Array) -> Array:
    for _ in range(HALVINGS if len(y) else 0):
        middle = (low + high) / 2
        same = within(np.stack([x, y, middle], axis=1)) == starts_inside
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return (low + high) / 2
