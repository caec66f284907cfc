"""Measured responses as NetCDF: labelled arrays with units.

    function, frequency, point   dimensions
    frequency (frequency)        Hz
    value (function, frequency, part)   real and imaginary part, in the unit of the function, exp(+i omega t)
    response, reference, motion, unit (function)   words: "12:+z", "3:-x", "acceleration", "m/s^2/N"
    coherence (function, frequency)     where there is one
    point (point), position (point, axis)      names, and coordinates in the axes of the measurement

What others have written is taken with care: names, kinds, shapes and sizes of arrays are looked at before any of them is read.
"""

from __future__ import annotations

import os
from importlib.metadata import version
from typing import Any

import h5py
import numpy as np

from trivet.errors import InputError, nearest, shown
from trivet.measure.channels import LONGEST_NAME, channel_of, factor_of, unit_of, written
from trivet.measure.checking import check_count
from trivet.measure.functions import MOTIONS, Channel, Functions, Motion
from trivet.model.quantity import Quantity
from trivet.results.netcdf import write_netcdf

KIND = "trivet measured responses"
MOST_POINTS = 100_000
LONGEST_WORD = 4 * LONGEST_NAME
LONGEST_SOURCE = 10_000


def write_labelled(functions: Functions, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write responses that `check_functions` takes."""
    import xarray as xr

    channels = list(zip(functions.motions, functions.responses, functions.references, strict=True))
    over, words = ("function", "frequency"), np.dtype(object)
    parts = np.stack([functions.values.real, functions.values.imag], axis=-1)
    variables = {
        "value": ((*over, "part"), parts, "see unit", "motion per load, exp(+i omega t)"),
        "response": (
            ("function",),
            np.array([written(c) for c in functions.responses], words),
            "1",
            "where and along what it moves",
        ),
        "reference": (
            ("function",),
            np.array([written(c) for c in functions.references], words),
            "1",
            "where and along what it is loaded",
        ),
        "motion": (("function",), np.array(functions.motions, words), "1", "what the response is"),
        "unit": (("function",), np.array([unit_of(*one) for one in channels], words), "1", "of the values"),
    }
    if functions.coherence is not None:
        variables["coherence"] = (over, functions.coherence, "1", "between response and load; NaN where there is none")
    coordinates: dict[str, Any] = {
        "frequency": ("frequency", functions.frequency, {"units": "Hz", "long_name": "frequency"}),
        "part": ["real", "imag"],
    }
    if functions.points:
        places = np.array([functions.points[point] for point in functions.points], dtype=float)
        variables["position"] = (("point", "axis"), places, "m", "of the point, in the axes of the measurement")
        coordinates |= {"point": np.array(list(functions.points), words), "axis": list("xyz")}
    dataset = xr.Dataset(
        {
            name: xr.Variable(own, values, {"units": unit, "long_name": text})
            for name, (own, values, unit, text) in variables.items()
        },
        coordinates,
        {"kind": KIND, "source": functions.source, "trivet_version": version("trivet"), "Conventions": "CF-1.11"},
    )
    write_netcdf(dataset, path, overwrite=overwrite)


def read_labelled(path: str | os.PathLike[str]) -> Functions:
    """Read responses; whatever else the file holds is left alone.

    Raises:
        InputError: with the variable, what it is and what was expected.
    """
    name = os.fspath(path)
    try:
        with h5py.File(name, "r") as file:
            return _Reader(name, file).functions()
    except (OSError, RuntimeError, KeyError, TypeError, UnicodeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name}: is no NetCDF-4 file, or is damaged: {error}") from None


class _Reader:
    """What is read of one file."""

    def __init__(self, name: str, file: Any) -> None:
        self.name = name
        self.file = file

    def functions(self) -> Functions:
        frequency = self.numbers("frequency", 1)
        count = self.array("response", 1).shape[0]
        check_count(count, len(frequency), self.name)
        if self.unit("frequency") != "Hz":
            raise InputError(f"{self.name}: frequency: has units {shown(self.unit('frequency'))}; expected Hz")
        responses, references = (self.channels(name, count) for name in ("response", "reference"))
        motions, units = self.motions(count), self.words("unit", count)
        values = self.numbers("value", 3, (count, len(frequency), 2)).view(complex)[..., 0]
        try:
            for k, own in enumerate(zip(units, motions, responses, references, strict=True)):
                factor = factor_of(*own)
                if factor != 1:
                    values[k] *= factor
        except InputError as error:
            raise InputError(f"{self.name}: unit: function {k + 1}: {error}") from None
        coherence = self.numbers("coherence", 2, values.shape) if "coherence" in self.file else None
        return Functions(frequency, values, motions, responses, references, self.points(), coherence, self.source())

    def array(self, name: str, dimensions: int) -> Any:
        """A variable, nothing of it read yet."""
        if name not in self.file:
            raise InputError(
                f"{self.name}: {name}: is missing; a file of measured responses has frequency, value, response, reference, "
                f"motion and unit{nearest(name, [key for key in self.file if isinstance(key, str)][:1000])}"
            )
        # Links and outer storage would lead out of the file, to whatever else this user may read.
        found = self.file[name] if isinstance(self.file.get(name, getlink=True), h5py.HardLink) else None
        if not isinstance(found, h5py.Dataset) or found.external or found.is_virtual:
            raise InputError(f"{self.name}: {name}: is no array in this file")
        if len(found.shape or ()) != dimensions:
            raise InputError(f"{self.name}: {name}: has shape {found.shape}; expected {dimensions} dimensions")
        return found

    def numbers(self, name: str, dimensions: int, shape: tuple[int, ...] | None = None) -> np.ndarray:
        """Numbers of a variable."""
        found = self.array(name, dimensions)
        if shape is None:
            check_count(1, found.shape[0], f"{self.name}: {name}")
        elif found.shape != shape:
            raise InputError(f"{self.name}: {name}: has shape {found.shape}; expected {shape}")
        if found.dtype.kind not in "fiu" or found.dtype.itemsize > 8:
            raise InputError(f"{self.name}: {name}: holds {found.dtype}; expected numbers")
        read: np.ndarray = found.astype("f8")[...]
        return read

    def unit(self, name: str) -> str:
        return self.word_of(self.file[name].attrs.get("units", ""), f"{name}: units", LONGEST_WORD)

    def words(self, name: str, count: int) -> list[str]:
        """Words of a variable."""
        found = self.array(name, 1)
        kind = h5py.check_string_dtype(found.dtype)
        if found.shape != (count,) or kind is None or (kind.length or 0) > LONGEST_WORD:
            raise InputError(f"{self.name}: {name}: has shape {found.shape} of {found.dtype}; expected {count} words")
        return [self.word_of(word, f"{name}: function {k + 1}", LONGEST_WORD) for k, word in enumerate(found.asstr()[...])]

    def word_of(self, word: Any, where: str, longest: int) -> str:
        text = word.decode("utf-8") if isinstance(word, bytes) else word.item() if isinstance(word, np.generic) else word
        if not isinstance(text, str) or len(text) > longest:
            raise InputError(f"{self.name}: {where}: {shown(text)}; expected words of at most {longest} letters")
        return str(text)

    def channels(self, name: str, count: int) -> tuple[Channel, ...]:
        found = []
        for k, word in enumerate(self.words(name, count)):
            try:
                found.append(channel_of(word))
            except InputError as error:
                raise InputError(f"{self.name}: {name}: function {k + 1}: {error}") from None
        return tuple(found)

    def motions(self, count: int) -> tuple[Motion, ...]:
        known = {str(motion): motion for motion in MOTIONS}
        found = self.words("motion", count)
        for k, word in enumerate(found):
            if word not in known:
                raise InputError(f"{self.name}: motion: function {k + 1}: {shown(word)}{nearest(word, known)}")
        return tuple(known[word] for word in found)

    def points(self) -> dict[str, tuple[float, float, float]]:
        if "position" not in self.file:
            return {}
        count = self.array("position", 2).shape[0]
        if count > MOST_POINTS:
            raise InputError(f"{self.name}: position: of {count} points; expected at most {MOST_POINTS}")
        names, places = self.words("point", count), self.numbers("position", 2, (count, 3))
        try:
            factor = Quantity("length", "m", "mm").parse(f"1 {self.unit('position')}")
        except Exception:
            raise InputError(
                f"{self.name}: position: has units {shown(self.unit('position'))}; expected a unit of length, such as m"
            ) from None
        if len(set(names)) < count:
            raise InputError(f"{self.name}: point: names some points twice")
        return {name: (x, y, z) for name, (x, y, z) in zip(names, (places * factor).tolist(), strict=True)}

    def source(self) -> str:
        return self.word_of(self.file.attrs.get("source", ""), "source", LONGEST_SOURCE)
