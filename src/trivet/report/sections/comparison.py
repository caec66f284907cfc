"""Machines side by side; or one beside what is published of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from trivet.errors import NoResultError, TrivetError
from trivet.report.document import Block, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, picture, repeat, told
from trivet.study.comparison import Comparison
from trivet.study.dynamic_comparison import DynamicComparison

_T = TypeVar("_T")

_STATIC = (
    "Stiffness over the check points of each machine's own hemisphere, each point with the roll that makes K_xx greatest; "
    "means, variances, tests of every pair, and published means where machine files carry them."
)
_DYNAMIC = "The least force per motion of the platform centre over frequency, each machine at home, with its drives held."


def section(subjects: Sequence[Subject]) -> Section:
    """Both halves of a comparison."""
    static = (Words(_STATIC), *attempt(lambda: _static(subjects)), repeat(_command(subjects, "--static-only")))
    dynamic = (Words(_DYNAMIC), *attempt(lambda: _dynamic(subjects)), repeat(_command(subjects, "--no-sensitivity")))
    heading = "Side by side" if len(subjects) > 1 else "Beside published values"
    return Section(heading, (), (Section("Stiffness", static), Section("Dynamic stiffness", dynamic)))


def is_published(subject: Subject) -> bool:
    """Whether there is something to set a machine beside."""
    return bool(subject.machine.about.published or subject.machine.about.published_dynamic)


def _command(subjects: Sequence[Subject], half: str) -> str:
    first, *others = subjects
    return first.command("compare", *(subject.word for subject in others), half, *first.points.options, model=True)


def _static(subjects: Sequence[Subject]) -> Iterator[Block]:
    from trivet.views import comparison as view

    found, missing = _each(subjects, lambda subject: subject.comparison)
    yield from missing
    whole = Comparison(tuple(m for own in found for m in own.maps), tuple(m for own in found for m in own.finer))
    caption = "Above the distributions over the check points, with means and published means; below K_xx, seen from above."
    yield picture(whole, caption, "Stiffness along x, y and z of the machines side by side, and maps of K_xx.")
    yield from told(view.tables(whole))


def _dynamic(subjects: Sequence[Subject]) -> Iterator[Block]:
    from trivet.views import dynamic_comparison as view

    found, missing = _each(subjects, lambda subject: subject.dynamics)
    yield from missing
    poses, described = (tuple(one for own in found for one in getattr(own, what)) for what in ("poses", "described"))
    whole = DynamicComparison(poses, described, (), found[0].low, found[0].high, found[0].loss_factor)
    caption = "Minimum dynamic stiffness along x, y and z; published values as diamonds."
    yield picture(whole, caption, "Minimum dynamic stiffness along x, y and z of the machines side by side.")
    yield from told(view.tables(whole))


def _each(subjects: Sequence[Subject], ask: Callable[[Subject], _T]) -> tuple[list[_T], list[Block]]:
    """What there is of every machine, and sentences about those of which there is nothing."""
    found: list[_T] = []
    missing: list[Block] = []
    for subject in subjects:
        try:
            found.append(ask(subject))
        except TrivetError as error:
            missing.append(Words(f"Left out: {error}", says_why=True))
    if not found:
        raise NoResultError(" ".join(words.text for words in missing if isinstance(words, Words)))
    return found, missing
