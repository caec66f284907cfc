"""The best that one set of locked drives allows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.drive_rates import MOST_RATE
from trivet.kinematics.held import Held, ways
from trivet.kinematics.inverse import branches, has_closed_form
from trivet.kinematics.mode import parse_mode
from trivet.model import Machine
from trivet.model.elements import Drivable
from trivet.space.frame import Frame
from trivet.study.lock_grid import Miss, Table, starts, table
from trivet.study.lock_measures import Measure
from trivet.study.lock_search import polished, with_best_rolls
from trivet.study.lock_task import Task
from trivet.study.lock_values import Holding, Poses, ends, mode_of, picked, split, turned
from trivet.study.locks import LockSet, LockSets

Array = NDArray[Any]

ROUNDS = 3
"""How often poses between those of the task that turn out worse join the search."""
JOINING = 6
"""So many of them at most, the worst first."""
WORSE = 1e-6
"""Part of the least by which they count as worse."""
BINDING = 1e-4
"""Margin of travel of a joint below which its limit binds."""
MICRON, MILLIDEGREE = 1e-6, math.radians(1e-3)
"""To which coordinates are rounded."""
FEW = 4
"""Coordinates whose neighbours on either side are tried."""


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
    margin: float
    """The least margin of travel of any joint, as `travel.Gauge.margin`."""
    rate: float
    """The greatest rate of a drive, see `kinematics.drive_rates`."""

    @property
    def spare(self) -> float:
        """The lesser of the margins of travel and of the rates of drives."""
        return min(self.margin, MOST_RATE / self.rate - 1 if self.rate else math.inf)

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


def own_signs(machine: Machine) -> Array:
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
        for one in _rounded(best):
            advice = self._summed_up(locks, one)
            if advice.holding is not None:
                break
        return advice

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
        return LockAdvice(locks, "", None, on_task, float(least.min()), worst, *_limits(holding, known))

    def as_is(self, machine: Machine, sets: LockSets) -> LockAdvice | None:
        """The locks that the machine has, as they are; None where they are none of the sets."""
        locked = {
            f"{leg.name}.{e.name}": float(e.locked)
            for leg in machine.legs
            for e in leg.chain.elements
            if isinstance(e, Drivable) and e.actuated and e.locked is not None
        }
        own = next((one for one in sets.whole if set(one.drives) == set(locked)), None)
        if own is None:
            return None
        try:
            held = self.ways(own)
        except InputError as error:
            return _failed(own, str(error))
        signs = own_signs(machine)
        kept = [[w for w in each if all(w.signs[b] == signs[w.number][b] for b in branches(w.leg))] for each in held]
        if not all(kept):
            return None
        chosen = tuple(each[0] for each in kept)
        values = np.array([locked[name] for way in chosen for name in way.drives])
        return self._summed_up(own, Holding(chosen, values, np.zeros(0), np.zeros(0)))


def _limits(holding: Holding, poses: Poses) -> tuple[tuple[Binding, ...], float, float]:
    """Joints at an end of their travel, the least margin of travel, and the greatest rate of a drive."""
    assert poses.rolls is not None
    found, least, rate = [], 1.0, 0.0
    for way, own in zip(holding.ways, split(holding.ways, holding.values), strict=True):
        case = np.tile(own, (len(poses), 1)), poses.frames, poses.rolls
        for joint, margins in way.margins(*case).items():
            at = int(np.argmin(margins))
            least = min(least, float(margins[at]))
            if margins[at] < BINDING:
                found.append(Binding(joint, float(margins[at]), _pose(poses, at)))
        rate = max(rate, float(way.rates(*case).max()))
    return tuple(found), least, rate


def _rounded(holding: Holding) -> Iterator[Holding]:
    """At coordinates which a drive can be told, the nearest, then where few those to either side, and as it is."""
    unit = np.array([MICRON if not is_turn else MILLIDEGREE for way in holding.ways for is_turn in _turns(way)])
    low, high = ends(holding.ways)
    yield holding._replace(values=np.clip(np.round(holding.values / unit) * unit + 0.0, low, high))
    for side in product((np.floor, np.ceil), repeat=len(unit) if len(unit) <= FEW else 0):
        values = [up(v / u) * u for up, v, u in zip(side, holding.values, unit, strict=True)]
        yield holding._replace(values=np.clip(values, low, high) if len(values) else holding.values)
    yield holding


def _turns(way: Held) -> list[bool]:
    return [e.is_angular for e in way.leg.chain.elements if isinstance(e, Drivable) and e.name in way.joints]


def _failed(locks: LockSet, reason: str, pose: WorstPose | None = None) -> LockAdvice:
    return LockAdvice(locks, reason, pose, None, math.nan, None, (), math.nan, math.nan)


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
