"""JSON schema of machine files, by which editors complete, explain and check them while one types."""

from __future__ import annotations

from typing import Any, get_args

from trivet.model.elements.base import NAME_PATTERN
from trivet.model.machine import Status, adapter

_Schema = dict[str, Any]

_VARIANT: _Schema = {
    "variant_of": {
        "title": "Variant of",
        "description": "Name of a machine of the catalogue, or of a file beside this one, of which this machine is a variant.",
        "type": "string",
    },
    "set": {
        "title": "Set",
        "description": 'What differs from the machine of which this one is a variant, by key path: "link.length" = "196 mm".',
        "type": "object",
    },
}


def schema() -> _Schema:
    """JSON schema (draft 2020-12) of machine files.

    It describes a file as it is written in TOML: sources beside the numbers (`{ value = …, source = …, status = … }`), variants
    of other machines, nothing null.  What takes more than one key to judge (an inner diameter below the outer one), and which
    unit fits which dimension, only the reader checks.
    """
    raw: _Schema = adapter().json_schema(mode="validation")
    tables: dict[str, _Schema] = raw["$defs"]
    del tables["Note"], tables["About"]["properties"]["notes"]  # written beside the numbers
    for table in (raw, *tables.values()):
        table["properties"] = {key: _field(field) for key, field in table["properties"].items()}
    heading = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return (
        heading
        | raw
        | {
            "title": "Machine file of trivet",
            "properties": raw["properties"] | _VARIANT,
            # A variant takes from its parent what it does not say itself.
            "required": [],
            "if": {"required": ["variant_of"]},
            "else": {"required": raw["required"], "properties": {"set": False}},
        }
    )


def _field(field: _Schema) -> _Schema:
    """The schema of one key: never null, explained, and with a source beside it where it is a value and not a table."""
    field = _without_null(field)
    if "patternProperties" in field:
        return field | {"additionalProperties": False}
    if "$ref" in field or "$ref" in field.get("items", {}) or "oneOf" in field.get("items", {}):
        return field
    about = {key: field.pop(key) for key in ("title", "description", "default", "examples") if key in field}
    kind = _kind(field)
    if isinstance(about.get("default"), float):
        about["default"] = _as_written(about["default"], about["examples"][0])
    if kind:
        about["description"] = " ".join(filter(None, [about.get("description"), f"{kind[0].upper()}{kind[1:]}."]))
    if "const" in field or field.get("pattern") == NAME_PATTERN:
        return about | field
    properties = {"value": field, "source": {"type": "string"}, "status": {"enum": list(get_args(Status))}}
    noted = {"type": "object", "properties": properties, "required": ["value"], "additionalProperties": False}
    return about | {"anyOf": [field, noted]}


def _as_written(default: float, example: str | float) -> str | float:
    """A default (in SI; zero in practice) with the unit of an example."""
    if isinstance(example, float) or default:
        return default
    return f"0 {example.partition(' ')[2]}"


def _without_null(field: _Schema) -> _Schema:
    """TOML has no null: a key that may be None to us is one that may be left out."""
    if field.get("default", ...) is None:
        field = {key: value for key, value in field.items() if key != "default"}
    choices = field.get("anyOf", [])
    if {"type": "null"} not in choices:
        return field
    (only,) = (choice for choice in choices if choice != {"type": "null"})
    return only | {key: value for key, value in field.items() if key != "anyOf"}


def _kind(field: _Schema) -> str:
    """What quantities and axes say of themselves ("a length with its unit"), taken out of a field or out of a list of them."""
    if "prefixItems" in field:
        (each,) = {_kind(item) for item in field["prefixItems"]}
        return f"a list of {len(field['prefixItems'])}, each {each}"
    kind: str = field.pop("x-kind", "")
    return kind
