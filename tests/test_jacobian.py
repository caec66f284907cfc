"""Jacobians: scale and sense of the rows, derivatives of the inverse kinematics, determinants."""

from __future__ import annotations

import dataclasses
import json
import math
from functools import cache, partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import (
    actuator_names,
    actuators,
    analytical_inverse_jacobian,
    homogenised,
    homogenised_inverse,
    inverse_jacobian,
    is_driven,
    zyz_rates,
)
from trivet.kinematics.mode import all_modes, parse_mode
from trivet.kinematics.singularity import conditions, nudged
from trivet.kinematics.standing import stand
from trivet.kinematics.transmission import transmissions
from trivet.model import Leg, Machine, load
from trivet.model.elements import Revolute, Spherical
from trivet.space.frame import Angle, Frame
from trivet.space.pose import zyz_frame
from trivet.space.vector import Vec

CASES = [
    case
    for case in json.loads((Path(__file__).parent / "data" / "kinematics.json").read_text())["cases"]
    if case["kind"] == "ik_fk_jac"
]
LOCKS: dict[str, dict[str, float]] = {
    "rmmt": {},
    "rmmt, one of each": {"leg-1.guide": 0.1, "leg-2.tangential": -0.004, "leg-3.radial": 0.012},
}
CIRCULAR = ("azulay", "eclipse", "alizade", "glozman")
STRAIGHT = ("behi", "ben-horin", "straight-column", "straight-elbow", "tahmasebi", "gough-stewart")
ALL = (*CIRCULAR, *STRAIGHT, *LOCKS)


@cache
def machine_of(name: str) -> Machine:
    machine = load(name.split(",")[0])
    return machine.with_locks(LOCKS[name]) if LOCKS.get(name) else machine


@cache
def stands(name: str, seed: int = 1) -> list[tuple[np.ndarray, Frame]]:
    """Every working mode with a few reachable random poses, four of each; poses are not near a Type 1 singularity."""
    machine, found = machine_of(name), []
    rng = np.random.default_rng(seed)
    for mode in all_modes(machine):
        signs, most = parse_mode(machine, mode), 120
        pose = zyz_frame(
            np.array(machine.home.position) + rng.uniform(-0.03, 0.03, (most, 3)),
            rng.uniform(-np.pi, np.pi, most), rng.uniform(0.05, 1.2, most), rng.uniform(-np.pi, np.pi, most),
        )  # fmt: skip
        reach = np.min(
            [np.broadcast_to(inverse(leg, pose, s).reach, most) for leg, s in zip(machine.legs, signs, strict=True)], 0
        )
        keep = np.flatnonzero(reach > 1e-5)[:4]
        if len(keep) == 0 and name in LOCKS:
            continue  # with its slide locked, a link that points outwards ends far from the platform
        assert len(keep) == 4, f"{name} {mode}: too few of the random poses are reachable"
        found.append((signs, part(pose, keep)))
    return found


def part(pose: Frame, which: Any) -> Frame:
    return Frame(*(Vec(*(c[which] for c in v)) for v in pose))


def together(name: str) -> tuple[Frame, np.ndarray]:
    """All stands of a machine as one batch: poses (n,) and signs (n, chains, 2)."""
    groups = stands(name)
    pose = Frame(
        *(Vec(*(np.concatenate(c) for c in zip(*vs, strict=True))) for vs in zip(*(p for _, p in groups), strict=True))
    )
    return pose, np.repeat([s for s, _ in groups], 4, axis=0)


@partial(jax.jit, static_argnames="which")
@partial(jax.vmap, in_axes=(None, 0, 0, None))
def leg_coordinates(leg: Leg, pose: Frame, signs: Any, which: tuple[int, ...]) -> tuple[Any, Any]:
    """Coordinates of some elements of a chain (n, k), and their derivatives along twists of the platform (n, k, 6)."""

    def displaced(twist: Any) -> Any:
        found = [inverse(leg, nudged(pose, twist), signs).coordinates[k] for k in which]
        plain = jnp.stack([jnp.asarray(jnp.arctan2(q.sin, q.cos) if isinstance(q, Angle) else q) for q in found])
        return plain, plain

    slopes, plain = jax.jacfwd(displaced, has_aux=True)(jnp.zeros(6))
    return plain, slopes


def coordinates(machine: Machine, pose: Frame, signs: Any) -> tuple[Any, Any]:
    """Q (n, 6) and dQ (n, 6, 6), for poses (n,) and signs (n, chains, 2)."""
    found = {}
    for k, leg in enumerate(machine.legs):
        which = tuple(k for k, e in enumerate(leg.chain.elements) if is_driven(e))
        plain, slopes = leg_coordinates(leg.unnamed, pose, signs[:, k], which)
        names = [f"{leg.name}.{leg.chain.elements[k].name}" for k in which]
        found |= {name: (plain[:, r], slopes[:, r]) for r, name in enumerate(names)}
    columns = zip(*(found[name] for name in actuator_names(machine)), strict=True)
    plain, slopes = (np.stack(column, axis=1) for column in columns)
    return plain, slopes


def turned(rotation: np.ndarray, pose: Frame, shift: np.ndarray) -> Frame:
    """Poses turned about their centres by rotations (..., 3, 3), and shifted (..., 3)."""
    columns = [np.einsum("...ij,...j->...i", rotation, np.stack(v, axis=-1)) for v in pose[1:]]
    origin = np.stack(pose.origin, axis=-1) + shift
    return Frame(*(Vec(*np.moveaxis(v, -1, 0)) for v in (origin, *columns)))


def exponential(vector: np.ndarray) -> np.ndarray:
    """Rotation by a vector (3,)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def in_rows(machine: Machine, difference: np.ndarray, of: np.ndarray) -> float:
    """Greatest difference of rows, relative to the rows, with angular velocities scaled by the characteristic length."""
    length = float(machine.characteristic_length)
    size = np.linalg.norm(homogenised(of, length), axis=-1)
    return float(np.max(np.linalg.norm(homogenised(difference, length), axis=-1) / size))


@pytest.mark.parametrize("name", ALL)
def test_inverse_jacobian_is_the_derivative_of_the_inverse_kinematics(name: str) -> None:
    """In every working mode, against automatic differentiation along twists and central differences on SE(3)."""
    machine = machine_of(name)
    pose, signs = together(name)
    rows = [conditions(machine, pose, signs).rows for signs, pose in stands(name)]
    found = np.concatenate([np.linalg.solve(r.j_q, r.j_x) for r in rows])

    _, exact = coordinates(machine, pose, signs)
    assert in_rows(machine, found - exact, exact) < 1e-10

    size = np.linalg.norm(homogenised(found, machine.characteristic_length), axis=-1)
    steps = 1e-6 * np.r_[[float(machine.characteristic_length)] * 3, [1.0] * 3]
    for k, step in enumerate(steps):
        twist = step * np.eye(6)[k]
        ahead, behind = (
            coordinates(machine, turned(exponential(s * twist[3:]), pose, s * twist[:3]), signs)[0] for s in (1, -1)
        )
        slope = np.array(ahead) - np.array(behind)
        angular = [joint.is_angular for _, joint in actuators(machine)]
        slope[:, angular] = np.arctan2(np.sin(slope[:, angular]), np.cos(slope[:, angular]))
        scale = size if k < 3 else size * machine.characteristic_length
        assert np.max(np.abs(slope / (2 * step) - found[:, :, k]) / scale) < 1e-6


@pytest.mark.parametrize("name", ALL)
def test_rows_are_unit_forces_at_right_angles(name: str) -> None:
    """Of a planar chain the tangent n and the link's direction u, in this order."""
    machine = machine_of(name)
    signs, pose = stands(name)[-1]
    j_x = conditions(machine, pose, signs).rows.j_x
    per_chain = 6 // len(machine.legs)
    for k, one in enumerate(stand(machine, pose, signs)):
        forces = j_x[:, per_chain * k : per_chain * (k + 1), :3]
        assert np.allclose(forces @ np.swapaxes(forces, 1, 2), np.eye(per_chain), rtol=0, atol=1e-12)
        if name in CIRCULAR or name.startswith(("rmmt", "straight", "behi", "ben")):
            hinge, _, end = _last_link(one)
            assert np.allclose(forces[:, 0], _array(hinge.y), rtol=0, atol=1e-12)
            assert np.allclose(forces[:, 1], _unit(_array(end.origin) - _array(hinge.origin)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", [n for n in ALL if n != "gough-stewart"])
def test_determinant_is_minus_s(name: str) -> None:
    """S of three planes of force through three points, in every working mode: the points are P, of Tahmasebi the feet."""
    machine = machine_of(name)
    for signs, pose in stands(name):
        points, across = [], []
        for one in stand(machine, pose, signs):
            hinge, ball, end = _last_link(one)
            at_foot = name == "tahmasebi"
            points.append(_array(ball.origin))
            u = _unit(_array(end.origin) - _array(ball.origin if at_foot else hinge.origin))
            across.append(np.cross(_array(hinge.y), u))
        e12, e23, e31 = points[1] - points[0], points[2] - points[1], points[0] - points[2]

        def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            return np.sum(a * b, axis=-1)

        w1, w2, w3 = across
        s = dot(e12, w1) * dot(e23, w2) * dot(e31, w3) - dot(e12, w2) * dot(e23, w3) * dot(e31, w1)
        size = np.linalg.norm(e12, axis=-1) * np.linalg.norm(e23, axis=-1) * np.linalg.norm(e31, axis=-1)
        found = conditions(machine, pose, signs).determinants.j_x
        assert np.max(np.abs(found + s) / size) < 1e-13


def _last_link(one: Any) -> tuple[Frame, Frame, Frame]:
    """Frames in {O} of a chain's last passive hinge, of its ball, and of its platform joint."""
    hinge = next(f for e, f, _ in reversed(one.steps) if isinstance(e, Revolute) and not e.actuated)
    ball = next(f for e, f, _ in one.steps if isinstance(e, Spherical))
    return hinge, ball, one.steps[-1][1]


def _array(v: Vec) -> np.ndarray:
    return np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in v)), axis=-1)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


@pytest.mark.parametrize("name", ["azulay", "alizade", "glozman", "behi", "tahmasebi", "gough-stewart", "rmmt, one of each"])
def test_nothing_depends_on_the_frame(name: str) -> None:
    """The machine turned about z as a whole; then rows reduced at another point, and with rows of a chain mixed."""
    machine = machine_of(name)
    signs, pose = stands(name)[0]
    angle = 0.7
    others = dataclasses.replace(
        machine,
        chains={
            key: chain if chain.base is None else dataclasses.replace(
                chain, base=dataclasses.replace(chain.base, azimuth=chain.base.azimuth + angle)
            )
            for key, chain in machine.chains.items()
        },
    )  # fmt: skip
    rotation = exponential(np.array([0, 0, angle]))
    spun = turned(rotation, pose, np.zeros(3))
    place = np.stack(pose.origin, axis=-1) @ rotation.T
    spun = spun._replace(origin=Vec(*place.T))
    here, there = conditions(machine, pose, signs), conditions(others, spun, signs)
    assert np.allclose(here.sigma_min, there.sigma_min, rtol=1e-9, atol=0)
    assert np.allclose(here.determinants.j_x, there.determinants.j_x, rtol=1e-9, atol=1e-18)
    assert np.allclose(here.determinants.inverse, there.determinants.inverse, rtol=1e-9, atol=0)
    for ours, theirs in zip(transmissions(machine, pose, signs), transmissions(others, spun, signs), strict=True):
        assert np.allclose(ours, theirs, rtol=0, atol=1e-9)
    arm = np.array([0.02, -0.05, 0.03])
    shift = np.eye(6)
    shift[3:, :3] = np.cross(np.eye(3), arm).T
    assert np.allclose(np.linalg.det(here.rows.j_x @ shift.T), here.determinants.j_x, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("name", ["azulay", "glozman", "tahmasebi", "gough-stewart"])
def test_analytical_jacobian_is_the_derivative_along_the_angles(name: str) -> None:
    machine = machine_of(name)
    signs = parse_mode(machine)
    place, angles = np.array([0.003, -0.002, 0.001]) + machine.home.position, np.array([0.4, 0.3, -0.2])
    found = np.asarray(analytical_inverse_jacobian(machine, zyz_frame(place, *angles), signs, 0.4, 0.3))
    steps = 1e-6 * np.vstack([np.eye(6), -np.eye(6)])
    moved = zyz_frame(place + steps[:, :3], *(angles + steps[:, 3:]).T)
    q, _ = coordinates(machine, moved, np.broadcast_to(signs, (12, *signs.shape)))
    assert in_rows(machine, (q[:6] - q[6:]).T / 2e-6 - found, found) < 1e-7
    x = np.array([*place, *angles])
    geometric = np.asarray(inverse_jacobian(machine, zyz_frame(x[:3], *x[3:]), signs))
    assert np.linalg.det(found) == pytest.approx(-math.sin(x[4]) * np.linalg.det(geometric), rel=1e-9)
    assert np.linalg.det(zyz_rates(x[3], x[4])) == pytest.approx(-math.sin(x[4]), rel=1e-12)
    batch = zyz_frame(x[None, :3], x[3:4], x[4:5], x[5:6])
    det = conditions(machine, batch, signs).determinants
    assert det.inverse[0] == pytest.approx(np.linalg.det(geometric), rel=1e-9)
    assert det.inverse_analytical[0] == pytest.approx(np.linalg.det(found), rel=1e-9)


def test_the_homogenised_inverse_counts_angles_as_lengths() -> None:
    machine = machine_of("azulay")
    pose, signs = zyz_frame((0.001, 0.002, 0.12), 0.3, 0.2, 0.1), parse_mode(machine)
    plain = np.asarray(inverse_jacobian(machine, pose, signs))
    found = np.asarray(homogenised_inverse(machine, pose, signs))
    length = 0.018
    assert np.allclose(found[:3, :3], plain[:3, :3] * length, rtol=1e-12, atol=1e-15)
    assert np.allclose(found[:3, 3:], plain[:3, 3:], rtol=1e-12, atol=1e-15)
    assert np.allclose(found[3:, :3], plain[3:, :3], rtol=1e-12, atol=1e-15)
    assert np.allclose(found[3:, 3:], plain[3:, 3:] / length, rtol=1e-12, atol=1e-15)


_OURS = {"proposed": "azulay", "benhorin": "ben-horin"}
_NO_LINK = ("alizade", "behi", "glozman")


def case_machine(case: dict[str, Any]) -> Machine:
    """The machine of a case of kinematics.json."""
    p, name = case["parameters"], _OURS.get(case["mechanism"], case["mechanism"])
    settings = {"platform_joint.radius": f"{p['Rp_mm']} mm"}
    settings |= {} if name in _NO_LINK else {"link.length": f"{p['L_mm']} mm"}
    if name == "glozman":
        settings |= {"link-1.length": f"{p['L1_mm']} mm", "link-2.length": f"{p['L2_mm']} mm"}
    if name in CIRCULAR:
        settings["guide.radius"] = f"{p['Rb_mm']} mm"
    if name == "behi":
        settings["base.radius"] = f"{p['Rb_mm']} mm"
    machine = load(name, settings)
    if name == "rmmt":
        angles = [q[0] - 2 * math.pi * k / 3 for k, q in enumerate(case["joints_chainwise"])]
        machine = machine.with_locks({f"leg-{k + 1}.guide": math.remainder(a, 2 * math.pi) for k, a in enumerate(angles)})
    return machine


def case_pose(case: dict[str, Any]) -> Frame:
    columns = np.array(case["pose"]["R_rowmajor"]).reshape(3, 3).T
    return Frame(Vec(*np.array(case["pose"]["p_mm"]) * 1e-3), *(Vec(*c) for c in columns))


def to_case_order(case: dict[str, Any]) -> np.ndarray:
    """Their Q from ours, (6, 6)."""
    change = np.eye(6)
    if case["mechanism"] == "benhorin":  # outwards first
        change = np.roll(change, 3, axis=0)
    if case["mechanism"] == "tahmasebi":  # along {O}
        for k in range(3):
            c, s = math.cos(2 * math.pi * k / 3), math.sin(2 * math.pi * k / 3)
            change[np.ix_([k, k + 3], [k, k + 3])] = [[c, -s], [s, c]]
    return change


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c['id']}-{c['mechanism']}")
def test_reference_cases(case: dict[str, Any]) -> None:
    machine, pose = case_machine(case), case_pose(case)
    found = conditions(machine, Frame(*(Vec(*(np.array([c]) for c in v)) for v in pose)), parse_mode(machine))
    sense = -1 if case["mechanism"] == "tahmasebi" else 1  # of the link: ours from the foot to P, as in all other chains
    assert found.determinants.j_x[0] * 1e9 == pytest.approx(sense * case["det_Jx_mm3"], rel=1e-9)
    assert found.determinants.j_x[0] * 1e9 == pytest.approx(-sense * case["S_mm3"], rel=1e-9)
    assert found.sigma_min[0] == pytest.approx(case["sigma_min_homog"], rel=1e-9)
    if "JG_inv" not in case:
        return
    inverse_here = to_case_order(case) @ np.asarray(inverse_jacobian(machine, pose, parse_mode(machine)))
    lengths = np.array([1.0 if joint.is_angular else 1e3 for _, joint in actuators(machine)])
    in_mm = lengths[:, None] * inverse_here / np.r_[[1e3] * 3, [1.0] * 3]
    assert in_rows(machine, in_mm - np.array(case["JG_inv"]), np.array(case["JG_inv"])) < 1e-9
    unit = np.prod(lengths) * 1e-9
    order = np.linalg.det(to_case_order(case))
    assert order * found.determinants.inverse[0] * unit == pytest.approx(case["det_JG_inv"], rel=1e-9)
    assert order * found.determinants.inverse_analytical[0] * unit == pytest.approx(case["det_J_inv_analytical_ZYZ"], rel=1e-9)
