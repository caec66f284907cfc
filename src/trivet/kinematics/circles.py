"""The three-circles problem (paper Eqs 7-9): points on three circles at given distances, all complex solutions of it.

With its actuators locked a machine of three chains holds every platform joint on a circle.  Where the joints can be, so that
the platform fits between them, are the assembly modes.  The three equations are bi-quadratic in z_i = exp(i phi_i), which has
no pole where the paper's tan(phi_i / 2) has one.  They have 16 solutions by Bernstein's theorem (the permanent of their
degrees), fewer where some lie at infinity; see `_expected`.  A problem is complete when as many solutions are proved to exist
apart from each other.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics import folds, roots
from trivet.kinematics.roots import Complex, Pair, Pairs
from trivet.space.scalar import Scalar

Array = NDArray[Any]

MOST = 16
"""Solutions of one problem."""

PAIRS = ((0, 1), (1, 2), (2, 0))

CHUNK, FEW = 256, 16
"""Problems per call of the first attempts, few enough that the work stays in a core's cache, and of the last."""

STEPS, MANY = 20, 80
"""Aberth steps that all but a few problems need, and that nearly all of these need."""

NEWTON, CREEPING = 5, 40
"""Newton steps to a simple root, and to a multiple one, which each step brings half as near."""

VANISHING = 1e-13
"""Coefficients below this, relative to what they are made of, are zero: axes are parallel within 6e-7 rad."""


COINCIDENT = 1e-7
"""A distance below this, relative to lengths of the problem, leaves the platform's turn to rounding."""


class Circles(NamedTuple):
    """Circles of n problems, with a point at centre + cos(phi) cosine + sin(phi) sine."""

    centre: Array
    """(n, 3, 3): problem, circle, component; m."""
    cosine: Array
    """(n, 3, 3) from the centre to the point at angle 0, m: as long as the radius."""
    sine: Array
    """(n, 3, 3) from the centre to the point at 90 degrees, m."""
    distance: Array
    """(n, 3) between the points on the circles 1 and 2, 2 and 3, 3 and 1, m."""


class Status(IntEnum):
    """What is known of the solutions of one problem."""

    COMPLETE = 0
    """All solutions are there."""
    INCOMPLETE = 1
    """At least one solution is missing."""
    NO_CIRCLE = 2
    """A radius is zero: an angle is arbitrary."""
    NO_TRIANGLE = 3
    """A distance is zero: two points coincide, and the platform has no frame."""
    COAXIAL = 4
    """All circles have one axis: what fits can turn about it, or nothing fits."""
    SELF_MOTION = 5
    """Infinitely many solutions: the platform moves with its actuators locked."""


@dataclass(frozen=True)
class CircleSolutions:
    """Solutions of n problems: real ones first, NaN beyond the last."""

    angle: Array
    """(n, 16, 3) complex, rad; the real part in (-pi, pi]."""
    multiplicity: Array
    """(n, 16): 1, more for a multiple root, which has one row (2 where assembly modes meet), 0 where there is no solution."""
    real: Array
    """(n, 16) proved to be real."""
    error: Array
    """(n, 16) bound of the error of the angles, rad, up to a factor 2; NaN for multiple roots, which it does not cover."""
    residual: Array
    """(n, 16) greatest residual of the equations relative to the sum of the moduli of their terms."""
    expected: Array
    """(n,) number of solutions, counted with multiplicity; 0 where it is not finite."""
    status: Array
    """(n,) values of `Status`."""

    @property
    def found(self) -> Array:
        """(n,) number of solutions found, counted with multiplicity."""
        return self.multiplicity.sum(axis=1)


def solve(circles: Circles) -> CircleSolutions:
    """All solutions, real and complex.

    Elimination, Aberth's iteration, Newton's method, Kantorovich's test (`roots`).  What is not complete then is tried again
    with more steps, then with each of the three angles in turn as the one which stays, and all its partners; what is left is
    searched for multiple roots and self-motion (`folds`).

    Args:
        circles: n problems.

    Raises:
        InputError: for wrong shapes, numbers that are not finite, negative distances, and axes which are not orthogonal and of
            equal length.
    """
    circles = _checked(circles)
    pairs = _pairs(circles)
    expected, status = _expected(circles, pairs)
    open_rows = np.flatnonzero(status == Status.INCOMPLETE)
    found = _Found.none(len(expected))
    for steps in (STEPS, MANY):
        for rows, batch in _batches(partial(_by_elimination, steps=steps), CHUNK, open_rows, pairs, expected):
            found.take(rows, batch)
        open_rows = open_rows[found.count(open_rows) < expected[open_rows]]
    for rows, batch in _batches(_by_trial, FEW, open_rows, pairs, expected):
        found.take(rows, batch)
        for k, row in enumerate(rows):
            if found.count(row) < expected[row]:
                equations, candidates = _equations(pairs, row), batch.logarithm[:, k]
                if folds.moves(equations, candidates):
                    status[row] = Status.SELF_MOTION
                else:
                    found.add_multiple(row, equations, *folds.multiple_roots(equations, candidates))
    status[(status == Status.INCOMPLETE) & (found.multiplicity.sum(axis=1) == expected)] = Status.COMPLETE
    expected[status > Status.INCOMPLETE] = 0
    found.multiplicity[status > Status.INCOMPLETE] = 0
    return found.solutions(expected, status)


def _checked(circles: Circles) -> Circles:
    checked = Circles(*(np.asarray(a, dtype=float) for a in circles))
    count = checked.distance.shape[0] if checked.distance.ndim else 0
    for name, array in checked._asdict().items():
        shape = (count, 3) if name == "distance" else (count, 3, 3)
        if array.shape != shape:
            raise InputError(f"circles.{name}: shape {array.shape}; expected {shape}")
        if not np.isfinite(array).all():
            raise InputError(f"circles.{name}: not a finite number in problem {np.argwhere(~np.isfinite(array))[0][0]}")
    if (checked.distance < 0).any():
        raise InputError(f"circles.distance: negative in problem {np.argwhere(checked.distance < 0)[0][0]}")
    long, wide = (np.einsum("nik,nik->ni", axis, axis) for axis in (checked.cosine, checked.sine))
    askew = np.abs(np.einsum("nik,nik->ni", checked.cosine, checked.sine)) + np.abs(long - wide) > 1e-12 * (long + wide)
    if askew.any():
        raise InputError(f"circles: cosine and sine are not orthogonal and equally long in problem {np.argwhere(askew)[0][0]}")
    return checked


def _pairs(circles: Circles) -> Pairs:
    """The three equations, each over the product of its radii; of a circle without radius NaN."""
    half = (circles.cosine - 1j * circles.sine) / 2  # X = c + half z + conj(half) / z, where half . half = 0
    radius = np.linalg.norm(circles.cosine, axis=2)
    made = []
    with np.errstate(divide="ignore", invalid="ignore"):
        for k, (i, j) in enumerate(PAIRS):
            offset, over = circles.centre[:, i] - circles.centre[:, j], 1 / (radius[:, i] * radius[:, j])
            a, b, far = half[:, i], half[:, j], np.linalg.norm(offset, axis=1)
            constant = _dot(offset, offset) + radius[:, i] ** 2 + radius[:, j] ** 2 - circles.distance[:, k] ** 2
            first = _split(2 * over * _dot(offset, a), 1 + far / radius[:, j])
            second = _split(-2 * over * _dot(offset, b), 1 + far / radius[:, i])
            both, apart = (_split(-2 * over * _dot(a, other), 1.0) for other in (b, b.conj()))
            made.append(Pair(constant * over, first, second, both, apart))
    return made[0], made[1], made[2]


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("nk,nk->n", a, b)


def _split(a: Array, size: Scalar) -> Complex:
    """A coefficient in parts, zero where only rounding makes it differ from that."""
    a = np.where(np.abs(a) > VANISHING * size, a, 0.0)
    return Complex(a.real, a.imag)


def _expected(circles: Circles, pairs: Pairs) -> tuple[Array, Array]:
    """Number of finite solutions (n,), and status: incomplete, or the reason why the number is not finite.

    A solution is lost to infinity where z_i and z_j grow together, or one grows as the other vanishes.  That needs a corner
    (U_i - i W_i) . (U_j -+ i W_j) which is zero, hence parallel axes, and a root z_k which the leading terms of the other two
    equations, (U_i - i W_i) . (c_i - X_k) and (U_j - i W_j) . (c_j - X_k), share: with two axes parallel they share both if
    these circles are coaxial (two roots, two ratios z_i / z_j, both ends: 8 remain), else none (16 remain).  Where all three
    axes are parallel, a triangle and its mirror image move, seen along the axes, in the plane: 6 ways each to put them on
    three circles (12), but 4 for the one that is similar to the triangle of the centres (10).
    """
    count = len(circles.distance)
    parallel = np.stack([(pair.both.square() == 0) | (pair.apart.square() == 0) for pair in pairs])
    coaxial = parallel & np.stack([(pair.first.square() == 0) & (pair.second.square() == 0) for pair in pairs])
    expected = np.full(count, MOST)
    expected[parallel.all(axis=0)] = 12
    expected[parallel.all(axis=0) & _similar(circles)] = 10
    expected[coaxial.any(axis=0)] = 8
    radius = np.linalg.norm(circles.cosine, axis=2)
    scale = np.maximum(radius.max(axis=1), circles.distance.max(axis=1)) + np.ptp(circles.centre, axis=1).max(axis=1)
    status = np.full(count, int(Status.INCOMPLETE))
    status[coaxial.sum(axis=0) > 1] = Status.COAXIAL
    status[circles.distance.min(axis=1) <= COINCIDENT * scale] = Status.NO_TRIANGLE
    status[radius.min(axis=1) <= VANISHING * scale] = Status.NO_CIRCLE
    return expected, status


def _similar(circles: Circles) -> Array:
    """Whether the triangles of the centres and of the points are similar (n,), seen along the axis of the first circle."""
    axis = np.cross(circles.cosine[:, 0], circles.sine[:, 0])
    sides = np.stack([circles.centre[:, i] - circles.centre[:, j] for i, j in PAIRS])
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.einsum("knj,nj->kn", sides, axis) / np.linalg.norm(axis, axis=1)
        base, top = np.einsum("knj,knj->kn", sides, sides) - along**2, circles.distance.T**2 - along**2
        ratio = top / base
        return np.asarray(np.ptp(ratio, axis=0) < 1e-12 * np.abs(ratio).max(axis=0))


class _Batch(NamedTuple):
    """What one call brought: points (m, k), problems last."""

    logarithm: Array
    """(m, k, 3) complex."""
    error: Array
    residual: Array
    proved: Array
    real: Array


@jax.jit
def _eliminated(pairs: Pairs, expected: Scalar, steps: Scalar) -> roots.Point:
    return roots.others_by_elimination(pairs, roots.first_unknown(pairs, expected, steps))


@jax.jit
def _tried(pairs: Pairs, expected: Scalar, steps: Scalar) -> roots.Point:
    return roots.others_by_trial(pairs, roots.first_unknown(pairs, expected, steps))


@jax.jit
def _settled(pairs: Pairs, z: roots.Point, steps: Scalar) -> tuple[roots.Roots, Scalar, Scalar]:
    found = roots.polished(pairs, z, steps)
    return found, *roots.isolated(found)


def _by_elimination(pairs: Pairs, expected: Scalar, steps: int) -> tuple[roots.Roots, Scalar, Scalar]:
    return _settled(pairs, _eliminated(pairs, expected, steps), NEWTON)


def _by_trial(pairs: Pairs, expected: Scalar) -> tuple[roots.Roots, Scalar, Scalar]:
    """With each unknown in turn as the one which stays, all partners of its roots, and the conjugates of all."""
    columns: list[list[Complex]] = [[], [], []]
    for shift in range(3):
        for k, z in enumerate(_tried(pairs[shift:] + pairs[:shift], expected, MANY)):
            columns[(k + shift) % 3] += [z, z.conjugate().inverse()]
    one, two, three = (Complex(*(np.concatenate(parts) for parts in zip(*column, strict=True))) for column in columns)
    return _settled(pairs, (one, two, three), CREEPING)


Attempt = Callable[[Pairs, Scalar], tuple[roots.Roots, Scalar, Scalar]]


def _batches(attempt: Attempt, size: int, rows: Array, pairs: Pairs, expected: Array) -> Iterator[tuple[Array, _Batch]]:
    """Attempts on problems, always as many per call (the last one again and again), one call per core."""

    def work(start: int) -> tuple[Array, _Batch]:
        chunk = rows[start : start + size]
        index = np.pad(chunk, (0, size - len(chunk)), mode="edge")
        found, proved, real = attempt(jax.tree.map(lambda a: a[index], pairs), expected[index].astype(float))
        keep = slice(len(chunk))
        z = np.stack([np.asarray(a.re) + 1j * np.asarray(a.im) for a in found.z], axis=2)
        with np.errstate(all="ignore"):
            logarithm = np.log(z)
        return chunk, _Batch(logarithm[:, keep], *(np.asarray(a)[:, keep] for a in (found.error, found.residual, proved, real)))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from pool.map(work, range(0, len(rows), size))


@dataclass(frozen=True)
class _Found:
    """Solutions found so far, (n, 16)."""

    logarithm: Array
    multiplicity: Array
    real: Array
    error: Array
    residual: Array

    @classmethod
    def none(cls, count: int) -> _Found:
        shape = (count, MOST)
        nothing = np.full(shape, np.nan)
        logarithm = np.full((*shape, 3), complex(np.nan, np.nan))
        return cls(logarithm, np.zeros(shape, dtype=int), np.zeros(shape, dtype=bool), nothing, nothing.copy())

    def count(self, rows: Any) -> Array:
        return self.multiplicity[rows].sum(axis=-1)

    def take(self, rows: Array, batch: _Batch) -> None:
        """The proved points of a batch, real ones first."""
        order = np.argsort(2 * ~batch.proved + ~batch.real, axis=0, kind="stable")[:MOST]
        proved = np.take_along_axis(batch.proved, order, 0).T
        self.multiplicity[rows] = proved
        self.real[rows] = np.take_along_axis(batch.real, order, 0).T & proved
        for own, new in ((self.error, batch.error), (self.residual, batch.residual)):
            own[rows] = np.where(proved, np.take_along_axis(new, order, 0).T, np.nan)
        logarithm = np.take_along_axis(batch.logarithm, order[:, :, None], 0).swapaxes(0, 1)
        self.logarithm[rows] = np.where(proved[:, :, None], logarithm, np.nan)

    def add_multiple(self, row: int, equations: folds.Equations, points: Array, multiplicity: Array) -> None:
        """Multiple roots of one problem, after the simple ones."""
        first = self.count(row)
        for k, w, times in zip(range(first, MOST), points, multiplicity, strict=False):
            self.logarithm[row, k], self.multiplicity[row, k] = w, times
            self.real[row, k] = np.abs(w.real).max() < folds.NEAR
            self.residual[row, k] = np.abs(equations.scaled(w[None])[0]).max()

    def solutions(self, expected: Array, status: Array) -> CircleSolutions:
        """As angles; NaN where there is none."""
        there = self.multiplicity > 0
        angle = np.where(self.real[:, :, None], self.logarithm.imag, -1j * self.logarithm)
        angle = np.where(there[:, :, None], angle, complex(np.nan, np.nan))
        error, residual = (np.where(there, a, np.nan) for a in (self.error, self.residual))
        return CircleSolutions(angle, self.multiplicity, self.real & there, error, residual, expected, status)


def _equations(pairs: Pairs, row: int) -> folds.Equations:
    coefficient, exponent = np.zeros((3, 9), dtype=complex), np.zeros((3, 9, 3))
    for k, (pair, (i, j)) in enumerate(zip(pairs, PAIRS, strict=True)):
        coefficient[k, 0] = pair.constant[row]
        for t, (part, along) in enumerate(zip(pair[1:], ((1, 0), (0, 1), (1, 1), (1, -1)), strict=True)):
            value = complex(part.re[row], part.im[row])
            coefficient[k, 1 + 2 * t : 3 + 2 * t] = value, value.conjugate()
            exponent[k, 1 + 2 * t, [i, j]] = along
            exponent[k, 2 + 2 * t, [i, j]] = -np.array(along)
    return folds.Equations(coefficient, exponent)
