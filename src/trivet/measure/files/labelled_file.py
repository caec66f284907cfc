"""NetCDF files of others, taken with care: kinds, shapes and sizes of arrays are looked at before any of them is read."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import h5py
import numpy as np

from trivet.errors import InputError, shown
from trivet.measure.channels import LONGEST_NAME, channel_of
from trivet.measure.checking import MOST_VALUES
from trivet.measure.functions import Channel

LONGEST_WORD = 4 * LONGEST_NAME
LONGEST_SOURCE = 10_000
Shape = tuple[int | None, ...]
"""Of an array; None where any length will do."""


@contextmanager
def opened(path: str | os.PathLike[str], what: str, needed: tuple[str, ...]) -> Iterator[LabelledFile]:
    """A file while it is read; `what` it holds and what is `needed` for that are for messages.

    Raises:
        InputError: for what is no such file, and in place of all errors of the library.
    """
    name = os.fspath(path)
    try:
        with h5py.File(name, "r") as file:
            yield LabelledFile(name, file, f"a file of {what} has {', '.join(needed)}")
    except InputError:
        raise
    except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{name}: is no NetCDF-4 file, or is damaged: {error}") from None


class LabelledFile:
    """Arrays and words of a file."""

    def __init__(self, name: str, file: Any, expected: str) -> None:
        self.name = name
        self._file = file
        self._expected = expected

    def __contains__(self, name: str) -> bool:
        return name in self._file

    def array(self, name: str, shape: Shape) -> Any:
        """A variable, nothing of it read yet."""
        if name not in self._file:
            raise InputError(f"{self.name}: {name}: is missing; {self._expected}")
        # Links and outer storage would lead out of the file, to whatever else this user may read.
        found = self._file[name] if isinstance(self._file.get(name, getlink=True), h5py.HardLink) else None
        if not isinstance(found, h5py.Dataset) or found.external or found.is_virtual:
            raise InputError(f"{self.name}: {name}: is no array in this file")
        own = found.shape or ()
        if len(own) != len(shape) or any(n not in (None, have) for n, have in zip(shape, own, strict=True)):
            expected = ", ".join("any" if n is None else str(n) for n in shape)
            raise InputError(f"{self.name}: {name}: has shape {own}; expected ({expected})")
        return found

    def numbers(self, name: str, shape: Shape) -> np.ndarray:
        """Numbers of a variable."""
        found = self.array(name, shape)
        if found.dtype.kind not in "fiu" or found.dtype.itemsize > 8:
            raise InputError(f"{self.name}: {name}: holds {found.dtype}; expected numbers")
        if found.size > 2 * MOST_VALUES:
            raise InputError(f"{self.name}: {name}: has {found.size} numbers; expected at most {2 * MOST_VALUES}")
        read: np.ndarray = found.astype("f8")[...]
        return read

    def complex(self, name: str, shape: Shape) -> np.ndarray:
        """Numbers whose real and imaginary parts are the last axis, which is gone then."""
        found: np.ndarray = self.numbers(name, (*shape, 2)).view(complex)[..., 0]
        return found

    def unit(self, name: str) -> str:
        """The units of a variable."""
        return self._word(self._file[name].attrs.get("units", ""), f"{name}: units", LONGEST_WORD)

    def words(self, name: str, count: int) -> list[str]:
        """Words of a variable."""
        found = self.array(name, (count,))
        kind = h5py.check_string_dtype(found.dtype)
        if kind is None or (kind.length or 0) > LONGEST_WORD:
            raise InputError(f"{self.name}: {name}: holds {found.dtype}; expected words of at most {LONGEST_WORD} letters")
        return [self._word(word, f"{name} {k + 1}", LONGEST_WORD) for k, word in enumerate(found.asstr()[...])]

    def channels(self, name: str, count: int) -> tuple[Channel, ...]:
        """Channels, which are words."""
        found = []
        for k, word in enumerate(self.words(name, count)):
            try:
                found.append(channel_of(word))
            except InputError as error:
                raise InputError(f"{self.name}: {name} {k + 1}: {error}") from None
        return tuple(found)

    @property
    def source(self) -> str:
        """Where it all comes from."""
        return self._word(self._file.attrs.get("source", ""), "source", LONGEST_SOURCE)

    def _word(self, word: Any, where: str, longest: int) -> str:
        text = word.decode("utf-8") if isinstance(word, bytes) else word.item() if isinstance(word, np.generic) else word
        if not isinstance(text, str) or len(text) > longest:
            raise InputError(f"{self.name}: {where}: {shown(text)}; expected words of at most {longest} letters")
        return text
