"""The machine's equations of motion, in task space (paper Eq 17) and in the space of the actuators (Eqs 27-32).

    M_t Vdot + C_t + g_t + F_t = J_G^-T tau_Q + tau_ext          (17), (22)
    M_Q Qddot + C_Q + g_Q + F_Q = tau_Q + J_G^T tau_ext          (27), (32)

V is the twist of the platform centre in {O} (not the rates of any angles), tau_ext a wrench on the platform at its centre, F
the friction of the joints; M contains what motors and gears reflect.  Nothing here divides by anything but the chains' W and,
in the space of the actuators, J_G^-1: M_t and its companions are regular at Type 2 singularities, where the actuators lose the
platform, and nothing is at Type 1, where a chain does.

States are batches: components of poses, twists and wrenches have the shape (n,).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax.numpy as jnp

from trivet.dynamics.bodies import Bodies
from trivet.dynamics.chain import (
    Chain,
    ChainMotion,
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
from trivet.space.elimination import Array, eliminated, solve
from trivet.space.frame import IDENTITY, Frame
from trivet.space.scalar import Scalar, add, is_zero, mul
from trivet.space.screw import Twist, Wrench
from trivet.space.symmetric import dot
from trivet.space.vector import ZERO, Vec

REST = Twist(ZERO, ZERO)


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
    """Eq (17); actuators in the order of Q."""

    inertia: Array
    """M_t (n, 6, 6): kg, kg m, kg m^2."""
    coriolis: Array
    """C_t (n, 6): N, N m."""
    gravity: Array
    """g_t (n, 6)."""
    friction: Array
    """F_t (n, 6)."""
    jacobian: Array
    """J_G^-1 (n, 6, 6), Qdot = J_G^-1 V."""
    velocity_product: Array
    """(n, 6): Qddot where Vdot = 0, the time derivative of J_G^-1 times V."""


class ActuatorSpace(NamedTuple):
    """Eq (27); actuators in the order of Q."""

    inertia: Array
    """M_Q (n, 6, 6): kg, kg m, kg m^2."""
    coriolis: Array
    """C_Q (n, 6): N, N m."""
    gravity: Array
    """g_Q (n, 6)."""
    friction: Array
    """F_Q (n, 6)."""


class Platform(NamedTuple):
    """The platform with the balls that it carries."""

    mass: RigidMass
    """About its centre, in the axes of {O}."""

    @classmethod
    def at(cls, bodies: Bodies, pose: Frame) -> Platform:
        """The platform at poses."""
        return cls(bodies.platform.out_of(pose._replace(origin=ZERO)))

    def force(self, twist: Twist, acceleration: Twist, gravity: Vec) -> Wrench:
        """M_p Vdot + C_p + g_p."""
        linear = acceleration.linear - twist.angular.cross(twist.linear) - gravity
        return rigid_force(self.mass, twist, Twist(linear, acceleration.angular))


Stand = Sequence[Posture]
"""How the chains stand: one posture per group of `Bodies.alike`, components (chains, n)."""


def chains_at(bodies: Bodies, pose: Frame, stand: Stand) -> list[Chain]:
    """The chains at poses (n,), one per group of `Bodies.alike`, components (chains, n)."""
    return [chain_at(group.leg, pose, posture, bodies.stock) for group, posture in zip(bodies.alike(), stand, strict=True)]


def task_space(bodies: Bodies, state: State, stand: Stand, around: Surroundings) -> TaskSpace:
    """Eq (17): platform (M_p, C_p, g_p) and chains (M_i, C_i, g_i of Eqs 18-20, C_i as corrected in docs/dynamics.md)."""
    pose, twist = state
    shape = jnp.shape(pose.origin.x)
    platform = Platform.at(bodies, pose)
    units = [*(Twist(axis, ZERO) for axis in IDENTITY[1:]), *(Twist(ZERO, axis) for axis in IDENTITY[1:])]
    inertia = jnp.stack([_array(platform.mass.momentum(unit), shape) for unit in units], axis=-1)
    coriolis = _array(platform.force(twist, REST, ZERO), shape)
    gravity = _array(platform.force(REST, REST, around.gravity), shape)
    friction = jnp.zeros((*shape, 6))
    rows: dict[tuple[int, int], Array] = {}
    drifts: dict[tuple[int, int], Array] = {}
    for group, chain in zip(bodies.alike(), chains_at(bodies, pose, stand), strict=True):
        inner = (len(group.places), *shape)
        z = jnp.stack([_array(row, inner) for row in chain.rows()], axis=-2)
        motion = chain_motion(chain, twist, REST)
        still = [0] * len(motion.rates)
        swirl, _ = inertia_forces(chain, motion.rates, motion.accelerations, ZERO)
        motors = [mul(reflected(joint), rise) for joint, rise in zip(chain.joints, motion.accelerations, strict=True)]
        weight, _ = inertia_forces(chain, still, still, chain.inwards(around.gravity))
        lost = resistance(chain, motion, around.creep)
        inertia += jnp.einsum("cnia,cnij,cnjb->nab", z, _array2(chain_inertia(chain).full(), inner), z)
        coriolis += jnp.einsum("cnia,cni->na", z, _array1([add(a, b) for a, b in zip(swirl, motors, strict=True)], inner))
        gravity += jnp.einsum("cnia,cni->na", z, _array1(weight, inner))
        friction += jnp.einsum("cnia,cni->na", z, _array1(lost.along(chain.screws), inner))
        friction += _array(chain.outwards(Wrench(ZERO, lost.in_ball)), inner).sum(axis=0)
        rises = _array1(motion.accelerations, inner)
        for own, place in enumerate(group.places):
            for rank, k in enumerate(chain.drives):
                rows[place, rank], drifts[place, rank] = z[own, :, k], rises[own, :, k]
    jacobian = jnp.stack([rows[rank] for rank in bodies.ranks], axis=-2)
    return TaskSpace(
        inertia, coriolis, gravity, friction, jacobian, jnp.stack([drifts[rank] for rank in bodies.ranks], axis=-1)
    )


def actuator_space(task: TaskSpace, length: Scalar) -> ActuatorSpace:
    """Eqs (28)-(31): M_Q = J_G^T M_t J_G, C_Q = J_G^T (C_t + M_t dJ_G/dt Qdot), g_Q = J_G^T g_t.

    Args:
        task: Eq (17).
        length: by which moments are compared with forces (m).
    """
    jacobian = forward_jacobian(task, length)
    inertia = jnp.einsum("nai,nab,nbj->nij", jacobian, task.inertia, jacobian)
    inertia = (inertia + jnp.swapaxes(inertia, -1, -2)) / 2

    def seen(wrench: Array) -> Array:
        return jnp.einsum("nai,na->ni", jacobian, wrench)

    # dJ_G/dt Qdot = -J_G (dJ_G^-1/dt) V
    swirl = seen(task.coriolis) - jnp.einsum("nij,nj->ni", inertia, task.velocity_product)
    return ActuatorSpace(inertia, swirl, seen(task.gravity), seen(task.friction))


def forward_jacobian(task: TaskSpace, length: Scalar) -> Array:
    """J_G (n, 6, 6), V = J_G Qdot (Eq 23)."""
    scale = jnp.concatenate([jnp.ones(3), jnp.full(3, length)])
    # Solved with turns times the length, so that pivots compare.
    return eliminated(task.jacobian / scale, jnp.eye(6)[None])[0] / scale[:, None]


class Drives(NamedTuple):
    """What the actuators do in a motion, in the order of Q; components (n,)."""

    force: list[Scalar]
    """tau_Q (N, N m): NaN or beyond all bounds where the actuators cannot bring the motion about (Type 2)."""
    speed: list[Scalar]
    """Qdot (m/s, rad/s)."""
    acceleration: list[Scalar]
    """Qddot (m/s^2, rad/s^2)."""


def inverse_dynamics(bodies: Bodies, state: State, acceleration: Twist, stand: Stand, around: Surroundings) -> Drives:
    """What the actuators must give for a motion: Eq (17) by the recursion of Newton and Euler, then Eq (32).

    Args:
        bodies: the machine.
        state: poses and twists.
        acceleration: Vdot (m/s^2, rad/s^2).
        stand: how the chains stand.
        around: what else acts.

    Returns:
        NaN where a chain does not reach.
    """
    pose, twist = state
    needed = Platform.at(bodies, pose).force(twist, acceleration, around.gravity).plus(around.load, -1)
    rows: dict[tuple[int, int], Wrench] = {}
    rises: dict[tuple[int, int], Scalar] = {}
    for group, chain in zip(bodies.alike(), chains_at(bodies, pose, stand), strict=True):
        motion = chain_motion(chain, twist, acceleration)
        shape = (len(group.places), *jnp.shape(pose.origin.x))
        needed = needed.plus(_summed(chain.outwards(chain_needs(chain, motion, around)), shape))
        for rank, k in enumerate(chain.drives):
            row, rise = chain.outwards(chain.reciprocal[k]), jnp.broadcast_to(motion.accelerations[k], shape)
            for own, place in enumerate(group.places):
                rows[place, rank], rises[place, rank] = _picked(row, own, shape), rise[own]
    ordered = [rows[rank] for rank in bodies.ranks]
    columns = [[*row.force, *(c / bodies.length for c in row.moment)] for row in ordered]
    right = [[c] for c in needed.force] + [[c / bodies.length] for c in needed.moment]
    forces = [row[0] for row in solve(list(zip(*columns, strict=True)), right)]
    return Drives(forces, [row @ twist for row in ordered], [rises[rank] for rank in bodies.ranks])


def chain_needs(chain: Chain, motion: ChainMotion, around: Surroundings) -> Wrench:
    """The wrench on the platform, at P in the chain's axes, which would move a chain in place of its drives."""
    forces, _ = inertia_forces(chain, motion.rates, motion.accelerations, chain.inwards(around.gravity))
    lost = resistance(chain, motion, around.creep)
    needed = Wrench(ZERO, lost.in_ball)
    for row, force, drag, joint, rise in zip(
        chain.reciprocal, forces, lost.along(chain.screws), chain.joints, motion.accelerations, strict=True
    ):
        needed = needed.plus(row, add(add(force, drag), mul(reflected(joint), rise)))
    return needed


def forces_of(task: TaskSpace, acceleration: Array, load: Wrench, length: Scalar) -> Array:
    """tau_Q (n, 6) for accelerations Vdot (n, 6), from Eqs (17) and (32); slower than `inverse_dynamics`."""
    wrench = jnp.einsum("nab,nb->na", task.inertia, acceleration) - _array(load, acceleration.shape[:1])
    scale = jnp.concatenate([jnp.ones(3), jnp.full(3, length)])
    needed = (wrench + task.coriolis + task.gravity + task.friction) / scale
    return eliminated(jnp.swapaxes(task.jacobian / scale, -1, -2), needed[..., None])[0][..., 0]


def forward_dynamics(task: TaskSpace, forces: Array, load: Wrench) -> Array:
    """Vdot (n, 6) under actuator forces (n, 6) in the order of Q and a load on the platform, by Eqs (17) and (22)."""
    given = jnp.einsum("nia,ni->na", task.jacobian, forces) + _array(load, task.coriolis.shape[:1])
    right = given - task.coriolis - task.gravity - task.friction
    return eliminated(task.inertia, right[..., None])[0][..., 0]


def energy(bodies: Bodies, state: State, stand: Stand, gravity: Vec) -> tuple[Scalar, Scalar]:
    """Kinetic energy, of motors and gears too, and potential energy (J; zero with all masses at the origin of {O})."""
    pose, twist = state
    platform = Platform.at(bodies, pose).mass
    kinetic = mul(platform.momentum(twist) @ twist, 0.5)
    fallen = gravity @ (platform.moment + pose.origin * platform.mass)
    for group, chain in zip(bodies.alike(), chains_at(bodies, pose, stand), strict=True):
        rates, matrix = chain_motion(chain, twist, REST).rates, chain_inertia(chain)
        own = mul(0.5, dot([dot([matrix[i, j] for j in range(len(rates))], rates) for i in range(len(rates))], rates))
        end, fall, lower = pose.origin + chain.arm, chain.inwards(gravity), 0
        for member in chain.inner:
            lower = add(lower, add(fall @ member.mass.moment, mul(gravity @ end, member.mass.mass)))
        inner = (len(group.places), *jnp.shape(pose.origin.x))
        kinetic, fallen = (
            total + jnp.sum(jnp.broadcast_to(part, inner), axis=0) for total, part in ((kinetic, own), (fallen, lower))
        )
    return kinetic, -fallen


def _array1(components: Sequence[Scalar], shape: tuple[int, ...]) -> Array:
    """(*shape, k)."""
    return jnp.stack([jnp.broadcast_to(jnp.asarray(c, dtype=float), shape) for c in components], axis=-1)


def _array2(rows: Sequence[Sequence[Scalar]], shape: tuple[int, ...]) -> Array:
    """(*shape, k, k)."""
    return jnp.stack([_array1(row, shape) for row in rows], axis=-2)


def _array(wrench: Wrench, shape: tuple[int, ...]) -> Array:
    """(*shape, 6)."""
    return _array1([*wrench.force, *wrench.moment], shape)


def _summed(wrench: Wrench, shape: tuple[int, ...]) -> Wrench:
    """The sum over chains."""
    return _each(wrench, lambda c: jnp.sum(jnp.broadcast_to(c, shape), axis=0))


def _picked(wrench: Wrench, own: int, shape: tuple[int, ...]) -> Wrench:
    """That of one chain."""
    return _each(wrench, lambda c: jnp.broadcast_to(c, shape)[own])


def _each(wrench: Wrench, change: Callable[[Array], Array]) -> Wrench:
    return Wrench(*(Vec(*(c if is_zero(c) else change(c) for c in v)) for v in wrench))
