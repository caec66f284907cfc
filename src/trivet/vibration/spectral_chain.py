"""One chain, exactly: the dynamic stiffness which it puts on the platform, as a ratio of entire functions of frequency.

From the ground (at rest, any wrench) the state, a twist and a wrench, passes joints, masses and beams.  It is S a, with one
column of S per wrench of the ground, and one more for every slack screw.  A mass takes its inertia force out of the wrench, a
spring adds its deflection, a slack screw adds its motion and the condition that the wrench has no power on it (so does a spring
beside a dashpot, with its wrench for none), and a beam multiplies by its transfer matrix (`vibration.spectral_beam`), a long
one in pieces, between which the state is made twelve new unknowns.  At the platform joint, whose own slack screws are
conditions only,

    [W0^T U]     [d]
    [  G   ] a = [0],       wrench = W0 b,  b = D d,

with U the twists of S, G the conditions, W0 the wrenches which the last joint transmits, and d = W0^T u the motions that they
feel.  D is the dynamic stiffness along W0, and the determinant q of the matrix is its denominator: all entries of S are entire
functions of frequency, so q D has no poles either.  Nothing is divided on the way: rigid drives and beams without length are no
exceptions, and as omega goes to zero this becomes the static stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from trivet.kinematics.constraint import transmitted
from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg
from trivet.model.elements import Flexibility, Joint, Stock
from trivet.model.elements.beam import beam_axes
from trivet.space.elimination import eliminated, product
from trivet.space.frame import Angle, Frame, about_z
from trivet.space.scalar import Scalar, add, is_zero
from trivet.space.screw import Twist, Wrench
from trivet.space.symmetric import Symmetric
from trivet.space.vector import Vec
from trivet.statics.beam_element import uniform
from trivet.statics.parts import Arm, Bar, Lump, Part, Tie, parts
from trivet.vibration.spectral_beam import Array, transfer

STILL = 1e-20
"""omega^2 (rad^2/s^2) that stands for none: at zero the free part of a chain would have neither inertia nor stiffness."""


class Excitation(NamedTuple):
    """Harmonic excitation exp(+i omega t), and how the structure dampens it."""

    omega: Array
    """(n,), rad/s."""
    loss_factor: Scalar | None
    """Structural damping eta of all stiffnesses that have none of their own, k (1 + i eta); None for a chain without damping,
    whose functions are real."""

    @property
    def square(self) -> Array:
        """omega^2, rad^2/s^2."""
        return jnp.maximum(self.omega * self.omega, STILL)

    def elastic(self, own: Scalar | None) -> Scalar:
        """1 + i eta of a stiffness, with a loss factor of its own or without."""
        return 1.0 if self.loss_factor is None else 1 + 1j * (self.loss_factor if own is None else own)

    @property
    def dtype(self) -> type:
        """Of the functions of frequency."""
        return float if self.loss_factor is None else complex


class Effort(NamedTuple):
    """How much the greatest frequency asks for (static: kernels are compiled for it)."""

    terms: int
    """Terms of the beams' series."""
    segments: int
    """Pieces of a beam, between which the basis of states is renewed: what grows like exp(k L) must not drown what decays."""


class LegDynamics(NamedTuple):
    """A chain at n frequencies, in its own axes."""

    wrenches: list[Wrench]
    """W0: m wrenches that the last joint transmits, reduced at the platform joint."""
    stiffness: Array
    """(n, m, m): dynamic stiffness D along them."""
    denominator: Array
    """(n,): q, up to one factor for all frequencies."""


class _Front(NamedTuple):
    """How far a walk along a chain has come."""

    states: Array
    """(n, 4, 3, c): S; velocity, angular velocity, force and moment at the point, in the axes below."""
    conditions: tuple[Array, ...]
    """Rows of G, (n, up to c) each."""
    point: Vec | None
    """None on the ground, where a state is the same wherever it is reduced."""
    axes: Array | None
    """(3, 3): columns are the axes in the chain's own; None where they are the chain's own."""

    def local(self, *vectors: Vec) -> Array:
        """(k, 3): vectors in the axes of the states."""
        columns = jnp.stack([_array(v) for v in vectors])
        return columns if self.axes is None else columns @ self.axes

    def power(self, screw: Array) -> Array:
        """(n, c): power of the wrenches on a screw (2, 3)."""
        return _combined(screw.reshape(6), _flat(self.states)[..., 6:, :])


def leg_dynamics(leg: Leg, pose: Frame, posture: Posture, stock: Stock, excitation: Excitation, effort: Effort) -> LegDynamics:
    """A chain at one pose and n frequencies."""
    count = excitation.omega.shape
    found = leg_parts(leg, pose, posture, stock)
    last = next(k for k in reversed(range(len(found))) if not isinstance(found[k], Lump))
    may_be_open = not any(isinstance(p, Lump) and _is_felt(p, found[last]) for p in found[last:])
    open_end: tuple[Twist, ...] = ()
    # Unit wrenches of the ground along any axes are as good as others: those of the first beam.
    axes = {k: _axes(part) for k, part in enumerate(found) if isinstance(part, Bar)}
    still = jnp.eye(12, 6, -6, dtype=excitation.dtype).reshape(4, 3, 6)
    front = _Front(jnp.broadcast_to(still, (*count, 4, 3, 6)), (), None, next(iter(axes.values()), None))
    for k, part in enumerate(found):
        if isinstance(part, Tie):
            front = _sprung(_moved(front, part.at), part, excitation)
            if k == last and may_be_open and part.element.viscosity is None:
                open_end = part.slack
            else:
                front = _yielding(front, part, excitation)
        elif isinstance(part, Bar):
            front = _turned_to(axes[k], _moved(front, part.start.origin))
            front = _passed(front, part, stock, excitation, effort)
        elif isinstance(part, Arm):
            front = _moved(_moved(front, part.start), part.end)
        else:
            front = _loaded(front, part, excitation.square)
    wrenches = transmitted(open_end)
    basis = [front.local(w.force, w.moment).reshape(6) for w in wrenches]
    flat = _flat(front.states)
    felt = [_combined(w, flat[..., :6, :]) for w in basis]
    conditions = [*front.conditions, *(front.power(front.local(*screw)) for screw in open_end)]
    size = flat.shape[-1]
    rows = [*felt, *(jnp.pad(row, ((0, 0), (0, size - row.shape[-1]))) for row in conditions)]
    matrix = jnp.stack(rows, axis=-2)
    # a from unit motions along W0, then its wrenches in terms of W0.
    scale = jnp.abs(matrix[:1]).max(axis=-1, keepdims=True)  # of the rows, the same at all frequencies
    solved, denominator = eliminated(matrix / scale, jnp.eye(size, len(wrenches)) / scale)
    along = jnp.stack([_combined(w, flat[..., 6:, :]) for w in basis], axis=-2)
    given = product(_inverse_products(wrenches), along)
    return LegDynamics(wrenches, product(given, solved), denominator)


def leg_parts(leg: Leg, pose: Frame, posture: Posture, stock: Stock) -> list[Part]:
    """What a chain is made of, in its own axes."""
    back = Angle(posture.heading.cos, -posture.heading.sin)
    seat = pose.place(leg.platform_frame())
    turned = Frame(seat.origin, *(about_z(back, axis) for axis in (seat.x, seat.y, seat.z)))
    return list(parts(walk(leg.chain.elements, posture), turned, stock))


def _inverse_products(wrenches: Sequence[Wrench]) -> Array:
    """(m, m): inverse of W0^T W0."""
    pairs = combinations_with_replacement(wrenches, 2)
    products = Symmetric.of(len(wrenches), (add(a.force @ b.force, a.moment @ b.moment) for a, b in pairs))
    return jnp.stack([jnp.stack([jnp.asarray(e, dtype=float) for e in row]) for row in products.inverse().full()])


def _is_felt(lump: Lump, tie: Part) -> bool:
    """Whether a mass beyond the last joint resists the joint's slack motions, which an open end leaves out."""
    assert isinstance(tie, Tie), "a body ends with a node of its own"
    has_arms = tie.element.inertia is not None or tie.element.centre_of_mass is not None
    return has_arms or not all(is_zero(c) for twist in tie.slack for c in twist.linear)


def _axes(bar: Bar) -> Array:
    """(3, 3): columns are the local axes of a beam in the chain's own, from its near end to its far end."""
    x, y, z = (_array(v) for v in beam_axes(bar.start, bar.axis))
    # The extended part of a slide may run backwards.
    ahead = jnp.where(jnp.asarray(bar.length) < 0, -1.0, 1.0)
    return jnp.stack([x * ahead, y, z * ahead], axis=-1)


def _array(vector: Vec) -> Array:
    """(3,)."""
    return jnp.stack([jnp.asarray(c, dtype=float) for c in vector])


def _flat(states: Array) -> Array:
    """(n, 12, c)."""
    return states.reshape(*states.shape[:-3], 12, states.shape[-1])


_IN_CROSS = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
)
"""(3, 3, 3): an arm times this is the matrix of arm x."""


def _crossed(arm: Array, vectors: Array) -> Array:
    """arm (3,) x vectors (..., 3, c)."""
    return _turned(jnp.tensordot(arm, _IN_CROSS, axes=1), vectors)


def _turned(matrix: Array, vectors: Array) -> Array:
    """(3, 3) times vectors (..., 3, c), without a call of a library per frequency."""
    return sum(matrix[:, j, None] * vectors[..., j, None, :] for j in range(3))  # type: ignore[return-value]


def _combined(factors: Array, rows: Array) -> Array:
    """Sum of factors (k,) times rows (..., k, c)."""
    return sum(factors[k] * rows[..., k, :] for k in range(rows.shape[-2]))  # type: ignore[return-value]


def _moved(front: _Front, there: Vec) -> _Front:
    """States reduced at another point of the same rigid body: v - arm x w, m - arm x f."""
    if front.point is None or front.point is there:
        return front._replace(point=there)
    velocity, angular, force, moment = (front.states[..., k, :, :] for k in range(4))
    (arm,) = front.local(there - front.point)
    moved = [velocity - _crossed(arm, angular), angular, force, moment - _crossed(arm, force)]
    return front._replace(states=jnp.stack(moved, axis=-3), point=there)


def _sprung(front: _Front, tie: Tie, excitation: Excitation) -> _Front:
    """Beyond those springs of a joint which have no viscous damping beside them."""
    elastic = excitation.elastic(tie.element.loss_factor)
    twists = front.states[..., :2, :, :]
    for flexibility in tie.sprung:
        if not _is_viscous(flexibility, tie.element):
            screw = front.local(*flexibility.twist)
            soft = flexibility.compliance / elastic
            twists = twists + screw[..., None] * (soft * front.power(screw))[..., None, None, :]
    return front._replace(states=jnp.concatenate([twists, front.states[..., 2:, :, :]], axis=-3))


def _is_viscous(flexibility: Flexibility, joint: Joint) -> bool:
    """Whether the damping of a joint's motion acts beside a spring; it does not in the joint's bearing."""
    return joint.viscosity is not None and flexibility.part in ("drive", "joint")


def _yielding(front: _Front, tie: Tie, excitation: Excitation) -> _Front:
    """Beyond the slack and the viscous screws of a joint.

    The motion along each is a new unknown, and power on the screw = rate * motion its condition: a division by the rate would
    be one by a function of frequency.
    """
    joint = tie.element
    viscous = jnp.zeros_like(excitation.omega) if joint.viscosity is None else 1j * excitation.omega * joint.viscosity
    screws = [(screw, viscous) for screw in tie.slack]
    for flexibility in tie.sprung:
        if _is_viscous(flexibility, joint):
            screws.append((flexibility.twist, excitation.elastic(joint.loss_factor) / flexibility.compliance + viscous))
    for twist, rate in screws:
        screw = front.local(*twist)
        condition = jnp.concatenate([front.power(screw), -rate[..., None]], axis=-1)
        motion = jnp.broadcast_to(jnp.pad(screw, ((0, 2), (0, 0)))[..., None], (*front.states.shape[:-1], 1))
        states = jnp.concatenate([front.states, motion], axis=-1)
        front = front._replace(states=states, conditions=(*front.conditions, condition))
    return front


def _turned_to(axes: Array, front: _Front) -> _Front:
    """States in the axes of a beam; those of the first one they have from the start."""
    if axes is front.axes:
        return front
    assert front.axes is not None
    return front._replace(states=_turned(axes.T @ front.axes, front.states), axes=axes)


def _passed(front: _Front, bar: Bar, stock: Stock, excitation: Excitation, effort: Effort) -> _Front:
    """Beyond a beam, in whose axes the states are."""
    made = uniform(bar.profile, stock)
    length = jnp.abs(jnp.asarray(bar.length)) / effort.segments
    step = transfer(made, length, excitation.square, excitation.elastic(made.loss_factor), effort.terms)
    for segment in range(effort.segments):
        front = front._replace(states=step.passed(front.states))
        if segment + 1 < effort.segments:
            front = _renewed(front)
    return front._replace(point=bar.end)


def _renewed(front: _Front) -> _Front:
    """The same states as new unknowns, which conditions tie to the old ones."""
    flat = _flat(front.states)
    fresh = jnp.broadcast_to(jnp.eye(12, dtype=flat.dtype), (*flat.shape[:-1], 12))
    tied = jnp.concatenate([flat, -fresh], axis=-1)
    renewed = jnp.concatenate([jnp.zeros_like(flat), fresh], axis=-1)
    states = renewed.reshape(*front.states.shape[:-1], renewed.shape[-1])
    return front._replace(states=states, conditions=(*front.conditions, *(tied[..., k, :] for k in range(12))))


def _loaded(front: _Front, lump: Lump, square: Array) -> _Front:
    """Beyond a mass at a node: the wrench which moves the mass goes no further."""
    assert front.point is not None, "a chain starts with a joint"
    velocity, angular, force, moment = (front.states[..., k, :, :] for k in range(4))
    (arm,) = front.local(lump.frame.origin - front.point)
    wanted = lump.mass * (velocity - _crossed(arm, angular))
    turning = _crossed(arm, wanted)
    if not all(is_zero(m) for m in lump.moments):
        axes = front.local(*lump.frame[1:])
        moments = jnp.stack([jnp.asarray(m, dtype=float) for m in lump.moments])
        turning = turning + _turned((axes.T * moments) @ axes, angular)
    square = square[..., None, None]
    loaded = [velocity, angular, force - square * wanted, moment - square * turning]
    return front._replace(states=jnp.stack(loaded, axis=-3))
