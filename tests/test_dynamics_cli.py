"""The commands dynamics, simulate and export: output, JSON, figures, NetCDF; every error is one line with its exit code."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trivet as t
from trivet.space.pose import zyz_frame

STATE = (
    "dynamics", "azulay", "--position", "2 mm, -1 mm, 12.2 cm", "--azimuth", "20 deg", "--tilt", "5 deg", "--roll", "-0.1 rad",
    "--velocity", "50 mm/s, 0 m/s, -0.02 m/s", "--angular-velocity", "0.5 rad/s, 0 rad/s, 20 deg/s",
    "--acceleration", "1 m/s^2, 0 m/s^2, 0.5 m/s^2", "--angular-acceleration", "0 rad/s^2, 3 rad/s^2, 0 rad/s^2",
    "--force", "5 N, 0 N, -3 N", "--moment", "0 N m, 100 N mm, 0 N m", "--at", "0 mm, 0 mm, 20 mm",
    "--gravity", "0 m/s^2, 0 m/s^2, -9.81 m/s^2",
)  # fmt: skip
UP = ("dynamics", "azulay", "--to", "0 mm, 0 mm, 130 mm", "--samples", "100")
SHORT = ("simulate", "azulay", "--duration", "5 ms", "--samples", "51", "--velocity", "10 mm/s, 0 m/s, 0 m/s")


@cache
def state() -> t.DynamicsReport:
    return t.dynamics_report(
        "azulay",
        (0.002, -0.001, 0.122),
        np.radians(20),
        np.radians(5),
        -0.1,
        velocity=(0.05, 0, -0.02),
        angular_velocity=(0.5, 0, np.radians(20)),
        acceleration=(1, 0, 0.5),
        angular_acceleration=(0, 3, 0),
        loading=t.Loading.of((0, 0, -9.81), (5, 0, -3), (0, 0.1, 0), (0, 0, 0.02)),
    )


@cache
def upwards() -> t.MotionReport:
    ends = (zyz_frame((0, 0, z), 0, 0, 0) for z in (0.125, 0.13))
    return t.motion("azulay", t.timed([t.straight(*ends)], t.Limits()), samples=100)


@cache
def let_go() -> t.Simulation:
    return t.simulate("azulay", 0.005, velocity=(0.01, 0, 0), samples=51)


def close(found: Any, expected: Any, tolerance: float = 1e-9) -> None:
    size = float(np.abs(np.asarray(expected)).max()) or 1.0
    np.testing.assert_allclose(np.asarray(found, dtype=float), expected, rtol=0, atol=tolerance * size)


def test_a_state_as_tables(trivet: Any) -> None:
    code, out, err = trivet(*STATE)
    assert (code, err) == (0, "")
    for words in (
        "what the forces are for", "M_Q, inertia seen by the drives", "leg-3.hinge", "coriolis", "force (5, 0, -3) N",
        "at (0, 0, 20) mm in {E}", "moment (0, 0.1, 0) N m", "free fall (0, 0, -9.81) m/s²",
    ):  # fmt: skip
        assert words in out
    assert "nan" not in out.lower()


def test_a_state_as_json_is_that_of_the_api(trivet: Any) -> None:
    found, report = json.loads(trivet(*STATE, "--json")[1]), state()
    assert found["reached"] is True
    for k, drive in enumerate(found["drives"]):
        unit, way = ("N_m", "rad") if "guide" in drive["name"] else ("N", "m")
        assert drive["name"] == report.actuators[k]
        assert drive[f"force_{unit}"] == pytest.approx(report.drives.force[k], rel=1e-9)
        assert drive[f"speed_{way}_per_s"] == pytest.approx(report.drives.speed[k], rel=1e-9)
        assert drive[f"acceleration_{way}_per_s2"] == pytest.approx(report.drives.acceleration[k], rel=1e-9)
        assert drive["power_W"] == pytest.approx(report.powers[k], rel=1e-9)
        assert sum(drive["force_shares"].values()) == pytest.approx(drive[f"force_{unit}"], rel=1e-9)
    close(found["actuator_space_SI"]["M_Q"], report.equations.actuators.inertia)
    close(found["task_space_SI"]["M_t"], report.equations.task.inertia)
    close(found["task_space_SI"]["inverse_jacobian"], report.equations.task.jacobian)
    close(found["twist_m_per_s_rad_per_s"], [0.05, 0, -0.02, 0.5, 0, np.radians(20)])
    assert set(found["joint_wrenches_N_Nm"]) == set(report.reactions)
    close(found["joint_wrenches_N_Nm"]["leg-2.ball"], report.reactions["leg-2.ball"])
    assert (found["kinetic_energy_J"], found["potential_energy_J"]) == pytest.approx(report.energy, rel=1e-12)
    assert (found["force_N"], found["force_at_in_E_m"]) == ([5, 0, -3], [0, 0, 0.02])
    assert "force_slopes_SI" not in found


def test_sensitivity_names_dimensions(trivet: Any) -> None:
    """A slope against the difference of the forces of two machines."""
    at_home = ("dynamics", "azulay", "--json")
    slopes = json.loads(trivet(*at_home, "--sensitivity")[1])["force_slopes_SI"]["dimensions"]
    (path,) = (key for key in slopes if key.endswith("link.length"))
    step = 1e-6

    def forces(length: float) -> np.ndarray:
        drives = t.dynamics_report(f"azulay@link.length={length!r} m").drives
        return np.asarray(drives.force)

    close(slopes[path], (forces(0.216 + step) - forces(0.216 - step)) / (2 * step), 1e-5)
    code, out, _ = trivet("dynamics", "azulay", "--sensitivity")
    assert (code, "when a dimension grows by 1 %" in out, "link.length" in out) == (0, True, True)


def test_a_straight_way_as_json_is_that_of_the_api(trivet: Any) -> None:
    found, report = json.loads(trivet(*UP, "--json")[1]), upwards()
    assert found["duration_s"] == pytest.approx(report.trajectory.duration, rel=1e-12)
    close(found["time_s"], report.time)
    close(found["position_m"], np.stack(list(report.moving.pose.origin), axis=1))
    close(found["drive_coordinates_m_or_rad"], report.coordinates)
    close(found["drive_forces_N_or_N_m"], report.drives.force)
    close(found["drive_powers_W"], report.powers)
    for drive, own in zip(found["drives"], report.drive_sizing, strict=True):
        force = "N" if own.unit == "m" else "N_m"
        assert drive["peak_force"][f"value_{force}"] == pytest.approx(own.force.value, rel=1e-9)
        assert drive["peak_force"]["time_s"] == own.force.time
        assert drive[f"rms_force_{force}"] == pytest.approx(own.rms_force, rel=1e-9)
        assert drive["mean_power_given_W"] == pytest.approx(own.mean_power, rel=1e-9, abs=1e-15)
    assert [joint["name"] for joint in found["joints"]] == [joint.name for joint in report.joint_sizing]
    assert found["least_sigma_min"] == pytest.approx(report.sigma_min.min(), rel=1e-9)


def test_ways_as_tables_and_files(trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet(*UP, "--figure", "m.png", "--figure", "m.html", "--data", "m.nc")
    assert (code, err.splitlines()) == (0, ["wrote m.png", "wrote m.html", "wrote m.nc"])
    for words in ("what they must give", "what the joints must bear", "where on the path the forces are greatest"):
        assert words in out
    assert (tmp_path / "m.png").stat().st_size > 10_000
    page = (tmp_path / "m.html").read_text(encoding="utf-8")
    assert "azulay: what a motion asks of the drives" in page
    assert "http" not in page.split("<script")[0]
    report = upwards()
    with xr.open_dataset(tmp_path / "m.nc", engine="h5netcdf") as data:
        close(data.drive_force, report.drives.force)
        close(data.joint_wrench, report.reactions)
        close(data.time, report.time)
        assert list(data.drive.values) == report.actuators
        assert data.joint_wrench.dims == ("time", "joint", "component")
        assert data.attrs["working_mode"] == "++ ++ ++"
        assert "format = 1" in data.attrs["machine_file"]


def test_limits_duration_and_step_are_taken(trivet: Any) -> None:
    def run(*options: str) -> Any:
        return json.loads(trivet("dynamics", "azulay", "--json", *options)[1])

    to = ("--to", "0 mm, 0 mm, 130 mm", "--to-tilt", "2 deg")
    slow = run(*to, "--speed", "5 mm/s", "--max-acceleration", "0.1 m/s^2", "--jerk", "10 m/s^3", "--samples", "50")
    assert slow["duration_s"] == pytest.approx(1 + 0.05 + 0.01, rel=1e-9)
    turning = run("--to-tilt", "5 deg", "--angular-speed", "2 deg/s", "--samples", "50")
    assert 2.5 < turning["duration_s"] < 3.0
    assert turning["position_m"][-1] == [0, 0, 0.125]
    stepped = run(*to, "--duration", "1.5 s", "--step", "15 ms")
    assert stepped["duration_s"] == pytest.approx(1.5)
    assert 101 <= len(stepped["time_s"]) <= 110


def test_circles_and_path_files(trivet: Any, tmp_path: Path) -> None:
    found = json.loads(trivet("dynamics", "azulay", "--circle", "2 mm", "--samples", "100", "--json")[1])
    place = np.array(found["position_m"])
    np.testing.assert_allclose(np.hypot(*place[:, :2].T), 0.002, rtol=1e-9)
    np.testing.assert_allclose(place[[0, -1]], [[0.002, 0, 0.125]] * 2, atol=1e-12)
    poses = ("0 mm, 0 mm, 125 mm", "2 mm, 1 mm, 124 mm", "0 mm, 3 mm, 126 mm")
    written = "".join(f"[[poses]]\nposition = {json.dumps(pose.split(', '))}\n" for pose in poses)
    (tmp_path / "p.toml").write_text('corners = "stop"\n' + written)
    found = json.loads(trivet("dynamics", "azulay", "--path", "p.toml", "--samples", "100", "--json")[1])
    place = np.array(found["position_m"])
    assert np.linalg.norm(place - [0.002, 0.001, 0.124], axis=1).min() < 1e-9
    np.testing.assert_allclose(place[-1], (0, 0.003, 0.126), atol=1e-12)


def test_simulations_as_json_are_those_of_the_api(trivet: Any) -> None:
    found, result = json.loads(trivet(*SHORT, "--json")[1]), let_go()
    close(found["time_s"], result.time)
    close(found["position_m"], np.stack(list(result.state.pose.origin), axis=1))
    close(found["drive_forces_N_or_N_m"], result.forces)
    close(found["natural_frequencies_Hz"], result.frequencies)
    close(found["energies_J"]["kinetic"], result.balance.kinetic)
    assert set(found["energies_J"]) == {"kinetic", "potential", "springs", "dissipated", "put_in"}
    assert (found["ended"], found["steps"], found["drives"]) == (None, result.steps, "springs")
    assert found["energy_drift"] < 1e-11
    assert found["greatest_gap_m"] < 1e-12


def test_simulations_as_tables_and_files(trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet(*SHORT, "--figure", "s.png", "--figure", "s.html", "--data", "s.nc")
    assert (code, err.splitlines()) == (0, ["wrote s.png", "wrote s.html", "wrote s.nc"])
    assert "natural frequencies on the drives' springs: 473.4, 489.5, 489.5, 640.1, 640.1, 643.2 Hz" in out
    assert "energy drift" in out
    assert (tmp_path / "s.png").stat().st_size > 10_000
    assert (tmp_path / "s.html").stat().st_size > 100_000
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as data:
        result = let_go()
        close(data.position, np.stack(list(result.state.pose.origin), axis=1))
        close(data.kinetic_energy, result.balance.kinetic)
        assert (data.attrs["drives"], data.attrs["ended"]) == ("springs", "")
        assert data.drive_force.dims == ("time", "drive")


def test_pushes_have_units(trivet: Any) -> None:
    options = (
        "simulate",
        "azulay",
        "--drives",
        "free",
        "--gravity",
        "0 m/s^2, 0 m/s^2, 0 m/s^2",
        "--duration",
        "5 ms",
        "--json",
    )
    found = json.loads(trivet(*options, "--samples", "51", "--push", "leg-1.slide=-500 mN", "--push", "leg-2.guide=20 N mm")[1])
    close(found["drive_forces_N_or_N_m"][-1], [0, 0.02, 0, -0.5, 0, 0])
    assert found["natural_frequencies_Hz"] == [0.0] * 6


def test_a_run_that_ends_early_says_why(trivet: Any) -> None:
    options = ("simulate", "azulay", "--drives", "free", "--duration", "0.2 s", "--samples", "51")
    code, out, _ = trivet(*options)
    assert code == 0
    assert "ended at t = 0.122821 s: leg-" in out
    assert "above its limit of 65 mm" in out
    assert json.loads(trivet(*options, "--json", "--anyway")[1])["ended"] is None


def test_export_as_json(trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet("export", "tahmasebi", "m.urdf", "--json")
    found = json.loads(out)
    assert (code, found["format"], found["open_loops"]) == (0, "urdf", ["leg-2.hinge", "leg-3.hinge"])
    assert "URDF cannot close loops: leg-2.hinge, leg-3.hinge are not in the file" in err
    assert (tmp_path / "m.urdf").read_text(encoding="utf-8") == t.to_urdf("tahmasebi")
    found = json.loads(trivet("export", "azulay", "m.xml", "--json")[1])
    assert (found["format"], found["open_loops"]) == ("mjcf", [])


TO = ("dynamics", "azulay", "--to", "0 mm, 0 mm, 130 mm")
WRONG = [
    (("dynamics", "azulay", "--figure", "d.png"), "a motion can be drawn and saved"),
    (("dynamics", "azulay", "--data", "d.nc"), "give --to, --circle or --path"),
    (("dynamics", "azulay", "--velocity", "1 m/s, 0 m/s"), "--velocity"),
    (("dynamics", "azulay", "--velocity", "1 m, 0 m, 0 m"), "not a unit of speed"),
    (("dynamics", "azulay", "--acceleration", "1, 0, 0"), "--acceleration"),
    (("dynamics", "azulay", "--force", "1 N, 0 N, nan N"), "--force"),
    (("dynamics", "azulay", "--mode", "+"), 'the signs "++ ++ ++"'),
    (("dynamics", "azulay", "--set", "link.size=1 mm"), "link.size"),
    ((*TO, "--step", "1 s"), "--step: 1 s is too large for a motion of"),
    ((*TO, "--step", "0.1 us"), "--step: 1e-07 s makes"),
    ((*TO, "--samples", "10"), "samples: 10 are too few"),
    ((*TO, "--circle", "2 mm"), "--to, --circle and --path: give one of them"),
    ((*TO, "--velocity", "1 m/s, 0 m/s, 0 m/s"), "along a path the path says"),
    ((*TO, "--sensitivity"), "along a path the path says"),
    ((*TO, "--speed", "0 m/s"), "--speed"),
    ((*TO, "--jerk", "5 m/s^2"), "--jerk"),
    ((*TO, "--duration", "1 ms"), "duration: 0.001 s is too short"),
    ((*TO, "--figure", "m.pdf"), ".png or .html"),
    ((*TO, "--data", "m.csv"), "ends in .nc"),
    (("dynamics", "azulay", "--to", "0 mm, 0 mm, 125 mm"), "the path has no extent"),
    (("dynamics", "azulay", "--circle", "-1 mm"), "--circle"),
    (("dynamics", "azulay", "--path", "nowhere.toml"), "nowhere.toml: cannot be read"),
    (("dynamics", "azulay", "--path", "nowhere.toml", "--speed", "1 m/s"), "leave the other options out"),
    (("dynamics", "azulay", "--path", "nowhere.toml", "--tilt", "1 deg"), "leave the other options out"),
    (("simulate", "azulay", "--drives", "spring"), "did you mean 'springs'"),
    (("simulate", "azulay", "--duration", "0 s"), "--duration"),
    (("simulate", "azulay", "--duration", "1 mm"), "not a unit of time"),
    (("simulate", "azulay", "--step", "1 ms"), "step: 0.001 s is too large for the fastest vibration"),
    (("simulate", "azulay", "--samples", "1"), "samples: 1"),
    (("simulate", "azulay", "--push", "leg-1.slide=5 N m"), "--push leg-1.slide"),
    (("simulate", "azulay", "--push", "leg-1.guide=5 N"), "--push leg-1.guide"),
    (("simulate", "azulay", "--push", "leg-1.slid=5 N"), "did you mean 'leg-1.slide'"),
    (("simulate", "azulay", "--push", "5 N"), "expected DRIVE=FORCE"),
    (("dynamics", "azulay", "--speed", "50 mm/s"), "--speed: speaks of a motion"),
    (("dynamics", "azulay", "--samples", "100"), "--samples: speaks of a motion"),
    (("dynamics", "azulay", "--at", "0 mm, 0 mm, 50 mm"), "--at: says where a force acts"),
    (("dynamics", "azulay", "--velocity", "1e200 m/s, 0 m/s, 0 m/s"), "beyond all reason"),
    ((*TO, "--duration", "1e9 s"), "at most 1e+06 s"),
    ((*TO, "--speed", "1e-15 m/s"), "orders of magnitude"),
    (("simulate", "azulay", "--drives", "free", "--duration", "1e17 s"), "steps"),
    (("export", "azulay", "m.urdf", "--mode", "++ ++ ++"), "--mode: a URDF tree has no working mode"),
    (("export", "azulay", "m.sdf"), "a tree in .urdf"),
    (("export", "nowhere", "m.urdf"), "no machine of this name"),
    (("export", "azulay", "folder/m.urdf"), "cannot be written"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(a) for a, _ in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(trivet: Any, arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    code, out, err = trivet(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


NO_RESULT = [
    (("dynamics", "azulay", "--position", "0 mm, 0 mm, 50 mm"), "above its limit of 65 mm"),
    (("dynamics", "azulay", "--position", "18 mm, 0 mm, 125 mm"), "is a Type 2 singularity"),
    (("dynamics", "azulay", "--to-tilt", "57 deg", "--data", "m.nc"), "meets a Type 2 singularity at t = 0.6235"),
    (("dynamics", "azulay", "--to", "0 mm, 0 mm, 0.2 m", "--figure", "m.png"), "leg-1.slide at"),
    (("dynamics", "azulay", "--to", "0 mm, 0 mm, 0.3 m", "--anyway"), "leg-1 cannot close"),
    (("simulate", "azulay", "--position", "0 mm, 0 mm, 50 mm", "--data", "s.nc"), "above its limit of 65 mm"),
    (("simulate", "azulay", "--position", "18 mm, 0 mm, 125 mm"), "no run starts at a Type 2 singularity"),
]


@pytest.mark.parametrize(("arguments", "message"), NO_RESULT, ids=[" ".join(a) for a, _ in NO_RESULT])
def test_no_result_is_one_line_and_exit_code_1(trivet: Any, arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    code, out, err = trivet(*arguments)
    assert (code, out) == (1, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [(*UP, "--figure", "a.png"), (*SHORT, "--data", "a.nc"), ("export", "azulay", "a.urdf")])
def test_files_are_not_overwritten_unasked(trivet: Any, arguments: tuple[str, ...], tmp_path: Path) -> None:
    file = tmp_path / arguments[-1]
    file.write_text("precious")
    code, out, err = trivet(*arguments)
    assert (code, out, "exists already" in err) == (2, "", True)
    assert file.read_text() == "precious"
    assert trivet(*arguments, "--overwrite")[0] == 0
    assert file.read_bytes()[:8] != b"precious"


def test_nothing_half_written_is_left(trivet: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where drawing fails in its middle."""
    from matplotlib.figure import Figure

    def fails(_: Figure, path: Path, **__: Any) -> None:
        path.write_text("half a picture")
        raise t.NoResultError("the ink has run out")

    monkeypatch.setattr(Figure, "savefig", fails)
    code, _, err = trivet(*SHORT, "--figure", "s.png")
    assert (code, err.strip().splitlines()) == (1, ["trivet: the ink has run out"])
    assert list(tmp_path.iterdir()) == []
