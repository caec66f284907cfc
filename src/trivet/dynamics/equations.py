"""The machine's equations of motion at one pose, in task space (paper Eq 17) and in the space of the actuators (Eqs 27-32).

    M_t Vdot + C_t + g_t + F_t = J_G^-T tau_Q + tau_ext          (17), (22)
    M_Q Qddot + C_Q + g_Q + F_Q = tau_Q + J_G^T tau_ext          (27), (32)

V is the twist of the platform centre in {O} (not the rates of any angles), tau_ext a wrench on the platform at its centre, F the
friction of the joints.  M contains what motors and gears reflect.  Chains are those of `dynamics.chain`; nothing here divides by
anything but the chains' W and, in the space of the actuators, J_G^-1, so that M_t and the like are regular at Type 2 singularities
(where the actuators lose the platform), and nothing is at Type 1 (where a chain does).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from trivet.dynamics.bodies import Bodies
from trivet.dynamics.chain import (
    Chain,
    chain_at,
    chain_inertia,
    chain_motion,
    inertia_forces,
    reflected,
    resistance,
    rigid_force,
)  # fmt: skip
from trivet.kinematics.walk import Posture
from trivet.model.mass import RigidMass
from trivet.space.elimination import inverse, solve
from trivet.space.frame import IDENTITY, Frame
from trivet.space.scalar import Scalar, add, mul
from trivet.space.screw import Twist, Wrench
from trivet.space.symmetric import Symmetric, dot
from trivet.space.vector import ZERO, Vec


class State(NamedTuple):
    """Where the platform is and how it moves."""

    pose: Frame
    """{E} in {O} (m)."""
    twist: Twist
    """V: velocity of the centre (m/s) and angular velocity (rad/s), in {O}."""


class Surroundings(NamedTuple):
    """What acts on a machine besides its actuators."""

    gravity: Vec
    """Acceleration of free fall in {O}, m/s^2."""
    load: Wrench
    """tau_ext: force (N) and moment (N m) on the platform, at its centre in {O}."""
    creep: Scalar = 0
    """Speed (m/s, rad/s) around which Coulomb friction passes through zero; zero for a jump."""


class TaskSpace(NamedTuple):
    """Eq (17) at one state."""

    inertia: Symmetric
    """M_t, 6 x 6 (kg, kg m, kg m^2)."""
    coriolis: Wrench
    """C_t (N, N m)."""
    gravity: Wrench
    """g_t."""
    friction: Wrench
    """F_t."""
    jacobian: list[Wrench]
    """Rows of J_G^-1, Qdot = J_G^-1 V, actuators in the order of Q."""
    drift: list[Scalar]
    """Qddot where Vdot = 0: the time derivative of J_G^-1, times V."""


class ActuatorSpace(NamedTuple):
    """Eq (27) at one state; actuators in the order of Q."""

    inertia: list[list[Scalar]]
    """M_Q (kg, kg m, kg m^2)."""
    coriolis: list[Scalar]
    """C_Q (N, N m)."""
    gravity: list[Scalar]
    """g_Q."""
    friction: list[Scalar]
    """F_Q."""


class Platform(NamedTuple):
    """The platform with the balls that it carries."""

    mass: RigidMass
    """About its centre, in the axes of {O}."""

    def force(self, twist: Twist, acceleration: Twist, gravity: Vec) -> Wrench:
        """M_p Vdot + C_p + g_p."""
        linear = acceleration.linear - twist.angular.cross(twist.linear) - gravity
        return rigid_force(self.mass, twist, Twist(linear, acceleration.angular))


def platform_at(bodies: Bodies, pose: Frame) -> Platform:
    """The platform at a pose."""
    return Platform(bodies.platform.out_of(pose._replace(origin=ZERO)))


def chains_at(bodies: Bodies, pose: Frame, stand: Sequence[Posture]) -> list[Chain]:
    """All chains at a pose."""
    return [chain_at(leg, pose, posture, bodies.stock) for leg, posture in zip(bodies.legs, stand, strict=True)]


def task_space(bodies: Bodies, state: State, stand: Sequence[Posture], around: Surroundings) -> TaskSpace:
    """Eq (17): platform (M_p, C_p, g_p) and chains (M_i, C_i, g_i of Eqs 18-20, with C_i as corrected in docs/dynamics.md)."""
    pose, twist = state
    rest = Twist(ZERO, ZERO)
    platform = platform_at(bodies, pose)
    inertia = _platform_inertia(platform)
    coriolis = platform.force(twist, rest, ZERO)
    gravity = platform.force(rest, rest, around.gravity)
    friction = Wrench(ZERO, ZERO)
    rows: list[list[Wrench]] = []
    drifts: list[list[Scalar]] = []
    for chain in chains_at(bodies, pose, stand):
        z, own = chain.rows(), chain_inertia(chain)
        motion = chain_motion(chain, twist, rest)
        for i in range(len(z)):
            for j in range(len(z)):
                _add_product(inertia, own[i, j], z[i], z[j])
        swirl, _ = inertia_forces(chain, motion.rates, motion.accelerations, ZERO)
        still = [0] * len(z)
        weight, _ = inertia_forces(chain, still, still, chain.inwards(around.gravity))
        motors = [mul(reflected(joint), rise) for joint, rise in zip(chain.joints, motion.accelerations, strict=True)]
        coriolis = _sum(coriolis, [add(a, b) for a, b in zip(swirl, motors, strict=True)], z)
        gravity = _sum(gravity, weight, z)
        lost = resistance(chain, motion, around.creep)
        friction = _sum(friction, lost.along(chain.screws), z).plus(chain.outwards(Wrench(ZERO, lost.in_ball)))
        rows.append([z[k] for k in chain.drives])
        drifts.append([motion.accelerations[k] for k in chain.drives])
    order = bodies.ranks
    return TaskSpace(inertia, coriolis, gravity, friction, [rows[c][k] for c, k in order], [drifts[c][k] for c, k in order])


def actuator_space(task: TaskSpace, length: Scalar) -> ActuatorSpace:
    """Eqs (28)-(31): M_Q = J_G^T M_t J_G, C_Q = J_G^T (C_t + M_t dJ_G/dt Qdot), g_Q = J_G^T g_t.

    Args:
        task: Eq (17).
        length: by which moments are compared with forces (m).
    """
    columns = list(zip(*inverse(_scaled(task.jacobian, length)), strict=True))  # J_G, with turns times the length
    jacobian = [[*column[:3], *(c / length for c in column[3:])] for column in columns]
    moved = [[dot([task.inertia[i, j] for j in range(6)], column) for i in range(6)] for column in jacobian]
    inertia = [[dot(row, column) for column in moved] for row in jacobian]
    # dJ_G/dt Qdot = -J_G (dJ_G^-1/dt) V
    coriolis = [*task.coriolis.force, *task.coriolis.moment]
    swirl = [add(dot(row, coriolis), mul(-1, dot(own, task.drift))) for row, own in zip(jacobian, inertia, strict=True)]
    gravity, friction = ([dot(row, [*w.force, *w.moment]) for row in jacobian] for w in (task.gravity, task.friction))
    return ActuatorSpace(inertia, swirl, gravity, friction)


def needed_wrench(bodies: Bodies, state: State, acceleration: Twist, chains: Sequence[Chain], around: Surroundings) -> Wrench:
    """M_t Vdot + C_t + g_t + F_t - tau_ext at once, by the recursion of Newton and Euler: what the actuators must bring about."""
    pose, twist = state
    total = platform_at(bodies, pose).force(twist, acceleration, around.gravity).plus(around.load, -1)
    for chain in chains:
        motion = chain_motion(chain, twist, acceleration)
        forces, _ = inertia_forces(chain, motion.rates, motion.accelerations, chain.inwards(around.gravity))
        lost = resistance(chain, motion, around.creep)
        own = Wrench(ZERO, lost.in_ball)
        for row, force, drag, joint, rise in zip(
            chain.reciprocal, forces, lost.along(chain.screws), chain.joints, motion.accelerations, strict=True
        ):
            own = own.plus(row, add(add(force, drag), mul(reflected(joint), rise)))
        total = total.plus(chain.outwards(own))
    return total


def drive_rows(bodies: Bodies, chains: Sequence[Chain]) -> list[Wrench]:
    """Rows of J_G^-1 in the order of Q."""
    rows = [[chain.reciprocal[k] for k in chain.drives] for chain in chains]
    return [chains[c].outwards(rows[c][k]) for c, k in bodies.ranks]


def inverse_dynamics(
    bodies: Bodies, state: State, acceleration: Twist, stand: Sequence[Posture], around: Surroundings
) -> list[Scalar]:
    """tau_Q: the forces (N, N m) that the actuators must give for a motion, in the order of Q; NaN or huge where they cannot.

    Args:
        bodies: the machine.
        state: pose and twist.
        acceleration: Vdot (m/s^2, rad/s^2).
        stand: how every chain stands.
        around: what else acts.
    """
    length = bodies.length
    chains = chains_at(bodies, state.pose, stand)
    wrench = needed_wrench(bodies, state, acceleration, chains, around)
    columns = list(zip(*_scaled(drive_rows(bodies, chains), length), strict=True))
    right = [[c] for c in wrench.force] + [[c / length] for c in wrench.moment]
    return [row[0] for row in solve(columns, right)]


def forward_dynamics(task: TaskSpace, forces: Sequence[Scalar], load: Wrench) -> Twist:
    """Vdot under actuator forces (N, N m) in the order of Q and a load on the platform: Eq (17) solved for it."""
    right = load.plus(task.coriolis, -1).plus(task.gravity, -1).plus(task.friction, -1)
    for row, force in zip(task.jacobian, forces, strict=True):
        right = right.plus(row, force)
    flat = [*right.force, *right.moment]
    undone = task.inertia.inverse()
    found = [dot([undone[i, j] for j in range(6)], flat) for i in range(6)]
    return Twist(Vec(*found[:3]), Vec(*found[3:]))


def energy(bodies: Bodies, state: State, stand: Sequence[Posture], gravity: Vec) -> tuple[Scalar, Scalar]:
    """Kinetic energy, that of motors and gears included, and potential energy (J; zero with all masses at the origin of {O})."""
    pose, twist = state
    platform = platform_at(bodies, pose).mass
    kinetic = mul(platform.momentum(twist) @ twist, 0.5)
    height = gravity @ (platform.moment + pose.origin * platform.mass)
    for chain in chains_at(bodies, pose, stand):
        rates = chain_motion(chain, twist, Twist(ZERO, ZERO)).rates
        own = chain_inertia(chain)
        for i, rate in enumerate(rates):
            kinetic = add(kinetic, mul(0.5, mul(rate, dot([own[i, j] for j in range(len(rates))], rates))))
        end = pose.origin + chain.arm
        fall = chain.inwards(gravity)
        for member in chain.inner:
            height = add(height, add(fall @ member.mass.moment, mul(gravity @ end, member.mass.mass)))
    return kinetic, -height


def _platform_inertia(platform: Platform) -> Symmetric:
    matrix = Symmetric(6)
    units = [Twist(axis, ZERO) for axis in IDENTITY[1:]] + [Twist(ZERO, axis) for axis in IDENTITY[1:]]
    for j, unit in enumerate(units):
        momentum = platform.mass.momentum(unit)
        column = [*momentum.force, *momentum.moment]
        for i in range(j + 1):
            matrix[i, j] = column[i]
    return matrix


def _add_product(matrix: Symmetric, factor: Scalar, a: Wrench, b: Wrench) -> None:
    left, right = [*a.force, *a.moment], [*b.force, *b.moment]
    for i in range(6):
        for j in range(i, 6):
            matrix[i, j] = add(matrix[i, j], mul(factor, mul(left[i], right[j])))


def _sum(wrench: Wrench, forces: Sequence[Scalar], rows: Sequence[Wrench]) -> Wrench:
    """A wrench and Z^T forces."""
    for force, row in zip(forces, rows, strict=True):
        wrench = wrench.plus(row, force)
    return wrench


def _scaled(rows: Sequence[Wrench], length: Scalar) -> list[list[Scalar]]:
    return [[*row.force, *(c / length for c in row.moment)] for row in rows]
