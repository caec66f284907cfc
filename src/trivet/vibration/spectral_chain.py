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

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import lu_factor, lu_solve

from trivet.kinematics.constraint import transmitted
from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg
from trivet.model.elements import Flexibility, Joint, Stock
from trivet.model.elements.beam import beam_axes
from trivet.space.scalar import Scalar, is_known
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
    states = jnp.broadcast_to(jnp.eye(12, 6, -6, dtype=complex), (*count, 12, 6))
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
                states, rows = _yielding(states, rows, part, excitation)
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
    columns = [_column(w.force, w.moment) for w in wrenches]
    basis: Any = np.stack(columns, axis=-1) if all(isinstance(c, np.ndarray) for c in columns) else jnp.stack(columns, axis=-1)
    ends = [_power(states, screw) for screw in open_end]
    conditions = [jnp.pad(row, ((0, 0), (0, states.shape[-1] - row.shape[-1]))) for row in (*rows, *ends)]
    matrix = jnp.concatenate([basis.T @ states[..., :6, :], *(c[..., None, :] for c in conditions)], axis=-2)
    # a from unit motions along W0, then its wrenches in terms of W0.
    size = matrix.shape[-1]
    scale = jnp.abs(matrix[:1]).max(axis=-1, keepdims=True)  # of the rows, the same at all frequencies
    factors, pivots = lu_factor(matrix / scale)
    motions = jnp.eye(size, len(wrenches)) / scale
    solved = lu_solve((factors, pivots), jnp.broadcast_to(motions.astype(complex), (*count, size, len(wrenches))))
    part_of = (np if isinstance(basis, np.ndarray) else jnp).linalg.inv(basis.T @ basis) @ basis.T
    return LegDynamics(wrenches, part_of @ states[..., 6:, :] @ solved, _determinant(factors, pivots))


def _determinant(factors: Array, pivots: Array) -> Array:
    """(n,): determinants from LU factors, the greatest of size one."""
    diagonal = jnp.diagonal(factors, axis1=-2, axis2=-1)
    sizes = jnp.abs(diagonal)
    swaps = jnp.sum(pivots != jnp.arange(pivots.shape[-1]), axis=-1)
    logarithm = jnp.log(sizes).sum(axis=-1)
    phase = jnp.prod(diagonal / sizes, axis=-1) * (1 - 2 * (swaps % 2))
    return phase * jnp.exp(logarithm - logarithm.max())


def _column(*vectors: Vec) -> Any:
    """Components of vectors, one after the other; an array of NumPy where all are known while JAX traces."""
    components = [c for v in vectors for c in v]
    if all(is_known(c) for c in components):
        return np.array(components, dtype=float)
    return jnp.stack([jnp.asarray(c, dtype=float) for c in components])


_IN_CROSS = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
)
"""(3, 3, 3): arm @ this is the matrix of arm x."""


def _cross(arm: Vec) -> Array:
    """(3, 3): the matrix of arm x."""
    return jnp.tensordot(_column(arm), _IN_CROSS, axes=1)


def _carry(arm: Vec) -> Array:
    """(12, 12): the state of a rigid body at a point an arm (m) further: v - arm x w, m - arm x f."""
    one, zero, cross = jnp.eye(3), jnp.zeros((3, 3)), -_cross(arm)
    return jnp.block([[one, cross, zero, zero], [zero, one, zero, zero], [zero, zero, one, zero], [zero, zero, cross, one]])


def _moved(states: Array, here: Vec | None, there: Vec) -> Array:
    """States reduced at another point of the same rigid body."""
    return states if here is None or here is there else _carry(there - here) @ states


def _power(states: Array, screw: Twist) -> Array:
    """(n, columns): power of the wrenches on a screw."""
    return jnp.einsum("i,...ij->...j", _column(screw.linear, screw.angular), states[..., 6:, :])


def _sprung(states: Array, tie: Tie, excitation: Excitation) -> Array:
    """States beyond those springs of a joint which have no viscous damping beside them."""
    elastic = excitation.elastic(tie.element.loss_factor)
    twists = states[..., :6, :]
    for flexibility in tie.sprung:
        if not _is_viscous(flexibility, tie.element):
            screw = _column(flexibility.twist.linear, flexibility.twist.angular)
            soft = flexibility.compliance / elastic
            twists = twists + screw[:, None] * (soft * _power(states, flexibility.twist))[..., None, :]
    return jnp.concatenate([twists, states[..., 6:, :]], axis=-2)


def _is_viscous(flexibility: Flexibility, joint: Joint) -> bool:
    """Whether the damping of a joint's motion acts beside a spring; it does not in the joint's bearing."""
    return joint.viscosity is not None and flexibility.part in ("drive", "joint")


def _yielding(states: Array, rows: list[Array], tie: Tie, excitation: Excitation) -> tuple[Array, list[Array]]:
    """States beyond the slack and the viscous screws of a joint, and the conditions so far with theirs.

    The motion along each is a new unknown, and power on the screw = rate * motion its condition: a division by the rate would
    be one by a function of frequency.
    """
    joint = tie.element
    viscous = jnp.zeros_like(excitation.omega) if joint.viscosity is None else 1j * excitation.omega * joint.viscosity
    screws = [(screw, viscous) for screw in tie.slack]
    for flexibility in tie.sprung:
        if _is_viscous(flexibility, joint):
            screws.append((flexibility.twist, excitation.elastic(joint.loss_factor) / flexibility.compliance + viscous))
    for screw, rate in screws:
        rows = [*rows, jnp.concatenate([_power(states, screw), -rate[..., None]], axis=-1)]
        motion = jnp.pad(_column(screw.linear, screw.angular), (0, 6))[:, None]
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
    arm, axes = _cross(lump.frame.origin - point), jnp.stack([_column(v) for v in lump.frame[1:]], axis=-1)
    moments = jnp.stack([jnp.asarray(m, dtype=float) for m in lump.moments])
    own = (axes * moments) @ axes.T
    inertia = jnp.block([[lump.mass * jnp.eye(3), -lump.mass * arm], [lump.mass * arm, own - lump.mass * arm @ arm]])
    wrenches = states[..., 6:, :] - square[..., None, None] * (inertia @ states[..., :6, :])
    return jnp.concatenate([states[..., :6, :], wrenches], axis=-2)
