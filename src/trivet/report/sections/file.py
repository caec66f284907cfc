"""The machine file."""

from __future__ import annotations

from trivet.model import Machine, to_text
from trivet.report.document import Listing, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import repeat


def text_of(machine: Machine) -> str:
    """The file of a machine, as `trivet show --toml` prints it."""
    return to_text(machine.renamed(machine.name))


def section(subject: Subject) -> Section:
    """All of it."""
    words = "All that this report was worked out from. Saved as a file, it gives every number above again."
    listing = Listing(f"{subject.name}, the machine file", text_of(subject.described))
    return Section("The machine file", (Words(words), listing, repeat(subject.command("show", "--toml", mode=False))))
