"""Legs of one machine on the guides of another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
import tomli_w
from documents import message_of
from numpy.testing import assert_allclose

from trivet.design.evaluation import Evaluation
from trivet.design.study import Study, read_study, unpacked
from trivet.model import load, parse, to_text
from trivet.model.elements import Profile
from trivet.model.toml import parse_toml
from trivet.space.surface import hemisphere
from trivet.study.architecture import on_guide, pairs
from trivet.study.home import require_home
from trivet.study.stiffness_map import stiffness_map

WAYS = {("alizade", "straight-column"): "behi", ("glozman", "straight-column"): "straight-elbow"}
"""Pairs that the catalogue has as machines of their own."""


def study(tmp_path: Path, **changes: Any) -> Study:
    path = tmp_path / "study.toml"
    whole = {
        "machines": ["glozman", "alizade"],
        "guides": ["azulay", "straight-column"],
        "quantities": ["mean K_xx", "mass"],
        "poses": {"steps": 2, "rolls": 24, "height": "160 mm", "radius": "4 mm"},
        "variables": [{"of": "platform_joint.radius", "low": "16 mm", "high": "20 mm"}],
    }
    path.write_text(tomli_w.dumps(whole | changes), encoding="utf-8")
    return read_study(path)


@pytest.mark.parametrize(("legs", "guide"), WAYS)
def test_a_pair_is_the_machine_that_the_catalogue_has_of_it(legs: str, guide: str) -> None:
    made, own = on_guide(load(legs).with_spherical("free"), load(guide)), load(WAYS[legs, guide]).with_spherical("free")
    assert made.chains["leg"].base == own.chains["leg"].base
    ours, theirs = (stiffness_map(one, hemisphere(0.16, 0.004, 2), rolls=24).matrix for one in (made, own))
    assert_allclose(ours, theirs, rtol=1e-9, atol=1e-3)


def test_a_machine_on_its_own_guides_is_itself() -> None:
    machine = load("azulay")
    assert on_guide(machine, load("eclipse")) is machine
    assert [one.name for one in pairs([machine, load("eclipse")], [machine, load("eclipse")])] == ["azulay", "eclipse"]


def test_a_pair_is_a_machine_file_of_its_own() -> None:
    made = on_guide(load("eclipse"), load("rmmt"))
    assert made.name == "eclipse-on-rmmt"
    again = parse(parse_toml("it", to_text(made).encode(), "a machine file"))
    assert jax.tree.leaves(again) == jax.tree.leaves(made)
    assert to_text(again) == to_text(made)


def test_what_a_guide_is_made_of_comes_along_and_what_both_name_is_of_the_legs() -> None:
    other = load("rmmt", {"sections.tube.outer_diameter": "30 mm"})
    guide, cross, *rest = other.chains["leg"].elements
    chain = replace(other.chains["leg"], elements=(guide, replace(cross, beam=Profile("rail", "steel")), *rest))
    rail = replace(other, chains={"leg": chain}, sections={**other.sections, "rail": other.sections["tube"]})
    made = on_guide(load("alizade"), rail)
    assert float(made.sections["rail"].outer_diameter) == 0.03
    assert float(made.sections["tube"].outer_diameter) == 0.019


def parse_file(text: str) -> Any:
    return parse(parse_toml("it", text.encode(), "a machine file"))


def test_home_is_where_it_is_reached() -> None:
    higher = to_text(load("straight-column")).replace("[chains.leg.base]\n", '[chains.leg.base]\nheight = "140 mm"\n')
    made = on_guide(load("eclipse"), parse_file(higher))
    assert made.home.position[2] == pytest.approx(0.301)
    require_home(made)


def test_every_leg_stands_on_every_guide_of_a_study(tmp_path: Path) -> None:
    made = study(tmp_path)
    assert made.names == ["glozman", "alizade", "glozman-on-straight-column", "alizade-on-straight-column"]
    worked = Evaluation(unpacked(made.climbing().packed))(np.array([[0.018], [0.02]])).values
    own = stiffness_map(made.machine(3, [0.02]), hemisphere(0.16, 0.004, 2), rolls=24)
    assert_allclose(worked[1, 3], np.mean(own.diagonal("K_xx")), rtol=1e-4)
    assert np.isfinite(worked).all()


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "legs that are not on guides": (
        {"machines": ["gough-stewart"]},
        "chains.left: is not a planar leg on a guide",
    ),
    "a guide that is none": ({"guides": ["gough-stewart"]}, "chains.left: is not a planar leg on a guide"),
    "an unknown machine": ({"guides": ["azuly"]}, "azuly"),
    "a path that no pair has": ({"variables": [{"of": "base.rad", "low": "1 mm", "high": "2 mm"}]}, "base.rad"),
    "too many": ({"machines": [f"azulay@link.length={200 + k} mm" for k in range(60)]}, "120 with all pairs"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_cannot_be_paired_is_named(tmp_path: Path, fault: str) -> None:
    changes, words = FAULTS[fault]
    assert words in message_of(lambda: study(tmp_path, **changes))
