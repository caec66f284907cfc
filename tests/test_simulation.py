"""Machines let go: energy, closed forms, an integration by SciPy, and where a run ends."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from machines import changed
from scipy.integrate import simpson, solve_ivp
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import trivet as t
from trivet.dynamics.batch import Case, drive_motion, energies, equations, platform_acceleration
from trivet.dynamics.equations import State
from trivet.kinematics.approach import drives_at
from trivet.kinematics.report import joint_names, joint_states
from trivet.model import Machine, document_of, load, parse
from trivet.space.frame import Frame
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import ZERO, Vec
from trivet.study.simulation import CREEP, MOST_SAMPLES, Simulation, simulate

NO_WEIGHT = t.Loading(gravity=(0.0, 0.0, 0.0))
KICK: dict[str, Any] = {"velocity": (0.02, -0.03, 0.01), "angular_velocity": (0.4, 0.3, -0.5)}
SAMPLES = 101
"""Times of almost all runs: what looks at them is compiled per number of times."""
SIGNS = np.ones((3, 2))
RATES = np.repeat([3e6 * 0.162**2, 3e6], 3)
"""Springs of azulay's drives, guides (along their circle of 162 mm) and slides; N m/rad and N/m."""


@cache
def rough() -> Machine:
    """The paper's machine with motors that weigh and joints that rub."""
    return changed(
        load("azulay"),
        {
            "guide": {"reflected_inertia": "0.4 kg", "damping": "30 N s/m", "friction": "1 N"},
            "slide": {"reflected_inertia": "0.2 kg", "damping": "20 N s/m"},
            "ball": {"damping": "0.01 N m s/rad"},
        },
    )


@cache
def springs(name: str, duration: float) -> Simulation:
    return simulate(name, duration, **KICK, loading=NO_WEIGHT, samples=SAMPLES)


@cache
def falling(anyway: bool) -> Simulation:
    """Let go at home, until the slides are at their end, or beyond it."""
    return simulate("azulay", 0.2, law="free", samples=SAMPLES, anyway=anyway)


@cache
def rubbing() -> Simulation:
    return simulate(rough(), 0.01, **KICK, samples=SAMPLES, forces={"leg-2.slide": 1.5})


def columns(*vectors: Vec) -> np.ndarray:
    """(n, 3 k)."""
    return np.stack(np.broadcast_arrays(*(np.atleast_1d(c).astype(float) for v in vectors for c in v)), axis=-1)


def moved(result: Simulation) -> np.ndarray:
    """(n, 6): displacement of the centre, and turn as a rotation vector."""
    pose = result.state.pose
    axes = np.stack([columns(axis) for axis in pose[1:]], axis=-1)
    place = columns(pose.origin)
    return np.hstack([place - place[0], Rotation.from_matrix(axes @ axes[0].T).as_rotvec()])


@pytest.mark.parametrize("name", ["azulay", "gough-stewart", "tahmasebi", "eclipse"])
def test_energy_stays_on_springs(name: str) -> None:
    result = springs(name, 0.2)
    kinetic, potential = energies(Case(result.machine, np.asarray(result.at.signs)), result.state)
    total = kinetic + result.balance.springs
    np.testing.assert_array_equal(potential, 0)
    assert np.abs(result.drift).max() < 2e-11
    assert np.abs(total - total[0]).max() < 2e-11 * kinetic.max()
    assert result.balance.springs.max() > 0.5 * kinetic.max()
    assert result.ended is None
    assert result.gap < 1e-12


def test_energy_stays_for_ten_seconds() -> None:
    result = springs("azulay", 10.0)
    assert np.abs(result.drift).max() < 1e-10
    assert result.time[-1] == 10.0
    assert result.gap < 1e-12


def test_small_vibrations_are_those_of_the_modes() -> None:
    """Displacement and turn over ten periods, from the mass matrix and the springs alone."""
    kick = np.array([2e-5, -1e-5, 3e-5, 1e-3, -2e-3, 4e-4])
    result = simulate("azulay", 0.02, velocity=kick[:3], angular_velocity=kick[3:], loading=NO_WEIGHT, samples=SAMPLES)
    task, _ = equations(Case(load("azulay"), SIGNS), State(result.at.frame, Twist(ZERO, ZERO)))
    mass, jacobian = task.inertia[0], task.jacobian[0]
    squares, shapes = eigh(jacobian.T @ np.diag(RATES) @ jacobian, mass)
    omega = np.sqrt(squares)
    np.testing.assert_allclose(result.frequencies, omega / (2 * np.pi), rtol=1e-9)
    swings = np.sin(np.outer(result.time, omega)) / omega
    expected = (swings * (shapes.T @ mass @ kick)) @ shapes.T
    for part in (slice(0, 3), slice(3, 6)):
        size = np.abs(expected[:, part]).max()
        np.testing.assert_allclose(moved(result)[:, part], expected[:, part], rtol=0, atol=1e-5 * size)


def test_springs_are_about_where_they_start() -> None:
    """Their forces come on top of what holds the machine there; coordinates are those of the joints."""
    result = simulate("azulay", 0.01, **KICK, samples=SAMPLES)
    apart = result.coordinates - result.coordinates[0]
    held = drive_motion(
        Case(load("azulay"), SIGNS, (0, 0, -9.80665)), State(result.at.frame, Twist(ZERO, ZERO)), Twist(ZERO, ZERO)
    )
    np.testing.assert_allclose(result.forces, held.force[0] - RATES * apart, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(result.balance.springs, 0.5 * apart**2 @ RATES, rtol=1e-8, atol=1e-15)
    states = joint_states(load("azulay"), result.state.pose, SIGNS)
    order = [joint_names(load("azulay")).index(name) for name in result.actuators]
    np.testing.assert_allclose(result.coordinates, np.asarray(states.coordinate)[:, order], rtol=0, atol=1e-14)
    assert result.actuators == [f"leg-{k}.{joint}" for joint in ("guide", "slide") for k in (1, 2, 3)]


def test_what_falls_gains_what_it_loses_in_height() -> None:
    result = falling(False)
    kinetic, potential = energies(Case(load("azulay"), SIGNS, (0, 0, -9.80665)), result.state)
    assert kinetic[-1] > 0.2
    np.testing.assert_allclose(kinetic, potential[0] - potential, rtol=0, atol=1e-11 * kinetic[-1])
    for part in (result.balance.springs, result.balance.dissipated, result.balance.put_in, result.forces):
        np.testing.assert_array_equal(part, 0)


def test_friction_takes_what_it_should() -> None:
    """Its power integrated over the records; nothing is lost besides, and nothing is lost without friction."""
    result = rubbing()
    task, _ = equations(Case(rough(), SIGNS, (0, 0, -9.80665), CREEP), result.state)
    power = np.einsum("na,na->n", task.friction, columns(*result.state.twist))
    assert np.all(power >= 0)
    lost = result.balance.dissipated
    assert lost[-1] > 0.1 * result.balance.kinetic[0]
    assert np.all(np.diff(lost) > -1e-15)
    for upto in (30, 60, 100):
        assert lost[upto] == pytest.approx(simpson(power[: upto + 1], x=result.time[: upto + 1]), rel=1e-3)
    assert np.abs(result.drift).max() < 1e-9


def test_constant_pushes_put_in_force_times_way() -> None:
    loading = t.Loading(gravity=(0, 0, 0), force=(0.3, -0.2, 0.1), moment=(0, 0, 0), point=(0, 0, 0))
    result = simulate(
        "azulay", 0.05, law="free", forces={"leg-1.slide": -2.0, "leg-3.guide": 0.1}, loading=loading, samples=SAMPLES
    )
    assert result.ended is None
    way = result.coordinates - result.coordinates[0]
    given = way @ np.array([0, 0, 0.1, -2.0, 0, 0]) + moved(result)[:, :3] @ np.array(loading.force)
    assert given[-1] > 1e-3
    np.testing.assert_allclose(result.balance.put_in, given, rtol=0, atol=1e-11)
    np.testing.assert_allclose(result.balance.kinetic, given, rtol=0, atol=1e-11)
    np.testing.assert_array_equal(result.forces, np.broadcast_to([0, 0, 0.1, -2.0, 0, 0], (SAMPLES, 6)))


def test_a_load_puts_in_its_power() -> None:
    """That of a moment, and of a force beside the centre, integrated over the records; all of it moves the machine."""
    loading = t.Loading(gravity=(0, 0, 0), force=(0.3, -0.2, 0.1), moment=(0.01, 0.02, -0.03), point=(0, 0, 0.02))
    result = simulate("azulay", 0.02, law="free", loading=loading, samples=SAMPLES)
    assert result.ended is None
    load, twist = load_on(result.state.pose, loading), result.state.twist
    turning = columns(load.moment) * columns(twist.angular)
    power = (columns(load.force) * columns(twist.linear) + turning).sum(axis=1)
    given = np.array([simpson(power[: k + 1], x=result.time[: k + 1]) for k in range(2, SAMPLES, 2)])
    assert simpson(turning.sum(axis=1), x=result.time) > 0.1 * given[-1] > 1e-5
    np.testing.assert_allclose(result.balance.put_in[2::2], given, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(result.balance.kinetic, result.balance.put_in, rtol=0, atol=1e-11)
    assert np.abs(result.drift).max() < 1e-10


@pytest.mark.parametrize("name", ["azulay", "gough-stewart"])
def test_slow_motions_run_through(name: str) -> None:
    """What moves is far less than the rounding of the weight's energy, which counts from {O}."""
    for speed in (1e-5, 1e-9):
        assert simulate(name, 1e-4, velocity=(speed, 0, 0), samples=11).ended is None


@pytest.mark.parametrize("law", ["hold", "springs"])
def test_what_is_held_stands_still(law: Any) -> None:
    gravity = (2.0, 0, -9.0)
    result = simulate(
        "azulay", 0.05, (0.003, 0.002, 0.12), 0.4, 0.1, 0.2, law=law, loading=t.Loading(gravity=gravity), samples=SAMPLES
    )
    assert np.abs(moved(result)).max() < 1e-9
    # A push of one newton besides sets it going, and so does a load, which is not held from the start.
    for besides in ({"forces": {"leg-1.slide": 1.0}}, {"loading": t.Loading(gravity, (0, 0, -1.0))}):
        pushed = simulate("azulay", 0.05, law=law, samples=SAMPLES, **besides)  # type: ignore[arg-type]
        assert np.abs(moved(pushed)).max() > (1e-7 if law == "springs" else 1e-3)


@pytest.mark.parametrize("name", ["azulay", "rough"])
def test_scipy_integrates_to_the_same(name: str) -> None:
    """Position and nine direction cosines by another integrator, with forces and accelerations from the batch functions."""
    machine = rough() if name == "rough" else load(name)
    loading = t.Loading(gravity=(1.0, 0, -9.0), force=(2.0, 0, 1.0), moment=(0, 0.1, 0), point=(0, 0, 0.02))
    pushes = {"leg-2.slide": 3.0}
    duration, tolerance = (0.01, 1e-10) if name == "azulay" else (0.002, 1e-8)
    ours = simulate(machine, duration, (0.002, 0, 0.12), 0.3, 0.1, 0.0, **KICK, loading=loading, forces=pushes, samples=SAMPLES)
    case, still, begun = Case(machine, SIGNS, loading.gravity, CREEP), Twist(ZERO, ZERO), ours.at.frame
    held = drive_motion(case._replace(creep=0.0), State(begun, still), still).force[0]
    held = held + np.array([0, 0, 0, 0, 3.0, 0])

    def at(y: np.ndarray) -> State:
        vectors = [Vec(*y[k : k + 3, None]) for k in range(0, 18, 3)]
        return State(Frame(*vectors[:4]), Twist(*vectors[4:]))

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        state = at(y)
        own = held - RATES * (np.asarray(drives_at(machine, state.pose, SIGNS))[0] - rest)
        rise = platform_acceleration(case, state, own[None], load_on(state.pose, loading))[0]
        return np.concatenate([y[12:15], np.cross(y[15:18], y[3:12].reshape(3, 3)).ravel(), rise])

    y = np.concatenate([np.ravel(begun).astype(float), KICK["velocity"], KICK["angular_velocity"]])
    rest = np.asarray(drives_at(machine, at(y).pose, SIGNS))[0]
    found = solve_ivp(slope, (0, duration), y, method="DOP853", rtol=tolerance, atol=tolerance * 1e-3, t_eval=ours.time).y.T
    np.testing.assert_allclose(columns(*ours.state.pose), found[:, :12], rtol=0, atol=1e-9)
    np.testing.assert_allclose(columns(ours.state.twist.linear), found[:, 12:15], rtol=0, atol=1e-6)
    np.testing.assert_allclose(columns(ours.state.twist.angular), found[:, 15:], rtol=0, atol=1e-4)
    assert np.abs(ours.drift).max() < 1e-9


def load_on(pose: Frame, loading: t.Loading) -> Wrench:
    """The load at the centre, worked out here."""
    arm = Vec(*(loading.point[2] * np.asarray(c) for c in pose.z))  # type: ignore[index]
    force = Vec(*loading.force)
    return Wrench(force, Vec(*loading.moment) + arm.cross(force))


def test_it_ends_at_the_end_of_travel() -> None:
    result = falling(False)
    assert result.ended is not None
    (told,) = re.findall(r"^at t = (\S+) s: leg-[123]\.slide at 65 mm is above its limit of 65 mm$", result.ended)
    assert float(told) == pytest.approx(result.time[-1], rel=1e-5)
    assert np.all(np.diff(result.time) > 0)
    np.testing.assert_allclose(result.coordinates[-1, 3:], 0.065, rtol=0, atol=1e-9)
    assert np.all(result.coordinates[:-1, 3:] < 0.065)
    assert np.all(np.isfinite(columns(*result.state.pose)))
    assert np.abs(result.drift).max() < 1e-10
    # Another run, up to that time, has its slides there as well.
    again = simulate("azulay", float(result.time[-1]), law="free", samples=SAMPLES, anyway=True)
    np.testing.assert_allclose(again.coordinates[-1, 3:], 0.065, rtol=0, atol=1e-9)


def test_anyway_goes_on_beyond_the_travel() -> None:
    result, short = falling(True), falling(False)
    assert (result.ended, len(result.time)) == (None, SAMPLES)
    assert result.coordinates[:, 3:].max() > 0.066
    both = len(short.time) - 1
    np.testing.assert_allclose(result.coordinates[:both], short.coordinates[:both], rtol=0, atol=1e-12)
    with pytest.raises(t.NoResultError, match="above its limit of 65 mm"):
        simulate("azulay", 0.01, (0, 0, 0.05))
    assert simulate("azulay", 0.01, (0, 0, 0.05), anyway=True, samples=SAMPLES).ended is None


def test_it_ends_where_chains_are_stretched() -> None:
    """Links of 216 mm, straight down: no further, and nothing that was computed there counts as a run."""
    result = simulate("azulay", 0.5, law="free", samples=SAMPLES, anyway=True)
    assert result.ended is not None
    assert result.time[-1] == pytest.approx(0.3, abs=0.006)
    assert np.abs(result.drift[:-1]).max() < 1e-6


@pytest.mark.parametrize("samples", [2, 52])
def test_records_do_not_change_the_run(samples: int) -> None:
    calls: list[tuple[int, int]] = []
    result = simulate(
        "azulay", 0.01, **KICK, loading=NO_WEIGHT, samples=samples, progress=lambda done, of: calls.append((done, of))
    )
    np.testing.assert_array_equal(result.time, np.linspace(0, 0.01, samples))
    assert calls[-1] == (samples, samples)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)
    whole = springs("azulay", 0.2)
    np.testing.assert_allclose(moved(result)[-1], moved(whole)[5], rtol=0, atol=1e-13)
    assert result.longest_step == pytest.approx(0.1 / (2 * np.pi * result.frequencies.max()), rel=1e-12)
    assert result.steps >= 0.01 / result.longest_step


def test_smaller_steps_come_to_the_same() -> None:
    own, finer = (simulate("azulay", 0.01, **KICK, loading=NO_WEIGHT, samples=SAMPLES, step=s) for s in (None, 1e-5))
    assert finer.steps > 2 * own.steps
    np.testing.assert_allclose(moved(finer), moved(own), rtol=0, atol=1e-12)


RIGID = {"guide": {"stiffness": None}}
WRONG: list[tuple[str, dict[str, Any]]] = [
    (r"^duration: 0 s; must be greater than zero$", {"duration": 0.0}),
    (r"^duration: nan s", {"duration": float("nan")}),
    (r"^duration: inf s", {"duration": float("inf")}),
    (r"^samples: 1; between 2 and 200000$", {"samples": 1}),
    (r"^samples: 200001;", {"samples": MOST_SAMPLES + 1}),
    (r"^step: 0\.001 s is too large for the fastest vibration, 643\.2 Hz; at most 0\.000247 s, 2\.47e-05 s", {"step": 1e-3}),
    (r"^step: 0\.5 s is too large for a run of 0\.1 s; at most 0\.01 s", {"step": 0.5, "law": "free", "duration": 0.1}),
    (r"^step: 0 s; must be greater than zero$", {"step": 0.0}),
    (r"^step: nan s", {"step": float("nan")}),
    (r"^drives 'spring'; did you mean 'springs'\?$", {"law": "spring"}),
    (r"^force of leg-1\.slid: azulay has no such drive; did you mean", {"forces": {"leg-1.slid": 1.0}}),
    (r"^force of leg-1\.hinge: azulay has no such drive", {"forces": {"leg-1.hinge": 1.0}}),
    (r"^force of leg-1\.slide: nan is no finite number$", {"forces": {"leg-1.slide": float("nan")}}),
    (r"^velocity: expected three finite numbers", {"velocity": (0.0, float("inf"), 0.0)}),
    (r"^angular velocity: expected three numbers", {"angular_velocity": (0.0, 1.0)}),
]


@pytest.mark.parametrize(("message", "options"), WRONG, ids=[message for message, _ in WRONG])
def test_wrong_input(message: str, options: dict[str, Any]) -> None:
    with pytest.raises(t.InputError, match=message):
        simulate("azulay", **({"duration": 0.01} | options))


def test_machines_that_cannot_be_simulated() -> None:
    document = document_of(load("gough-stewart"))
    for chain in document["chains"].values():
        chain["elements"].reverse()
    with pytest.raises(t.InputError, match="no closed-form inverse kinematics"):
        simulate(parse(document), 0.01)
    with pytest.raises(
        t.InputError, match=r"^leg-1\.guide: a drive without stiffness is rigid and no spring; give guide\.stiff"
    ):
        simulate(changed(load("azulay"), RIGID), 0.01)
    with pytest.raises(t.NoResultError, match="not reached: leg-1 cannot close"):
        simulate("azulay", 0.01, (0, 0, 0.5), anyway=True)


@pytest.mark.parametrize("x", [0.018, 0.018 - 1e-7])
def test_singular_starts_are_refused(x: float) -> None:
    """As `dynamics_report` refuses them; there no forces of the drives hold the machine, whatever their size."""
    with pytest.raises(t.NoResultError, match="singular"):
        simulate("azulay", 0.01, (x, 0, 0.125), anyway=True, samples=SAMPLES)
