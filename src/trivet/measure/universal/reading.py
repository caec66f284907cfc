"""Measured responses from universal files."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from trivet.errors import InputError
from trivet.measure.universal.axis import even_axis
from trivet.measure.universal.join import COHERENCE, RESPONSE, Coherence, Found, Imported, Measured, Unused, joined
from trivet.measure.universal.modes import MeasuredMode, mode_of
from trivet.measure.universal.parse import Fields, function, head, parse, record_of
from trivet.measure.universal.points import Geometry, geometry
from trivet.measure.universal.scan import Block, scan
from trivet.measure.universal.units import Declared, Scale, declared, hertz, unit_of

SUFFIXES = (".unv", ".uff", ".uf", ".u58", ".bunv", ".ufb")
"""Of universal files."""
_KINDS = {
    0: "general function", 1: "time record", 2: "auto spectrum", 3: "cross spectrum", 5: "transmissibility",
    7: "auto correlation", 8: "cross correlation", 9: "power spectral density", 10: "energy spectral density", 12: "spectrum",
    18: "mode indicator function", 21: "partial coherence", 26: "multiple coherence",
}  # fmt: skip
_OTHER = {18: "coordinate systems", 55: "data at points that are no mode", 82: "trace lines", 2412: "elements"}


def read_universal(
    paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    units: str | None = None,
    least_coherence: float | None = None,
) -> Imported:
    """Read frequency response functions, with their points, coherence and modes, from universal files.

    Datasets 15, 55, 58 and 58b, 151, 164, 2411 and 2420 are read; all others are listed as unused.

    Args:
        paths: a file, or several that are joined; all functions have to be on the same frequencies.
        units: what the functions are in, where the files do not tell or are to be overruled: "m/s^2 per N", or "g per lbf, mm"
            with the unit in which points lie.
        least_coherence: lines below are told and marked as doubtful, 0 to 1.

    Raises:
        InputError: with file, dataset, line, value, what was expected and the remedy.
    """
    given = declared(units)
    if least_coherence is not None and not 0 <= least_coherence <= 1:
        raise InputError(f"--least-coherence {least_coherence:g}: expected 0 to 1")
    found = Found()
    names = _names(paths)
    for path in names:
        _read(path, given, found)
    if not found.functions:
        kinds = dict.fromkeys(one.what for one in found.unused)
        rest = ", ".join([*kinds, *([f"{len(found.modes)} modes"] if found.modes else [])])
        what = "no frequency response function (type 58, function type 4)"
        raise InputError(f"{', '.join(names)}: {what}; found: {rest or 'nothing else'}")
    return joined(found, least_coherence)


def read_modes(paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]]) -> tuple[MeasuredMode, ...]:
    """Mode shapes (dataset 55) of universal files, in their order; raises InputError as `read_universal` does."""
    blocks = [block for path in _names(paths) for block in scan(path) if block.kind == 55]
    return tuple(mode_of(fields) for fields in map(parse, blocks) if fields is not None)


def _names(paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]]) -> list[str]:
    return [os.fspath(path) for path in ([paths] if isinstance(paths, (str, os.PathLike)) else paths)]


def _read(path: str, given: Declared, found: Found) -> None:
    """Add what a file holds."""
    blocks = scan(path)
    parsed = [(block, fields) for block in blocks if block.kind != 58 and (fields := parse(block)) is not None]
    read = {id(block) for block, _ in parsed}
    scale = _scale(parsed)
    place = geometry(parsed, scale, given)
    for block in blocks:
        if block.kind == 58:
            _add(block, place, scale, given, found)
        elif id(block) not in read:
            found.unused.append(Unused(path, block.number, block.kind, _OTHER.get(block.kind, f"dataset {block.kind}")))
    found.modes += [mode_of(fields) for block, fields in parsed if block.kind == 55]
    for number, at in place.positions.items():
        known = found.points.setdefault(str(number), (float(at[0]), float(at[1]), float(at[2])))
        if not np.allclose(known, at, rtol=1e-5, atol=1e-9):
            raise InputError(f"{path}: point {number} is at {at.tolist()} m, at {list(known)} m in another file")
    words = [fields[key] for block, fields in parsed if block.kind == 151 for key in ("model_name", "description", "program")]
    told = ", ".join(dict.fromkeys(word for word in words if word.upper() not in ("", "NONE")))
    found.sources.append(Path(path).name + (f" ({told})" if told else ""))


def _scale(parsed: list[tuple[Block, Fields]]) -> Scale | None:
    """What dataset 164 says: factors from SI to the units of the file."""
    own = [(block, Scale(1 / fields["length"], 1 / fields["force"])) for block, fields in parsed if block.kind == 164]
    for block, scale in own[1:]:
        if not np.allclose(scale, own[0][1], rtol=1e-6):
            raise block.error(f"other units than in dataset {own[0][0].number}; a file has one system of units")
    return own[0][1] if own else None


def _add(block: Block, place: Geometry, scale: Scale | None, given: Declared, found: Found) -> None:
    """Add a function, if it is a response or a coherence."""
    kind = head(block)["func_type"]
    if kind not in (RESPONSE, COHERENCE):
        found.unused.append(Unused(block.path, block.number, 58, _KINDS.get(kind, f"function type {kind}")))
        return
    fields = function(block)
    codes = tuple(fields.get(f"{s}_{key}") for s in ("rsp", "ref") for key in ("ent_name", "node", "dir"))
    if kind == RESPONSE:
        ends = [place.channel(block, fields, side) for side in ("rsp", "ref")]
        unit = unit_of(block, fields, (ends[0].is_rotation, ends[1].is_rotation), scale, given)
        if not np.iscomplexobj(fields["data"]):
            raise block.error("values are real; a frequency response has real and imaginary parts: ordinate type 5 or 6", 8)
        frequency = _frequency(block, fields)
        found.functions.append(Measured(block, frequency, unit.factor * fields["data"], unit, ends[0], ends[1], codes))
        return
    if np.iscomplexobj(fields["data"]) and np.any(fields["data"].imag):
        raise block.error("a coherence has no imaginary part", 8)
    values = np.real(fields["data"])
    frequency = _frequency(block, fields)
    wrong = np.flatnonzero((values < 0) | (values > 1 + 1e-6))
    if len(wrong):
        k = int(wrong[0])
        raise block.error(f"coherence {values[k]:.6g} at frequency line {k + 1}; expected 0 to 1", record_of(block, k))
    found.coherences.append(Coherence(block, frequency, values, codes))


def _frequency(block: Block, fields: Fields) -> np.ndarray:
    """(n,) Hz; raises InputError where they do not rise."""
    data = fields["data"]
    if fields["abscissa_spacing"]:
        x = even_axis(fields["abscissa_min"], fields["abscissa_inc"], len(data))
    else:
        x = np.asarray(fields["x"])
    falls = np.flatnonzero(np.diff(x) <= 0)
    if x[0] < 0 or len(falls):
        k = int(falls[0]) + 1 if len(falls) else 0
        raise block.error(f"frequency line {k + 1} is at {x[k]:.6g}; expected 0 or more, rising", record_of(block, k))
    return hertz(block, fields) * x
