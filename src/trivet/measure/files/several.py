"""Measured responses from several files, of whatever kind, as one set."""

from __future__ import annotations

import os
from collections.abc import Iterable

from trivet.errors import InputError
from trivet.measure.files.by_suffix import contents
from trivet.measure.files.suffixes import KINDS, UNIVERSAL, kind_of
from trivet.measure.imported import Content, Imported
from trivet.measure.joining import joined


def import_files(
    paths: Iterable[str | os.PathLike[str]], units: str | None = None, least_coherence: float | None = None
) -> Imported:
    """Read and join files of measured responses: universal files, NetCDF, tables.

    Args:
        paths: at least one; all functions have to be on the same frequencies.  Those of one response, reference and motion
            come as their mean.
        units: of universal files, see `read_universal`; the other kinds have their own.
        least_coherence: lines below are told and marked as doubtful, 0 to 1.

    Raises:
        InputError: with the file, the place in it, what was expected and the remedy.
    """
    names = [os.fspath(path) for path in paths]
    if not names:
        raise InputError("no file is given; expected at least one")
    if least_coherence is not None and not 0 <= least_coherence <= 1:
        raise InputError(f"--least-coherence {least_coherence:g}: expected 0 to 1")
    kinds = [kind_of(name) for name in names]
    if units is not None and UNIVERSAL not in kinds:
        raise InputError(f'--units "{units}": is for universal files; a table and NetCDF tell their units themselves')
    found: dict[int, Content] = {}
    for kind in KINDS:
        places = [k for k, own in enumerate(kinds) if own == kind]
        found |= zip(places, contents(kind, [names[k] for k in places], units), strict=True)
    return joined([found[k] for k in range(len(names))], least_coherence)
