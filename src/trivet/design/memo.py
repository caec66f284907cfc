"""What an optimisation has worked out, kept in a file that grows: a run that was interrupted goes on as if it had not been.

The file is records one after the other, each with its length and a checksum.  Whatever is wrong with the file from some record
on, of a power cut or a flipped byte, is cut off, and worked out again.
"""

from __future__ import annotations

import fcntl
import os
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError

Array = NDArray[Any]

_HEAD = struct.Struct("<4sIIII")
"""Mark, length of the key, of the values with their shape, and checksums of these lengths and of all that follows."""
_MARK = b"tvmo"


class Memo(MutableMapping[bytes, Array]):
    """Values by the bytes of what they were asked of; new ones are written at once."""

    def __init__(self, descriptor: int, path: str) -> None:
        self._descriptor, self._path = descriptor, path
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
        self._write(b"".join(_record(key, values) for key, values in new.items()))
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
        """Take in what the file holds; what is damaged, and all after it, is cut off, and its bytes are counted."""
        data = os.pread(self._descriptor, os.fstat(self._descriptor).st_size, 0)
        place = 0
        while (found := _parsed(data, place)) is not None:
            key, values, place = found
            self._known[key] = values
        os.ftruncate(self._descriptor, place)
        return len(data) - place


def _record(key: bytes, values: Array) -> bytes:
    shape = struct.pack(f"<B{values.ndim}I", values.ndim, *values.shape)
    held = shape + values.astype("<f8").tobytes()
    lengths = struct.pack("<II", len(key), len(held))
    return _HEAD.pack(_MARK, len(key), len(held), zlib.crc32(lengths), zlib.crc32(key + held)) + key + held


def _parsed(data: bytes, place: int) -> tuple[bytes, Array, int] | None:
    """The record at a place and where the next one is; None where there is none, or a damaged one."""
    if place + _HEAD.size > len(data):
        return None
    mark, of_key, of_held, of_lengths, of_body = _HEAD.unpack_from(data, place)
    start, end = place + _HEAD.size, place + _HEAD.size + of_key + of_held
    if mark != _MARK or of_lengths != zlib.crc32(struct.pack("<II", of_key, of_held)) or end > len(data):
        return None
    body = data[start:end]
    if zlib.crc32(body) != of_body:
        return None
    key, held = body[:of_key], body[of_key:]
    shape = struct.unpack_from(f"<{held[0]}I", held, 1)
    return key, np.frombuffer(held[1 + 4 * held[0] :], dtype="<f8").reshape(shape).copy(), end


@contextmanager
def kept(
    path: str | os.PathLike[str] | None, fingerprint: str, told: Any = lambda cut: None
) -> Iterator[MutableMapping[bytes, Array]]:
    """What is known of a study, from a file that is made, or gone on with; without a path, of this run alone.

    Args:
        path: the file.
        fingerprint: of the study.
        told: called with the bytes that were damaged, and are cut off, where there are any.

    Raises:
        InputError: for a file of something else or of another study, that another process is at, or that cannot be written.
    """
    if path is None:
        yield {}
        return
    name = os.fspath(path)
    try:
        descriptor = os.open(name, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    except OSError as error:
        raise InputError(f"{name}: cannot be written: {error.strerror or error}") from None
    try:
        yield _opened(descriptor, name, fingerprint, told)
    finally:
        os.close(descriptor)


def _opened(descriptor: int, name: str, fingerprint: str, told: Callable[[int], None]) -> Memo:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise InputError(f"{name}: another process is at it") from None
    head = f"trivet optimisation 1 {version('trivet')} {fingerprint}".encode()
    size = os.fstat(descriptor).st_size
    begun = os.pread(descriptor, 4, 0)
    if size and begun != _MARK[: len(begun)]:
        raise InputError(f"{name}: is no file of an optimisation; choose another name (--store)")
    memo = Memo(descriptor, name)
    cut = memo.read()
    others = [key for key in memo if key.startswith(b"trivet optimisation ")]
    if others and others != [head]:
        raise InputError(f"{name}: is of another study, or of another version; choose another name (--store), or remove it")
    if not others:
        memo.update({head: np.zeros(0)})
    if cut:
        told(cut)
    return memo
