"""trivet map --quantity dynamic-stiffness: output, JSON, NetCDF, figures, wrong input."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trivet as t
from trivet.show import atlas as drawn
from trivet.views.atlas import tables

ASKED = ("map", "azulay", "--quantity", "dynamic-stiffness", "--steps", "2", "--from", "50 Hz", "--to", "700 Hz")


@cache
def small() -> t.Atlas:
    return t.atlas("azulay", t.over_hemisphere(0.121, 0.004, 2), low=50, high=700)


def test_tables(trivet: Any) -> None:
    code, out, _ = trivet(*ASKED)
    one = small()
    assert code == 0
    assert "13 of 13 points reached; platform centre, 50 to 700 Hz, loss factor 0.02" in out
    (row,) = [line.split() for line in out.splitlines() if line.startswith("zz") and "N/µm" in line and len(line.split()) == 5]
    own = one.stiffness[:, 2] / 1e6
    assert row[1:4] == [f"{value:.4g}" for value in (own.min(), np.median(own), own.max())]
    assert f"{one.worst[0].stiffness / 1e6:.4g}" in out
    assert "worst poses, sought between the points" in out
    assert f"{1e3 * one.worst[0].position[2]:.4f}" in out


def test_json_and_netcdf(trivet: Any, tmp_path: Path) -> None:
    file = tmp_path / "atlas.nc"
    out = trivet(*ASKED, "--json", "--data", str(file))[1]
    found, one = json.loads(out), small()
    assert found["units_of_stiffness"] == {"xx": "N/m", "yy": "N/m", "zz": "N/m"}
    np.testing.assert_allclose(found["least_stiffness_SI"]["yy"], one.stiffness[:, 1], rtol=1e-9)
    np.testing.assert_allclose(found["at_frequency_Hz"]["yy"], one.at_frequency[:, 1], rtol=1e-9)
    np.testing.assert_allclose(found["worst"]["zz"]["stiffness_SI"], one.worst[2].stiffness, rtol=1e-9)
    np.testing.assert_allclose(found["worst"]["zz"]["tilt_rad"], one.worst[2].tilt, rtol=1e-9)
    np.testing.assert_allclose(found["greatest_receptance_SI"]["xx"], one.greatest[0], rtol=1e-9)
    with xr.open_dataset(file, engine="h5netcdf") as saved:
        np.testing.assert_allclose(saved["least_stiffness"].sel(entry="zz"), one.stiffness[:, 2], rtol=1e-9)
        np.testing.assert_allclose(saved["worst_position"].sel(entry="xx"), one.worst[0].position, rtol=1e-9)
        np.testing.assert_allclose(saved["least_receptance"].sel(entry="yy"), one.least[1], rtol=1e-9)
        assert saved["worst_frequency"].attrs["units"] == "Hz"


def test_without_a_search_between_the_points(trivet: Any, tmp_path: Path) -> None:
    file, one = tmp_path / "atlas.nc", small()
    found = json.loads(trivet(*ASKED, "--no-worst", "--json", "--data", str(file))[1])
    assert not found["worst_is_sought_between_points"]
    for k, entry in enumerate(one.entries):
        worst, point = found["worst"][entry], one.stiffness[:, k].argmin()
        assert worst["stiffness_SI"] == pytest.approx(one.stiffness[point, k], rel=1e-9)
        assert worst["least_at_a_point_SI"] == pytest.approx(worst["stiffness_SI"], rel=1e-9)
        assert worst["stiffness_SI"] > 1.00001 * one.worst[k].stiffness, "there is less between the points"
        assert worst["frequency_Hz"] == pytest.approx(one.at_frequency[point, k], rel=1e-7)
        np.testing.assert_allclose(worst["position_m"], one.places.position[point], atol=1e-15)
    with xr.open_dataset(file, engine="h5netcdf") as saved:
        assert saved.attrs["worst_sought_between_points"] == 0
        assert saved["worst_stiffness"].attrs["long_name"] == "least at the points alone"
    titles = [part.title for part in tables(replace(one, sought=False)) if hasattr(part, "title")]
    assert "worst poses, of the points alone" in titles
    assert drawn._words(one.worst[0], False).startswith("worst point: ")


def test_other_entries_and_their_units(trivet: Any) -> None:
    found = json.loads(
        trivet(*ASKED, "--entries", "x_ry, rx_y, rz_rz", "--roll", "0 deg", "--loss-factor", "0.05", "--json")[1]
    )
    assert found["units_of_stiffness"] == {"x_ry": "N", "rx_y": "N/rad", "rz_rz": "N m/rad"}
    assert (found["loss_factor"], found["roll_policy"]) == (0.05, "0 deg")


def test_figures(tmp_path: Path) -> None:
    one = small()
    for suffix in ("png", "html"):
        t.figure(one, tmp_path / f"atlas.{suffix}")
        assert (tmp_path / f"atlas.{suffix}").stat().st_size > 20_000
    assert "13 of 13 points" in drawn._title(one)[0]
    assert (
        drawn._words(one.worst[0], True)
        == f"worst pose: {one.worst[0].stiffness / 1e6:.4g} N/µm at {one.worst[0].frequency:.1f} Hz"
    )
    line = t.atlas("azulay", t.along("move", way, 1.0, 4), entries=("xx",), low=50, high=700, points=5)
    t.figure(line, tmp_path / "line.png")
    t.figure(line, tmp_path / "line.html")


def way(s: np.ndarray) -> np.ndarray:
    return np.stack([0.003 * s, 0 * s, 0.125 + 0 * s, 0 * s, 0.1 * s, 0.2 * s], axis=1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("map", "azulay", "--entries", "xx"), "--entries: only with --quantity dynamic-stiffness"),
        (("map", "azulay", "--from", "5 Hz", "--point", "tool"), "--point, --from: only with"),
        ((*ASKED, "--entries", "xq"), "xq"),
        (("map", "azulay", "--quantity", "dynamic"), "did you mean 'dynamic-stiffness'?"),
        (("map", "azulay", "--quantity", "nothing"), "known are: 1/det J^-1"),
        (("map", "azulay", "--objective", "D_xx"), "add --quantity dynamic-stiffness"),
        ((*ASKED, "--roll", "best K_xx", "--objective", "D_xx"), "it does not go with --roll"),
        ((*ASKED, "--rolls", "0"), "rolls: 0"),
        ((*ASKED, "--loss-factor", "1e-12"), "expected 1e-08 or more"),
        ((*ASKED, "--point", "tool"), "tool_tip"),
        ((*ASKED, "--loss-factor", "0"), "damping"),
        ((*ASKED[:-1], "40 Hz"), "rises"),
        ((*ASKED[:-1], "40 mm"), "--to"),
    ],
)
def test_wrong_input(trivet: Any, options: tuple[str, ...], words: str) -> None:
    code, _, complaint = trivet(*options)
    assert code == 2
    assert words in complaint
    assert "Traceback" not in complaint


def test_a_least_value_at_an_end_of_the_range_is_told(trivet: Any) -> None:
    """Above the resonances of a block of two poses the stiffness only grows."""
    asked = ("map", "azulay", "--quantity", "dynamic-stiffness", "--block", "2mm,0mm,0mm", "--steps", "1", "--roll", "0 deg")
    over = (*asked, "--from", "530 Hz", "--to", "560 Hz", "--entries", "xx, zz")
    assert "xx, zz: least at an end of the range" in trivet(*over)[1]
    assert json.loads(trivet(*over, "--json")[1])["worst"]["xx"]["is_at_end_of_range"] is True
    assert "end of the range" not in trivet(*asked, "--from", "300 Hz", "--to", "700 Hz", "--entries", "xx, zz")[1]


def test_no_pose_is_reached(trivet: Any) -> None:
    code, _, complaint = trivet(*ASKED, "--height", "900 mm")
    assert code == 1
    assert "no pose of the hemisphere of 4 mm is reached" in complaint
