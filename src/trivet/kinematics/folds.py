"""Where the solutions of the three-circles problem are not isolated simple points: double roots and self-motion.

One problem at a time, for the few that need it; unknowns are w = log z = i phi.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

EQUAL = 1e-12
"""Greatest residual of a multiple root, relative to the terms of the equations; nearer roots only rounding tells apart."""

SINGULAR = 1e-5
"""Singular values of the Jacobian below this, relative to the terms of the equations, count as zero where roots meet; Newton's
method comes as near as 1e-8 to a multiple root."""

WIDEST = 7.0
"""Greatest real part of log z of a point to be examined; towards infinity the equations are flat whatever they are."""

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


def multiple_roots(equations: Equations, w: Array) -> tuple[Array, Array]:
    """Multiple roots (k, 3) near points (m, 3), each once, and their multiplicities (k,).

    Where the Jacobian J of three equations loses k ranks, the multiplicity is at least 2^k.  To such a point Newton's method
    creeps; with the unknown null vector B l of J, B of one column more than J has ranks, the root of (f, J B l) is simple
    again (Leykin, Verschelde and Zhao, Theor. Comput. Sci. 359, 2006, 111-122).
    """
    ranks = _ranks(equations, w)
    found, multiplicity = [], []
    for rank in range(3):
        points = _deflated(equations, w[ranks == rank], rank)
        found.append(points)
        multiplicity += len(points) * [2 ** (3 - rank)]
    return np.concatenate(found), np.array(multiplicity, dtype=int)


def _deflated(equations: Equations, w: Array, rank: int) -> Array:
    """Points at which the equations vanish and the Jacobian has a rank, near points (m, 3)."""
    if not len(w):
        return w
    mixed = np.random.default_rng(0).normal(size=(4, 4, 2)) @ (1, 1j)
    columns, normal = mixed[:3, : rank + 1], mixed[3, : rank + 1]
    start, size = w, 4 + rank
    inner = np.linalg.svd(equations.scaled(w)[1] @ columns)[2][:, -1].conj()
    inner = inner / (inner @ normal)[:, None]
    for _ in range(12):
        f, jacobian, bends = equations.scaled(w)
        null = inner @ columns.T
        system = np.zeros((len(w), 7, size), dtype=complex)
        system[:, :3, :3] = jacobian
        system[:, 3:6, :3], system[:, 3:6, 3:] = np.einsum("mejk,mk->mej", bends, null), jacobian @ columns
        system[:, 6, 3:] = normal
        gap = np.concatenate([f, np.einsum("mej,mj->me", jacobian, null), (inner @ normal - 1)[:, None]], axis=1)
        step = _bounded(np.einsum("mab,mb->ma", np.linalg.pinv(system, rcond=1e-12), gap))
        w, inner = w - step[:, :3], inner - step[:, 3:]
    good = (np.abs(gap).max(axis=1) < EQUAL) & (np.abs(step).max(axis=1) < 1e-9) & (np.abs(w - start).max(axis=1) < 1e-2)
    return distinct(w[good & (_ranks(equations, w) == rank)], NEAR)


def moves(equations: Equations, w: Array) -> bool:
    """Whether a curve of solutions passes through one of the points (m, 3): a self-motion."""
    w = w[_ranks(equations, w) == 2]
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
            at = at - _bounded(np.einsum("mab,mb->ma", np.linalg.pinv(rows, rcond=1e-9), gap))
        f = equations.scaled(at)[0]
        follows &= (np.abs(f).max(axis=1) < EQUAL) & (np.abs(np.einsum("mj,mj->m", direction, at - w) - length) < 1e-9)
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


def _bounded(step: Array) -> Array:
    """Steps (m, k) of at most 0.1, so that none that goes astray overflows."""
    return step / np.maximum(1.0, np.abs(step).max(axis=1, keepdims=True) / 0.1)


def _ranks(equations: Equations, w: Array) -> Array:
    """Rank of the Jacobian at points (m, 3) that are nearly solutions; -1 at others."""
    with np.errstate(all="ignore"):
        fit = np.abs(w.real).max(axis=1) < WIDEST
        near = np.where(fit[:, None], w, 0.0)
        f, jacobian, _ = equations.scaled(near)
    values = np.linalg.svd(jacobian, compute_uv=False)
    return np.where(fit & (np.abs(f).max(axis=1) < 1e-9), (values > SINGULAR).sum(axis=1), -1)
