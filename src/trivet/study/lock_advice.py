"""Which drives of a machine to lock for a task, and where."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.model import Machine
from trivet.study.lock_best import LockAdvice, Search, own_signs
from trivet.study.lock_measures import Goal, Measure, measure
from trivet.study.lock_stiffness import axis_stiffness
from trivet.study.lock_task import BEST, Task, TaskLike, task_of
from trivet.study.locks import LockSet, LockSets, lock_sets, with_drives_locked
from trivet.study.machines import MachineLike, choose

Array = NDArray[Any]
Modes = Literal["all", "own"]
"""Working modes that are looked at: every one that a lock set has, or the machine's own where a choice is one of its."""

EQUAL = 1e-3
"""Part of the greatest value within which sets are equal."""
LOCKED = "-locked"
"""What is put after the name of a machine locked as is best."""


@dataclass(frozen=True)
class LocksAdvised:
    """Advice for a task; the best set first, those that do not reach it last."""

    machine: Machine
    """Its drives free."""
    sets: LockSets
    task: Task
    measure: Measure
    signs: Array | None
    """(n_chains, 2) the one working mode that was looked at, where chains have the choice; None for all."""
    advices: tuple[LockAdvice, ...]
    own: LockAdvice | None
    """The locks of the machine's file as they are; None where they are no such set."""

    @property
    def as_is(self) -> float:
        """The least of the measure with the locks of the machine's file; NaN where they are no such set, or do not reach."""
        return math.nan if self.own is None else self.own.value

    @cached_property
    def reached(self) -> tuple[LockAdvice, ...]:
        """Sets that reach the whole task."""
        return tuple(advice for advice in self.advices if advice.holding is not None)

    @property
    def best(self) -> LockAdvice:
        """The best of all; of those that are equal, see `equal`, the file's own drives, or what has the most to spare."""
        return self.advices[0]

    @cached_property
    def equal(self) -> tuple[LockAdvice, ...]:
        """The sets whose value is the greatest, or less by no more than `EQUAL`; the best is the first of them."""
        return tuple(advice for advice in self.reached if _is_equal(advice, max(a.value for a in self.reached)))

    @cached_property
    def stiffness(self) -> tuple[dict[str, float], dict[str, float]]:
        """Of the best set and of the locks of the file: K and 1/C along x, y, z, each the least over the task, N/m.

        Empty for a file whose locks are no such set, or do not reach the task.
        """
        poses, kept = self.task.poses, self.best.holding
        assert kept is not None
        own = None if self.own is None else self.own.holding
        return axis_stiffness(kept, poses), {} if own is None else axis_stiffness(own, poses)

    @cached_property
    def locked(self) -> Machine:
        """The machine, locked as is best, with a line of that in its description."""
        held = with_drives_locked(self.machine, self.best.coordinates)
        line = f"Locked on {datetime.date.today().isoformat()} for the greatest {self.measure.name} ({self.task.name})."
        about = replace(
            held.about,
            name=held.name if held.name.endswith(LOCKED) else held.name + LOCKED,
            description=f"{held.about.description} {line}".strip(),
            published=(),
            published_dynamic=(),
        )
        return replace(held, about=about, home=replace(held.home, mode=self.best.mode))


def _is_equal(advice: LockAdvice, greatest: float) -> bool:
    return advice.value >= greatest - EQUAL * abs(greatest)


def advise_locks(
    machine: MachineLike,
    task: TaskLike,
    goal: Goal | str = "1/C_xx",
    *,
    roll: str | float | None = None,
    modes: Modes = "all",
    progress: Callable[[str, int, int], None] = lambda doing, done, total: None,
) -> LocksAdvised:
    """Which drives to lock, and where, so that the least of a measure over a task is greatest.

    Every lock set that leaves six freedoms is tried, with coordinates of its own for every chain.  Results are checked at poses
    between those of the task, the worst of which join the search.  What is found is the best of a grid and of what can be
    climbed to from there: a narrow hill between the points of the grid can be missed.

    Args:
        machine: machine, name or file, with more drives than six.
        task: a family of poses (a path, a surface), or a list of (x, y, z, azimuth, tilt, roll) in m and rad.
        goal: what is to be great, or its objective alone: "K_xx", "1/C_zz", ..., "D_xx", "sigma_min", "travel", or "1/rate".
        roll: where the task leaves the roll open: "best" for the goal (also when not given), "-alpha", or an angle (rad).
        modes: which working modes are looked at.
        progress: called with what is done, and how much of how many.

    Raises:
        InputError: a machine with no drive to spare, a goal that is none, or a dynamic stiffness with a free roll.
        NoResultError: no lock set reaches the whole task.
    """
    chosen = choose(machine)
    free = chosen.with_free_drives()
    goal = Goal(goal) if isinstance(goal, str) else goal
    asked, own = measure(free, goal), task_of(task, roll)
    if own.roll == BEST and goal.is_dynamic:
        raise InputError(f"objective {goal.objective}: wants rolls that are known; give the roll as an angle or -alpha")
    if modes not in ("all", "own"):
        raise InputError(f"modes '{modes}': expected all, or own for the machine's")
    sets = lock_sets(chosen)
    if not sets.whole:
        raise NoResultError(f"{free.name}: no set of {sets.spare} locked drives leaves six freedoms: {sets.sets[0].verdict}")
    signs = own_signs(chosen) if modes == "own" else None
    search = Search(free, asked, own, signs)
    found = []
    for k, one in enumerate(sets.whole):
        progress("lock sets", k, len(sets.whole))
        found.append(search.advise(one))
    progress("lock sets", len(sets.whole), len(sets.whole))
    as_is = search.as_is(chosen, sets)
    advices = _ordered(found, None if as_is is None else as_is.locks)
    if advices[0].holding is None:
        raise NoResultError(
            f"{free.name}: no lock set reaches all of the task ({own.name}); with {advices[0].locks.name}: {advices[0].reason}"
        )
    return LocksAdvised(free, sets, own, asked, signs, advices, as_is)


def _ordered(found: list[LockAdvice], own: LockSet | None) -> tuple[LockAdvice, ...]:
    """The best first; of those that are equal the file's own set, then what has most to spare."""
    greatest = max((advice.value for advice in found if advice.holding is not None), default=0.0)

    def rank(advice: LockAdvice) -> tuple[float, ...]:
        if advice.holding is None:
            return (2,)
        if _is_equal(advice, greatest):
            return 0, advice.locks != own, -round(advice.spare, 6), -advice.value
        return 1, -advice.value

    return tuple(sorted(found, key=rank))
