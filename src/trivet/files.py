"""Writing files whole or not at all."""

from __future__ import annotations

import math
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from trivet.errors import InputError

_begun: set[str] = set()
"""Temporary files that are being written."""

_borrowed: set[str] = set()
"""Temporary folders that are in use."""

_TRIES = 50
"""How often it is begun anew to remove a folder when whoever is leaving is interrupted at it."""


@contextmanager
def replacing(path: str | os.PathLike[str], *, overwrite: bool = False) -> Iterator[Path]:
    """A temporary file in the folder of `path`, which takes that name when the block ends and vanishes when it fails.

    Args:
        path: the file to appear.
        overwrite: whether a file of this name may be replaced.

    Yields:
        Path of the empty temporary file, to be written by the block.

    Raises:
        InputError: when `path` is a folder, exists unasked, or cannot be written.
    """
    target = Path(os.path.realpath(path))
    temporary = target.parent / f".{target.name}.{secrets.token_hex(4)}.part"
    created = False
    try:
        if target.is_dir():
            raise InputError(f"{os.fspath(path)}: is a folder; the name of a file was expected")
        if target.exists() and not target.is_file():
            raise InputError(f"{os.fspath(path)}: is not a regular file")
        if target.exists() and not overwrite:
            raise InputError(_exists(path))
        # Not tempfile: its files are closed to everybody else, and so would be the result.
        _begun.add(str(temporary))
        temporary.open("x").close()
        created = True
        yield temporary
        if overwrite:
            os.replace(temporary, target)
        else:
            _place(temporary, target, path)
        created = False
    except OSError as error:
        if error.filename is not None and os.fspath(error.filename) not in (str(temporary), str(target)):
            raise  # the block stumbled over another file
        raise InputError(f"{os.fspath(path)}: cannot be written: {error.strerror or error}") from None
    finally:
        if created:
            temporary.unlink(missing_ok=True)
        _begun.discard(str(temporary))


@contextmanager
def borrowed_folder() -> Iterator[Path]:
    """An empty folder that vanishes when the block ends, however often its end is interrupted."""
    folder = tempfile.mkdtemp(prefix="trivet-")
    _borrowed.add(folder)
    try:
        yield Path(folder)
    finally:
        _clear_away(folder)
        _borrowed.discard(folder)


def _clear_away(folder: str) -> None:
    """Remove a folder; an interruption meanwhile is raised when it is gone."""
    interruption: BaseException | None = None
    for _ in range(_TRIES):
        try:
            shutil.rmtree(folder, ignore_errors=True)
            break
        except (KeyboardInterrupt, SystemExit) as error:
            interruption = error
    if interruption is not None:
        raise interruption


def remove_begun() -> None:
    """Remove the files that are being written and the folders in use: for who leaves without ending their blocks."""
    for name in list(_begun):
        with suppress(OSError):
            os.unlink(name)
    for folder in list(_borrowed):
        shutil.rmtree(folder, ignore_errors=True)


def check_room(path: str | os.PathLike[str], size: float) -> None:
    """Raise InputError where the disk of a path has no room for so many bytes: HDF5 does not take a full one gracefully."""
    folder = Path(os.path.realpath(path)).parent
    room = shutil.disk_usage(folder).free if folder.is_dir() else math.inf
    if size > room:
        raise InputError(f"{os.fspath(path)}: takes {size / 1e6:.3g} MB, the disk has room for {room / 1e6:.3g} MB")


def _exists(path: str | os.PathLike[str]) -> str:
    return f"{os.fspath(path)}: exists already; choose another name, or allow overwriting (--overwrite)"


def _place(temporary: Path, target: Path, path: str | os.PathLike[str]) -> None:
    """Give a file its name unless another has taken it meanwhile."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        raise InputError(_exists(path)) from None
    except OSError:  # a file system without links
        os.replace(temporary, target)
        return
    temporary.unlink()


def check_writable(path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Raise InputError, before any long work, when `replacing` would refuse the path; leaves nothing behind."""
    try:
        with replacing(path, overwrite=overwrite):
            raise _Enough
    except _Enough:
        pass


class _Enough(Exception):
    """The file could be written."""
