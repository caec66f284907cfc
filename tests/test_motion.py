"""Motions along a path: what drives must do, against energies and plain NumPy; where a path leaves the machine."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from machines import changed
from numpy.polynomial.legendre import leggauss

import trivet as t
from trivet.dynamics.batch import Case, drive_motion, energies, equations, reactions
from trivet.dynamics.equations import State
from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.report import joint_names, joint_states
from trivet.kinematics.singularity import SINGULAR, conditions
from trivet.model import Machine, document_of, load, parse
from trivet.space.curve import circle, straight, through, timed
from trivet.space.pose import zyz_frame
from trivet.study.motion import FEWEST, MOST, MotionReport, motion

HOME = (0.0, 0.0, 0.125)
POSES = (
    zyz_frame(HOME, 0, 0, 0),
    zyz_frame((0.004, 0.002, 0.122), 0.5, 0.1, -0.3),
    zyz_frame((-0.002, 0.005, 0.118), 1.3, 0.15, -0.9),
    zyz_frame((0.001, -0.004, 0.128), 0.2, 0.05, 0.1),
)
LOADING = t.Loading(gravity=(1.0, -2.0, -9.0), force=(5.0, -3.0, 8.0), moment=(0.1, -0.2, 0.3), point=(0.0, 0.01, 0.02))


@cache
def rough() -> Machine:
    """The paper's machine with motors that weigh and joints that rub."""
    return changed(
        load("azulay"),
        {
            "guide": {"reflected_inertia": "0.4 kg", "damping": "3 N s/m", "friction": "1 N"},
            "slide": {"reflected_inertia": "0.2 kg", "damping": "2 N s/m"},
            "ball": {"damping": "0.01 N m s/rad", "friction": "0.02 N m"},
        },
    )


@cache
def smooth_run(resisting: bool = False) -> MotionReport:
    """A smooth way through four poses; with friction also under a load, or by its weight alone."""
    machine = rough() if resisting else load("azulay")
    trajectory = timed([through(POSES, 0.018)], t.Limits())
    return motion(machine, trajectory, loading=LOADING if resisting else None, samples=200)


def go(to: Any, tilt: float = 0.0, start: Any = HOME, **options: Any) -> MotionReport:
    """Straight from home, or elsewhere."""
    way = straight(zyz_frame(start, 0, 0, 0), zyz_frame(to, 0, tilt, 0))
    return motion("azulay", timed([way], t.Limits()), **({"samples": 200} | options))


def state_at(report: MotionReport, times: np.ndarray) -> tuple[State, Any]:
    moving = report.trajectory.at(times)
    return State(moving.pose, moving.twist), moving.acceleration


def six(twist: Any) -> np.ndarray:
    """(n, 6) of a twist or a wrench."""
    return np.stack(np.broadcast_arrays(*(np.atleast_1d(c).astype(float) for v in twist for c in v)), axis=-1)


@pytest.mark.parametrize("resisting", [False, True])
def test_drives_are_those_of_the_inverse_dynamics(resisting: bool) -> None:
    report = smooth_run(resisting)
    state, rise = state_at(report, report.time)
    case = Case(report.machine, np.ones((3, 2)), report.loading.gravity)
    found = drive_motion(case, state, rise, report.loading.on(report.machine, state.pose))
    for own, theirs in zip(report.drives, found, strict=True):
        np.testing.assert_allclose(own, theirs, rtol=1e-12, atol=1e-12)
    wrench = six(report.load)
    arm = np.array([0, 0.01, 0.02]) if resisting else np.zeros(3)
    turned = np.stack([np.stack(list(v), axis=-1) for v in state.pose[1:]], axis=-1) @ arm
    np.testing.assert_allclose(
        wrench[:, 3:], np.cross(turned, report.loading.force)[: len(wrench)] + report.loading.moment, atol=1e-15
    )
    np.testing.assert_array_equal(wrench[:, :3], np.broadcast_to(report.loading.force, wrench[:, :3].shape))


def test_speeds_are_derivatives_of_coordinates() -> None:
    """Along the trajectory, away from where the jerk jumps."""
    report = smooth_run()
    step = 2e-5
    times = np.linspace(0.03, 0.97, 80) * report.trajectory.duration
    switches = report.trajectory.laws[0].switches
    times = times[np.abs(times[:, None] - switches).min(axis=1) > 2 * step]
    runs = [motion_at(report, times + side * step) for side in (-1, 0, 1)]
    before, (_, drives), after = runs
    np.testing.assert_allclose(drives.speed, (after[0] - before[0]) / (2 * step), rtol=0, atol=2e-6)
    np.testing.assert_allclose(drives.acceleration, (after[1].speed - before[1].speed) / (2 * step), rtol=0, atol=1e-4)


def motion_at(report: MotionReport, times: np.ndarray) -> tuple[np.ndarray, Any]:
    """Coordinates of the drives by the joints' own report, and what the drives do."""
    state, rise = state_at(report, times)
    signs = closed_form_signs(report.machine, report.mode)
    joints = np.asarray(joint_states(report.machine, state.pose, signs).coordinate)
    picked = [joint_names(report.machine).index(name) for name in report.actuators]
    return joints[:, picked], drive_motion(report.case, state, rise, report.loading.on(report.machine, state.pose))


def gauss(report: MotionReport, values: Any, upto: float) -> np.ndarray:
    """Integral of values(times) from 0 to a time, exact for smooth pieces between changes of the jerk."""
    nodes, weights = leggauss(12)
    ends = np.unique(np.concatenate([np.linspace(0, upto, 13), [s for s in report.trajectory.laws[0].switches if s < upto]]))
    half, middle = np.diff(ends) / 2, (ends[1:] + ends[:-1]) / 2
    times = (middle[:, None] + half[:, None] * nodes).ravel()
    found: np.ndarray = (half[:, None] * weights).ravel() @ values(times)
    return found


@pytest.mark.parametrize("share", [0.37, 0.62, 1.0])
def test_work_of_the_drives_is_the_change_of_energy(share: float) -> None:
    report = smooth_run()
    upto = share * report.trajectory.duration

    def power(times: np.ndarray) -> np.ndarray:
        state, rise = state_at(report, times)
        drives = drive_motion(report.case, state, rise)
        found: np.ndarray = np.sum(drives.force * drives.speed, axis=1)
        return found

    state, _ = state_at(report, np.array([0.0, upto]))
    kinetic, potential = energies(report.case, state)
    assert gauss(report, power, upto) == pytest.approx(np.diff(kinetic + potential)[0], abs=1e-11)
    assert np.abs(np.diff(potential)[0]) > 5e-3


@pytest.mark.parametrize("resisting", [False, True])
def test_powers_balance_at_every_instant(resisting: bool) -> None:
    """What drives and load give is what the energy grows by, and what friction takes."""
    report = smooth_run(resisting)
    state, rise = report.state, six(report.moving.acceleration)
    v, load = six(state.twist), six(report.load)
    task, _ = equations(report.case, state)
    growth = np.einsum("na,na->n", v, np.einsum("nab,nb->na", task.inertia, rise) + task.coriolis + task.gravity)
    lost = np.einsum("na,na->n", v, task.friction)
    assert np.all(lost >= -1e-15)
    assert (lost.max() > 0.05) == resisting
    given = report.powers.sum(axis=1) + np.einsum("na,na->n", v, load)
    np.testing.assert_allclose(given, growth + lost, rtol=0, atol=1e-11)
    step, inner = 2e-5, slice(5, -5)
    times = report.time[inner]
    keep = np.abs(times[:, None] - report.trajectory.laws[0].switches).min(axis=1) > 2 * step
    after, before = (sum(energies(report.case, state_at(report, times + side * step)[0])) for side in (1, -1))
    np.testing.assert_allclose(((after - before) / (2 * step))[keep], growth[inner][keep], rtol=0, atol=1e-6)


@pytest.mark.parametrize("resisting", [False, True])
def test_sizing_against_plain_numpy(resisting: bool) -> None:
    report = smooth_run(resisting)
    time, power = report.time, report.drives.force * report.drives.speed
    width = np.diff(time)[:, None]

    def mean(values: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.sum(width * (values[1:] + values[:-1]) / 2, axis=0) / (time[-1] - time[0])
        return found

    rms, given = np.sqrt(mean(report.drives.force**2)), mean(np.where(power > 0, power, 0.0))
    for k, drive in enumerate(report.drive_sizing):
        assert (drive.name, drive.unit) == (report.actuators[k], "rad" if "guide" in drive.name else "m")
        assert report.units[k] == ("N m" if drive.unit == "rad" else "N")
        assert (drive.low, drive.high) == (report.coordinates[:, k].min(), report.coordinates[:, k].max())
        assert drive.rms_force == pytest.approx(rms[k], rel=1e-12)
        assert drive.mean_power == pytest.approx(given[k], rel=1e-12)
        for peak, values in (
            (drive.speed, report.drives.speed), (drive.acceleration, report.drives.acceleration),
            (drive.force, report.drives.force), (drive.power_given, np.maximum(power, 0)),
            (drive.power_taken, np.minimum(power, 0)),
        ):  # fmt: skip
            assert abs(peak.value) == np.abs(values[:, k]).max()
            assert values[np.flatnonzero(time == peak.time)[0], k] == peak.value
    wrenches = reactions(report.case, report.state, report.moving.acceleration, report.load)
    for k, joint in enumerate(report.joint_sizing):
        assert joint.force.value == pytest.approx(np.linalg.norm(wrenches[:, k, :3], axis=1).max(), rel=1e-12)
        assert joint.moment.value == pytest.approx(np.linalg.norm(wrenches[:, k, 3:], axis=1).max(), rel=1e-12)
        at = int(np.flatnonzero(time == joint.force.time)[0])
        assert np.linalg.norm(report.reactions[at, k, :3]) == pytest.approx(joint.force.value, rel=1e-12)


def test_peaks_and_means_do_not_depend_on_the_samples() -> None:
    """But for what a coarser look misses; the pose of a peak is that at its time."""
    run = smooth_run()
    coarse, fine = (motion("azulay", run.trajectory, samples=n) for n in (120, 240))
    for one, two in zip(coarse.drive_sizing, fine.drive_sizing, strict=True):
        assert one.rms_force == pytest.approx(two.rms_force, rel=2e-2)
        assert one.mean_power == pytest.approx(two.mean_power, rel=2e-2)
        assert one.force.value == pytest.approx(two.force.value, rel=1e-2)
    place, angles = fine.pose_at(fine.drive_sizing[0].force.time)
    k = int(np.argmax(np.abs(fine.drives.force[:, 0])))
    np.testing.assert_allclose(place, [c[k] for c in fine.moving.pose.origin], rtol=0, atol=1e-15)
    again = zyz_frame(place, *angles)
    np.testing.assert_allclose(np.array(again.z), [c[k] for c in fine.moving.pose.z], rtol=0, atol=1e-12)


@pytest.mark.parametrize("samples", [FEWEST, MOST])
def test_bounds_of_samples(samples: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bounds themselves are allowed; the most is brought down here, for it takes its time."""
    if samples == FEWEST:
        assert FEWEST <= len(go((0, 0, 0.126), samples=samples).time) <= FEWEST + 10
        with pytest.raises(t.InputError, match=r"^samples: 49 are too few, a time step of .* s; between 50 and 200000"):
            go((0, 0, 0.126), samples=samples - 1)
    else:
        with pytest.raises(t.InputError, match=r"^samples: 200001 are too many"):
            go((0, 0, 0.126), samples=samples + 1)
        monkeypatch.setattr("trivet.study.motion.MOST", 300)
        assert len(go((0, 0, 0.126), samples=300).time) >= 300
        with pytest.raises(t.InputError, match="between 50 and 300"):
            go((0, 0, 0.126), samples=301)
    with pytest.raises(t.InputError, match=r"^samples: 0 are too few"):
        go((0, 0, 0.126), samples=0)


def test_angles_count_on_over_a_full_turn() -> None:
    """The whole machine turns about its axis: every guide goes from where it stands by 360 degrees, without a jump."""
    turns = [zyz_frame(HOME, 0, 0, np.radians(angle)) for angle in range(0, 361, 60)]
    report = motion("azulay", timed([through(turns, 0.018)], t.Limits(angular_speed=5.0)), samples=200)
    assert np.abs(np.diff(report.coordinates, axis=0)).max() < 0.1
    np.testing.assert_allclose(report.coordinates[-1, :3] - report.coordinates[0, :3], 2 * np.pi, rtol=0, atol=1e-12)
    np.testing.assert_allclose(report.coordinates[:, 3:] - report.coordinates[0, 3:], 0, atol=1e-12)
    rolled = np.unwrap(np.arctan2(report.moving.pose.x.y, report.moving.pose.x.x))
    for k in range(3):
        np.testing.assert_allclose(report.coordinates[:, k] - report.coordinates[0, k], rolled, rtol=0, atol=1e-12)
    assert report.drive_sizing[0].high - report.drive_sizing[0].low == pytest.approx(2 * np.pi, rel=1e-12)


def told(error: Any) -> float:
    """The time in a message."""
    (time,) = re.findall(r"at t = (\S+) s, centre", str(error.value))
    return float(time)


def test_singularity_on_the_way_is_told_with_its_time_and_pose() -> None:
    way = timed([straight(zyz_frame(HOME, 0, 0, 0), zyz_frame(HOME, 0, np.radians(57), 0))], t.Limits())
    with pytest.raises(t.NoResultError, match="meets a Type 2 singularity at t = ") as error:
        motion("azulay", way, samples=100)
    time = told(error)
    there = conditions(load("azulay"), way.at(time + np.array([-2e-5, 0.0, 2e-5, -time])).pose, np.ones((3, 2)))
    side = np.sign(there.determinants.j_x)
    assert (side[0], side[2]) == (side[3], -side[3])
    # A pose counts as singular a little before it is.
    assert there.sigma_min[1] < 1.2 * SINGULAR
    assert there.sigma_min[3] > 0.1
    moving = way.at(np.array([time]))
    assert f"centre (0, 0, 125) mm, alpha 0°, beta {np.degrees(np.arccos(moving.pose.z.z[0])):.4g}°, gamma 0°" in str(
        error.value
    )
    with pytest.raises(t.NoResultError, match=f"at t = {time:.6g} s"):
        motion("azulay", way, samples=777, anyway=True)


@pytest.mark.parametrize(
    ("to", "chain", "limit"),
    [
        ((0, 0, 0.21), "leg-1.slide", "below its limit of 0 mm"),
        ((0, 0, 0.04), "leg-1.slide", "above its limit of 65 mm"),
        ((0.08, 0.02, 0.125), "leg-1.slide", "above its limit of 65 mm"),
    ],
)
def test_end_of_travel_is_told_with_its_time_and_pose(to: Any, chain: str, limit: str) -> None:
    with pytest.raises(t.NoResultError, match=f"{chain} at .* mm is {limit}") as error:
        go(to)
    time = told(error)
    way = timed([straight(zyz_frame(HOME, 0, 0, 0), zyz_frame(to, 0, 0, 0))], t.Limits())
    pose = way.at(time + np.array([-2e-6, 2e-6])).pose
    states = joint_states(load("azulay"), pose, np.ones((3, 2)))
    k = joint_names(load("azulay")).index(chain)
    bound = 0.0 if "below" in limit else 0.065
    assert (states.coordinate[0, k] - bound) * (states.coordinate[1, k] - bound) < 0
    x, y, z = (float(np.mean(c)) * 1e3 for c in pose.origin)
    assert re.search(rf"centre \({x:.3g}\d*, {y:.3g}\d*, {z:.3g}\d*\) mm", str(error.value))


def test_anyway_passes_the_travel_and_not_the_reach() -> None:
    report = go((0, 0, 0.05), anyway=True)
    assert report.coordinates[:, 3:].max() > 0.0661
    with pytest.raises(t.NoResultError, match=r"at t = 0\.97\d* s, centre \(0, 0, 216\) mm, .*leg-1 cannot close") as error:
        go((0, 0, 0.3), anyway=True)
    # The links are 216 mm long: above that nothing reaches.
    assert told(error) == pytest.approx(0.97, abs=1e-6)
    with pytest.raises(t.NoResultError, match=r"at t = 0 s, centre \(0, 0, 50\) mm.*above its limit of 65 mm"):
        go(HOME, start=(0, 0, 0.05))
    with pytest.raises(t.NoResultError, match="not reached: leg-1 cannot close"):
        go(HOME, start=(0, 0, 0.5), anyway=True)


def test_machines_that_have_no_motion() -> None:
    document = document_of(load("gough-stewart"))
    for chain in document["chains"].values():
        chain["elements"].reverse()
    way = timed([straight(zyz_frame((0, 0, 0.34), 0, 0, 0), zyz_frame((0, 0, 0.35), 0, 0, 0))], t.Limits())
    with pytest.raises(t.InputError, match="no closed-form inverse kinematics for the chain spherical prismatic universal"):
        motion(parse(document), way)
    way = timed([circle(zyz_frame(HOME, 0, 0, 0), 0.002)], t.Limits())
    with pytest.raises(t.InputError, match="azulay: 3 drives for the platform's six freedoms; lock or release drives"):
        motion(changed(load("azulay"), {"guide": {"actuated": None}}), way)
    weightless = changed(load("gough-stewart"), {"strut": {"beam": None}}, platform={"mass": "1 kg"})
    way = timed([circle(zyz_frame((0, 0, 0.35), 0, 0, 0), 0.002)], t.Limits())
    with pytest.raises(t.InputError, match="its masses leave a motion of the platform without inertia"):
        motion(weightless, way)
