"""Natural modes and frequency responses at home."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.report.document import Block, Plot, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, drawn, picture, repeat, told

_MODES = (
    "How the machine rings at home with its drives held: at which frequencies, how the platform moves then, and which parts "
    "yield. The part with the greatest share of the strain energy is the one to stiffen; where two modes have "
    "the same frequency, look at both, since any mixture of them is a mode."
)
_RESPONSES = (
    "How far the platform centre moves per newton of a harmonic force at it, and when. The least dynamic stiffness is the "
    "least force per motion over the frequencies shown, 5 Hz to 3 kHz: what the machine resists with where it resists least. "
    "Stiff machines may be softer above; the command takes another range with --to."
)


def section(subject: Subject) -> Section:
    """Modes and responses."""
    ringing = subject.command("modes", "--figure", "modes.html", model=True)
    swinging = subject.command("frf", "--figure", "frf.html", model=True)
    modes = (Words(_MODES), *attempt(lambda: _modes(subject)), repeat(ringing))
    responses = (Words(_RESPONSES), *attempt(lambda: _responses(subject)), repeat(swinging))
    return Section("Vibration", (), (Section("Natural modes", modes), Section("Frequency responses", responses)))


def _modes(subject: Subject) -> Iterator[Block]:
    from trivet.views import modes as view

    caption = "The first modes; the grey shadow is the machine at rest. The command below gives a page in which they move."
    yield picture(subject.modes, caption, f"Shapes of the first natural modes of {subject.name}.")
    yield from told(view.tables(subject.modes))
    if subject.hidden > 0:
        yield Words(
            f"That is {subject.hidden:.4g} kg less than what moves, as told at home: the inertia of what rods that slide have "
            "inside their guides is left out, so that frequencies come out somewhat high where drives yield."
        )


def _responses(subject: Subject) -> Iterator[Block]:
    from trivet.show.response import page
    from trivet.views import frf as view

    shown = subject.response
    alt = f"Receptance of the platform centre of {subject.name} along x, y and z over frequency, magnitude and phase."
    yield Plot(
        "Receptance of the platform centre, magnitude and phase; circles mark the least dynamic stiffness.",
        alt,
        page(shown),
        drawn(shown),
    )
    yield from told(view.tables(shown))
