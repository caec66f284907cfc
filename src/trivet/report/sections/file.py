"""The machine file."""

from __future__ import annotations

from trivet.model import printed
from trivet.report.document import Listing, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import repeat


def section(subject: Subject) -> Section:
    """All of it."""
    words = "All that this report was worked out from. Saved as a file, it gives every number above again."
    listing = Listing(f"{subject.name}, the machine file", printed(subject.described))
    return Section("The machine file", (Words(words), listing, repeat(subject.command("show", "--toml", mode=False))))
