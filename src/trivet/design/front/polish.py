"""Fronts made better by slopes: their ends, their members, the gaps between them, and other discrete values."""

from __future__ import annotations

import numpy as np

from trivet.design.front.archive import Archive, spread
from trivet.design.front.evolution import Tell
from trivet.design.front.front import chosen
from trivet.design.front.gaps import Gap, gaps
from trivet.design.front.linear import coarsened
from trivet.design.front.meeting import met
from trivet.design.front.polisher import Point, Polisher, Polishing
from trivet.design.front.problem import Array, Asked

MEMBERS = 24
"""Members polished before gaps are filled, at most: from then on less is won by them."""
CLOSE = 0.3
"""Gaps this short, beside those of evenly spread points, stay."""
SHORTER = 0.5
"""Gaps this much shorter than the longest wait for their turn."""
PASSES = 3
"""Over what would be told of the front and was not polished, at most."""
PARTS = np.array([[0.25], [0.5], [0.75]])
"""Where designs between two points are looked at, without polishing."""


def polished(asked: Asked, archive: Archive, how: Polishing, tell: Tell | None = None) -> None:
    """Makes the front of an archive better: coarsely first, then its ends, its members, between them until there are enough,
    and other discrete values.

    Raises:
        NoResultError: no design of the archive meets all constraints, and none is found that does.
    """
    polisher = Polisher(asked, archive, how, tell)
    if not len(archive):
        polisher.told("limits", 0)
        met(polisher)
    coarsened(polisher)
    polisher.told("polish", 0)
    for stage in (_polish_ends, _polish_members, _fill_gaps, _exchange, _fill_gaps, _polish_rest):
        stage(polisher)
    archive.prune()


def _polish_ends(polisher: Polisher) -> None:
    """Each objective alone, then the others as far as it allows."""
    for i in range(polisher.many):
        if polisher.is_late:
            return
        designs, values = polisher.archive.best
        width, own = polisher.width, np.eye(polisher.many)[i]
        reference = np.where(own > 0, values.objectives[:, i].min(), np.inf)
        polisher.finish(polisher.towards(designs[values.objectives[:, i].argmin()], reference, own * width))


def _polish_members(polisher: Polisher) -> None:
    """Some members, evenly spread; under one objective also designs from all over."""
    designs, values = polisher.archive.best
    for i in spread(values.objectives, min(polisher.how.points // 2, MEMBERS)):
        polisher.improve(designs[i], values.objectives[i])
    for design in polisher.archive.first if polisher.many == 1 else ():
        polisher.improve(design, values.objectives[0])


def _polish_rest(polisher: Polisher) -> None:
    """What else would be told of the front, and what then takes the place of that."""
    archive = polisher.archive
    for _ in range(PASSES):
        index = chosen(polisher.asked.problem, archive, polisher.how.points)
        index = index[~archive.is_polished[index]]
        for design, objectives in zip(archive.designs[index], archive.values.objectives[index], strict=True):
            polisher.improve(design, objectives)


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
        polisher.look([way for a, b, _ in pairs if polisher.is_alike(a, b) for way in a.design + PARTS * (b.design - a.design)])
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
                if design.tobytes() not in tried and not polisher.is_late:
                    tried.add(design.tobytes())
                    polisher.improve(design, point.both[: polisher.many])


def _between(polisher: Polisher, a: Point, b: Point, gap: Gap) -> list[Array]:
    """Designs to start from: halfway, where discrete variables agree, and the archive's nearest in objectives."""
    designs, values = polisher.archive.best
    nearest = designs[np.sum(((values.objectives - gap.middle) / polisher.width) ** 2, axis=1).argmin()]
    if polisher.is_alike(a, b):
        return [(a.design + b.design) / 2, nearest]
    return [nearest, a.design, b.design]
