"""The machine at home."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.report.document import Block, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, repeat, told

_INTRODUCTION = (
    "At its home pose: where every joint stands within its travel, which bodies are nearest to each other, how stiffly the "
    "platform is held, and which parts give way when a force pulls at its centre."
)


def section(subject: Subject) -> Section:
    """Joints, clearances, stiffness, compliance budget, masses."""
    command = subject.command("pose", model=True)
    return Section("At home", (Words(_INTRODUCTION), *attempt(lambda: _blocks(subject)), repeat(command)))


def _blocks(subject: Subject) -> Iterator[Block]:
    from trivet.views import pose as view

    yield from told([*view.tables(subject.home), view.masses_table(subject.home)])
    if subject.hidden > 0:
        left = sum(subject.home.masses.values()) - subject.hidden
        yield Words(
            f"Rods that slide count with all their length. {subject.hidden:.4g} kg of that is inside their guides: it does not "
            "bend, and its inertia is left out of natural modes and frequency responses, so that their frequencies come out "
            f"somewhat high where drives yield: {left:.4g} kg vibrate there."
        )
