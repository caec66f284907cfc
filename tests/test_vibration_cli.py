"""The commands modes and frf, rigid drives, the dynamic half of compare: output, JSON, NetCDF, wrong input."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from machines import changed

import trivet as t
from trivet.errors import InputError
from trivet.model import load
from trivet.study.mode_summary import aligned, comparable, largest, motion_words, summaries, total_mass
from trivet.study.response_summary import ShownResponse, check_entries

FEW = ("--to", "600 Hz", "--points", "50")


def bare_masses(name: str, slide: str) -> list[float]:
    """Masses of a machine whose rods weigh what is out: vibration has no more of them."""
    return list(t.pose(changed(load(name), {slide: {"travel": None}})).masses.values())


@cache
def four_modes() -> t.ModesReport:
    return t.modes("azulay", count=4)


@cache
def response() -> t.FrequencyResponse:
    return t.frf("azulay", high=600.0, points=50)


def test_modes_say_what_moves_and_what_yields(trivet: Any) -> None:
    code, out, _ = trivet("modes", "azulay", "--count", "4")
    assert code == 0
    rows = [line.split() for line in out.splitlines() if re.match(r"[1-4] ", line)]
    assert [row[1] for row in rows] == [f"{f:.2f}" for f in four_modes().frequency]
    assert [row[2] for row in rows] == ["x", "y", "z", "rz"]
    assert "leg-1.slide 25 %, leg-2.slide 25 %, leg-3.slide 25 %" in out
    assert "0.8394 kg" in out


def test_modes_as_json(trivet: Any) -> None:
    found = json.loads(trivet("modes", "azulay", "--count", "4", "--json")[1])
    report = four_modes()
    assert found["mass_kg"] == pytest.approx(sum(bare_masses("azulay", "slide")))
    for k, mode in enumerate(found["modes"]):
        assert mode["number"] == k + 1
        assert mode["frequency_Hz"] == pytest.approx(report.frequency[k], rel=1e-9)
        assert sum(mode["strain_energy_shares"].values()) == pytest.approx(1)
    # Whatever mixtures stand for a pair, together they take the same mass.
    pair = np.sum([mode["effective_mass_kg"] for mode in found["modes"][:2]], axis=0)
    np.testing.assert_allclose(pair, report.effective_mass[:3, :2].sum(axis=1), rtol=1e-8, atol=1e-12)
    assert np.array(found["modes"][0]["effective_mass_fraction"]) * found["mass_kg"] == pytest.approx(
        found["modes"][0]["effective_mass_kg"]
    )


def test_elements_do_not_change_frequencies(trivet: Any) -> None:
    def frequencies(*options: str) -> list[float]:
        found = json.loads(trivet("modes", "azulay", "--count", "3", "--json", *options)[1])
        return [mode["frequency_Hz"] for mode in found["modes"]]

    assert frequencies("--elements", "3") == pytest.approx(frequencies(), rel=1e-9)
    assert frequencies("--drives", "rigid")[0] > 1.5 * frequencies()[0]
    assert frequencies("--spherical", "free")[0] < 0.5 * frequencies()[0]


def test_rigid_drives_stiffen_a_pose(trivet: Any) -> None:
    def stiffness(*options: str) -> float:
        return float(json.loads(trivet("pose", "azulay", "--json", *options)[1])["diagonal"]["K_zz_N_per_m"])

    assert stiffness("--drives", "rigid") > 2 * stiffness()
    assert stiffness("--drives", "as-described") == stiffness()


def test_double_modes_are_turned_to_the_axes() -> None:
    """Turned modes are modes as before: orthonormal to mass and stiffness; the first of a pair leaves y alone."""
    raw = four_modes()
    report = aligned(raw)
    mesh, shapes = report.modes.mesh, report.modes.shapes
    squares = (2 * np.pi * report.modes.mesh_frequency) ** 2
    np.testing.assert_allclose(shapes.T @ (mesh.mass @ shapes), np.eye(4), atol=1e-9)
    np.testing.assert_allclose(shapes.T @ (mesh.stiffness @ shapes), np.diag(squares), atol=1e-6 * squares[-1])
    assert report.frequency == pytest.approx(raw.frequency, rel=1e-12)
    moved, most = comparable(report), largest(report)
    assert abs(moved[1, 0]) < 1e-6 * most[0]
    assert abs(moved[0, 1]) < 1e-6 * most[1]
    assert np.all(moved[np.argmax(np.abs(moved), axis=0), range(4)] > 0)
    np.testing.assert_allclose(aligned(report).modes.shapes, shapes, atol=1e-9)


def test_the_count_does_not_change_what_modes_do(trivet: Any) -> None:
    """It may cut a pair in two."""

    def told(count: int) -> list[tuple[Any, ...]]:
        found = json.loads(trivet("modes", "azulay", "--count", str(count), "--elements", "2", "--json")[1])["modes"]
        return [(mode["number"], mode["platform_moves"], *np.round(mode["effective_mass_fraction"], 6) + 0.0) for mode in found]

    all_twelve = told(12)
    for count in (1, 2, 3, 4, 5, 6, 11):
        assert told(count) == all_twelve[:count]


def test_motion_in_words() -> None:
    assert motion_words(np.array([0.0, 0, 1, 0, 0, 0]), 1.0) == "z"
    assert motion_words(np.array([-1.0, 0, 0.09, 0, 0.4, -0.2]), 1.0) == "x with ry, rz"
    assert motion_words(np.array([0.01, 0, 0, 0, 0, 0]), 1.0) == "hardly moves"


def test_struts_ring_without_the_platform() -> None:
    report = aligned(t.modes("gough-stewart", count=8))
    words = [mode.motion for mode in summaries(report)]
    assert words[:4] == ["x with ry", "y with rx", "rz", "z"]
    assert words[6:] == ["hardly moves", "hardly moves"]
    fractions = np.array([mode.mass_fraction for mode in summaries(report)])
    assert np.all(fractions.sum(axis=0) < 1)
    assert fractions[3, 2] > 0.95
    assert total_mass(report) == pytest.approx(sum(bare_masses("gough-stewart", "strut")))


def test_frf_table(trivet: Any) -> None:
    code, out, _ = trivet("frf", "azulay", *FEW)
    assert code == 0
    assert "structural damping with loss factor 0.02, 5 to 600 Hz" in out
    first = next(line.split() for line in out.splitlines() if line.startswith("1 "))
    peak = ShownResponse(response()).at_resonances("xx")[0]
    assert first[1:4] == ["455.56", f"{1e6 * abs(peak):.4g}", f"{np.degrees(np.angle(peak)):.1f}"]
    assert re.search(r"^x +0\.11443 N/µm +455\.55 *$", out, re.MULTILINE)
    assert re.search(r"rz +\S+ N m/rad +600\.00  end of the range", out)


def test_frf_as_json(trivet: Any) -> None:
    found = json.loads(trivet("frf", "azulay", *FEW, "--entries", "xx, z_ry", "--output", "mobility", "--json")[1])
    frequency = np.array(found["frequency_Hz"])
    np.testing.assert_array_equal(frequency, response().frequency)
    for name, unit in (("xx", "m/s/N"), ("z_ry", "m/s/(N m)")):
        own = found["entries"][name]
        values = np.array(own["re"]) + 1j * np.array(own["im"])
        np.testing.assert_allclose(values, 2j * np.pi * frequency * response().entry(name), rtol=1e-9, atol=1e-18)
        assert own["unit"] == unit
    least = found["minimum_dynamic_stiffness"][2]
    assert (least["direction"], least["stiffness_N_per_m"]) == ("z", pytest.approx(110953.2, rel=1e-5))
    assert "stiffness_N_m_per_rad" in found["minimum_dynamic_stiffness"][3]
    assert found["natural_frequencies_Hz"] == pytest.approx([455.559, 455.559, 512.063], rel=1e-5)


def test_frequencies_have_units(trivet: Any) -> None:
    found = json.loads(trivet("frf", "azulay", "--from", "0.1 kHz", "--to", "2e5 mHz", "--points", "3", "--json")[1])
    assert found["frequency_Hz"] == pytest.approx([100, 150, 200])
    assert found["natural_frequencies_Hz"] == []


def test_two_places_have_no_minimum(trivet: Any) -> None:
    options = ("frf", "azulay", *FEW, "--response", "leg-1.link@0.5", "--method", "modal", "--damping", "modal")
    code, out, _ = trivet(*options)
    assert (code, "minimum dynamic stiffness" in out) == (0, False)
    assert "receptance of leg-1.link@0.5 under loads at platform, method modal, modal damping" in out
    assert json.loads(trivet(*options, "--json")[1])["minimum_dynamic_stiffness"] == []


def test_without_damping_there_is_no_bound(trivet: Any) -> None:
    code, out, _ = trivet("frf", "azulay", *FEW, "--loss-factor", "0")
    assert (code, "no bound" in out, "µm/N" in out) == (0, True, False)


def test_responses_that_symmetry_forbids_are_zero() -> None:
    shown = ShownResponse(response(), entries=("xx", "xz"))
    assert np.all(shown.at_resonances("xz") == 0)
    assert np.all(shown.at_resonances("xx") != 0)


def test_units_of_responses() -> None:
    shown = ShownResponse(response(), "accelerance")
    assert shown.unit("xx") == ("m/s^2/N", "m/s²/N", 1.0)
    assert ShownResponse(response()).unit("rx_ry") == ("rad/(N m)", "µrad/(N m)", 1e6)
    with pytest.raises(InputError, match="given twice"):
        check_entries(["xx", " x_x"], "receptance")


def test_modes_as_netcdf(trivet: Any, tmp_path: Path) -> None:
    assert trivet("modes", "azulay", "--count", "4", "--data", "m.nc")[0] == 0
    with xr.open_dataset(tmp_path / "m.nc", engine="h5netcdf") as data:
        report = four_modes()
        np.testing.assert_allclose(data.frequency, report.frequency, rtol=1e-9)
        assert data.frequency.attrs["units"] == "Hz"
        np.testing.assert_allclose(data.strain_energy_share.sum("part"), 1)
        np.testing.assert_array_equal(data["shape"][1], data.platform)
        mesh = report.modes.mesh.structure
        np.testing.assert_array_equal(data.node_position, mesh.nodes)
        assert list(data.beam.values) == [beam.name for beam in mesh.beams]
        assert float(data.mass) == pytest.approx(total_mass(report))
        assert data.attrs["working_mode"] == "++ ++ ++"
        assert "format = 1" in data.attrs["machine_file"]
        np.testing.assert_allclose(data.position, (0, 0, 0.125))


def test_responses_as_netcdf(trivet: Any, tmp_path: Path) -> None:
    assert trivet("frf", "azulay", *FEW, "--data", "f.nc")[0] == 0
    with xr.open_dataset(tmp_path / "f.nc", engine="h5netcdf") as data:
        assert data.receptance.dims[-1] == "part"
        assert list(data.part.values) == ["real", "imag"]
        values = data.receptance.sel(part="real") + 1j * data.receptance.sel(part="imag")
        np.testing.assert_array_equal(values.sel(motion="x", load="ry"), response().entry("x_ry"))
        assert data.frequency.attrs["units"] == "Hz"
        np.testing.assert_allclose(data.natural_frequency, response().natural)
        assert {key: data.attrs[key] for key in ("response", "excitation", "method", "damping")} == {
            "response": "platform",
            "excitation": "platform",
            "method": "exact",
            "damping": "structural",
        }
        assert data.attrs["loss_factor"] == 0.02
        assert float(data.minimum_dynamic_stiffness.sel(component="x")) == pytest.approx(114434.17, rel=1e-6)
    assert not (tmp_path / "g.nc").exists()
    t.save(ShownResponse(response(), entries=("zz",)), "g.nc")
    with xr.open_dataset(tmp_path / "g.nc", engine="h5netcdf") as data:
        assert data.receptance.shape == (len(response().frequency), 6, 6, 2)


BOTH = ("compare", "azulay", "alizade", "--steps", "2", "--finer", "1", "--no-sensitivity")


def test_compare_adds_the_dynamic_half(trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet(*BOTH, "--figure", "c.png", "--figure", "c.html", "--data", "c.nc")
    assert (code, err.count("wrote")) == (0, 3)
    assert out.index("Welch") < out.index("minimum dynamic stiffness as described")
    assert re.search(r"azulay +0\.1144 +455\.5 .* 455\.6, 455\.6, 512\.1", out)
    assert re.search(r"alizade +Azulay et al\. 2014, Table 5 +D_zz +2\.0800 +0\.1068 +-95 %", out)
    assert "variant by variant" not in out
    assert out.count("docs/replication.md tells") == 2
    answer = [line.split() for line in out[out.index("in short, N/µm") :].splitlines()[2:8]]
    assert [words[0] for words in answer] == ["K_xx", "K_yy", "K_zz", "D_xx", "D_yy", "D_zz"]
    for _, first, more, sign, second, less in answer:
        assert {first, second} == {"azulay", "alizade"}
        assert (sign in {">", "≈"}, float(more) >= float(less)) == (True, True)
    assert answer[3][1:3] == ["azulay", "0.1144"]
    with xr.open_dataset(tmp_path / "c.nc", group="alizade", engine="h5netcdf") as data:
        assert float(data.minimum_dynamic_stiffness.sel(variant="as described", axis="z")) == pytest.approx(106809.0, rel=1e-5)
        assert data.stiffness.sizes["point"] == 13
        assert data.attrs["loss_factor"] == 0.02


def test_compare_as_json_has_both_halves(trivet: Any) -> None:
    found = json.loads(trivet(*BOTH, "--json")[1])
    dynamics = found["dynamics"]
    assert [own["machine"] for own in dynamics["machines"]] == ["azulay", "alizade"]
    assert dynamics["machines"][0]["minimum_dynamic_stiffness"][0]["stiffness_N_per_m"] == pytest.approx(114434.17, rel=1e-6)
    assert dynamics["machines"][1]["natural_frequencies_Hz"][0] == pytest.approx(412.198, rel=1e-5)
    assert dynamics["orders"][0]["machines"] == ["azulay", "alizade"]
    assert len(found["machines"]) == 2
    static = json.loads(trivet(*BOTH, "--static-only", "--json")[1])
    assert (static["dynamics"], static["dynamics_missing_because"]) == (None, None)
    assert static["machines"] == found["machines"]


def test_a_missing_dynamic_half_does_not_take_the_static_one_away(trivet: Any) -> None:
    code, out, err = trivet(*BOTH[:1], "azulay@home.position=0 mm,0 mm,500 mm", *BOTH[3:])
    assert (code, "stiffness over the points" in out) == (1, True)
    told = "azulay@home.position=0 mm,0 mm,500 mm: home.position 0 mm, 0 mm, 500 mm: the pose is not reached"
    assert f"No dynamic comparison: {told}" in out
    warning, error = err.splitlines()
    assert warning.startswith(f"trivet: warning: {told}")
    assert error.startswith(f"trivet: {told}")


def test_a_machine_without_result_does_not_take_the_others_away(trivet: Any) -> None:
    """One reaches no point of its hemisphere, one does not reach home: each is told of, and the third has both halves."""
    high, low = "azulay@workpiece.height=400 mm", "alizade@home.position=0 mm,0 mm,400 mm"
    code, out, err = trivet("compare", "azulay", high, low, *BOTH[3:], "--json", "--figure", "c.png", "--data", "c.nc")
    found = json.loads(out)
    assert code == 1
    assert [own["machine"] for own in found["machines"]] == ["azulay", low]
    assert [own["machine"] for own in found["dynamics"]["machines"]] == ["azulay", high]
    assert found["missing"][0].startswith(f"{high}: no point of the hemisphere of 4 mm is reached")
    assert found["dynamics"]["missing"][0].startswith(f"{low}: home.position 0 mm, 0 mm, 400 mm: ")
    error = err.splitlines()[-1]
    assert found["missing"][0] in error
    assert found["dynamics"]["missing"][0] in error


def test_variants_are_listed() -> None:
    from trivet.views import dynamic_comparison as view

    found = t.compare_dynamics("azulay", "alizade", sensitivity=["balls free", "Timoshenko"])
    listed = view.as_json(found)
    assert {own["variant"] for own in listed["variants"]} == {"as described", "balls free", "Timoshenko"}
    assert len(listed["ranges"]) == 6
    assert listed["ranges"][0]["least_variant"] == "balls free"
    titles = [part.title for part in view.tables(found) if not isinstance(part, str)]
    assert "variant by variant along x, y and z, N/µm" in titles
    json.dumps(listed, allow_nan=False)


WRONG = [
    (("modes", "azulay", "--count", "0"), "--count"),
    (("modes", "azulay", "--count", "101"), "--count"),
    (("modes", "azulay", "--elements", "0"), "elements: 0"),
    (("modes", "azulay", "--drives", "soft"), "rigid or as-described"),
    (("modes", "azulay", "--figure", "m.pdf"), ".png or .html"),
    (("modes", "azulay", "--data", "m.csv"), "ends in .nc"),
    (("modes", "azulay", "--mode", "+"), 'the signs "++ ++ ++"'),
    (("frf", "azulay", "--from", "0 Hz"), "greater than zero"),
    (("frf", "azulay", "--from", "5"), "unit is missing"),
    (("frf", "azulay", "--from", "5 mm"), "not a unit of frequency"),
    (("frf", "azulay", "--from", "5 rad/s"), "not a unit of frequency"),
    (("frf", "azulay", "--to", "3000 rpm"), "not a unit of frequency"),
    (("frf", "azulay", "--from", "3 kHz", "--to", "5 Hz"), "3000 Hz to 5 Hz"),
    (("frf", "azulay", "--points", "1"), "points: 1"),
    (("frf", "azulay", "--loss-factor", "-0.1"), "loss factor: -0.1"),
    (("frf", "azulay", "--loss-factor", "nan"), "loss factor: nan"),
    (("frf", "azulay", "--response", "leg-1.hing"), "did you mean 'leg-1.hinge'"),
    (("frf", "azulay", "--excitation", "leg-1.link@1.5"), "leg-1.link@0.5"),
    (("frf", "azulay", "--method", "exakt"), "did you mean 'exact'"),
    (("frf", "azulay", "--damping", "modal"), "needs modes"),
    (("frf", "azulay", "--response", "tool"), "no platform.tool_tip"),
    (("frf", "azulay", "--output", "receptence"), "did you mean 'receptance'"),
    (("frf", "azulay", "--entries", "xq"), "expected two of x, y, z"),
    (("frf", "azulay", "--entries", "xx,xx"), "given twice"),
    (("frf", "nowhere"), "no machine of this name"),
    (("compare", "azulay", "--drives", "loose", "--steps", "2"), "rigid or as-described"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(a) for a, _ in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(trivet: Any, arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    code, out, err = trivet(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_damping_of_parts_alone_is_damping(trivet: Any) -> None:
    code, out, err = trivet("frf", "azulay", "--loss-factor", "0", "--set", "ball.loss_factor=0.1", *FEW)
    assert (code, err) == (0, "")
    assert "minimum dynamic stiffness" in out
    assert "no bound" not in out
    assert "loss factor 0 (some parts have damping of their own)" in out


@pytest.mark.parametrize("command", ["modes", "frf"])
def test_no_result_is_exit_code_1(trivet: Any, command: str) -> None:
    code, out, err = trivet(command, "azulay", "--position", "0 mm, 0 mm, 50 mm")
    assert (code, out) == (1, "")
    assert "above its limit of 65 mm" in err
    assert (
        trivet(command, "azulay", "--position", "0 mm, 0 mm, 50 mm", "--anyway", *(() if command == "modes" else FEW))[0] == 0
    )


@pytest.mark.parametrize("command", ["modes", "frf"])
def test_files_are_not_overwritten_unasked(trivet: Any, command: str, tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("precious")
    code, out, err = trivet(command, "azulay", "--figure", "a.png")
    assert (code, out) == (2, "")
    assert "exists already" in err
    assert (tmp_path / "a.png").read_text() == "precious"
