"""Figures of plans: what is on them, as Matplotlib and plotly were told it."""

from __future__ import annotations

import json
import math
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import opened

import trivet
from trivet.reach.margins import side
from trivet.show.cone import disc_of
from trivet.show.figure import figure
from trivet.show.plan import headings, map_of, marks, panels, places, value_label
from trivet.show.plan_motion import MOST_FRAMES, samples_of, standing
from trivet.show.sticks import sticks
from trivet.study.aims import read_aims
from trivet.study.pathfile import read_path
from trivet.study.plan import Plan, plan_along, plans
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


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that Matplotlib has written."""
    from matplotlib.figure import Figure

    found: list[Any] = []
    save = Figure.savefig

    def kept(self: Any, *arguments: Any, **options: Any) -> None:
        save(self, *arguments, **options)
        found.append(self)

    monkeypatch.setattr(Figure, "savefig", kept)
    return found


def words(axes: Any) -> list[str]:
    """What a legend lists."""
    return [text.get_text() for text in axes.get_legend().get_texts()]


def is_outside(legend: Any, axes: Any) -> bool:
    """Whether a legend covers nothing of what is drawn within axes, and lies on the page."""
    own, page = legend.get_window_extent(), axes.figure.bbox
    inside = page.x0 <= own.x0 and own.x1 <= page.x1 and page.y0 <= own.y0 and own.y1 <= page.y1
    return inside and not own.overlaps(axes.get_window_extent())


PATH = """
format = 1
[[poses]]
position = ["0 mm", "0 mm", "114 mm"]
[[poses]]
position = ["0 mm", "0 mm", "114 mm"]
azimuth = "30 deg"
tilt = "25 deg"
[[poses]]
position = ["3 mm", "2 mm", "112 mm"]
azimuth = "60 deg"
tilt = "25 deg"
"""


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
    assert found["sigma_min"].bound == way.proof.demand.sigma_min
    np.testing.assert_allclose(found["clearance"].values, 1e3 * way.along.clearance)
    np.testing.assert_allclose(found["travel left"].values, 100 * way.along.travel)
    assert [panel.said for panel in found.values()] == ["proven", "end of travel", "touching"]


def test_worst_place_is_where_the_value_is_least() -> None:
    aims = ("sigma_min=0.1", "K_xx=5 N/um")
    plan = trivet.plan("azulay", 0.004, 0.110, mode="++ ++ -+", aims=aims, step=STEP, rolls=ROLLS, proof=False)
    value = next(panel for panel in panels(plan) if panel.label == "value, –").values
    assert 0 < places(plan)["worst"] == value.argmin() < len(value) - 1


def test_joints_without_limits_have_no_panel() -> None:
    plan = trivet.plan("glozman", 0.004, 0.168, mode="++ -- +-", step=STEP, rolls=ROLLS, proof=False)
    assert [panel.label.split(",")[0] for panel in panels(plan)] == ["sigma_min", "clearance"]


@pytest.mark.parametrize(
    ("aims", "label"),
    [
        (("sigma_min",), "sigma_min here, –"),
        (("K_xx",), "K_xx here, N/m"),
        (("K_rx",), "K_rx here, N m/rad"),
        (("sigma_min=0.1", "K_xx=5 N/um"), "the least here of sigma_min / 0.1, K_xx / (5 N/µm)"),
    ],
)
def test_values_have_units(way: Plan, aims: tuple[str, ...], label: str) -> None:
    assert value_label(way.rules._replace(aims=read_aims(aims)), " here") == label


def test_page_of_a_way_moves_the_machine_along_it(way: Plan, tmp_path: Path) -> None:
    traces, layout, frames = page(way, tmp_path / "way.html")
    assert way.along is not None
    names = [trace.get("name") for trace in traces]
    for name in ("Type 2 singularity (det J_x = 0)", "not allowed", "way", "start", "end", "worst", "sphere", "guide"):
        assert name in names
    for label in ("sigma_min, –", "travel left, % of half", "clearance, mm"):
        assert label in names
    assert {a["text"] for a in layout["annotations"]} == {"proven", "end of travel", "touching"}
    assert "proven" in layout["title"]["text"]
    assert 1 < len(frames) == len(layout["sliders"][0]["steps"]) <= MOST_FRAMES
    assert (tmp_path / "way.html").stat().st_size < 8e6
    for k, frame in zip(samples_of(way), frames, strict=True):
        own = {names[number]: data for number, data in zip(frame["traces"], frame["data"], strict=True) if names[number]}
        pose = some(frames_of(way.along.touch, way.rules.radius), k)
        corners = np.stack([numbers(own["platform"][axis]) for axis in "xyz"], axis=-1)
        np.testing.assert_allclose(corners[-2:].mean(axis=0), 1e3 * np.array([float(c) for c in pose.origin]), atol=1e-3)
        thickness = 1e3 * float(way.machine.platform.disc.thickness)  # type: ignore[union-attr]
        np.testing.assert_allclose(corners[-1] - corners[-2], thickness * np.array(pose.matrix(), dtype=float)[:, 2], atol=1e-3)
        dots = [data for data in frame["data"] if data["type"] == "scatter"]
        np.testing.assert_allclose([numbers(dot["x"])[0] for dot in dots], marks(way)[k])
        np.testing.assert_allclose(numbers(dots[0]["y"]), headings(way)[k])
        np.testing.assert_allclose(numbers(dots[-1]["y"]), 1e3 * way.along.clearance[k])


def test_bodies_that_stand_still_are_drawn_once(way: Plan) -> None:
    bodies = standing(way, samples_of(way)[:5])
    still = {own[0].role for own in bodies.values() if len(own) == 1}
    assert still == {"guide"}
    assert {own[0].role for own in bodies.values() if len(own) == 5} >= {"link", "platform", "actuated joint", "passive joint"}
    assert {len(own) for own in bodies.values()} == {1, 5}


@pytest.mark.peer("chromium", program="chromium")
def test_the_machine_moves_in_a_browser(way: Plan, tmp_path: Path) -> None:
    figure(way, tmp_path / "way.html")
    with opened(tmp_path / "way.html", tmp_path / "profile") as browser:
        while not browser.evaluate("!!document.querySelector('.plotly-graph-div .slider-group')"):
            time.sleep(0.1)
        last = len(samples_of(way)) - 1
        graph = "document.querySelector('.plotly-graph-div')"
        now = "{frame: {duration: 0, redraw: true}, mode: 'immediate'}"
        find = f"const z = {graph}._fullData.find((trace) => trace.name == 'platform').z"
        look = f"(() => {{ {find}; return z.reduce((sum, own) => sum + own) / z.length; }})()"
        low = browser.evaluate(look)
        browser.evaluate(f"Plotly.animate({graph}, ['{last}'], {now}).then(() => 0)")
        assert way.along is not None
        poses = frames_of(way.along.touch, way.rules.radius)
        for height, k in ((low, 0), (browser.evaluate(look), -1)):
            assert height == pytest.approx(1e3 * float(np.array(poses.origin[2])[k]), abs=1e-3)


def test_page_without_a_way_has_the_map_only(stopped: Plan, tmp_path: Path) -> None:
    traces, layout, frames = page(stopped, tmp_path / "none.html")
    assert not frames
    assert "sliders" not in layout
    assert {trace["type"] for trace in traces} == {"heatmap", "scatter", "contour"}
    assert [trace["name"] for trace in traces if trace.get("name")] == ["not allowed", "Type 2 singularity (det J_x = 0)"]
    assert layout["title"]["text"].endswith("no way")


def test_several_plans_are_lines_of_their_own_looks(tmp_path: Path, drawn: list[Any]) -> None:
    study = plans(["azulay"], (0.108, 0.110, 0.121), ("++ ++ -+",), radius=0.004, step=STEP, rolls=ROLLS, proof=False)
    traces, layout, _ = page(study, tmp_path / "several.html")
    possible = [plan for plan in study.plans if plan.is_possible]
    lines, worst = ([trace for trace in traces if trace["mode"] == mode] for mode in ("lines", "markers"))
    assert 1 < len(possible) == len(lines) == len(worst)
    for look in ("color", "dash"):
        assert len({trace["line"][look] for trace in lines}) == len(lines)
    np.testing.assert_allclose([numbers(trace["y"])[0] for trace in worst], [plan.value for plan in possible])
    assert layout["title"]["text"].startswith(f"{len(possible)} of 3 cases")
    assert layout["yaxis"]["title"]["text"] == "sigma_min along the way, –"
    figure(study, tmp_path / "several.png")
    (axes,) = drawn[0].axes
    solid = [line for line in axes.lines if line.get_linestyle() != "None"]
    assert (
        len({line.get_color() for line in solid}) == len({str(line._unscaled_dash_pattern) for line in solid}) == len(possible)
    )
    assert is_outside(axes.get_legend(), axes)


def test_picture_of_a_way_has_its_map_and_a_panel_per_margin(way: Plan, tmp_path: Path, drawn: list[Any]) -> None:
    figure(way, tmp_path / "way.png")
    seen, *margins, scale = drawn[0].axes
    assert [axes.get_ylabel() for axes in margins] == ["sigma_min, –", "travel left,\n% of half", "clearance,\nmm"]
    assert scale.get_ylabel() == "sigma_min, –"
    assert margins[-1].get_xlabel() == "tilt, °"
    assert words(seen) == ["not allowed", "Type 2 singularity (det J_x = 0)", "way", "start", "end", "worst"]
    assert is_outside(seen.get_legend(), seen)
    assert way.along is not None
    for axes, least in zip(margins, (way.sigma_min, 1e2 * way.travel, 1e3 * way.clearance), strict=True):
        assert f"least\n{least:.3g}" in [text.get_text() for text in axes.texts]
        assert axes.get_xlim() == seen.get_xlim() == (0, 90)


def test_picture_without_a_way_has_the_map_only(stopped: Plan, tmp_path: Path, drawn: list[Any]) -> None:
    figure(stopped, tmp_path / "none.png")
    seen, _ = drawn[0].axes
    assert words(seen) == ["not allowed", "Type 2 singularity (det J_x = 0)"]
    assert is_outside(seen.get_legend(), seen)
    # The curve lies where the command says that the side changes.
    curve = np.concatenate([path.vertices for path in seen.collections[-1].get_paths()])
    assert 30 < curve[:, 0].min() < curve[:, 0].max() < 38


def test_path_is_told_by_its_poses_and_has_no_sphere(tmp_path: Path, drawn: list[Any]) -> None:
    (tmp_path / "path.toml").write_text(PATH, encoding="utf-8")
    path = plan_along("azulay", read_path(tmp_path / "path.toml"), mode="++ ++ -+", step=STEP, rolls=ROLLS, proof=False)
    traces, layout, frames = page(path, tmp_path / "path.html")
    assert frames
    assert "sphere" not in [trace.get("name") for trace in traces]
    labels = [step["label"] for step in layout["sliders"][0]["steps"]]
    assert labels[0].startswith("pose 1 of 3: tilt 0 deg")
    assert labels[-1].startswith("pose 3 of 3: tilt 25 deg")
    assert "3 poses" in layout["title"]["text"]
    figure(path, tmp_path / "path.png")
    assert drawn[0].axes[-2].get_xlabel() == "pose"
    assert all(tick == round(tick) for tick in drawn[0].axes[-2].get_xticks())


def test_cone_marks_its_edge_and_its_worst_direction(tmp_path: Path, drawn: list[Any]) -> None:
    cone = trivet.cone("azulay", math.radians(8), step=math.radians(4), rolls=24, proof=False)
    traces, layout, _ = page(cone, tmp_path / "cone.html")
    found = {trace["name"]: trace for trace in traces}
    assert cone.samples is not None
    worst = found[f"worst, {cone.samples.value.min():.3g}"]
    np.testing.assert_allclose(np.hypot(numbers(worst["x"]), numbers(worst["y"])), [8.0])
    edge = found["edge of the cone"]
    np.testing.assert_allclose(np.hypot(numbers(edge["x"]), numbers(edge["y"])), 8.0)
    assert found["value"]["colorbar"]["title"]["text"] == "sigma_min, –"
    assert [a["text"] for a in layout["annotations"]] == ["azimuth 0°", "90°", "180°", "270°"]
    assert "up to 8°" in layout["title"]["text"]
    figure(cone, tmp_path / "cone.png")
    seen, scale = drawn[0].axes
    assert scale.get_ylabel() == "sigma_min, –"
    (legend,) = drawn[0].legends
    assert [text.get_text() for text in legend.get_texts()][:2] == ["edge of the cone", "level"]
    assert is_outside(legend, seen)
    assert not legend.get_window_extent().overlaps(seen.get_tightbbox())


def test_cone_is_worked_out_where_it_is_drawn() -> None:
    cone = trivet.cone("azulay", math.radians(8), step=math.radians(4), rolls=24, proof=False)
    disc = disc_of(cone)
    assert cone.samples is not None
    assert disc.least == cone.samples.value.min()
    tilt, azimuth = np.degrees(cone.samples.touch.tilt), cone.samples.touch.azimuth
    places = np.stack([tilt * np.cos(azimuth), tilt * np.sin(azimuth)], axis=-1)
    column, row = (np.abs(disc.across - own[:, None]).argmin(axis=1) for own in places.T)
    np.testing.assert_allclose(disc.value[row, column], cone.samples.value, atol=3e-3)  # half a pixel off
    assert disc.value[disc.inside].max() - disc.least > 0.1
    starts, tips = disc.arrows[:, 0], disc.arrows[:, 1]
    nearest = np.linalg.norm((starts + tips)[:, None] / 2 - places, axis=-1).argmin(axis=1)
    heading = (azimuth + cone.samples.touch.roll)[nearest]
    own = (tips - starts) / np.linalg.norm(tips - starts, axis=1)[:, None]
    assert np.all(np.sum(own * np.stack([np.cos(heading), np.sin(heading)], axis=-1), axis=1) > 0.95)


def test_sticks_end_at_the_platform(way: Plan) -> None:
    assert way.along is not None
    pose = some(frames_of(way.along.touch, way.rules.radius), 3)
    *chains, platform = sticks(way.machine, pose, way.rules.signs)
    centre = 1e3 * np.array([float(c) for c in pose.origin])
    np.testing.assert_allclose([np.linalg.norm(chain[-1] - centre) for chain in chains], 18.0)
    np.testing.assert_allclose(sorted(map(tuple, platform[:-1])), sorted(tuple(chain[-1]) for chain in chains))
    np.testing.assert_array_equal(platform[0], platform[-1])
