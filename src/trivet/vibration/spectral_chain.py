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

import jax
import jax.numpy as jnp
import numpy as np

from trivet.kinematics.constraint import transmitted
from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg
from trivet.model.elements import Flexibility, Joint, Stock
from trivet.model.elements.beam import beam_axes
from trivet.space.scalar import Scalar, is_known, is_zero
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
    states = jnp.broadcast_to(jnp.eye(12, 6, -6, dtype=complex).reshape(4, 3, 6), (*count, 4, 3, 6))
    rows: list[Array] = []
    found = list(parts(walk(leg.chain.elements, posture), stock))
    point: Vec | None = None  # on the ground a state is the same wherever it is reduced
    last = next(k for k in reversed(range(len(found))) if not isinstance(found[k], Lump))
    # What turns with the platform is felt by motions which an open end leaves out.
    may_be_open = not any(isinstance(p, Lump) and _has_arms(p) for p in found[last:])
    open_end: tuple[Twist, ...] = ()
    for k, part in enumerate(found):
        if isinstance(part, Tie):
            states, point = _moved(states, point, part.at), part.at
            states = _sprung(states, part, excitation)
            if k == last and may_be_open and part.element.viscosity is None:
                open_end = part.slack
            else:
                states, rows = _yielding(states, rows, part, excitation)
        elif isinstance(part, Bar):
            states, point = _moved(states, point, part.start.origin), part.end
            states, rows = _passed(states, rows, part, stock, excitation, effort)
        elif isinstance(part, Arm):
            states, point = _moved(_moved(states, point, part.start), part.start, part.end), part.end
        else:
            assert point is not None, "a chain starts with a joint"
            states = _loaded(states, point, part, excitation.square)
    wrenches = transmitted(open_end)
    columns = [_column(w.force, w.moment) for w in wrenches]
    basis: Any = np.stack(columns, axis=-1) if all(isinstance(c, np.ndarray) for c in columns) else jnp.stack(columns, axis=-1)
    rows = [*rows, *(_power(states, screw) for screw in open_end)]
    flat = states.reshape(*count, 12, -1)
    felt = [_combined(basis[:, k], flat[..., :6, :]) for k in range(len(wrenches))]
    size = flat.shape[-1]
    matrix = jnp.stack([*felt, *(jnp.pad(row, ((0, 0), (0, size - row.shape[-1]))) for row in rows)], axis=-2)
    # a from unit motions along W0, then its wrenches in terms of W0.
    scale = jnp.abs(matrix[:1]).max(axis=-1, keepdims=True)  # of the rows, the same at all frequencies
    solved, denominator = eliminated(matrix / scale, jnp.eye(size, len(wrenches)) / scale)
    part_of = (np if isinstance(basis, np.ndarray) else jnp).linalg.inv(basis.T @ basis) @ basis.T
    given = jnp.stack([_combined(part_of[k], flat[..., 6:, :]) for k in range(len(wrenches))], axis=-2)
    return LegDynamics(wrenches, (given[..., None] * solved[..., None, :, :]).sum(axis=-2), denominator)


def _has_arms(lump: Lump) -> bool:
    """Whether a mass of a joint resists turns about its node."""
    assert isinstance(lump.element, Joint), "a body ends with a node of its own"
    return lump.element.inertia is not None or lump.element.centre_of_mass is not None


def _column(*vectors: Vec) -> Any:
    """Components of vectors, one after the other; an array of NumPy where all are known while JAX traces."""
    components = [c for v in vectors for c in v]
    if all(is_known(c) for c in components):
        return np.array(components, dtype=float)
    return jnp.stack([jnp.asarray(c, dtype=float) for c in components])


_IN_CROSS = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
)
"""(3, 3, 3): an arm times this is the matrix of arm x."""


def _crossed(arm: Vec, vectors: Array) -> Array:
    """arm x vectors (..., 3, c)."""
    matrix = jnp.tensordot(_column(arm), _IN_CROSS, axes=1)
    return _turned(matrix, vectors)


def _turned(matrix: Array, vectors: Array) -> Array:
    """(3, 3) times vectors (..., 3, c), without a call of a library per frequency."""
    return sum(matrix[:, j, None] * vectors[..., j, None, :] for j in range(3))  # type: ignore[return-value]


def _combined(factors: Any, rows: Array) -> Array:
    """Sum of factors (k,) times rows (..., k, c)."""
    return sum(factors[k] * rows[..., k, :] for k in range(rows.shape[-2]))  # type: ignore[return-value]


def _moved(states: Array, here: Vec | None, there: Vec) -> Array:
    """States reduced at another point of the same rigid body: v - arm x w, m - arm x f."""
    if here is None or here is there:
        return states
    velocity, angular, force, moment = (states[..., k, :, :] for k in range(4))
    arm = there - here
    return jnp.stack([velocity - _crossed(arm, angular), angular, force, moment - _crossed(arm, force)], axis=-3)


def _power(states: Array, screw: Twist) -> Array:
    """(n, columns): power of the wrenches on a screw."""
    wrenches = states[..., 2:, :, :].reshape(*states.shape[:-3], 6, states.shape[-1])
    return _combined(_column(screw.linear, screw.angular), wrenches)


def _sprung(states: Array, tie: Tie, excitation: Excitation) -> Array:
    """States beyond those springs of a joint which have no viscous damping beside them."""
    elastic = excitation.elastic(tie.element.loss_factor)
    twists = states[..., :2, :, :]
    for flexibility in tie.sprung:
        if not _is_viscous(flexibility, tie.element):
            screw = _column(flexibility.twist.linear, flexibility.twist.angular).reshape(2, 3, 1)
            soft = flexibility.compliance / elastic
            twists = twists + screw * (soft * _power(states, flexibility.twist))[..., None, None, :]
    return jnp.concatenate([twists, states[..., 2:, :, :]], axis=-3)


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
        motion = jnp.pad(_column(screw.linear, screw.angular), (0, 6)).reshape(4, 3, 1)
        states = jnp.concatenate([states, jnp.broadcast_to(motion, (*states.shape[:-1], 1))], axis=-1)
    return states, rows


def _passed(
    states: Array, rows: list[Array], bar: Bar, stock: Stock, excitation: Excitation, effort: Effort
) -> tuple[Array, list[Array]]:
    """States beyond a beam, and the conditions so far with those of its pieces."""
    made = uniform(bar.profile, stock)
    x, y, z = (_column(v) for v in beam_axes(bar.start, bar.axis))
    # The extended part of a slide may run backwards.
    ahead = jnp.where(jnp.asarray(bar.length) < 0, -1.0, 1.0)
    axes = jnp.stack([x * ahead, y, z * ahead], axis=-1)
    length = jnp.abs(jnp.asarray(bar.length)) / effort.segments
    elastic = excitation.elastic(made.loss_factor)
    step = transfer(made, length, excitation.square, elastic, effort.terms)
    states = _turned(axes.T, states)
    for segment in range(effort.segments):
        states = step.passed(states)
        if segment + 1 < effort.segments:
            states, rows = _renewed(states, rows)
    return _turned(axes, states), rows


def _renewed(states: Array, rows: list[Array]) -> tuple[Array, list[Array]]:
    """The same states as new unknowns, and the conditions so far with those that tie them to the old ones."""
    flat = states.reshape(*states.shape[:-3], 12, -1)
    fresh = jnp.broadcast_to(jnp.eye(12, dtype=complex), (*flat.shape[:-1], 12))
    tied = jnp.concatenate([flat, -fresh], axis=-1)
    renewed = jnp.concatenate([jnp.zeros_like(flat), fresh], axis=-1).reshape(*states.shape[:-1], -1)
    return renewed, [*rows, *(tied[..., k, :] for k in range(12))]


def _loaded(states: Array, point: Vec, lump: Lump, square: Array) -> Array:
    """States beyond a mass at a node: the wrench which moves the mass goes no further."""
    velocity, angular, force, moment = (states[..., k, :, :] for k in range(4))
    arm = lump.frame.origin - point
    wanted = lump.mass * (velocity - _crossed(arm, angular))
    turning = _crossed(arm, wanted)
    if not all(is_zero(m) for m in lump.moments):
        axes = jnp.stack([_column(v) for v in lump.frame[1:]], axis=-1)
        moments = jnp.stack([jnp.asarray(m, dtype=float) for m in lump.moments])
        turning = turning + _turned((axes * moments) @ axes.T, angular)
    square = square[..., None, None]
    return jnp.stack([velocity, angular, force - square * wanted, moment - square * turning], axis=-3)


def eliminated(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Solutions (n, s, m) of n sets of s equations, and their determinants (n,), up to one factor for all.

    Elimination after Gauss and Jordan with the greatest pivot of each column: LAPACK, called for many small matrices at a time
    from several places of one compiled kernel, now and then never returns (jaxlib 0.10).

    Args:
        matrix: (n, s, s).
        right: (n or 1, s, m) right hand sides.
    """
    size = matrix.shape[-1]
    whole = jnp.concatenate([matrix, jnp.broadcast_to(right, (*matrix.shape[:-1], right.shape[-1])).astype(matrix.dtype)], axis=-1)
    rows = jnp.arange(size)

    def column(k: Array, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        whole, logarithm, phase = carry
        own = jax.lax.dynamic_index_in_dim(whole, k, axis=-1, keepdims=False)
        chosen = jnp.argmax(jnp.where(rows < k, -1.0, jnp.abs(own)), axis=-1)
        is_chosen, is_k = rows == chosen[..., None], rows == k
        pivot_row = jnp.where(is_chosen[..., None], whole, 0).sum(axis=-2)
        displaced = jax.lax.dynamic_index_in_dim(whole, k, axis=-2, keepdims=False)
        pivot = jax.lax.dynamic_index_in_dim(pivot_row, k, axis=-1, keepdims=False)
        scaled = pivot_row / pivot[..., None]
        swapped = jnp.where(is_chosen[..., None], displaced[..., None, :], whole)
        factors = jax.lax.dynamic_index_in_dim(swapped, k, axis=-1, keepdims=False)
        left = jnp.where(is_k[:, None], scaled[..., None, :], swapped - factors[..., None] * scaled[..., None, :])
        length = jnp.abs(pivot)
        sign = jnp.where(chosen == k, 1.0, -1.0)
        return left, logarithm + jnp.log(length), phase * (sign * pivot / length)

    first = jnp.zeros(matrix.shape[:-2]), jnp.ones(matrix.shape[:-2], dtype=matrix.dtype)
    whole, logarithm, phase = jax.lax.fori_loop(0, size, column, (whole, *first))
    return whole[..., size:], phase * jnp.exp(logarithm - logarithm.max())
