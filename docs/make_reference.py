"""Write docs/machine-file-reference.md and docs/study-file-reference.md, the tables of all keys of those files.

python docs/make_reference.py
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import TypeAdapter

from trivet.design import study_file
from trivet.model import schema

DOCS = Path(__file__).parent

# Table of the schema, where it stands in a file, and what tells it from its neighbours.
PLACES = {
    "About": "[about]",
    "Published": "[[about.published]]",
    "PublishedDynamic": "[[about.published_dynamic]]",
    "Platform": "[platform]",
    "Disc": "[platform.disc]",
    "Home": "[home]",
    "Workpiece": "[workpiece]",
    "Material": "[materials.NAME]",
    "Tube": "[sections.NAME]",
    "Rod": "[sections.NAME]",
    "Rectangle": "[sections.NAME]",
    "General": "[sections.NAME]",
    "Chain": "[chains.NAME]",
    "Base": "[chains.NAME.base]",
    "PlatformJoint": "[chains.NAME.platform_joint]",
    "Curvilinear": "[[chains.NAME.elements]]",
    "Prismatic": "[[chains.NAME.elements]]",
    "Profile": "beam = { … }",
    "Revolute": "[[chains.NAME.elements]]",
    "Universal": "[[chains.NAME.elements]]",
    "Spherical": "[[chains.NAME.elements]]",
    "Beam": "[[chains.NAME.elements]]",
    "Offset": "[[chains.NAME.elements]]",
    "Bearing": "bearing = { … }",
    "Neutral": "neutral = { … }",
    "Sphere": "shapes = [{ … }]",
    "Capsule": "shapes = [{ … }]",
    "Box": "shapes = [{ … }]",
    "Mesh": "shapes = [{ … }]",
    "Interference": "[interference]",
}
# Those of a study file.
OF_STUDIES = {
    "GivenVariable": "[[variables]]",
    "GivenPoses": "[poses]",
    "GivenLoad": "[load]",
    "GivenSweep": "[sweep]",
    "GivenAims": "[optimise]",
    "GivenLimit": "[[optimise.limits]]",
    "GivenSensitivity": "[sensitivity]",
}


def pages() -> dict[Path, str]:
    """The pages as they should be."""
    return {DOCS / "machine-file-reference.md": machines(), DOCS / "study-file-reference.md": studies()}


def machines() -> str:
    """The page of machine files."""
    described = schema()
    tables = described["$defs"]
    assert set(tables) == set(PLACES), set(tables) ^ set(PLACES)
    parts = [
        "# Keys of machine files",
        "Made from the schema by `python docs/make_reference.py`; how the keys go together is told in "
        "[machine files](machine-files.md). NAME is a name of your own: lower case letters, digits, `-` and `_`.",
        section("Top level", described["description"], described["else"]["required"], described["properties"]),
    ]
    for name, place in PLACES.items():
        table = tables[name]
        tag = next(
            (
                f' with `{key} = "{table["properties"][key]["const"]}"`'
                for key in ("type", "shape")
                if key in table["properties"]
            ),
            "",
        )
        parts.append(section(f"`{place}`{tag}", table["description"], table.get("required", []), table["properties"]))
    return "\n\n".join(parts) + "\n"


def section(title: str, description: str, needed: list[str], keys: dict[str, Any]) -> str:
    """One table of a machine file."""
    rows = [f"| `{key}` | {'needed' if key in needed else default(field)} | {about(field)} |" for key, field in keys.items()]
    return "\n".join([f"## {title}", "", description, "", "| key | default | meaning |", "|---|---|---|", *rows])


def default(field: dict[str, Any]) -> str:
    """What stands for a key that is left out."""
    value = field.get("default", "")
    return f"`{str(value).lower() if isinstance(value, bool) else value}`" if value not in ("", []) else ""


def about(field: dict[str, Any]) -> str:
    """Meaning of a key, and the words it may take."""
    value = field["anyOf"][0] if "anyOf" in field else field
    words = value.get("enum", [])
    listed = "One of " + ", ".join(f'`"{word}"`' for word in words) + "." if words else ""
    if isinstance(value.get("const"), str):
        listed = f'`"{value["const"]}"`'
    return " ".join(filter(None, [field.get("description", ""), listed])).replace("|", "\\|")


def studies() -> str:
    """The page of study files."""
    tables = TypeAdapter(study_file.StudyFile).json_schema()
    tables = {"StudyFile": tables} | tables["$defs"]
    places = {"StudyFile": "Top level"} | {name: f"`{place}`" for name, place in OF_STUDIES.items()}
    assert set(tables) == set(places), set(tables) ^ set(places)
    parts = [
        "# Keys of study files",
        "Made from what reads them by `python docs/make_reference.py`; how the keys go together, and which quantities there "
        "are, is told in [which dimensions are best](studies.md). Where a value is a number with its unit, the unit is that "
        "of the dimension or quantity; a factor and a share have none. A text has 1 to 200 characters where nothing else is "
        "said.",
    ]
    parts += [study_section(tables, name, title) for name, title in places.items()]
    return "\n\n".join(parts) + "\n"


def study_section(tables: dict[str, Any], name: str, title: str) -> str:
    """One table of a study file."""
    table, rows = tables[name], []
    for key, field in table["properties"].items():
        told = "needed" if key in table.get("required", []) else study_default(name, key)
        target = field.get("$ref", field.get("items", {}).get("$ref", ""))
        meaning = field.get("description") or (tables[target.rpartition("/")[2]]["description"] if target else "")
        rows.append(f"| `{key}` | {value(field)} | {told} | {meaning} |".replace("|  |", "| |"))
    head = ["| key | value | default | meaning |", "|---|---|---|---|"]
    return "\n".join([f"## {title}", "", table["description"], "", *head, *rows])


def study_default(table: str, key: str) -> str:
    """What stands for a key that is left out, as one would write it."""
    kind = getattr(study_file, table)
    (field,) = (own for own in dataclasses.fields(kind) if own.name == key)
    if field.default is dataclasses.MISSING or field.default in (None, "") or dataclasses.is_dataclass(field.default):
        return ""
    written = TypeAdapter(get_type_hints(kind, include_extras=True)[key]).dump_python(field.default, mode="json")
    return f"`{json.dumps(written)}`"


def value(field: dict[str, Any]) -> str:
    """What a key may be, in words, with its bounds."""
    kinds = [own for own in field.get("anyOf", []) if own != {"type": "null"}]
    if kinds:
        plain = {"string", "integer", "number"}
        number = ["a number with its unit"] if plain <= {own["type"] for own in kinds} else []
        rest = [value(own) for own in kinds if not number or own["type"] not in plain]
        return " or ".join(number + rest)
    if "x-kind" in field:
        return str(field["x-kind"])
    if "enum" in field:
        return "one of " + ", ".join(f'`"{word}"`' for word in field["enum"])
    if "const" in field:
        return f"`{field['const']}`"
    if "prefixItems" in field:
        return f"a list of {len(field['prefixItems'])}, each {value(field['prefixItems'][0])}"
    if field.get("type") == "array":
        return f"a list{bounds(field, 'Items')}, each {value(field['items'])}"
    if field.get("type") == "integer":
        return f"a whole number, {field['minimum']:,} to {field['maximum']:,}"
    if field.get("type") == "string":
        return "a text" + bounds(field, "Length", " characters").replace(" of 1 to 200 characters", "")
    return "a table"


def bounds(field: dict[str, Any], of: str, unit: str = "") -> str:
    """Least and greatest size of a text or a list; nothing where there is no greatest."""
    least, most = field.get(f"min{of}"), field.get(f"max{of}")
    if most is None:
        return ""
    return f" of {least} to {most:,}{unit}" if least else f" of at most {most:,}{unit}"


if __name__ == "__main__":
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
