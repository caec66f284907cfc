"""Stiffness over the check points."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.errors import TrivetError
from trivet.report.document import Block, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, picture, repeat, told

_INTRODUCTION = (
    "How stiffly the platform is held over the check points on the hemisphere, its normal at right angles to the surface, each "
    "with the roll that makes K_xx greatest. K_ii is the force per displacement with all other motions held, 1/C_ii that with "
    "the platform free to give way."
)

_BOTH_SIDES = (
    "The statistics are over the points on all sides together. K_ii holds all other motions of the platform, and with free "
    "ball joints does not see a singularity; 1/C_ii leaves them free, and does."
)


def section(subject: Subject) -> Section:
    """Map and statistics."""
    command = subject.command("map", "--figure", "stiffness.png", *subject.points.options, model=True)
    return Section("Stiffness over the hemisphere", (Words(_INTRODUCTION), *attempt(lambda: _blocks(subject)), repeat(command)))


def _blocks(subject: Subject) -> Iterator[Block]:
    from trivet.show.maps import draw_map
    from trivet.views import stiffness_map as view

    (found,) = subject.comparison.maps
    alt = f"Stiffness of {subject.name} along x, y and z over the check points, seen from above, and the best roll."
    yield picture(found, "Stiffness and best roll over the check points, seen from above.", alt, draw=draw_map, columns=2)
    yield from told(view.tables(found))
    if count := _crossing(subject):
        curves = "a curve of Type 2 singularities crosses" if count == 1 else f"{count} curves of Type 2 singularities cross"
        yield Words(f"Mind: {curves} this hemisphere. {_BOTH_SIDES}")


def _crossing(subject: Subject) -> int:
    """How many singular curves there are on the hemisphere; none where that cannot be told."""
    try:
        return len(subject.singularities.curves)
    except TrivetError:
        return 0
