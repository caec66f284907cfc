"""One chain, exactly: the dynamic stiffness which it puts on the platform, as a ratio of entire functions of frequency.

From the ground (at rest, any wrench) the state, a twist and a wrench, passes joints, masses and beams.  It is S a, with one
column of S per wrench of the ground, and one more for every slack screw.  A mass takes its inertia force out of the wrench, a
spring adds its deflection, a slack screw adds its motion and the condition that the wrench has no power on it, and a beam
multiplies by its transfer matrix (`vibration.spectral_beam`).  At the platform joint

    [W0^T U]     [d]
    [  G   ] a = [0],       wrench = W0 b,  b = D d,

with U the twists of S, G the conditions, W0 the wrenches which the last joint transmits, and d = W0^T u the motions that they
feel.  D is the dynamic stiffness along W0, and the determinant q of the matrix is its denominator: all entries of S are entire
functions of frequency, so q D has no poles either.  Nothing is divided on the way: rigid drives and beams without length are no
exceptions, and at omega = 0 this is the static stiffness.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from trivet.kinematics.constraint import transmitted
from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg
from trivet.model.elements import Flexibility, Joint, Stock
from trivet.model.elements.beam import beam_axes
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec
from trivet.statics.beam_element import uniform
from trivet.statics.parts import Arm, Bar, Lump, Tie, parts
from trivet.vibration.spectral_beam import Array, transfer

STILL = 1e-20
"""omega^2 (rad^2/s^2) that stands for none: at zero the free part of a chain would have neither inertia nor stiffness."""


class Excitation(NamedTuple):
    """Harmonic excitation exp(+i omega t), and how the structure dampens it."""

    omega: Array
    """(n,), rad/s."""
    loss_factor: Scalar
    """Structural damping eta of all stiffnesses that have none of their own, k (1 + i eta)."""

    @property
    def square(self) -> Array:
        """omega^2, rad^2/s^2."""
        return jnp.maximum(self.omega * self.omega, STILL)

    def elastic(self, own: Scalar | None) -> Scalar:
        """1 + i eta of a stiffness, with a loss factor of its own or without."""
        return 1 + 1j * (self.loss_factor if own is None else own)


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


def leg_dynamics(leg: Leg, posture: Posture, stock: Stock, excitation: Excitation, effort: Effort) -> LegDynamics:
    """A chain at one pose and n frequencies."""
    count = excitation.omega.shape
    states = jnp.zeros((*count, 12, 6), dtype=complex).at[..., 6:, :].set(jnp.eye(6))
    rows: list[Array] = []
    found = list(parts(walk(leg.chain.elements, posture), stock))
    point: Vec | None = None  # on the ground a state is the same wherever it is reduced
    last = next(k for k in reversed(range(len(found))) if not isinstance(found[k], Lump))
    open_end: tuple[Twist, ...] = ()
    for k, part in enumerate(found):
        if isinstance(part, Tie):
            states, point = _moved(states, point, part.at), part.at
            states = _sprung(states, part, excitation)
            if k == last and part.element.viscosity is None:
                open_end = part.slack
            else:
                states, rows = _slack(states, rows, part, excitation)
        elif isinstance(part, Bar):
            states = _moved(states, point, part.start.origin)
            step = _along(part, stock, excitation, effort)
            for segment in range(effort.segments):
                states = step @ states
                if segment + 1 < effort.segments:
                    states, rows = _renewed(states, rows)
            point = part.end
        elif isinstance(part, Arm):
            states, point = _moved(_moved(states, point, part.start), part.start, part.end), part.end
        else:
            assert point is not None, "a chain starts with a joint"
            states = _loaded(states, point, part, excitation.square)
    wrenches = transmitted(open_end)
    basis = jnp.stack([_column(w.force, w.moment) for w in wrenches], axis=-1)
    ends = [_power(states, screw) for screw in open_end]
    conditions = [jnp.pad(row, ((0, 0), (0, states.shape[-1] - row.shape[-1]))) for row in (*rows, *ends)]
    matrix = jnp.concatenate([basis.T @ states[..., :6, :], *(c[..., None, :] for c in conditions)], axis=-2)
    # a from unit motions along W0, then its wrenches in terms of W0.
    size = matrix.shape[-1]
    motions = jnp.eye(size, len(wrenches), dtype=complex)
    scale = jnp.abs(matrix[:1]).max(axis=-1, keepdims=True)  # of the rows, the same at all frequencies
    solved = jnp.linalg.solve(matrix / scale, jnp.broadcast_to(motions / scale, (*count, size, len(wrenches))))
    part_of = jnp.linalg.inv(basis.T @ basis) @ basis.T
    sign, size_log = jnp.linalg.slogdet(matrix / scale)
    return LegDynamics(wrenches, part_of @ states[..., 6:, :] @ solved, sign * jnp.exp(size_log - size_log.max()))


def _column(*vectors: Vec) -> Array:
    """Components of vectors, one after the other."""
    return jnp.stack([jnp.asarray(c, dtype=float) for v in vectors for c in v])


def _carry(arm: Vec) -> Array:
    """(12, 12): the state of a rigid body at a point an arm (m) further."""
    x, y, z = (jnp.asarray(c, dtype=float) for c in arm)
    zero = jnp.zeros_like(x)
    cross = jnp.stack([jnp.stack([zero, z, -y]), jnp.stack([-z, zero, x]), jnp.stack([y, -x, zero])])  # w -> w x arm
    return jnp.eye(12).at[:3, 3:6].set(cross).at[9:, 6:9].set(cross)  # m - arm x f = m + f x arm


def _moved(states: Array, here: Vec | None, there: Vec) -> Array:
    """States reduced at another point of the same rigid body."""
    return states if here is None or here is there else _carry(there - here) @ states


def _power(states: Array, screw: Twist) -> Array:
    """(n, columns): power of the wrenches on a screw."""
    return jnp.einsum("i,...ij->...j", _column(screw.linear, screw.angular), states[..., 6:, :])


def _sprung(states: Array, tie: Tie, excitation: Excitation) -> Array:
    """States beyond the springs of a joint."""
    added = jnp.zeros_like(states[..., :6, :])
    for flexibility in tie.sprung:
        soft = _softness(flexibility, tie.element, excitation)
        screw = _column(flexibility.twist.linear, flexibility.twist.angular)
        added = added + screw[:, None] * (soft[..., None] * _power(states, flexibility.twist))[..., None, :]
    return states.at[..., :6, :].add(added)


def _softness(flexibility: Flexibility, joint: Joint, excitation: Excitation) -> Array:
    """(n,): compliance (m/N or rad/(N m)) of a joint along one screw."""
    resistance = 1j * excitation.omega * (0.0 if joint.viscosity is None else joint.viscosity) * flexibility.compliance
    viscous = flexibility.part in ("drive", "joint")
    return flexibility.compliance / (excitation.elastic(joint.loss_factor) + resistance * viscous)


def _slack(states: Array, rows: list[Array], tie: Tie, excitation: Excitation) -> tuple[Array, list[Array]]:
    """States beyond the slack screws of a joint, and the conditions so far with theirs: power on the screw = resistance."""
    viscosity = tie.element.viscosity
    for screw in tie.slack:
        row = _power(states, screw)
        resistance = 1j * excitation.omega * (0.0 if viscosity is None else viscosity)
        rows = [*rows, jnp.concatenate([row, -resistance[..., None]], axis=-1)]
        motion = jnp.zeros((12, 1)).at[:6, 0].set(_column(screw.linear, screw.angular))
        states = jnp.concatenate([states, jnp.broadcast_to(motion, (*states.shape[:-1], 1))], axis=-1)
    return states, rows


def _renewed(states: Array, rows: list[Array]) -> tuple[Array, list[Array]]:
    """The same states as new unknowns, and the conditions so far with those that tie them to the old ones."""
    fresh = jnp.broadcast_to(jnp.eye(12, dtype=complex), (*states.shape[:-1], 12))
    tied = jnp.concatenate([states, -fresh], axis=-1)
    return jnp.concatenate([jnp.zeros_like(states), fresh], axis=-1), [*rows, *(tied[..., k, :] for k in range(12))]


def _along(bar: Bar, stock: Stock, excitation: Excitation, effort: Effort) -> Array:
    """(n, 12, 12): the state at the far end of a piece of a beam from that at its near end, in the chain's axes."""
    made = uniform(bar.profile, stock)
    x, y, z = (_column(v) for v in beam_axes(bar.start, bar.axis))
    # The extended part of a slide may run backwards.
    ahead = jnp.where(jnp.asarray(bar.length) < 0, -1.0, 1.0)
    axes = jnp.stack([x * ahead, y, z * ahead], axis=-1)
    length = jnp.abs(jnp.asarray(bar.length)) / effort.segments
    elastic = excitation.elastic(made.loss_factor)
    inside = transfer(made, length, excitation.square, elastic, effort.terms)
    turn = jnp.kron(jnp.eye(4), axes)
    return turn @ inside @ turn.T


def _loaded(states: Array, point: Vec, lump: Lump, square: Array) -> Array:
    """States beyond a mass at a node: the wrench which moves the mass goes no further."""
    axes = jnp.stack([_column(v) for v in lump.frame[1:]], axis=-1)
    inertia = jnp.zeros((6, 6)).at[:3, :3].set(lump.mass * jnp.eye(3))
    inertia = inertia.at[3:, 3:].set(axes @ jnp.diag(jnp.stack([jnp.asarray(m, dtype=float) for m in lump.moments])) @ axes.T)
    carry = _carry(lump.frame.origin - point)[:6, :6]
    return states.at[..., 6:, :].add(-square[..., None, None] * (carry.T @ inertia @ carry @ states[..., :6, :]))
