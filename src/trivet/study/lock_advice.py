"""Which drives of a machine to lock for a task, and where."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.held import Held, ways
from trivet.kinematics.inverse import branches, has_closed_form
from trivet.kinematics.mode import parse_mode
from trivet.model import Machine
from trivet.model.elements import Drivable
from trivet.space.frame import Frame
from trivet.study.lock_grid import Miss, Table, starts, table
from trivet.study.lock_measures import Goal, Measure, measure
from trivet.study.lock_search import polished, with_best_rolls
from trivet.study.lock_task import BEST, Task, TaskLike, task_of
from trivet.study.lock_values import Holding, Poses, mode_of, picked, split, turned
from trivet.study.locks import LockSet, LockSets, lock_sets, with_drives_locked
from trivet.study.machines import MachineLike, choose

Array = NDArray[Any]
Modes = Literal["all", "own"]
"""Working modes that are looked at: every one that a lock set has, or the machine's own where a choice is one of its."""

ROUNDS = 3
"""How often poses between those of the task that turn out worse join the search."""
JOINING = 6
"""So many of them at most, the worst first."""
WORSE = 1e-6
"""Part of the least by which they count as worse."""
BINDING = 1e-4
"""Margin of travel of a joint below which its limit binds."""


class WorstPose(NamedTuple):
    """Where a measure is least."""

    position: tuple[float, float, float]
    """m in {O}."""
    angles: tuple[float, float, float]
    """Azimuth, tilt, roll, rad."""


class Binding(NamedTuple):
    """A joint that comes to an end of its travel."""

    joint: str
    margin: float
    """`travel.Gauge.margin`: 0 at an end."""
    pose: WorstPose


@dataclass(frozen=True)
class LockAdvice:
    """The best that one set of drives allows, or why it does not serve."""

    locks: LockSet
    reason: str
    """Why some pose is not reached; empty where all are."""
    missed: WorstPose | None
    """The pose that is not reached."""
    holding: Holding | None
    """Where the drives are held, at the poses of the task; the measure there."""
    value: float
    """The least of the measure over the task and the poses between; NaN where some pose is not reached."""
    worst: WorstPose | None
    binding: tuple[Binding, ...]
    """Joints at an end of their travel, which keep the measure from being greater or bound what is reached."""

    @property
    def coordinates(self) -> dict[str, float]:
        """Where the drives are locked, m or rad."""
        if self.holding is None:
            return {}
        names = [name for way in self.holding.ways for name in way.drives]
        return dict(zip(names, self.holding.values.tolist(), strict=True))

    @property
    def mode(self) -> str:
        """The working mode, as the locked machine has it."""
        return "" if self.holding is None else mode_of(self.holding.ways)


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
    as_is: float
    """The least of the measure with the locks of the machine's file; NaN where they are no such set, or do not reach."""

    @cached_property
    def reached(self) -> tuple[LockAdvice, ...]:
        """Sets that reach the whole task."""
        return tuple(advice for advice in self.advices if advice.holding is not None)

    @property
    def best(self) -> LockAdvice:
        """The best of all."""
        return self.advices[0]

    @cached_property
    def locked(self) -> Machine:
        """The machine, locked as is best."""
        return with_drives_locked(self.machine, self.best.coordinates)


def advise_locks(
    machine: MachineLike,
    task: TaskLike,
    goal: Goal | str = "K_xx",
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
        goal: what is to be great, or its objective alone: "K_xx", "1/C_zz", ..., "D_xx", "sigma_min", or "travel".
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
    signs = _own_signs(chosen) if modes == "own" else None
    search = Search(free, asked, own, signs)
    found = []
    for k, one in enumerate(sets.whole):
        progress("lock sets", k, len(sets.whole))
        found.append(search.advise(one))
    progress("lock sets", len(sets.whole), len(sets.whole))
    order = sorted(range(len(found)), key=lambda k: (found[k].holding is None, -found[k].value if found[k].holding else 0.0))
    advices = tuple(found[k] for k in order)
    if advices[0].holding is None:
        raise NoResultError(
            f"{free.name}: no lock set reaches all of the task ({own.name}); with {advices[0].locks.name}: {advices[0].reason}"
        )
    return LocksAdvised(free, sets, own, asked, signs, advices, search.as_is(chosen, sets))


def _own_signs(machine: Machine) -> Array:
    """The machine's own signs; + where it has no such choice, or no closed form while its drives are free."""
    closed = all(has_closed_form(leg) for leg in machine.legs)
    return np.asarray(parse_mode(machine)) if closed else np.ones((len(machine.legs), 2))


class Search:
    """The lock sets of one machine for one task; what sets have in common is worked out once."""

    def __init__(self, machine: Machine, asked: Measure, task: Task, signs: Array | None) -> None:
        self.machine, self.asked, self.task, self.signs = machine, asked, task, signs
        self._tables: dict[tuple[int, tuple[str, ...]], Table | Miss] = {}

    def ways(self, locks: LockSet) -> list[list[Held]]:
        """Per chain, how it is held by a lock set.

        Raises:
            InputError: a chain has no closed form then, or a drive no travel.
        """
        made = []
        for number, leg in enumerate(self.machine.legs):
            joints = [name.partition(".")[2] for name in locks.drives if name.partition(".")[0] == leg.name]
            made.append(ways(self.machine, number, joints, None if self.signs is None else self.signs[number]))
        return made

    def table(self, held: list[Held]) -> Table | Miss:
        """A chain over the poses of the task."""
        key = held[0].number, held[0].joints
        if key not in self._tables:
            self._tables[key] = table(self.asked, held, self.task.poses)
        return self._tables[key]

    def advise(self, locks: LockSet) -> LockAdvice:
        """The best that a lock set allows."""
        try:
            held = self.ways(locks)
        except InputError as error:
            return _failed(locks, str(error))
        poses = self.task.poses
        tables = [self.table(own) for own in held]
        best: Holding | None = None
        for _ in range(ROUNDS):
            made = []
            for known in tables:
                if isinstance(known, Miss):
                    return _failed(locks, known.reason, _pose(poses, known.pose))
                made.append(known)
            again = None if best is None else with_best_rolls(self.asked, best, poses)
            begun = [again] if again is not None and math.isfinite(again.value) else starts(self.asked, made, poses)
            if not begun:
                return _failed(locks, "each chain reaches all poses, yet not with the same rolls")
            best = polished(self.asked, begun, poses)
            worse = self._worse(best)
            if not len(worse):
                break
            poses = poses.with_more(self.task.checked.some(worse))
            tables = [table(self.asked, own, poses) for own in held]
        assert best is not None
        return self._summed_up(locks, best)

    def _worse(self, holding: Holding) -> Array:
        """Which poses between those of the task are worse, the worst first."""
        least = with_best_rolls(self.asked, holding, self.task.checked).least
        order = np.argsort(least, kind="stable")[:JOINING]
        found: Array = order[~(least[order] >= holding.value - WORSE * abs(holding.value))]
        return found

    def _summed_up(self, locks: LockSet, holding: Holding) -> LockAdvice:
        on_task = with_best_rolls(self.asked, holding, self.task.poses)
        between = with_best_rolls(self.asked, holding, self.task.checked)
        both, least = self.task.poses.with_more(self.task.checked), np.concatenate([on_task.least, between.least])
        known = replace(both, rolls=np.concatenate([on_task.rolls, between.rolls]))
        worst = _pose(known, int(np.argmin(least)))
        if not np.all(np.isfinite(least)):
            first = int(np.argmin(least))
            parts = split(holding.ways, holding.values)
            one = _frame(known, first)
            reasons = [way.miss(own, one) for way, own in zip(holding.ways, parts, strict=True)]
            return _failed(locks, next((r for r in reasons if r), "a chain does not close between the poses"), worst)
        return LockAdvice(locks, "", None, on_task, float(least.min()), worst, self._binding(holding, known))

    def _binding(self, holding: Holding, poses: Poses) -> tuple[Binding, ...]:
        assert poses.rolls is not None
        found = []
        for way, own in zip(holding.ways, split(holding.ways, holding.values), strict=True):
            for joint, margins in way.margins(np.tile(own, (len(poses), 1)), poses.frames, poses.rolls).items():
                at = int(np.argmin(margins))
                if margins[at] < BINDING:
                    found.append(Binding(joint, float(margins[at]), _pose(poses, at)))
        return tuple(found)

    def as_is(self, machine: Machine, sets: LockSets) -> float:
        """The least of the measure with the locks that the machine has."""
        locked = {
            f"{leg.name}.{e.name}": float(e.locked)
            for leg in machine.legs
            for e in leg.chain.elements
            if isinstance(e, Drivable) and e.actuated and e.locked is not None
        }
        own = next((one for one in sets.whole if set(one.drives) == set(locked)), None)
        if own is None:
            return math.nan
        try:
            held = self.ways(own)
        except InputError:
            return math.nan
        signs = _own_signs(machine)
        kept = [[w for w in each if all(w.signs[b] == signs[w.number][b] for b in branches(w.leg))] for each in held]
        if not all(kept):
            return math.nan
        chosen = tuple(each[0] for each in kept)
        values = np.array([locked[name] for way in chosen for name in way.drives])
        nothing = Holding(chosen, values, np.zeros(0), np.zeros(0))
        least = min(with_best_rolls(self.asked, nothing, p).value for p in (self.task.poses, self.task.checked))
        return least if math.isfinite(least) else math.nan


def _failed(locks: LockSet, reason: str, pose: WorstPose | None = None) -> LockAdvice:
    return LockAdvice(locks, reason, pose, None, math.nan, None, ())


def _frame(poses: Poses, at: int) -> Frame:
    """One pose, of floats."""
    assert poses.rolls is not None
    index = np.array([at])
    found: Frame = jax.tree.map(lambda c: float(c[0]), turned(picked(poses.frames, index), poses.rolls[index]))
    return found


def _pose(poses: Poses, at: int) -> WorstPose:
    frame: Frame = jax.tree.map(float, jax.tree.map(lambda c: c[at], poses.frames))
    x, y, z = (c + 0.0 for c in frame.origin)
    # At roll zero the second axis is level, which tells the azimuth where there is no tilt too.
    azimuth, tilt = math.atan2(-frame.y.x, frame.y.y), math.atan2(-frame.x.z, frame.z.z)
    return WorstPose((x, y, z), (azimuth, tilt, 0.0 if poses.rolls is None else float(poses.rolls[at])))
