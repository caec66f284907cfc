"""Machines: the catalogue, and one of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from trivet.kinematics.jacobian import is_driven
from trivet.model import Machine, dimensions, document_of
from trivet.model.elements import Curvilinear, Joint, Prismatic, Revolute, Spherical, Universal
from trivet.views.layout import table, wrapping
from trivet.views.si import finite


def catalogue_table(machines: list[Machine]) -> list[Any]:
    """The catalogue, one line each."""
    found = table("Machines of the catalogue", "name", "what it is", "chains", left=3)
    for machine in machines:
        chains = ", ".join(f"{c.copies} × {topology(c)}" for _, c in sorted(machine.chains.items()))
        found.add_row(machine.name, machine.about.title, chains)
    return [found]


def topology(chain: Any) -> str:
    """The joints of a chain by their letters, the actuated ones in brackets: "[P][P]RS"."""
    letters = {Curvilinear: "P", Prismatic: "P", Revolute: "R", Spherical: "S", Universal: "U"}
    joints = [(letters[type(e)], is_driven(e)) for e in chain.elements if isinstance(e, Joint)]
    return "".join(f"[{letter}]" if driven else letter for letter, driven in joints)


def tables(machine: Machine) -> Iterator[Any]:
    """A machine: chains, dimensions, sources."""
    about = machine.about
    lines = (f"{machine.name}: {about.title}", about.description, f"Source: {about.source}" if about.source else "")
    yield "\n".join(line for line in lines if line)
    document = document_of(machine)
    for name, chain in sorted(machine.chains.items()):
        elements = table(
            f"chain {name}, {chain.copies} ×, {topology(chain)} (actuated joints in brackets)",
            "element",
            "type",
            "data",
            left=3,
        )
        for row in document["chains"][name]["elements"]:
            data = ", ".join(f"{k} {_plain(v)}" for k, v in row.items() if k not in ("name", "type") and v is not False)
            elements.add_row(row["name"], row["type"], data)
        yield wrapping(elements)
    rest = table("the rest", "key", "value", left=2)
    for key in ("platform", "home", "workpiece", "sections", "materials", "theory", "interference", "fixtures"):
        for path, value in _flat(document.get(key, {}), key):
            rest.add_row(path, _plain(value))
    for name, chain in sorted(document["chains"].items()):
        for key in ("platform_joint", "base"):
            for path, value in _flat(chain.get(key, {}), f"{name}.{key}"):
                rest.add_row(path, _plain(value))
    yield wrapping(rest)
    noted = [n for n in about.notes if n.status != "given"]
    if noted:
        sources = table("numbers that are not given by the source", "key", "status", "why", left=3)
        for note in noted:
            sources.add_row(note.path, note.status, note.source)
        yield wrapping(sources)


def _flat(node: Any, path: str) -> list[tuple[str, Any]]:
    if isinstance(node, dict) and "value" not in node:
        return [pair for key, value in node.items() for pair in _flat(value, f"{path}.{key}")]
    return [(path, node)]


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return _plain(value["value"]) if "value" in value else ", ".join(f"{k} {_plain(v)}" for k, v in value.items())
    if isinstance(value, list):
        return " … ".join(map(_plain, value)) if len(value) == 2 else ", ".join(map(_plain, value))
    return "yes" if value is True else str(value)


def card(machine: Machine) -> dict[str, Any]:
    """A machine in short."""
    return {
        "name": machine.name,
        "title": machine.about.title,
        "description": machine.about.description,
        "source": machine.about.source,
        "chains": {
            name: {
                "copies": chain.copies,
                "elements": [{"name": e.name, "type": e.type, "actuated": is_driven(e)} for e in chain.elements],
            }
            for name, chain in sorted(machine.chains.items())
        },
        "notes": [{"path": n.path, "status": n.status, "source": n.source} for n in machine.about.notes],
    }


def as_json(machine: Machine) -> dict[str, Any]:
    """A machine with every dimension by its key path, in SI."""
    return card(machine) | {"dimensions_SI": {k: finite(float(v)) for k, v in dimensions(machine).items()}}
