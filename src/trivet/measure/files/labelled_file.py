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
KINDS = {"trivet measured responses": "measured responses", "trivet modal fit": "a modal fit"}
"""Files of trivet that are read, in words, by their attribute "kind"; others have none, yet a version of trivet."""
Dimensions = tuple[str, ...]
"""Their names."""


@contextmanager
def opened(path: str | os.PathLike[str], kind: str, needed: tuple[str, ...]) -> Iterator[LabelledFile]:
    """A file while it is read; of which kind it is to be (see `KINDS`), and what is needed for that.

    Raises:
        InputError: for a file of another kind or what is no such file, and in place of all errors of the library.
    """
    name, plain = os.fspath(path), KINDS[kind]
    try:
        with h5py.File(name, "r") as file:
            found = LabelledFile(name, file, f"a file of {plain} has {', '.join(needed)}")
            if found.kind not in (None, kind):
                raise InputError(f"{name}: holds {KINDS.get(found.kind, 'other results')}, not {plain}")
            yield found
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

    def array(self, name: str, shape: Shape, dimensions: Dimensions = ()) -> Any:
        """A variable, nothing of it read yet, whose shape and dimensions may stand in another order."""
        if name not in self._file:
            raise InputError(f"{self.name}: {name}: is missing; {self._expected}")
        # Links and outer storage would lead out of the file, to whatever else this user may read.
        found = self._file[name] if isinstance(self._file.get(name, getlink=True), h5py.HardLink) else None
        if not isinstance(found, h5py.Dataset) or found.external or found.is_virtual:
            raise InputError(f"{self.name}: {name}: is no array in this file")
        own = found.shape or ()
        ordered = tuple(own[k] for k in self._order(found, name, dimensions)) if len(own) == len(dimensions) else own
        if len(own) != len(shape) or any(n not in (None, have) for n, have in zip(shape, ordered, strict=True)):
            expected = ", ".join("any" if n is None else str(n) for n in shape)
            raise InputError(f"{self.name}: {name}: has shape {own}; expected ({expected})")
        return found

    def _order(self, found: Any, name: str, dimensions: Dimensions) -> list[int]:
        """Where dimensions are in those of a variable; as they are where the file does not name them."""
        own = [scales[0].name.rpartition("/")[2] if len(scales) else "" for scales in found.dims]
        if not any(own):
            return list(range(len(dimensions)))
        if sorted(own) != sorted(dimensions):
            raise InputError(f"{self.name}: {name}: has dimensions {', '.join(own)}; expected {', '.join(dimensions)}")
        return [own.index(dimension) for dimension in dimensions]

    def numbers(self, name: str, shape: Shape, dimensions: Dimensions = ()) -> np.ndarray:
        """Numbers of a variable, its dimensions in this order where they have names; what is packed is unpacked (CF, 8.1)."""
        found = self.array(name, shape, dimensions)
        if found.dtype.kind not in "fiu" or found.dtype.itemsize > 8:
            raise InputError(f"{self.name}: {name}: holds {found.dtype}; expected numbers")
        if found.size > 2 * MOST_VALUES:
            raise InputError(f"{self.name}: {name}: has {found.size} numbers; expected at most {2 * MOST_VALUES}")
        read: np.ndarray = found.astype("f8")[...]
        missing = [self._number(found, name, key) for key in ("_FillValue", "missing_value")]
        for value in (value for value in missing if value is not None):
            read[read == value] = np.nan
        scale, offset = (self._number(found, name, key) for key in ("scale_factor", "add_offset"))
        if scale is not None or offset is not None:
            read = read * (1.0 if scale is None else scale) + (0.0 if offset is None else offset)
        return read.transpose(self._order(found, name, dimensions)) if dimensions else read

    def _number(self, found: Any, name: str, key: str) -> float | None:
        """An attribute that is a number, if there is one."""
        if key not in found.attrs:
            return None
        value = np.asarray(found.attrs[key])
        if value.size != 1 or value.dtype.kind not in "fiu":
            raise InputError(f"{self.name}: {name}: {key}: {shown(found.attrs[key])}; expected a number")
        return float(value.ravel()[0])

    def complex(self, name: str, shape: Shape, dimensions: Dimensions = (), factors: np.ndarray | None = None) -> np.ndarray:
        """Numbers, times factors, whose real and imaginary parts are the last axis, which is gone then."""
        parts = self.numbers(name, (*shape, 2), (*dimensions, "part") if dimensions else ())
        real, imaginary = (parts[..., k] for k in self.places("part", ("real", "imag")))
        found = np.empty(real.shape, dtype=complex)
        found.real, found.imag = real, imaginary
        if factors is not None:  # apart, so that infinities remain what they are
            with np.errstate(over="ignore"):
                found.real *= factors
                found.imag *= factors
        return found

    def places(self, name: str, labels: tuple[str, ...]) -> list[int]:
        """Where labels are along a dimension; in their order where the file has no labels there."""
        if name not in self._file or h5py.check_string_dtype(self.array(name, (len(labels),)).dtype) is None:
            return list(range(len(labels)))
        own = self.words(name, len(labels))
        if sorted(own) != sorted(labels):
            raise InputError(f"{self.name}: {name}: is {', '.join(own)}; expected {', '.join(labels)}")
        return [own.index(label) for label in labels]

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
    def kind(self) -> str | None:
        """What the file says that it holds; None where that is nothing, and no file of trivet."""
        attributes = self._file.attrs
        if not {"kind", "trivet_version"} & set(attributes):
            return None
        return self._word(attributes.get("kind", ""), "kind", LONGEST_WORD)

    @property
    def source(self) -> str:
        """Where it all comes from."""
        return self._word(self._file.attrs.get("source", ""), "source", LONGEST_SOURCE)

    def _word(self, word: Any, where: str, longest: int) -> str:
        text = word.decode("utf-8") if isinstance(word, bytes) else word.item() if isinstance(word, np.generic) else word
        if not isinstance(text, str) or len(text) > longest:
            raise InputError(f"{self.name}: {where}: {shown(text)}; expected words of at most {longest} letters")
        return text
