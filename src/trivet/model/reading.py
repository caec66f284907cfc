"""Reading, checking and writing machine files (TOML)."""

from __future__ import annotations

import copy
import os
import tomllib
import types
import typing
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import TypeAdapter, ValidationError

from trivet.errors import InputError, nearest
from trivet.files import replacing
from trivet.model.check import check
from trivet.model.machine import Machine
from trivet.model.paths import Key, find, join, put

LARGEST_FILE = 1_000_000
"""Bytes; a machine file holds a few thousand."""

_NOTE_KEYS = {"value", "source", "status"}


@cache
def _adapter() -> TypeAdapter[Machine]:
    return TypeAdapter(Machine)


def catalogue() -> list[str]:
    """Names of the machines that come with trivet."""
    folder = resources.files("trivet.catalog")
    return sorted(p.name[:-5] for p in folder.iterdir() if p.name.endswith(".toml") and not p.name.startswith("_"))


def load(machine: str | os.PathLike[str], settings: Mapping[str, str] | None = None) -> Machine:
    """A machine from the catalogue ("azulay") or from a file ("my-machine.toml").

    Args:
        machine: name in the catalogue, or path of a TOML file.
        settings: dimensions to change, by key path (abbreviated where unambiguous): {"link.length": "196 mm"}.

    Raises:
        InputError: with the key path, the value, what was expected and the nearest valid name.
    """
    name = os.fspath(machine)
    document = _document(name)
    try:
        _apply(document, settings or {})
        return parse(document)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _document(name: str, depth: int = 0) -> dict[str, Any]:
    """The TOML document behind a name, with the machine it varies (`variant_of`) filled in."""
    is_file = name.endswith(".toml") or os.sep in name or Path(name).is_file()
    if not is_file and name not in catalogue():
        raise InputError(f"{name}: no machine of this name in the catalogue{nearest(name, catalogue())} (a file ends in .toml)")
    text = _read_text(Path(name)) if is_file else resources.files("trivet.catalog").joinpath(f"{name}.toml").read_bytes()
    document = _parse_toml(name, text)
    if "variant_of" not in document:
        return document
    parent = document.pop("variant_of")
    settings = document.pop("set", {})
    if depth > 3 or not isinstance(parent, str) or not isinstance(settings, dict):
        raise InputError(f"{name}: variant_of: expected the name of a machine, and [set] a table of key paths")
    if is_file and parent not in catalogue():
        parent = str(Path(name).parent / parent)
    base = _document(parent, depth + 1)
    try:
        _apply(base, settings)
    except InputError as error:
        raise InputError(f"{name}: set: {error}") from None
    return base | document


def _read_text(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder; a machine file was expected")
        with path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if len(data) > LARGEST_FILE:
        raise InputError(f"{path}: larger than {LARGEST_FILE} bytes; a machine file holds a few thousand")
    return data


def _parse_toml(name: str, data: bytes) -> dict[str, Any]:
    try:
        return tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError:
        raise InputError(f"{name}: is not UTF-8 text; a machine file is TOML") from None
    except (tomllib.TOMLDecodeError, ValueError) as error:
        raise InputError(f"{name}: is not TOML: {error}") from None
    except RecursionError:
        raise InputError(f"{name}: is nested too deeply") from None


def _apply(document: dict[str, Any], settings: Mapping[str, Any]) -> None:
    for path, value in settings.items():
        put(document, find(document, path), value)


def parse(document: Mapping[str, Any]) -> Machine:
    """A machine from a document (nested dicts as TOML gives them).

    Raises:
        InputError: as `load`.
    """
    plain, notes = _without_notes(copy.deepcopy(dict(document)))
    known = _known_materials()
    for material in _materials_named(plain) - set(_table(plain, "materials")):
        if material in known:
            plain.setdefault("materials", {})[material] = known[material]
    if isinstance(plain.get("about"), dict):
        plain["about"]["notes"] = notes
    try:
        machine = _adapter().validate_python(plain)
    except ValidationError as error:
        raise InputError(_one_line(error, plain)) from None
    check(machine)
    return machine


def _table(document: dict[str, Any], key: str) -> dict[str, Any]:
    found = document.get(key)
    return found if isinstance(found, dict) else {}


@cache
def _known_materials() -> dict[str, Any]:
    data = resources.files("trivet.catalog").joinpath("_materials.toml").read_text(encoding="utf-8")
    return {name: {k: v for k, v in entry.items() if k != "source"} for name, entry in tomllib.loads(data).items()}


def _materials_named(node: Any) -> set[str]:
    if isinstance(node, dict):
        own = {node["material"]} if isinstance(node.get("material"), str) else set()
        return own.union(*(_materials_named(v) for v in node.values()))
    return set().union(*(_materials_named(v) for v in node)) if isinstance(node, list) else set()


def _without_notes(document: dict[str, Any]) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """Replace every { value = …, source = …, status = … } by its value, and collect the rest."""
    notes: list[dict[str, str]] = []

    def walk(node: Any, keys: tuple[Key, ...]) -> Any:
        if isinstance(node, dict):
            if "value" in node:
                path = join(document, keys)
                strange = set(node) - _NOTE_KEYS
                if strange:
                    raise InputError(f"{path}: unknown key '{min(strange)}' beside value{nearest(min(strange), _NOTE_KEYS)}")
                notes.append({"path": path} | {k: v for k, v in node.items() if k != "value"})
                return walk(node["value"], keys)
            return {k: walk(v, (*keys, k)) for k, v in node.items()}
        if isinstance(node, list):
            return [walk(v, (*keys, i)) for i, v in enumerate(node)]
        return node

    plain = walk(document, ())
    return plain, sorted(notes, key=lambda note: note["path"])


def _one_line(error: ValidationError, document: dict[str, Any]) -> str:
    """The most telling of pydantic's complaints, as one line with the key path, the value and the remedy."""
    found = error.errors(include_url=False)
    # A misspelled key shows up twice, as unknown and as missing; the unknown one names the mistake.
    found.sort(key=lambda e: e["type"] == "missing")
    first = found[0]
    keys = _document_keys(document, first["loc"])
    path = join(document, keys)
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    kind = first["type"]
    if kind in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"{path}: unknown key{nearest(str(keys[-1]), _fields_at(document, keys[:-1]))}{more}"
    if kind == "missing":
        return f"{path}: this key is needed and missing{more}"
    if kind == "union_tag_not_found":
        return f"{path}: the key {first['ctx']['discriminator']} is needed and missing{more}"
    value = _shown(first["input"])
    if kind == "union_tag_invalid":
        known = [t.strip(" '") for t in first["ctx"]["expected_tags"].split(",")]
        tag = first["ctx"]["tag"]
        return f"{path}.{first['ctx']['discriminator'].strip(chr(39))}: '{tag}' is not known{nearest(tag, known)}{more}"
    if kind == "literal_error":
        return f"{path}: {value} is not known; expected {first['ctx']['expected']}{more}"
    if kind in ("dataclass_type", "dict_type"):
        return f"{path}: {value} where a table was expected{more}"
    return f"{path}: {value}: {first['msg'][0].lower()}{first['msg'][1:]}{more}"


def _shown(value: Any) -> str:
    text = repr(value) if not isinstance(value, str) else f'"{value}"'
    return text if len(text) <= 60 else text[:57] + "…"


def _document_keys(document: Any, location: tuple[Key, ...]) -> tuple[Key, ...]:
    """The keys of a pydantic location that stand in the document; union tags and the like are left out."""
    keys: list[Key] = []
    for index, part in enumerate(location):
        if isinstance(document, dict) and part in document:
            document = document[part]
        elif isinstance(document, list) and isinstance(part, int) and part < len(document):
            document = document[part]
        elif index + 1 < len(location) or part == "[key]":
            continue
        keys.append(part)
    return tuple(keys)


def _fields_at(document: Any, keys: tuple[Key, ...]) -> set[str]:
    """Names of the keys that the table at some place may hold."""
    kind: Any = Machine
    for key in keys:
        document = document[key]
        kind = typing.get_type_hints(kind, include_extras=False).get(str(key)) if _is_table(kind) else typing.get_args(kind)[-1 if isinstance(key, str) else 0]
        kind = _pick(kind, document)
    return set(typing.get_type_hints(kind)) - {"__pydantic_config__", "notes"} if _is_table(kind) else set()


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


def document_of(machine: Machine) -> dict[str, Any]:
    """The document (nested dicts, quantities as text with units, sources beside the numbers) of a machine."""
    document = _plain(_adapter().dump_python(machine, exclude_none=True))
    notes = document["about"].pop("notes", [])
    for note in notes:
        keys = find(document, note["path"])
        value = document
        for key in keys:
            value = value[key]
        put(document, keys, {"value": value} | {k: v for k, v in note.items() if k != "path" and v})
    return {k: document[k] for k in ("format", "about") if k in document} | document


def _plain(node: Any) -> Any:
    """Tuples as lists, empty texts and tables left out."""
    if isinstance(node, dict):
        return {k: _plain(v) for k, v in node.items() if v not in ("", {}, (), [])}
    return [_plain(v) for v in node] if isinstance(node, (tuple, list)) else node


def to_text(machine: Machine) -> str:
    """A machine as the text of a machine file."""
    return tomli_w.dumps(document_of(machine))


def write(machine: Machine, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a machine file; it appears whole or not at all.

    Raises:
        InputError: when the file exists (unless `overwrite`), or cannot be written.
    """
    text = to_text(machine)
    with replacing(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")


def schema() -> dict[str, Any]:
    """JSON schema of machine files, for editors."""
    return _adapter().json_schema(mode="validation")
