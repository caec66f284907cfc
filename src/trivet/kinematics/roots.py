"""Three bi-quadratic equations in z_i = exp(i phi_i), one per pair of circles: elimination, iteration, certificate.

Two unknowns are eliminated: the resultant of the three equations is a Laurent polynomial F in z_1 of degrees -8 to 8, whose
roots Aberth's iteration finds all at once (Math. Comp. 27, 1973, 339-344).  F is never expanded there; values and slopes come
from the elimination at each point, which keeps clustered roots apart.  Newton's method in log z on the three equations then
removes what the elimination loses, and Kantorovich's theorem isolates every root.

Arrays are (roots, problems), problems last, so that XLA vectorises over them; a complex number is a pair of reals for the
same reason.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from trivet.space.scalar import Scalar

DEGREE = 8
"""Of F, upwards and downwards."""

WIDEST = 0.1
"""Largest radius of isolation, in log z; the second derivatives are bounded over it."""

FAR = 1e75
"""Modulus at which roots at infinity are parked, and one over that of roots at zero."""

FARTHEST = 1e13
"""Greatest modulus of a finite root; beyond it coefficients which rounding made are at work."""

EXACT = 2e-14
"""Greatest residual, relative to the sum of the terms of an equation, of a point on which Newton's method has settled."""

_TINY = 1e-300
_EPSILON = float(np.finfo(float).eps)


class Complex(NamedTuple):
    """A complex number as a pair of reals."""

    re: Scalar
    im: Scalar

    def __add__(self, other: Complex) -> Complex:  # type: ignore[override]
        return Complex(self.re + other.re, self.im + other.im)

    def __sub__(self, other: Complex) -> Complex:
        return Complex(self.re - other.re, self.im - other.im)

    def __neg__(self) -> Complex:
        return Complex(-self.re, -self.im)

    def __mul__(self, other: Complex) -> Complex:  # type: ignore[override]
        return Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    def __truediv__(self, other: Complex) -> Complex:
        return self * other.inverse()

    def scaled(self, factor: Scalar) -> Complex:
        """Times a real number."""
        return Complex(self.re * factor, self.im * factor)

    def inverse(self) -> Complex:
        """One over it; zero, not NaN, for zero."""
        return self.conjugate().scaled(1 / (self.square() + _TINY))

    def conjugate(self) -> Complex:
        """Mirrored in the real axis."""
        return Complex(self.re, -self.im)

    def square(self) -> Scalar:
        """Square of the modulus."""
        return self.re * self.re + self.im * self.im

    def modulus(self) -> Scalar:
        """Absolute value."""
        return jnp.sqrt(self.square())


class Pair(NamedTuple):
    """k + 2 Re(a u + b v + c u v + d u/v) of two circles (Eq 8), u and v on the unit circle, continued to complex u, v."""

    constant: Scalar
    first: Complex
    second: Complex
    both: Complex
    apart: Complex


Pairs: TypeAlias = tuple[Pair, Pair, Pair]
"""Of the unknowns (z1, z2), (z2, z3), (z3, z1)."""
Point: TypeAlias = tuple[Complex, Complex, Complex]
"""z1, z2, z3."""
Quadratic: TypeAlias = tuple[Complex, Complex, Complex]
"""Coefficients of the square, of the unknown and of one."""


class Roots(NamedTuple):
    """Points that Newton's method has reached."""

    z: Point
    error: Scalar
    """Newton step that would follow, with its rounding, in log z."""
    reach: Scalar
    """Within this distance in log z no second root exists; below 8 errors nothing is proved."""
    residual: Scalar
    """Greatest residual of the three equations, relative to the sum of their terms."""


def quadratics(pairs: Pairs, z: Complex) -> tuple[Quadratic, Quadratic]:
    """The equations (z1, z2) and (z3, z1) at z1, as quadratics in z2 and in z3."""
    one, _, three = pairs
    over = z.inverse()

    def along(constant: Scalar, rising: Complex) -> Complex:
        ahead, behind = rising * z, rising.conjugate() * over
        return Complex(constant + ahead.re + behind.re, ahead.im + behind.im)

    second = (
        one.second + one.both * z + one.apart.conjugate() * over,
        along(one.constant, one.first),
        one.second.conjugate() + one.apart * z + one.both.conjugate() * over,
    )
    third = (
        three.first + three.both * z + three.apart * over,
        along(three.constant, three.second),
        three.first.conjugate() + three.apart.conjugate() * z + three.both.conjugate() * over,
    )
    return second, third


class _Elimination(NamedTuple):
    """Of z3 and z2 at one z1: F is top / lead^3, the common root z2 is -last[1] / last[0]."""

    top: Complex
    lead: Complex
    last: tuple[Complex, Complex]
    outer: tuple[Complex, Complex]
    inner: tuple[Complex, Complex]


def _eliminate(pairs: Pairs, z: Complex) -> _Elimination:
    """Resultant of two quadratics in z3 (Bezout), every product reduced at once by the quadratic in z2."""
    (p, q, r), (s, t, u) = quadratics(pairs, z)
    two = pairs[1]
    constant = Complex(two.constant, 0.0 * two.constant)
    a = (two.both, two.second, two.apart.conjugate())
    b = (two.first, constant, two.first.conjugate())
    c = (two.apart, two.second.conjugate(), two.both.conjugate())

    def minor(f: Complex, g: Quadratic, h: Complex, k: Quadratic) -> tuple[Complex, Complex]:
        return reduced(*(f * x - h * y for x, y in zip(g, k, strict=True)))

    def reduced(square: Complex, linear: Complex, constant: Complex) -> tuple[Complex, Complex]:
        return p * linear - q * square, p * constant - r * square

    outer, inner, other = minor(s, c, u, a), minor(s, b, t, a), minor(t, c, u, b)
    mixed = outer[0] * outer[1]
    g, h = reduced(
        outer[0] * outer[0] - inner[0] * other[0],
        mixed + mixed - inner[0] * other[1] - inner[1] * other[0],
        outer[1] * outer[1] - inner[1] * other[1],
    )
    return _Elimination(h * (p * h - q * g) + r * g * g, p, (g, h), outer, inner)


def _starts(pairs: Pairs, finite: Scalar) -> Complex:
    """Starts of the iteration (16, n) at the moduli which the Newton polygon of F suggests (Bini, Numer. Alg. 13, 1996).

    The roots come in pairs z, 1 / conj z.  The starts must not: the iteration would keep the symmetry, and real roots, which
    are their own partners, would never be found.
    """
    nodes = 2 * np.pi * np.arange(2 * DEGREE + 1) / (2 * DEGREE + 1)
    powers = np.arange(DEGREE + 1)
    f = _eliminate(pairs, Complex(np.cos(nodes)[:, None], np.sin(nodes)[:, None]))
    values = (f.top / (f.lead * f.lead * f.lead)).re  # F is real where |z| = 1, and |F_-k| = |F_k|
    turns = np.outer(powers, nodes)
    coefficients = Complex(jnp.asarray(np.cos(turns)) @ values, jnp.asarray(np.sin(turns)) @ values)
    height = 0.5 * jnp.log(coefficients.square() + _TINY)
    slopes = []
    for k in range(1, DEGREE + 1):  # of the least concave majorant between k - 1 and k: the least of the greatest chords
        chords = [jnp.max((height[k:] - height[i]) / (powers[k:] - i)[:, None], axis=0) for i in range(k)]
        slopes.append(jnp.minimum(0.0, jnp.min(jnp.stack(chords), axis=0)))
    radius = jnp.exp(-jnp.stack(slopes))
    radius = jnp.where(2 * powers[1:, None] > finite, FAR, radius)
    angles = np.pi * (math.sqrt(5) - 1) * np.arange(2 * DEGREE)[:, None] + 0.5
    moduli = jnp.concatenate([radius, 1 / radius])
    return Complex(moduli * np.cos(angles), moduli * np.sin(angles))


def _repulsion(z: Complex) -> Complex:
    """Sum of z / (z - other) over the other roots."""

    def added(j: Scalar, total: Complex) -> Complex:
        other = Complex(*(jax.lax.dynamic_index_in_dim(part, j) for part in z))
        return total + (z - other).inverse()  # zero for the root itself

    return z * jax.lax.fori_loop(0, 2 * DEGREE, added, Complex(jnp.zeros_like(z.re), jnp.zeros_like(z.im)))


def _aberth(pairs: Pairs, z: Complex) -> Complex:
    """One step of all roots (16, n): Newton's method for z^8 F in log z, each root repelled by the others."""
    f, slope = jax.jvp(lambda z: _eliminate(pairs, z), (z,), (z,))
    away = (slope.lead / f.lead).scaled(-3.0) - _repulsion(z)
    step = f.top / (slope.top + f.top * Complex(away.re + DEGREE, away.im))
    size = step.square()
    moved = z - z * step.scaled(jnp.where(size > 1, jnp.sqrt(1 / size), 1.0))
    parked = (z.square() > FAR) | (z.square() < 1 / FAR)
    return Complex(jnp.where(parked, z.re, moved.re), jnp.where(parked, z.im, moved.im))


def first_unknown(pairs: Pairs, finite: Scalar, steps: Scalar) -> Complex:
    """z1 (16, n) of all roots: of coefficients (n,) after a number of steps; those beyond `finite` (n,) are parked."""
    return jax.lax.fori_loop(0, steps, lambda _, z: _aberth(pairs, z), _starts(pairs, finite))


def others_by_elimination(pairs: Pairs, z: Complex) -> Point:
    """z2 and z3 that belong to z1, where only one pair does."""
    f = _eliminate(pairs, z)
    second = -f.last[1] / f.last[0]
    return z, second, -(f.outer[0] * second + f.outer[1]) / (f.inner[0] * second + f.inner[1])


def others_by_trial(pairs: Pairs, z: Complex) -> Point:
    """All four z2 and z3 (4 m, n) that z1 (m, n) allows, one of which the equation between them rejects or none."""
    second, third = (_both_roots(quadratic) for quadratic in quadratics(pairs, z))
    choices = [(z, two, three) for two in second for three in third]
    one, two, three = (
        Complex(*(jnp.concatenate(parts) for parts in zip(*column, strict=True))) for column in zip(*choices, strict=True)
    )
    return one, two, three


def _both_roots(quadratic: Quadratic) -> tuple[Complex, Complex]:
    square, linear, constant = (jax.lax.complex(c.re, c.im) for c in quadratic)
    root = jnp.sqrt(linear * linear - 4 * square * constant)
    root = jnp.where((jnp.conj(linear) * root).real < 0, -root, root)  # no cancellation in the sum
    half = -(linear + root) / 2
    first, second = half / square, constant / half
    return Complex(first.real, first.imag), Complex(second.real, second.imag)


class _Local(NamedTuple):
    """One equation at a point, and its first derivatives in log u and log v."""

    value: Complex
    by_first: Complex
    by_second: Complex
    size: Scalar
    """Sum of the moduli of the terms."""
    bend: Scalar
    """Bound of the second derivatives for changes of log u and log v below one."""


def _local(pair: Pair, u: Complex, v: Complex) -> _Local:
    over_u, over_v = u.inverse(), v.inverse()
    by_u, by_v = (pair.first * u, pair.first.conjugate() * over_u), (pair.second * v, pair.second.conjugate() * over_v)
    both = (pair.both * (u * v), pair.both.conjugate() * (over_u * over_v))
    apart = (pair.apart * (u * over_v), pair.apart.conjugate() * (v * over_u))
    plain, crossed = (by_u, by_v), (both, apart)
    total = Complex(pair.constant, 0.0)
    for ahead, behind in plain + crossed:
        total = total + ahead + behind
    along_both, along_apart = both[0] - both[1], apart[0] - apart[1]
    once, twice = (sum(term.modulus() for terms in group for term in terms) for group in (plain, crossed))
    return _Local(
        total,
        by_u[0] - by_u[1] + along_both + along_apart,
        by_v[0] - by_v[1] + along_both - along_apart,
        jnp.abs(pair.constant) + once + twice,
        once + 4 * twice,
    )


def _inverse(local: tuple[_Local, _Local, _Local]) -> list[list[Complex]]:
    """Inverse of the Jacobian of the three equations, whose rows are (p1, p2, 0), (0, q2, q3), (r1, 0, r3)."""
    p1, p2, q2, q3, r3, r1 = (slope for row in local for slope in (row.by_first, row.by_second))
    over = (p1 * q2 * r3 + p2 * q3 * r1).inverse()
    adjugate = [[q2 * r3, -(p2 * r3), p2 * q3], [q3 * r1, p1 * r3, -(p1 * q3)], [-(q2 * r1), p2 * r1, p1 * q2]]
    return [[entry * over for entry in row] for row in adjugate]


def _locals(pairs: Pairs, z: Point) -> tuple[_Local, _Local, _Local]:
    one, two, three = pairs
    return _local(one, z[0], z[1]), _local(two, z[1], z[2]), _local(three, z[2], z[0])


def polished(pairs: Pairs, z: Point, steps: Scalar) -> Roots:
    """Newton's method in log z from points (m, n), and what Kantorovich's theorem says of where it ends.

    The error and the reach are in the greatest of the three changes of log z.
    """

    def newton(_: Scalar, state: tuple[Point, list[Complex]]) -> tuple[Point, list[Complex]]:
        z, values = state
        moved = []
        for unknown, row in zip(z, _inverse(_locals(pairs, z)), strict=True):
            step = row[0] * values[0] + row[1] * values[1] + row[2] * values[2]
            step = step.scaled(jnp.minimum(1.0, 0.5 / (step.modulus() + _TINY)))
            moved.append(unknown - unknown * step)
        z = moved[0], moved[1], moved[2]
        return z, [row.value for row in _locals(pairs, z)]

    # The values are handed on: XLA would compute them once per unknown, each time rounded otherwise, and where the Jacobian is
    # nearly singular such steps lead off in all directions.
    z, _ = jax.lax.fori_loop(0, steps, newton, (z, [row.value for row in _locals(pairs, z)]))
    local = _locals(pairs, z)
    error, curvature = jnp.zeros(()), jnp.zeros(())
    for row in _inverse(local):
        step = row[0] * local[0].value + row[1] * local[1].value + row[2] * local[2].value
        gains = [entry.modulus() for entry in row]
        rounding = 4 * _EPSILON * sum(gain * at.size for gain, at in zip(gains, local, strict=True))
        error = jnp.maximum(error, step.modulus() + rounding)
        curvature = jnp.maximum(curvature, sum(gain * at.bend for gain, at in zip(gains, local, strict=True)))
    error = jnp.where(curvature > 0, error, jnp.inf)  # a Jacobian of determinant zero has no inverse, and got zero for it
    reach = jnp.minimum(WIDEST, math.exp(-2 * WIDEST) / curvature)
    residuals = [row.value.modulus() / row.size for row in local]
    return Roots(z, error, reach, jnp.maximum(jnp.maximum(residuals[0], residuals[1]), residuals[2]))


def isolated(roots: Roots) -> tuple[Scalar, Scalar]:
    """Flags (m, n): proved and named for the first time; and real, which is its own partner 1 / conj z within its reach."""
    proved = (8 * roots.error < roots.reach) & (roots.residual < EXACT)
    for z in roots.z:
        proved &= (z.square() < FARTHEST**2) & (z.square() > FARTHEST**-2)

    def away(z: Complex, other: Complex) -> Scalar:
        return (z - other).square() / other.square()

    def table(z: Complex) -> Scalar:
        row, column = Complex(z.re[:, None], z.im[:, None]), Complex(z.re[None], z.im[None])
        return away(row, column)

    one, two, three = (table(z) for z in roots.z)
    apart = jnp.maximum(jnp.maximum(one, two), three)
    near = jnp.maximum(roots.reach / 2, 6 * roots.error)
    earlier = np.tri(roots.error.shape[0], k=-1, dtype=bool)[:, :, None]
    same = (apart < jnp.maximum(near[:, None], near[None]) ** 2) & earlier & proved[None]
    real = jnp.ones_like(proved)
    for z in roots.z:
        real &= jnp.abs(z.square() - 1) < roots.reach / 2
    return proved & ~same.any(axis=1), proved & real
