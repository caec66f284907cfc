"""TOML files: read with bounds on their size and depth; every fault is one line that names the file."""

from __future__ import annotations

import difflib
import os
import tomllib
from pathlib import Path
from typing import Any

from trivet.errors import InputError

LARGEST_FILE = 1_000_000
"""Bytes; a machine file holds a few thousand."""
_MOST_DOTS = 1000
"""Before the sign of equality, in a line."""

_DEEPEST = 16
"""Tables within tables; a machine file has five."""


def read_toml(path: str | os.PathLike[str], what: str) -> dict[str, Any]:
    """The document in a file; `what` it should be ("a path file") is said where it is not.

    Raises:
        InputError: naming the file, when it cannot be read, is too large or too deep, or is not TOML.
    """
    name = os.fspath(path)
    return parse_toml(name, read_bytes(name, what), what)


def read_bytes(name: str, what: str) -> bytes:
    """The bytes of a file of moderate size."""
    path = Path(name)
    try:
        if path.is_dir():
            raise InputError(f"{name}: is a folder; {what} was expected")
        if path.is_fifo():
            raise InputError(f"{name}: is a pipe; {what} was expected")
        with path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
    except InputError:
        raise
    except FileNotFoundError as error:
        near = " or ".join(f"'{path}'" for path in files_near(name))
        hint = f"; did you mean {near}?" if near else ""
        raise InputError(f"{name}: cannot be read: {error.strerror}{hint}") from None
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        raise InputError(f"{name}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > LARGEST_FILE:
        raise InputError(f"{name}: larger than {LARGEST_FILE} bytes; {what} holds a few thousand")
    return data


def files_near(name: str) -> list[str]:
    """Paths of at most two TOML files whose names are nearly a given one, in its folder."""
    folder, own = os.path.split(name)
    try:
        listed = {entry.lower(): entry for entry in os.listdir(folder or ".") if entry.lower().endswith(".toml")}
    except (OSError, ValueError):
        return []
    near = difflib.get_close_matches(own.lower(), sorted(listed), n=2, cutoff=0.7)
    return [os.path.join(folder, listed[entry]) for entry in near]


def parse_toml(name: str, data: bytes, what: str) -> dict[str, Any]:
    """The document in bytes."""
    try:
        if any(line.partition(b"=")[0].count(b".") > _MOST_DOTS for line in data.splitlines()):
            raise InputError(_too_deep(what))  # a key with so many parts takes minutes to read
        document = tomllib.loads(data.decode("utf-8-sig"))
        check_depth(document, what)
    except UnicodeDecodeError:
        raise InputError(f"{name}: is not UTF-8 text; {what} is TOML") from None
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    except tomllib.TOMLDecodeError as error:  # says where
        raise InputError(f"{name}: is not TOML: {error}") from None
    except ValueError:
        raise InputError(f"{name}: is not TOML: a whole number of thousands of digits") from None
    except RecursionError:
        raise InputError(f"{name}: {_too_deep(what)}") from None
    return document


def _too_deep(what: str) -> str:
    return f"nested too deeply; {what} has at most {_DEEPEST} tables and lists within each other"


def check_depth(document: Any, what: str) -> None:
    """Raise InputError for tables and lists within each other beyond all reason."""
    layer = [document]
    for _ in range(_DEEPEST + 1):
        tables = [node.values() if isinstance(node, dict) else node for node in layer if isinstance(node, (dict, list))]
        layer = [value for table in tables for value in table]
    if layer:
        raise InputError(_too_deep(what))
