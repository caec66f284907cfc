"""Rigid-body dynamics against engines that nobody here wrote: MuJoCo on exported files, Pinocchio on trees made here.

To both engines a machine is a tree of bodies.  Its loops are closed by exact rows, of the engine's own Jacobians and their
rates, so that all sides differ by rounding alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import jax
import numpy as np
import pytest
from machines import changed
from numpy.typing import NDArray
from test_mujoco import MACHINES, Model, machine_of, stands

from trivet.dynamics import batch
from trivet.dynamics.equations import State
from trivet.interop.mjcf import to_mjcf
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.standing import Standing, stand
from trivet.model import Machine
from trivet.model.elements import Curvilinear, Element, Joint, Prismatic, Spherical, Stock, Universal
from trivet.model.mass import RigidMass, platform_mass
from trivet.space.frame import IDENTITY, Frame
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec

Array = NDArray[np.float64]

TOLERANCE = 1e-11
"""Of the largest number of the same kind: lengths and turns, forces and torques apart."""
TURNS = (False, False, False, True, True, True)
MOTE, MOTE_INERTIA = 1e-12, 1e-13
"""What the file gives bodies without mass (kg, kg m^2), as it says itself."""
KINDS = [name for name in MACHINES if not name.startswith("azulay-")]
"""Without the variants of one machine in its dimensions."""
RESISTING: dict[str, dict[str, dict[str, Any]]] = {
    "azulay with lumps": {
        "guide": {"damping": "40 N s/m", "friction": "3 N", "reflected_inertia": "0.7 kg"},
        "slide": {"damping": "30 N s/m", "friction": "2 N", "reflected_inertia": "0.4 kg"},
        "hinge": {"damping": "0.2 N m s/rad", "friction": "0.1 N m"},
        "ball": {"damping": "0.1 N m s/rad", "friction": "0.05 N m"},
    },
    "gough-stewart": {
        "cross": {"damping": "0.3 N m s/rad", "friction": "0.2 N m", "mass": "0.3 kg", "inertia": ["1e-4 kg m^2"] * 3},
        "strut": {"damping": "100 N s/m", "friction": "20 N", "reflected_inertia": "2 kg"},
        "ball": {"damping": "0.2 N m s/rad", "friction": "0.1 N m"},
    },
    "tahmasebi": {
        "ball": {"damping": "0.1 N m s/rad", "friction": "0.05 N m", "mass": "0.1 kg"},
        "hinge": {"damping": "0.2 N m s/rad", "friction": "0.1 N m", "mass": "0.05 kg"},
    },
}


@pytest.fixture(autouse=True)
def uncompiled() -> Iterator[None]:
    """Few states of many machines: to compile the kernels takes ten times as long as to run them step by step."""
    jax.config.update("jax_disable_jit", True)
    yield
    jax.config.update("jax_disable_jit", False)


class Situation(NamedTuple):
    """How a machine moves and what acts on it; six numbers each, linear part first, in {O}."""

    twist: Array
    acceleration: Array
    load: Array
    gravity: Array

    @classmethod
    def random(cls, seed: int) -> Situation:
        """0.2 m/s and 1 rad/s, 3 m/s^2 and 10 rad/s^2, 10 N and 1 N m; free fall aslant."""
        rng = np.random.default_rng(seed)
        twist, acceleration, load = (np.repeat(pair, 3) * rng.normal(size=6) for pair in ((0.2, 1), (3, 10), (10, 1)))
        fall = rng.normal(size=3)
        return cls(twist, acceleration, load, 9.81 * fall / np.linalg.norm(fall))

    def asked(self, pose: Frame) -> tuple[State, Twist, Wrench]:
        """State, acceleration and load, as trivet takes them."""
        (v, w), (rise, spin), (force, moment) = (np.split(six, 2) for six in (self.twist, self.acceleration, self.load))
        return State(pose, Twist(Vec(*v), Vec(*w))), Twist(Vec(*rise), Vec(*spin)), Wrench(Vec(*force), Vec(*moment))


def assert_close(ours: Array, theirs: Array, turns: Iterable[bool] = (False,)) -> None:
    """Each number to the tolerance of the largest of its kind."""
    are_turns = np.broadcast_to(list(turns), theirs.shape)
    for kind in (are_turns, ~are_turns):
        largest = np.abs(theirs[kind]).max(initial=0)
        np.testing.assert_allclose(ours[kind], theirs[kind], rtol=0, atol=TOLERANCE * largest)


class Closed(NamedTuple):
    """A tree with closed loops: M a + bias = drives^T forces + loops^T multipliers + platform^T load, loops a = -loops_rate."""

    inertia: Array
    bias: Array
    loops: Array
    loops_rate: Array
    """Time derivative of the rows times the velocity."""
    drives: Array
    """Speeds of the actuators per velocity (6, nv)."""
    platform: Array
    """Twist of the platform centre in {O} per velocity (6, nv)."""
    platform_rate: Array

    def accelerations(self, platform: Array) -> Array:
        """Of all coordinates, when the platform accelerates so."""
        return within(self.loops, -self.loops_rate, self.platform, platform - self.platform_rate)

    def forces(self, accelerations: Array, load: Array) -> tuple[Array, Array]:
        """Inverse dynamics: forces of the actuators, and multipliers."""
        needed = self.inertia @ accelerations + self.bias - self.platform.T @ load
        found = np.linalg.solve(np.concatenate([self.drives, self.loops]).T, needed)
        return found[:6], found[6:]

    def platform_acceleration(self, forces: Array, load: Array) -> Array:
        """Forward dynamics."""
        rows = len(self.loops)
        matrix = np.block([[self.inertia, self.loops.T], [self.loops, np.zeros((rows, rows))]])
        given = self.drives.T @ forces + self.platform.T @ load - self.bias
        found = np.linalg.solve(matrix, np.concatenate([given, -self.loops_rate]))
        return self.platform @ found[: len(given)] + self.platform_rate


def within(loops: Array, gaps: Array, rows: Array, values: Array) -> Array:
    """Velocities or accelerations of all coordinates from those along some rows and across the loops."""
    return np.linalg.solve(np.concatenate([loops, rows]), np.concatenate([gaps, values]))


class Exact(Model):
    """An exported machine without motes, and without MuJoCo's own solver, which lets loops yield."""

    def __init__(self, text: str, situation: Situation) -> None:
        super().__init__(text)
        light = (self.m.body_inertia[:, 0] > 0) & (self.m.body_inertia.min(axis=1) < 2 * MOTE_INERTIA)
        self.m.body_mass[light] -= MOTE
        self.m.body_inertia[light] -= MOTE_INERTIA
        self.engine.mj_setConst(self.m, self.d)
        self.engine.mj_resetDataKeyframe(self.m, self.d, 0)
        self.m.opt.gravity = situation.gravity
        self.update()
        loops = self.gaps(self.engine.mj_jac)
        self.d.qvel = within(loops, np.zeros(len(loops)), self.twist(), situation.twist)
        self.update()

    def update(self) -> None:
        """What follows from places and velocities alone."""
        for step in ("kinematics", "comPos", "makeM", "comVel", "passive", "energyPos", "energyVel"):
            getattr(self.engine, f"mj_{step}")(self.m, self.d)

    def gaps(self, jacobian: Any) -> Array:
        """Velocities of the gaps, or their rates, per qvel: of the centre, in a weld of the turn too."""
        rows = []
        for one, other, kind in zip(self.m.eq_obj1id, self.m.eq_obj2id, self.m.eq_type, strict=True):
            ends = [self.rows_at(jacobian, self.d.site_xpos[site], self.m.site_bodyid[site]) for site in (one, other)]
            rows.append((ends[0] - ends[1])[: 6 if kind == self.engine.mjtEq.mjEQ_WELD else 3])
        return np.concatenate(rows)

    def rows_at(self, jacobian: Any, point: Array, body: int) -> Array:
        linear, angular = np.zeros((2, 3, self.m.nv))
        jacobian(self.m, self.d, linear, angular, point, body)
        return np.concatenate([linear, angular])

    def closed(self, names: list[str]) -> Closed:
        """The equations of motion in the present state."""
        inertia, bias = np.zeros((self.m.nv, self.m.nv)), np.zeros(self.m.nv)
        for row, unit in zip(inertia, np.eye(self.m.nv), strict=True):
            self.engine.mj_mulM(self.m, self.d, row, unit)
        self.engine.mj_rne(self.m, self.d, 0, bias)
        rate, platform = self.engine.mj_jacDot, self.m.body("platform").id
        swirl = self.rows_at(rate, self.d.xpos[platform], platform) @ self.d.qvel
        gaps, rates = self.gaps(self.engine.mj_jac), self.gaps(rate) @ self.d.qvel
        return Closed(inertia, bias - self.d.qfrc_passive, gaps, rates, self.rows_of(names), self.twist(), swirl)


def driven(machine: Machine) -> tuple[list[str], list[bool]]:
    """Names of the actuators, and which of them turn."""
    found = actuators(machine)
    return [name for name, _ in found], [not isinstance(joint, Prismatic) for _, joint in found]


def smooth(machine: Machine) -> Machine:
    """Without Coulomb friction, which MuJoCo makes constraints of, and damping in balls, which its constraints do not have."""
    elements = [e for leg in machine.legs for e in leg.chain.elements]
    return changed(machine, {e.name: dict.fromkeys(("friction", "damping")[: 1 + isinstance(e, Spherical)]) for e in elements})


@pytest.mark.peer("mujoco")
@pytest.mark.parametrize(("name", "resists"), [*((name, False) for name in MACHINES), *((name, True) for name in RESISTING)])
def test_mujoco(name: str, resists: bool) -> None:
    machine = smooth(changed(machine_of(name), RESISTING[name]) if resists else machine_of(name))
    names, turns = driven(machine)
    for seed, (pose, signs, mode) in enumerate(stands(name)):
        situation = Situation.random(seed)
        model = Exact(to_mjcf(machine, pose, mode), situation)
        theirs, (state, rise, load) = model.closed(names), situation.asked(pose)
        case = batch.Case(machine, signs, situation.gravity)

        accelerations = theirs.accelerations(situation.acceleration)
        forces, _ = theirs.forces(accelerations, situation.load)
        ours = batch.drive_motion(case, state, rise, load)
        assert_close(ours.speed[0], theirs.drives @ model.d.qvel, turns)
        assert_close(ours.acceleration[0], theirs.drives @ accelerations, turns)
        assert_close(ours.force[0], forces, turns)

        given = forces * np.random.default_rng(seed).uniform(-1, 1, 6)
        found = batch.platform_acceleration(case, state, given[None], load)[0]
        assert_close(found, theirs.platform_acceleration(given, situation.load), TURNS)

        space, none = batch.equations(case, state).actuators, np.zeros((len(theirs.loops), 6))
        motions = within(theirs.loops, none, theirs.drives, np.eye(6))
        inertia = motions.T @ theirs.inertia @ motions
        units = np.sqrt(np.outer(np.diag(inertia), np.diag(inertia)))
        assert_close(space.inertia[0] / units, inertia / units)
        steady = within(theirs.loops, -theirs.loops_rate, theirs.drives, np.zeros(6))
        model.m.opt.gravity = 0
        weightless = model.closed(names).bias
        swirl = motions.T @ (theirs.inertia @ steady + weightless)
        assert_close(space.coriolis[0] + space.friction[0], swirl, turns)
        assert_close(space.gravity[0], motions.T @ (theirs.bias - weightless), turns)

        kinetic, potential = batch.energies(case, state)
        assert (potential[0], kinetic[0]) == pytest.approx(tuple(model.d.energy), rel=TOLERANCE)


class Hinge(NamedTuple):
    """One of trivet's joints, and which of Pinocchio's make it up: none for a ball at the end of a chain."""

    element: Any
    name: str
    frame: Frame
    """In whose axes and at whose origin its wrench is told, in {O}."""
    joints: list[int]

    @property
    def lever(self) -> float:
        """Path along which friction and motors are told, per unit of the coordinate."""
        return float(self.element.radius) if isinstance(self.element, Curvilinear) else 1.0


class End(NamedTuple):
    """Where a chain meets the platform."""

    last: Hinge
    is_ball: bool
    joint: int
    place: Any
    """In the last body of the chain."""
    seat: Any
    """In the platform."""


class Tree:
    """A machine in Pinocchio: its joints and inertias, placed by the fixed dimensions of trivet's elements."""

    def __init__(self, machine: Machine, pose: Frame, signs: Array, situation: Situation) -> None:
        import pinocchio

        self.pin, self.model = pinocchio, pinocchio.Model()
        self.model.gravity.linear = situation.gravity
        self.coordinates: list[float] = []
        self.hinges: list[Hinge] = []
        self.ends: list[End] = []
        self.platform = self.add(0, pinocchio.JointModelFreeFlyer(), IDENTITY, [*pose.origin, *self.quaternion(pose)])
        welds = sum(not isinstance(leg.chain.elements[-1], Spherical) for leg in machine.legs)
        # Pinocchio wants a mass beyond every joint; what is beyond the last one of a chain moves with the platform.
        self.share = platform_mass(machine.platform, machine.stock).times(1 / (1 + welds))
        self.weigh(self.platform, self.share, IDENTITY)
        for one in stand(machine, pose, signs):
            self.add_leg(machine.stock, one)
        for hinge in self.hinges:
            reflected = getattr(hinge.element, "reflected_inertia", None)
            if reflected is not None:
                self.model.armature[self.dofs(hinge.joints[0])] = reflected * hinge.lever**2
        self.q, self.v, self.data = np.array(self.coordinates), np.zeros(self.model.nv), self.model.createData()
        loops, _ = self.gaps()
        self.v = within(loops, np.zeros(len(loops)), self.at(self.platform)[0], situation.twist)

    def add_leg(self, stock: Stock, one: Standing) -> None:
        seat, frame, parent = one.leg.platform_frame(), one.leg.base_frame(), 0
        is_ball = isinstance(one.leg.chain.elements[-1], Spherical)
        for k, (element, place, coordinate) in enumerate(one.steps):
            made: list[int] = []
            is_end = is_ball and k == len(one.steps) - 1
            if is_end:
                self.weigh(self.platform, element.weigh(stock), seat)
            elif element.unknowns:
                for joint, values in self.joints_for(element, coordinate):
                    parent, frame = self.add(parent, joint, frame, values), IDENTITY
                    made.append(parent)
                if isinstance(element, Curvilinear):
                    frame = frame.shift((element.radius, 0, 0))
            else:
                frame = element.advance(frame, coordinate)
            if not is_end:
                self.weigh(parent, element.weigh(stock), frame)
            if is_end or made:
                told = one.steps[k + 1][1] if is_carriage(element, k) else place
                self.hinges.append(Hinge(element, f"{one.leg.name}.{element.name}", told, made))
        if not is_ball:
            self.weigh(parent, self.share.into(seat), frame)
        self.ends.append(End(self.hinges[-1], is_ball, parent, self.se3(frame), self.se3(seat)))

    def joints_for(self, element: Element, coordinate: Any) -> list[tuple[Any, list[float]]]:
        """Pinocchio's joints for one of trivet's, and their coordinates."""
        if isinstance(element, Spherical):
            return [(self.pin.JointModelSpherical(), self.quaternion(element.advance(IDENTITY, coordinate)))]
        if isinstance(element, Prismatic):
            return [(self.pin.JointModelPrismaticUnaligned(np.array(element.axis)), [float(coordinate)])]
        axes = element.axes if isinstance(element, Universal) else [getattr(element, "axis", (0.0, 0.0, 1.0))]
        angles = coordinate if isinstance(element, Universal) else [coordinate]
        hinges = (self.pin.JointModelRevoluteUnaligned(np.array(axis)) for axis in axes)
        return [(hinge, [math.atan2(angle.sin, angle.cos)]) for hinge, angle in zip(hinges, angles, strict=True)]

    def add(self, parent: int, joint: Any, frame: Frame, values: Iterable[float]) -> int:
        self.coordinates += map(float, values)
        return self.model.addJoint(parent, joint, self.se3(frame), f"joint {self.model.njoints}")

    def weigh(self, joint: int, mass: RigidMass, frame: Frame) -> None:
        """Add a body, given in a frame of a joint."""
        if mass.mass:
            about, centre = np.array(mass.about_centre.matrix(), dtype=float), np.array(mass.centre, dtype=float)
            self.model.appendBodyToJoint(joint, self.pin.Inertia(float(mass.mass), centre, about), self.se3(frame))

    def se3(self, frame: Frame) -> Any:
        return self.pin.SE3(np.array(frame.matrix(), dtype=float), np.array(frame.origin, dtype=float))

    def quaternion(self, frame: Frame) -> list[float]:
        return list(self.pin.Quaternion(np.array(frame.matrix(), dtype=float)).coeffs())

    def dofs(self, joint: int) -> list[int]:
        """Where the velocity of a joint stands in that of the tree."""
        own = self.model.joints[joint]
        return list(range(own.idx_v, own.idx_v + own.nv))

    def at(self, joint: int, place: Any = None) -> tuple[Array, Array]:
        """Twist of a place in a body, along the axes of {O}, per velocity; and its rate without accelerations."""
        given = joint, place or self.pin.SE3.Identity(), self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        rows = self.pin.getFrameJacobian(self.model, self.data, *given)
        return rows, self.pin.getFrameClassicalAcceleration(self.model, self.data, *given).vector

    def gaps(self) -> tuple[Array, Array]:
        """Velocities of the gaps of all loops per velocity, and their rates."""
        self.pin.computeJointJacobians(self.model, self.data, self.q)
        self.pin.forwardKinematics(self.model, self.data, self.q, self.v, np.zeros(self.model.nv))
        found = []
        for end in self.ends:
            pairs = zip(self.at(end.joint, end.place), self.at(self.platform, end.seat), strict=True)
            found.append([(one - other)[: 3 if end.is_ball else 6] for one, other in pairs])
        rows, rates = zip(*found, strict=True)
        return np.concatenate(rows), np.concatenate(rates)

    def resistance(self) -> Array:
        """Viscous and Coulomb friction of the joints, against the motion."""
        unit = np.eye(self.model.nv)
        sliding = [(h.element, h.lever * unit[self.dofs(joint)]) for h in self.hinges for joint in h.joints]
        sliding += [(end.last.element, self.turning(end)) for end in self.ends if end.is_ball]
        return sum(rows.T @ rubbing(joint, rows @ self.v) for joint, rows in sliding)

    def turning(self, end: End) -> Array:
        """Angular velocity of the platform on the end of a chain per velocity."""
        return (self.at(self.platform, end.seat)[0] - self.at(end.joint, end.place)[0])[3:]

    def closed(self, names: list[str]) -> Closed:
        """The equations of motion."""
        (loops, rates), (platform, rate) = self.gaps(), self.at(self.platform)
        where = {hinge.name: self.dofs(hinge.joints[0])[0] for hinge in self.hinges if hinge.joints}
        drives = np.eye(self.model.nv)[[where[name] for name in names]]
        bias = self.pin.nonLinearEffects(self.model, self.data, self.q, self.v) + self.resistance()
        upper = np.triu(self.pin.crba(self.model, self.data, self.q))
        return Closed(upper + np.triu(upper, 1).T, bias, loops, rates, drives, platform, rate)

    def solver(self) -> Any:
        """Pinocchio's own solver of closed loops: accelerations from forces along all coordinates."""
        models, datas = self.pin.StdVec_RigidConstraintModel(), self.pin.StdVec_RigidConstraintData()
        for end in self.ends:
            kind = self.pin.ContactType.CONTACT_3D if end.is_ball else self.pin.ContactType.CONTACT_6D
            places = end.joint, end.place, self.platform, end.seat
            models.append(self.pin.RigidConstraintModel(kind, self.model, *places, self.pin.ReferenceFrame.LOCAL))
            datas.append(models[-1].createData())
        data, settings = self.model.createData(), self.pin.ProximalSettings(1e-14, 1e-12, 20)
        self.pin.initConstraintDynamics(self.model, data, models, datas)
        return lambda given: self.pin.constraintDynamics(self.model, data, self.q, self.v, given, models, datas, settings)

    def simulated(self, given: Array) -> Array:
        """Acceleration of the platform under forces along all coordinates."""
        self.pin.forwardKinematics(self.model, self.data, self.q, self.v, self.solver()(given))
        return self.at(self.platform)[1]

    def wrenches(self, accelerations: Array, multipliers: Array) -> dict[str, Array]:
        """What is handed on through trivet's joints, as trivet tells it."""
        outer, found = self.pin.StdVec_Force([self.pin.Force.Zero()] * self.model.njoints), {}
        for end in self.ends:
            count = 3 if end.is_ball else 6
            own, multipliers = np.concatenate([multipliers[:count], np.zeros(6 - count)]), multipliers[count:]
            if end.is_ball:
                own[3:] += rubbing(end.last.element, self.turning(end) @ self.v)
            body = self.data.oMi[end.joint]
            on_chain = self.pin.SE3(np.eye(3), (body * end.place).translation).act(self.pin.Force(own))
            outer[end.joint] = body.actInv(on_chain)
            if end.is_ball:
                found[end.last.name] = self.se3(end.last.frame).actInv(-on_chain).vector
        self.pin.rnea(self.model, self.data, self.q, self.v, accelerations, outer)
        for hinge in self.hinges:
            for joint in hinge.joints:
                passed = self.data.oMi[joint].act(self.data.f[joint])
                found[hinge.name] = self.se3(hinge.frame).actInv(passed).vector
        return found


def is_carriage(element: Element, place: int) -> bool:
    """Whether a joint tells its wrench where the body beyond it stands: the carriage of a guide."""
    return isinstance(element, Curvilinear) or (place == 0 and isinstance(element, Prismatic))


def rubbing(joint: Joint, speed: Array) -> Array:
    """Force or moment against a speed."""
    return ((joint.damping or 0) + (joint.friction or 0) / np.linalg.norm(speed)) * speed


@pytest.mark.peer("pin", module="pinocchio")
@pytest.mark.parametrize(("name", "resists"), [*((name, False) for name in KINDS), *((name, True) for name in RESISTING)])
def test_pinocchio(name: str, resists: bool) -> None:
    machine = changed(machine_of(name), RESISTING[name]) if resists else machine_of(name)
    names, turns = driven(machine)
    for seed, (pose, signs, _) in enumerate(stands(name)[:2]):
        situation = Situation.random(seed)
        tree = Tree(machine, pose, signs, situation)
        theirs, (state, rise, load) = tree.closed(names), situation.asked(pose)
        case = batch.Case(machine, signs, situation.gravity)

        accelerations = theirs.accelerations(situation.acceleration)
        forces, multipliers = theirs.forces(accelerations, situation.load)
        assert_close(batch.drive_motion(case, state, rise, load).force[0], forces, turns)

        given = forces * np.random.default_rng(seed).uniform(-1, 1, 6)
        found = batch.platform_acceleration(case, state, given[None], load)[0]
        assert_close(found, theirs.platform_acceleration(given, situation.load), TURNS)
        along_all = theirs.drives.T @ given + theirs.platform.T @ situation.load - tree.resistance()
        assert_close(found, tree.simulated(along_all), TURNS)

        wrenches = tree.wrenches(accelerations, multipliers)
        ours = dict(zip(batch.joint_list(machine), batch.reactions(case, state, rise, load)[0], strict=True))
        # Moments as forces at the radius of the platform: struts hardly bear any.
        scale = np.where(TURNS, 1 / float(machine.characteristic_length), 1.0)
        assert_close(np.stack([ours[joint] for joint in wrenches]) * scale, np.stack(list(wrenches.values())) * scale)
