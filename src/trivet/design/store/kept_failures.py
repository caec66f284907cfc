"""Chunks that failed, kept in the store until they are worked out after all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from trivet.design.store.disk import content, put, told
from trivet.design.store.layout import STATUS

FILE = f"{STATUS}/failures.json"
"""Beside the statuses, where zarr does not look for arrays."""


class Failure(NamedTuple):
    """A chunk that could not be worked out."""

    chunk: int
    designs: tuple[int, int]
    """The first and the last of them."""
    attempts: int
    """In all runs together."""
    reason: str

    def __str__(self) -> str:
        return f"designs {self.designs[0]} to {self.designs[1]}: {self.reason} (attempts: {self.attempts})"


def failures_in(root: Path, chunks: int) -> dict[int, Failure] | None:
    """Failures by chunk, of so many chunks; None where the file is damaged."""
    data = content(root / FILE)
    try:
        rows = json.loads(data) if data is not None else []
        found = [Failure(int(c), (int(first), int(last)), int(n), str(reason)) for c, (first, last), n, reason in rows]
        return {failure.chunk: failure for failure in found} if all(0 <= one.chunk < chunks for one in found) else None
    except (ValueError, TypeError, RecursionError):
        return None


def keep(root: Path, failures: Mapping[int, Failure]) -> None:
    """Write them; no file where there are none."""
    if failures:
        rows = [list(failures[k]) for k in sorted(failures)]
        put(root / FILE, json.dumps(rows, indent=1, ensure_ascii=False).encode())
        return
    with told(root / FILE, "removed"):
        (root / FILE).unlink(missing_ok=True)
