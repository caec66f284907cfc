"""What rigid-body dynamics must obey by itself: energy, two forms of one equation, statics; its derivatives; its parts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from machines import bracketed, part
from test_dynamics import POSES, Motion, close, compiler, joined_poses, motion, twist_of, variant, wrench_of
from test_jacobian import exponential, turned
from test_mujoco import MACHINES, machine_of
from test_singularity import one

from trivet.dynamics import equations as eq
from trivet.dynamics.batch import Case, DriveMotion, Equations, drive_motion, energies, equations
from trivet.dynamics.bodies import Bodies
from trivet.dynamics.sensitivity import force_slopes
from trivet.kinematics.approach import drives_at
from trivet.kinematics.jacobian import actuator_names, inverse_jacobian
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.singularity import nudged
from trivet.kinematics.standing import home_pose
from trivet.model import dimensions, document_of, parse
from trivet.model.mass import RigidMass, platform_mass, together
from trivet.space.elimination import determinant, eliminated, inverse, solve, solved
from trivet.space.frame import Angle, Frame
from trivet.space.screw import Twist
from trivet.space.tensor import Tensor
from trivet.space.vector import Vec
from trivet.statics.load import load_case

# Which of five equally spaced places make a first derivative, exact to the fourth power of the step.
PLACES, WEIGHTS = np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12
STEP = 2e-5
"""Seconds: with their platform joint near the axis carriages race."""


@pytest.fixture(autouse=True)
def op_by_op() -> Iterator[None]:
    """As in `test_dynamics`."""
    with compiler(False):
        yield


def cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def along(states: Motion, time: float) -> tuple[Frame, np.ndarray]:
    """Poses and twists a little later on curves which start with the states' own twists and accelerations."""
    poses, twists = [], []
    for k, (twist, rise) in enumerate(zip(states.twist, states.rise, strict=True)):
        way, speed = time * twist + time**2 / 2 * rise, twist + time * rise
        turn, angle = cross(way[3:]), np.linalg.norm(way[3:]) or 1e-9  # where there is none, turn is zero
        # How the vector of a rotation turns it: its left Jacobian.
        first, second = (1 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
        spin = speed[3:] + first * turn @ speed[3:] + second * turn @ turn @ speed[3:]
        poses.append(turned(exponential(way[3:]), part(states.pose, [k]), way[:3]))
        twists.append(np.r_[speed[:3], spin])
    return joined_poses(poses), np.array(twists)


def rate(values: np.ndarray) -> np.ndarray:
    """Time derivatives of values at `PLACES`, and then in the middle, (5 n, ...)."""
    return np.einsum("k,k...->...", WEIGHTS, values.reshape(5, -1, *values.shape[1:])[:4]) / STEP


@pytest.mark.parametrize("name", MACHINES)
def test_along_a_curve(name: str) -> None:
    """Power and energy, term by term; speeds and accelerations of the drives against what their coordinates do."""
    machine, states = variant(name, True), motion(name, 0)
    case = states.case(machine)
    now, terms = drive_motion(case, *states.given), equations(case, states.state)
    task = terms.task
    poses, twists = zip(*(along(states, time) for time in STEP * np.r_[PLACES, 0]), strict=True)
    curve = eq.State(joined_poses(list(poses)), twist_of(np.concatenate(twists)))
    kinetic, potential = energies(case, curve)
    check_forms(terms, now, states, kinetic[-POSES:])
    still, stored = rate(kinetic), rate(potential)
    twist, lost = states.twist, np.sum(states.twist * task.friction, axis=1)
    driven = np.sum(twist * (np.einsum("nij,nj->ni", task.inertia, states.rise) + task.coriolis), axis=1)
    close(driven, still, 1e-8)
    close(np.sum(twist * task.gravity, axis=1), stored, 1e-8)
    given = np.sum(now.force * now.speed, axis=1) + np.sum(states.load * twist, axis=1)
    close(given, still + stored + lost, 1e-8)
    assert np.all(lost > 0)
    rows = equations(case, curve).task.jacobian
    close(now.acceleration, rate(np.einsum("nij,nj->ni", rows, np.concatenate(twists))), 1e-8)
    with compiler(True):
        coordinates = np.asarray(drives_at(machine, curve.pose, states.signs)).reshape(5, -1, 6)
        close(rows[-1], np.asarray(inverse_jacobian(machine, part(curve.pose, -1), states.signs)))
    close(now.speed, rate(np.unwrap(coordinates, axis=0).reshape(-1, 6)), 1e-8)


def check_forms(terms: Equations, found: DriveMotion, states: Motion, kinetic: np.ndarray) -> None:
    """Eq (27) is Eq (17) seen from the drives, and both have the kinetic energy in them."""
    task, actuators = terms
    forward = np.linalg.inv(task.jacobian)
    felt = np.einsum("nai,na->ni", forward, states.load)
    force = np.einsum("nij,nj->ni", actuators.inertia, found.acceleration)
    close(found.force, force + actuators.coriolis + actuators.gravity + actuators.friction - felt, 1e-9)
    assert np.array_equal(actuators.inertia, np.swapaxes(actuators.inertia, 1, 2))
    close(task.inertia, np.swapaxes(task.inertia, 1, 2), 1e-13)
    for inertia, speed in ((task.inertia, states.twist), (actuators.inertia, found.speed)):
        assert np.linalg.eigvalsh(inertia).min() > 0
        close(np.einsum("ni,nij,nj->n", speed, inertia, speed) / 2, kinetic)


def test_swirl_is_half_of_what_inertia_changes() -> None:
    """V . C_t = V . dM_t/dt V / 2 and g_t = dU/dX, by derivatives of the kernels themselves."""
    machine, states = variant("tahmasebi", True), motion("tahmasebi", 0)
    case, bodies = states.case(machine), Bodies.of(variant("tahmasebi", True))
    around = eq.Surroundings(Vec(*states.gravity), wrench_of(states.load))

    def inertia(step: Any) -> Any:
        pose = nudged(states.pose, step * states.twist.T)
        return eq.task_space(
            bodies, eq.State(pose, twist_of(states.twist)), standing(bodies, pose, states.signs), around
        ).inertia

    def potential(shift: Any) -> Any:
        pose = nudged(part(states.pose, [0]), shift[:, None])
        stand = standing(bodies, pose, states.signs)
        return eq.energy(bodies, eq.State(pose, eq.REST), stand, around.gravity)[1][0]

    task = equations(case, states.state).task
    _, change = jax.jvp(inertia, (0.0,), (1.0,))
    close(np.sum(states.twist * task.coriolis, axis=1), np.einsum("ni,nij,nj->n", states.twist, change, states.twist) / 2)
    close(task.gravity[0], jax.jacfwd(potential)(jnp.zeros(6)))


def standing(bodies: Bodies, pose: Frame, signs: Any) -> Any:
    return [group.stand(pose, signs) for group in bodies.alike()]


@pytest.mark.parametrize("name", MACHINES)
def test_drives_at_rest_are_those_of_the_statics(name: str) -> None:
    """The structure of the statics knows no dynamics; its drives are pushed by what ours must push against."""
    machine = machine_of(name)
    pose, signs, gravity = home_pose(machine), parse_mode(machine), (1.0, -3.0, -9.0)
    rest = Twist(Vec(0, 0, 0), Vec(0, 0, 0))
    load = np.array([30.0, -20.0, 10.0, 0.5, 1.0, -2.0])
    to_tip = np.cross(np.array([float(c) for c in pose.direction(machine.platform.tool_tip or (0, 0, 0))]), load[:3])
    ours = drive_motion(
        Case(machine, signs, gravity), eq.State(pose, rest), rest, wrench_of(load + np.r_[0, 0, 0, to_tip])
    ).force
    with compiler(True):
        yielding = machine.with_spherical("free").with_guide("rotation")
        drives = load_case(yielding, pose, signs, load[:3], load[3:], gravity).drives
    close(-ours[0], [drives[drive].load for drive in actuator_names(machine)], 1e-8)


# Derivatives

CREEP = 0.5
"""Smooth enough for differences, which know nothing of the jump of friction at rest."""
SLOPES = ("azulay", "glozman", "gough-stewart", "tahmasebi")


@pytest.mark.parametrize("name", SLOPES)
def test_slopes_of_the_forces(name: str) -> None:
    """With respect to every dimension and to the state, against differences; poses are truly turned there."""
    machine, states = variant(name, True), motion(name, 1)
    leaves, structure = jax.tree.flatten(machine)
    paths, dims = list(dimensions(machine)), np.array(leaves, dtype=float)
    # As long as its travel asks for, a rod has no derivative where that starts from zero.
    dims = np.where([path.endswith("travel.1") for path in paths] * (dims == 0), -2e-3, dims)
    machine = jax.tree.unflatten(structure, dims.tolist())
    pose, twist, rise = part(states.pose, [0]), states.twist[:1], states.rise[:1]
    around = eq.Surroundings(Vec(*states.gravity), wrench_of(states.load[:1]), CREEP)

    @jax.vmap
    def forces(dims: Any, pose: Frame, twist: Any, rise: Any) -> Any:
        bodies = Bodies.of(jax.tree.unflatten(structure, list(dims)))
        stand = [group.stand(pose, states.signs) for group in bodies.alike()]
        state = eq.State(pose, twist_of(twist))
        return jnp.concatenate(eq.inverse_dynamics(bodies, state, twist_of(rise), stand, around).force)

    steps = np.r_[np.full(3, 2e-5), np.full(3, 1e-3), np.full(12, 3e-4), 1e-3 * np.where(dims == 0, 0.1, np.abs(dims))]
    ways = np.concatenate([place * np.diag(steps) for place in PLACES])
    there = joined_poses([turned(exponential(way[3:6]), pose, way[:3]) for way in ways])
    shifts = ways[:, None, 6:12], ways[:, None, 12:18]
    beside = forces(dims + ways[:, 18:], jax.tree.map(lambda c: c[:, None], there), twist + shifts[0], rise + shifts[1])
    beside = np.asarray(beside).reshape(len(PLACES), len(steps), 6)
    with compiler(True):
        state, ahead, load = (jax.tree.map(lambda c: float(c[0]), t) for t in states.given)
        found = force_slopes(states.case(machine, CREEP), state, ahead, load)
    differences = np.einsum("k,kij->ji", WEIGHTS, beside) / steps
    for own, expected in zip(found[1:], np.split(differences[:, :18], 3, axis=1), strict=True):
        close(own, expected, 1e-6)
    size = np.abs(beside).max()
    assert list(found.dimensions) == paths
    for slope, difference, path, value in zip(found.dimensions.values(), differences.T[18:], paths, np.abs(dims), strict=True):
        assert slope == pytest.approx(difference, rel=1e-6, abs=1e-6 * size / (value or 1.0)), path
    assert np.sum(np.abs(differences[:, 18:]).max(axis=0) * np.abs(dims) > 1e-4 * size) > 20, "most dimensions matter"
    task, actuators = equations(states.case(machine), states.state)
    close(found.acceleration, actuators.inertia[0] @ task.jacobian[0], 1e-9)


# What it is made of


def random_turn(rng: np.random.Generator) -> np.ndarray:
    return exponential(rng.normal(size=3) * 2)


def frame_of(turn: np.ndarray, place: np.ndarray) -> Frame:
    return Frame(Vec(*place), *(Vec(*column) for column in turn.T))


def array_of(mass: RigidMass) -> tuple[float, np.ndarray, np.ndarray]:
    return float(mass.mass), np.array(mass.moment, dtype=float), np.array(mass.inertia.matrix(), dtype=float)


def test_masses_move_and_add() -> None:
    """Against clouds of points, of which everything is a sum."""
    rng = np.random.default_rng(2)
    weights, points = rng.uniform(0.1, 1, 7), rng.normal(size=(7, 3))

    def cloud(weights: np.ndarray, points: np.ndarray) -> RigidMass:
        moments = sum(w * ((p @ p) * np.eye(3) - np.outer(p, p)) for w, p in zip(weights, points, strict=True))
        tensor = Tensor(*moments.diagonal(), moments[0, 1], moments[0, 2], moments[1, 2])
        return RigidMass(weights.sum(), Vec(*(weights @ points)), tensor)

    def same(found: RigidMass, expected: RigidMass) -> None:
        for a, b in zip(array_of(found), array_of(expected), strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)

    turn, place = random_turn(rng), rng.normal(size=3)
    whole, frame = cloud(weights, points), frame_of(turn, place)
    same(whole.shifted(Vec(*place)), cloud(weights, points + place))
    same(whole.out_of(frame), cloud(weights, points @ turn.T + place))
    same(whole.into(frame), cloud(weights, (points - place) @ turn))
    same(together([cloud(weights[:3], points[:3]), cloud(weights[3:], points[3:])]), whole)
    same(whole.times(3.0), cloud(3 * weights, points))
    centre = weights @ points / weights.sum()
    same(RigidMass.centred(whole.mass, whole.centre, whole.about_centre), whole)
    np.testing.assert_allclose(whole.centre, centre, atol=1e-14)
    np.testing.assert_allclose(whole.about_centre.matrix(), array_of(cloud(weights, points - centre))[2], atol=1e-12)
    v, omega = rng.normal(size=(2, 3))
    speeds = v + np.cross(omega, points)
    momentum = whole.momentum(Twist(Vec(*v), Vec(*omega)))
    np.testing.assert_allclose(momentum.force, weights @ speeds, atol=1e-12)
    np.testing.assert_allclose(momentum.moment, weights @ np.cross(points, speeds), atol=1e-12)


def test_elements_weigh_what_handbooks_say() -> None:
    """Tube, plate, bar, lump and bracket, each in the frame beyond its element."""
    document = document_of(bracketed())
    document["sections"]["bar"] = {"shape": "rectangle", "width": "10 mm", "height": "20 mm"}
    elements = {element["name"]: element for element in document["chains"]["leg"]["elements"]}
    elements["slide"] |= {"mass": "0.3 kg", "centre_of_mass": ["1 mm", "2 mm", "3 mm"], "travel": ["-5 mm", "65 mm"]}
    elements["slide"] |= {
        "inertia": ["10 kg mm^2", "20 kg mm^2", "30 kg mm^2"],
        "beam": {"section": "bar", "material": "steel"},
    }
    machine = parse(document)
    found = {e.name: array_of(e.weigh(machine.stock)) for e in machine.legs[0].chain.elements}

    def check(name: str, *bodies: tuple[float, list[float], list[float]]) -> None:
        mass, moment, inertia = found[name]
        places = [np.array(centre) for _, centre, _ in bodies]
        about = [np.diag(i) + m * ((c @ c) * np.eye(3) - np.outer(c, c)) for (m, _, i), c in zip(bodies, places, strict=True)]
        assert mass == pytest.approx(sum(m for m, _, _ in bodies), rel=1e-12)
        np.testing.assert_allclose(moment, sum(m * c for (m, _, _), c in zip(bodies, places, strict=True)), atol=1e-15)
        np.testing.assert_allclose(inertia, sum(about), rtol=1e-12, atol=1e-16)

    outer, inner, length = 0.0095, 0.007, 0.216
    tube = 7870 * math.pi * (outer**2 - inner**2) * length
    across = tube * (3 * (outer**2 + inner**2) + length**2) / 12
    check("link", (tube, [length / 2, 0, 0], [tube * (outer**2 + inner**2) / 2, across, across]))
    bar, wide, high, long = 7870 * 0.010 * 0.020 * 0.070, 0.010, 0.020, 0.070
    sides = [bar * (wide**2 + high**2) / 12, bar * (long**2 + high**2) / 12, bar * (long**2 + wide**2) / 12]
    check("slide", (bar, [-0.030, 0, 0], sides), (0.3, [0.001, 0.002, 0.003], [1e-5, 2e-5, 3e-5]))
    check("bracket", (0.1, [0, 0, 0], [0, 0, 0]), (0.1, [-0.005, 0, -0.003], [0, 0, 0]))
    assert found["guide"][0] == found["hinge"][0] == 0
    plate = machine_of("azulay")
    mass, _, inertia = array_of(platform_mass(plate.platform, plate.stock))
    radius, thick = 0.018, 0.010
    assert mass == pytest.approx(7870 * math.pi * radius**2 * thick, rel=1e-12)
    sides = [mass * (3 * radius**2 + thick**2) / 12] * 2 + [mass * radius**2 / 2]
    np.testing.assert_allclose(inertia, np.diag(sides), rtol=1e-12, atol=1e-16)


@pytest.mark.parametrize("size", range(1, 7))
def test_elimination(size: int) -> None:
    """Named components with known zeros and ones anywhere, in batches in which pivots vanish or are small here and there."""
    rng = np.random.default_rng(size)
    for share in (0.0, 0.4, 0.6):
        for _ in range(6):
            batch = rng.normal(size=(size, size, 40)) * 10.0 ** rng.uniform(-1, 1, (size, 1, 1))
            batch[rng.uniform(size=batch.shape) < 0.1] = 0.0
            kept = rng.uniform(size=(size, size)) >= share
            kept[np.arange(size), rng.permutation(size)] = True
            exact = kept & (rng.uniform(size=kept.shape) < 0.2)
            known = rng.choice([1, -1, 1e-9, 0.5], (size, size)).tolist()
            rows = [
                [known[i][j] if exact[i, j] else batch[i, j] if kept[i, j] else 0 for j in range(size)] for i in range(size)
            ]
            whole = np.moveaxis([[np.broadcast_to(c, 40) for c in row] for row in rows], -1, 0).astype(float)
            good = np.linalg.cond(whole) < 1e5
            right = rng.normal(size=(size, 2, 40))
            with np.errstate(all="ignore"):
                found = np.moveaxis(np.array([[np.broadcast_to(c, 40) for c in row] for row in solve(rows, right)]), -1, 0)
                undone = np.moveaxis(np.array([[np.broadcast_to(c, 40) for c in row] for row in inverse(rows)]), -1, 0)
            left = np.einsum("nij,njk->nik", whole, found) - np.moveaxis(right, -1, 0)
            sizes = np.einsum("nij,njk->nik", np.abs(whole), np.abs(found)) + 1
            assert np.all(np.abs(left / sizes)[good] < 1e-9)
            apart = np.einsum("nij,njk->nik", undone, whole) - np.eye(size)
            grown = np.einsum("nij,njk->nik", np.abs(undone), np.abs(whole)) + 1
            assert np.all(np.abs(apart / grown)[good] < 1e-9)


def test_elimination_of_arrays() -> None:
    rng = np.random.default_rng(4)
    matrix, right, way = rng.normal(size=(50, 6, 6)), rng.normal(size=(50, 6, 2)), rng.normal(size=(50, 6, 6))
    matrix[:, 0, 0] = 0
    (found, determinants), (slope, _) = jax.jvp(lambda m: eliminated(m, jnp.asarray(right)), (matrix,), (way,))
    np.testing.assert_allclose(found, np.linalg.solve(matrix, right), rtol=1e-8)
    ratio = determinants / np.linalg.det(matrix)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    np.testing.assert_allclose(slope, -np.linalg.solve(matrix, way @ np.linalg.solve(matrix, right)), rtol=1e-8)


def test_a_column_of_known_zeros_is_singular() -> None:
    assert np.isnan(np.array(solve([[1, 0], [np.ones(3), 0]], [[1], [1]])[1][0], dtype=float)).all()


def test_turns_of_frames_are_those_of_tensors() -> None:
    """A plate turned by a frame's own turn weighs along the turned axes."""
    body = RigidMass.centred(2.0, Vec(0.1, 0.0, 0.0), Tensor(1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
    frame = one(frame_of(np.eye(3), np.zeros(3))).turn((0.0, 0.0, 1.0), Angle(0.0, 1.0))
    turned_over = body.out_of(frame)
    np.testing.assert_allclose(np.array(turned_over.moment, dtype=float).ravel(), [0, 0.2, 0], atol=1e-15)
    np.testing.assert_allclose(turned_over.inertia.xx, [2.0 + 2.0 * 0.1**2], rtol=1e-14)


def test_small_systems_and_determinants_against_numpy() -> None:
    """Rows in any order, and singular ones: a determinant of zero is zero, and nothing solves such a system."""
    rng = np.random.default_rng(3)
    matrices = rng.normal(size=(50, 6, 6)) * np.exp(rng.normal(size=(50, 6, 1)))
    right = rng.normal(size=(50, 6, 4))
    np.testing.assert_allclose(jax.vmap(determinant)(matrices), np.linalg.det(matrices), rtol=1e-12)
    np.testing.assert_allclose(jax.vmap(solved)(matrices, right), np.linalg.solve(matrices, right), rtol=1e-9, atol=1e-12)
    order = np.eye(6)[[2, 0, 1, 5, 3, 4]]
    assert float(determinant(order)) == np.linalg.det(order)
    for singular in (np.zeros((6, 6)), np.diag([1.0, 2.0, 0.0, 1.0, 1.0, 1.0])):
        assert float(determinant(singular)) == 0
        assert np.all(np.isnan(solved(singular, np.ones((6, 2)))))
