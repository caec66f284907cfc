"""Inverse kinematics, working modes and Jacobians."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from machines import PAPER, STATIC_CASES, difference, reference_machine, reference_pose

from trivet.errors import InputError, NoResultError
from trivet.kinematics.constraint import transmitted
from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import actuator_names, constraint_rows, inverse_jacobian
from trivet.kinematics.mode import all_modes, mode_text, parse_mode
from trivet.kinematics.report import joint_state
from trivet.model import Machine, document_of, load, parse
from trivet.space.pose import zyz_frame
from trivet.space.screw import Twist
from trivet.space.vector import ZERO, Vec
from trivet.statics.stiffness import stiffness
from trivet.statics.structure import structural_stiffness
from trivet.study.pose import pose


@pytest.mark.parametrize(("name", "count"), [("azulay", 64), ("eclipse", 64), ("alizade", 8), ("glozman", 64)])
def test_every_working_mode_is_written_and_read(name: str, count: int) -> None:
    machine = load(name)
    modes = all_modes(machine)
    assert len(set(modes)) == count
    for text in modes:
        assert mode_text(machine, parse_mode(machine, text)) == text
        assert np.array_equal(parse_mode(machine, text.replace(" ", "")), parse_mode(machine, text))


@pytest.mark.parametrize("text", ["+", "++ ++", "++ ++ ++ ++", "++ +* ++", "+++ ++ +", "a"])
def test_wrong_modes_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r'the signs "\+\+ \+\+ \+\+"'):
        parse_mode(load("azulay"), text)


@pytest.mark.parametrize("case", STATIC_CASES, ids=lambda c: f"{c['id']}-{c['mechanism']}")
def test_reference_branches(case: dict) -> None:  # type: ignore[type-arg]
    """All branches of static.json: theta, second coordinate and elevation of the last link."""
    machine, frame = reference_machine(case), reference_pose(case)
    for branch in case["ik_all"]:
        leg = machine.legs[branch["chain"] - 1]
        posture = inverse(leg, frame, np.array([branch["side"], branch["branch"]], dtype=float))
        theta = math.atan2(posture.coordinates[0].sin, posture.coordinates[0].cos)
        assert math.remainder(theta - branch["theta"], 2 * math.pi) == pytest.approx(0, abs=1e-12)
        second = posture.coordinates[1] if case["mechanism"] != "alizade" else posture.coordinates[2]
        if case["mechanism"] == "glozman":  # theirs from +e_r, ours from -e_r, both towards e_z
            found = math.pi - math.atan2(float(second.sin), float(second.cos))
            assert math.remainder(found - branch["q2"], 2 * math.pi) == pytest.approx(0, abs=1e-12)
        else:
            offset = case["params"]["Rb"] if case["mechanism"] == "proposed" else 0.0  # theirs from Oz, ours from the guide
            assert float(second) * 1e3 + offset == pytest.approx(branch["q2"], abs=1e-9)


@pytest.mark.parametrize("case", STATIC_CASES, ids=lambda c: f"{c['id']}-{c['mechanism']}")
def test_reference_jacobians(case: dict) -> None:  # type: ignore[type-arg]
    machine = reference_machine(case)
    found = np.asarray(inverse_jacobian(machine, reference_pose(case), parse_mode(machine)))
    expected = np.array(case["Jinv"])
    expected[:3, :3] *= 1e3  # rad per mm
    if case["mechanism"] == "glozman":
        expected[3:, :3] *= 1e3
        expected[3:] *= -1  # their angle runs the other way
    else:
        expected[3:, 3:] *= 1e-3  # mm per rad
    scale = np.diag([1, 1, 1] + [1 / machine.characteristic_length] * 3)
    rows = np.linalg.norm(expected @ scale, axis=1)[:, None]
    assert np.max(np.abs((found - expected) @ scale) / rows) < 1e-12


@pytest.mark.parametrize("name", PAPER)
def test_jacobian_is_the_derivative_of_the_inverse_kinematics(name: str) -> None:
    machine = load(name)
    generator = np.random.default_rng(5)
    names = actuator_names(machine)
    assert names[:3] == [f"leg-{k}.guide" for k in (1, 2, 3)]
    home = np.array(machine.home.position)
    order = [f"{leg.name}.{e.name}" for leg in machine.legs for e in leg.chain.elements if f"{leg.name}.{e.name}" in names]
    rows = [order.index(n) for n in names]
    everything = [f"{leg.name}.{e.name}" for leg in machine.legs for e in leg.chain.elements if hasattr(e, "actuated")]
    actuated = [everything.index(n) for n in order]
    for _ in range(12):
        signs = parse_mode(machine, generator.choice(all_modes(machine)))
        place = home + generator.normal(size=3) * 3e-3
        angles = generator.uniform(0.05, 1.2, 3)
        jacobian = np.asarray(inverse_jacobian(machine, zyz_frame(place, *angles), signs))
        # d(pose)/d(position, alpha, beta, gamma) by AD through a pose built in JAX; H of the paper's Eq (26).
        alpha, beta, _ = angles
        h = np.eye(6)
        h[3:, 3:] = [
            [0, -math.sin(alpha), math.cos(alpha) * math.sin(beta)],
            [0, math.cos(alpha), math.sin(alpha) * math.sin(beta)],
            [1, 0, math.cos(beta)],
        ]
        analytical = jacobian @ h
        step = 1e-6

        def joints(x: np.ndarray, signs: np.ndarray = signs) -> np.ndarray:
            return np.asarray(joint_state(machine, zyz_frame(x[:3], *x[3:]), signs).coordinate)[actuated][rows]

        x = np.r_[place, angles]
        numerical = np.stack([(joints(x + d) - joints(x - d)) / (2 * step) for d in step * np.eye(6)], axis=1)
        assert np.allclose(analytical, numerical, rtol=1e-6, atol=1e-6 * np.abs(analytical).max())


def test_rows_are_apart_as_in_eq_33() -> None:
    machine = load("azulay")
    frame = zyz_frame((0.001, 0.002, 0.12), 0.3, 0.5, 0.1)
    rows = constraint_rows(machine, frame, parse_mode(machine))
    assert rows.j_q.shape == (6, 6)
    assert rows.j_x.shape == (6, 6)
    assert np.count_nonzero(np.abs(rows.j_q) > 1e-12) == 6, "each wrench of this machine works on one drive"


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_transmitted_wrenches_are_reciprocal(count: int) -> None:
    """Also for twists without any component known at trace time (reflection instead of a pivot)."""
    generator = np.random.default_rng(count)
    twists = [
        Twist(Vec(*jnp.asarray(generator.normal(size=3))), Vec(*jnp.asarray(generator.normal(size=3)))) for _ in range(count)
    ]
    basis = transmitted(twists)
    assert len(basis) == 6 - count
    power = np.array([[float(w @ t) for t in twists] for w in basis])
    assert np.abs(power).max() < 1e-12
    matrix = np.array([[float(c) for c in (*w.force, *w.moment)] for w in basis])
    assert np.linalg.svd(matrix, compute_uv=False)[-1] > 1e-3


def test_an_idle_freedom_is_told() -> None:
    spin = Twist(ZERO, Vec(1, 0, 0))
    with pytest.raises(NoResultError, match="turns freely"):
        transmitted([spin, spin])


def test_a_pose_which_is_not_reached_names_chain_joint_and_limit() -> None:
    with pytest.raises(NoResultError, match=r"leg-1 cannot close"):
        pose("azulay", (0, 0, 0.3))
    with pytest.raises(NoResultError, match=r"leg-\d\.slide at 6[5-9].* mm is above its limit of 65 mm"):
        pose("azulay", (0, 0, 0.05))
    report = pose("azulay", (0, 0, 0.05), anyway=True)
    assert report.miss is not None
    assert not all(j.inside for j in report.joints)


def test_batches_carry_nan_not_exceptions() -> None:
    machine = load("glozman")
    heights = np.array([0.172, 0.9])
    frames = zyz_frame(np.stack([0 * heights, 0 * heights, heights], axis=1), 0 * heights, 0 * heights, 0 * heights)
    signs = parse_mode(machine)
    state = jax.vmap(lambda f: joint_state(machine, f, signs))(frames)
    assert np.all(np.isfinite(state.coordinate[0]))
    assert np.all(state.reach[1] < 0)
    assert np.any(np.isnan(state.coordinate[1]))


def straight(leg: str) -> Machine:
    """A machine with straight guides: chains at 0, 120 and 240 degrees, foot at 150 mm."""
    document = document_of(load(leg))
    document["about"] = {"name": "straight"}
    chain = document["chains"]["leg"]
    guide = {"name": "guide", "type": "prismatic", "axis": "y", "actuated": True, "stiffness": "3 N/um"}
    chain["elements"] = [guide, *chain["elements"][1:]]
    chain["base"] = {"azimuth": "10 deg", "radius": "150 mm"}
    chain["platform_joint"]["azimuth"] = "10 deg"
    return parse(document)


@pytest.mark.parametrize("leg", PAPER)
def test_straight_guides_carry_any_leg(leg: str) -> None:
    machine = straight(leg)
    frame = zyz_frame(np.add(machine.home.position, (0.003, -0.002, 0.001)), 0.3, 0.2, 0.1)
    signs = parse_mode(machine)
    assert mode_text(machine, signs) == ("" if leg == "alizade" else "+ + +")
    assert all_modes(machine)[0] == mode_text(machine, signs)
    batch = jax.tree.map(lambda c: np.atleast_1d(float(c)), frame)
    assert difference(machine, stiffness(machine, batch, signs)[0][0], structural_stiffness(machine, frame, signs)) < 1e-9


def test_travel_may_lie_across_180_degrees() -> None:
    """A carriage at -175 degrees is inside 150 to 210 degrees."""
    document = document_of(load("azulay"))
    chain = document["chains"]["leg"]
    chain["copies"] = 1
    chain["base"] = {"azimuth": "0 deg"}
    chain["platform_joint"]["azimuth"] = "185 deg"
    chain["elements"][0]["travel"] = ["150 deg", "210 deg"]
    machine = parse(document)
    state = joint_state(machine, zyz_frame((0, 0, 0.125), 0, 0, 0), parse_mode(machine))
    assert math.degrees(float(state.coordinate[0])) == pytest.approx(-175)
    assert math.degrees(float(state.gauge[0])) == pytest.approx(185)


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.05), (0.01, -0.02, 0.03)])
def test_stiffness_at_a_point_of_the_platform(point: tuple[float, float, float]) -> None:
    """The wrench that holds the platform under one and the same small motion, reduced at either point."""
    report = pose("azulay", tilt=0.4, azimuth=0.3, roll=0.2)
    arm = np.array(report.frame.direction(point), dtype=float)
    at_centre = np.random.default_rng(1).normal(size=6)
    at_point = np.r_[at_centre[:3] + np.cross(at_centre[3:], arm), at_centre[3:]]
    force, moment = np.split(report.stiffness @ at_centre, 2)
    assert np.allclose(report.stiffness_at(point) @ at_point, np.r_[force, moment - np.cross(arm, force)], rtol=1e-10)
