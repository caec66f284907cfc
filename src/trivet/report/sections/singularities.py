"""Singularities at home and over the check points."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.report.document import Block, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, picture, repeat, told

_HOME = (
    "At a singularity of Type 2 the platform gives way although all drives hold; at one of Type 1 a drive moves without the "
    "platform. How far home is from either, and how well forces get through to the platform: 1 is best, 0 is singular."
)
_MAP = (
    "The same over the check points on the hemisphere, each with its best roll. Where sigma_min, the smallest singular value "
    "of the Jacobian, comes to zero, the drives lose the platform; a red line marks where that happens."
)


def section(subject: Subject) -> Section:
    """How near, and where."""
    at_home, over = subject.command("singularity"), ("--quantity", "sigma_min", "--figure", "singularities.png")
    mapped = subject.command("map", *over, *subject.points.options, model=True)
    home = (Words(_HOME), *attempt(lambda: _home(subject)), repeat(at_home))
    field = (Words(_MAP), *attempt(lambda: _map(subject)), repeat(mapped))
    return Section("Singularities", (), (Section("At home", home), Section("Over the hemisphere", field)))


def _home(subject: Subject) -> Iterator[Block]:
    from trivet.views import singularity as view

    yield from told(view.tables(subject.singularity))


def _map(subject: Subject) -> Iterator[Block]:
    from trivet.views import singularity_map as view

    alt = f"Smallest singular value over the check points of {subject.name}, seen from above, with the singular curves."
    yield picture(subject.singularities, "sigma_min over the check points, seen from above.", alt)
    yield from told(view.tables(subject.singularities))
