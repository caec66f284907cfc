"""A measure, and margins of travel, at many coordinates of the spare drives and many poses; their slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.held import Held
from trivet.kinematics.inverse import branches
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled
from trivet.study.lock_measures import Measure

Array = NDArray[Any]

BEYOND = 1e-9
"""Margin of travel below zero that is rounding."""


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


class Holding(NamedTuple):
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


def picked(frames: Frame, index: Array) -> Frame:
    """Some of the frames (p,)."""
    found: Frame = jax.tree.map(lambda c: np.asarray(c)[index], frames)
    return found


def turned(frames: Frame, rolls: Array) -> Frame:
    """Frames (m,) turned about their normals."""
    return rolled(frames, Angle(np.cos(rolls), np.sin(rolls)))


def split(ways: Sequence[Held], values: Array) -> list[Array]:
    """Coordinates (..., d) chain by chain."""
    return np.split(values, np.cumsum([len(way.low) for way in ways])[:-1], axis=-1)


def ends(ways: Sequence[Held]) -> tuple[Array, Array]:
    """(d,) lowest and highest coordinates of the held drives."""
    return np.concatenate([way.low for way in ways]), np.concatenate([way.high for way in ways])


def span(ways: Sequence[Held]) -> Array:
    """(d,) travel of the held drives."""
    low, high = ends(ways)
    return high - low


def mode_of(ways: Sequence[Held]) -> str:
    """The working mode, as the machine so locked has it."""
    groups = ["".join("+" if way.signs[b] > 0 else "-" for b in branches(way.leg)) for way in ways]
    return " ".join(group for group in groups if group)


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


def over_poses(asked: Measure, ways: Sequence[Held], values: Array, frames: Frame, rolls: Array) -> Array:
    """(m, p) the measure at coordinates (m, d), each at all poses (p,)."""
    m, p = (a.ravel() for a in np.indices((len(values), len(rolls))))
    return values_at(asked, ways, values[m], picked(frames, p), rolls[p]).reshape(len(values), len(rolls))


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
