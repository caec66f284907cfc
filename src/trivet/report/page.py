"""A document as one HTML page that asks nobody for anything."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from importlib import resources
from itertools import count
from typing import Any, NamedTuple

from trivet.report.document import Block, Document, Plot, Section, Table, all_sections

_NUMBER = re.compile(r"[<>≈±+−-]?\s*\d[\d., ]*(e[+−-]?\d+)?\s*(%|[^\W\d][\w/]*( [^\W\d][\w/]*)?|°[\w/²]*)?")
"""A number, with its unit or without."""


class Entry(NamedTuple):
    """A section where it stands in the document."""

    anchor: str
    number: str
    section: Section
    entries: tuple[Entry, ...]


def page_of(document: Document) -> str:
    """The page, with all that it needs inside; its scripts are those whose hashes its head names, and no others run."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    own = Environment(
        loader=PackageLoader("trivet.report", "template"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_printable,
    )
    scripts = _scripts(document)
    numbers = count(1)
    own.filters |= {"base64": _base64, "json": _json, "numeric": _numeric}
    own.tests["in_space"] = _in_space
    own.tests |= {kind.__name__.lower(): _is(kind) for kind in Block.__args__}
    return own.get_template("page.html").render(
        document=document,
        entries=_entries(document.sections),
        next_plot=lambda: next(numbers),
        scripts=scripts,
        hashes=" ".join(f"'sha256-{_hash(script)}'" for script in scripts) or "'none'",
        style=_file("page.css"),
    )


def _is(kind: type) -> Any:
    return lambda block: isinstance(block, kind)


def _file(name: str) -> str:
    return resources.files("trivet.report").joinpath("template", name).read_text(encoding="utf-8")


def _entries(sections: tuple[Section, ...], above: str = "") -> tuple[Entry, ...]:
    """Sections with their numbers, "2.1", and anchors, "section-2-1"."""
    found = []
    for k, section in enumerate(sections, 1):
        number = f"{above}.{k}" if above else str(k)
        found.append(Entry(f"section-{number.replace('.', '-')}", number, section, _entries(section.sections, number)))
    return tuple(found)


def _scripts(document: Document) -> tuple[str, ...]:
    """What draws the plots, once; nothing where there are none."""
    if not any(isinstance(block, Plot) for section in all_sections(document.sections) for block in section.blocks):
        return ()
    from plotly.offline import get_plotlyjs

    return (get_plotlyjs(), _file("plots.js"))


def _printable(value: Any) -> Any:
    """Text without characters that nobody sees, or that turn others round; what a filter has made is left as it is."""
    if type(value) is not str:
        return value
    return "".join(c if c.isprintable() or c in "\n\t" else c.encode("unicode_escape").decode("ascii") for c in value)


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _hash(script: str) -> str:
    return _base64(hashlib.sha256(script.encode("utf-8")).digest())


def _json(figure: Any) -> str:
    """A plotly figure as wide as the page, within a script, where no text may look like its end."""
    value = json.loads(figure.to_json())
    layout = value["layout"]
    for name in ("title", "width"):
        layout.pop(name, None)
    layout |= {"autosize": True, "paper_bgcolor": "white", "font": {"color": "black"} | layout.get("font", {})}
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")


def _in_space(figure: Any) -> bool:
    """Whether there is something in a plotly figure that can be turned."""
    return any("scene" in trace for trace in figure.data)


def _numeric(table: Table) -> list[bool]:
    """Which columns hold numbers only."""
    columns = ([row[k] for row in table.rows if k < len(row) and row[k]] for k in range(len(table.columns)))
    return [bool(cells) and all(_NUMBER.fullmatch(cell.strip()) for cell in cells) for cells in columns]
