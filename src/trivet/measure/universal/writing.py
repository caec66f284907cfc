"""Measured responses as universal files: datasets 151, 164, 2411, 58 and 55, in SI."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from trivet.errors import InputError
from trivet.files import replacing
from trivet.measure.functions import Channel, Functions
from trivet.measure.imported import MeasuredMode
from trivet.measure.universal.axis import has_six_digits, is_even
from trivet.measure.universal.reading import COHERENCE, RESPONSE
from trivet.measure.universal.units import LOADS, MOTION_OF, SI

Dataset = dict[str, Any]

_TYPES = {motion: kind for kind, motion in MOTION_OF.items()}
_SIZE = slice(38, 50)
"""Where a function in bytes says how many they are."""


def write_universal(
    functions: Functions,
    path: str | os.PathLike[str],
    modes: Sequence[MeasuredMode] = (),
    *,
    binary: bool = False,
    overwrite: bool = False,
) -> None:
    """Write responses with their points, coherence and modes as a universal file in SI; it appears whole or not at all.

    As bytes (58b) everything but modes is read back to the last bit, the frequencies too: where six digits of a first value
    and a step do not give them, they are written one by one, as doubles, which is how pyuff and its kin take them.  As text
    values have 12 digits, and frequencies that do not stand in six are refused.  Modes have 6 digits.

    Args:
        functions: the responses; points are numbers, directions lie along x, y or z.
        path: file to write.
        modes: mode shapes; complex ones have no rotations, which dataset 55 of pyuff does not take.
        binary: whether values are bytes rather than text.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: for what the format cannot hold, a file that exists unasked or cannot be written.
    """
    name = os.fspath(path)
    _check(functions, name, binary)
    datasets = [_header(functions), _UNITS, *_points(functions, name), *_functions(functions, name, binary)]
    datasets += [_mode(mode, k, name) for k, mode in enumerate(modes, 1)]
    import_module("pyuff")  # before a folder is begun
    # A file for each dataset: pyuff looks through the whole file before it adds to it.
    with replacing(path, overwrite=overwrite) as temporary, TemporaryDirectory() as folder, temporary.open("wb") as file:
        for k, dataset in enumerate(datasets):
            file.write(_bytes(dataset, Path(folder) / str(k)))


def _bytes(dataset: Dataset, path: Path) -> bytes:
    """A dataset as pyuff writes it into a file of its own."""
    import pyuff

    pyuff.UFF(str(path)).write_sets(dataset, "add")
    text = path.read_bytes()
    path.unlink()
    if not dataset.get("binary"):
        return text
    # pyuff says eight bytes a point, whatever a point has.
    each = (2 if np.iscomplexobj(dataset["data"]) else 1) + (0 if dataset["abscissa_spacing"] else 1)
    size = f"{8 * each * len(dataset['data']):{_SIZE.stop - _SIZE.start}d}".encode()
    return text[: _SIZE.start] + size + text[_SIZE.stop :]


def _check(functions: Functions, name: str, binary: bool) -> None:
    """Refuse what cannot be held, before the work."""
    if not len(functions) or len(functions.frequency) < 2:
        raise InputError(
            f"{name}: {len(functions)} functions at {len(functions.frequency)} lines; a file holds 1 at 2 at least"
        )
    if not np.isfinite(functions.values).all():
        k = int(np.flatnonzero(~np.isfinite(functions.values).all(axis=1))[0])
        raise InputError(f"{name}: {functions.labels[k]} has values that are not finite; universal files have none")
    if not (binary or is_even(functions.frequency) or has_six_digits(functions.frequency)):
        raise InputError(f"{name}: its frequencies need more than the six digits of text; write it as bytes (--binary)")


_UNITS: Dataset = {
    "type": 164, "units_code": 1, "units_description": "SI: Meter (newton)", "temp_mode": 2, "length": 1.0, "force": 1.0,
    "temp": 1.0, "temp_offset": 273.15,
}  # fmt: skip


def _header(functions: Functions) -> Dataset:
    return {
        "type": 151,
        "model_name": functions.source[:80] or "NONE",
        "description": "NONE",
        "db_app": "trivet",
        "program": "trivet",
    }


def _points(functions: Functions, name: str) -> Iterator[Dataset]:
    if functions.points:
        places = np.array(list(functions.points.values()))
        none = [0] * len(places)
        yield {
            "type": 2411, "node_nums": [_number(point, name) for point in functions.points], "def_cs": none, "disp_cs": none,
            "color": [8] * len(places), "x": places[:, 0], "y": places[:, 1], "z": places[:, 2],
        }  # fmt: skip


def _number(point: str, name: str) -> int:
    if not (point.isascii() and point.isdigit() and 0 < int(point) < 10**9 and str(int(point)) == point):
        raise InputError(f'{name}: point "{point}" is no number; universal files have points 1, 2, 3, …')
    return int(point)


def _code(channel: Channel, name: str) -> int:
    """A direction as 1 to 6, negative against the axis."""
    axis = int(np.argmax(np.abs(channel.direction)))
    along = channel.direction[axis]
    if abs(along) < 1 - 1e-9:
        raise InputError(f"{name}: {channel} lies along no axis; universal files are written with directions x, y and z only")
    code = axis + 1 + (3 if channel.is_rotation else 0)
    return code if along > 0 else -code


def _functions(functions: Functions, name: str, binary: bool) -> Iterator[Dataset]:
    """Each response, and behind it its coherence where it has one."""
    even = is_even(functions.frequency)
    for k, (values, response, reference) in enumerate(
        zip(functions.values, functions.responses, functions.references, strict=True)
    ):
        common: Dataset = {
            "type": 58, "binary": int(binary), "x": functions.frequency, "abscissa_spacing": int(even),
            "abscissa_spec_data_type": 18, "abscissa_axis_lab": "Frequency", "abscissa_axis_units_lab": "Hz",
            "rsp_node": _number(response.point, name), "rsp_dir": _code(response, name),
            "ref_node": _number(reference.point, name), "ref_dir": _code(reference, name),
        }  # fmt: skip
        motion = functions.motions[k]
        yield common | {
            "func_type": RESPONSE, "data": np.array(values, dtype=complex), "id1": functions.labels[k],
            "ordinate_spec_data_type": _TYPES[motion], "ordinate_axis_units_lab": SI[motion][response.is_rotation],
            "orddenom_spec_data_type": max(LOADS), "orddenom_axis_units_lab": "N m" if reference.is_rotation else "N",
        }  # fmt: skip
        row = None if functions.coherence is None else functions.coherence[k]
        if row is None or np.isnan(row).all():
            continue
        if not np.isfinite(row).all():
            raise InputError(f"{name}: the coherence of {functions.labels[k]} has gaps; universal files have none")
        yield common | {
            "func_type": COHERENCE,
            "data": row,
            "id1": f"Coherence {functions.labels[k]}",
            "orddenom_spec_data_type": 0,
        }


def _mode(mode: MeasuredMode, number: int, name: str) -> Dataset:
    if not np.isfinite(mode.shape).all():
        raise InputError(f"{name}: mode {number} has values that are not finite; universal files have none")
    common: Dataset = {
        "type": 55, "id1": mode.title[:80] or "NONE", "spec_data_type": 8, "load_case": 1, "mode_n": number,
        "node_nums": [_number(point, name) for point in mode.points],
    }  # fmt: skip
    columns = mode.shape.shape[1]
    if columns == 3:
        shape = {f"r{k + 1}": mode.shape[:, k].astype(complex) for k in range(3)}
        return common | shape | {"analysis_type": 3, "data_ch": 2, "eig": complex(mode.pole)}
    if np.any(mode.shape.imag):
        raise InputError(f"{name}: mode {number} is complex and has rotations; dataset 55 is written with one of both")
    shape = {f"r{k + 1}": mode.shape[:, k].real for k in range(columns)}
    return common | shape | {"analysis_type": 2, "data_ch": 3, "freq": mode.frequency, "modal_damp_vis": mode.damping}
