"""From a problem to its front: evolution and polishing in turn, twice, coarse before fine.

Evolution finds where the front is, polishing puts designs onto it.  Crossing polished designs then finds pieces of the front
that were missed, which a few designs far from it do not; for that a coarse polish is enough.
"""

from __future__ import annotations

from dataclasses import replace

from trivet.design.front.archive import spread
from trivet.design.front.evolution import Evolution, Tell, evolved
from trivet.design.front.front import Front, told
from trivet.design.front.linear import coarsened
from trivet.design.front.polish import polished
from trivet.design.front.polisher import Polisher, Polishing
from trivet.design.front.problem import Array, Asked, Memo, Problem

FIRST = 0.6
"""Part of the evolution that goes before any polishing."""
HALF = 2
"""What is polished in between has so many times fewer points, and so much less time."""


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
    first = int(FIRST * evolution.evaluations)
    before = replace(evolution, evaluations=first, seconds=FIRST * evolution.seconds)
    after = replace(
        evolution, evaluations=evolution.evaluations - first, seconds=(1 - FIRST) * evolution.seconds, seed=evolution.seed + 1
    )
    archive = evolved(asked, before, start, tell)
    if len(archive):
        some = replace(polishing, points=-(-polishing.points // HALF), seconds=polishing.seconds / HALF)
        coarsened(Polisher(asked, archive, some, tell))
    designs, values = archive.best if len(archive) else (archive.nearest[0], None)
    if values is not None:
        designs = designs[spread(values.objectives, evolution.population // 2)]
    evolved(asked, after, designs, tell, archive)
    polished(asked, archive, replace(polishing, seconds=polishing.seconds / HALF), tell)
    return told(problem, archive, polishing.points)
