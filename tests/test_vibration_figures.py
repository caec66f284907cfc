"""Figures of vibration: what they show is where the numbers say, pages need no network and hold no NaN."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import time
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import opened

import trivet
from trivet.errors import InputError
from trivet.show import dynamic_comparison
from trivet.show.mode_picture import MOST, PANEL
from trivet.show.mode_shapes import LARGEST, Moving, MovingScene, _bent, captions, moving_scene
from trivet.show.response import marks, panels, title
from trivet.statics.assembly import PLATFORM
from trivet.study.dynamic_comparison import DynamicComparison
from trivet.study.mode_summary import aligned
from trivet.study.response_summary import ShownResponse
from trivet.study.whole_comparison import WholeComparison

MACHINES = ("azulay", "alizade", "gough-stewart", "rmmt")


@cache
def report(name: str) -> trivet.ModesReport:
    return aligned(trivet.modes(name, count=4))


@cache
def seen(name: str) -> MovingScene:
    return moving_scene(report(name))


@cache
def response(loss_factor: float = 0.02) -> trivet.FrequencyResponse:
    return trivet.frf("azulay", high=1000.0, points=300, loss_factor=loss_factor)


@cache
def compared() -> DynamicComparison:
    return trivet.compare_dynamics("azulay", "alizade", sensitivity=["balls free", "drives rigid"])


def factors(name: str) -> np.ndarray:
    """Scale of every mode in the drawing: of the platform's plate, which is rigid, against its twist."""
    own, (plate,) = report(name), [body for body in seen(name).bodies if body.shape.name == "platform"]
    arms = plate.shape.rings - np.array(own.at.position)
    twist = own.modes.displacements[PLATFORM]
    expected = twist[:3] + np.cross(twist[3:], arms[..., None], axisa=0, axisb=2, axisc=2)
    found: np.ndarray = np.einsum("rcim,rcim->m", plate.moves, expected) / np.einsum("rcim,rcim->m", expected, expected)
    np.testing.assert_allclose(plate.moves, expected * found, atol=1e-12)
    return found


def ends(body: Moving) -> np.ndarray:
    """(2, 3, m): how the middles of the first and of the last ring move."""
    moved: np.ndarray = body.moves.mean(axis=1)[[0, -1]]
    return moved


@pytest.mark.parametrize("name", MACHINES)
def test_the_largest_displacement_is_a_tenth_of_the_size(name: str) -> None:
    found = seen(name)
    most = np.max([np.linalg.norm(body.moves, axis=2).max(axis=(0, 1)) for body in found.bodies], axis=0)
    np.testing.assert_allclose(most, LARGEST * found.size)
    assert 0.1 < found.size < 1.0


@pytest.mark.parametrize("name", MACHINES)
def test_chains_hang_together_while_they_move(name: str) -> None:
    """The far end of every chain's last link goes where the platform goes, as far as the ball there lets it."""
    own, scale = report(name), factors(name)
    for leg in own.at.machine.legs:
        links = [b for b in seen(name).bodies if b.shape.role == "link" and b.shape.name.startswith(f"{leg.name}.")]
        at = np.array([float(c) for c in own.at.frame.shift(leg.platform_frame().origin).origin])
        last = min(links, key=lambda b: np.linalg.norm(b.shape.rings[-1].mean(axis=0) - at))
        assert np.linalg.norm(last.shape.rings[-1].mean(axis=0) - at) < 1e-9
        twist = own.modes.displacements[PLATFORM]
        platform = twist[:3] + np.cross(twist[3:], at - np.array(own.at.position), axisa=0, axisc=0)
        np.testing.assert_allclose(ends(last)[1], platform * scale, atol=1e-6 * seen(name).size)


def test_beams_go_through_their_nodes() -> None:
    own, scale = report("azulay"), factors("azulay")
    structure = own.modes.mesh.structure
    pieces = [beam for beam in structure.beams if beam.name == "leg-2.link"]
    nodes = [pieces[0].first, *(beam.second for beam in pieces)]
    (link,) = [b for b in seen("azulay").bodies if b.shape.name == "leg-2.link" and b.shape.role == "link"]
    middles, moves = link.shape.rings.mean(axis=1), link.moves.mean(axis=1)
    for node in nodes:
        nearest = int(np.argmin(np.linalg.norm(middles - structure.nodes[node], axis=1)))
        assert np.linalg.norm(middles[nearest] - structure.nodes[node]) < 1e-9
        np.testing.assert_allclose(moves[nearest], own.modes.displacements[node, :3] * scale, atol=1e-12)
    straight = (moves[:1] + moves[-1:]) / 2
    assert np.abs(moves[len(moves) // 2] - straight).max() > 0.05 * LARGEST * seen("azulay").size, "it bends"


def test_bending_between_nodes_is_cubic() -> None:
    """Of a clamped beam with a load at its end two nodes tell all: v = x^2 (3 L - x); what is axial stays linear."""
    length = 0.3
    ends_of_it = np.array([(0.1, 0.0, 0.0), (0.1 + length, 0.0, 0.0)])
    twists = np.zeros((2, 6, 1))
    twists[1, :, 0] = (0.5, 2 * length**3, 0.0, 0.0, 0.0, 3 * length**2)
    for low, high in ((0.0, 1.0), (0.25, 0.5)):
        places, moved = _bent(ends_of_it, twists, low, high)
        x = places[:, 0] - 0.1
        assert x[[0, -1]] == pytest.approx([low * length, high * length])
        inside = np.isclose((x / length * 16) % 1, 0) | np.isclose((x / length * 16) % 1, 1)
        assert inside.sum() >= 5
        np.testing.assert_allclose(moved[inside, 1, 0], (x**2 * (3 * length - x))[inside], atol=1e-15)
        np.testing.assert_allclose(moved[:, 0, 0], 0.5 * x / length, atol=1e-15)


def test_telescopes_stay_on_their_feet() -> None:
    found, own = seen("gough-stewart"), report("gough-stewart")
    scale = factors("gough-stewart")
    for name in ("left-1.strut", "right-3.strut"):
        (barrel,) = [b for b in found.bodies if b.shape.name == name and b.shape.role.endswith("joint")]
        tie = next(tie for tie in own.modes.mesh.structure.connections if tie.name == name)
        np.testing.assert_allclose(ends(barrel)[0], own.modes.displacements[tie.first, :3] * scale, atol=1e-12)
        (rod,) = [b for b in found.bodies if b.shape.name == name and b.shape.role == "link"]
        assert len(barrel.shape.rings) > 10
        assert np.linalg.norm(rod.shape.rings[0].mean(axis=0) - barrel.shape.rings[0].mean(axis=0)) > 0.05


def test_what_stands_on_the_ground_stays() -> None:
    names = {shape.name for shape in seen("azulay").rest}
    assert {"leg-1.guide", "{O} x", "{O} y", "{O} z"} <= names
    assert not any(name.startswith("{E}") or name == "workpiece" for name in names)
    moving = {body.shape.name for body in seen("azulay").bodies}
    assert {"platform", "leg-1.link", "leg-1.slide", "leg-3.ball"} <= moving


def test_captions_say_what_moves() -> None:
    first, parts = next(captions(seen("azulay")))
    assert first == "1: 455.6 Hz, platform: x"
    assert parts.replace("\u00a0", " ") == "yielding: leg-1.slide 47 %, leg-2.slide 13 %, leg-3.slide 13 %"
    assert seen("azulay").title[1].startswith("mode ++ ++ ++")


def test_picture_of_modes(tmp_path: Path) -> None:
    from matplotlib.image import imread

    trivet.figure(report("azulay"), tmp_path / "m.png")
    picture = imread(tmp_path / "m.png")
    assert picture.shape[1] == 3 * PANEL[0]
    assert MOST == 6
    # Colours of the scale, dark blue to yellow, in every one of the four panels; nothing of them in the empty two.
    strength = picture[..., :3].max(axis=2) - picture[..., :3].min(axis=2)
    panels_of_it = [
        strength[150 + row * PANEL[1] : 150 + (row + 1) * PANEL[1], column * PANEL[0] : (column + 1) * PANEL[0]]
        for row, column in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1))
    ]
    shares = [(panel > 0.4).mean() for panel in panels_of_it]
    assert min(shares[:4]) > 0.02
    assert shares[4] == 0


def page_data(text: str) -> Any:
    """The figure in a page of modes."""
    found = re.search(r"^const figure = (.*);$", text, re.MULTILINE)
    assert found
    return json.loads(found.group(1), parse_constant=lambda word: pytest.fail(f"{word} in the page"))


def needs_no_network(text: str) -> bool:
    return not re.search(r"<(script|link|img|iframe)[^>]*(src|href)\s*=", text)


def test_page_of_modes(tmp_path: Path) -> None:
    trivet.figure(report("azulay"), tmp_path / "m.html")
    text = (tmp_path / "m.html").read_text(encoding="utf-8")
    assert needs_no_network(text)
    assert len(text) > 1_000_000
    data = page_data(text)["data"]
    ways = json.loads(re.search(r"^const modes = (.*);  //", text, re.MULTILINE).group(1), parse_constant=pytest.fail)
    number, shadow = (int(n) for n in re.search(r"const moving = (\d+), shadow = (\d+);", text).groups())
    assert len(ways) == text.count("<option>") == 4
    assert "<option>3: 512.1 Hz, platform: z</option>" in text
    moving = data[number]
    assert moving["x"] == data[shadow]["x"]
    assert max(moving["i"]) < len(moving["x"])
    for k, way in enumerate(ways):
        assert len(way["x"]) == len(way["size"]) == len(moving["x"])
        size = np.linalg.norm([way["x"], way["y"], way["z"]], axis=0)
        assert size.max() == pytest.approx(1e3 * LARGEST * seen("azulay").size, abs=2e-3)
        assert (max(way["size"]), min(way["size"]) >= 0) == (1.0, True)
        assert way["parts"].startswith("yielding: ")
        assert k < 2 or np.std(way["z"]) > 0


@pytest.mark.peer("chromium", program="chromium")
def test_modes_move_in_a_browser(tmp_path: Path) -> None:
    """The page draws itself without a network, moves, stops when it is told to, and shows another mode."""
    trivet.figure(report("azulay"), tmp_path / "m.html")
    with opened(tmp_path / "m.html", tmp_path / "profile") as page:
        while not page.evaluate("typeof byId !== 'undefined' && byId('parts').textContent"):
            time.sleep(0.1)
        look = """(async () => {
          const seen = new Set();
          for (let k = 0; k < COUNT; k++) {
            await new Promise((done) => setTimeout(done, 150));
            seen.add(view.data[moving].x.reduce((sum, x) => sum + x, 0));
          }
          return seen.size;
        })()"""
        assert page.evaluate(look.replace("COUNT", "12")) >= 3
        page.evaluate("byId('play').click()")
        assert page.evaluate("byId('play').textContent") == "play"
        page.evaluate("new Promise((done) => setTimeout(done, 500))")
        assert page.evaluate(look.replace("COUNT", "5")) == 1
        page.evaluate("byId('mode').selectedIndex = 2; byId('mode').dispatchEvent(new Event('change')); 0")
        page.evaluate("new Promise((done) => setTimeout(done, 500))")
        rise = page.evaluate("Math.max(...view.data[moving].z.map((z, k) => z - home.z[k]))")
        assert rise == pytest.approx(1e3 * LARGEST * seen("azulay").size, rel=0.1), "the third mode goes along z"
        assert "slide" in page.evaluate("byId('parts').textContent")


def test_minima_are_marked_where_they_are() -> None:
    shown = ShownResponse(response(), entries=("xx", "yy", "zz", "rz_rz"))
    found = panels(shown)
    assert list(found) == ["µm/N", "µrad/(N m)"]
    linear = marks(shown, found["µm/N"])
    assert [mark.text for mark in linear] == ["xx, yy: 0.1144 N/µm at 455.5 Hz", "zz: 0.1110 N/µm at 512.1 Hz"]
    for mark, minimum in zip(linear, (response().minima[0], response().minima[2]), strict=True):
        assert mark.frequency == minimum.frequency
        assert mark.magnitude == pytest.approx(1e6 / minimum.stiffness, rel=0.01)
    (turning,) = marks(shown, found["µrad/(N m)"])
    assert turning.text == "rz_rz: 1461 N m/rad at 683.0 Hz"
    assert [curve.is_hidden for curve in found["µm/N"]] == [False, True, False]
    np.testing.assert_allclose(found["µm/N"][2].magnitude, 1e6 * np.abs(response().receptance[:, 2, 2]))


def test_title_says_machine_pose_and_damping() -> None:
    lines = title(ShownResponse(response(), "accelerance"))
    assert lines[0].startswith("azulay: ")
    assert "z 125 mm" in lines[1]
    assert lines[2] == "accelerance at platform; structural damping, loss factor 0.02; exact"


def test_phase_has_no_lines_across() -> None:
    turning = np.exp(1j * np.linspace(0, 20, len(response().frequency)))[:, None, None] * np.ones((6, 6))
    (curve,) = panels(ShownResponse(dataclasses.replace(response(), receptance=turning), entries=("xx",)))["µm/N"]
    assert np.isnan(curve.phase).sum() == 3, "a gap at every jump of 20 rad"
    known = np.isfinite(curve.phase)
    np.testing.assert_allclose(curve.phase[known], np.degrees(np.angle(turning[known, 0, 0])))
    steps = np.diff(curve.phase)
    assert np.all(np.abs(steps[np.isfinite(steps)]) <= 180)


def test_without_damping_resonances_are_left_out() -> None:
    shown = ShownResponse(response(0.0))
    (curves,) = panels(shown).values()
    assert np.nanmax(curves[0].magnitude) < 1e3
    gaps = response(0.0).frequency[np.isnan(curves[0].magnitude)]
    assert np.all(np.abs(gaps[:, None] / response(0.0).natural - 1).min(axis=1) < 1e-4)
    assert marks(shown, curves) == []


def numbers(node: Any) -> list[np.ndarray]:
    """All arrays of a plotly figure, also those which it has packed."""
    if isinstance(node, dict):
        if "bdata" in node:
            return [np.frombuffer(base64.b64decode(node["bdata"]), dtype=np.dtype(node["dtype"]).newbyteorder("<"))]
        return [array for value in node.values() for array in numbers(value)]
    if isinstance(node, list):
        return [array for value in node for array in numbers(value)]
    return []


def plots(text: str) -> list[Any]:
    """What the plots of a page are told."""
    found = []
    for match in re.finditer(r"Plotly\.newPlot\(\s*\"[^\"]+\",\s*", text):
        data, _ = json.JSONDecoder(parse_constant=pytest.fail).raw_decode(text, match.end())
        found.append(data)
    return found


@pytest.mark.parametrize("loss_factor", [0.02, 0.0])
def test_page_of_a_response(loss_factor: float, tmp_path: Path) -> None:
    trivet.figure(ShownResponse(response(loss_factor), entries=("xx", "zz", "x_ry")), tmp_path / "f.html")
    text = (tmp_path / "f.html").read_text(encoding="utf-8")
    assert needs_no_network(text)
    (data,) = plots(text)
    names = [trace["name"] for trace in data]
    assert {"xx", "zz", "x_ry", "natural frequencies"} <= set(names)
    assert ("minimum dynamic stiffness" in names) == (loss_factor > 0)
    assert all(np.all(np.isfinite(array)) for array in numbers(data))
    ticks = next(trace for trace in data if trace["name"] == "natural frequencies")
    assert len(ticks["text"]) == len(response(loss_factor).natural)
    assert ticks["text"][2] == "mode 3: 512.06 Hz"


def test_picture_of_a_response(tmp_path: Path) -> None:
    from matplotlib.image import imread

    trivet.figure(response(), tmp_path / "f.png")
    picture = imread(tmp_path / "f.png")
    assert picture.shape[:2] == (900, 1200)
    picture = picture[160:600]  # magnitudes
    green = (picture[..., 1] > picture[..., 0] + 0.3) & (picture[..., 1] > picture[..., 2] + 0.1)
    assert 0.001 < green.mean() < 0.05  # zz


def test_picture_of_a_dynamic_comparison(tmp_path: Path) -> None:
    from matplotlib.figure import Figure

    found: Any = Figure()
    dynamic_comparison.plot(found, compared())
    for axes, axis in zip(found.axes, "xyz", strict=True):
        assert axes.get_xscale() == "log"
        circles = [line for line in axes.lines if line.get_label() == "as described"]
        own = [line.get_xdata()[0] for line in circles]
        assert own == pytest.approx([compared().of(name).along(axis).stiffness / 1e6 for name in ("azulay", "alizade")])
        low, high = axes.get_xlim()
        shown = [x for line in axes.lines for x in line.get_xdata()]
        shown += [x for bar in axes.patches for x in (bar.get_x(), bar.get_x() + bar.get_width())]
        assert low < min(shown) <= max(shown) < high
    labels = [text.get_text() for text in found.legends[0].get_texts()]
    assert labels == ["variants", "as described", "published"]


def test_pages_of_comparisons(tmp_path: Path) -> None:
    trivet.figure(compared(), tmp_path / "d.html")
    static = trivet.compare("azulay", "alizade", steps=2, finer=1)
    trivet.figure(WholeComparison(static, compared()), tmp_path / "w.html")
    trivet.figure(WholeComparison(static, None, "no home"), tmp_path / "s.html")
    for name, count in (("d", 1), ("w", 2), ("s", 1)):
        text = (tmp_path / f"{name}.html").read_text(encoding="utf-8")
        assert needs_no_network(text)
        found = plots(text)
        assert len(found) == count
        assert all(np.all(np.isfinite(array)) for data in found for array in numbers(data))
        assert text.count("plotly.js v") == 1, "the program is in it once"


def test_both_halves_in_one_picture(tmp_path: Path) -> None:
    from matplotlib.image import imread

    static = trivet.compare("azulay", "alizade", steps=2, finer=1)
    trivet.figure(static, tmp_path / "s.png")
    trivet.figure(WholeComparison(static, compared()), tmp_path / "w.png")
    alone, both = imread(tmp_path / "s.png"), imread(tmp_path / "w.png")
    assert both.shape[1] == alone.shape[1]
    assert both.shape[0] == alone.shape[0] + round(100 * dynamic_comparison.height(compared()))


def test_what_cannot_be_written(tmp_path: Path) -> None:
    for result in (report("azulay"), response(), compared()):
        with pytest.raises(InputError, match=r"\.png or \.html"):
            trivet.figure(result, tmp_path / "m.svg")
        (tmp_path / "m.png").write_text("mine")
        with pytest.raises(InputError, match="exists already"):
            trivet.figure(result, tmp_path / "m.png")
        assert (tmp_path / "m.png").read_text() == "mine"
