"""The commands tilt and workspace: tables, JSON, files, and one line for what is wrong."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trivet as t

TILT = ("tilt", "azulay", "--neutral", "radial", "--radius", "8 mm", "--height", "100 mm", "--azimuths", "3", "--rolls", "60")


def test_tilt_in_tables_json_and_files(trivet: Any, tmp_path: Path) -> None:
    files = ("--figure", "t.png", "--figure", "t.html", "--data", "t.nc")
    code, out, err = trivet(*TILT, *files)
    assert (code, err.count("wrote")) == (0, 3)
    assert "ball deviation" in out
    assert "from home" in out
    code, out, _ = trivet(*TILT, "--json")
    (case,) = json.loads(out)["cases"]
    report = t.tilt("azulay", 0.008, 0.1, neutral="radial", azimuths=3, rolls=60)
    assert case["tilt_rad"] == pytest.approx(report.tilt, abs=1e-12)
    assert case["connected_rad"] == pytest.approx(report.connected.tolist())
    assert math.degrees(case["tilt_rad"]) > 90 > math.degrees(case["connected_tilt_rad"])
    with xr.open_dataset(tmp_path / "t.nc", group="1-azulay", engine="h5netcdf") as data:
        assert data["unbroken"].attrs["units"] == "rad"
        np.testing.assert_allclose(data["unbroken"], report.unbroken)
        assert data.attrs["neutral"] == "radial"
    assert (tmp_path / "t.png").stat().st_size > 10_000


def test_tilts_of_several(trivet: Any) -> None:
    """A case that reaches nothing is a row, not an end."""
    more = ("azulay@link.length=206 mm", "--radius", "300 mm", "--most", "30 deg", "--no-bodies", "--step", "5 deg")
    code, out, _ = trivet(*TILT, *more, "--figure", "several.png", "--json")
    found = json.loads(out)
    assert code == 0
    assert len(found["cases"]) == 2
    assert len(found["missing"]) == 2
    assert "no pose on the sphere of 300 mm about z0 = 100 mm is reached" in found["missing"][0]["reason"]


def test_an_unchecked_cone_is_said(trivet: Any) -> None:
    _, out, _ = trivet("tilt", "azulay", "--azimuths", "3", "--rolls", "12", "--step", "20 deg", "--no-bodies")
    assert "the cone of ball is not checked, for no neutral axis is given" in out


def test_workspace_in_tables_json_and_files(trivet: Any, tmp_path: Path) -> None:
    asked = ("workspace", "azulay", "behi", "--columns", "16", "--no-bodies")
    code, out, err = trivet(*asked, "--figure", "w.png", "--figure", "w.html", "--data", "w.nc")
    assert (code, err.count("wrote")) == (0, 3)
    assert "with one orientation: alpha 0°, beta 0°, gamma 0°" in out
    code, out, _ = trivet(*asked, "--json")
    first, second = json.loads(out)["machines"]
    assert first["volume_m3"] == pytest.approx(t.workspace("azulay", count=16, bodies=False).volume, rel=1e-12)
    assert second["machine"] == "behi"
    with xr.open_dataset(tmp_path / "w.nc", group="1-azulay", engine="h5netcdf") as data:
        assert float(data["volume"]) == pytest.approx(first["volume_m3"])
        cell = float(data["x"][1] - data["x"][0]) * float(data["y"][1] - data["y"][0])
        assert float(data["length"].sum()) * cell == pytest.approx(first["volume_m3"], rel=1e-9)


def test_orientations_in_tables_json_and_files(trivet: Any, tmp_path: Path) -> None:
    asked = ("workspace", "azulay", "--kind", "orientation", "--columns", "8", "--no-bodies", "--neutral", "radial")
    code, out, err = trivet(*asked, "--figure", "o.png", "--figure", "o.html", "--data", "o.nc")
    assert (code, err.count("wrote")) == (0, 3)
    assert "of all orientations" in out
    code, out, _ = trivet(*asked, "--json")
    found = json.loads(out)
    assert 0 < found["part_of_all_orientations"] < found["solid_angle_sr"] / (4 * math.pi) <= 1
    with xr.open_dataset(tmp_path / "o.nc", engine="h5netcdf") as data:
        assert float(data["solid_angle"]) == found["solid_angle_sr"]


def test_pose_tells_margins_and_clearances(trivet: Any) -> None:
    code, out, _ = trivet("pose", "azulay", "--json")
    found = json.loads(out)
    assert code == 0
    slide = next(joint for joint in found["joints"] if joint["name"] == "leg-1.slide")
    assert slide["margin_m"] == pytest.approx(min(slide["coordinate_m"], 0.065 - slide["coordinate_m"]))
    gaps = [pair["distance_m"] for pair in found["clearances"]]
    assert gaps == sorted(gaps)
    assert gaps[0] == pytest.approx(min(c.distance for c in t.pose("azulay").clearances))


def machine_with(lines: str, tmp_path: Path) -> str:
    path = tmp_path / "m.toml"
    path.write_text(f'variant_of = "azulay"\n[about]\nname = "m"\n{lines}', encoding="utf-8")
    return str(path)


WRONG = [
    (("tilt", "azulay", "--radius", "0 mm"), "radius of the sphere: 0 mm; must be greater than zero"),
    (("tilt", "azulay", "--radius", "-4 mm"), "must be greater than zero"),
    (("tilt", "azulay", "--neutral", "axial"), "neutral axis 'axial'"),
    (("tilt", "azulay", "--azimuths", "2"), "from 3 to"),
    (("tilt", "azulay", "--step", "0 deg"), "--step"),
    (("tilt", "azulay", "--most", "200 deg"), "at most 180 deg"),
    (("tilt", "azulay", "--azimuths", "100000", "--rolls", "100000"), "a grid of"),
    (("tilt", "gough-stewart", "--figure", "t.pdf"), ".png or .html"),
    (("workspace", "azulay", "--kind", "some"), "expected one of constant, reachable"),
    (("workspace", "azulay", "--columns", "2"), "columns: 2"),
    (("workspace", "azulay", "--region", "0 mm, 0 mm, 0 mm"), "two points, separated by a semicolon"),
    (("workspace", "azulay", "--region", "0 mm,0 mm,0 mm;0 mm,1 mm,1 mm"), "its greatest x, 0 mm, is not above the least"),
    (("workspace", "azulay", "--position", "0 mm,0 mm,0 mm"), "it goes with --kind orientation"),
    (("workspace", "azulay", "--kind", "total", "--tilt", "3 deg"), "those of a constant orientation"),
    (("workspace", "azulay", "eclipse", "--kind", "orientation"), "one machine at a time"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(a) for a, _ in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(trivet: Any, arguments: tuple[str, ...], message: str) -> None:
    code, out, err = trivet(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


WRONG_FILES = [
    ('[set]\n"ball.neutral" = { axis = "x", body = "behind" }', "body"),
    ('[set]\n"ball.neutral" = { axis = "w" }', "expected an axis"),
    ('[set]\n"ball.cone" = "0 deg"', "ball.cone"),
    ('[set]\n"ball.cone" = "120 deg"\n"ball.neutral" = { axis = "z", measure = "elevation" }', "an elevation lies between"),
    ('[set]\n"ball.neutral" = { axis = "x", body = "before" }', "ball.neutral.stem: needed"),
    ('[set]\n"slide.travel" = ["65 mm", "0 mm"]', "write the lower limit first"),
    ('[set]\n"interference.may_touch" = [["leg.lonk", "platform"]]', "did you mean 'leg.link'"),
    ('[set]\n"interference.clearance" = "-1 mm"', "must not be negative"),
    ('[set]\n"platform.shapes" = [{ shape = "sphere", radius = "0 mm" }]', "platform.shapes"),
    ('[set]\n"platform.shapes" = [{ shape = "cone", radius = "1 mm" }]', "platform.shapes"),
]


@pytest.mark.parametrize(("lines", "message"), WRONG_FILES, ids=[m for _, m in WRONG_FILES])
def test_wrong_files_are_one_line(trivet: Any, lines: str, message: str, tmp_path: Path) -> None:
    code, _, err = trivet("tilt", machine_with(lines, tmp_path), "--azimuths", "3", "--rolls", "12", "--step", "20 deg")
    assert code == 2
    assert message in err
    assert err.count("\n") == 1


def test_bodies_that_touch_at_home_are_named(trivet: Any, tmp_path: Path) -> None:
    path = machine_with('[set]\n"sections.tube.outer_diameter" = "60 mm"', tmp_path)
    for command in ("tilt", "workspace"):
        code, _, err = trivet(command, path)
        assert code == 1
        assert "at home leg-" in err
        assert "interference.may_touch" in err
        assert err.count("\n") == 1


def test_a_sphere_out_of_reach_is_named(trivet: Any) -> None:
    code, _, err = trivet("tilt", "azulay", "--height", "500 mm", "--azimuths", "3", "--rolls", "12")
    assert code == 1
    assert "no pose on the sphere of 4 mm about z0 = 500 mm is reached: at its pole" in err
    assert "leg-" in err


def test_no_workspace_is_said(trivet: Any) -> None:
    code, _, err = trivet("workspace", "azulay", "--region", "1 m,1 m,1 m;1.1 m,1.1 m,1.1 m", "--columns", "8")
    assert code == 1
    assert "no place of the region is reached" in err
