"""Reading machine files (TOML)."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any, get_args

from pydantic import ValidationError

from trivet.errors import InputError, nearest, shown
from trivet.model.check import check
from trivet.model.complaint import one_complaint
from trivet.model.elements import KEYS
from trivet.model.machine import Machine, Status, adapter
from trivet.model.paths import Key, find, join, put
from trivet.model.toml import check_depth, files_near, parse_toml, read_bytes

_FILE = "a machine file"
_MOST_PARENTS = 4

_NAMING_KEYS = ("format", "name", "type", "shape")
_NOTE_KEYS = ("value", "source", "status")


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


def _document(name: str, below: tuple[str, ...] = ()) -> dict[str, Any]:
    """The TOML document behind a name, with the machine it varies (`variant_of`) filled in."""
    is_file = _names_file(name)
    own = os.path.abspath(name) if is_file else name
    if own in below:
        raise InputError(f"{name}: varies itself: {' to '.join((*below, own))}")
    if len(below) > _MOST_PARENTS:
        raise InputError(f"{name}: a variant of a variant more than {_MOST_PARENTS} times over")
    if not is_file and name not in catalogue():
        raise InputError(f"{name}: no machine of this name in the catalogue{_meant(name)}")
    if name.removesuffix(".toml") in catalogue() and is_file and not os.path.exists(name):
        raise InputError(f"{name}: no such file; the machine of the catalogue is called '{name.removesuffix('.toml')}'")
    data = read_bytes(name, _FILE) if is_file else resources.files("trivet.catalog").joinpath(f"{name}.toml").read_bytes()
    document = parse_toml(name, data, _FILE)
    if is_file:
        _anchor(document, os.path.dirname(own))
    if "variant_of" not in document:
        return document
    parent, settings = document.pop("variant_of"), document.pop("set", {})
    if not isinstance(parent, str):
        raise InputError(f"{name}: variant_of: {shown(parent)} where the name of a machine was expected")
    if not isinstance(settings, dict):
        raise InputError(f"{name}: set: {shown(settings)} where a table of key paths was expected")
    beside = os.path.join(os.path.dirname(name), parent) if is_file and _names_file(parent) else parent
    try:
        base = _document(beside, (*below, own))
    except InputError as error:
        raise InputError(f"{name}: variant_of: {error}") from None
    try:
        _apply(base, settings)
    except InputError as error:
        raise InputError(f"{name}: set: {error}") from None
    return base | document


def _meant(name: str) -> str:
    """What may have been meant by a name that is neither of the catalogue nor of a file."""
    whole = [path for path in (f"{name}.toml", f"{os.path.splitext(name)[0]}.toml") if os.path.isfile(path)]
    if whole:
        return f"; did you mean the file '{whole[0]}'?"
    return f"{nearest(name.lower(), {*catalogue(), *files_near(name)})} (trivet list tells all; a file ends in .toml)"


def _anchor(node: Any, folder: str) -> None:
    """Files of meshes lie where the machine file is, unless their path says otherwise."""
    if isinstance(node, dict):
        if node.get("shape") == "mesh" and isinstance(node.get("file"), str):
            node["file"] = os.path.join(folder, node["file"])
        for value in node.values():
            _anchor(value, folder)
    elif isinstance(node, list):
        for value in node:
            _anchor(value, folder)


def _names_file(name: str) -> bool:
    return name not in catalogue() and (name.endswith(".toml") or os.sep in name or os.path.isfile(name))


def _apply(document: dict[str, Any], settings: Mapping[str, Any]) -> None:
    for path, value in settings.items():
        if isinstance(value, dict) and value and "value" not in value and "." not in path:
            # link.length = … without quotes is a table within a table to TOML
            raise InputError(f'{path}: a table; a key path is written in quotes, "{path}.{next(iter(value))}" = …')
        keys = find(document, path, KEYS)
        table: Any = document
        for key in keys[:-1]:
            table = table.setdefault(key, {}) if isinstance(table, dict) else table[key]
        put(document, keys, _as_there(document, keys, value))


_LIST = re.compile(r"\s*[-+.\d][^,]*(,\s*[-+.\d][^,]*)+")
"""Numbers, with units or without, and commas between them."""


def _as_there(document: Any, keys: tuple[Key, ...], value: Any) -> Any:
    """Text from a command line in the form of the value that it replaces: a list written with commas, a whole number."""
    for key in keys[:-1]:
        document = document[key]
    present = document.get(keys[-1]) if isinstance(document, dict) else document[keys[-1]]
    if isinstance(present, dict):
        present = present.get("value")
    if isinstance(value, str) and (isinstance(present, list) or (present is None and _LIST.fullmatch(value))):
        return [part.strip() for part in value.split(",")]
    if isinstance(value, str) and type(present) is int and value.isdecimal() and len(value) < 10:
        return int(value)
    return value


def parse(document: Mapping[str, Any]) -> Machine:
    """A machine from a document (nested dicts as TOML gives them).

    Raises:
        InputError: as `load`.
    """
    check_depth(document, _FILE)
    version = document.get("format", 1)
    if version != 1 or isinstance(version, bool):
        # Before all else: the keys of a later format would look misspelt.
        raise InputError(f"format: {shown(version)} is not known; expected 1")
    plain, notes = _without_notes(dict(document))
    known = _known_materials()
    for material in _materials_named(plain) - set(_table(plain, "materials")):
        if material in known:
            plain.setdefault("materials", {})[material] = known[material]
    about = plain.get("about")
    if isinstance(about, dict):
        if "notes" in about:
            raise InputError("about.notes: unknown key; sources are written beside the numbers, { value = …, source = … }")
        about["notes"] = notes
    try:
        machine = adapter().validate_python(plain)
    except ValidationError as error:
        raise InputError(one_complaint(error, plain)) from None
    check(machine, known)
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
    """A copy in which every { value = …, source = …, status = … } is replaced by its value, and the rest of these as notes."""
    found: list[tuple[tuple[Key, ...], dict[str, str]]] = []

    def walk(node: Any, keys: tuple[Key, ...]) -> Any:
        if isinstance(node, dict) and "value" in node:
            found.append((keys, _note(node, join(document, keys))))
            return walk(node["value"], keys)
        if isinstance(node, int) and node.bit_length() > 64:
            # Python will not print thousands of digits, and neither will pydantic, which would fail over it.
            raise InputError(f"{join(document, keys)}: {shown(node)} is beyond all reason")
        if isinstance(node, dict):
            return {k: walk(v, (*keys, k)) for k, v in node.items()}
        if isinstance(node, list):
            if any(isinstance(v, dict) and "value" in v for v in node):
                path = join(document, keys)
                raise InputError(f"{path}: write one source beside the whole list, {{ value = […], source = … }}")
            return [walk(v, (*keys, i)) for i, v in enumerate(node)]
        return node

    plain = walk(document, ())
    # Paths in the copy: there a name is text even where a source stood beside it.
    notes = [{"path": join(plain, keys)} | note for keys, note in found]
    return plain, sorted(notes, key=lambda note: note["path"])


def _note(node: dict[str, Any], path: str) -> dict[str, str]:
    """What stands beside a value."""
    if path.rpartition(".")[2] in _NAMING_KEYS:
        raise InputError(f"{path}: a table; sources stand beside dimensions, this key is written plainly")
    for key in node:
        if key not in _NOTE_KEYS:
            raise InputError(f"{path}: unknown key {shown(key)} beside value{nearest(str(key), _NOTE_KEYS)}")
    if not _is_plain(node["value"]):
        raise InputError(f"{path}.value: {shown(node['value'])} where text, a number or a list of these was expected")
    if not isinstance(node.get("source", ""), str):
        raise InputError(f"{path}.source: {shown(node['source'])} where text was expected")
    status = node.get("status", "given")
    if status not in get_args(Status):
        raise InputError(f"{path}.status: {shown(status)} is not known; expected {' or '.join(get_args(Status))}")
    return {k: v for k, v in node.items() if k != "value"}


def _is_plain(value: Any) -> bool:
    return all(_is_plain(v) for v in value) if isinstance(value, list) else value is not None and not isinstance(value, dict)
