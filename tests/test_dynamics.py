"""Rigid-body dynamics against Lagrange multipliers on all bodies (`rigid_model`), and against worked reference cases."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
import pytest
from machines import part, unlocked
from rigid_model import RigidModel
from test_jacobian import exponential, turned
from test_mujoco import MACHINES, machine_of, stands
from test_singularity import one

from trivet.dynamics import equations as eq
from trivet.dynamics.batch import (
    Case,
    drive_motion,
    energies,
    equations,
    joint_list,
    platform_acceleration,
    reactions,
)
from trivet.dynamics.bodies import Bodies
from trivet.dynamics.reactions import joint_wrenches
from trivet.errors import InputError
from trivet.kinematics.inverse import inverse
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import home_pose, postures
from trivet.model import Machine, document_of, load, parse
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec

CASES = [
    case
    for case in json.loads((Path(__file__).parent / "data" / "kinematics.json").read_text())["cases"]
    if case["kind"] == "inverse_dynamics"
]
POSES = 3


@contextmanager
def compiler(works: bool) -> Iterator[None]:
    """Kernels compiled or op by op in here, also in threads, which `jax.disable_jit` does not reach; as before out there."""
    before = jax.config.jax_disable_jit
    jax.config.update("jax_disable_jit", not works)  # type: ignore[no-untyped-call]
    try:
        yield
    finally:
        jax.config.update("jax_disable_jit", before)  # type: ignore[no-untyped-call]


@pytest.fixture(autouse=True)
def op_by_op() -> Iterator[None]:
    """Kernels without the compiler: too few states are asked of each machine to repay it."""
    with compiler(False):
        yield


class Motion(NamedTuple):
    """States (n, ...) in one working mode, and what acts."""

    pose: Frame
    signs: Any
    twist: np.ndarray
    rise: np.ndarray
    load: np.ndarray
    gravity: np.ndarray

    @property
    def state(self) -> eq.State:
        return eq.State(self.pose, twist_of(self.twist))

    def some(self, keep: Any) -> eq.State:
        return eq.State(part(self.pose, keep), twist_of(self.twist[keep]))

    @property
    def given(self) -> tuple[eq.State, Twist, Wrench]:
        """As the inverse dynamics takes it."""
        return self.state, twist_of(self.rise), wrench_of(self.load)

    def case(self, machine: Machine, creep: float = 0.0) -> Case:
        return Case(machine, self.signs, tuple(self.gravity), creep)


def twist_of(columns: np.ndarray) -> Twist:
    return Twist(Vec(*columns.T[:3]), Vec(*columns.T[3:]))


def wrench_of(columns: np.ndarray) -> Wrench:
    return Wrench(Vec(*columns.T[:3]), Vec(*columns.T[3:]))


@cache
def variant(name: str, resisting: bool) -> Machine:
    """A machine; or one whose joints are heavy and rub, and whose motors weigh, each in its own measure."""
    document = document_of(machine_of(name))
    for chain in document["chains"].values() if resisting else ():
        for place, element in enumerate(chain["elements"]):
            if element["type"] in ("beam", "offset"):
                continue
            size, is_straight = 1 + 0.3 * place, element["type"] in ("prismatic", "curvilinear")
            element |= {
                "mass": f"{0.1 * size} kg",
                "centre_of_mass": ["3 mm", f"{2 * size} mm", "-4 mm"],
                "inertia": ["200 kg mm^2", "300 kg mm^2", "350 kg mm^2"],
                "friction": f"{2 * size} N" if is_straight else f"{0.02 * size} N m",
                "damping": f"{5 * size} N s/m" if is_straight else f"{0.03 * size} N m s/rad",
            }
            if element.get("actuated"):
                element["reflected_inertia"] = f"{0.3 * size} kg" if is_straight else f"{0.01 * size} kg m^2"
    return parse(document)


@cache
def motion(name: str, which: int = 0) -> Motion:
    """Reachable poses, tilted up to 40 degrees, in the mode of one of `test_mujoco.stands`, in any motion."""
    machine, (_, signs, _), most = machine_of(name), stands(name)[which], 2000
    rng = np.random.default_rng([which, *map(ord, name)])
    reach = 0.3 * float(machine.characteristic_length)
    position = np.array(machine.home.position) + rng.uniform(-reach, reach, (most, 3))
    angles = rng.uniform((-np.pi, 0, -np.pi), (np.pi, np.radians(40), np.pi), (most, 3))
    pose = zyz_frame(position, *angles.T)
    clear = [np.broadcast_to(inverse(leg, pose, s).reach, most) for leg, s in zip(machine.legs, signs, strict=True)]
    keep = np.flatnonzero(np.min(clear, axis=0) > 1e-4)[:POSES]
    assert len(keep) == POSES, "too few of the random poses are reachable"
    return Motion(part(pose, keep), signs, *moving(rng, POSES))


def moving(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Twists, accelerations, loads and a gravity of any direction."""
    sizes = ((0.2, 1.0), (2.0, 10.0), (20.0, 1.0))
    found = [rng.normal(size=(count, 6)) * np.repeat(size, 3) for size in sizes]
    return found[0], found[1], found[2], rng.normal(scale=6.0, size=3)


def close(found: Any, expected: Any, tolerance: float = 1e-10) -> None:
    """Equal, forces and moments (or whatever is three and three along the last axis) compared apart."""
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    assert found.shape == expected.shape
    for half in (slice(3), slice(3, None)) if expected.shape[-1] == 6 else (slice(None),):
        size = np.abs(expected[..., half]).max()
        np.testing.assert_allclose(found[..., half], expected[..., half], rtol=0, atol=tolerance * size + 1e-13)


def models(machine: Machine, states: Motion, creep: float = 0.0) -> list[tuple[RigidModel, tuple[np.ndarray, ...]]]:
    """Per state the model, and twist, acceleration, load and gravity."""
    return [
        (RigidModel(machine, part(states.pose, k), states.signs, creep), (*rest, states.gravity))
        for k, rest in enumerate(zip(states.twist, states.rise, states.load, strict=True))
    ]


# Of the variants of one machine in its dimensions, one is enough.
EACH = [(name, resisting) for resisting in (False, True) for name in MACHINES if not (resisting and name.startswith("azulay-"))]
each = pytest.mark.parametrize(("name", "resisting"), EACH, ids=[f"{n} resisting" if r else n for n, r in EACH])


@each
def test_motion_and_forces(name: str, resisting: bool) -> None:
    """Inverse dynamics gives the forces, forward dynamics gives the motion back, whatever the forces."""
    machine, states = variant(name, resisting), motion(name, int(resisting))
    case, pairs = states.case(machine), models(machine, states)
    expected = [model.inverse(*given) for model, given in pairs]
    found = drive_motion(case, *states.given)
    close(found.force, [e.forces for e in expected])
    close(found.speed, [model.speeds(v) for model, (v, *_) in pairs])
    close(found.acceleration, [e.drives for e in expected])
    forces, twice = np.concatenate([found.force, 1.5 * found.force[::-1]]), np.r_[0:POSES, 0:POSES]
    others = [model.forward(v, f, *rest).acceleration for (model, (v, _, *rest)), f in zip(pairs, forces[POSES:], strict=True)]
    falling = platform_acceleration(case, states.some(twice), forces, wrench_of(states.load[twice]))
    close(falling[:POSES], states.rise, 1e-9)
    close(falling[POSES:], others, 1e-9)
    close(np.stack(energies(case, states.state), axis=-1), [model.energies(v, g) for model, (v, *_, g) in pairs])


@each
def test_joint_wrenches(name: str, resisting: bool) -> None:
    machine, states = variant(name, resisting), motion(name, int(resisting))
    found = reactions(states.case(machine), *states.given)
    pairs = models(machine, states)
    assert joint_list(machine) == [tie.name for tie in pairs[0][0].ties]
    close(found, [model.inverse(*given).wrenches for model, given in pairs], 1e-9)


@each
def test_equations_of_motion(name: str, resisting: bool) -> None:
    """Every term of both forms; of the second as what the drives give for motions in which nothing else is needed."""
    machine, states = variant(name, resisting), motion(name, int(resisting))
    found, zero = equations(states.case(machine), states.state), np.zeros(6)
    for k, (model, (twist, _, _, gravity)) in enumerate(models(machine, states)):
        task, actuators = (jax.tree.map(lambda a, k=k: a[k], part_of) for part_of in found)
        u, motions = model.velocities(twist), model.motions()
        still, lost = model.accelerations(u, zero), model.friction(u)
        close(task.inertia, motions.T @ (model.mass + model.motors) @ motions)
        close(task.coriolis, motions.T @ (model.needs(u, still, np.zeros(3)) - lost))
        close(task.gravity, motions.T @ model.weight(gravity))
        close(task.friction, motions.T @ lost)
        close(task.jacobian, model.drives @ motions)
        close(task.velocity_product, model.inverse(twist, zero, zero, gravity).drives)
        forward = np.linalg.inv(model.drives @ motions)
        columns = [model.inverse(zero, column, zero, np.zeros(3)).forces for column in forward.T]
        close(actuators.inertia, np.stack(columns, axis=-1), 1e-9)
        close(actuators.gravity, model.inverse(zero, zero, zero, gravity).forces, 1e-9)
        steady = model.inverse(twist, -forward @ task.velocity_product, zero, np.zeros(3)).forces
        close(actuators.friction, forward.T @ motions.T @ lost, 1e-9)
        close(actuators.coriolis + actuators.friction, steady, 1e-9)


@pytest.mark.parametrize("name", ["azulay", "tahmasebi", "gough-stewart"])
def test_creep_smooths_friction(name: str) -> None:
    """Balls at the end and inside of chains, a cross; and nothing is undefined at rest, where friction is then nothing."""
    machine, states, creep = variant(name, True), motion(name, 1), 0.3
    found = drive_motion(states.case(machine, creep), *states.given).force
    close(found, [model.inverse(*given).forces for model, given in models(machine, states, creep)])
    jump = drive_motion(states.case(machine), *states.given).force
    assert np.abs(jump - found).max() > 1e-3 * np.abs(found).max()
    rest = states._replace(twist=np.zeros((POSES, 6)))
    for speed in (0.0, creep):
        assert np.all(equations(rest.case(machine, speed), rest.state).task.friction == 0)


def upside_down() -> tuple[Machine, Motion]:
    """A hexapod with its balls on the ground and its crosses on the platform: closed numerically."""
    document = document_of(variant("gough-stewart", True))
    for chain in document["chains"].values():
        chain["elements"].reverse()
    rng = np.random.default_rng(3)
    return parse(document), Motion(one(zyz_frame((0.01, 0.02, 0.34), 0.3, 0.2, -0.25)), None, *moving(rng, 1))


def test_chains_without_closed_form() -> None:
    machine, states = upside_down()
    case = states.case(machine)
    with compiler(True):  # the closure asks for it
        model = RigidModel(machine, part(states.pose, 0), None)
        expected = model.inverse(states.twist[0], states.rise[0], states.load[0], states.gravity)
        close(drive_motion(case, *states.given).force[0], expected.forces)
        with pytest.raises(InputError, match="one pose at a time"):
            drive_motion(case, states.state._replace(pose=part(states.pose, [0, 0])), *states.given[1:])
        bodies = Bodies.of(machine)
        stand = bodies.grouped(postures(machine, part(states.pose, 0), None))
    state, rise, load = states.given
    around = eq.Surroundings(Vec(*states.gravity), load)
    forces = [np.array([force]) for force in expected.forces]
    close(joint_wrenches(bodies, state, rise, stand, around, forces)[0], expected.wrenches)
    kinetic, potential = model.energies(states.twist[0], states.gravity)
    close(np.ravel(eq.energy(bodies, state, stand, around.gravity)), [kinetic, potential])


@pytest.mark.parametrize("case", CASES, ids=[str(case["id"]) for case in CASES])
def test_reference_cases(case: dict[str, Any]) -> None:
    machine = reference(case["parameters"])
    columns = np.reshape(case["pose"]["R_rowmajor"], (3, 3)).T
    pose = one(Frame(Vec(*case["pose"]["p_m"]), *(Vec(*c) for c in columns)))
    rows = (np.array([case[key]]) for key in ("V", "Vdot", "F_ext"))
    states = Motion(pose, parse_mode(machine), *rows, np.array([0, 0, -case["parameters"]["g0"]]))
    found = drive_motion(states.case(machine), *states.given)
    actuators = equations(states.case(machine), states.state).actuators
    close(found.force[0], case["tau_Q"], 1e-9)
    close(found.speed[0], case["Qdot"], 1e-9)
    close(actuators.inertia[0], case["M_Q"], 1e-9)
    close(actuators.coriolis[0], case["C_Q"], 1e-9)
    close(actuators.gravity[0], case["g_Q"], 1e-9)


def reference(p: dict[str, Any]) -> Machine:
    """The machine of a case: its bodies as lumps, and a steel that weighs next to nothing in place of its beams."""
    document = document_of(load("azulay"))
    elements = {element["name"]: element for element in document["chains"]["leg"]["elements"]}
    del elements["slide"]["beam"]
    document["materials"]["steel"]["density"] = "1e-9 kg/m^3"
    document["chains"]["leg"]["platform_joint"]["radius"] = f"{p['Rp']} m"
    # Carriage and slide turn about z alone: their other moments of inertia may be anything.
    elements["guide"] |= {"radius": f"{p['Rb']} m"} | lump(p["m_c"], 0, [p["Jc"]] * 3)
    elements["slide"] |= lump(p["m_s"], p["s_off"], [p["Js"]] * 3)
    elements["hinge"] |= lump(p["m_l"], -p["lc"], [p["Ia"], p["It"], p["It"]])
    elements["link"]["length"] = f"{p['L']} m"
    elements["ball"]["mass"] = f"{p['m_b']} kg"
    moments = p["I_E"]
    document["platform"] = {
        "mass": f"{p['m_p']} kg",
        "centre_of_mass": [f"{c} m" for c in p["c_E"]],
        "inertia": [f"{moments[k][k]} kg m^2" for k in range(3)],
        "products_of_inertia": [f"{moments[i][j]} kg m^2" for i, j in ((0, 1), (0, 2), (1, 2))],
    }
    return parse(document)


def lump(mass: float, along: float, moments: list[float]) -> dict[str, Any]:
    return {
        "mass": f"{mass} kg",
        "centre_of_mass": [f"{along} m", "0 m", "0 m"],
        "inertia": [f"{moment} kg m^2" for moment in moments],
    }


def test_batches_are_what_their_members_are() -> None:
    """Compiled, in hundreds of states, where twist and load are given once for all of them."""
    machine, few = variant("azulay", True), motion("azulay", 1)
    count = 300
    pick = np.arange(count) % POSES
    many = few._replace(pose=part(few.pose, pick), rise=few.rise[pick])
    state = eq.State(many.pose, twist_of(few.twist[0]))
    given = state, twist_of(many.rise), wrench_of(few.load[1])
    case = few.case(machine)
    with compiler(True):
        found = drive_motion(case, *given)
        accelerations = platform_acceleration(case, state, found.force, given[2])
    close(accelerations, many.rise, 1e-9)
    models_of = [RigidModel(machine, part(few.pose, k), few.signs) for k in range(POSES)]
    expected = [m.inverse(few.twist[0], few.rise[k], few.load[1], few.gravity) for k, m in enumerate(models_of)]
    close(found.force, np.stack([e.forces for e in expected])[pick])


def test_nothing_is_said_out_of_reach() -> None:
    """A pose that no chain reaches is NaN, its neighbours in the batch are not."""
    machine, few = variant("azulay", True), motion("azulay", 0)
    position = few.pose.origin._replace(z=few.pose.origin.z + np.array([0.0, 1.0, 0.0]))
    states = few._replace(pose=few.pose._replace(origin=position))
    case = states.case(machine)
    forces = drive_motion(case, *states.given).force
    for found in (forces, reactions(case, *states.given), platform_acceleration(case, states.state, np.ones((POSES, 6)))):
        assert np.all(np.isnan(found[1][..., -1]))
        assert np.all(np.isfinite(found[[0, 2]]))


@pytest.mark.parametrize(("name", "axis"), [("azulay", (0.6, 0.8, 0.0)), ("gough-stewart", (0.0, 0.28, 0.96))])
def test_forces_grow_towards_type_2(name: str, axis: tuple[float, ...]) -> None:
    """Tenfold where the distance is a tenth; there the drives lose the platform, which falls as the bodies let it."""
    machine = variant(name, True)
    signs, axis = parse_mode(machine), np.array(axis)
    angle = singular_turn(machine, signs, axis)
    away = [tilted(machine, axis * (angle + past)) for past in (1e-3, 1e-4, 1e-5, 0.0)]
    joined = joined_poses(away)
    rest = np.zeros((4, 6))
    states = Motion(joined, signs, rest, rest, rest, np.array([1.0, 2.0, -9.0]))
    found = drive_motion(states.case(machine), *states.given)
    greatest = np.abs(found.force).max(axis=1)
    assert greatest[1] / greatest[0] == pytest.approx(10, rel=0.2)
    assert greatest[2] / greatest[1] == pytest.approx(10, rel=0.02)
    assert not greatest[3] < 1e6 * greatest[0], "beyond all bounds, or NaN"
    assert np.all(np.isfinite(found.speed))
    forces = np.linspace(-2, 3, 6)
    falling = platform_acceleration(states.case(machine), states.some([3]), forces[None])
    expected = RigidModel(machine, part(joined, 3), signs).forward(rest[0], forces, rest[0], states.gravity)
    close(falling[0], expected.acceleration, 1e-9)


def tilted(machine: Machine, turn: np.ndarray) -> Frame:
    """Home turned by a vector."""
    return turned(exponential(turn), one(home_pose(machine)), np.zeros(3))


def joined_poses(poses: list[Frame]) -> Frame:
    return Frame(*(Vec(*(np.concatenate(c) for c in zip(*v, strict=True))) for v in zip(*poses, strict=True)))


def singular_turn(machine: Machine, signs: Any, axis: np.ndarray) -> float:
    """The angle about an axis from home at which the drives first lose the platform."""
    low, high, case = 0.0, 2.0, Case(machine, signs)
    for _ in range(6):
        angles = np.linspace(low, high, 200)
        poses = joined_poses([tilted(machine, axis * angle) for angle in angles])
        rows = equations(case, eq.State(poses, twist_of(np.zeros((200, 6))))).task.jacobian
        place = int(np.flatnonzero(np.diff(np.sign(np.linalg.det(rows))))[0])
        low, high = angles[place : place + 2]
    return (low + high) / 2


def test_six_drives_are_asked_for() -> None:
    machine, states = unlocked(), motion("azulay", 0)
    with pytest.raises(InputError, match="rmmt: 9 drives for the platform's six freedoms; lock or release"):
        drive_motion(Case(machine, None), *states.given)
    held = machine_of("azulay").with_locks({"leg-2.slide": 0.01})
    with pytest.raises(InputError, match="azulay: 5 drives"):
        equations(Case(held, states.signs), states.state)


def test_the_rod_of_a_slide_needs_its_travel() -> None:
    document = document_of(machine_of("azulay"))
    slide = next(e for e in document["chains"]["leg"]["elements"] if e["name"] == "slide")
    del slide["travel"]
    states = motion("azulay", 0)
    with pytest.raises(InputError, match=r"chains\.leg-1\.elements\.slide\.travel: missing"):
        drive_motion(states.case(parse(document)), *states.given)
    del slide["beam"]
    assert np.all(np.isfinite(drive_motion(states.case(parse(document)), *states.given).force))
