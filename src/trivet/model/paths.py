"""Key paths: the address of a value in a machine file, as messages, `--set` and gradients spell it.

A path is the keys joined by dots; members of a list that have a name go by it: `chains.leg.elements.link.length`.
Any ending, or the full path with segments left out, addresses the same value where it is unambiguous: `link.length`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

import jax

from trivet.errors import InputError, nearest

Key = str | int


_NONE: Mapping[str, Collection[str]] = {}
OPEN = ("fixtures", "interference", "workpiece")
"""Tables of a machine that need not be there before something is put into them."""


def join(document: Any, keys: Sequence[Key]) -> str:
    """The path of a place in a document, given its keys; keys which the document lacks are taken as they are."""
    parts: list[str] = []
    for key in keys:
        if isinstance(key, int):
            member = document[key] if isinstance(document, list) and key < len(document) else None
            name = member.get("name") if isinstance(member, dict) else None
            parts.append(name if isinstance(name, str) else str(key + 1))
            document = member
        else:
            parts.append(str(key))
            document = document.get(key) if isinstance(document, dict) else None
    return ".".join(parts)


def leaves(document: Any, keys: tuple[Key, ...] = ()) -> Iterator[tuple[Key, ...]]:
    """Keys of every value of a document, depth first."""
    if isinstance(document, dict) and "value" not in document:
        for key, value in document.items():
            yield from leaves(value, (*keys, key))
    elif isinstance(document, list) and any(isinstance(v, (dict, list)) for v in document):
        for index, value in enumerate(document):
            yield from leaves(value, (*keys, index))
    else:
        yield keys


def find(document: dict[str, Any], path: str, optional: Mapping[str, Collection[str]] = _NONE) -> tuple[Key, ...]:
    """Keys of the one value that a path, or an abbreviation of it, addresses.

    A value that the document does not hold yet is addressed by its path in full; or in short, when it is a joint's or a body's
    and its key one of the `optional` ones, or one of the keys of the table that such a one is.
    """
    wanted = path.split(".")
    candidates = {join(document, keys): keys for keys in leaves(document)}
    if path in candidates:
        return candidates[path]
    matches = [full for full in candidates if _abbreviates(wanted, full.split("."))]
    if len(matches) == 1:
        return candidates[matches[0]]
    if matches:
        some = sorted(matches)[:4] + ["others"] * (len(matches) > 4)
        raise InputError(f"{path}: ambiguous; it could be {' or '.join(some)}")
    parent = _parent(document, wanted)
    if parent is not None:
        return parent
    tail = 2 if len(wanted) > 2 and wanted[-1] in optional.get(wanted[-2], ()) else 1
    members = {join(document, keys): keys for keys in _members(document)}
    around = [keys for full, keys in members.items() if _abbreviates(wanted[:-tail], full.split("."))]
    if len(around) == 1 and (tail == 2 or wanted[-1] in optional):
        return (*around[0], *wanted[-tail:])
    raise InputError(f"{path}: no such key in this machine{nearest(path, _beside(wanted, candidates, members, optional))}")


def _beside(
    wanted: list[str], candidates: Iterable[str], members: Iterable[str], optional: Mapping[str, Collection[str]]
) -> set[str]:
    """What may have been meant by a path that addresses nothing."""
    tables = [full for full in members if _abbreviates(wanted[:-2], full.split("."))]
    if len(wanted) > 2 and len(tables) == 1 and optional.get(wanted[-2]):
        return {".".join((*wanted[:-1], key)) for key in optional[wanted[-2]]}
    if len(wanted) > 2 and wanted[-1] in optional.get(wanted[-2], ()):
        return {".".join((full.split(".")[-1], *wanted[-2:])) for full in members}
    numbers = [full for full in candidates if not full.startswith("about.")]
    endings = {".".join(full.split(".")[-2:]) for full in numbers} | set(numbers)
    return {ending for ending in endings if ending.split(".")[:-1] == wanted[:-1] != []} or endings


def _members(document: Any, keys: tuple[Key, ...] = ()) -> Iterator[tuple[Key, ...]]:
    """Keys of all members of lists that have a name."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield from _members(value, (*keys, key))
    elif isinstance(document, list):
        for index, value in enumerate(document):
            if isinstance(value, dict) and "name" in value:
                yield (*keys, index)


def _abbreviates(wanted: list[str], full: list[str]) -> bool:
    if wanted[-1:] != full[-1:]:
        return False
    rest = iter(full)
    return all(part in rest for part in wanted)


def _parent(document: dict[str, Any], wanted: list[str]) -> tuple[Key, ...] | None:
    """Keys of a value that the document does not hold yet, when the table around it is spelled in full."""
    keys: list[Key] = []
    here: Any = document
    for part in wanted[:-1]:
        if isinstance(here, dict) and (part in here or (not keys and part in OPEN)):
            keys.append(part)
            here = here.get(part, {})
        elif isinstance(here, list):
            index = next((i for i, v in enumerate(here) if isinstance(v, dict) and v.get("name") == part), None)
            if index is None:
                return None
            keys.append(index)
            here = here[index]
        else:
            return None
    return (*keys, wanted[-1]) if isinstance(here, dict) else None


def get(document: Any, keys: Sequence[Key]) -> Any:
    """The value at a place."""
    for key in keys:
        document = document[key]
    return document


def put(document: Any, keys: Sequence[Key], value: Any) -> None:
    """Set a value in place."""
    for key in keys[:-1]:
        document = document[key]
    document[keys[-1]] = value


def dimensions(machine: Any) -> dict[str, Any]:
    """Every dimension of a machine (or of a gradient with respect to one) by its key path; values in SI."""
    found = {}
    for keys, value in jax.tree_util.tree_flatten_with_path(machine)[0]:
        here, parts = machine, []
        for key in keys:
            entry = getattr(key, "name", None) or getattr(key, "key", None)
            if entry is None:
                here = here[key.idx]
                parts.append(getattr(here, "name", str(key.idx + 1)))
            else:
                here = here[entry] if isinstance(here, dict) else getattr(here, entry)
                parts.append(entry)
        found[".".join(parts)] = value
    return found
