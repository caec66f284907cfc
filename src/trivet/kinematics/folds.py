"""Where the solutions of the three-circles problem are not isolated simple points: double roots and self-motion.

One problem at a time, for the few that need it; unknowns are w = log z = i phi.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

DOUBLE = 1e-12
"""How far from zero, relative to the terms of the equations, their value at a fold may be: two roots nearer to each other than
this makes them are told apart by rounding only."""

SINGULAR = 1e-5
"""Ratio of singular values of the Jacobian below which a root may be multiple; a double root is found to about 1e-8."""

NEAR = 1e-6
"""Distance in log z below which two double roots are one, and a double root is its own partner 1 / conj z."""

ARC = (0.05, 0.1)
"""Steps along a self-motion, rad."""


class Equations(NamedTuple):
    """Three sums of nine exponentials each."""

    coefficient: Array
    """(3, 9) complex."""
    exponent: Array
    """(3, 9, 3) of w1, w2, w3: -1, 0 or 1."""

    def terms(self, w: Array) -> Array:
        """(m, 3, 9) at points (m, 3)."""
        return self.coefficient * np.exp(np.einsum("etj,mj->met", self.exponent, w))

    def scaled(self, w: Array) -> tuple[Array, Array, Array]:
        """Values (m, 3), Jacobians (m, 3, 3) and second derivatives (m, 3, 3, 3), over the sums of moduli of the terms."""
        terms = self.terms(w)
        terms = terms / np.abs(terms).sum(axis=2, keepdims=True)
        slopes = np.einsum("met,etj->mej", terms, self.exponent)
        bends = np.einsum("met,etj,etk->mejk", terms, self.exponent, self.exponent)
        return terms.sum(axis=2), slopes, bends


def double_roots(equations: Equations, w: Array) -> Array:
    """Double roots (k, 3) near points (m, 3), each once.

    A fold of the unfolded equations f + mu b = 0 with J v = 0 is a simple root in (w, v, mu), whatever f(w) = 0 has there
    (Griewank and Reddien, SIAM J. Numer. Anal. 21, 1984, 176-185); it is a double root of f where mu vanishes.
    """
    w = w[_is_singular(equations, w)]
    if not len(w):
        return w
    start = w
    left, _, right = np.linalg.svd(equations.scaled(w)[1])
    b, normal = left[:, :, 2], right[:, 2]
    v, mu = normal.conj(), np.zeros(len(w), dtype=complex)
    for _ in range(12):
        f, jacobian, bends = equations.scaled(w)
        system = np.zeros((len(w), 7, 7), dtype=complex)
        system[:, :3, :3], system[:, :3, 6] = jacobian, b
        system[:, 3:6, :3], system[:, 3:6, 3:6] = np.einsum("mejk,mk->mej", bends, v), jacobian
        system[:, 6, 3:6] = normal
        gap = np.concatenate(
            [f + mu[:, None] * b, np.einsum("mej,mj->me", jacobian, v), (np.einsum("mj,mj->m", normal, v) - 1)[:, None]], axis=1
        )
        step = np.einsum("mab,mb->ma", np.linalg.pinv(system, rcond=1e-12), gap)
        w, v, mu = w - step[:, :3], v - step[:, 3:6], mu - step[:, 6]
    _, _, bends = equations.scaled(w)
    curvature = np.abs(np.einsum("me,mejk,mj,mk->m", b.conj(), bends, v, v))
    settled = np.abs(step).max(axis=1) < 1e-9
    good = settled & (np.abs(mu) < DOUBLE) & (curvature > 1e-4) & (np.abs(w - start).max(axis=1) < 1e-2)
    return distinct(w[good], NEAR)


def moves(equations: Equations, w: Array) -> bool:
    """Whether a curve of solutions passes through one of the points (m, 3): a self-motion."""
    w = w[_is_singular(equations, w)]
    if not len(w):
        return False
    direction = np.linalg.svd(equations.scaled(w)[1])[2][:, 2]
    follows = np.ones(len(w), dtype=bool)
    for length in ARC:
        at = w + length * direction.conj()
        for _ in range(12):
            f, jacobian, _ = equations.scaled(at)
            along = np.einsum("mj,mj->m", direction, at - w) - length
            rows = np.concatenate([jacobian, direction[:, None]], axis=1)
            gap = np.concatenate([f, along[:, None]], axis=1)
            at = at - np.einsum("mab,mb->ma", np.linalg.pinv(rows, rcond=1e-9), gap)
        with np.errstate(all="ignore"):
            f = equations.scaled(at)[0]
        follows &= (np.abs(f).max(axis=1) < DOUBLE) & (np.abs(np.einsum("mj,mj->m", direction, at - w) - length) < 1e-9)
    return bool(follows.any())


def distinct(w: Array, radius: float) -> Array:
    """Of points (m, 3) those that are farther than a radius from all before them, angles modulo a turn."""
    kept: list[Array] = []
    for point in w:
        if all(distance(point, other) > radius for other in kept):
            kept.append(point)
    return np.array(kept).reshape(-1, 3)


def distance(w: Array, other: Array) -> float:
    """Greatest difference of log z, angles modulo a turn."""
    apart = w - other
    turn = 2 * np.pi
    return float(np.abs(apart.real + 1j * (apart.imag - turn * np.round(apart.imag / turn))).max())


def _is_singular(equations: Equations, w: Array) -> Array:
    with np.errstate(all="ignore"):
        f, jacobian, _ = equations.scaled(w)
        fit = np.isfinite(w).all(axis=1) & (np.abs(f).max(axis=1) < 1e-9)
    values = np.linalg.svd(np.where(fit[:, None, None], jacobian, 0.0), compute_uv=False)
    return fit & (values[:, 2] < SINGULAR * values[:, 0])
