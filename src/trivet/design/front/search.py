"""From a problem to its front: evolution and polishing in turns, coarse before fine.

Evolution finds where the front is, polishing puts designs onto it.  Crossing polished designs then finds pieces of the front
that were missed, which a few designs far from it do not; for that a coarse polish is enough.
"""

from __future__ import annotations

from dataclasses import replace

from trivet.design.front.archive import Archive, spread
from trivet.design.front.evolution import Evolution, Tell, evolved
from trivet.design.front.front import Front, told
from trivet.design.front.linear import coarsened
from trivet.design.front.polish import polished
from trivet.design.front.polisher import Polisher, Polishing
from trivet.design.front.problem import Array, Asked, Memo, Problem

TURNS = 4
"""Of evolution, each followed by polishing; that of all but the last is coarse."""
COARSE = 0.5
"""Part of the time for polishing that coarse turns may take."""


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
        tell: called as the search goes on; evolution counts through all turns.

    Raises:
        NoResultError: no design meets all constraints, or none has a value.
    """
    asked = Asked(problem, {} if memo is None else memo, evolution.population)
    archive = Archive.empty(len(problem.low), len(problem.objectives), len(problem.constraints))
    some = replace(polishing, seconds=COARSE * polishing.seconds / (TURNS - 1))
    for turn in range(TURNS):
        evolved(asked, _part(evolution, turn), start, _through(evolution, turn, tell), archive)
        if turn < TURNS - 1:
            if len(archive):
                coarsened(Polisher(asked, archive, some, tell))
            start = _parents(archive, evolution.population // 2)
    polished(asked, archive, replace(polishing, seconds=(1 - COARSE) * polishing.seconds), tell)
    return told(problem, archive, polishing.points)


def _part(evolution: Evolution, turn: int) -> Evolution:
    """What evolves in one of the turns: whole generations, those that do not share out evenly first."""
    return replace(
        evolution,
        evaluations=_before(evolution, turn + 1) - _before(evolution, turn),
        seconds=evolution.seconds / TURNS, seed=evolution.seed + turn,
    )  # fmt: skip


def _before(evolution: Evolution, turn: int) -> int:
    """How many designs evolve before one of the turns."""
    generations = -(-evolution.evaluations // evolution.population)
    return -(-generations * turn // TURNS) * evolution.population


def _through(evolution: Evolution, turn: int, tell: Tell | None) -> Tell | None:
    """Tells of the evolution in one of the turns as part of that in all."""
    if tell is None:
        return None
    done, total = _before(evolution, turn), _before(evolution, TURNS)
    return lambda own: tell(own._replace(done=done + own.done, of=total))


def _parents(archive: Archive, many: int) -> Array:
    """Designs (n, d) to go on from: evenly over the front, or those that miss constraints the least."""
    if not len(archive):
        return archive.nearest[0]
    designs, values = archive.best
    return designs[spread(values.objectives, many)]
