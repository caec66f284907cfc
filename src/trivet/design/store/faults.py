"""What is wrong with the files of a store."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from trivet.design.store.disk import content
from trivet.design.store.kept_failures import FILE, failures_in
from trivet.design.store.layout import DIGEST, STATUS, Array
from trivet.design.store.scratch import Scratch, digest_of, key_of


class Fault(NamedTuple):
    """A file that is not what was written."""

    file: str
    """Within the folder."""
    what: str
    """What is wrong with it."""
    chunk: int | None = None
    """To be worked out again; None where nothing is lost by it."""
    designs: tuple[int, int] | None = None
    """The first and the last of them."""

    def __str__(self) -> str:
        where = f" (designs {self.designs[0]} to {self.designs[1]})" if self.designs is not None else ""
        return f"{self.file} {self.what}{where}"


def faults_of(root: Path, scratch: Scratch, done: Array) -> Iterator[Fault]:
    """Faults of the metadata, of the chunks that claim to be done, and of the list of failures."""
    for key, expected in scratch.metadata.items():
        found = content(root / key)
        if found != expected:
            yield Fault(key, _misfit(found, len(expected)))
    for k in done.nonzero()[0]:
        yield from _chunk_faults(root, scratch, int(k))
    if failures_in(root, scratch.layout.chunks) is None:
        yield Fault(FILE, "is altered")


def _chunk_faults(root: Path, scratch: Scratch, k: int) -> Iterator[Fault]:
    """Of one chunk: which file it is tell lengths and checksums."""
    found = {key: content(root / key) for key in scratch.keys(k)}
    files = {key: data for key, data in found.items() if data is not None}
    digest = content(root / key_of(DIGEST, k))
    if len(files) == len(found) and digest == digest_of(scratch.layout, files):
        return
    start, stop = scratch.layout.designs(k)
    designs = (start, stop - 1)
    faults = []
    for name, (key, data) in zip((*scratch.layout.arrays, STATUS), found.items(), strict=True):
        if data is None or not scratch.is_sound(k, name, data):
            length = scratch.layout.chunk * (1 if name == STATUS else 8) + 4
            faults.append(Fault(key, _misfit(data, length), k, designs))
    yield from faults or [Fault(key_of(DIGEST, k), "does not fit the files of its chunk", k, designs)]


def _misfit(data: bytes | None, length: int) -> str:
    if data is None:
        return "is missing"
    return f"is cut short, {len(data)} of {length} bytes" if len(data) < length else "is altered"
