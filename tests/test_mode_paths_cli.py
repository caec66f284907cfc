"""trivet modes along a path: tables, JSON, NetCDF, figures, wrong input."""

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
from trivet.show.mode_paths import curves, doubts, marks
from trivet.study.corners import corners_of
from trivet.study.mode_paths import ModePaths, modes_along
from trivet.study.pathfile import PathFile, PathPose
from trivet.vibration.tracking import Doubt
from trivet.views import mode_paths as view

FEW = ("--count", "4", "--steps", "4", "--elements", "3")
TILT = ("--to-tilt", "16 deg")
PATH = """
format = 1
[[poses]]
position = ["0 mm", "0 mm", "125 mm"]
[[poses]]
position = ["0 mm", "0 mm", "125 mm"]
azimuth = "30 deg"
tilt = "10 deg"
[[poses]]
position = ["3 mm", "2 mm", "122 mm"]
azimuth = "50 deg"
tilt = "10 deg"
roll = "-20 deg"
"""


@cache
def tilted() -> ModePaths:
    home = PathPose((0.0, 0.0, 0.125))
    return modes_along("azulay", PathFile([home, PathPose(home.position, tilt=math.radians(16))]), count=4, steps=4, elements=3)


def test_table(trivet: Any) -> None:
    code, out, err = trivet("modes", "azulay", *TILT, *FEW)
    assert (code, err) == (0, "")
    assert "from centre (0, 0, 125) mm, alpha 0°, beta 0°, gamma 0°\nto centre (0, 0, 125) mm, alpha 0°, beta 16°" in out
    assert "Places are told by the tilt, °" in out
    rows = [line.split() for line in out.splitlines() if re.match(r"[1-4] ", line)]
    for k, row in enumerate(rows):
        own = tilted().frequency[:, k]
        assert row[1:3] == [f"{own[0]:.2f}", f"{own[-1]:.2f}"]
        assert (row[3], row[5]) == (f"{own.min():.2f}", f"{own.max():.2f}")
        assert float(row[6]) == pytest.approx(4 * own.argmax())
    assert {rows[0][8], rows[1][8]} == {"x", "y"}
    assert (rows[2][8], rows[3][8]) == ("z", "rz")
    (met,) = re.findall(r"cross +1 and 2 +([0-9.]+) +([0-9.]+)", out)
    (one,) = tilted().encounters
    assert float(met[0]) == pytest.approx(float(tilted().scale.at(one.place)), rel=1e-3)
    assert float(met[1]) == pytest.approx(one.frequency, abs=0.01)
    assert "every mode is known again after each, by a MAC of" in out


def test_json(trivet: Any) -> None:
    found = json.loads(trivet("modes", "azulay", *TILT, *FEW, "--json")[1])
    report = tilted()
    assert [pose["tilt_rad"] for pose in found["poses"]] == pytest.approx(np.radians([0, 4, 8, 12, 16]))
    assert [pose["place"] for pose in found["poses"]] == [1, 1.25, 1.5, 1.75, 2]
    for k, branch in enumerate(found["branches"]):
        assert branch["number"] == k + 1
        assert branch["frequency_Hz"] == pytest.approx(report.frequency[:, k], rel=1e-9)
        assert [report.frequency[n].argsort().argsort()[k] + 1 for n in range(1, 5)] == branch["mode_number"][1:]
        assert np.array(branch["platform_twist_1_or_rad_per_m_per_sqrt_kg"]).shape == (5, 6)
        assert len(branch["MAC"]) == len(found["steps"]) == 4
    assert found["encounters"][0]["kind"] == "cross"
    assert found["encounters"][0]["branches"] == [1, 2]
    assert found["doubts"] == []


def test_path_file(trivet: Any, tmp_path: Path) -> None:
    """Every pose of the file is among those that are told of; a level pose takes the azimuth of the next."""
    (tmp_path / "way.toml").write_text(PATH)
    found = json.loads(trivet("modes", "azulay", "--path", "way.toml", *FEW, "--json")[1])
    places = [pose["place"] for pose in found["poses"]]
    assert {1, 2, 3} <= set(places)
    first, last = found["poses"][0], found["poses"][-1]
    assert (first["azimuth_rad"], first["roll_rad"]) == pytest.approx((math.radians(30), math.radians(-30)))
    assert (last["azimuth_rad"], last["roll_rad"]) == pytest.approx((math.radians(50), math.radians(-20)))
    single = t.modes("azulay", last["position_m"], *(last[f"{key}_rad"] for key in ("azimuth", "tilt", "roll")), count=4)
    now = sorted(branch["frequency_Hz"][-1] for branch in found["branches"])
    assert now == pytest.approx(single.frequency, rel=1e-8)
    out = trivet("modes", "azulay", "--path", "way.toml", *FEW)[1]
    assert "Places are poses, 1 to 3" in out
    assert ", through 1 more" in out


def test_angles_go_the_shorter_way_round() -> None:
    place = (0.0, 0.0, 0.125)
    poses = [PathPose(place, math.radians(350), 0.1, 3.0), PathPose(place, math.radians(10), 0.1, -3.0)]
    start, end = corners_of(PathFile(poses))
    assert end[3] - start[3] == pytest.approx(math.radians(20))
    assert end[5] - start[5] == pytest.approx(2 * math.pi - 6)


def test_netcdf(trivet: Any, tmp_path: Path) -> None:
    code, _, err = trivet("modes", "azulay", *TILT, *FEW, "--data", "m.nc")
    assert (code, err) == (0, "wrote m.nc\n")
    with xr.open_dataset(tmp_path / "m.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.frequency, tilted().frequency, rtol=1e-9)
        assert data.frequency.attrs["units"] == "Hz"
        assert data.frequency.dims == ("place", "branch")
        np.testing.assert_allclose(np.degrees(data.tilt), [0, 4, 8, 12, 16])
        assert list(data.encounter_kind.values) == ["cross"]
        assert data.encounter_branches.values.tolist() == [[1, 2]]
        assert data.attrs["doubts"] == 0
        assert data.least_mac.shape == (4, 4)


def test_figures(trivet: Any, tmp_path: Path) -> None:
    code, _, err = trivet("modes", "azulay", *TILT, *FEW, "--figure", "m.png", "--figure", "m.html")
    assert (code, err.count("wrote")) == (0, 2)
    page = (tmp_path / "m.html").read_text(encoding="utf-8")
    assert "<script src=" not in page
    assert r"tilt, \u00b0" in page
    assert "1 and 2 cross" in page
    report = tilted()
    for k, curve in enumerate(curves(report)):
        at = np.searchsorted(report.branches.fine_place, report.place)
        np.testing.assert_allclose(curve.frequency[at], report.frequency[:, k], rtol=1e-12)
        np.testing.assert_allclose(curve.at[at], [0, 4, 8, 12, 16], atol=1e-12)
    assert len({(curve.colour, curve.dash) for curve in curves(report)}) == 4
    (mark,) = marks(report)
    assert mark.frequency == pytest.approx(
        float(np.interp(mark.at, curves(report)[0].at, curves(report)[0].frequency)), rel=1e-6
    )


def test_what_is_not_certain_is_told(tmp_path: Path) -> None:
    from dataclasses import replace

    report = replace(tilted(), branches=replace(tilted().branches, doubts=(Doubt(2, 1.25, 1.5, 0.51),)))
    *_, last = view.tables(report)
    assert "NOT CERTAIN in 1 of them, at worst branch 3 at 4 (MAC 0.51)" in last
    assert view.as_json(report)["doubts"] == [{"branch": 3, "start": 1.25, "end": 1.5, "MAC": 0.51}]
    at, frequency = doubts(report)
    assert at == pytest.approx([6.0])
    assert frequency == pytest.approx([512.2], abs=1)
    for name in ("d.png", "d.html"):
        t.figure(report, tmp_path / name)
    assert "not certain" in (tmp_path / "d.html").read_text(encoding="utf-8")


ONE = '[[poses]]\nposition = ["0 mm", "0 mm", "125 mm"]\n'
WRONG = [
    (("modes", "azulay", "--path", "one.toml"), "poses"),
    (("modes", "azulay", "--path", "same.toml"), "the pose 2 of the path is where the pose 1 is"),
    (("modes", "azulay", "--path", "none.toml"), "none.toml"),
    (("modes", "azulay", "--path", "way.toml", "--tilt", "5 deg"), "no --position"),
    (("modes", "azulay", "--path", "way.toml", "--to-tilt", "5 deg"), "no --position"),
    (("modes", "azulay", "--to-tilt", "0 deg"), "the pose 2 of the path is where the pose 1 is"),
    (("modes", "azulay", "--to-tilt", "5"), "unit is missing"),
    (("modes", "azulay", "--to", "1 mm, 2 mm"), "expected three values"),
    (("modes", "azulay", *TILT, "--count", "0"), "--count"),
    (("modes", "azulay", *TILT, "--steps", "0"), "steps: 0"),
    (("modes", "azulay", "--steps", "5"), "--steps: speaks of a path"),
    (("modes", "azulay", *TILT, "--elements", "0"), "elements: 0"),
    (("modes", "azulay", *TILT, "--mode", "+"), 'the signs "++ ++ ++"'),
    (("modes", "azulay", *TILT, "--figure", "m.pdf"), ".png or .html"),
    (("modes", "azulay", *TILT, "--data", "m.csv"), "ends in .nc"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(a) for a, _ in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(trivet: Any, arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    for name, text in (("one", ONE), ("same", 2 * ONE), ("way", PATH)):
        (tmp_path / f"{name}.toml").write_text(text)
    code, out, err = trivet(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert len(list(tmp_path.iterdir())) == 3


def test_a_path_that_leaves_what_is_reached_is_exit_code_1(trivet: Any) -> None:
    code, out, err = trivet("modes", "azulay", "--to", "0 mm, 0 mm, 50 mm", *FEW)
    assert (code, out) == (1, "")
    assert len(err.strip().splitlines()) == 1
    found = re.search(r"at pose 1 and 0.94 of the way to the next, centre \(0, 0, ([0-9.]+)\) mm", err)
    assert found
    assert "leg-1.slide at " in err
    assert "is above its limit of 65 mm" in err
    at = float(found[1]) / 1e3
    slides = [t.pose("azulay", (0, 0, at + d), anyway=True).miss is None for d in (1e-5, -1e-5)]
    assert slides == [True, False]
    assert trivet("modes", "azulay", "--to", "0 mm, 0 mm, 50 mm", *FEW, "--anyway")[0] == 0
    code, out, err = trivet("modes", "azulay", "--to", "0 mm, 0 mm, 500 mm", *FEW, "--anyway")
    assert (code, out) == (1, "")
    assert "cannot close" in err


def test_the_first_pose_is_told_as_such(trivet: Any) -> None:
    err = trivet("modes", "azulay", "--position", "0 mm, 0 mm, 50 mm", "--to-tilt", "5 deg", *FEW)[2]
    assert "leaves what the machine reaches at pose 1, centre (0, 0, 50) mm" in err
    assert "one step on" not in err


def test_a_path_of_python_needs_two_poses() -> None:
    with pytest.raises(t.InputError, match="poses: 1 of a path"):
        modes_along("azulay", PathFile([PathPose((0.0, 0.0, 0.125))]))
    with pytest.raises(t.InputError, match="count: 0"):
        modes_along("azulay", PathFile([PathPose((0.0, 0.0, 0.125)), PathPose((0.0, 0.0, 0.12))]), count=0)
