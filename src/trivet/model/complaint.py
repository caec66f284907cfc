"""One line for what pydantic has to say about a document: key path, value, and what was expected."""

from __future__ import annotations

import dataclasses
import types
import typing
from typing import Any

from pydantic import ValidationError

from trivet.errors import nearest, shown
from trivet.model.elements.base import NAME_PATTERN
from trivet.model.machine import Machine
from trivet.model.paths import Key, get, join

_WANTED = {
    "bool_type": "true or false",
    "dataclass_type": "a table",
    "dict_type": "a table",
    "float_type": "a number",
    "int_type": "a whole number",
    "list_type": "a list",
    "string_type": "text",
    "tuple_type": "a list",
}

MOST, LONGEST = 10, 800
"""Complaints, and letters, of one line."""

VECTORS = frozenset({"at", "centre", "centre_of_mass", "end", "origin", "position", "size", "start", "tool_tip", "vector"})
"""Keys of lists of x, y and z."""

_BOUNDS = {
    "greater_than_equal": "is not at least {ge}",
    "less_than_equal": "is not at most {le}",
    "too_long": "has more than {max_length} entries",
    "too_short": "has fewer than {min_length} entries",
}


def one_complaint(error: ValidationError, document: dict[str, Any], kind: Any = Machine) -> str:
    """Pydantic's complaints about a document in one line, the most telling one first, each with the key path, the value and the
    remedy, as far as they fit; `kind` is what the document should be."""
    found = error.errors(include_url=False)
    # A misspelled key shows up twice, as unknown and as missing; the unknown one names the mistake.
    found.sort(key=lambda e: e["type"] == "missing")
    line, *others = dict.fromkeys(_sentence(one, document, kind) for one in found[:MOST])
    for told, other in enumerate(others, 1):
        if len(line) + len(other) > LONGEST:
            return f"{line} (and {len(found) - told} more)"
        line = f"{line}; also {other}"
    return line if len(found) <= MOST else f"{line} (and {len(found) - MOST} more)"


def _sentence(first: Any, document: dict[str, Any], whole: Any) -> str:
    keys = _document_keys(document, first["loc"])
    path, kind, context = _path(document, keys), first["type"], first.get("ctx", {})
    if kind in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"{path}: unknown key{nearest(str(keys[-1]), _fields_at(document, keys[:-1], whole))}"
    if kind == "missing" and isinstance(keys[-1], int):
        remedy = "; x, y and z are needed" if keys[-2:-1] and keys[-2] in VECTORS else ""
        return f"{join(document, keys[:-1])}: {shown(first['input'])} has too few entries{remedy}"
    if kind == "missing":
        return f"{path}: this key is needed and missing"
    if kind == "union_tag_not_found":
        return f"{path}.{_bare(context['discriminator'])}: this key is needed and missing"
    if kind == "union_tag_invalid":
        known = [_bare(t) for t in context["expected_tags"].split(",")]
        return f"{path}.{_bare(context['discriminator'])}: {shown(context['tag'])} is not known{nearest(context['tag'], known)}"
    value = shown(first["input"])
    if kind == "literal_error":
        return f"{path}: {value} is not known; expected {context['expected']}"
    if kind in _WANTED:
        return f"{path}: {value} where {_WANTED[kind]} was expected"
    if kind in _BOUNDS:
        return f"{path}: {value} {_BOUNDS[kind].format(**context)}"
    if kind == "string_pattern_mismatch" and context["pattern"] == NAME_PATTERN:
        return f"{path}: {value}: a name is lower case letters, digits, - and _, at most 40, and begins with a letter"
    return f"{path}: {value}: {first['msg'][0].lower()}{first['msg'][1:]}"


def _path(document: Any, keys: tuple[Key, ...]) -> str:
    """As `join`, but a component of a vector is called x, y or z."""
    if len(keys) > 1 and isinstance(keys[-1], int) and keys[-2] in VECTORS:
        vector = get(document, keys[:-1])
        if isinstance(vector, list) and len(vector) == len("xyz"):
            return f"{join(document, keys[:-1])}.{'xyz'[keys[-1]]}"
    return join(document, keys)


def _bare(text: str) -> str:
    return text.strip(" '")


def _document_keys(document: Any, location: tuple[Key, ...]) -> tuple[Key, ...]:
    """The keys of a pydantic location that stand in the document; union tags and the like are left out."""
    keys: list[Key] = []
    for index, part in enumerate(location):
        is_key = isinstance(document, dict) and part in document
        if is_key or (isinstance(document, list) and isinstance(part, int) and part < len(document)):
            document = document[part]
        elif index + 1 < len(location) or part == "[key]":
            continue
        keys.append(part)
    return tuple(keys)


def _fields_at(document: Any, keys: tuple[Key, ...], kind: Any) -> set[str]:
    """Names of the keys that the table at some place may hold."""
    for key in keys:
        document = document[key]
        if _is_table(kind):
            kind = typing.get_type_hints(kind).get(str(key))
        else:
            kind = typing.get_args(kind)[-1 if isinstance(key, str) else 0]
        kind = _pick(kind, document)
    return {field.name for field in dataclasses.fields(kind)} - {"notes"} if _is_table(kind) else set()


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and hasattr(kind, "__dataclass_fields__")


def _pick(kind: Any, node: Any) -> Any:
    """The member of a union that a node of the document claims to be, by its type or shape."""
    if typing.get_origin(kind) not in (typing.Union, types.UnionType):
        return kind
    members = [m for m in typing.get_args(kind) if m is not type(None)]
    if isinstance(node, dict):
        for member in members:
            hints = typing.get_type_hints(member) if _is_table(member) else {}
            for tag in ("type", "shape"):
                if tag in hints and node.get(tag) in typing.get_args(hints[tag]):
                    return member
    return members[0]
