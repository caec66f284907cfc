"""Measured responses as NetCDF: labelled arrays with units.

    function, frequency, point   dimensions
    frequency (frequency)        Hz
    value (function, frequency, part)   real and imaginary part, in the unit of the function, exp(+i omega t)
    response, reference, motion, unit (function)   words: "12:+z", "3:-x", "acceleration", "m/s^2/N"
    coherence (function, frequency)     where there is one
    point (point), position (point, axis)      names, and coordinates in the axes of the measurement

What others have written is taken with care: names, kinds, shapes and sizes of arrays are looked at before any of them is read.
Dimensions may stand in another order, and so may parts and axes with their labels; numbers may be packed (scale_factor).
"""

from __future__ import annotations

import os
from importlib.metadata import version
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from trivet.errors import InputError, nearest, shown
from trivet.measure.channels import factor_of, unit_of, written
from trivet.measure.checking import check_count
from trivet.measure.files.labelled_file import LabelledFile, opened
from trivet.measure.functions import MOTIONS, Functions, Motion
from trivet.measure.imported import Content
from trivet.model.quantity import Quantity
from trivet.results.netcdf import write_netcdf

KIND = "trivet measured responses"
MOST_POINTS = 100_000
NEEDED = ("frequency", "value", "response", "reference", "motion", "unit")
OVER = ("function", "frequency")
_LENGTH = Quantity("length", "m", "mm")


def write_labelled(functions: Functions, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write responses that `check_functions` takes."""
    import xarray as xr

    channels = list(zip(functions.motions, functions.responses, functions.references, strict=True))
    words = np.dtype(object)
    parts = np.stack([functions.values.real, functions.values.imag], axis=-1)
    variables = {
        "value": ((*OVER, "part"), parts, "see unit", "motion per load, exp(+i omega t)"),
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
        variables["coherence"] = (OVER, functions.coherence, "1", "between response and load; NaN where there is none")
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


def read_labelled(path: str) -> Content:
    """Read responses; whatever else the file holds is left alone.

    Raises:
        InputError: with the variable, what it is and what was expected.
    """
    with opened(path, KIND, NEEDED) as file:
        functions = functions_of(file)
        return Content.of(path, functions, file.words("unit", len(functions)))


def functions_of(file: LabelledFile) -> Functions:
    """The responses of an open file, in SI; errors as of `read_labelled`."""
    frequency = file.numbers("frequency", (None,))
    count = file.array("response", (None,)).shape[0]
    check_count(count, len(frequency), file.name)
    if file.unit("frequency") != "Hz":
        raise InputError(f"{file.name}: frequency: has units {shown(file.unit('frequency'))}; expected Hz")
    responses, references = file.channels("response", count), file.channels("reference", count)
    motions, units = _motions(file, count), file.words("unit", count)
    factors = np.empty((count, 1))
    for k, own in enumerate(zip(units, motions, responses, references, strict=True)):
        try:
            factors[k] = factor_of(*own)
        except InputError as error:
            raise InputError(f"{file.name}: unit {k + 1}: {error}") from None
    shape = (count, len(frequency))
    values = file.complex("value", shape, OVER, factors)
    coherence = file.numbers("coherence", shape, OVER) if "coherence" in file else None
    return Functions(frequency, values, motions, responses, references, _points(file), coherence, file.source)


def _motions(file: LabelledFile, count: int) -> tuple[Motion, ...]:
    known = {str(motion): motion for motion in MOTIONS}
    found = file.words("motion", count)
    for k, word in enumerate(found):
        if word not in known:
            raise InputError(f"{file.name}: motion {k + 1}: {shown(word)}{nearest(word, known)}")
    return tuple(known[word] for word in found)


def _points(file: LabelledFile) -> dict[str, tuple[float, float, float]]:
    if "position" not in file:
        return {}
    count = file.array("point", (None,)).shape[0]
    if count > MOST_POINTS:
        raise InputError(f"{file.name}: position: of {count} points; expected at most {MOST_POINTS}")
    names, places = file.words("point", count), file.numbers("position", (count, 3), ("point", "axis"))
    places = places[:, file.places("axis", ("x", "y", "z"))]
    if len(set(names)) < count:
        raise InputError(f"{file.name}: point: names some points twice")
    try:
        factor = _LENGTH.parse(f"1 {file.unit('position')}")
    except PydanticCustomError as error:
        raise InputError(f"{file.name}: position: has units {shown(file.unit('position'))}: {error.message()}") from None
    return {name: (x, y, z) for name, (x, y, z) in zip(names, (places * factor).tolist(), strict=True)}
