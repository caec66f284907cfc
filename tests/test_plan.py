"""Plans: the paper's question, independent checks at fifty times finer steps, cones, the command."""

from __future__ import annotations

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any, get_type_hints

import jax
import numpy as np
import pytest
import xarray as xr
from plain_machines import azulay as met
from plain_machines import read, rotation

import trivet as t
from trivet.kinematics.jacobian import inverse_jacobian
from trivet.model import dimensions, load
from trivet.reach.margins import side
from trivet.reach.touch import Touch
from trivet.study.aims import read_aims
from trivet.study.cone import cone
from trivet.study.pathfile import read_path
from trivet.study.plan import Plan, plan, plan_along, plans
from trivet.study.requirements import Requirements, Settings
from trivet.study.roll_grid import frames_of
from trivet.views.plan_cases import _grouped

FINER = 50


def walked(touch: Touch, step: float) -> np.ndarray:
    """Coordinates (6, n) along knots, in steps of at most `step` (rad)."""
    knots = np.stack(touch)
    parts = []
    for k in range(knots.shape[1] - 1):
        count = max(2, math.ceil(np.abs(knots[3:, k + 1] - knots[3:, k]).max() / step))
        parts.append(knots[:, [k]] + (knots[:, [k + 1]] - knots[:, [k]]) * np.arange(count) / count)
    return np.concatenate([*parts, knots[:, -1:]], axis=1)


def checked(found: Plan, length: float) -> None:
    """A plan of azulay against plain NumPy, at fifty times finer steps than its grid."""
    assert found.knots is not None
    assert found.proof is not None
    way = walked(found.knots, found.grid.step / FINER)
    turn = rotation(*way[3:])
    place = way[:3].T + found.rules.radius * turn[:, :, 2]
    plain = met(place, turn, found.mode, length)
    assert plain.closes.all()
    assert plain.inside.all() or not found.rules.limits
    assert plain.sigma.min() >= found.proof.demand.sigma_min
    assert len(set(np.sign(plain.determinant))) == 1
    assert plain.sigma.min() == pytest.approx(found.sigma_min, rel=0.02)
    jumps = np.abs(np.angle(np.exp(1j * np.diff(plain.heading, axis=0))))
    assert jumps.max() < 0.5
    assert way[4, 0] == 0
    assert way[4, -1] == found.grid.path.tilt[-1]


@pytest.mark.parametrize(("name", "height"), [("azulay", 0.121), ("eclipse", 0.17), ("alizade", 0.157), ("glozman", 0.168)])
def test_no_machine_of_the_paper_gets_to_the_horizon_in_its_own_mode(name: str, height: float) -> None:
    """physics.md 5: whatever the roll, limits and bodies, a Type 2 singularity lies across."""
    for limits in (True, False):
        found = plan(name, 0.004, height, limits=limits, bodies=limits, step=math.radians(2), rolls=90)
        assert not found.is_possible
        words, _, ring = found.stopped_by.partition("; ")
        assert words == (
            "start and end lie on different sides of a Type 2 singularity at every roll, which is proven, "
            "whatever limits and bodies"
        )
        # The ring, sign by sign at steps of a tenth of a degree.
        tilts, rolls = np.meshgrid(np.radians(np.arange(0.05, 90, 0.1)), np.radians(np.arange(0, 360, 4)), indexing="ij")
        still = np.zeros(tilts.size)
        touch = Touch(still, still, still + height, still, tilts.ravel(), rolls.ravel())
        sides = side(found.machine, frames_of(touch, 0.004), found.rules.signs).reshape(tilts.shape)
        crossed = np.degrees(tilts[:-1][sides[:-1] * sides[1:] < 0]) + 0.05
        told = re.fullmatch(r"det J_x changes sign at tilts from (.*) to (.*) deg", ring)
        assert told is not None
        assert [float(told[1]), float(told[2])] == pytest.approx([crossed.min(), crossed.max()], abs=0.15)
        assert math.radians(15) < found.grid.path.tilt[found.highest] < math.radians(60)


def test_another_mode_gets_there_and_it_is_proven() -> None:
    found = plan("azulay", 0.004, 0.11, mode="++ ++ -+")
    assert found.is_safe
    assert found.is_steady
    assert found.bottleneck == pytest.approx(0.4753, abs=2e-4)
    assert found.value > 0.98 * found.bottleneck
    checked(found, 0.216)
    # Modes that only name the chains differently are worth the same.
    same = plan("azulay", 0.004, 0.11, mode="-+ ++ ++", proof=False)
    assert same.bottleneck == pytest.approx(found.bottleneck, rel=1e-3)


def test_the_grid_of_a_plan_is_the_plain_one() -> None:
    found = plan("azulay", 0.004, 0.11, mode="++ ++ -+", bodies=False, proof=False, step=math.radians(3), rolls=60)
    rows, columns = np.indices(found.grid.shape)
    touch = np.stack(found.grid.at(rows.ravel(), columns.ravel()))
    turn = rotation(*touch[3:])
    plain = met(touch[:3].T + 0.004 * turn[:, :, 2], turn, found.mode, 0.216)
    is_open = np.isfinite(found.field.value.ravel())
    assert not np.any(is_open & ~plain.inside)
    assert np.mean(plain.inside & ~is_open) < 0.02  # what is kept in hand
    np.testing.assert_allclose(found.field.value.ravel()[is_open], plain.sigma[is_open], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        found.signed_sigma.ravel()[is_open], (np.sign(plain.determinant) * plain.sigma)[is_open], atol=1e-12
    )


def test_other_aims() -> None:
    settings: Any = {"mode": "++ ++ -+", "height": 0.11, "step": math.radians(3), "rolls": 60, "proof": False, "bodies": False}
    sigma = plan("azulay", **settings)
    stiff = plan("azulay", aims=read_aims(["K_xx"]), **settings)
    both = plan("azulay", aims=read_aims(["K_xx=1 N/um", "sigma_min=0.1"]), **settings)
    assert sigma.along is not None
    assert stiff.along is not None
    assert both.along is not None
    worst = int(stiff.along.value.argmin())
    there = Touch(*(float(c[worst]) for c in stiff.along.touch))
    pose = t.pose(
        "azulay", position=(0.004 * math.sin(there.tilt), 0.0, 0.11 + 0.004 * math.cos(there.tilt)), tilt=there.tilt,
        roll=there.roll, mode="++ ++ -+",
    )  # fmt: skip
    assert stiff.value == pytest.approx(pose.diagonal("K_xx"), rel=1e-6)
    assert stiff.sigma_min <= sigma.sigma_min
    pairs = np.minimum(both.along.value * 0 + both.sigma_min / 0.1, np.inf)
    assert both.value <= pairs.min() + 1e-12


def test_aims_as_they_are_written() -> None:
    both = read_aims(("sigma_min=0.1", "K_xx=5 N/um"))
    assert [aim.unit for aim in both] == pytest.approx([0.1, 5e6])
    assert read_aims(("sigma_min=0.1", both[1])) == both
    assert read_aims("K_xx") == read_aims(("K_xx",))
    assert read_aims(both[1]) == both[1:]  # type: ignore[arg-type]
    coarse: Any = {"mode": "++ ++ -+", "to": 0.4, "step": 0.2, "rolls": 24, "proof": False, "bodies": False}
    written = t.plan("azulay", 0.004, 0.11, aims=("sigma_min=0.1", "K_xx=5 N/um"), **coarse)
    assert written.value == t.plan("azulay", 0.004, 0.11, aims=both, **coarse).value
    with pytest.raises(t.InputError, match="did you mean"):
        t.cone("azulay", 0.2, aims=("sigma_max",))


def test_plans_in_a_line() -> None:
    coarse: Any = {"step": math.radians(5), "rolls": 24}
    found = plan("azulay", 0.004, 0.11, mode="++ ++ -+", **coarse)
    assert repr(found) == f"<Plan: azulay, mode ++ ++ -+, to tilt 90 deg: proven, least value {found.value:.4g}>"
    assert repr(plan("azulay", 0.004, **coarse)) == "<Plan: azulay, mode ++ ++ ++, to tilt 90 deg: no way>"
    small = cone("azulay", 0.1, step=0.1, rolls=24, azimuths=6, proof=False)
    assert repr(small) == f"<ConePlan: azulay, mode ++ ++ ++, up to 5.73 deg: {small.verdict}, least value {small.value:.4g}>"


def test_a_given_start_is_kept() -> None:
    roll = math.radians(100)
    found = plan("azulay", 0.004, 0.11, mode="++ ++ -+", start_roll=roll, step=math.radians(3), rolls=60)
    assert found.is_safe
    assert found.knots is not None
    assert found.knots.roll[0] == pytest.approx(roll)
    turned = plan("azulay", 0.004, 0.11, mode="++ ++ -+", azimuth=1.0, start_roll=roll, step=math.radians(3), rolls=60)
    assert turned.knots is not None
    assert turned.knots.roll[0] + turned.knots.azimuth[0] == pytest.approx(roll)


def test_a_way_around_what_the_grid_does_not_see() -> None:
    """On the best way of this mode a ball crosses the axis of the guides, where its carriage jumps: seen by the proof alone."""
    found = plan("glozman", mode="++ +- +-")
    assert found.is_safe
    assert found.value < 0.3
    plainly = plan("glozman", mode="++ +- +-", proof=False)
    assert plainly.value > 0.34


def test_a_cone_with_one_roll_for_each_direction() -> None:
    found = cone("azulay", math.radians(20), step=math.radians(4), rolls=60, azimuths=24)
    assert found.is_safe
    assert found.sheet is not None
    assert found.proof is not None
    rng = np.random.default_rng(9)
    rays, rows = found.knots.roll.shape
    u, v = rng.uniform(0, rays - 1, 20_000), rng.uniform(0, rows - 1, 20_000)
    i, j = np.minimum(u.astype(int), rays - 2), np.minimum(v.astype(int), rows - 2)
    p, q = u - i, v - j
    knots = np.stack(found.knots)
    way = ((1 - p) * (1 - q) * knots[:, i, j] + p * (1 - q) * knots[:, i + 1, j] + (1 - p) * q * knots[:, i, j + 1]
           + p * q * knots[:, i + 1, j + 1])  # fmt: skip
    turn = rotation(*way[3:])
    plain = met(way[:3].T + 0.004 * turn[:, :, 2], turn, found.mode, 0.216)
    assert plain.inside.all()
    assert plain.sigma.min() >= found.proof.least.sigma_min
    assert len(set(np.sign(plain.determinant))) == 1
    # At the pole all azimuths mean one pose.
    heading = (found.knots.azimuth + found.knots.roll)[:, 0]
    np.testing.assert_allclose(heading, heading[0], atol=1e-12)
    np.testing.assert_allclose(found.knots.roll[0] - 2 * np.pi, found.knots.roll[-1], atol=1e-12)


def test_a_cone_beyond_the_ring_has_no_roll() -> None:
    found = cone("azulay", math.radians(44), step=math.radians(4), rolls=60, azimuths=12)
    assert found.sheet is None
    assert math.radians(20) < found.largest < math.radians(36)


def test_modes_in_order() -> None:
    study = plans(["azulay"], [0.11], ["++ ++ ++", "++ ++ -+"], proof=False, step=math.radians(3), rolls=60)
    assert [found.mode for found in study.plans] == ["++ ++ -+", "++ ++ ++"]
    everything = plans(["alizade"], modes=["all"], proof=False, step=math.radians(5), rolls=36, bodies=False)
    assert len(everything.plans) == 8


def test_settings_are_the_requirements_by_keywords() -> None:
    assert list(get_type_hints(Settings).items()) == list(get_type_hints(Requirements).items())
    with pytest.raises(TypeError, match="heigth"):
        plan("azulay", heigth=0.11)  # type: ignore[call-arg]
    for asked in (plan, cone):
        with pytest.raises(t.InputError, match="must be above zero"):
            asked("azulay", 0.1, sigma=-1.0)  # type: ignore[operator]


def test_reasons_are_worked_out_only_when_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[int] = []
    monkeypatch.setattr("trivet.study.plan.stop", lambda *what: told.append(1) or "something")
    found = plan("azulay", 0.004, 0.121, step=math.radians(5), rolls=36, bodies=False)
    assert not found.is_possible
    assert not told
    assert found.stopped_by == "something"


def _is_labelled(data: xr.Dataset, machine: str) -> None:
    assert data.attrs["machine"] == machine
    assert t.parse(tomllib.loads(data.attrs["machine_file"])).name == machine
    assert all(data[name].attrs["units"] and data[name].attrs["long_name"] for name in data.data_vars)


def test_plans_as_netcdf(tmp_path: Path) -> None:
    coarse: Any = {"step": math.radians(5), "rolls": 36, "proof": False}
    modes = ["++ ++ ++", "++ ++ -+"]
    study = plans(["azulay"], [0.11], modes, aims=("K_xx",), **coarse)
    t.save(study, tmp_path / "plans.nc")
    way, none = (xr.load_dataset(tmp_path / "plans.nc", group=f"{k}-azulay", engine="h5netcdf") for k in (1, 2))
    _is_labelled(way, "azulay")
    _is_labelled(none, "azulay")
    found = study.plans[0]
    assert found.knots is not None
    assert found.along is not None
    assert found.drives is not None
    assert (way.attrs["working_mode"], way.attrs["possible"], way.attrs["verdict"]) == (modes[1], 1, "no proof asked for")
    assert (none.attrs["working_mode"], none.attrs["possible"], none.attrs["verdict"]) == (modes[0], 0, "no way")
    assert none.attrs["stopped_by"] == study.plans[1].stopped_by
    assert way["value"].attrs["units"] == way["sample_value"].attrs["units"] == "N/m"
    np.testing.assert_array_equal(way["value"], np.where(np.isfinite(found.field.value), found.field.value, np.nan))
    np.testing.assert_array_equal(way["side"], found.field.side)
    np.testing.assert_array_equal(way["roll"][3], found.grid.at(np.full(36, 3.0), np.arange(36)).roll)
    for name, touch in (("knot", found.knots), ("sample", found.along.touch)):
        np.testing.assert_array_equal(way[f"{name}_centre"].T, np.stack(touch[:3]))
        for part in ("azimuth", "tilt", "roll"):
            np.testing.assert_array_equal(way[f"{name}_{part}"], getattr(touch, part))
            assert way[f"{name}_{part}"].attrs["units"] == "rad"
    for name, own in (("value", "value"), ("sigma_min", "sigma_min"), ("travel_margin", "travel"), ("clearance", "clearance")):
        np.testing.assert_array_equal(way[f"sample_{name}"], getattr(found.along, own))
    np.testing.assert_array_equal(way["knot_drive"].sel(drive="leg-2.slide"), found.drives.knots[:, 4])
    assert way["drive_unit"].sel(drive="leg-2.slide") == "m"
    np.testing.assert_array_equal(way["drive_rate"], found.drives.rates)


def test_a_cone_as_netcdf(tmp_path: Path) -> None:
    found = cone("azulay", 0.1, step=0.05, rolls=36, azimuths=12)
    t.save(found, tmp_path / "cone.nc")
    data = xr.load_dataset(tmp_path / "cone.nc", engine="h5netcdf")
    _is_labelled(data, "azulay")
    assert data.attrs["verdict"] == "proven"
    np.testing.assert_array_equal(data["roll"], found.knots.roll)
    np.testing.assert_array_equal(data["azimuth"], found.knots.azimuth[:, 0])
    turn = rotation(*np.stack([np.ravel(c) for c in found.knots])[3:])
    plain = met(np.array([0, 0, 0.121]) + 0.004 * turn[:, :, 2], turn, found.mode, 0.216)
    np.testing.assert_allclose(np.ravel(data["sigma_min"]), plain.sigma, atol=1e-12)
    np.testing.assert_allclose(np.ravel(data["travel_margin"]), plain.travel, atol=1e-9)
    assert data["clearance"].attrs["units"] == "m"
    none = cone("azulay", math.radians(44), step=math.radians(11), rolls=24, azimuths=6)
    t.save(none, tmp_path / "none.nc")
    data = xr.load_dataset(tmp_path / "none.nc", engine="h5netcdf")
    assert data.attrs["possible"] == 0
    assert data["roll"].isnull().all()
    assert float(data["widest"]) == none.largest


# The command.


def test_a_plan_in_words(trivet: Any) -> None:
    code, out, _ = trivet("plan", "azulay", "--mode", "++ ++ -+", "--height", "110 mm", "--step", "3 deg", "--rolls", "60")
    assert code == 0
    assert "PROVEN between these poses too" in out
    assert re.search(
        r"10\.\d % of half the travel left \(leg-3\.slide at tilt 0 deg\), clearance 2\.1\d mm \(leg-\d\.link and leg-\d\.link",
        out,
    )
    assert re.search(r"fastest of the drives is leg-3\.slide: 0\.3\d+ mm per degree that the platform turns, at tilt 7", out)
    code, out, _ = trivet("plan", "azulay", "--step", "3 deg", "--rolls", "60")
    assert code == 1
    assert "NO way: start and end lie on different sides" in out


COARSE = ("plan", "azulay", "--mode", "++ ++ -+", "--height", "110 mm", "--step", "5 deg", "--rolls", "36")


@pytest.mark.parametrize(("name", "value", "verdict", "code"), [("SHARE", 1.5, "REFUTED", 1), ("BUDGET", 1, "NOT proven", 0)])
def test_what_is_met_stands_beside_a_proof_that_fails(
    name: str, value: float, verdict: str, code: int, trivet: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"trivet.study.requirements.{name}", value)
    found, out, _ = trivet(*COARSE)
    assert found == code
    assert out.count(verdict) == 1
    assert re.search(
        r"least at samples: sigma_min 0\.47\d+, .*\n.*\n" + verdict + r".*\n.*; at its middle sigma_min 0\.\d+, "
        r"\d+\.\d % of half the travel left, clearance \d+\.\d\d mm", out
    )  # fmt: skip
    found, out, _ = trivet(*COARSE, "--json")
    assert found == code
    proof = json.loads(out)["plans"][0]["proof"]
    assert proof["met_there"]["sigma_min"] > 0.47
    assert proof["open_at"]["z_m"] == pytest.approx(0.11)
    found, out, _ = trivet("plan", "azulay", "--cone", "8 deg", "--step", "4 deg", "--rolls", "24")
    assert found == code
    assert "; at its middle sigma_min 0." in out


def test_a_cone_without_a_roll_is_no_result(trivet: Any) -> None:
    code, out, _ = trivet("plan", "azulay", "--cone", "44 deg", "--step", "11 deg", "--rolls", "24")
    assert code == 1
    assert "NO roll that is continuous" in out


def test_the_machine_is_found_at_its_worst() -> None:
    """The joint and the bodies that are named have what is told, by the report of the pose."""
    found = plan("azulay", 0.004, 0.11, mode="++ ++ -+", step=math.radians(5), rolls=36, proof=False)
    assert found.along is not None
    assert found.closest is not None
    for sample in (found.closest.joint_at, found.closest.bodies_at):
        there = Touch(*(float(c[sample]) for c in found.along.touch))
        place = (0.004 * math.sin(there.tilt), 0.0, 0.11 + 0.004 * math.cos(there.tilt))
        report = t.pose("azulay", position=place, tilt=there.tilt, roll=there.roll, mode="++ ++ -+")
        near = min(report.clearances, key=lambda c: c.distance)
        if sample == found.closest.bodies_at:
            assert near.distance == pytest.approx(found.clearance, abs=1e-9)
            assert {near.one, near.other} == {*found.closest.bodies}
        if sample == found.closest.joint_at:
            name, margin = found.closest.joint, found.travel
            joint = next(joint for joint in report.joints if joint.name == name)
            low, high = joint.low, joint.high
            assert 2 * min(joint.limited - low, high - joint.limited) / (high - low) == pytest.approx(margin, abs=1e-9)
    assert plan("glozman", 0.004, 0.168, to=0.1, step=0.05, rolls=24, proof=False).closest.joint == ""  # type: ignore[union-attr]


def test_drives_along_a_way() -> None:
    """Their coordinates by triangles, their rates by the inverse Jacobian."""
    found = plan("azulay", 0.004, 0.11, mode="++ ++ -+", azimuth=0.4, step=math.radians(5), rolls=36, proof=False)
    drives = found.drives
    assert drives is not None
    assert found.knots is not None
    turn = rotation(*np.stack(found.knots)[3:])
    place = np.stack(found.knots)[:3].T + 0.004 * turn[:, :, 2]
    plain = met(place, turn, found.mode, 0.216)
    own = dict(zip(drives.names, drives.knots.T, strict=True))
    for k in range(3):
        np.testing.assert_allclose(np.exp(1j * own[f"leg-{k + 1}.guide"]), np.exp(1j * plain.heading[:, k]), atol=1e-9)
        np.testing.assert_allclose(own[f"leg-{k + 1}.slide"], plain.joints[:, 3 * k + 1] - read("azulay").guide, atol=1e-9)
    where, drive = drives.fastest
    row = drives.rows[where]
    ends = [walked(found.knots, 1e-5)[:, k] for k in _around(found, row)]
    frames = frames_of(Touch(*np.stack(ends, axis=1)), 0.004)
    turns = rotation(*np.stack(ends, axis=1)[3:])
    change = turns[1] @ turns[0].T
    spin = np.array([change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]]) / 2
    move = np.diff(np.stack(frames.origin), axis=1)[:, 0]
    there = jax.tree.map(lambda c: float(np.mean(c)), frames)
    jacobian = inverse_jacobian(found.machine, there, found.rules.signs)
    rates = np.asarray(jacobian) @ np.concatenate([move, spin]) / np.linalg.norm(spin)
    np.testing.assert_allclose(drives.rates[where], rates, rtol=2e-3, atol=1e-5)
    scale = np.where(drives.is_angular, drives.size, 1.0)
    assert abs(rates[drive] * scale[drive]) == pytest.approx(np.abs(rates * scale).max())


def _around(found: Plan, row: float) -> tuple[int, int]:
    """Two neighbouring places of a finely walked way, about a row of the grid."""
    assert found.knots is not None
    tilt = float(np.interp(row, np.arange(found.grid.shape[0]), found.grid.path.tilt))
    way = walked(found.knots, 1e-5)
    k = int(np.searchsorted(way[4], tilt))
    return k - 1, k


def test_several_aims_in_words(trivet: Any) -> None:
    code, out, _ = trivet(*COARSE, "--no-proof", "--objective", "sigma_min=0.1", "--objective", "K_xx=5 N/um")
    assert code == 0
    told = re.search(
        r"least value (\S+) \(sigma_min (\S+), (\S+) of 0.1; K_xx (\S+) N/µm, (\S+) of 5 N/µm: K_xx governs\)", out
    )
    assert told is not None
    value, sigma, over_tenth, stiff, over_five = (float(text) for text in told.groups())
    assert value == over_five < over_tenth
    assert (sigma, stiff) == pytest.approx((0.1 * over_tenth, 5 * over_five), rel=1e-3)
    assert "the least of sigma_min over 0.1 and K_xx over 5 N/µm" in out
    code, out, _ = trivet(*COARSE, "--no-proof", "--objective", "sigma_min=0.1", "--objective", "K_xx=5 N/um", "--json")
    assert code == 0
    found = json.loads(out)["plans"][0]
    assert found["governs"] == "K_xx"
    assert found["at_worst"]["K_xx_N_per_m"] == pytest.approx(5e6 * found["value"])
    code, out, _ = trivet(*COARSE, "--no-proof", "--objective", "K_xx")
    assert code == 0
    assert re.search(r"least K_xx \d\.\d+ N/µm at", out)


def test_advice_is_told_as_an_option(trivet: Any) -> None:
    arguments = ("plan", "azulay", "--mode", "++ ++ -+", "--step", "5 deg", "--rolls", "36", "--advise")
    code, out, _ = trivet(*arguments)
    assert code == 1
    assert re.search(r"link\.length +216 mm .* travel .* yes +--set 'chains\.leg\.elements\.link\.length=21\d\.?\d* mm'", out)
    # Neutral axes make chains of their own of the copies; what is told of are the dimensions of the file.
    code, out, _ = trivet(*arguments, "--neutral", "home", "--height", "110 mm", "--json")
    assert code == 1
    found = json.loads(out)["advice"]
    assert {change["mends"] for change in found} == {"travel"}
    assert all(change["option"][0] in ("--set", "--height") for change in found)
    assert {change["dimension"] for change in found} <= {"height of the sphere", *dimensions(load("azulay"))}


def test_cases_in_a_table(trivet: Any) -> None:
    arguments = ("--mode", "all", "--height", "110 mm", "--step", "5 deg", "--rolls", "36", "--no-proof")
    code, out, _ = trivet("plan", "azulay", *arguments)
    assert code == 0
    lines = out.splitlines()
    assert lines[0].strip() == "64 cases; machine azulay; z0 110 mm; the best first"
    assert "machine" not in lines[1]
    assert lines[2].startswith("++ ++ -+, ++ -+ ++, -+ ++ ++  ")
    assert lines[2].split()[9] == "90°"
    assert re.search(r"^\+\+ \+\+ \+\+ +\d\d\.?\d*°", out, re.MULTILINE)
    assert re.search(r"^\+\+ \+- -\+, .* and 3 more ", out, re.MULTILINE)
    assert "det J_x" in out
    code, out, _ = trivet("plan", "azulay", "eclipse", "--to", "10 deg", "--step", "5 deg", "--rolls", "12", "--no-proof")
    assert code == 0
    assert out.splitlines()[1].split()[0] == "machine"


def test_modes_are_alike_only_where_the_chains_are_the_same() -> None:
    """Equal values of modes that choose otherwise are a matter of chance, or of limits that are not looked at."""
    modes = ["++ ++ ++", "-- -- --", "++ ++ +-", "+- ++ ++", "++ +- +-"]
    study = plans(["azulay"], [0.121], modes, proof=False, limits=False, bodies=False, to=0.1, step=0.05, rolls=36)
    values = {plan.mode: round(plan.bottleneck, 9) for plan in study.plans}
    assert values["++ ++ ++"] == values["-- -- --"]
    assert values["++ ++ +-"] == values["+- ++ ++"] == values["++ +- +-"]
    rows = sorted([plan.mode for plan in group] for group in _grouped(study.plans))
    assert rows == [["++ ++ ++"], ["++ ++ +-", "+- ++ ++"], ["++ +- +-"], ["-- -- --"]]


def test_a_plan_as_json_and_files(trivet: Any, tmp_path: Path) -> None:
    arguments = ("plan", "azulay", "alizade", "--mode", "all", "--step", "10 deg", "--rolls", "24", "--no-proof", "--no-bodies")
    code, out, _ = trivet(*arguments[:1], *arguments[2:], "--figure", "a.png", "--figure", "a.html", "--json")
    assert code == 0
    found = json.loads(out)["plans"]
    assert len(found) == 8
    assert found[0]["possible"]
    assert found[0]["knots"]["tilt_rad"][-1] == pytest.approx(math.pi / 2)
    drives = found[0]["drives"]
    assert len(drives["at_knots"]) == 6
    columns = [next(value for key, value in drive.items() if key.startswith("coordinate")) for drive in drives["at_knots"]]
    assert {len(column) for column in columns} == {len(found[0]["knots"]["tilt_rad"])}
    assert drives["fastest"]["name"] in {drive["name"] for drive in drives["at_knots"]}
    assert all((tmp_path / name).stat().st_size > 10_000 for name in ("a.png", "a.html"))
    one = ("plan", "azulay", "--mode", "++ ++ -+", "--height", "110 mm", "--step", "5 deg", "--rolls", "36")
    code, _, _ = trivet(*one, "--figure", "b.png", "--figure", "b.html", "--data", "b.nc")
    assert code == 0
    assert xr.load_dataset(tmp_path / "b.nc", group="1-azulay", engine="h5netcdf").attrs["verdict"] == "proven"
    assert all((tmp_path / name).stat().st_size > 10_000 for name in ("b.png", "b.html", "b.nc"))
    code, out, _ = trivet(
        "plan",
        "azulay",
        "--cone",
        "8 deg",
        "--step",
        "4 deg",
        "--figure",
        "c.png",
        "--figure",
        "c.html",
        "--json",
        "--data",
        "c.nc",
    )
    assert code == 0
    assert json.loads(out)["safe"]
    assert all((tmp_path / name).stat().st_size > 10_000 for name in ("c.png", "c.html", "c.nc"))


@pytest.mark.parametrize(("arguments", "words"), [
    (("plan", "azulay", "--objective", "sigma_max"), "did you mean"),
    (("plan", "azulay", "--objective", "sigma_min", "--objective", "K_xx"), "what counts as one"),
    (("plan", "azulay", "--objective", "K_xx=3 mm"), "objective"),
    (("plan", "azulay", "--objective", "sigma_min=-1"), "above zero"),
    (("plan", "azulay", "--sigma", "0"), "must be above zero"),
    (("plan", "azulay", "--to", "200 deg"), "up to 180 deg"),
    (("plan", "azulay", "--step", "0 deg"), "step"),
    (("plan", "azulay", "--rolls", "3"), "at least 8 rolls"),
    (("plan", "azulay", "--rolls", "100000000"), "no more than"),
    (("plan", "azulay", "--rolls", "9" * 400), "no more than"),
    (("plan", "azulay", "--cone", "20 deg", "--rolls", "9" * 400), "no more than"),
    (("plan", "azulay", "--cone", "20 deg", "--to", "40 deg"), "no --to"),
    (("plan", "azulay", "--cone", "20 deg", "--advise"), "no --to"),
    (("plan", "azulay", "--cone", "20 deg", "--mode", "all"), "takes one mode"),
    (("plan", "azulay", "--advise", "--mode", "all"), "of one machine, height and mode"),
    (("plan", "azulay", "--objective", "sigma_min=1e-320"), "1e-30"),
    (("plan", "azulay", "--mode", "+"), "has the signs"),
    (("plan", "azulay", "--radius", "0 mm"), "must be greater than zero"),
    (("plan", "azulay", "--cone", "95 deg"), "up to 90 deg"),
    (("plan", "azulay", "eclipse", "--cone", "5 deg"), "one machine"),
    (("plan", "azulay", "--solid", "--no-bodies"), "look at bodies"),
    (("plan", "rmmt@nothing=1"), "nothing"),
    (("plan",), "MACHINE"),
])  # fmt: skip
def test_wrong_input_is_one_line_and_exit_code_2(arguments: tuple[str, ...], words: str, trivet: Any) -> None:
    code, out, err = trivet(*arguments)
    assert code == 2
    assert not out
    assert words in err
    assert len(err.strip().splitlines()) == 1


def test_starts_and_ends_that_are_not_reached_are_named() -> None:
    low = plan("azulay", 0.004, 0.03, step=math.radians(5), rolls=36)
    assert low.stopped_by.startswith("at the start leg-1.slide at ")
    assert "is above its limit" in low.stopped_by or "is below its limit" in low.stopped_by
    touching = plan("azulay", 0.004, 0.11, mode="-- -- --", limits=False, step=math.radians(5), rolls=36)
    assert touching.stopped_by.startswith("at the start leg-")
    assert "overlap by" in touching.stopped_by
    lacking = plan("azulay", 0.004, 0.11, mode="++ ++ -+", sigma=0.9, step=math.radians(5), rolls=36)
    assert "sigma_min is 0.4" in lacking.stopped_by
    assert "0.9 is demanded" in lacking.stopped_by
    assert cone("azulay", 0.2, sigma=0.9, step=0.1, rolls=24, azimuths=8).sheet is None
    end = plan("azulay", 0.004, 0.121, neutral="normal", to=1.0, step=math.radians(5), rolls=36)
    assert "ball deviation" in end.stopped_by
    assert end.stopped_by.startswith("beyond tilt ")


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
azimuth = "150 deg"
tilt = "25 deg"
[[poses]]
position = ["-3 mm", "0 mm", "112 mm"]
azimuth = "200 deg"
tilt = "60 deg"
"""


def test_a_path_through_poses(tmp_path: Path, trivet: Any) -> None:
    (tmp_path / "path.toml").write_text(PATH, encoding="utf-8")
    found = plan_along("azulay", read_path(tmp_path / "path.toml"), mode="++ ++ -+", step=math.radians(2), rolls=90)
    assert found.is_safe
    assert found.knots is not None
    assert found.places is not None
    checked(found, 0.216)
    # It passes the poses: centre and normal.
    poses = np.interp(found.places, np.arange(found.grid.shape[0]), found.grid.marks)
    for number, place, azimuth, tilt in ((2, (0, 0, 0.114), 30, 25), (3, (0.003, 0.002, 0.112), 150, 25)):
        k = int(np.argmin(np.abs(poses - number)))
        assert poses[k] == pytest.approx(number)
        assert [float(c[k]) for c in found.knots[:3]] == pytest.approx(place)
        assert np.degrees([found.knots.azimuth[k], found.knots.tilt[k]]) == pytest.approx((azimuth, tilt))
    code, out, _ = trivet("plan", "azulay", "--path", "path.toml", "--step", "4 deg", "--rolls", "45", "--figure", "p.png")
    assert code == 1
    assert "assembled as described" in out
    assert "NO way" in out
    code, _, err = trivet("plan", "azulay", "--path", "path.toml", "--height", "110 mm")
    assert code == 2
    assert "--path: says where the platform goes" in err


def test_how_to_assemble_a_mode(trivet: Any) -> None:
    code, out, _ = trivet("plan", "azulay", "--mode", "++ +- -+", "--step", "10 deg", "--rolls", "24", "--no-proof")
    assert code == 1
    assert "leg-2 with its elbow the other way (-); leg-3 with its carriage on the far side of the guide's axis" in out
