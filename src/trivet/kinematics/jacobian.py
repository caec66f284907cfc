"""Jacobians of a machine, J_q and J_x apart (paper Eqs 23-26 and 33-35).

J_q Qdot = J_x V, so that J_G^-1 = J_q^-1 J_x.  The rows of J_x are the wrenches which the chains transmit with their passive
joints free.  Their scale and sense are fixed here: unit forces, at right angles to each other within a chain, so that a planar
chain has the tangent of its guide, n, and the direction of its last link towards the platform, u, in this order.  det J_x then
is a length cubed that depends continuously on pose and dimensions.  Seen from the platform centre, for three chains,

    det J_x = -S,   S = (e12 w1)(e23 w2)(e31 w3) - (e12 w2)(e23 w3)(e31 w1),   e_ij = P_j - P_i,   w = n x u.

Numbers that mix lengths and angles are made dimensionless by the machine's `characteristic_length`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeGuard

import jax
import jax.numpy as jnp

from trivet.errors import InputError
from trivet.kinematics.constraint import transmitted
from trivet.kinematics.inverse import inverse
from trivet.kinematics.standing import postures
from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg, Machine
from trivet.model.elements import Drivable, Element, Spherical
from trivet.space.elimination import determinant, expanded, solved
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, is_known, mul
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec


class ConstraintRows(NamedTuple):
    """J_q Qdot = J_x V for one pose; a row is a unit force which a chain transmits (see the module)."""

    j_q: Scalar
    """(n, n_actuators): power of the row on a unit speed of the actuator, W per m/s or rad/s: a cosine, or a lever arm (m)."""
    j_x: Scalar
    """(n, 6): force and moment (m) of the row at the platform centre in {O}."""


class Determinants(NamedTuple):
    """Determinants at one pose."""

    j_q: Scalar
    """m per angular actuator, multiplied; actuators in the order of Q."""
    j_x: Scalar
    """m^3."""
    inverse: Scalar
    """det J_G^-1 = det J_x / det J_q."""
    inverse_analytical: Scalar
    """det J^-1 = -sin(beta) det J_G^-1, which vanishes with the tilt for no fault of the machine."""


class ChainRows(NamedTuple):
    """What one chain transmits, at the platform joint P in the chain's own axes."""

    wrenches: list[Wrench]
    """Unit forces at right angles to each other; in a chain without a ball unit wrenches, moments over the length `scale`."""
    driven: list[tuple[Drivable, Twist]]
    """The driven joints in order, with their unit twists."""
    steps: list[tuple[Element, Frame, Any]]
    """The walk down the chain."""


def is_driven(element: Element) -> TypeGuard[Drivable]:
    """Whether an element is a joint that a drive moves: actuated, and not locked."""
    return isinstance(element, Drivable) and element.is_driven


def actuators(machine: Machine) -> list[tuple[str, Drivable]]:
    """Actuators by name, in the order of Q: the first of every chain, then the second of every chain (paper section 2)."""
    ranked = []
    for place, leg in enumerate(machine.legs):
        driven = [e for e in leg.chain.elements if isinstance(e, Drivable) and e.is_driven]
        ranked += [((rank, place), (f"{leg.name}.{joint.name}", joint)) for rank, joint in enumerate(driven)]
    return [found for _, found in sorted(ranked, key=lambda pair: pair[0])]


def actuator_names(machine: Machine) -> list[str]:
    """Names of the `actuators`."""
    return [name for name, _ in actuators(machine)]


def chain_rows(leg: Leg, posture: Posture, scale: Scalar) -> ChainRows:
    """The wrenches which one chain transmits when its passive joints are free, as fixed by the module.

    Args:
        leg: the chain.
        posture: how it stands.
        scale: length (m) by which moments are made forces in a chain without a ball; where there is one, all that the chain
            transmits are forces through its centre, and no length is needed.

    Raises:
        NoResultError: the chain has an idle freedom.
    """
    steps = walk(leg.chain.elements, posture)
    passive = [t for e, f, c in steps if not is_driven(e) for t in e.freedoms(f, c, posture.end)]
    has_ball = any(isinstance(e, Spherical) for e in leg.chain.elements)
    units = _orthonormal(transmitted(passive), 0 if has_ball else 1 / (scale * scale))
    if units:
        # The passive freedoms, in their order, and the wrenches span everything; the sense in which they do must not flip.
        spanned = expanded([[*w.force, *w.moment] for w in units] + [[*t.linear, *t.angular] for t in passive])
        units[-1] = _scaled(units[-1], jnp.where(spanned < 0, -1.0, 1.0))
    driven = [(e, e.freedoms(f, c, posture.end)[0]) for e, f, c in steps if is_driven(e)]
    return ChainRows(units, driven, steps)


def constraint_rows(machine: Machine, pose: Frame, signs: Scalar) -> ConstraintRows:
    """J_q and J_x of Eq (33) at one pose: rows chain by chain, (n1, u1, n2, u2, ...); columns of J_q in the order of Q.

    Args:
        machine: the machine.
        pose: platform frame in {O}, scalar components.
        signs: (n_chains, 2) working mode, or None as for `standing.postures`.

    Raises:
        NoResultError: a chain has an idle freedom.
    """
    scale = machine.characteristic_length

    def rows(leg: Leg, posture: Posture) -> tuple[Scalar, Scalar]:
        chain = chain_rows(leg, posture, scale)
        moved = [wrench.carried(posture.heading, arm_of(leg, pose)) for wrench in chain.wrenches]
        powers = [[wrench @ twist for _, twist in chain.driven] for wrench in chain.wrenches]
        return matrix(powers, len(chain.driven)), matrix([[*w.force, *w.moment] for w in moved], 6)

    blocks, rows_x = zip(*per_chain(machine, pose, signs, rows), strict=True)
    names, first = actuator_names(machine), 0
    j_q = jnp.zeros((sum(len(block) for block in blocks), len(names)))
    for leg, block in zip(machine.legs, blocks, strict=True):
        columns = [names.index(f"{leg.name}.{e.name}") for e in leg.chain.elements if is_driven(e)]
        j_q = j_q.at[first : first + len(block), jnp.array(columns, dtype=int)].set(block)
        first += len(block)
    return ConstraintRows(j_q, jnp.concatenate(rows_x))


def per_chain(machine: Machine, pose: Frame, signs: Scalar, work: Callable[[Leg, Posture], Any]) -> list[Any]:
    """What a function of arrays makes of every chain and its posture, in the order of the chains.

    Chains that are made alike are done as one batch, so that JAX compiles one of them; arguments as for `constraint_rows`.
    """
    legs = [leg.unnamed for leg in machine.legs]
    if signs is None:
        return [work(leg, posture) for leg, posture in zip(legs, postures(machine, pose, None), strict=True)]
    alike: dict[Any, list[int]] = {}
    for place, leg in enumerate(legs):
        alike.setdefault(jax.tree.structure(leg), []).append(place)
    found: dict[int, Any] = {}
    for places in alike.values():
        stacked = jax.tree.map(lambda *c: jnp.stack([jnp.asarray(v) for v in c]), *(legs[k] for k in places))
        done = jax.vmap(lambda leg, sign: work(leg, inverse(leg, pose, sign)))(stacked, jnp.asarray(signs)[jnp.array(places)])
        found |= {place: jax.tree.map(lambda a, row=row: a[row], done) for row, place in enumerate(places)}
    return [found[place] for place in range(len(legs))]


def arm_of(leg: Leg, pose: Frame) -> Vec:
    """From the platform centre to the platform joint of a chain, in {O} (m): R P of paper Eq 1."""
    return pose.direction(leg.platform_frame().origin)


def inverse_jacobian(machine: Machine, pose: Frame, signs: Scalar) -> Scalar:
    """Geometric inverse Jacobian (Eqs 23 and 34): Qdot = J_G^-1 V, (n_actuators, 6), rad/s and m/s per m/s and rad/s.

    Raises:
        InputError: when the actuators are not as many as the wrenches which the chains transmit (a redundant machine).
    """
    rows = constraint_rows(machine, pose, signs)
    n, count = rows.j_q.shape
    if n != count:
        raise InputError(f"{machine.name}: {count} actuators against {n} constraints; lock {abs(count - n)} of them")
    return solved(rows.j_q, rows.j_x)


def square_rows(machine: Machine, pose: Frame, signs: Scalar) -> ConstraintRows:
    """`constraint_rows` of a machine with six actuators that hold the platform's six freedoms: both matrices are 6 x 6.

    Raises:
        InputError: for any other machine.
    """
    require_six_each(machine)
    return constraint_rows(machine, pose, signs)


def require_six_each(machine: Machine) -> None:
    """Raise InputError unless six actuators hold the platform's six freedoms."""
    chains = machine.chains.values()
    held = sum(chain.copies * (6 - sum(len(e.unknowns) for e in chain.elements if not is_driven(e))) for chain in chains)
    count = len(actuators(machine))
    if (held, count) != (6, 6):
        raise InputError(
            f"{machine.name}: {count} actuators and {held} constraints; six of each are needed here, "
            "lock or release drives until there are"
        )


def zyz_rates(azimuth: Scalar, tilt: Scalar) -> Scalar:
    """H of Eq (26), V = H Xdot with Xdot = (velocity of the centre, rates of alpha, beta, gamma); det H = -sin(beta)."""
    ca, sa, cb, sb = jnp.cos(azimuth), jnp.sin(azimuth), jnp.cos(tilt), jnp.sin(tilt)
    turning = matrix([[0.0, -sa, ca * sb], [0.0, ca, sa * sb], [1.0, 0.0, cb]], 3)
    return jnp.eye(6).at[3:, 3:].set(turning)


def analytical_inverse_jacobian(machine: Machine, pose: Frame, signs: Scalar, azimuth: Scalar, tilt: Scalar) -> Scalar:
    """J^-1 of Eq (24), Qdot = J^-1 Xdot, by J^-1 = J_G^-1 H (Eqs 25 and 26); singular at zero tilt whatever the machine.

    Args:
        machine, pose, signs: as for `constraint_rows`.
        azimuth, tilt: alpha and beta of the pose (rad); at zero tilt the pose alone does not tell alpha.

    Raises:
        InputError: as `inverse_jacobian`.
    """
    return inverse_jacobian(machine, pose, signs) @ zyz_rates(azimuth, tilt)


def homogenised(wrenches: Scalar, length: Scalar) -> Scalar:
    """Rows (..., 6) of J_x or J^-1 with their moments, or angular columns, divided by a length: all entries of one unit."""
    return wrenches / jnp.array([1.0, 1.0, 1.0, length, length, length])


def homogenised_inverse(machine: Machine, pose: Frame, signs: Scalar) -> Scalar:
    """J_G^-1 without units, (n_actuators, 6).

    Angular velocities of the platform and of angular actuators are made speeds by the machine's `characteristic_length`.

    Raises:
        InputError: as `inverse_jacobian`.
    """
    length = machine.characteristic_length
    speeds = jnp.stack([jnp.asarray(length if joint.is_angular else 1.0) for _, joint in actuators(machine)])
    return homogenised(inverse_jacobian(machine, pose, signs), length) * speeds[:, None]


def determinants(machine: Machine, pose: Frame, signs: Scalar) -> Determinants:
    """Determinants at one pose (Eq 35).

    Raises:
        InputError: for a machine without six actuators and six constraints.
    """
    rows = square_rows(machine, pose, signs)
    return determinants_of(rows, pose)


def determinants_of(rows: ConstraintRows, pose: Frame) -> Determinants:
    """Determinants of rows that are at hand."""
    j_q, j_x = determinant(rows.j_q), determinant(rows.j_x)
    sine_of_tilt = jnp.sqrt(pose.z.x * pose.z.x + pose.z.y * pose.z.y)
    return Determinants(j_q, j_x, j_x / j_q, -sine_of_tilt * j_x / j_q)


def _orthonormal(wrenches: list[Wrench], per_square: Scalar) -> list[Wrench]:
    """Gram and Schmidt, in the order given, under the product of forces plus `per_square` (1/m^2) times that of moments."""

    def product(a: Wrench, b: Wrench) -> Scalar:
        return a.force @ b.force + mul(a.moment @ b.moment, per_square)

    done: list[Wrench] = []
    for wrench in wrenches:
        for other in done:
            wrench = wrench.plus(other, -product(wrench, other))
        square = product(wrench, wrench)
        done.append(wrench if is_known(square) and square == 1 else _scaled(wrench, 1 / jnp.sqrt(square)))
    return done


def _scaled(wrench: Wrench, factor: Scalar) -> Wrench:
    return Wrench(wrench.force * factor, wrench.moment * factor)


def matrix(rows: list[list[Scalar]], columns: int) -> Scalar:
    """An array of scalars by rows."""
    flat = [jnp.asarray(v, dtype=float) for row in rows for v in row]
    return (jnp.stack(flat) if flat else jnp.zeros(0)).reshape(len(rows), columns)
