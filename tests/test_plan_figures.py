"""Figures of plans: what is on them, as Matplotlib and plotly were told it."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trivet
from trivet.kinematics.jacobian import arm_of
from trivet.reach.margins import side
from trivet.show.figure import figure
from trivet.show.plan import headings, map_of, marks, panels, places
from trivet.show.sticks import sticks
from trivet.study.plan import Plan, plans
from trivet.study.roll_grid import frames_of, some

STEP, ROLLS = math.radians(5), 60


@pytest.fixture(scope="module")
def way() -> Plan:
    return trivet.plan("azulay", 0.004, 0.110, mode="++ ++ -+", step=STEP, rolls=ROLLS)


@pytest.fixture(scope="module")
def stopped() -> Plan:
    return trivet.plan("azulay", step=STEP, rolls=ROLLS, proof=False)


def page(result: Any, path: Path) -> tuple[list[dict[str, Any]], dict[str, Any], list[dict[str, Any]]]:
    """Traces, layout and frames of a page."""
    figure(result, path)
    text = path.read_text(encoding="utf-8")
    assert "<script src=" not in text  # no network
    arguments = text[text.rindex("Plotly.newPlot(") :]
    decoder = json.JSONDecoder()
    traces, end = decoder.raw_decode(arguments, arguments.index("["))
    layout, end = decoder.raw_decode(arguments, arguments.index("{", end))
    frames = re.search(r"Plotly\.addFrames\(\s*'[^']*',\s*", arguments)
    return traces, layout, decoder.raw_decode(arguments, frames.end())[0] if frames else []


def numbers(value: Any) -> np.ndarray:
    """Numbers as plotly writes them."""
    if isinstance(value, dict):
        import base64

        return np.frombuffer(base64.b64decode(value["bdata"]), dtype=value["dtype"])
    return np.array([np.nan if v is None else v for v in value], dtype=float)


def test_map_has_the_way_on_allowed_poses_and_the_singular_curve_where_the_side_changes(way: Plan) -> None:
    seen = map_of(way)
    column = np.abs(seen.rolls[:, None] - headings(way)).argmin(axis=0)
    row = np.abs(seen.marks[:, None] - marks(way)).argmin(axis=0)
    assert np.isfinite(seen.values[column, row]).all()
    rows, columns = np.indices(way.grid.shape).reshape(2, -1)
    sides = side(way.machine, frames_of(way.grid.at(rows, columns), way.rules.radius), way.rules.signs).reshape(way.grid.shape)
    np.testing.assert_array_equal(np.sign(seen.sigma[: way.grid.columns]), sides.T)
    np.testing.assert_array_equal(seen.sigma[way.grid.columns], seen.sigma[0])  # once round


def test_margins_are_told_in_their_units_with_what_is_demanded(way: Plan) -> None:
    assert way.along is not None
    assert way.proof is not None
    found = {panel.label.split(",")[0]: panel for panel in panels(way)}
    assert list(found) == ["sigma_min", "travel left", "clearance"]
    assert found["sigma_min"].demanded == way.proof.demand.sigma_min
    np.testing.assert_allclose(found["clearance"].values, 1e3 * way.along.clearance)
    np.testing.assert_allclose(found["travel left"].values, 100 * way.along.travel)


def test_worst_place_is_where_the_value_is_least() -> None:
    aims = ("sigma_min=0.1", "K_xx=5 N/um")
    plan = trivet.plan("azulay", 0.004, 0.110, mode="++ ++ -+", aims=aims, step=STEP, rolls=ROLLS, proof=False)
    value = next(panel for panel in panels(plan) if panel.label == "value").values
    assert 0 < places(plan)["worst"] == value.argmin() < len(value) - 1


def test_page_of_a_way_moves_the_machine_along_it(way: Plan, tmp_path: Path) -> None:
    traces, layout, frames = page(way, tmp_path / "way.html")
    assert way.along is not None
    names = [trace.get("name") for trace in traces]
    for name in ("Type 2 singularity (det J_x = 0)", "not allowed", "start", "end", "worst", "sigma_min", "platform"):
        assert name in names
    assert "clearance, mm" in names
    assert "proven" in layout["title"]["text"]
    assert len(frames) == len(layout["sliders"][0]["steps"])
    # The platform's corners are as far from its centre as the joints are, in the first frame and in the last.
    for frame, k in ((frames[0], 0), (frames[-1], len(way.along.rows) - 1)):
        pose = some(frames_of(way.along.touch, way.rules.radius), k)
        corners = np.stack([numbers(frame["data"][1][axis]) for axis in "xyz"], axis=-1)[:3]
        arms = [np.linalg.norm([float(c) for c in arm_of(leg, pose)]) for leg in way.machine.legs_unnamed]
        centre = 1e3 * np.array([float(c) for c in pose.origin])
        np.testing.assert_allclose(np.linalg.norm(corners - centre, axis=1), 1e3 * np.array(arms), atol=2e-3)


def test_page_without_a_way_has_the_map_only(stopped: Plan, tmp_path: Path) -> None:
    traces, layout, frames = page(stopped, tmp_path / "none.html")
    assert not frames
    assert {trace["type"] for trace in traces} == {"heatmap", "scatter", "contour"}
    assert layout["title"]["text"].endswith("no way")


def test_several_plans_are_lines_of_their_own_looks(tmp_path: Path) -> None:
    study = plans(["azulay"], (0.108, 0.110, 0.121), ("++ ++ -+",), radius=0.004, step=STEP, rolls=ROLLS, proof=False)
    traces, layout, _ = page(study, tmp_path / "several.html")
    possible = [plan for plan in study.plans if plan.is_possible]
    assert 1 < len(possible) == len(traces)
    for look in ("color", "dash"):
        assert len({trace["line"][look] for trace in traces}) == len(traces)
    assert layout["title"]["text"].startswith(f"{len(possible)} of 3 cases")
    figure(study, tmp_path / "several.png")


def test_pictures_of_every_kind(way: Plan, stopped: Plan, tmp_path: Path) -> None:
    from matplotlib.image import imread

    heights = []
    for name, plan in (("way", way), ("none", stopped)):
        figure(plan, tmp_path / f"{name}.png")
        heights.append(imread(tmp_path / f"{name}.png").shape[0])
    assert heights[0] > heights[1]  # by the panels of the margins


def test_cone_marks_its_edge_and_its_worst_direction(tmp_path: Path) -> None:
    cone = trivet.cone("azulay", math.radians(8), step=math.radians(4), rolls=24, proof=False)
    traces, layout, _ = page(cone, tmp_path / "cone.html")
    worst = next(trace for trace in traces if trace.get("name", "").startswith("worst"))
    np.testing.assert_allclose(numbers(worst["r"]), [8.0])
    assert "up to 8°" in layout["title"]["text"]
    figure(cone, tmp_path / "cone.png")


def test_sticks_end_at_the_platform(way: Plan) -> None:
    assert way.along is not None
    *chains, platform = sticks(way.machine, some(frames_of(way.along.touch, way.rules.radius), 3), way.rules.signs)
    np.testing.assert_allclose(sorted(map(tuple, platform[:-1])), sorted(tuple(chain[-1]) for chain in chains))
    np.testing.assert_array_equal(platform[0], platform[-1])
