"""TOML files of one kind beside machine files (poses, paths, set-ups), as values that pydantic has checked."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from trivet.errors import InputError
from trivet.model.complaint import one_complaint
from trivet.model.toml import read_toml

_T = TypeVar("_T")


def read_checked(path: str | os.PathLike[str], kind: type[_T], what: str, needed: Mapping[str, str] | None = None) -> _T:
    """Read a file.

    Args:
        path: the file.
        kind: the dataclass that it is.
        what: the same in words, "a pose file".
        needed: keys that it must have, each with what is said where it is missing.

    Raises:
        InputError: with the file, the key, the value and what was expected.
    """
    name = os.fspath(path)
    document = read_toml(name, what)
    if document.get("format", 1) is True:  # which equals 1, the version
        raise InputError(f"{name}: format: true is not known; expected 1")
    for key, words in (needed or {}).items():
        if key not in document:
            raise InputError(f"{name}: {key}: missing; {words}")
    try:
        found: _T = TypeAdapter(kind).validate_python(document)
    except ValidationError as error:
        raise InputError(f"{name}: {one_complaint(error, document, kind)}") from None
    return found
