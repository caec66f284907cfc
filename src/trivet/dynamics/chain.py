"""One chain at one pose: its screws and masses, and the forces that it needs for a motion (paper Eqs 14-16, 18-21).

Written in the chain's own axes; twists, wrenches and masses are reduced at the platform joint P, and accelerations are those of
the body's point that is at P just then less omega x v (spatial accelerations), so that all of them add down the chain.

The coordinates q are those of the joints which are not locked, less a ball at the end: there the chain feels the velocity of P
alone, W is 3 x 3 as in the paper, and what lies beyond the ball belongs to the platform.  A chain that ends otherwise feels the
whole twist of the platform, and W is 6 x 6.  The rows of W^-1 are wrenches at P, each with unit power on its own coordinate and
none on the others: `Chain.reciprocal`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp

from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg
from trivet.model.elements import Drivable, Element, Joint, Spherical, Stock
from trivet.model.mass import RigidMass
from trivet.space.elimination import inverse
from trivet.space.frame import Angle, Frame, about_z
from trivet.space.scalar import Scalar, add, mul
from trivet.space.screw import Twist, Wrench
from trivet.space.symmetric import Symmetric
from trivet.space.vector import ZERO, Vec

STILL = Twist(ZERO, ZERO)
NO_WRENCH = Wrench(ZERO, ZERO)


class Member(NamedTuple):
    """An element of a chain where it stands."""

    element: Element
    frame: Frame
    """Where it starts."""
    screws: tuple[Twist, ...]
    """Unit twists of its coordinates, at P."""
    mass: RigidMass
    """What it weighs, about P; moves with all coordinates up to its own."""


class Chain(NamedTuple):
    """One chain at one pose (see the module)."""

    members: tuple[Member, ...]
    """All elements; the last one without its mass, which moves with the platform."""
    ends_with_ball: bool
    reciprocal: tuple[Wrench, ...]
    """One per coordinate q: the rows of W^-1."""
    heading: Angle
    """Rotation about z, from {O}, of the chain's axes."""
    end: Vec
    """P, in them (m)."""
    arm: Vec
    """From the platform centre to P, in {O} (m)."""

    @property
    def inner(self) -> tuple[Member, ...]:
        """The members which the coordinates q move."""
        return self.members[:-1] if self.ends_with_ball else self.members

    @property
    def screws(self) -> list[Twist]:
        """One per coordinate q."""
        return [screw for member in self.inner for screw in member.screws]

    @property
    def drives(self) -> list[int]:
        """Which of the coordinates q a drive moves."""
        return [k for k, joint in enumerate(self.joints) if isinstance(joint, Drivable) and joint.is_driven]

    @property
    def joints(self) -> list[Element]:
        """The joint of every coordinate q."""
        return [member.element for member in self.inner for _ in member.screws]

    def inwards(self, v: Vec) -> Vec:
        """A vector given in {O}, in the chain's axes."""
        return about_z(Angle(self.heading.cos, -self.heading.sin), v)

    def outwards(self, wrench: Wrench) -> Wrench:
        """A wrench at P as the platform feels it: at its centre, in {O}."""
        return wrench.carried(self.heading, self.arm)

    def rows(self) -> list[Wrench]:
        """Z of Eq (21), qdot = Z V: one wrench at the platform centre in {O} per coordinate."""
        return [self.outwards(wrench) for wrench in self.reciprocal]


class ChainMotion(NamedTuple):
    """How a chain moves."""

    platform: Twist
    """Of the platform, at P."""
    rates: tuple[Scalar, ...]
    """qdot (m/s, rad/s)."""
    accelerations: tuple[Scalar, ...]
    """qddot (m/s^2, rad/s^2)."""


def chain_at(leg: Leg, pose: Frame, posture: Posture, stock: Stock) -> Chain:
    """A chain of six freedoms as it stands at a pose."""
    steps = walk(leg.chain.elements, posture)
    last = leg.chain.elements[-1]
    ends_with_ball = isinstance(last, Spherical)
    members = []
    for k, (element, frame, coordinate) in enumerate(steps):
        mass = element.weigh(stock).out_of(steps[k + 1][1]).shifted(-posture.end) if element is not last else RigidMass.none()
        members.append(Member(element, frame, element.freedoms(frame, coordinate, posture.end), mass))
    screws = [screw for member in members[: -1 if ends_with_ball else None] for screw in member.screws]
    columns = [[*screw.linear] if ends_with_ball else [*screw.linear, *screw.angular] for screw in screws]
    rows = inverse(list(zip(*columns, strict=True)))
    reciprocal = tuple(Wrench(Vec(*row[:3]), ZERO if ends_with_ball else Vec(*row[3:])) for row in rows)
    arm = pose.direction(leg.platform_frame().origin)
    return Chain(tuple(members), ends_with_ball, reciprocal, posture.heading, posture.end, arm)


def chain_motion(chain: Chain, twist: Twist, acceleration: Twist) -> ChainMotion:
    """How a chain moves with the platform (Eqs 15 and 16, and their time derivatives).

    Args:
        chain: the chain.
        twist: of the platform, at its centre in {O} (m/s, rad/s).
        acceleration: its time derivative (m/s^2, rad/s^2).
    """
    linear, angular = twist
    velocity = linear + angular.cross(chain.arm)
    rise = acceleration.linear + acceleration.angular.cross(chain.arm) + angular.cross(angular.cross(chain.arm))
    platform = Twist(chain.inwards(velocity), chain.inwards(angular))
    rates = tuple(row @ platform for row in chain.reciprocal)
    moving, carried = STILL, STILL
    for screw, rate in zip(chain.screws, rates, strict=True):
        own = screw.times(rate)
        carried = carried.plus(moving.cross(own))
        moving = moving.plus(own)
    # Of what carries P: the last link where the chain ends with a ball, else the platform itself, which moves as that does.
    carrier = moving.angular if chain.ends_with_ball else platform.angular
    reached = Twist(chain.inwards(rise) - carrier.cross(platform.linear), chain.inwards(acceleration.angular))
    return ChainMotion(platform, rates, tuple(row @ reached.plus(carried, -1) for row in chain.reciprocal))


def inertia_forces(
    chain: Chain, rates: Sequence[Scalar], accelerations: Sequence[Scalar], gravity: Vec
) -> tuple[list[Scalar], list[Wrench]]:
    """M_q qddot + C_q + g_q of Eq (14), by the recursion of Newton and Euler.

    Args:
        chain: the chain.
        rates, accelerations: of its coordinates q.
        gravity: acceleration of free fall, in the chain's axes (m/s^2).

    Returns:
        Forces along the coordinates (N, N m), and per member the wrench (at P) that it must hand on for itself and for what
        follows up to the platform joint.
    """
    values = iter(zip(rates, accelerations, strict=True))
    velocity, acceleration = STILL, Twist(-gravity, ZERO)
    own: list[Wrench] = []
    for member in chain.inner:
        for screw in member.screws:
            rate, rise = next(values)
            turning = screw.times(rate)
            acceleration = acceleration.plus(screw, rise).plus(velocity.cross(turning))
            velocity = velocity.plus(turning)
        own.append(_force_of(member.mass, velocity, acceleration))
    wrenches: list[Wrench] = []
    total = NO_WRENCH
    for wrench in reversed(own):
        total = total.plus(wrench)
        wrenches.insert(0, total)
    forces = [wrench @ screw for member, wrench in zip(chain.inner, wrenches, strict=True) for screw in member.screws]
    return forces, wrenches


def rigid_force(mass: RigidMass, twist: Twist, acceleration: Twist) -> Wrench:
    """The wrench that a rigid body needs (Newton and Euler); all reduced at one point fixed in space."""
    return mass.momentum(acceleration).plus(twist.cross_wrench(mass.momentum(twist)))


def _force_of(mass: RigidMass, twist: Twist, acceleration: Twist) -> Wrench:
    return NO_WRENCH if mass.is_none else rigid_force(mass, twist, acceleration)


def chain_inertia(chain: Chain) -> Symmetric:
    """M_q of Eq (14): inertia along the coordinates q, of bodies and of motors (kg, kg m, kg m^2)."""
    screws, joints = chain.screws, chain.joints
    matrix = Symmetric(len(screws))
    beyond = RigidMass.none()
    first = len(screws)
    for member in reversed(chain.inner):
        beyond = beyond.plus(member.mass)
        first -= len(member.screws)
        for k in range(first, first + len(member.screws)):
            momentum = beyond.momentum(screws[k])
            for j in range(k + 1):
                # Screws of the same member are in both of its rows: once is enough.
                matrix[j, k] = momentum @ screws[j]
    for k, joint in enumerate(joints):
        matrix[k, k] = add(matrix[k, k], reflected(joint))
    return matrix


def reflected(joint: Element) -> Scalar:
    """Inertia of motor and gear along a coordinate (kg, kg m^2)."""
    if not isinstance(joint, Drivable) or joint.reflected_inertia is None:
        return 0
    return mul(joint.reflected_inertia, mul(joint.lever, joint.lever))


class Resistance(NamedTuple):
    """What friction takes."""

    forces: list[Scalar]
    """Against the motion, along the coordinates q (N, N m)."""
    in_ball: Vec
    """Moment (N m) in the ball at the end, against the platform's turning on the last link, in the chain's axes."""

    def along(self, screws: Sequence[Twist]) -> list[Scalar]:
        """Forces along the coordinates q, the ball's among them."""
        return [add(f, -(s.angular @ self.in_ball)) for f, s in zip(self.forces, screws, strict=True)]


def resistance(chain: Chain, motion: ChainMotion, creep: Scalar) -> Resistance:
    """Viscous and Coulomb friction of every joint.

    Args:
        chain, motion: the chain and how it moves.
        creep: speed (m/s, rad/s) around which Coulomb friction passes through zero, v / sqrt(v^2 + creep^2); zero for a jump.
    """
    forces: list[Scalar] = []
    values = iter(motion.rates)
    for member in chain.inner:
        joint, rates = member.element, [next(values) for _ in member.screws]
        if not isinstance(joint, Joint):
            continue
        if isinstance(joint, Spherical):
            forces += list(_friction(joint, Vec(*rates), creep))
        else:
            forces += [mul(_friction(joint, Vec(mul(rate, joint.lever), 0, 0), creep).x, joint.lever) for rate in rates]
    last = chain.members[-1].element
    if not chain.ends_with_ball or not isinstance(last, Joint):
        return Resistance(forces, ZERO)
    turning = motion.platform.angular
    for screw, rate in zip(chain.screws, motion.rates, strict=True):
        turning = turning - screw.angular * rate
    return Resistance(forces, _friction(last, turning, creep))


def _friction(joint: Joint, speed: Vec, creep: Scalar) -> Vec:
    """Force or moment against a speed; rolling in the same way whatever its direction."""
    found = ZERO if joint.damping is None else speed * joint.damping
    if joint.friction is None:
        return found
    square = speed @ speed + creep * creep
    still = square == 0
    return found + speed * (joint.friction * jnp.where(still, 0.0, 1.0) / jnp.sqrt(jnp.where(still, 1.0, square)))
