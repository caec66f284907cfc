"""The command solids: output, JSON, NetCDF, pictures, wrong input."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from step_files import BAR, BESIDE, SLANTED, TUBE, step_file

from trivet.model import load, to_text

pytestmark = pytest.mark.peer("scikit-fem", module="skfem")
gmsh = pytest.mark.peer("gmsh")

Run = Callable[..., tuple[int, str, str]]
FEW = ("azulay", "--part", "leg.slide", "--to", "700 Hz", "--points", "20", "--fineness", "0.7")


def test_tables(trivet: Run) -> None:
    code, out, _ = trivet("solids", *FEW)
    assert code == 0
    assert "solids in place of beams (euler-bernoulli), whose ends stay plane; 5 to 700 Hz, loss factor 0.02" in out
    assert re.search(r"leg-1.slide, leg-2.slide, leg-3.slide +32.1562 +section +\d+ hexahedra", out)
    rows = [line.split() for line in out.splitlines() if re.match(r"[1-4] ", line)]
    beams, solids, difference = (np.array([float(row[k]) for row in rows]) for k in (1, 2, 3))
    assert beams[[0, 2, 3]] == pytest.approx([455.56, 512.06, 683.16], abs=0.01)
    np.testing.assert_allclose(100 * (solids / beams - 1), difference, atol=3e-3)
    assert np.all((difference < 0) & (difference > -1)), "solids shear, these beams do not"
    assert re.search(r"^z +0.11095 N/µm +512.0\d", out, re.MULTILINE)
    assert "Modes are paired by their MAC" in out
    assert all(0.99 < float(row[-1]) <= 1 for row in rows)


def test_json_data_and_pictures(trivet: Run, tmp_path: Path) -> None:
    code, out, err = trivet("solids", *FEW, "--json", "--data", "s.nc", "--figure", "s.png", "--figure", "s.html")
    assert code == 0, err
    found = json.loads(out)
    (solid,) = found["solids"]
    assert solid["parts"] == ["leg-1.slide", "leg-2.slide", "leg-3.slide"]
    assert solid["file"] is None
    assert solid["cut_off_Hz"] == 5600.0
    assert solid["mass_kg"] == pytest.approx(solid["beam_mass_kg"], rel=2e-3)
    natural = found["natural_frequencies"]
    assert len(natural["MAC"]) == len(natural["beams_Hz"])
    assert np.array(natural["solids_Hz"]) / natural["beams_Hz"] - 1 == pytest.approx(natural["difference"], rel=1e-6)
    assert [m["direction"] for m in found["minimum_dynamic_stiffness"]["solids"]] == ["x", "y", "z", "rx", "ry", "rz"]
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as data:
        assert data.attrs["ends"] == "plane"
        assert data.frequency.attrs["units"] == "Hz"
        np.testing.assert_allclose(data.natural_frequency.sel(side="solids"), natural["solids_Hz"])
        np.testing.assert_allclose(data.receptance.sel(side="beams", part="real"), found["receptance_SI"]["beams"]["re"])
        np.testing.assert_allclose(data.mac, natural["MAC"])
        least = data.minimum_dynamic_stiffness.sel(side="solids", component="z")
        assert float(least) == pytest.approx(found["minimum_dynamic_stiffness"]["solids"][2]["stiffness_N_per_m"])
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "s.html").read_text()
    assert "x and y, solids" in page
    assert "z, beams" in page


def test_without_damping(trivet: Run) -> None:
    code, out, _ = trivet("solids", *FEW, "--loss-factor", "0")
    assert code == 0
    assert "no bound at a natural frequency" in out
    assert "minimum dynamic stiffness" not in out


@gmsh
def test_a_part_from_a_file(trivet: Run, tmp_path: Path) -> None:
    step_file(tmp_path, TUBE, 216, "link.step")
    options = ("--to", "700 Hz", "--points", "5", "--fineness", "0.7", "--json")
    found = [json.loads(trivet("solids", "azulay", "--part", part, *options)[1]) for part in ("leg.link=link.step", "leg.link")]
    assert found[0]["solids"][0]["file"] == "link.step"
    assert found[0]["solids"][0]["kind_of_elements"] == "tetrahedra"
    of_file, of_section = (np.array(one["natural_frequencies"]["solids_Hz"]) for one in found)
    np.testing.assert_allclose(of_file, of_section, rtol=1e-3)


@gmsh
@pytest.mark.parametrize(
    ("part", "message"),
    [
        ("leg.lnk", "part leg.lnk: not known; did you mean"),
        ("leg.hinge", "part leg.hinge: is no beam"),
        ("leg.link=none.step", "none.step: cannot be read: No such file or directory"),
        ("leg.link=short.step", "short.step: the part is 100 mm long, leg-1.link 216 mm at this pose"),
        ("leg.link=empty.step", "empty.step: 0 MB; expected more than nothing"),
        ("leg.link=text.step", "text.step: "),
        ("leg.link=", "part leg.link=: no file is named"),
        ("leg.link=nan.step", "nan.step: -NaN where a number was expected"),
        ("leg.link=beside.step", "beside.step: lies beside its axis: the middle of its near end, y = 12.000 mm"),
        ("leg.link=slanted.step", "slanted.step: lies beside its axis: the middle of its far end, y = -2.500 mm"),
    ],
)
def test_wrong_input(trivet: Run, tmp_path: Path, part: str, message: str) -> None:
    (tmp_path / "empty.step").touch()
    (tmp_path / "text.step").write_text("no part at all\n")
    (tmp_path / "nan.step").write_text("/* (nan) */ #1=CARTESIAN_POINT('nan, (inf,',(0., -NaN,1.));\n")
    for what, length in ((BAR, 100.0), (BESIDE, 216.0), (SLANTED, 216.0)):
        name = {BAR: "short.step", BESIDE: "beside.step", SLANTED: "slanted.step"}[what]
        if name in part:
            step_file(tmp_path, what, length, name)
    code, out, err = trivet("solids", "azulay", "--part", part, "--points", "5", "--fineness", "0.7")
    assert (code, out) == (2, "")
    assert err.startswith(f"trivet: {message}")
    assert err.count("\n") == 1


def test_a_section_by_its_numbers(trivet: Run, tmp_path: Path) -> None:
    text = to_text(load("azulay"))
    tube = re.search(r"\[sections\.tube\]\n(.*?)\n\n", text, re.DOTALL)
    assert tube
    general = 'shape = "general"\narea = "1.3e-4 m^2"\ninertia_y = "4.5e-9 m^4"\ninertia_z = "4.5e-9 m^4"\ntorsion = "9e-9 m^4"'
    (tmp_path / "own.toml").write_text(text.replace(tube.group(1), general))
    code, _, err = trivet("solids", "own.toml", "--points", "5")
    assert code == 2
    assert err.startswith("trivet: leg-1.slide: its section is given by its numbers and has no shape")
