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
from collections.abc import Sequence
from typing import TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from trivet.space.scalar import Scalar
from trivet.statics.beam_element import PLANES, Uniform

Array: TypeAlias = jax.Array

# Where the parts of the state stand among (v, w, f, m): twist and wrench of stretching and of torsion.
_LINES = (np.array([0, 6]), np.array([3, 9]))


def transfer(made: Uniform, length: Scalar, square: Array, elastic: Scalar, terms: int) -> Array:
    """(n, 12, 12): state at the far end from the state at the near end, in local axes.

    Args:
        made: of what the beam is made.
        length: above zero, or zero, m.
        square: (n,) omega^2, rad^2/s^2.
        elastic: 1 + i eta, which multiplies both moduli.
        terms: how far the series go, see `terms_for`.
    """
    matrix = jnp.zeros((*square.shape, 12, 12), dtype=jnp.result_type(square, elastic))
    lines = ((made.axial, made.mass), (made.torsion, made.polar))
    for places, (stiffness, inertia) in zip(_LINES, lines, strict=True):
        matrix = _placed(matrix, places, np.ones(2), _line(stiffness * elastic, inertia, length, square, terms))
    bending = ((made.flexural_z, made.shear_y, made.rotary_z), (made.flexural_y, made.shear_z, made.rotary_y))
    for (near, sign), (flexural, shear, rotary) in zip(PLANES, bending, strict=True):
        places, signs = np.r_[near[:2], near[:2] + 6], np.array([1, sign, 1, sign])
        inertia = (made.mass, rotary)
        matrix = _placed(matrix, places, signs, _bending(flexural * elastic, shear * elastic, inertia, length, square, terms))
    return matrix


def terms_for(argument: float) -> int:
    """Terms after which the series have converged to rounding, for a wave number times length."""
    term, n = 1.0, 0
    while term > 1e-18 or n < argument / 2:
        n += 1
        term *= argument**2 / ((2 * n) * (2 * n + 1))
    return n + 1


def wave_number(made: Uniform, omega: Scalar) -> Array:
    """Greatest wave number (1/m) of a beam at a frequency (rad/s), damping left out."""
    square = jnp.square(omega)
    found = [square * made.mass / made.axial, square * made.polar / made.torsion]
    for flexural, shear, rotary in (
        (made.flexural_z, made.shear_y, made.rotary_z),
        (made.flexural_y, made.shear_z, made.rotary_y),
    ):
        half = square * (made.mass / shear + rotary / flexural) / 2
        found.append(half + jnp.sqrt(half * half + square * made.mass / flexural))
    return jnp.sqrt(jnp.stack(found).max())


def _placed(matrix: Array, places: np.ndarray, signs: np.ndarray, rows: Sequence[Sequence[Array]]) -> Array:
    """The matrix with a block, whose axes have signs, in place."""
    block = jnp.stack([jnp.stack([jnp.broadcast_to(c, matrix.shape[:-2]) for c in row], axis=-1) for row in rows], axis=-2)
    return matrix.at[..., places[:, None], places].set(block * (signs[:, None] * signs))


def _line(stiffness: Scalar, inertia: Scalar, length: Scalar, square: Array, terms: int) -> list[list[Array]]:
    """Stretching or torsion, with c = cos and s = sin(k L)/(k L) as series of (k L)^2."""
    soft, heavy = length / stiffness, square * (inertia * length)
    z = heavy * soft
    c, s = jnp.zeros_like(z), jnp.zeros_like(z)
    for n in reversed(range(terms)):
        c, s = 1 / math.factorial(2 * n) - z * c, 1 / math.factorial(2 * n + 1) - z * s
    return [[c, s * soft], [-s * heavy, c]]


def _bending(
    flexural: Scalar, shear: Scalar, inertia: tuple[Scalar, Scalar], length: Scalar, square: Array, terms: int
) -> list[list[Array]]:
    """Bending: rows and columns deflection, slope, shear force, moment, in SI."""
    heavy, turning = square * (inertia[0] * length), square * (inertia[1] * length)
    bend, give = length / flexural, length / shear
    area = length * length
    z, phi_z, r = heavy * bend * area, heavy * give, turning * bend
    c0, c1, c2, c3 = _functions(-(phi_z + r), phi_z * r - z, terms)
    ww, aa = c0 - phi_z * c2, c0 - r * c2
    wa = (c1 - (phi_z + r) * c3) * length
    wm, mw = c2 * length * bend, c2 * length * heavy
    aw = c3 * length * heavy * bend
    sway = c1 - phi_z * c3
    turn = c1 - r * c3
    return [
        [ww, wa, sway * give - c3 * area * bend, wm],
        [aw, aa, -wm, turn * bend],
        [-sway * heavy, -mw, ww, -aw],
        [mw, c3 * area * heavy - turn * turning, -wa, aa],
    ]


def _functions(s: Array, t: Array, terms: int) -> tuple[Array, Array, Array, Array]:
    """c0, c1, c2, c3.

    With h_n the complete homogeneous symmetric polynomials of the two squared exponents, h_n = s h_n-1 - t h_n-2, and
    S_m = sum of h_n / (2n + m)!, they are 1 - t S_4, 1 - t S_5, S_2 and S_3.
    """
    weights = jnp.array([[1 / math.factorial(2 * n + 2 + m) for m in range(4)] for n in range(terms)])

    def add_term(carry: tuple[Array, Array, Array], weight: Array) -> tuple[tuple[Array, Array, Array], None]:
        h, before, sums = carry
        return (s * h - t * before, h, sums + weight * h[..., None]), None

    start = (jnp.ones_like(s), jnp.zeros_like(s), jnp.zeros((*s.shape, 4), dtype=s.dtype))
    (_, _, sums), _ = jax.lax.scan(add_term, start, weights)
    s2, s3, s4, s5 = (sums[..., m] for m in range(4))
    return 1 - t * s4, 1 - t * s5, s2, s3
