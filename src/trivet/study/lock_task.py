"""For which poses drives are locked: those of a family and others between them, or a list."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.space.family import Family, Places
from trivet.space.pose import zyz_frame
from trivet.study.lock_values import Poses

Array = NDArray[Any]

BEST, AGAINST = "best", "-alpha"
"""Words for rolls: the best at every pose, and against the azimuth so that the platform leans without spinning."""
MOST = 2000
"""Poses at most."""

TaskLike = Family | Sequence[Sequence[float]] | Array


@dataclass(frozen=True)
class Task:
    """Poses to reach."""

    name: str
    roll: str
    """How the roll is chosen, in words: "given", "best", "-alpha", "30 deg"."""
    places: Places
    """(n,); where the roll is free it is None."""
    coordinate: Array | None
    """(n,) along a path; None for other tasks."""
    between: Places
    """Poses between them, at which results are checked; the same poses for a list."""
    family: Family | None

    @property
    def poses(self) -> Poses:
        """As the search takes them."""
        return poses_of(self.places)

    @property
    def checked(self) -> Poses:
        """Those between."""
        return poses_of(self.between)


def poses_of(places: Places) -> Poses:
    """Places as the search takes them."""
    flat = zyz_frame(places.position, places.azimuth, places.tilt, np.zeros(len(places.tilt)))
    return Poses(flat, places.roll)


def task_of(task: TaskLike, roll: str | float | None = None) -> Task:
    """A task from poses, (x, y, z, azimuth, tilt, roll) each in m and rad, or from a family.

    Args:
        task: the poses.
        roll: how the roll is chosen where the task leaves it open: "best" (for what is asked; also when not given), "-alpha",
            or an angle (rad).

    Raises:
        InputError: no pose, too many, one that is not finite, or a roll where the poses have their own.
    """
    if isinstance(task, Family):
        places, name = task.places(task.coordinates), task.name
        between = task.places(_between(task))
        known = np.all(np.isfinite(between.position), axis=1)
        between = between.some(np.flatnonzero(known))
    else:
        rows = [[float(c) for c in row] for row in task]
        if not rows or any(len(row) != 6 or not all(map(math.isfinite, row)) for row in rows):
            raise InputError("poses: a list of (x, y, z, azimuth, tilt, roll), finite numbers in m and rad, was expected")
        table = np.array(rows)
        places = Places(table[:, :3], table[:, 3], table[:, 4], table[:, 5])
        between, name = places, f"{len(rows)} poses" if len(rows) > 1 else "one pose"
    if len(places.tilt) > MOST:
        raise InputError(f"poses: {len(places.tilt)} of the {name}; at most {MOST} are looked at, take fewer steps")
    if places.roll is not None:
        if roll is not None:
            raise InputError(f"roll {roll}: the poses of the {name} have rolls of their own")
        words = "given"
    else:
        places, words = _with_roll(places, roll)
        between, _ = _with_roll(between, roll)
    along = task.coordinates[:, 0] if isinstance(task, Family) and places.roll is not None and _is_path(task) else None
    return Task(name, words, places, along, between, task if isinstance(task, Family) else None)


def _is_path(family: Family) -> bool:
    return len(family.spacing) == 1


def _between(family: Family) -> Array:
    """Coordinates half a step aside of those of the grid, in all directions."""
    if _is_path(family):
        return (family.coordinates[1:] + family.coordinates[:-1]) / 2
    steps = np.array([v for v in product((-0.5, 0.0, 0.5), repeat=len(family.spacing)) if any(v)]) * family.spacing
    tried = family.nearest((family.coordinates[:, None] + steps).reshape(-1, len(family.spacing)))
    _, first = np.unique(np.round(tried / family.spacing * 4), axis=0, return_index=True)
    return tried[np.sort(first)]


def _with_roll(places: Places, roll: str | float | None) -> tuple[Places, str]:
    if roll is None or roll == BEST:
        return places, BEST
    if roll == AGAINST:
        return places._replace(roll=-places.azimuth), AGAINST
    if isinstance(roll, str) or not math.isfinite(roll):
        raise InputError(f'roll "{roll}": expected an angle, {AGAINST} or {BEST}')
    return places._replace(roll=np.full(len(places.tilt), float(roll))), f"{math.degrees(roll):.6g} deg"
