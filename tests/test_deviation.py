"""Errors to first order, deviation by deviation: against machines built otherwise, closed forms, what holds of all machines."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache
from typing import Any

import jax
import numpy as np
import pytest
from test_mujoco import Model, mujoco_peer

from trivet.interop.mjcf import to_mjcf
from trivet.kinematics.approach import approach, drive_coordinates
from trivet.kinematics.deviation import Deviation, Way, deviations, places, platform_errors
from trivet.kinematics.jacobian import actuator_names, inverse_jacobian
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.standing import stand
from trivet.model import Machine, catalogue, dimensions, document_of, load, parse
from trivet.model.elements import Curvilinear
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame

MACHINES = [name for name in catalogue() if not name.startswith("azulay-")]
_compiled = jax.jit(
    lambda machine, pose, signs: (platform_errors(machine, pose, signs), inverse_jacobian(machine, pose, signs))
)


@cache
def stood(name: str) -> tuple[Machine, Frame, Any, np.ndarray, np.ndarray]:
    """A machine near home, at the pose of a few that is furthest from singular.

    Its working mode, its errors per deviation, and its Jacobian, from drives to platform.
    """
    machine, rng = load(name), np.random.default_rng(len(name))
    signs, found = parse_mode(machine), []
    for _ in range(8):
        position = np.array(machine.home.position) + rng.uniform(-0.008, 0.008, 3)
        pose = zyz_frame(position, rng.uniform(-3, 3), rng.uniform(0.1, 0.6), rng.uniform(-3, 3))
        errors, inverse = (np.asarray(a) for a in _compiled(machine, pose, signs))
        if np.isfinite(inverse).all():
            found.append((jax.tree.map(float, pose), errors, np.linalg.inv(inverse)))
    pose, errors, jacobian = min(found, key=lambda one: np.abs(one[2]).max())
    return machine, pose, signs, errors, jacobian


def separate(machine: Machine) -> Machine:
    """The same machine, every copy of a chain a chain of its own."""
    return dataclasses.replace(machine, chains={leg.name: leg.alone() for leg in machine.legs})


def table(frame: Frame) -> np.ndarray:
    """(4, 3) origin and axes."""
    return np.array([[float(c) for c in v] for v in frame])


def moved(before: Frame, after: Frame) -> np.ndarray:
    """(6,) displacement and small rotation from one frame to another."""
    a, b = table(before), table(after)
    return np.r_[b[0] - a[0], np.cross(a[1:], b[1:] - a[1:]).sum(axis=0) / 2]


def otherwise(name: str) -> tuple[Callable[[float], Machine], np.ndarray]:
    """The machine with every dimension of every chain off by random parts of a size, and to first order what comes of it."""
    machine, _, _, errors, _ = stood(name)
    ways, alone = deviations(machine), separate(machine)
    chosen = [k for k, way in enumerate(ways) if way.way == "dimension"]
    off, paths = np.random.default_rng(1).uniform(-1, 1, len(chosen)), list(dimensions(alone))
    leaves, structure = jax.tree.flatten(alone)

    def made(size: float) -> Machine:
        own = list(leaves)
        for k, more in zip(chosen, off, strict=True):
            own[paths.index(f"chains.{machine.legs[ways[k].leg].name}.{ways[k].of}")] += size * more
        return jax.tree.unflatten(structure, own)

    return made, off @ errors[chosen]


@pytest.mark.parametrize("name", MACHINES)
def test_first_order_against_machines_that_are_made_otherwise(name: str) -> None:
    """The pose is solved anew at the same coordinates of the drives; what is left is a quarter where all is off by half."""
    machine, pose, signs, _, _ = stood(name)
    values = np.array(list(drive_coordinates(machine, pose, signs).values()))
    made, linear = otherwise(name)
    left = []
    for size in (2e-6, 1e-6):
        found = approach(made(size), values, pose, signs)
        left.append(np.abs(moved(pose, found.frame) - size * linear).max())
    assert left[0] < 0.02 * 2e-6 * np.abs(linear).max()
    assert left[1] < 0.3 * left[0] or left[0] < 1e-13


@mujoco_peer
@pytest.mark.parametrize("name", ["tahmasebi", "gough-stewart", "rmmt"])
def test_mujoco_finds_the_platform_where_first_order_says(name: str) -> None:
    """The other machine is exported, and its drives are led by MuJoCo to where those of the machine stand.

    Off by as much one way and the other, since MuJoCo takes sites that are turned by less than 1e-6 for not turned.
    """
    machine, pose, signs, _, _ = stood(name)
    made, linear = otherwise(name)
    held, there = drive_coordinates(machine, pose, signs), []
    for size in (2e-5, -2e-5):
        model = Model(to_mjcf(made(size), pose, mode_text(machine, signs)))
        model.drive(held)
        body = model.d.body("platform")
        there.append(np.concatenate([body.xpos[None], body.xmat.reshape(3, 3).T]))
    ahead, behind = there
    turned = np.cross(table(pose)[1:], ahead[1:] - behind[1:]).sum(axis=0) / 2
    off = np.r_[ahead[0] - behind[0], turned] / 4e-5
    assert np.abs(off - linear).max() < 2e-3 * np.abs(linear).max()


@pytest.mark.parametrize("name", MACHINES)
def test_what_drives_are_off_by_goes_through_the_jacobian(name: str) -> None:
    machine, pose, signs, errors, jacobian = stood(name)
    ways, stands = deviations(machine), stand(machine, pose, signs)
    for column, drive in enumerate(actuator_names(machine)):
        leg, joint = drive.split(".")
        place = next(k for k, own in enumerate(machine.legs) if own.name == leg)
        own = errors[ways.index(Deviation(place, "drive", joint))]
        np.testing.assert_allclose(own, jacobian[:, column], atol=1e-9 * np.abs(jacobian).max())
        if Deviation(place, "growth", joint) in ways:
            reach = next(float(c) for e, _, c in stands[place].steps if e.name == joint)
            np.testing.assert_allclose(errors[ways.index(Deviation(place, "growth", joint))], own * reach, atol=1e-9)


@pytest.mark.parametrize("name", MACHINES)
def test_chains_that_are_displaced_alike_take_the_platform_with_them(name: str) -> None:
    """Each chain at another of its joints, in that joint's own frame."""
    machine, pose, signs, errors, _ = stood(name)
    ways, rng = deviations(machine), np.random.default_rng(3)
    shift, turn = rng.normal(size=(2, 3))
    total = np.zeros(6)
    for k, one in enumerate(stand(machine, pose, signs)):
        element, frame, coordinate = one.steps[rng.integers(len(one.steps))]
        origin, *axes = table(element.advance(frame, coordinate) if isinstance(element, Curvilinear) else frame)
        for axis, direction in enumerate(axes):
            total += (
                direction @ (shift + np.cross(turn, origin)) * errors[ways.index(Deviation(k, "along", element.name, axis))]
            )
            total += direction @ turn * errors[ways.index(Deviation(k, "about", element.name, axis))]
    centre = table(pose)[0]
    np.testing.assert_allclose(total, np.r_[shift + np.cross(turn, centre), turn], atol=1e-8)


def closed(machine: Machine, held: dict[str, Any], start: np.ndarray) -> np.ndarray:
    """(9,) displacement and rotation vector of the platform from a pose, and angles of the three hinges, that close the loops.

    By a general solver on the walk down the chains, for chains that end in a ball.
    """
    from scipy.optimize import root
    from scipy.spatial.transform import Rotation

    def gaps(unknown: np.ndarray) -> np.ndarray:
        found = []
        for k, leg in enumerate(machine.legs):
            frame = leg.base_frame()
            for element in leg.chain.elements[:-1]:
                locked, own = getattr(element, "locked", None), held.get(f"{leg.name}.{element.name}")
                if element.name == "hinge":
                    own = element.coordinate(float(unknown[6 + k]))
                frame = element.advance(frame, own if locked is None else element.coordinate(locked))
            seat = np.array(leg.platform_frame().origin, dtype=float)
            centre, *axes = start
            place = centre + unknown[:3] + Rotation.from_rotvec(unknown[3:6]).apply(seat @ axes)
            found.append(np.array(frame.origin, dtype=float) - place)
        return np.concatenate(found)

    solution = root(gaps, np.r_[np.zeros(6), [float(held[f"{leg.name}.hinge"]) for leg in machine.legs]], tol=1e-15)
    assert np.abs(gaps(solution.x)).max() < 1e-14
    return np.asarray(solution.x)


def test_joints_askew_against_a_machine_with_joints_that_are_locked_askew() -> None:
    """All joints and bodies of all chains, each in three of its six ways, solved by nothing of the house but the walk."""
    machine, pose, signs, errors, _ = stood("azulay")
    ways, rng, document = deviations(machine), np.random.default_rng(4), document_of(separate(machine))
    kinds: list[tuple[Way, str, str]] = [("along", "prismatic", "m"), ("about", "revolute", "rad")]
    held, linear = dict[str, Any](), np.zeros(6)
    for k, one in enumerate(stand(machine, pose, signs)):
        elements = document["chains"][one.leg.name]["elements"]
        for element, _, coordinate in one.steps:
            is_hinge = element.name == "hinge"
            held[f"{one.leg.name}.{element.name}"] = element.number(coordinate) if is_hinge else coordinate
            place = next(i for i, e in enumerate(elements) if e["name"] == element.name) + (element.name == "guide")
            for chosen in rng.choice(6, 3, replace=False):
                (way, kind, unit), axis, off = kinds[chosen // 3], int(chosen % 3), 1e-6 * rng.uniform(-1, 1)
                linear += off * errors[ways.index(Deviation(k, way, element.name, axis))]
                joint = {"name": f"{element.name}-{chosen}", "type": kind, "axis": "xyz"[axis], "locked": f"{off!r} {unit}"}
                elements.insert(place, joint)
    assert np.abs(closed(machine, held, table(pose))[:6]).max() < 1e-12
    assert np.abs(linear).max() > 1e-6
    assert np.abs(closed(parse(document), held, table(pose))[:6] - linear).max() < 1e-3 * np.abs(linear).max()


def test_a_link_that_is_too_long_in_closed_form() -> None:
    """Level and centred, the hinges on the ground plane: sin(phi) = z/L is how steep the links are.

    One link longer by 1 lifts the centre by 1/(3 sin) and tips the platform by 2/(3 R sin); all of them lift it by 1/sin, a
    larger circle of the guide lowers it by cot, a larger platform lifts it by cot.
    """
    machine = load("azulay")
    height, link, radius = 0.125, 0.216, 0.018
    sine = height / link
    cotangent = np.sqrt(1 - sine * sine) / sine
    ways = deviations(machine)
    errors = np.asarray(_compiled(machine, zyz_frame((0, 0, height), 0.0, 0.0, 0.0), parse_mode(machine))[0])

    def of(path: str) -> np.ndarray:
        return np.array([errors[ways.index(Deviation(k, "dimension", path))] for k in range(3)])

    np.testing.assert_allclose(
        of("elements.link.length")[0], [0, 0, 1 / (3 * sine), 0, -2 / (3 * radius * sine), 0], atol=1e-10
    )
    up = np.array([0, 0, 1, 0, 0, 0])
    np.testing.assert_allclose(of("elements.link.length").sum(axis=0), up / sine, atol=1e-10)
    np.testing.assert_allclose(of("elements.guide.radius").sum(axis=0), -up * cotangent, atol=1e-10)
    np.testing.assert_allclose(of("platform_joint.radius").sum(axis=0), up * cotangent, atol=1e-10)


@pytest.mark.parametrize("name", ["glozman", "rmmt"])
def test_all_other_numbers_leave_the_end_of_a_chain_where_it_is(name: str) -> None:
    """By the walk down the chain at fixed coordinates, of numbers changed one by one; those that place it do move it."""
    machine, pose, signs, _, _ = stood(name)
    apart_ = separate(machine)
    leaves, structure = jax.tree.flatten(apart_)
    own = [(k, path) for k, path in enumerate(dimensions(apart_)) if path.startswith(f"chains.{machine.legs[0].name}.")]
    coordinates = stand(apart_, pose, signs)[0].posture.coordinates

    def ends(numbers: list[Any]) -> np.ndarray:
        leg = jax.tree.unflatten(structure, numbers).legs[0]
        frame = leg.base_frame()
        for element, coordinate in zip(leg.chain.elements[:-1], coordinates, strict=False):
            locked = getattr(element, "locked", None)
            frame = element.advance(frame, coordinate if locked is None else element.coordinate(locked))
        return np.concatenate([table(frame), table(leg.platform_frame())])

    start = ends(leaves)
    for k, path in own:
        changed = [v + 1e-3 * (j == k) for j, v in enumerate(leaves)]
        assert np.any(ends(changed) != start) == places(path.split(".", 2)[2]), path
