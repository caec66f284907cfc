"""Files that are there, whole, after a power cut too; and a folder that one process has to itself."""

from __future__ import annotations

import fcntl
import os
import socket
import stat
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

from trivet.errors import InputError, one_line
from trivet.files import replacing

LOCK = ".lock"
"""The file by which a folder is held."""
AT_ONCE = 8
"""Files that are written together."""


def put(path: Path, data: bytes) -> None:
    """Write a file, which has reached the disk under its name when `settle` has been called for its folder.

    Raises:
        InputError: where it cannot be written; what was there before is there still.
    """
    with replacing(path, overwrite=True) as temporary, open(temporary, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def settle(folder: Path) -> None:
    """Have the names in a folder reach the disk."""
    with told(folder, "written"):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def put_all(files: Mapping[Path, bytes]) -> None:
    """Write files, which have all reached the disk under their names when this returns.

    Several at a time: writing is waiting for the disk, which takes many at once in the time of one.
    """
    with ThreadPoolExecutor(AT_ONCE) as threads:
        list(threads.map(put, files, files.values()))
        list(threads.map(settle, {path.parent for path in files}))


def content(path: Path) -> bytes | None:
    """What a file holds; None where there is none.

    Raises:
        InputError: where it cannot be read, or is no file: a folder, or a pipe, of which the end would never come.
    """
    with told(path, "read"):
        try:
            if not stat.S_ISREG(path.stat().st_mode):
                raise InputError(f"{path}: is in the place of a file; remove it")
            return path.read_bytes()
        except (FileNotFoundError, NotADirectoryError):
            return None


def is_unfinished(path: Path) -> bool:
    """Whether a file is one that was being written when its process died."""
    return path.name.startswith(".") and path.name.endswith(".part")


@contextmanager
def told(path: str | os.PathLike[str], what: str) -> Iterator[None]:
    """What the system refuses, as one line about a path."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{os.fspath(error.filename or path)}: cannot be {what}: {error.strerror or error}") from None


class Lock:
    """A folder held by this process, until it lets go or dies."""

    def __init__(self, folder: Path, name: Path) -> None:
        """Take hold of a folder.

        Raises:
            InputError: when another process has it, or files there cannot be locked; it is called by `name`.
        """
        self._path = folder / LOCK
        with told(self._path, "locked"):
            self._descriptor = self._held(name)
            os.ftruncate(self._descriptor, 0)
            os.write(self._descriptor, f"process {os.getpid()} on {socket.gethostname()}".encode())

    def _held(self, name: Path) -> int:
        while True:
            descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                with suppress(FileNotFoundError):
                    if os.path.samestat(os.fstat(descriptor), os.stat(self._path)):
                        return descriptor
            except BlockingIOError:
                holder = one_line(os.read(descriptor, 200).decode(errors="replace"), 200) or "another process"
                os.close(descriptor)
                raise InputError(f"{name}: is being worked at by {holder}; wait for it or end it") from None
            except OSError:
                os.close(descriptor)
                raise
            os.close(descriptor)  # whoever had it has let go meanwhile, and taken the file away

    def release(self) -> None:
        """Let go of it."""
        with suppress(OSError):
            self._path.unlink()
        os.close(self._descriptor)
