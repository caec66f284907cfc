"""Files of measured responses, by their suffix: NetCDF, tables of comma-separated values, universal files."""

from __future__ import annotations

import os
from pathlib import Path

from trivet.errors import InputError
from trivet.measure.checking import check_functions, check_size
from trivet.measure.functions import Functions
from trivet.measure.universal.reading import SUFFIXES, read_universal

READ = (".nc", ".csv", *SUFFIXES)
WRITTEN = (".nc", ".csv")


def read_functions(path: str | os.PathLike[str]) -> Functions:
    """Read a file of measured responses: .nc (see `labelled.py`), .csv (see `table.py`), or a universal file.

    Raises:
        InputError: for another suffix, a file that cannot be read or is too large, or one that holds no measured responses;
            with the place in the file and what was expected.
    """
    suffix = _suffix(path, READ)
    if suffix in SUFFIXES:
        return read_universal(path).functions
    check_size(path)
    if suffix == ".nc":
        from trivet.measure.files.labelled import read_labelled as read
    else:
        from trivet.measure.files.table import read_table as read
    found = read(path)
    check_functions(found, os.fspath(path))
    return found


def save_functions(functions: Functions, path: str | os.PathLike[str], overwrite: bool = False) -> None:
    """Write measured responses so that `read_functions` gives them back to the last digit; whole or not at all.

    Args:
        functions: the responses.
        path: file to write, .nc or .csv.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: for another suffix, responses that no file holds (a value that is not finite), a file that exists unasked
            or cannot be written.
    """
    suffix = _suffix(path, WRITTEN)
    check_functions(functions, f"{os.fspath(path)}: cannot be written")
    if suffix == ".nc":
        from trivet.measure.files.labelled import write_labelled as write
    else:
        from trivet.measure.files.table import write_table as write
    write(functions, path, overwrite=overwrite)


def _suffix(path: str | os.PathLike[str], known: tuple[str, ...]) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        raise InputError(f"{os.fspath(path)}: a file of measured responses ends in {' or '.join(known)}")
    return suffix
