"""Coarse polishing: successive linear programming with a trust region (R. Fletcher and E. Sainz de la Maza, Mathematical
Programming 43, 1989), solved by HiGHS.

Where models bend much, as with best rolls that follow limits, none is true far from its design, and its least is not worth
finding.  A linear program over the rows costs a few milliseconds, so that many points come near the front in the time that
sequential quadratic programming takes to bring one onto it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from trivet.design.front.archive import spread
from trivet.design.front.polisher import Point, Polisher
from trivet.design.front.problem import Array
from trivet.design.front.program import Goal, Program, gain, improving
from trivet.design.front.trust import Trust

LEAST = 1e-3
"""The radius at which a point is done."""
PARTS = (1.0, 0.5, 0.2, 0.05)
"""Of the way to what a linear program promises, tried together."""
ENOUGH = 1e-3
"""The gain, as a part of the front's extent, at which a point is done."""
MEMBERS = 24
"""Points, at most; the next evolution carries on from them."""
ROUNDS = 12
"""Linear programs per point, at most."""


@dataclass
class Climber:
    """A point on its way."""

    point: Point
    goal: Goal
    trust: Trust = field(default_factory=Trust)
    gained: float = np.inf
    """By its last step."""
    rounds: int = 0

    @property
    def is_done(self) -> bool:
        """Whether more steps would gain little."""
        return self.gained < ENOUGH or self.trust.radius < LEAST or self.rounds >= ROUNDS


def coarsened(polisher: Polisher) -> None:
    """Moves evenly spread designs of the archive towards the front, all at once, as many designs cost little more than few.

    Of two objectives or more, those at the ends go towards less of theirs alone.
    """
    climbers = _begun(polisher, min(polisher.how.points, MEMBERS)) if polisher.box.is_free.any() else []
    if climbers:
        polisher.told("coarse polish", 0, len(climbers))
    while not polisher.is_late and (left := [climber for climber in climbers if not climber.is_done]):
        ways = [_way(polisher, climber) for climber in left]
        tried = polisher.tried(np.concatenate(ways), polisher.asked)
        for k, climber in enumerate(left):
            _step(climber, tried[k * len(PARTS) : (k + 1) * len(PARTS)])
        polisher.told("coarse polish", sum(climber.is_done for climber in climbers), len(climbers))
    polisher.archive.prune()


def _begun(polisher: Polisher, points: int) -> list[Climber]:
    designs, values = polisher.archive.best
    objectives = values.objectives
    width, limits = polisher.width, len(polisher.asked.problem.constraints)
    both = np.concatenate(values, axis=1)

    def begun(i: int, reference: Array, direction: Array) -> Climber:
        return Climber(Point(designs[i], both[i]), improving(reference, direction, width, limits))

    members = [begun(i, objectives[i], width) for i in spread(objectives, points)]
    own = np.diag(width)
    ends = [begun(int(i), np.where(own[k] > 0, objectives[i], np.inf), own[k]) for k, i in enumerate(objectives.argmin(axis=0))]
    return ends + members if polisher.many > 1 else members


def _step(climber: Climber, tried: list[Point]) -> None:
    """What becomes of a way whose designs were tried."""
    point, goal, climber.rounds = climber.point, climber.goal, climber.rounds + 1
    missed, t = goal.attained(np.array([point.both, *(one.both for one in tried)]))
    best = int(np.lexsort((t, missed))[0])
    climber.trust.went(PARTS[best - 1] if best else None)
    if best:
        climber.gained, climber.point = gain(goal, point.both, tried[best - 1].both), tried[best - 1]


def _way(polisher: Polisher, climber: Climber) -> Array:
    """Designs (4, d) towards what the linear program of a model promises; known ones need no model."""
    design, goal = climber.point.design, climber.goal
    key = b"linear" + b"".join(np.ascontiguousarray(part, float).tobytes() for part in (design, *goal, climber.trust.radius))
    if key in polisher.asked.memo:
        return polisher.asked.memo[key]
    first = polisher.box.genes(design[None])[0][polisher.box.is_free]
    found = Program(polisher.asked.problem.model(design), polisher.box, design, goal, climber.trust.radius).linear()
    designs = polisher.box.moved(design, first + np.array(PARTS)[:, None] * (found - first))
    polisher.asked.memo.update({key: designs})
    return designs
