"""Writing machine files."""

from __future__ import annotations

import hashlib
import os
from typing import Any

import tomli_w

from trivet.files import replacing
from trivet.model.machine import Machine, adapter
from trivet.model.paths import get, join, leaves, put


def document_of(machine: Machine) -> dict[str, Any]:
    """The document (nested dicts, quantities as text with units, sources beside the numbers) of a machine."""
    document: dict[str, Any] = _plain(adapter().dump_python(machine, exclude_none=True))
    notes = document["about"].pop("notes", [])
    places = {join(document, keys): keys for keys in leaves(document)} if notes else {}
    for note in notes:
        keys = places.get(note["path"])
        if keys is not None:  # what is left out because it is empty takes its source along
            beside = {k: v for k, v in note.items() if k != "path" and v}
            put(document, keys, {"value": get(document, keys)} | beside)
    return {k: document[k] for k in ("format", "about") if k in document} | document


def _plain(node: Any) -> Any:
    """Tuples as lists, empty texts and tables left out; but a platform without mass is an empty table, and needed."""
    if isinstance(node, dict):
        return {k: _plain(v) for k, v in node.items() if k == "platform" or v not in ("", {}, (), [])}
    return [_plain(v) for v in node] if isinstance(node, (tuple, list)) else node


def to_text(machine: Machine) -> str:
    """A machine as the text of a machine file."""
    return tomli_w.dumps(document_of(machine))


def printed(machine: Machine) -> str:
    """The text of a machine file as `trivet show --toml` prints it: without published values, which speak of the original."""
    return to_text(machine.renamed(machine.name))


def fingerprint(machine: Machine) -> str:
    """SHA-256 (hex) of the machine file as printed: which machine results are of."""
    return hashlib.sha256(printed(machine).encode()).hexdigest()


def write(machine: Machine, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a machine file; it appears whole or not at all.

    Raises:
        InputError: when the file exists (unless `overwrite`), or cannot be written.
    """
    text = to_text(machine)
    with replacing(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")
