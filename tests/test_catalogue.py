"""Every machine of the catalogue is read, checked, written and read again, and drawn."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from trivet.kinematics.closure import coordinates_from, end_frame
from trivet.model import Machine, catalogue, load, parse, to_text, write
from trivet.model.elements import Spherical
from trivet.show.drawing import draw

LAYOUTS = {
    "azulay": "curvilinear prismatic revolute beam spherical",
    "eclipse": "curvilinear prismatic revolute beam spherical",
    "alizade": "curvilinear revolute prismatic spherical",
    "glozman": "curvilinear revolute beam revolute beam spherical",
    "tahmasebi": "prismatic prismatic spherical beam revolute",
    "rmmt": "curvilinear prismatic prismatic revolute beam spherical",
    "gough-stewart": "universal prismatic spherical",
    "behi": "prismatic revolute prismatic spherical",
    "ben-horin": "prismatic prismatic revolute beam spherical",
    "straight-column": "prismatic prismatic revolute beam spherical",
    "straight-elbow": "prismatic revolute beam revolute beam spherical",
}
ACTUATORS = {"rmmt": 9}
UNPUBLISHED = ("tahmasebi", "rmmt", "gough-stewart", "behi", "ben-horin", "straight-column", "straight-elbow")


def _numbers(node: Any, keys: tuple[str, ...] = ()) -> list[str]:
    """Paths of the quantities of a document that have no source of their own."""
    if isinstance(node, dict):
        return [] if "value" in node else [p for key, value in node.items() for p in _numbers(value, (*keys, key))]
    if isinstance(node, list) and any(isinstance(v, dict) for v in node):
        return [p for value in node for p in _numbers(value, (*keys, value["name"]))]
    first = node[0] if isinstance(node, list) else node
    is_number = type(first) in (int, float) or (isinstance(first, str) and first[:1].isdigit())
    return [".".join(keys)] if is_number else []


def test_catalogue_is_complete() -> None:
    assert set(LAYOUTS) <= set(catalogue())


@pytest.mark.parametrize("name", catalogue())
def test_round_trip_is_bit_identical(name: str) -> None:
    machine = load(name)
    text = to_text(machine)
    again = parse(tomllib.loads(text))
    assert to_text(again) == text
    first, second = jax.tree.flatten(machine), jax.tree.flatten(again)
    assert first[1] == second[1]
    assert [float(v).hex() for v in first[0]] == [float(v).hex() for v in second[0]]
    assert again.about.notes == machine.about.notes
    assert again.about.title == machine.about.title


@pytest.mark.parametrize("name", catalogue())
def test_file_round_trip(name: str, tmp_path: Path) -> None:
    machine = load(name)
    write(machine, tmp_path / "machine.toml")
    assert to_text(load(tmp_path / "machine.toml")) == to_text(machine)
    assert [p.name for p in tmp_path.iterdir()] == ["machine.toml"]


@pytest.mark.parametrize("name", LAYOUTS)
def test_layout(name: str) -> None:
    machine = load(name)
    for chain in machine.chains.values():
        assert " ".join(e.type for e in chain.elements) == LAYOUTS[name]  # type: ignore[attr-defined]
        freedoms = sum(len(e.COORDINATES) for e in chain.elements)
        assert freedoms == (7 if name == "rmmt" else 6)
    driven = [e for leg in machine.legs for e in leg.chain.elements if getattr(e, "actuated", False)]
    assert len(driven) == ACTUATORS.get(name, 6)


@pytest.mark.parametrize("name", LAYOUTS)
def test_declared_coordinates_are_the_freedoms(name: str) -> None:
    """Every coordinate moves the end of the chain along the twist which the joint declares for it."""
    rng = np.random.default_rng(3)
    for leg in load(name).legs:
        elements, base = leg.chain.elements, leg.base_frame()
        numbers = rng.uniform(0.2, 0.5, sum(len(e.unknowns) for e in elements))
        step, column, frame = 1e-6, 0, base
        for element, coordinate in zip(elements, coordinates_from(elements, numbers), strict=True):
            end = end_frame(elements, base, coordinates_from(elements, numbers))
            beyond = element.advance(frame, coordinate)
            # A ball spans its freedoms with axes of its own choice; its three turns are covered by the loop closure.
            twists = () if isinstance(element, Spherical) else element.freedoms(frame, coordinate, end.origin)
            for index, twist in enumerate(twists, start=column):
                ahead, behind = (
                    end_frame(elements, base, coordinates_from(elements, numbers + sign * step * np.eye(len(numbers))[index]))
                    for sign in (1, -1)
                )
                moved = [(float(a) - float(b)) / (2 * step) for a, b in zip(ahead.origin, behind.origin, strict=True)]
                np.testing.assert_allclose(moved, [float(c) for c in twist.linear], atol=1e-8)
                turned = [(float(a) - float(b)) / (2 * step) for a, b in zip(ahead.z, behind.z, strict=True)]
                np.testing.assert_allclose(turned, [float(c) for c in twist.angular.cross(end.z)], atol=1e-8)
            column += len(element.unknowns)
            frame = beyond


@pytest.mark.parametrize("name", UNPUBLISHED)
def test_every_assumed_number_says_so(name: str) -> None:
    path = Path(__file__).parents[1] / "src" / "trivet" / "catalog" / f"{name}.toml"
    bare = _numbers(tomllib.loads(path.read_text(encoding="utf-8")))
    # The zero of a base is a convention, copies a count, and 1 the version of the format.
    assert [p for p in bare if not p.endswith((".copies", "base.azimuth", "format"))] == []
    assert any(note.status == "assumed" for note in load(name).about.notes)


@pytest.mark.parametrize("name", catalogue())
def test_draws(name: str, tmp_path: Path) -> None:
    machine: Machine = load(name)
    draw(machine, path=tmp_path / "machine.png")
    draw(machine, path=tmp_path / "machine.html")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["machine.html", "machine.png"]
