"""Write docs/machine-file-reference.md, the tables of all keys of machine files, from their schema.

python docs/make_reference.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from trivet.model import schema

PAGE = Path(__file__).parent / "machine-file-reference.md"

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


def page() -> str:
    """The page as it should be."""
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


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
