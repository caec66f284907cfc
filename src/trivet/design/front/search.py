"""From a problem to its front: evolution, designs that meet the constraints, polishing."""

from __future__ import annotations

from trivet.design.front.evolution import Evolution, Tell, evolved
from trivet.design.front.front import Front, told
from trivet.design.front.polish import polished
from trivet.design.front.polisher import Polishing
from trivet.design.front.problem import Array, Asked, Memo, Problem


def searched(
    problem: Problem, evolution: Evolution, polishing: Polishing, memo: Memo | None = None, start: Array | None = None,
    tell: Tell | None = None,
) -> Front:  # fmt: skip
    """The front of a problem.  With the memo of a run that was interrupted it ends as that would have, unless time was up.

    Args:
        problem: what is asked.
        evolution: how long designs evolve.
        polishing: how fine the front becomes, and how many points it has at most.
        memo: what is known, and where what becomes known is kept.
        start: designs (n, d) to begin with, beside random ones.
        tell: called as the search goes on.

    Raises:
        NoResultError: no design meets all constraints, or none has a value.
    """
    asked = Asked(problem, {} if memo is None else memo, evolution.population)
    archive = evolved(asked, evolution, start, tell)
    polished(asked, archive, polishing, tell)
    return told(problem, archive, polishing.points)
