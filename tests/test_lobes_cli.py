"""The command lobes: output, JSON, NetCDF, figures, wrong input."""

from __future__ import annotations

import json
import math
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trivet as t
from trivet.show import lobes as drawn
from trivet.study.lobes import RPM, LobesAlong, deepest_first
from trivet.study.pathfile import PathFile, PathPose
from trivet.views.lobes import cut_words

FEW = ("--points", "60", "--highest", "1 kHz")
CUT = ("--diameter", "16 mm", "--teeth", "4", "--radial-depth", "4 mm", "--side", "down", "--material", "aluminium-7075-t6")
TOUR = """
[[poses]]
position = ["0 mm", "0 mm", "125 mm"]

[[poses]]
position = ["5 mm", "0 mm", "125 mm"]
azimuth = "20 deg"
tilt = "15 deg"
"""


def cut(radial: float = 0.004) -> t.Cut:
    return t.Cut.of(0.016, 4, radial, "down", material="aluminium-7075-t6")


@cache
def tilted() -> t.Lobes:
    return t.lobes("azulay", tilt=0.3, cut=cut(), feed=0.2, points=60, highest=1000.0)


@cache
def tour() -> LobesAlong:
    poses = [PathPose((0.0, 0.0, 0.125)), PathPose((0.005, 0.0, 0.125), math.radians(20), math.radians(15))]
    return t.lobes_along("azulay", PathFile(poses), cut=cut(), points=60, highest=1000.0)


def rows(out: str, title: str) -> list[list[str]]:
    """Cells of the table under a title."""
    (body,) = re.findall(rf"^{title} *\n.*\n((?:.+\n)+)", out, re.MULTILINE)
    return [line.split() for line in body.splitlines()]


def test_lobes_as_tables(trivet: Any) -> None:
    code, out, _ = trivet("lobes", "azulay", *CUT, *FEW, "--tilt", "0.3 rad", "--feed", "0.2 rad", "--check", "2")
    one = tilted()
    assert code == 0
    assert "4 teeth, 16 mm, down milling from 120° to 180°, K_t 767.01 N/mm², K_r 0.2201" in out
    place = "at the platform centre (no platform.tool_tip is given), tool against z_E"
    assert f"{place}, feed 11.4592° from the direction of growing tilt" in out
    assert f"stable at every spindle speed: up to {one.lowest_depth * 1e3:.4f} mm; deeper cuts chatter at" in out
    best = one.pockets[0]
    assert rows(out, "between lobes, the deepest first")[0] == [
        f"{one.speeds[best] / RPM:.1f}",
        f"{one.depth[best] * 1e3:.4f}",
        f"{one.limits.frequency[best]:.1f}",
        f"{4 * one.speeds[best] / (2 * math.pi):.1f}",
        str(one.limits.waves[best]),
    ]
    assert len(rows(out, "over the range")) == 10
    checked = rows(out, "lobes beside semi-discretisation")
    assert [row[0] for row in checked] == [f"{row.speed / RPM:.1f}" for row in one.check(2)]
    assert all(abs(float(row[3])) < 12 for row in checked)
    assert "double the period" not in out


def test_a_little_cut_is_warned_of(trivet: Any) -> None:
    cutting = ("--diameter", "16 mm", "--teeth", "2", "--radial-depth", "1 mm", "--side", "up", *CUT[-2:])
    _, out, _ = trivet("lobes", "azulay", *cutting, *FEW)
    assert "less than half a tooth is in the material, in the mean: the lobes leave out such as double the period; try" in out


def test_lobes_as_json(trivet: Any) -> None:
    out = trivet("lobes", "azulay", *CUT, *FEW, "--tilt", "0.3 rad", "--feed", "0.2 rad", "--check", "1", "--json")[1]
    found, one = json.loads(out), tilted()
    np.testing.assert_allclose(found["depth_m"], one.depth, rtol=1e-9)
    np.testing.assert_allclose(found["spindle_speed_rad_per_s"], np.linspace(2000, 20000, 60) * math.pi / 30, rtol=1e-12)
    np.testing.assert_allclose(found["chatter_frequency_Hz"], one.limits.frequency, rtol=1e-9)
    assert found["whole_waves"] == one.limits.waves.tolist()
    assert found["lowest_depth_m"] == pytest.approx(one.lowest_depth)
    assert (found["place"], found["tool_side"], found["reached"], found["tilt_rad"]) == ("platform", -1, True, 0.3)
    assert found["cut"] == {
        "diameter_m": 0.016, "teeth": 4, "entry_rad": pytest.approx(2 * math.pi / 3), "exit_rad": pytest.approx(math.pi),
        "tangential_Pa": pytest.approx(767.01e6), "radial_ratio": pytest.approx(168.8 / 767.01),
    }  # fmt: skip
    (checked,) = found["check"]
    assert checked["semi_discretisation_depth_m"] == pytest.approx(one.check(1)[0].semi_discretisation, rel=1e-9)
    assert [pocket["depth_m"] for pocket in found["pockets"]] == pytest.approx(one.depth[one.pockets].tolist())


def test_a_path_as_tables_and_json(trivet: Any, tmp_path: Path) -> None:
    (tmp_path / "tour.toml").write_text(TOUR)
    options = ("lobes", "azulay", *CUT, *FEW, "--path", "tour.toml")
    code, out, _ = trivet(*options)
    along = tour()
    assert code == 0
    assert f"pose {along.worst + 1} is the worst; there stable at every spindle speed" in out
    table = rows(out, "pose by pose")
    assert [row[7] for row in table] == [f"{one.lowest_depth * 1e3:.4f}" for one in along.poses]
    assert table[1][1:7] == ["5.000", "0.000", "125.000", "20.000", "15.000", "0.000"]
    best = along.pockets[0]
    assert f"{along.speeds[best] / RPM:.1f}" in out
    found = json.loads(trivet(*options, "--json")[1])
    np.testing.assert_allclose([pose["depth_m"] for pose in found["poses"]], along.depth, rtol=1e-9)
    np.testing.assert_allclose(found["least_depth_m"], along.depth.min(axis=0), rtol=1e-9)
    assert found["worst_pose"] == along.worst + 1


def test_without_a_lobe_it_is_said(trivet: Any) -> None:
    """Faster than any lobe, and below all resonances: nothing to chatter at."""
    options = ("lobes", "azulay", *CUT, "--from", "300000 rpm", "--to", "400000 rpm", "--points", "20", "--highest", "100 Hz")
    code, out, _ = trivet(*options)
    assert code == 0
    assert "no lobe from 300000 to 400000 rpm: no depth is unstable there" in out
    assert "between lobes" not in out
    assert json.loads(trivet(*options, "--json")[1])["depth_m"] == [None] * 20


def test_damping_that_reaches_no_mode(trivet: Any) -> None:
    """Clamped balls do not turn, so that their damping damps nothing: by semi-discretisation no depth is stable."""
    undamped = ("--loss-factor", "0", "--set", "ball.loss_factor=0.1", "--check", "2")
    code, out, err = trivet("lobes", "azulay", *CUT, *FEW, *undamped)
    assert (code, err) == (0, "")
    assert [row[2:] for row in rows(out, "lobes beside semi-discretisation")] == [["0.0000"], ["0.0000"]]


def test_angles_instead_of_a_radial_depth(trivet: Any) -> None:
    angles = ("--diameter", "16 mm", "--teeth", "4", "--entry", "120 deg", "--exit", "180 deg", *CUT[-2:])
    found = json.loads(trivet("lobes", "azulay", *angles, *FEW, "--tilt", "0.3 rad", "--feed", "0.2 rad", "--json")[1])
    np.testing.assert_allclose(found["depth_m"], tilted().depth, rtol=1e-6)
    slot = ("--diameter", "16 mm", "--teeth", "4", "--tangential", "600 N/mm^2", "--radial-ratio", "0.33")
    found = json.loads(trivet("lobes", "azulay", *slot, *FEW, "--json")[1])
    assert (found["cut"]["entry_rad"], found["cut"]["exit_rad"]) == (0, pytest.approx(math.pi))
    assert found["cut"]["tangential_Pa"] == pytest.approx(6e8)


def test_cuts_in_words() -> None:
    assert cut_words(t.Cut(0.02, 1, 0.0, math.pi, 6e8, 0.3)).startswith("1 tooth, 20 mm, slot from 0° to 180°")
    assert "inside from 30° to 90°" in cut_words(t.Cut(0.02, 2, math.radians(30), math.radians(90), 6e8, 0.3))


def test_pockets() -> None:
    assert deepest_first(np.array([9.0, 1, 3, 1, 5, 5, 2, 8])).tolist() == [4, 2]


def test_lobes_as_netcdf(trivet: Any, tmp_path: Path) -> None:
    options = ("lobes", "azulay", *CUT, *FEW, "--tilt", "0.3 rad", "--feed", "0.2 rad", "--data", "l.nc")
    assert trivet(*options)[0] == 0
    one = tilted()
    with xr.open_dataset(tmp_path / "l.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.depth, one.depth, rtol=1e-9)
        assert data.depth.dims == ("speed",)
        assert data.spindle_speed.attrs["units"] == "rad/s"
        values = data.receptance.sel(part="real") + 1j * data.receptance.sel(part="imag")
        np.testing.assert_allclose(values, one.receptance, rtol=1e-7, atol=1e-18)
        np.testing.assert_allclose(data.plane, one.point.axes)
        assert float(data.tilt) == 0.3
        assert data.attrs["teeth"] == 4
        assert (data.attrs["place"], data.attrs["tool_side"]) == ("platform", -1)
        assert data.attrs["tangential_Pa"] == pytest.approx(767.01e6)
        assert "format = 1" in data.attrs["machine_file"]
    t.save(tour(), tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.depth, tour().depth)
        assert data.depth.dims == ("pose", "speed")
        assert data.pose.values.tolist() == [1, 2]
        np.testing.assert_allclose(data.azimuth, [0, math.radians(20)])
        np.testing.assert_allclose(data.lowest_depth, [one.lowest_depth for one in tour().poses])


def test_pictures(tmp_path: Path) -> None:
    from matplotlib import colormaps
    from matplotlib.image import imread

    for result in (tilted(), tour()):
        t.figure(result, tmp_path / "l.png", overwrite=True)
        picture = imread(tmp_path / "l.png")
        assert picture.shape[:2] == (900, 1200)
        blue = (picture[..., 2] > picture[..., 0] + 0.4) & (picture[..., 2] > picture[..., 1] + 0.15)
        assert blue[620:].mean() > 1e-3, "a line below"
    least, most = drawn.colour_range(tour())
    part = np.log(np.clip(tour().depth * 1e3, least, most) / least) / np.log(most / least)
    expected = colormaps["cividis"](part)[..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(picture[170:600, 100:1070, :3].mean(axis=(0, 1)), expected, atol=0.02)


def test_the_axis_of_depths() -> None:
    assert drawn.ceiling(np.array([1e-3, 2e-3, np.inf])) == pytest.approx(2.12)
    assert drawn.ceiling(np.array([1e-3, 50e-3])) == pytest.approx(10)
    assert drawn.ceiling(np.array([np.inf])) == 1
    assert drawn.colour_ticks(0.15, 1.2) == [0.2, 0.3, 0.5, 0.7, 1.0]


def test_pages(tmp_path: Path) -> None:
    for result, words in ((tilted(), "chatter, Hz"), (tour(), "stable depth, mm")):
        t.figure(result, tmp_path / "l.html", overwrite=True)
        text = (tmp_path / "l.html").read_text(encoding="utf-8")
        assert words in text
        assert re.search(r"<(?:script|link)[^>]+(?:src|href)=", text) is None, "needs no network"
        (start,) = (match.end() for match in re.finditer(r"Plotly\.newPlot\(\s*\"[^\"]+\",\s*", text))
        traces, _ = json.JSONDecoder(parse_constant=pytest.fail).raw_decode(text, start)
        if result is tilted():
            (limit,) = [trace for trace in traces if trace.get("name") == "limit"]
            np.testing.assert_allclose(limit["y"], tilted().depth * 1e3)
        else:
            (map_,) = [trace for trace in traces if trace["type"] == "heatmap"]
            np.testing.assert_allclose(map_["customdata"], tour().depth * 1e3)
            np.testing.assert_allclose(np.power(10, map_["z"]), tour().depth * 1e3)


LOBES = ("lobes", "azulay", *FEW)
WRONG = [
    ((*LOBES, "--diameter", "16 mm", "--teeth", "0", *CUT[-2:]), "teeth: 0; a cutter has 1 to 200 teeth"),
    ((*LOBES, "--diameter", "-16 mm", "--teeth", "4", *CUT[-2:]), "must be greater than zero"),
    ((*LOBES, "--diameter", "0 mm", "--teeth", "4", *CUT[-2:]), "must be greater than zero"),
    ((*LOBES, "--diameter", "16", "--teeth", "4", *CUT[-2:]), "the unit is missing"),
    ((*LOBES, "--diameter", "16 mm", *CUT[-2:]), "--teeth"),
    (
        (*LOBES, *CUT[:4], "--radial-depth", "17 mm", "--side", "up", *CUT[-2:]),
        "radial depth: 17 mm; expected above zero, up to",
    ),
    ((*LOBES, *CUT[:6], *CUT[-2:]), "--side: is needed for a cut that is no slot"),
    ((*LOBES, *CUT[:6], "--side", "upp", *CUT[-2:]), "did you mean 'up'"),
    ((*LOBES, *CUT[:-1], "aluminium-7075-t7"), "did you mean 'aluminium-7075-t6'"),
    ((*LOBES, *CUT[:-2]), "give either a material, or both"),
    ((*LOBES, *CUT[:-2], "--tangential", "600 N/mm^2"), "both tangential force and radial ratio"),
    ((*LOBES, *CUT[:-2], "--tangential", "600 N", "--radial-ratio", "0.3"), "not a unit of specific force"),
    ((*LOBES, *CUT, "--entry", "0 deg"), "--entry and --exit: go together"),
    (
        (*LOBES, *CUT[:4], "--entry", "90 deg", "--exit", "30 deg", *CUT[-2:]),
        "expected angles that rise within 0 deg to 180 deg",
    ),
    ((*LOBES, *CUT, "--from", "9000 rpm", "--to", "3000 rpm"), "spindle speeds: 9000 rpm to 3000 rpm"),
    ((*LOBES, *CUT, "--from", "9000"), "the unit is missing"),
    ((*LOBES, *CUT, "--from", "100 Hz"), "not a unit of spindle speed"),
    ((*LOBES, *CUT, "--points", "1"), "points: 1; expected 2"),
    ((*LOBES, *CUT, "--loss-factor", "0"), "what is not damped chatters at any depth"),
    ((*LOBES, *CUT, "--check", "0"), "--check: 0; expected 1 to 60 speeds"),
    ((*LOBES, *CUT, "--path", "nowhere.toml", "--tilt", "3 deg"), "--path: has poses of its own"),
    ((*LOBES, *CUT, "--path", "nowhere.toml", "--check", "3"), "--path: has poses of its own"),
    ((*LOBES, *CUT, "--path", "nowhere.toml"), "nowhere.toml: cannot be read"),
    ((*LOBES, *CUT, "--highest", "1 Hz"), "highest frequency: 1 Hz"),
    ((*LOBES, *CUT, "--figure", "l.pdf"), ".png or .html"),
    ((*LOBES, *CUT, "--data", "l.csv"), "ends in .nc"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(a[6:]) for a, _ in WRONG])
def test_wrong_input_is_told_and_exit_code_2(trivet: Any, arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    code, out, err = trivet(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_pose_that_is_not_reached_is_exit_code_1(trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet("lobes", "azulay", *CUT, *FEW, "--position", "0 mm, 0 mm, 50 mm")
    assert (code, out) == (1, "")
    assert "above its limit of 65 mm" in err
    (tmp_path / "tour.toml").write_text(TOUR.replace('"125 mm"]\nazimuth', '"50 mm"]\nazimuth'))
    code, out, err = trivet("lobes", "azulay", *CUT, *FEW, "--path", "tour.toml")
    assert (code, out) == (1, "")
    assert "pose 2 of 2: azulay: the pose is not reached" in err
