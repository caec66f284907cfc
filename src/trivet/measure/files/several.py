"""Measured responses from several files, of whatever kind, as one set."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from trivet.errors import InputError
from trivet.measure.files.by_suffix import read_functions
from trivet.measure.functions import Functions
from trivet.measure.universal.axis import first_difference
from trivet.measure.universal.join import Imported, few
from trivet.measure.universal.reading import SUFFIXES, read_universal


def import_files(
    paths: Iterable[str | os.PathLike[str]], units: str | None = None, least_coherence: float | None = None
) -> Imported:
    """Read and join files of measured responses: universal files, NetCDF, tables.

    Args:
        paths: at least one; all functions have to be on the same frequencies.
        units: of universal files, see `read_universal`; the other kinds have their own.
        least_coherence: lines below are told and marked as doubtful, 0 to 1.

    Raises:
        InputError: with the file, the place in it, what was expected and the remedy.
    """
    names = [os.fspath(path) for path in paths]
    universal = [name for name in names if Path(name).suffix.lower() in SUFFIXES]
    if units is not None and not universal:
        raise InputError(f'--units "{units}": is for universal files; a table and NetCDF tell their units themselves')
    whole = read_universal(universal, units, least_coherence) if universal else None
    for name in names:
        if name not in universal:
            functions = read_functions(name)
            own = Imported(functions, tuple("SI" for _ in functions.motions), least_coherence=least_coherence)
            whole = own if whole is None else _joined(whole, own, name)
    if whole is None:
        raise InputError("no file is given; expected at least one")
    return whole


def _joined(whole: Imported, more: Imported, name: str) -> Imported:
    """Two sets on the same frequencies."""
    one, other = whole.functions, more.functions
    apart = first_difference(one.frequency, other.frequency)
    if apart is not None:
        raise InputError(f"{name}: on other frequencies than the files before: {apart}; give them apart")
    for point, at in other.points.items():
        if not np.allclose(one.points.get(point, at), at, rtol=1e-5, atol=1e-9):
            raise InputError(f"{name}: point {point} is at {list(at)} m, at {list(one.points[point])} m in another file")
    before = set(zip(one.responses, one.references, one.motions, strict=True))
    pairs = zip(other.responses, other.references, other.motions, strict=True)
    again = [label for label, pair in zip(other.labels, pairs, strict=True) if pair in before]
    functions = Functions(
        one.frequency,
        np.concatenate([one.values, other.values]),
        one.motions + other.motions,
        one.responses + other.responses,
        one.references + other.references,
        {**one.points, **other.points},
        _coherence(one, other),
        "; ".join(source for source in (one.source, other.source) if source),
    )
    remarks = [f"{few(again, 'function', 'functions')} measured again in {name}; all are kept"] if again else []
    return replace(whole, functions=functions, units=whole.units + more.units, remarks=(*whole.remarks, *remarks))


def _coherence(one: Functions, other: Functions) -> np.ndarray | None:
    if one.coherence is None and other.coherence is None:
        return None
    rows = [np.full(f.values.shape, np.nan) if f.coherence is None else f.coherence for f in (one, other)]
    return np.concatenate(rows)
