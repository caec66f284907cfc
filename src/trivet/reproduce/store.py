"""What is found, kept item by item, so that work goes on where it was interrupted."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from trivet.errors import InputError
from trivet.files import replacing
from trivet.reproduce.fitting import misfit
from trivet.reproduce.found import Found, adapter
from trivet.reproduce.paper import Item

FOLDER = "items"
"""Within the folder of the results: a file per item."""
MARK = "README"
"""In it: that a run made the folder, and may write over what lies there."""
OURS = "Made by trivet reproduce, which writes over what is here and beside.\n"
"""What the mark says."""
MOST_BYTES = 50_000_000
"""Of an item; those of the paper have less than a million."""
VERSION, CODE, SETTING = "version of trivet", "code", "setting"
NO_NUMBERS = ("cli", "report", "show", "viewer", "views")
"""Folders of the package whose code changes no number."""


class Kept(NamedTuple):
    """What there is of an item."""

    found: Found | None
    reason: str
    """Why there is nothing that could be taken."""


def inputs(item: Item) -> dict[str, str]:
    """What an item depends on, by name: the version and its code, what it is worked out with, and the machine files."""
    from importlib.metadata import version

    from pydantic import RootModel

    from trivet.model import fingerprint
    from trivet.study.machines import choose

    setting = RootModel[Any]((item.work, item.machines, item.values)).model_dump_json()
    machines = {f"machine {name}": fingerprint(choose(name)) for name in item.machines}
    return {VERSION: version("trivet"), CODE: _code(), SETTING: _hash(setting)} | machines


@cache
def _code() -> str:
    """What the code is that numbers come from: while it is worked on, its version stays."""
    package = Path(__file__).parents[1]
    found = (path for path in sorted(package.rglob("*.py")) if path.relative_to(package).parts[0] not in NO_NUMBERS)
    return _hash("".join(f"{path.relative_to(package).as_posix()}\0{path.read_text(encoding='utf-8')}\0" for path in found))


def path_of(folder: Path, item: Item) -> Path:
    """The file of an item."""
    return folder / FOLDER / f"{item.name}.json"


def keep(folder: Path, item: Item, found: Found) -> None:
    """Write what is found; the file appears whole or not at all."""
    text = adapter().dump_json(found).decode()
    document = {"inputs": inputs(item), "hash": _hash(text), "found": text}
    with replacing(path_of(folder, item), overwrite=True) as temporary:
        temporary.write_text(json.dumps(document), encoding="utf-8")


def kept(folder: Path, item: Item) -> Kept:
    """What an earlier run has left, if it is whole and made of the same."""
    path = path_of(folder, item)
    if not path.is_file():
        return Kept(None, "is no file" if path.exists() else "")
    try:
        if path.stat().st_size > MOST_BYTES:
            return Kept(None, "is damaged")
        document = json.loads(path.read_text(encoding="utf-8"))
        text, own = document["found"], document["inputs"]
        if document["hash"] != _hash(text):
            return Kept(None, "is damaged")
        if changed := _changed(own, inputs(item)):
            return Kept(None, f"is of another {changed}")
        found = adapter().validate_json(text)
        reason = misfit(item, found)
        return Kept(None, reason) if reason else Kept(found, "")
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):  # ValidationError is a ValueError
        return Kept(None, "is damaged")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None


def prepare(folder: Path) -> None:
    """Make the folder of the results, or take one of an earlier run.

    Raises:
        InputError: when it cannot be made, or holds what no run has left.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; the name of a folder was expected")
    try:
        mark = folder / FOLDER / MARK
        if not _is_marked(mark):
            if folder.is_dir() and any(folder.iterdir()):
                raise InputError(f"{folder}: holds other files; choose an empty or a new folder, or one of an earlier run")
            os.makedirs(folder / FOLDER)
            with replacing(mark) as temporary:
                temporary.write_text(OURS, encoding="utf-8")
        for path in (*folder.iterdir(), *(folder / FOLDER).iterdir()):
            if path.is_symlink():
                raise InputError(f"{path}: is a link to another place, which would be written over; remove it")
    except OSError as error:
        raise InputError(f"{folder}: cannot be made or read: {error.strerror or error}") from None


def _is_marked(mark: Path) -> bool:
    """Whether a run of ours made the folder of this mark."""
    with suppress(OSError, ValueError):
        return mark.stat().st_size == len(OURS) and mark.read_text(encoding="utf-8") == OURS
    return False


def _changed(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """Names of what has changed."""
    return ", ".join(name for name in {**now, **before} if before.get(name) != now.get(name))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
