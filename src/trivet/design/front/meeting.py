"""Designs that meet all constraints, where evolution found none."""

from __future__ import annotations

from trivet.design.front.polisher import Polisher
from trivet.design.front.program import meeting
from trivet.errors import NoResultError

ALIKE = 0.99
"""Constraints are named that are missed by this much of what the worst is."""


def met(polisher: Polisher) -> None:
    """Goes from the designs that miss constraints the least to one that meets all, which comes into the archive.

    Raises:
        NoResultError: there is none; it names the constraints that are in the way.
    """
    archive, problem = polisher.archive, polisher.asked.problem
    goal = meeting(len(problem.objectives), len(problem.constraints))
    for design in archive.nearest[0]:
        polisher.pursued(design, goal)
        if len(archive):
            return
    if not len(archive.nearest[0]):
        raise NoResultError(f"none of the {archive.seen} designs tried has a value; move or widen the ranges of the variables")
    constraints = archive.nearest[1][0]
    worst = [problem.missed(k, value) for k, value in enumerate(constraints) if value >= ALIKE * constraints.max()]
    raise NoResultError(
        f"no design meets all constraints: the one that comes nearest misses {' and '.join(worst)}, "
        f"with {len(archive.nearest[0])} of {archive.seen} designs followed by slopes; "
        f"relax {'it' if len(worst) == 1 else 'one of them'} or widen the ranges of the variables"
    )
