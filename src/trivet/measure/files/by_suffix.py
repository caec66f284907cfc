"""Files of measured responses, by their suffix: each kind has a reader, and a writer where any responses can be written."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import NamedTuple

from trivet.measure.checking import check_functions, check_size
from trivet.measure.files.suffixes import NETCDF, TABLE, UNIVERSAL, Kind, kind_of
from trivet.measure.functions import Functions
from trivet.measure.imported import Content
from trivet.measure.joining import joined

Writer = Callable[..., None]


class Room(NamedTuple):
    """Where a kind of files is read and written."""

    read: Callable[[Sequence[str], str | None], list[Content]]
    """Some files of the kind, with the units that are declared for them."""
    write: Callable[[], Writer] | None = None


def read_functions(path: str | os.PathLike[str]) -> Functions:
    """Read a file of measured responses: .nc (see `labelled.py`), .csv (see `table.py`), or a universal file.

    Functions that were measured several times come as their mean.

    Raises:
        InputError: for another suffix, a file that cannot be read or is too large, or one that holds no measured responses;
            with the place in the file and what was expected.
    """
    return joined(contents(kind_of(path), [os.fspath(path)])).functions


def contents(kind: Kind, paths: Sequence[str], units: str | None = None) -> list[Content]:
    """What files of one kind hold, a file each; units are for those that do not tell theirs.

    Raises:
        InputError: as `read_functions` does.
    """
    return _ROOMS[kind].read(paths, units)


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
    write = _ROOMS[kind_of(path, [kind for kind, room in _ROOMS.items() if room.write])].write
    assert write is not None
    check_functions(functions, f"{os.fspath(path)}: cannot be written")
    write()(functions, path, overwrite=overwrite)


def _netcdf(paths: Sequence[str], units: str | None) -> list[Content]:
    from trivet.measure.files.labelled import read_labelled

    return [_sized(path, read_labelled) for path in paths]


def _table(paths: Sequence[str], units: str | None) -> list[Content]:
    from trivet.measure.files.table import read_table

    return [_sized(path, read_table) for path in paths]


def _universal(paths: Sequence[str], units: str | None) -> list[Content]:
    from trivet.measure.universal.reading import contents

    return contents(paths, units)


def _sized(path: str, read: Callable[[str], Content]) -> Content:
    """What a file holds that is of moderate size."""
    check_size(path)
    return read(path)


def _netcdf_writer() -> Writer:
    from trivet.measure.files.labelled import write_labelled

    return write_labelled


def _table_writer() -> Writer:
    from trivet.measure.files.table import write_table

    return write_table


_ROOMS = {NETCDF: Room(_netcdf, _netcdf_writer), TABLE: Room(_table, _table_writer), UNIVERSAL: Room(_universal)}
