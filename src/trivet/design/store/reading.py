"""Stores for those who read them; while they grow too."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trivet.design.store.disk import content
from trivet.design.store.faults import faults_of
from trivet.design.store.layout import FORMAT, ROOT, STATUS, Array, Layout, layout_of
from trivet.design.store.recognising import document_in
from trivet.design.store.scratch import Scratch
from trivet.design.store.writing import done_in
from trivet.errors import InputError, shown

MENDED = "run the study again, which mends it"


@dataclass(frozen=True)
class Results:
    """What a store held when it was opened."""

    path: Path
    layout: Layout
    done: Array
    """(chunks,) whether each is worked out."""
    arrays: Any
    """The zarr group."""

    @property
    def is_complete(self) -> bool:
        """Whether all chunks are worked out."""
        return bool(self.done.all())

    def column(self, name: str, start: int = 0, stop: int | None = None) -> Array:
        """Numbers of some designs (stop - start,), SI; NaN where there are none, or not yet."""
        names = [column.name for column in self.layout.columns]
        values: Array = self.arrays[self.layout.arrays[names.index(name)]][start:stop]
        return values

    def status(self, start: int = 0, stop: int | None = None) -> Array:
        """Statuses of some designs, 0 where they are not yet worked out, 1 and above as the layout has their names."""
        values: Array = self.arrays[STATUS][start:stop]
        return values


def read(path: str | os.PathLike[str]) -> Results:
    """The results of a study; all that claims to be done is checked.

    Raises:
        InputError: for a folder that is no store of a study, or a damaged one.
    """
    import zarr
    from zarr.storage import LocalStore

    root = Path(path)
    if not root.is_dir():
        raise InputError(f"{root}: is no folder; the results of a study are one")
    document = document_in(root)
    if document is None or "fingerprint" not in document:
        raise InputError(f"{root}: is not the store of a study, or its {ROOT} is damaged; {MENDED}")
    if document.get("format") != FORMAT:
        raise InputError(f"{root}: is of the format {shown(document.get('format'))}; this version of trivet knows '{FORMAT}'")
    layout = layout_of(document)
    if layout is None:
        raise InputError(f"{root / ROOT}: is altered; {MENDED}")
    scratch = Scratch(layout)
    done = done_in(root, layout)
    for fault in faults_of(root, scratch, done):
        if fault.chunk is not None or not _means_the_same(content(root / fault.file), scratch.metadata.get(fault.file, b"{}")):
            raise InputError(f"{root}: {fault}; {MENDED}")
    return Results(root, layout, done, zarr.open_group(LocalStore(root, read_only=True), mode="r", zarr_format=3))


def _means_the_same(found: bytes | None, expected: bytes) -> bool:
    """Whether metadata that another version of zarr has written says the same."""
    try:
        return bool(json.loads(found or b"") == json.loads(expected))
    except (ValueError, RecursionError):
        return False
