"""What the drives must give for a motion."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.report.document import Block, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, picture, repeat, told


def section(subject: Subject) -> Section:
    """A circle about home, at the usual limits."""
    from trivet.space.curve import Limits

    usual = Limits()
    words = (
        f"Once round a level circle of {1e3 * subject.circle:g} mm about home, the platform held level, as fast as "
        f"{usual.speed:g} m/s, {usual.acceleration:g} m/s² and {usual.jerk:g} m/s³ allow, under its weight and no other load: "
        "what every drive must give, and what the joints must bear. Bodies are rigid."
    )
    command = subject.command("dynamics", "--circle", f"{1e3 * subject.circle:g} mm", "--figure", "motion.png")
    return Section("Dynamics of a motion", (Words(words), *attempt(lambda: _blocks(subject)), repeat(command)))


def _blocks(subject: Subject) -> Iterator[Block]:
    from trivet.views import motion as view

    caption = "Drives over time: coordinates, speeds, forces and powers."
    yield picture(subject.motion, caption, f"Coordinates, speeds, forces and powers of the drives of {subject.name} over time.")
    yield from told(view.tables(subject.motion))
