"""Whose folder it is: that of a study, of another one, or of something else."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import zip_longest
from pathlib import Path
from typing import Any

from trivet.design.store.disk import LOCK, content, is_unfinished, told
from trivet.design.store.layout import FORMAT, ROOT, STATUS, Layout, layout_of
from trivet.design.store.scratch import Scratch
from trivet.errors import InputError, shown

ELSEWHERE = "choose another folder (--store), or remove it"


def check(root: Path, scratch: Scratch) -> None:
    """Whether a folder is to be made, is empty, or is the store of this study, however damaged.

    Raises:
        InputError: when it is anything else.
    """
    with told(root, "read"):
        if not root.exists():
            if root.is_symlink():
                raise InputError(f"{root}: is a link to where nothing is; {ELSEWHERE}, or make that one")
            return
        if not root.is_dir():
            raise InputError(f"{root}: is a file; the name of a folder was expected")
        if all(_is_nothing(root, path) for path in root.rglob("*")):
            return
    document = document_in(root)
    there = None if document is None else layout_of(document)
    if there is not None:
        if there.fingerprint != scratch.layout.fingerprint:
            raise InputError(f"{root}: {_difference(there, scratch.layout)}; {ELSEWHERE}")
        return
    if document is not None and document.get("format", FORMAT) != FORMAT and "fingerprint" in document:
        raise InputError(
            f"{root}: is of the format {shown(document['format'])}; this version of trivet knows '{FORMAT}'; {ELSEWHERE}"
        )
    # The file that tells is damaged: any other that is as it would be written now tells as well.
    if not any(content(root / key) == data for key, data in scratch.metadata.items()):
        if document is None or "fingerprint" not in document:
            raise InputError(f"{root}: is not the store of a study; {ELSEWHERE}")
        raise InputError(f"{root}: {ROOT} is damaged, and nothing else tells that it is of this study; {ELSEWHERE}")


def document_in(root: Path) -> Mapping[str, Any] | None:
    """Attributes of a group; None where there is none that could be read."""
    data = content(root / ROOT)
    try:
        attributes = json.loads(data or b"")["attributes"]
        return attributes if isinstance(attributes, dict) else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def _is_nothing(root: Path, path: Path) -> bool:
    """Whether a path is what is left where a process died before anything was written."""
    return path == root / STATUS or path == root / STATUS / LOCK or is_unfinished(path)


def _difference(there: Layout, here: Layout) -> str:
    """The first that differs between two studies, in words."""
    if there.version != here.version:
        return f"was made by trivet {there.version}, and this is {here.version}; go on with that one"
    old, new = there.document, here.document
    name = next(name for name in (*new, *old) if name != "fingerprint" and old.get(name) != new.get(name))
    place, before, now = _narrowed(name, old.get(name), new.get(name))
    return f"is the store of another study: {place} is {before} there and {now} here"


def _narrowed(name: str, old: Any, new: Any) -> tuple[str, str, str]:
    """Where two values differ: within lists the entry, within text the line."""
    if isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            return f"the number of {name}", str(len(old)), str(len(new))
        k = next(k for k in range(len(old)) if old[k] != new[k])
        return _narrowed(f"{name}.{k + 1}", old[k], new[k])
    if isinstance(old, dict) and isinstance(new, dict):
        key = next(key for key in (*new, *old) if old.get(key) != new.get(key))
        return _narrowed(f"{name}.{key}", old.get(key), new.get(key))
    parts = _document(old), _document(new)
    if None not in parts:
        return _narrowed(name, *parts)
    if isinstance(old, str) and isinstance(new, str) and "\n" in old + new:
        lines = list(zip_longest(old.splitlines(), new.splitlines()))
        k = next((k for k, (before, now) in enumerate(lines) if before != now), 0)
        return _narrowed(f"line {k + 1} of {name}", *lines[k])
    before, now = ("nothing" if value is None else shown(value) for value in (old, new))
    return name, before, now


def _document(value: Any) -> Any:
    """What text with a list or a table in it holds; None of anything else."""
    try:
        found = json.loads(value) if isinstance(value, str) else None
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, (list, dict)) else None
