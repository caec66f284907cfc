"""Where a document comes from: versions, date, files with their hashes, the command."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from trivet.model import fingerprint
from trivet.report.subject import Subject

PACKAGES = ("trivet", "jax", "numpy", "scipy")


def provenance(subjects: Sequence[Subject], files: Iterable[str], command: str) -> tuple[tuple[str, str], ...]:
    """Names and values; `files` are those which were read beside the machines."""
    machines = [
        (f"machine file of {subject.name}", f"SHA-256 {fingerprint(subject.described)}, as printed in this report")
        for subject in subjects
    ]
    return (
        ("command", command),
        ("date", f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"),
        *versions(),
        *machines,
        *((name, f"SHA-256 {hashlib.sha256(Path(name).read_bytes()).hexdigest()}") for name in files),
    )


def versions() -> tuple[tuple[str, str], ...]:
    """Of what the numbers were worked out with."""
    python = f"{platform.python_version()}, {platform.system()} {platform.machine()}"
    return (*((name, version(name)) for name in PACKAGES), ("Python", python))
