"""Designs moved towards goals by slopes, models made anew at each place."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from trivet.design.front.archive import Archive, is_best
from trivet.design.front.box import Box
from trivet.design.front.evolution import Progress, Tell
from trivet.design.front.problem import MET, Array, Asked
from trivet.design.front.program import Goal, Program, gain, improving, joined
from trivet.design.front.trust import Trust

STEPS = 60
"""Of sequential quadratic programming on one model, at most."""
ROUNDS = 30
"""Models in turn, at most."""
NARROWER = 0.1
"""The radius next time, as a part of one that led to nothing better."""
MISSES = 4
"""Models in turn that lead to nothing better, at most; those that promised nothing count twice."""
BENT = 3
"""Times that a model is asked again since limits bend away from it, at most."""
BACK = (1.0, 0.5, 0.1, 0.01)
"""Parts of the way to what the model promises, tried together."""
LOOSE = 1e-6
"""Room of an objective, as a part of the front's extent, that is used."""
HELD = 1e-10
"""By how much others may be missed for its sake."""
THIN = 1e-6
"""Extent of a front, as a part of what objectives usually differ by, below which it counts as none."""


@dataclass(frozen=True)
class Polishing:
    """How long and how fine."""

    points: int = 60
    """On the front, at least where it has so many."""
    seconds: float = float("inf")
    precision: float = 1e-12
    """The gain, as a part of the front's extent, at which a point is done."""
    radius: float = 0.5
    """How far variables may go on one model, as a part of their range."""


class Point(NamedTuple):
    """A design (d,) and its objectives and constraints (m + k,)."""

    design: Array
    both: Array


@dataclass
class Polisher:
    """Moves designs towards goals; all that is met on the way goes into the archive."""

    asked: Asked
    archive: Archive
    how: Polishing
    tell: Tell | None = None
    few: Asked = field(init=False)
    """The same, for a few designs at a time."""
    box: Box = field(init=False)
    ends: float = field(init=False)
    finished: dict[bytes, Point] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self.few = replace(self.asked, batch=len(BACK))
        self.box = Box.of(self.asked.problem)
        self.ends = time.monotonic() + self.how.seconds

    @property
    def width(self) -> Array:
        """(m,) the extent of the front; where it has none, that of the designs that were met first, or the objective's size."""
        _, (objectives, _) = self.archive.best
        extent, size = np.ptp(objectives, axis=0), np.abs(objectives).max(axis=0)
        usual = size if self.archive.usual is None else self.archive.usual
        return np.where(extent > THIN * usual, extent, np.where(usual > 0, usual, np.where(size > 0, size, 1.0)))

    @property
    def is_late(self) -> bool:
        """Whether time is up."""
        return time.monotonic() >= self.ends

    @property
    def many(self) -> int:
        """Objectives."""
        return len(self.asked.problem.objectives)

    @property
    def front(self) -> list[Point]:
        """What was polished to the end and nothing dominates."""
        points = list(self.finished.values())
        best = is_best(np.array([point.both[: self.many] for point in points]).reshape(len(points), self.many))
        return [point for point, is_on in zip(points, best, strict=True) if is_on]

    def told(self, stage: str, done: int, of: int | None = None) -> None:
        """Says how far a stage is."""
        if self.tell is not None:
            self.tell(Progress(stage, done, of, self.archive))

    def finish(self, point: Point) -> bool:
        """Keeps what was polished to the end; returns whether it is new on the front."""
        key = point.design.tobytes()
        is_met = np.isfinite(point.both).all() and np.max(point.both[self.many :], initial=0.0) <= MET
        if self.is_late or key in self.finished or not is_met:
            return False
        self.finished[key] = point
        self.archive.polished.add(key)
        self.told("polish", len(self.finished))
        return key in (one.design.tobytes() for one in self.front)

    def towards(self, start: Array, reference: Array, direction: Array) -> Point:
        """The best design found from one (d,) for the least t with objectives <= reference + t direction, (m,) both; then for
        less of those objectives that leave room under theirs, the others held."""
        width, constraints = self.width, len(self.asked.problem.constraints)
        point = self.pursued(start, improving(reference, direction, width, constraints))
        for _ in range(self.many - 1):
            reached = point.both[: self.many]
            aimed = direction > 0
            t = np.max((reached[aimed] - reference[aimed]) / direction[aimed])
            is_loose = (aimed | np.isinf(reference)) & (reference + t * direction - reached > LOOSE * width)
            if not is_loose.any() or not np.isfinite(point.both).all() or self.is_late:
                break
            # A little above what is reached: where it is least, slopes are zero and say nothing of where others may go.
            reference, direction = reached + HELD * width * ~is_loose, width * is_loose
            point = self.pursued(point.design, improving(reference, direction, width, constraints))
        return point

    def improve(self, start: Array, objectives: Array) -> None:
        """Polishes a design (d,) towards less of all objectives (m,), while there is time."""
        if not self.is_late:
            self.finish(self.towards(start, objectives, self.width))

    def pursued(self, start: Array, goal: Goal) -> Point:
        """The best design found from one (d,) for a goal, never worse than that one."""
        key = b"polished" + b"".join(np.ascontiguousarray(part, float).tobytes() for part in (start, *goal))
        if not self.box.is_free.any():
            return self.tried(start[None])[0]
        if key in self.asked.memo:
            return self._again(self.asked.memo[key])
        way: list[Array] = [start[None]]
        point, misses = self.tried(way[0])[0], 0
        far, near = Trust(self.how.radius, self.how.radius, NARROWER), Trust()
        for _ in range(ROUNDS):
            better, promised, tried = self._once(point, goal, far, near)
            way.append(tried)
            if better is None:
                misses += 1 if promised > 0 else 2
                if abs(promised) < self.how.precision or misses >= MISSES:
                    break
                continue
            gained, point, misses = gain(goal, point.both, better.both), better, 0
            if gained < self.how.precision or self.is_late:
                break
        if not self.is_late:
            self.asked.memo.update({key: np.concatenate([*way, point.design[None]])})
        return point

    def _again(self, way: Array) -> Point:
        """What was tried on a way that is known, in the same order, so that the archive becomes the same; its end."""
        points = self.tried(way[:1])
        for first in range(1, len(way) - 1, len(BACK)):
            points += self.tried(way[first : first + len(BACK)])
        return next(point for point in points if np.array_equal(point.design, way[-1]))

    def _once(self, point: Point, goal: Goal, far: Trust, near: Trust) -> tuple[Point | None, float, Array]:
        """What a model of a design leads to, if it is better, what it promised to gain, and the designs that were tried."""
        program = Program(self.asked.problem.model(point.design), self.box, point.design, goal, far.radius)
        found, promised = program.solved(STEPS, self.how.precision)
        tried = whole = self._on_the_way(point, found)
        best = _best(goal, point, tried)
        for _ in range(BENT if promised > self.how.precision or not _is_met(goal, point) else 0):
            is_whole = best is not None and tried[best] is whole[0]
            # Limits bend away from their models: the same once more, farther inside by what the whole step missed them by.
            nearer = program.goal.within(whole[0].both - np.fmin(program.both(found), goal.reference))
            if is_whole or not np.isfinite(whole[0].both).all() or np.array_equal(nearer.reference, program.goal.reference):
                break
            program = replace(program, goal=nearer)
            found, _ = program.solved(STEPS, self.how.precision)
            whole = self._on_the_way(point, found)
            tried, best = tried + whole, _best(goal, point, tried + whole)
        if promised < -self.how.precision and best != 0:
            # Quadratic programming lost its way, as where rows end: they may be true near by, where they are as good as linear.
            program = replace(program, goal=goal, radius=near.radius)
            first, tried = len(tried), tried + self._on_the_way(point, program.linear())
            best = _best(goal, point, tried)
            near.went(None if best is None or best < first else BACK[best - first])
        if promised > 0 or best is None:
            far.went(None if best is None else BACK[best % len(BACK)])
        return None if best is None else tried[best], promised, np.array([one.design for one in tried])

    def _on_the_way(self, point: Point, genes: Array) -> list[Point]:
        """Designs on the way from one to genes (f,), tried."""
        first = self.box.genes(point.design[None])[0][self.box.is_free]
        return self.tried(self.box.moved(point.design, first + np.array(BACK)[:, None] * (genes - first)))

    def is_alike(self, a: Point, b: Point) -> bool:
        """Whether two have the same discrete values."""
        return np.array_equal(a.design[self.box.is_discrete], b.design[self.box.is_discrete])

    def look(self, designs: list[Array]) -> None:
        """Takes designs (d,) into the archive as they are."""
        if designs:
            self.archive.add(np.array(designs), self.asked(np.array(designs)))

    def tried(self, designs: Array, asked: Asked | None = None) -> list[Point]:
        """Works out designs (n, d), few at a time unless told otherwise; the archive takes them in."""
        values = (asked or self.few)(designs)
        self.archive.add(designs, values)
        return [Point(*one) for one in zip(designs, joined(values), strict=True)]


def _best(goal: Goal, point: Point, tried: list[Point]) -> int | None:
    """Which of what was tried is the best; None where a point is as good itself."""
    missed, t = goal.attained(np.array([point.both, *(one.both for one in tried)]))
    best = int(np.lexsort((t, missed))[0])
    return best - 1 if best else None


def _is_met(goal: Goal, point: Point) -> bool:
    """Whether a point meets the bounds of a goal."""
    return bool(goal.attained(point.both[None])[0][0] == 0)
