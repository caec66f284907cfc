"""Integration of the equations of motion in time, by diffrax (P. Kidger, On Neural Differential Equations, 2021).

The unknowns are how far the platform has moved and turned (a quaternion) from where it began, and its twist.  All joints follow
from the pose in closed form, so the loops are closed to rounding at every instant, however long the run; the quaternion is
normalised wherever it is used.  Displacements, not positions: the rounding of a position at every step would be as large as the
deflection of a stiff spring is accurate.  Two more unknowns are the work that friction takes and that which constant forces put
in, so that energy can be balanced.

The integrator is Dormand and Prince's of order 8, with steps of bounded length: a tenth of a radian of the fastest vibration on
the drives' springs, where steps of constant length lose hardly any energy, and shorter ones where the tolerance asks for it.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from trivet.dynamics import equations as eq
from trivet.dynamics.bodies import Bodies
from trivet.kinematics.jacobian import is_driven
from trivet.model.elements import Drivable
from trivet.space.elimination import Array
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec

MOST_STEPS = 100_000
"""Of one call: where steps shrink without end it gets stuck, not lost, and whoever interrupts is heard between calls."""


class Acting(NamedTuple):
    """What acts on a machine in a simulation."""

    gravity: Array
    """(3,) acceleration of free fall in {O}, m/s^2."""
    force: Array
    """(3,) on the platform, in {O}, N."""
    moment: Array
    """(3,) on the platform, in {O}, N m."""
    point: Array
    """(3,) where the force acts, in {E}, m."""
    drive_force: Array
    """(6,) constant forces of the actuators in the order of Q, N or N m."""
    rate: Array
    """(6,) stiffness of the actuators' springs, N/m or N m/rad; zero for none."""
    rest: Array
    """(6,) coordinates at which the springs are slack, m or rad."""
    creep: Array
    """Speed (m/s, rad/s) around which Coulomb friction passes through zero."""
    beginning: Frame
    """{E} in {O} from which displacements are counted (m)."""


class Steps(NamedTuple):
    """How steps are chosen."""

    longest: Array
    """s."""
    tolerance: Array
    """Relative error per step."""


class Run(NamedTuple):
    """Unknowns at some times."""

    unknowns: Array
    """(n, 15): displacement, quaternion (scalar first), V, work of friction and of constant forces; infinite where stuck."""
    steps: Array
    """How many were taken."""


def start(twist: Array) -> Array:
    """(15,) unknowns at the beginning."""
    return jnp.concatenate([jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), twist, jnp.zeros(2)])


@jax.jit
def advance(bodies: Bodies, signs: Array, acting: Acting, steps: Steps, unknowns: Array, times: Array) -> Run:
    """The unknowns at times (n,), the first of which is that of the given ones."""
    import diffrax

    found = diffrax.diffeqsolve(
        diffrax.ODETerm(_slope),
        diffrax.Dopri8(),
        times[0],
        times[-1],
        jnp.minimum(steps.longest, times[-1] - times[0]),
        unknowns,
        args=(bodies, signs, acting),
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.PIDController(
            rtol=steps.tolerance,
            atol=steps.tolerance * 1e-3,
            dtmax=steps.longest,
            dtmin=1e-9 * steps.longest,
            force_dtmin=False,
        ),
        max_steps=MOST_STEPS,
        throw=False,
        adjoint=diffrax.ForwardMode(),  # the one that neither keeps nor recomputes steps
    )
    return Run(found.ys, found.stats["num_steps"])


def state_of(beginning: Frame, unknowns: Array) -> eq.State:
    """Pose and twist from unknowns (n, 15), components (n,)."""
    moved, q, v = Vec(*unknowns[:, :3].T), unknowns[:, 3:7].T, unknowns[:, 7:13].T
    w, *vector = q / jnp.sqrt(jnp.sum(q * q, axis=0))
    u = Vec(*vector)

    def turned(axis: Vec) -> Vec:
        across = u.cross(axis) * 2
        return axis + across * w + u.cross(across)

    pose = Frame(beginning.origin + moved, *(turned(axis) for axis in beginning[1:]))
    return eq.State(pose, Twist(Vec(*v[:3]), Vec(*v[3:])))


def drive_coordinates(bodies: Bodies, stand: eq.Stand) -> Array:
    """(n, 6) of the actuators in the order of Q; angles in (-pi, pi]."""
    found: dict[tuple[int, int], Scalar] = {}
    for group, posture in zip(bodies.alike(), stand, strict=True):
        own = [(e, c) for e, c in zip(group.leg.chain.elements, posture.coordinates, strict=True) if is_driven(e)]
        for rank, (element, coordinate) in enumerate(own):
            plain = element.number(coordinate)
            for k, place in enumerate(group.places):
                found[place, rank] = plain[k]
    return jnp.stack([found[rank] for rank in bodies.ranks], axis=-1)


def stretch(bodies: Bodies, stand: eq.Stand, acting: Acting) -> Array:
    """(n, 6): how far the actuators are from where their springs are slack; angles the short way round."""
    apart = drive_coordinates(bodies, stand) - acting.rest
    joints = [[e for e in leg.chain.elements if isinstance(e, Drivable) and e.is_driven] for leg in bodies.legs]
    angular = jnp.array([joints[place][rank].is_angular for place, rank in bodies.ranks])
    return jnp.where(angular, jnp.arctan2(jnp.sin(apart), jnp.cos(apart)), apart)


def drive_forces(bodies: Bodies, stand: eq.Stand, acting: Acting) -> Array:
    """(n, 6): what the actuators give."""
    return acting.drive_force - acting.rate * stretch(bodies, stand, acting)


def load_at(acting: Acting, pose: Frame) -> Wrench:
    """The load on the platform, at its centre in {O}."""
    force = Vec(*acting.force)
    return Wrench(force, Vec(*acting.moment) + pose.direction(tuple(acting.point)).cross(force))


def _slope(_: Scalar, unknowns: Array, given: tuple[Bodies, Array, Acting]) -> Array:
    return _rates(*given, unknowns)


def _rates(bodies: Bodies, signs: Array, acting: Acting, unknowns: Array) -> Array:
    state = state_of(acting.beginning, unknowns[None])
    stand = [group.stand(state.pose, signs) for group in bodies.alike()]
    load = load_at(acting, state.pose)
    task = eq.task_space(bodies, state, stand, eq.Surroundings(Vec(*acting.gravity), load, acting.creep))
    rise = eq.forward_dynamics(task, drive_forces(bodies, stand, acting), load)[0]
    w, x, y, z = unknowns[3:7]
    p, q, r = unknowns[10:13]
    spin = 0.5 * jnp.stack([-p * x - q * y - r * z, p * w + q * z - r * y, q * w + r * x - p * z, r * w + p * y - q * x])
    twist = unknowns[7:13]
    lost = task.friction[0] @ twist
    put_in = acting.drive_force @ (task.jacobian[0] @ twist) + (load.force @ state.twist.linear)[0]
    put_in = put_in + (load.moment @ state.twist.angular)[0]
    return jnp.concatenate([twist[:3], spin, rise, lost[None], put_in[None]])


class Balance(NamedTuple):
    """Energies (n,), J."""

    kinetic: Array
    potential: Array
    """Of the weight; zero with all masses at the origin of {O}."""
    springs: Array
    """Of the actuators' springs."""
    dissipated: Array
    """What friction took since the beginning."""
    put_in: Array
    """What constant forces of actuators and load put in since the beginning."""

    @property
    def total(self) -> Array:
        """What must not change."""
        return self.kinetic + self.potential + self.springs + self.dissipated - self.put_in


class Recorded(NamedTuple):
    """What is looked at of a run, at n times."""

    state: eq.State
    coordinates: Array
    """(n, 6) of the actuators; angles in (-pi, pi]."""
    forces: Array
    """(n, 6) of the actuators, N or N m."""
    balance: Balance


@jax.jit
def recorded(bodies: Bodies, signs: Array, acting: Acting, unknowns: Array) -> Recorded:
    """What a run looks like, from its unknowns (n, 15)."""
    state = state_of(acting.beginning, unknowns)
    stand = [group.stand(state.pose, signs) for group in bodies.alike()]
    kinetic, potential = eq.energy(bodies, state, stand, Vec(*acting.gravity))
    springs = 0.5 * jnp.sum(acting.rate * stretch(bodies, stand, acting) ** 2, axis=-1)
    balance = Balance(kinetic, potential, springs, unknowns[:, 13], unknowns[:, 14])
    return Recorded(state, drive_coordinates(bodies, stand), drive_forces(bodies, stand, acting), balance)
