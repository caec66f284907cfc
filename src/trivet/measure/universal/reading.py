"""Measured responses from universal files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError
from trivet.measure.checking import HIGHEST
from trivet.measure.functions import Channel
from trivet.measure.imported import Content, Imported, Measured, Unused
from trivet.measure.joining import first_difference, joined
from trivet.measure.universal.axis import even_axis
from trivet.measure.universal.description import Described, describe
from trivet.measure.universal.function import function, head, record_of
from trivet.measure.universal.modes import mode_of
from trivet.measure.universal.plain import Fields
from trivet.measure.universal.points import Geometry, geometry
from trivet.measure.universal.scan import Block, scan
from trivet.measure.universal.units import Declared, declared, hertz, told_unit

RESPONSE, COHERENCE = 4, 6
"""Types of functions that are read."""
_KINDS = {
    0: "general function", 1: "time record", 2: "auto spectrum", 3: "cross spectrum", 5: "transmissibility",
    7: "auto correlation", 8: "cross correlation", 9: "power spectral density", 10: "energy spectral density", 12: "spectrum",
    18: "mode indicator function", 21: "partial coherence", 26: "multiple coherence",
}  # fmt: skip
Codes = tuple[object, ...]
"""Names, numbers and directions of both ends as they stand in a file."""


class Coherence(NamedTuple):
    """A coherence of a file."""

    block: Block
    frequency: np.ndarray
    values: np.ndarray


class Collected(NamedTuple):
    """The functions of a file."""

    functions: list[tuple[Codes, Measured]]
    coherences: dict[Codes, list[Coherence]]
    unused: list[Unused]


def read_universal(paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], units: str | None = None) -> Imported:
    """Read frequency response functions, with their points, coherence and modes, from universal files.

    Datasets 15, 55, 58 and 58b, 151, 164, 2411 and 2420 are read; all others are listed as unused.

    Args:
        paths: a file, or several that are joined: axes and points of any of them hold for all, and all functions have to be on
            the same frequencies.
        units: what the functions are in, where the files do not tell or are to be overruled: "m/s^2 per N", or "g per lbf, mm"
            with the unit in which points lie.

    Raises:
        InputError: with file, dataset, line, value, what was expected and the remedy.
    """
    return joined(contents([paths] if isinstance(paths, (str, os.PathLike)) else paths, units))


def contents(paths: Iterable[str | os.PathLike[str]], units: str | None = None) -> list[Content]:
    """What universal files hold, a file each; arguments and errors as of `read_universal`.

    Files are gone through twice, so that no more than one is in memory as a whole: for what holds for all, then for functions.
    """
    given = declared(units)
    files = [describe(os.fspath(path), given) for path in paths]
    place = geometry(files, given)
    collected = [_collected(file, place, given) for file in files]
    functions = _with_coherence(collected)
    return [
        Content(
            file.path,
            functions[k],
            place.points,
            file.source,
            tuple(mode_of(block, fields, place) for block, fields in file.datasets if block.kind == 55),
            tuple(sorted([*file.unused, *collected[k].unused], key=lambda one: one.number)),
        )
        for k, file in enumerate(files)
    ]


def _collected(file: Described, place: Geometry, given: Declared) -> Collected:
    """Responses and coherences of a file."""
    found = Collected([], {}, [])
    for block in scan(file.path):
        if block.kind != 58:
            continue
        kind = head(block)["func_type"]
        if kind not in (RESPONSE, COHERENCE):
            found.unused.append(Unused(block.path, block.number, 58, _KINDS.get(kind, f"function type {kind}")))
            continue
        fields = function(block)
        codes = tuple(fields.get(f"{s}_{key}") for s in ("rsp", "ref") for key in ("ent_name", "node", "dir"))
        if kind == RESPONSE:
            ends = [place.channel(block, fields, side) for side in ("rsp", "ref")]
            found.functions.append((codes, _response(block, fields, ends, file, given)))
        else:
            found.coherences.setdefault(codes, []).append(_coherence(block, fields))
    return found


def _response(block: Block, fields: Fields, ends: Sequence[Channel], file: Described, given: Declared) -> Measured:
    response, reference = ends
    unit = told_unit(block, fields, (response.is_rotation, reference.is_rotation), file.scale, given)
    if not np.iscomplexobj(fields["data"]):
        raise block.error("values are real; a frequency response has real and imaginary parts: ordinate type 5 or 6", 8)
    frequency, values = _frequency(block, fields), unit.factor * fields["data"]
    return Measured(block.title, frequency, values, unit.motion, response, reference, unit.words)


def _coherence(block: Block, fields: Fields) -> Coherence:
    if np.iscomplexobj(fields["data"]) and np.any(fields["data"].imag):
        raise block.error("a coherence has no imaginary part", 8)
    values = np.real(fields["data"])
    wrong = np.flatnonzero((values < 0) | (values > 1 + 1e-6))
    if len(wrong):
        k = int(wrong[0])
        raise block.error(f"coherence {values[k]:.6g} at frequency line {k + 1}; expected 0 to 1", record_of(block, k))
    return Coherence(block, _frequency(block, fields), values)


def _frequency(block: Block, fields: Fields) -> np.ndarray:
    """(n,) Hz; raises InputError where they do not rise, or are beyond all that is measured."""
    data = fields["data"]
    if fields["abscissa_spacing"]:
        x = even_axis(fields["abscissa_min"], fields["abscissa_inc"], len(data))
    else:
        x = np.asarray(fields["x"])
    falls = np.flatnonzero(np.diff(x) <= 0)
    if x[0] < 0 or len(falls):
        k = int(falls[0]) + 1 if len(falls) else 0
        raise block.error(f"frequency line {k + 1} is at {x[k]:.6g}; expected 0 or more, rising", record_of(block, k))
    frequency = hertz(block, fields) * x
    if frequency[-1] > HIGHEST:
        raise block.error(f"frequencies go up to {frequency[-1]:.6g} Hz; expected at most {HIGHEST:g} Hz", 8)
    return frequency


def _with_coherence(files: Sequence[Collected]) -> list[list[Measured]]:
    """Functions of each file with their coherence: the first of a pair of degrees of freedom goes with its first function.

    It is looked for in the file of the function, then in all others; what is left goes with those that are not used.
    """
    own = [[(codes, _paired(one, codes, [file])) for codes, one in file.functions] for file in files]
    found = [[_paired(one, codes, files) for codes, one in row] for row in own]
    for file in files:
        for left in (one.block for waiting in file.coherences.values() for one in waiting):
            file.unused.append(Unused(left.path, left.number, 58, "coherence of no function"))
    return found


def _paired(one: Measured, codes: Codes, files: Sequence[Collected]) -> Measured:
    """A function with the first coherence of its degrees of freedom that waits in one of some files, if there is one."""
    waiting = next((file.coherences[codes] for file in files if file.coherences.get(codes)), None)
    if one.coherence is not None or waiting is None:
        return one
    coherence = waiting.pop(0)
    apart = first_difference(one.frequency, coherence.frequency)
    if apart is not None:
        raise InputError(f"{one.title} and {coherence.block.title} are on different frequencies: {apart}; give them apart")
    return one._replace(coherence=coherence.values)
