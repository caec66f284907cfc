"""Advice: slopes of all margins against differences; every change that is told, put back as the command takes it."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trivet.errors import InputError
from trivet.model import catalogue, dimensions, document_of, load, parse, write
from trivet.model.machine import Machine
from trivet.reach.scene import Ball
from trivet.reach.touch import Touch
from trivet.space.vector import Vec
from trivet.study.advice import HEIGHT, Change, _changed, _Place, advice, with_dimension
from trivet.study.machines import choose, parse_settings
from trivet.study.pathfile import read_path
from trivet.study.plan import Plan, plan, plan_along, replanned
from trivet.study.roll_grid import Rules
from trivet.study.spare import Margin, slopes, spare

FINER: dict[str, Any] = {"step": math.radians(3), "rolls": 60}
COARSE: dict[str, Any] = {"step": math.radians(5), "rolls": 36, "proof": False}

STOPPED: dict[str, tuple[str, float, str, dict[str, Any], Margin]] = {
    "azulay, slides": ("azulay", 0.121, "++ ++ -+", {}, "travel"),
    "eclipse, columns": ("eclipse", 0.200, "++ ++ -+", {}, "travel"),
    "azulay, balls": ("azulay@ball.cone=20 deg", 0.121, "++ ++ ++", {"neutral": "home", "to": 0.5}, "travel"),
    "azulay, links": ("azulay@sections.tube.outer_diameter=24 mm", 0.110, "++ ++ -+", {}, "clearance"),
    "glozman, links": ("glozman@sections.tube.outer_diameter=23 mm", 0.168, "++ -- +-", {}, "clearance"),
    "alizade, sigma": ("alizade", 0.157, "+ + -", {"sigma": 0.75}, "sigma_min"),
}
"""Machine, height of the sphere (m), mode, settings, and what stops it."""
NAMED = {
    "azulay, slides": {"chains.leg.elements.link.length", "chains.leg.elements.guide.radius", HEIGHT},
    "eclipse, columns": {"chains.leg.elements.link.length", "chains.leg.elements.column.travel.2", HEIGHT},
    "azulay, balls": {"chains.leg.elements.ball.cone"},
    "azulay, links": {"sections.tube.outer_diameter", "chains.leg.platform_joint.radius"},
    "glozman, links": {"sections.tube.outer_diameter", "chains.leg.platform_joint.radius"},
    "alizade, sigma": {"chains.leg.elements.guide.radius"},
}
"""Changes that let it pass, among others."""


def again(name: str, height: float, mode: str, settings: dict[str, Any], change: Change) -> Plan:
    """The plan with a change made as the command makes it, in the words of the advice."""
    option, value = change.option
    if option == "--height":
        number, unit = value.split(" ")
        assert unit == "mm"
        return plan(name, 0.004, float(number) * 1e-3, mode=mode, **settings, **COARSE)
    assert option == "--set"
    return plan(choose(name, parse_settings([value])), 0.004, height, mode=mode, **settings, **COARSE)


@pytest.mark.parametrize("case", STOPPED)
def test_what_is_advised_lets_the_machine_pass(case: str) -> None:
    name, height, mode, settings, margin = STOPPED[case]
    stopped = plan(name, 0.004, height, mode=mode, **settings, **COARSE)
    assert not stopped.is_possible
    changes = advice(stopped)
    assert [change.passes for change in changes] == sorted((change.passes for change in changes), reverse=True)
    assert {change.dimension for change in changes if change.passes} >= NAMED[case]
    for change in changes:
        assert change.mends == margin
        assert again(name, height, mode, settings, change).is_possible == change.passes
        if change.passes:  # narrowed down: nine tenths of it do not serve
            less = change.now + 0.9 * (change.needed - change.now)
            if change.dimension == HEIGHT:
                assert not replanned(stopped, height=less).is_possible
            else:
                changed = with_dimension(stopped.machine, change.dimension, less)
                assert not replanned(stopped, machine=changed).is_possible


def test_values_are_those_of_the_paper_s_machine() -> None:
    stopped = plan("azulay", 0.004, 0.121, mode="++ ++ -+", proof=False, **FINER)
    changes = {change.dimension: change for change in advice(stopped)}
    link, inner = changes["chains.leg.elements.link.length"], changes["chains.leg.elements.slide.travel.1"]
    assert link.passes
    assert link.needed == pytest.approx(0.2194, abs=3e-4)
    assert link.written == ("216 mm", f"{link.needed * 1e3:.5g} mm")
    assert plan(load("azulay", parse_settings([link.option[1]])), 0.004, 0.121, mode="++ ++ -+", **FINER).is_safe
    assert link.option == ("--set", f"chains.leg.elements.link.length={link.written[1]}")
    assert changes[HEIGHT].needed == pytest.approx(0.1151, abs=3e-4)
    assert changes[HEIGHT].option == ("--height", changes[HEIGHT].written[1])
    assert inner.needed == pytest.approx(-0.0041, abs=2e-4)
    assert inner.option == ("--set", f"chains.leg.elements.slide.travel={inner.written[1]}, 65 mm")


def test_the_worst_of_two_margins_is_to_be_mended_first() -> None:
    """Slides and links, of which no change mends both."""
    settings = {"mode": "++ ++ -+", **COARSE}
    stopped = plan("azulay@sections.tube.outer_diameter=22.5 mm", 0.004, 0.121, **settings)
    assert not plan("azulay@sections.tube.outer_diameter=22.5 mm", 0.004, 0.121, limits=False, **settings).is_possible
    assert not plan("azulay@sections.tube.outer_diameter=22.5 mm", 0.004, 0.121, bodies=False, **settings).is_possible
    changes = advice(stopped)
    assert len(changes) >= 4
    assert {(change.mends, change.passes) for change in changes} == {("travel", False)}


def test_no_change_is_told_that_no_file_may_have() -> None:
    stopped = plan("azulay", 0.004, 0.121, mode="++ ++ -+", **COARSE)
    link = _Place.of(stopped.machine, "chains.leg.elements.link.length")
    assert _changed(stopped.machine, link, -0.1) is None
    assert _changed(stopped.machine, link, 0.1) is not None


def test_nothing_is_advised_where_a_singularity_is_in_the_way_or_nothing_is() -> None:
    assert not advice(plan("azulay", 0.004, 0.121, **COARSE))
    assert not advice(plan("azulay", 0.004, 0.110, mode="++ ++ -+", **COARSE))


@pytest.mark.parametrize("margin", ["travel", "clearance", "sigma_min"])
@pytest.mark.parametrize(
    ("name", "mode", "height"), [("azulay", "++ ++ -+", 0.11), ("behi", "", 0.15), ("alizade", "+ + -", 0.157)]
)
def test_slopes_against_differences(name: str, mode: str, height: float, margin: Margin) -> None:
    rules = plan(name, 0.004, height, mode=mode, solid=True, sigma=0.1, **COARSE).rules
    size = float(rules.machine.characteristic_length)
    touch = Touch(*(np.array([v]) for v in (0.001, 0.002, height, 0.3, 0.4, 1.0)))

    def left(rules: Rules, touch: Touch) -> float:
        scale = float(rules.machine.characteristic_length) if margin == "clearance" else size
        return float(spare(rules, touch, margin)[0]) * scale / size

    def raised(by: float) -> tuple[Rules, Touch]:
        assert rules.workpiece is not None
        moved = Ball(rules.workpiece.centre + Vec(0.0, 0.0, by), rules.workpiece.radius)
        return rules._replace(workpiece=moved), touch._replace(z=touch.z + by)

    assert math.isfinite(left(rules, touch))
    by_machine, by_rise = slopes(rules, touch, margin)
    step, moved = 1e-7, 0
    assert by_rise == pytest.approx((left(*raised(step)) - left(*raised(-step))) / (2 * step), rel=1e-5, abs=1e-7)
    for dimension, slope in dimensions(by_machine).items():
        now = float(dimensions(rules.machine)[dimension])
        step = 1e-6 * max(abs(now), 1e-3)
        ends = [left(rules._replace(machine=with_dimension(rules.machine, dimension, now + s)), touch) for s in (-step, step)]
        assert float(slope) == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-5, abs=1e-7)
        moved += ends[0] != ends[1]
    assert moved >= 3


def with_everything() -> Machine:
    """Bodies of every shape, sources beside numbers, a cone with its axis."""
    document = document_of(load("azulay"))
    document["fixtures"] = {
        "table": [{"shape": "box", "size": ["200 mm", "200 mm", "10 mm"], "centre": ["0 mm", "0 mm", "-5 mm"]}],
        "post": [
            {"shape": "capsule", "start": ["200 mm", "0 mm", "0 mm"], "end": ["200 mm", "0 mm", "50 mm"], "radius": "5 mm"},
            {"shape": "sphere", "radius": "7 mm", "centre": ["200 mm", "0 mm", "60 mm"]},
        ],
    }
    document["interference"] = {"clearance": "1 mm"}
    elements = document["chains"]["leg"]["elements"]
    elements[1]["travel"] = {"value": elements[1]["travel"], "source": "a drawing"}
    elements[4]["neutral"] = {"axis": "z"}
    return parse(document)


@pytest.mark.parametrize("name", [*catalogue(), "with everything"])
def test_every_dimension_is_written_as_it_is_read(name: str, tmp_path: Path) -> None:
    machine = with_everything() if name == "with everything" else load(name)
    write(machine, tmp_path / "machine.toml")
    for dimension, value in dimensions(machine).items():
        place = _Place.of(machine, dimension)
        wanted = place.rounded(float(value) * 0.99123456 if value else -0.01234567)
        option, text = place.option(machine, wanted)
        assert option == "--set"
        try:
            parse(document_of(with_dimension(machine, dimension, wanted)))
        except InputError:
            continue  # below zero, where that cannot be
        changed = load(tmp_path / "machine.toml", parse_settings([text]))
        expected = {k: float(v) for k, v in dimensions(machine).items()} | {dimension: wanted}
        assert dimensions(changed) == pytest.approx(expected, rel=1e-15, abs=0)


def test_solid_sphere_sinks_with_the_poses() -> None:
    """Left where it was, it would be in the way of the links around it."""
    name, settings = "azulay@platform_joint.radius=38 mm", {"to": 0.3, "solid": True}
    stopped = plan(name, 0.030, 0.160, **settings, **COARSE)
    height = {change.dimension: change for change in advice(stopped)}[HEIGHT]
    assert height.passes
    assert height.mends == "travel"
    assert height.needed < 0.15
    assert plan(name, 0.030, height.needed, **settings, **COARSE).is_possible


def test_a_path_stays_where_it_is(tmp_path: Path) -> None:
    poses = [
        '[[poses]]\nposition = ["0 mm", "0 mm", "125 mm"]',
        '[[poses]]\nposition = ["0 mm", "0 mm", "123 mm"]\ntilt = "9 deg"',
    ]
    (tmp_path / "path.toml").write_text("format = 1\n" + "\n".join(poses))
    stopped = plan_along("azulay", read_path(tmp_path / "path.toml"), mode="++ ++ -+", **COARSE)
    found = {change.dimension: change.passes for change in advice(stopped)}
    assert found["chains.leg.elements.link.length"]
    assert HEIGHT not in found


def test_only_dimensions_of_the_file_are_told_of() -> None:
    """Neutral axes that differ from copy to copy make chains of their own of the copies."""
    stopped = plan("azulay", 0.004, 0.110, mode="++ ++ -+", neutral="home", **COARSE)
    known = dimensions(load("azulay")).keys()
    assert {change.dimension for change in advice(stopped)} - known > {HEIGHT}
    assert {change.dimension for change in advice(stopped, load("azulay"))} - known == {HEIGHT}


def test_advice_is_taken_by_the_command(trivet: Any) -> None:
    arguments = ("plan", "azulay", "--mode", "++ ++ -+", "--step", "5 deg", "--rolls", "36")
    stopped = plan("azulay", 0.004, 0.121, mode="++ ++ -+", **COARSE)
    found = [change for change in advice(stopped) if change.passes]
    assert {change.option[0] for change in found} == {"--set", "--height"}
    for change in found:
        pasted = shlex.split(shlex.join(change.option))
        code, out, _ = trivet(*arguments, *pasted, "--no-proof", "--json")
        assert code == 0
        assert json.loads(out)["plans"][0]["possible"]


def test_advice_in_words(trivet: Any) -> None:
    arguments = ("plan", "azulay", "--mode", "++ ++ -+", "--step", "5 deg", "--rolls", "36", "--advise")
    code, out, _ = trivet(*arguments)
    assert code == 1
    assert "link.length" in out
    code, out, _ = trivet(*arguments, "--json")
    assert code == 1
    assert json.loads(out)["advice"][0]["passes"]


def test_a_solid_sphere_goes_along_with_its_height() -> None:
    """A plan about another height is the plan that was asked for there."""
    settings = {"mode": "++ ++ -+", "solid": True, "step": math.radians(6), "rolls": 30, "proof": False}
    there = plan("azulay", 0.004, 0.110, **settings)
    moved = replanned(plan("azulay", 0.004, 0.121, **settings), height=0.110)
    np.testing.assert_array_equal(moved.field.value, there.field.value)
    assert not np.array_equal(there.field.value, plan("azulay", 0.004, 0.110, **(settings | {"solid": False})).field.value)
