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
from typing import TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from trivet.space.scalar import Scalar
from trivet.statics.beam_element import PLANES, Uniform

Array: TypeAlias = jax.Array


def transfer(made: Uniform, length: Scalar, square: Array, elastic: Scalar, terms: int) -> Array:
    """(n, 12, 12): state at the far end from the state at the near end, in local axes.

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
    entries = [
        cos, sinc * soft, -sinc * mass,
        c0 - phi_z * c2, (c1 - (phi_z + r) * c3) * length, sway * give - c3 * area * bend, c2 * length * bend,
        c3 * length * heavy * bend, c0 - r * c2, turn * bend, -sway * heavy, c2 * length * heavy,
        c3 * area * heavy - turn * turning,
    ]  # fmt: skip
    together = jnp.concatenate([jnp.broadcast_to(e, cos.shape) for e in entries], axis=-1)
    return (together @ _PLACES).reshape(-1, 12, 12)


def _places() -> np.ndarray:
    """(26, 144): where the entries of `transfer`, two of each kind, stand in the matrix, and with which sign."""
    places = np.zeros((13, 2, 12, 12))
    for pair, place in enumerate((0, 3)):
        for kind, (row, column) in ((0, (0, 0)), (0, (6, 6)), (1, (0, 6)), (2, (6, 0))):
            places[kind, pair, place + row, place + column] = 1
    # Rows and columns: deflection w, slope a, shear force v, moment m; half of the entries follow from the other half.
    ww, wa, wv, wm, aw, aa, am, vw, mw, ma = range(3, 13)
    bending = [[ww, wa, wv, wm], [aw, aa, -wm, am], [vw, -mw, ww, -aw], [mw, ma, -wa, aa]]
    for pair, (near, sign) in enumerate(PLANES):
        axes, signs = np.r_[near[:2], near[:2] + 6], (1, sign, 1, sign)
        for i, kinds in enumerate(bending):
            for j, kind in enumerate(kinds):
                places[abs(kind), pair, axes[i], axes[j]] = np.sign(kind) * signs[i] * signs[j]
    return places.reshape(26, 144)


_PLACES = _places()


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
