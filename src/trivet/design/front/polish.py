"""Fronts made better by slopes: their members, their ends, and the gaps between them."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from trivet.design.front.archive import Archive, is_best, spread
from trivet.design.front.box import Box
from trivet.design.front.evolution import Progress, Tell
from trivet.design.front.gaps import Gap, gaps
from trivet.design.front.problem import MET, Array, Asked
from trivet.design.front.program import Goal, Program, gain, improving, joined

STEPS = 60
"""Of sequential quadratic programming on one model, at most."""
ROUNDS = 12
"""Models in turn, at most."""
NARROW = 0.25
"""What is tried of a way that leads to nothing better, the radius next time."""
BACK = (1.0, 0.5, 0.1, 0.01)
"""Parts of the way to what the model promises, tried together."""
CLOSE = 0.3
"""Gaps this short, beside those of evenly spread points, stay."""
SHORTER = 0.5
"""Gaps this much shorter than the longest wait for their turn."""
THIN = 1e-6
"""Extent of a front, as a part of what objectives usually differ by, below which it counts as none."""
PARTS = np.array([[0.25], [0.5], [0.75]])
"""Where designs between two points are looked at, without polishing."""


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

    def finish(self, point: Point) -> bool:
        """Keeps what was polished to the end; returns whether it is new on the front."""
        key = point.design.tobytes()
        if key in self.finished or np.max(point.both[self.many :], initial=0.0) > MET or not np.isfinite(point.both).all():
            return False
        self.finished[key] = point
        self.archive.polished.add(key)
        if self.tell is not None:
            self.tell(Progress("polish", len(self.front), self.how.points, self.archive))
        return key in (one.design.tobytes() for one in self.front)

    def towards(self, start: Array, reference: Array, direction: Array) -> Point:
        """The best design found from one (d,) for the least t with objectives <= reference + t direction, (m,) both; never
        worse than that one."""
        goal = improving(reference, direction, self.width, len(self.asked.problem.constraints))
        return self.pursued(start, goal)

    def pursued(self, start: Array, goal: Goal) -> Point:
        """The best design found from one (d,) for a goal, never worse than that one."""
        key = b"polished" + b"".join(np.ascontiguousarray(part, float).tobytes() for part in (start, *goal))
        if not self.box.is_free.any():
            return self._tried(start[None])[0]
        if key in self.asked.memo:
            return self._again(self.asked.memo[key])
        way: list[Array] = [start[None]]
        point, radius = self._tried(way[0])[0], self.how.radius
        for _ in range(ROUNDS):
            better, promised, tried = self._once(point, goal, radius)
            way.append(tried)
            if promised < self.how.precision:
                break
            if better is None:
                radius *= NARROW
                continue
            gained, point = gain(goal, point.both, better.both), better
            if gained < self.how.precision or self.is_late:
                break
        if not self.is_late:
            self.asked.memo.update({key: np.concatenate([*way, point.design[None]])})
        return point

    def _again(self, way: Array) -> Point:
        """What was tried on a way that is known, in the same order, so that the archive becomes the same; its end."""
        self._tried(way[:1])
        for first in range(1, len(way) - 1, len(BACK)):
            self._tried(way[first : first + len(BACK)])
        return self._tried(way[-1:])[0]

    def _once(self, point: Point, goal: Goal, radius: float) -> tuple[Point | None, float, Array]:
        """What a model of a design leads to, if it is better, what it promised to gain, and the designs that were tried."""
        first = self.box.genes(point.design[None])[0][self.box.is_free]
        program = Program(self.asked.problem.model(point.design), self.box, point.design, goal, radius)
        found, promised = program.solved(STEPS, self.how.precision)
        designs = self.box.moved(point.design, first + np.array(BACK)[:, None] * (found - first))
        tried = self._tried(designs)
        missed, t = goal.attained(np.array([point.both, *(one.both for one in tried)]))
        best = int(np.lexsort((t, missed))[0])
        return (None if best == 0 else tried[best - 1]), promised, designs

    def is_alike(self, a: Point, b: Point) -> bool:
        """Whether two have the same discrete values."""
        return np.array_equal(a.design[self.box.is_discrete], b.design[self.box.is_discrete])

    def look(self, designs: list[Array]) -> None:
        """Takes designs (d,) into the archive as they are."""
        if designs:
            self.archive.add(np.array(designs), self.asked(np.array(designs)))

    def _tried(self, designs: Array) -> list[Point]:
        values = self.few(designs)
        self.archive.add(designs, values)
        return [Point(*one) for one in zip(designs, joined(values), strict=True)]


def polished(asked: Asked, archive: Archive, how: Polishing, tell: Tell | None = None) -> None:
    """Makes the front of an archive better: its ends, its members, then between them until it has enough points, and other
    discrete values."""
    polisher = Polisher(asked, archive, how, tell)
    for stage in (_polish_ends, _polish_members, _fill_gaps, _exchange):
        stage(polisher)
    archive.prune()


def _polish_ends(polisher: Polisher) -> None:
    """Each objective alone, then the others as far as it allows."""
    for i in range(polisher.many):
        if polisher.is_late:
            return
        designs, values = polisher.archive.best
        own = np.eye(polisher.many)[i] * polisher.width
        reference = np.where(own > 0, values.objectives[:, i].min(), np.inf)
        end = polisher.towards(designs[values.objectives[:, i].argmin()], reference, own)
        if polisher.many > 1:
            end = polisher.towards(end.design, end.both[: polisher.many], polisher.width - own)
        polisher.finish(end)


def _polish_members(polisher: Polisher) -> None:
    """Half as many members as there are to be points, evenly spread."""
    designs, values = polisher.archive.best
    for i in spread(values.objectives, polisher.how.points // 2):
        if polisher.is_late or polisher.many == 1:
            return
        polisher.finish(polisher.towards(designs[i], values.objectives[i], polisher.width))


def _fill_gaps(polisher: Polisher) -> None:
    """The longest gaps first, until there are enough points or nothing is found between them."""
    tried: set[tuple[bytes, bytes]] = set()
    while polisher.many > 1 and not polisher.is_late:
        points = polisher.front
        found = gaps(np.array([point.both[: polisher.many] for point in points]).reshape(-1, polisher.many), polisher.width)
        pairs = [(points[gap.first], points[gap.second], gap) for gap in found if gap.length > CLOSE / polisher.how.points]
        pairs = [pair for pair in pairs if (pair[0].design.tobytes(), pair[1].design.tobytes()) not in tried]
        if not pairs or len(points) >= polisher.how.points:
            return
        polisher.look(
            [ways for a, b, _ in pairs if polisher.is_alike(a, b) for ways in a.design + PARTS * (b.design - a.design)]
        )
        for a, b, gap in pairs[: polisher.how.points - len(points)]:
            if gap.length < SHORTER * pairs[0][2].length or polisher.is_late:
                break
            tried.add((a.design.tobytes(), b.design.tobytes()))
            _fill(polisher, a, b, gap)


def _fill(polisher: Polisher, a: Point, b: Point, gap: Gap) -> None:
    """A point between two."""
    for start in _between(polisher, a, b, gap):
        if polisher.finish(polisher.towards(start, gap.middle, gap.direction)):
            return


def _exchange(polisher: Polisher) -> None:
    """Each discrete variable of each point of the front to the values beside its own, all else polished anew, as long as better
    points come of it."""
    tried: set[bytes] = set()
    before = -1
    while before < len(tried):
        before = len(tried)
        for point in polisher.front:
            for design in polisher.box.beside(point.design):
                if polisher.is_late:
                    return
                if design.tobytes() not in tried:
                    tried.add(design.tobytes())
                    polisher.finish(polisher.towards(design, point.both[: polisher.many], polisher.width))


def _between(polisher: Polisher, a: Point, b: Point, gap: Gap) -> list[Array]:
    """Designs to start from: halfway, where discrete variables agree, and the archive's nearest in objectives."""
    designs, values = polisher.archive.best
    nearest = designs[np.sum(((values.objectives - gap.middle) / polisher.width) ** 2, axis=1).argmin()]
    if polisher.is_alike(a, b):
        return [(a.design + b.design) / 2, nearest]
    return [nearest, a.design, b.design]
