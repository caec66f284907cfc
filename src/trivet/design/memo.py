"""What an optimisation has worked out, kept in a file that grows: a run that was interrupted goes on as if it had not been.

The file is records one after the other, each with its length and a checksum that tells whose it is.  A record that a power cut
or a flipped byte has damaged is taken out, and worked out again; those after it are found by their marks and stay.
"""

from __future__ import annotations

import fcntl
import os
import stat
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.design.store.disk import told as refused
from trivet.errors import InputError

Array = NDArray[Any]

_HEAD = struct.Struct("<4sIIII")
"""Mark, length of the key, of the values with their shape, and checksums of these lengths and of all that follows."""
_MARK = b"tvmo"
_TITLE = b"trivet optimisation "
"""How the key of the record begins that tells whose file it is; all others have that key in their checksums."""
_BEGINNING = 65536
"""Bytes in which a file of ours has a mark, however damaged."""


class _Record(NamedTuple):
    """A record that is sound."""

    start: int
    end: int
    key: bytes
    values: Array


class Memo(MutableMapping[bytes, Array]):
    """Values by the bytes of what they were asked of; new ones are written at once."""

    def __init__(self, descriptor: int, path: str, title: bytes) -> None:
        self._descriptor, self._path, self._title = descriptor, path, title
        self._known: dict[bytes, Array] = {}

    def __getitem__(self, key: bytes) -> Array:
        return self._known[key]

    def __contains__(self, key: object) -> bool:
        return key in self._known

    def __iter__(self) -> Iterator[bytes]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)

    def __delitem__(self, key: bytes) -> None:
        raise TypeError("what was worked out stays")

    def __setitem__(self, key: bytes, values: Array) -> None:
        self.update({key: values})

    def update(self, *others: Any, **_: Any) -> None:
        """Take in what is new, with one writing."""
        new: dict[bytes, Array] = {}
        for other in others:
            items: Iterable[tuple[bytes, Array]] = other.items() if isinstance(other, Mapping) else other
            new |= {key: np.ascontiguousarray(values, dtype=float) for key, values in items}
        self._write(b"".join(_record(key, values, self._title) for key, values in new.items()))
        self._known |= new

    def _write(self, data: bytes) -> None:
        end = os.lseek(self._descriptor, 0, os.SEEK_END)
        try:
            while data:
                data = data[os.write(self._descriptor, data) :]
        except OSError as error:
            os.ftruncate(self._descriptor, end)
            raise InputError(f"{self._path}: cannot be written: {error.strerror or error}; what is there stays") from None

    def read(self) -> int:
        """Take in what the file holds; what is damaged is taken out, and its bytes are counted.

        Raises:
            InputError: for a file of something else or of another study, which stays as it is.
        """
        with refused(self._path, "read"), open(os.dup(self._descriptor), "rb") as file:
            file.seek(0)
            begun = file.read(_BEGINNING)
            if begun[: len(_MARK)] != _MARK[: len(begun)] and _MARK not in begun:
                raise InputError(f"{self._path}: is no file of an optimisation; choose another name (--store)")
            data = begun + file.read()
        sound = list(_records(data, self._title))
        titles = {record.key for record in sound if record.key.startswith(_TITLE)}
        if titles - {self._title}:
            raise InputError(
                f"{self._path}: is of another study, or of another version; choose another name (--store), or remove it"
            )
        title = _record(self._title, np.zeros(0), b"")
        if not sound and len(data) >= len(title):
            raise InputError(
                f"{self._path}: is damaged, and nothing tells that it is of this study; choose another name (--store), "
                "or remove it"
            )
        self._known = {record.key: record.values for record in sound if record.key != self._title}
        cut = len(data) - sum(record.end - record.start for record in sound)
        if cut:
            self._close_gaps(data, sound)
        if not titles:
            self._write(title)
        return cut

    def _close_gaps(self, data: bytes, sound: list[_Record]) -> None:
        """Leave nothing but records that are sound.  None goes to where one is that still has to go: a death costs one."""
        place = 0
        with refused(self._path, "mended"):
            for record in sound:
                if record.start != place:
                    os.pwrite(self._descriptor, data[record.start : record.end], place)
                place += record.end - record.start
            os.ftruncate(self._descriptor, place)


def _record(key: bytes, values: Array, title: bytes) -> bytes:
    shape = struct.pack(f"<B{values.ndim}I", values.ndim, *values.shape)
    held = shape + values.astype("<f8").tobytes()
    lengths = struct.pack("<II", len(key), len(held))
    return _HEAD.pack(_MARK, len(key), len(held), zlib.crc32(lengths), zlib.crc32(title + key + held)) + key + held


def _records(data: bytes, title: bytes) -> Iterator[_Record]:
    """Records of a title, and those that are titles, wherever they are."""
    place = data.find(_MARK)
    while place >= 0:
        found = _parsed(data, place, title)
        if found is not None:
            yield found
        place = data.find(_MARK, place + 1 if found is None else found.end)


def _parsed(data: bytes, place: int, title: bytes) -> _Record | None:
    """The record at a place; None where there is none, or a damaged one."""
    if place + _HEAD.size > len(data):
        return None
    _, of_key, of_held, of_lengths, of_body = _HEAD.unpack_from(data, place)
    start, end = place + _HEAD.size, place + _HEAD.size + of_key + of_held
    if of_lengths != zlib.crc32(struct.pack("<II", of_key, of_held)) or end > len(data):
        return None
    key, held = data[start : start + of_key], data[start + of_key : end]
    if of_body != zlib.crc32((b"" if key.startswith(_TITLE) else title) + key + held):
        return None
    shape = struct.unpack_from(f"<{held[0]}I", held, 1)
    return _Record(place, end, key, np.frombuffer(held[1 + 4 * held[0] :], dtype="<f8").reshape(shape).copy())


@contextmanager
def kept(
    path: str | os.PathLike[str] | None, fingerprint: str, told: Any = lambda cut: None
) -> Iterator[MutableMapping[bytes, Array]]:
    """What is known of a study, from a file that is made, or gone on with; without a path, of this run alone.

    Args:
        path: the file.
        fingerprint: of the study.
        told: called with the bytes that were damaged, and are taken out, where there are any.

    Raises:
        InputError: for a file of something else or of another study, that another process is at, or that cannot be written.
    """
    if path is None:
        yield {}
        return
    name = os.fspath(path)
    try:
        descriptor = os.open(name, os.O_RDWR | os.O_CREAT, 0o666)
    except IsADirectoryError:
        raise InputError(f"{name}: is a folder, as a sweep makes; choose another name (--store)") from None
    except OSError as error:
        raise InputError(f"{name}: cannot be written: {error.strerror or error}") from None
    try:
        yield _opened(descriptor, name, fingerprint, told)
    finally:
        os.close(descriptor)


def _opened(descriptor: int, name: str, fingerprint: str, told: Callable[[int], None]) -> Memo:
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        raise InputError(f"{name}: is not a regular file; choose another name (--store)")
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(f"{name}: another process is at it; wait for it or end it") from None
    except OSError as error:
        raise InputError(f"{name}: cannot be locked: {error.strerror or error}") from None
    memo = Memo(descriptor, name, _TITLE + f"2 {version('trivet')} {fingerprint}".encode())
    cut = memo.read()
    if cut:
        told(cut)
    return memo


class Part(MutableMapping[bytes, Array]):
    """The part of what is known that is one machine's."""

    def __init__(self, memo: MutableMapping[bytes, Array], prefix: bytes) -> None:
        self._memo, self._prefix = memo, prefix

    def __getitem__(self, key: bytes) -> Array:
        return self._memo[self._prefix + key]

    def __contains__(self, key: object) -> bool:
        return isinstance(key, bytes) and self._prefix + key in self._memo

    def __setitem__(self, key: bytes, values: Array) -> None:
        self._memo.update({self._prefix + key: values})

    def update(self, *others: Any, **_: Any) -> None:
        """Take in what is new, with one writing."""
        for other in others:
            items = other.items() if isinstance(other, Mapping) else other
            self._memo.update({self._prefix + key: values for key, values in items})

    def __delitem__(self, key: bytes) -> None:
        del self._memo[self._prefix + key]

    def __iter__(self) -> Iterator[bytes]:
        return (key.removeprefix(self._prefix) for key in self._memo if key.startswith(self._prefix))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def remembered(memo: MutableMapping[bytes, Array], kind: bytes, designs: Array, work_out: Callable[[Array], Array]) -> Array:
    """Rows (n, k) of designs (n, d) of a kind that `work_out` gives; it is asked for those that are not known."""
    keys = [kind + np.ascontiguousarray(design, dtype=float).tobytes() for design in designs]
    new = [k for k, key in enumerate(keys) if key not in memo]
    if new:
        memo.update(dict(zip((keys[k] for k in new), work_out(designs[new]), strict=True)))
    return np.array([memo[key] for key in keys])
