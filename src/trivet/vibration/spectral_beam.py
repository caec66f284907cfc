"""A vibrating uniform beam, exactly: the state at its far end from that at its near end, without a mesh.

The state is the twist (v, w) of a section and the wrench (f, m) that the part beyond puts on it, in local axes, x along the
beam.  Stretching, torsion and the two bendings are apart.  Bending after Timoshenko, with e = E I, per length L:

    w' = a + phi v,   a' = m,   v' = -z w,   m' = -v - r a                                              (d/d(x/L)),

w = deflection / L, a = slope of the section, v = V L^2/e, m = M L/e, phi = e/(G A_s L^2), z = mu omega^2 L^4/e and
r = j omega^2 L^2/e.  Its matrix A has A^4 = s A^2 - t with s = -(z phi + r), t = z (phi r - 1), so that

    exp A = c0 + c1 A + c2 A^2 + c3 A^3

with entire functions c of s and t: series without roots, branches or cancellation, down to omega = 0 and to zero length, where
they give the static flexibility.  (Cayley-Hamilton; the equations are Timoshenko's, Phil. Mag. 41:744, 1921.)
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp

from trivet.space.scalar import Scalar
from trivet.statics.beam_element import Uniform

Array: TypeAlias = jax.Array


class Transfer(NamedTuple):
    """How the state at the far end of a beam follows from that at its near end, in local axes.

    Every entry is (n, 2): stretching and torsion; or bending in the x-y and in the x-z plane, of which the rows and columns are
    deflection w, slope a, shear force v and moment m.
    """

    along: tuple[Array, Array, Array]
    """Cosine; twist per wrench; wrench per twist."""
    across: tuple[tuple[Array, ...], ...]
    """Rows of bending, four by four."""

    def passed(self, states: Array) -> Array:
        """States (n, 4, 3, c) at the far end: velocity, angular velocity, force and moment, in local axes, of c columns."""
        cos, soft, heavy = (e[..., None] for e in self.along)
        twists, wrenches = states[..., :2, 0, :], states[..., 2:, 0, :]
        first = jnp.concatenate([cos * twists + soft * wrenches, heavy * twists + cos * wrenches], axis=-2)
        # A rotation about z is a slope in the x-y plane, one about -y in the x-z plane.
        sign = jnp.array([[1.0], [-1.0]])
        near = (
            states[..., 0, 1:, :], sign * states[..., 1, :0:-1, :],
            states[..., 2, 1:, :], sign * states[..., 3, :0:-1, :],
        )  # fmt: skip
        far = [_products(row, near) for row in self.across]
        rest = [far[0], (sign * far[1])[..., ::-1, :], far[2], (sign * far[3])[..., ::-1, :]]
        return jnp.concatenate([first[..., None, :], jnp.stack(rest, axis=-3)], axis=-2)


def _products(row: tuple[Array, ...], near: tuple[Array, ...]) -> Array:
    """Sum of entries (n, 2) times states (n, 2, c)."""
    first, *rest = (entry[..., None] * state for entry, state in zip(row, near, strict=True))
    return sum(rest, start=first)


def transfer(made: Uniform, length: Scalar, square: Array, elastic: Scalar, terms: int) -> Transfer:
    """The transfer over a length of a uniform beam.

    Args:
        made: of what the beam is made.
        length: above zero, or zero, m.
        square: (n,) omega^2, rad^2/s^2.
        elastic: 1 + i eta, which multiplies both moduli.
        terms: how far the series go, see `terms_for`.
    """
    square = square[:, None]
    # Stretching and torsion, then bending in the local x-y and x-z planes.
    stiff, inert = _pair(made.axial, made.torsion) * elastic, _pair(made.mass, made.polar)
    flexural, shear = _pair(made.flexural_z, made.flexural_y) * elastic, _pair(made.shear_y, made.shear_z)
    heavy, turning = square * made.mass * length, square * _pair(made.rotary_z, made.rotary_y) * length
    soft, mass = length / stiff, square * inert * length
    bend, give = length / flexural, length / shear / elastic  # infinite shear stiffness times eta would have no derivative
    area = length * length
    phi_z, r = heavy * give, turning * bend
    s = jnp.concatenate([-mass * soft, -(phi_z + r)], axis=-1)
    t = jnp.concatenate([jnp.zeros_like(mass * soft), phi_z * r - heavy * bend * area], axis=-1)
    s2, s3, s4, s5 = _sums(s, t, terms)
    cos, sinc = 1 + s[:, :2] * s2[:, :2], 1 + s[:, :2] * s3[:, :2]
    c0, c1, c2, c3 = 1 - t[:, 2:] * s4[:, 2:], 1 - t[:, 2:] * s5[:, 2:], s2[:, 2:], s3[:, 2:]
    sway, turn = c1 - phi_z * c3, c1 - r * c3
    ww, wa, wv, wm = c0 - phi_z * c2, (c1 - (phi_z + r) * c3) * length, sway * give - c3 * area * bend, c2 * length * bend
    aw, aa, am = c3 * length * heavy * bend, c0 - r * c2, turn * bend
    vw, mw, ma = -sway * heavy, c2 * length * heavy, c3 * area * heavy - turn * turning
    # Half of the entries follow from the other half.
    across = ((ww, wa, wv, wm), (aw, aa, -wm, am), (vw, -mw, ww, -aw), (mw, ma, -wa, aa))
    return Transfer((cos, sinc * soft, -sinc * mass), across)


def transfer_matrix(made: Uniform, length: Scalar, square: Array, elastic: Scalar, terms: int) -> Array:
    """(n, 12, 12): `transfer` as matrices."""
    unit = jnp.eye(12).reshape(1, 4, 3, 12)
    return transfer(made, length, square, elastic, terms).passed(unit).reshape(-1, 12, 12)


def _pair(first: Scalar, second: Scalar) -> Array:
    return jnp.stack([jnp.asarray(first, dtype=float), jnp.asarray(second, dtype=float)])


def terms_for(argument: float) -> int:
    """Terms after which the series have converged to rounding, for a wave number times length."""
    term, n = 1.0, 0
    while term > 1e-18 or n < argument / 2:
        n += 1
        term *= argument**2 / ((2 * n) * (2 * n + 1))
    return n + 1


def wave_numbers(made: Uniform, omega: Scalar) -> Array:
    """(2,): greatest wave numbers (1/m) of bending, and of stretching or torsion, at a frequency (rad/s), damping left out."""
    square = jnp.square(omega)
    along = [square * made.mass / made.axial, square * made.polar / made.torsion]
    across = []
    for flexural, shear, rotary in (
        (made.flexural_z, made.shear_y, made.rotary_z),
        (made.flexural_y, made.shear_z, made.rotary_y),
    ):
        half = square * (made.mass / shear + rotary / flexural) / 2
        across.append(half + jnp.sqrt(half * half + square * made.mass / flexural))
    return jnp.sqrt(jnp.stack([jnp.stack(across).max(), jnp.stack(along).max()]))


def _sums(s: Array, t: Array, terms: int) -> tuple[Array, ...]:
    """S_2 to S_5, of which the functions c are made: c0 = 1 - t S_4, c1 = 1 - t S_5, c2 = S_2, c3 = S_3.

    With h_n the complete homogeneous symmetric polynomials of the two squared exponents, h_n = s h_n-1 - t h_n-2, and
    S_m = sum of h_n / (2n + m)!.  With t = 0 they are those of stretching: cos = 1 + s S_2, sin / (k L) = 1 + s S_3.
    """
    weights = jnp.array([[1 / math.factorial(2 * n + 2 + m) for m in range(4)] for n in range(terms)])

    def add_term(carry: tuple[Array, Array, Array], weight: Array) -> tuple[tuple[Array, Array, Array], None]:
        h, before, sums = carry
        return (s * h - t * before, h, sums + weight * h[..., None]), None

    start = (jnp.ones_like(s), jnp.zeros_like(s), jnp.zeros((*s.shape, 4), dtype=s.dtype))
    (_, _, sums), _ = jax.lax.scan(add_term, start, weights)
    return tuple(sums[..., m] for m in range(4))
