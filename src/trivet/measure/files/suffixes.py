"""Kinds of files of measured responses, known by their suffixes; light, so that help and messages can name them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from trivet.errors import InputError


class Kind(NamedTuple):
    """A kind of files."""

    name: str
    suffixes: tuple[str, ...]

    def __str__(self) -> str:
        """As help names it: "tables (.csv)"."""
        return f"{self.name} ({', '.join(self.suffixes[:2])}{', …' if len(self.suffixes) > 2 else ''})"


NETCDF = Kind("NetCDF", (".nc",))
TABLE = Kind("tables", (".csv",))
UNIVERSAL = Kind("universal files", (".unv", ".uff", ".uf", ".u58", ".bunv", ".ufb"))
KINDS = (NETCDF, TABLE, UNIVERSAL)


def kind_of(path: str | os.PathLike[str], kinds: Iterable[Kind] = KINDS) -> Kind:
    """The kind of a file, one of some; raises InputError for any other suffix."""
    suffix = Path(path).suffix.lower()
    known = {ending: kind for kind in kinds for ending in kind.suffixes}
    if suffix not in known:
        raise InputError(f"{os.fspath(path)}: a file of measured responses ends in {' or '.join(known)}")
    return known[suffix]
