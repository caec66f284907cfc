"""A store that is worked at."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Self

import numpy as np

from trivet.design.store.disk import Lock, content, is_unfinished, put_all, settle, told
from trivet.design.store.faults import Fault, faults_of
from trivet.design.store.kept_failures import FILE, Failure, failures_in, keep
from trivet.design.store.layout import DIGEST, STATUS, Array, Chunk, Layout
from trivet.design.store.recognising import check
from trivet.design.store.scratch import WIDTH, Scratch, digest_of, key_of
from trivet.errors import InputError
from trivet.files import check_room


def open_store(path: str | os.PathLike[str], layout: Layout) -> Store:
    """Make a store, or go on with one.

    Raises:
        InputError: when the folder is none of this study, is being worked at by another process, or cannot be written;
            when the disk has no room for what is still to come.
    """
    root, scratch = Path(path), Scratch(layout)
    check(root, scratch)
    with told(root, "made"):
        root.mkdir(exist_ok=True)
        (root / STATUS).mkdir(exist_ok=True)
    with suppress(InputError):  # a folder that may not be read
        settle(root.absolute().parent)
    lock = Lock(root / STATUS, root)
    try:
        check(root, scratch)  # once more: another process may have made it meanwhile
        return Store(root, scratch, lock)
    except BaseException:
        lock.release()
        raise


class Store:
    """A store that is worked at; by this process alone, as long as it is open."""

    def __init__(self, root: Path, scratch: Scratch, lock: Lock) -> None:
        self.path, self.layout = root, scratch.layout
        self._scratch, self._lock = scratch, lock
        self._sweep()
        self.done = done_in(root, self.layout)
        """(chunks,) whether each is worked out."""
        if not self.done.any():
            self._write_metadata()
        self._failures = failures_in(root, self.layout.chunks) or {}
        if any(self.done[list(self._failures)]):
            self._failures = {k: failure for k, failure in self._failures.items() if not self.done[k]}
            keep(root, self._failures)
        rest = self.layout.chunks - int(self.done.sum())
        check_room(root / DIGEST, rest * (self.layout.chunk * (8 * len(self.layout.columns) + 1) + WIDTH))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let others work at it."""
        self._lock.release()

    @property
    def failures(self) -> tuple[Failure, ...]:
        """Chunks that failed when they were last tried."""
        return tuple(self._failures[k] for k in sorted(self._failures))

    def undone(self) -> Iterator[int]:
        """Chunks that are still to be worked out."""
        return (int(k) for k in np.flatnonzero(~self.done))

    def write(self, k: int, chunk: Chunk) -> None:
        """Write a chunk; it is done when this returns, and as good as not begun when it does not.

        Raises:
            InputError: where it cannot be written: no room, say.
        """
        files = self._scratch.encoded(k, chunk)
        put_all({self.path / key: data for key, data in files.items()})
        put_all({self.path / key_of(DIGEST, k): digest_of(self.layout, files)})
        self.done[k] = True
        if self._failures.pop(k, None) is not None:
            keep(self.path, self._failures)

    def fail(self, k: int, reason: str, attempts: int) -> Failure:
        """Record why a chunk could not be worked out."""
        start, stop = self.layout.designs(k)
        before = self._failures[k].attempts if k in self._failures else 0
        self._failures[k] = Failure(k, (start, stop - 1), before + attempts, reason)
        keep(self.path, self._failures)
        return self._failures[k]

    def faults(self) -> tuple[Fault, ...]:
        """Files that are not what was written; all of the store is read."""
        return tuple(faults_of(self.path, self._scratch, self.done))

    def repair(self, faults: Iterable[Fault]) -> None:
        """Write what is known anew, and count chunks with faults as not done."""
        for fault in faults:
            if fault.chunk is not None:
                with told(self.path, "removed"):
                    (self.path / key_of(DIGEST, fault.chunk)).unlink(missing_ok=True)
                self.done[fault.chunk] = False
            elif fault.file == FILE:
                keep(self.path, self._failures)
        self._write_metadata()

    def _write_metadata(self) -> None:
        for key, data in self._scratch.metadata.items():
            folder = (self.path / key).parent
            with told(folder, "made"):
                folder.mkdir(exist_ok=True)
                if folder != self.path:
                    (folder / "c").mkdir(exist_ok=True)
            if content(self.path / key) != data:
                put_all({self.path / key: data})
                settle(self.path)

    def _sweep(self) -> None:
        """Remove what was being written when a process died."""
        with told(self.path, "removed"):
            for path in self.path.rglob(".*.part"):
                if is_unfinished(path):
                    path.unlink()


def done_in(root: Path, layout: Layout) -> Array:
    """(chunks,) whether each claims to be worked out."""
    done = np.zeros(layout.chunks, dtype=bool)
    with told(root, "read"):
        folder = root / DIGEST / "c"
        for entry in os.scandir(folder) if folder.is_dir() else ():
            if entry.name.isdecimal() and entry.name.isascii() and int(entry.name) < layout.chunks:
                done[int(entry.name)] = True
    return done
