"""Poles and participation vectors from measured responses: the poly-reference least-squares complex frequency estimator.

Guillaume, Verboven, Vanlanduit, Van der Auweraer, Peeters, "A poly-reference implementation of the least-squares complex
frequency-domain estimator", IMAC XXI, 2003; Peeters, Van der Auweraer, Guillaume, Leuridan, "The PolyMAX frequency-domain
method", Shock and Vibration 11 (2004) 395.  One reference makes it the common-denominator estimator.

Every response is a row of numerators over one matrix of denominators, H_o = B_o(x) A(x)^-1, polynomials in x = exp(-j theta)
with complex coefficients, theta rising by `CIRCLE` of a turn from the lower end of the band to the upper one.  A's highest
coefficient is the identity: least squares then puts the roots that only noise asks for where poles are unstable, and the stable
ones are those of the structure.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np
import scipy.linalg

CIRCLE = 0.9
"""Part of the circle that the band takes: what is left lets the ends of the band differ."""
EVEN = 1e-6
"""How far spacings of frequencies may differ, as a part of the spacing, for a fast Fourier transform to be right."""
_RIDGE = 1e-13


class OrderPoles(NamedTuple):
    """What a model of one order has."""

    order: int
    """Degree of the denominators: every reference brings so many poles."""
    poles: np.ndarray
    """(r,) rad/s, stable and unstable ones, of positive frequency or not."""
    participation: np.ndarray
    """(r, i) of the references, unit vectors."""


class NormalEquations(NamedTuple):
    """Of all orders at once."""

    numerator: np.ndarray
    """(o, p + 1, (p + 1) i): responses times denominators on orthonormal numerators; row k is new in the model of order k."""
    denominator: np.ndarray
    """((p + 1) i, (p + 1) i)"""
    lowest: float
    """rad/s at x = 1."""
    delay: float
    """s, theta over rad/s."""


def estimate(omega: np.ndarray, values: np.ndarray, highest: int) -> list[OrderPoles]:
    """Poles of the models of orders 1 to the highest.

    Args:
        omega: (n,) rad/s, rising; evenly spaced ones are worked out by fast Fourier transforms.
        values: (o, i, n) complex, of o responses to i references: any of receptance, mobility, accelerance.
        highest: order, at most a third of the number of frequencies is of use.
    """
    equations = normal_equations(omega, values, highest)
    references, rest = values.shape[1], equations.denominator.copy()
    found = []
    for order in range(highest + 1):
        fresh = equations.numerator[:, order]
        rest -= fresh.conj().T @ fresh
        if order:
            found.append(_solved(equations, rest, order, references))
    return found


def normal_equations(omega: np.ndarray, values: np.ndarray, highest: int) -> NormalEquations:
    """The sums over frequencies, each response scaled to its root mean square."""
    size = np.sqrt(np.mean(np.abs(values) ** 2, axis=(1, 2), keepdims=True))
    scaled = values / np.where(size > 0, size, 1)
    outputs, references, lines = values.shape
    turn = math.ceil(lines / CIRCLE)
    delay = 2 * math.pi * (lines - 1) / (turn * (omega[-1] - omega[0]))
    sums = _Sums(omega, delay, turn, highest)
    plain = sums.of(np.ones((1, lines)))[0]
    single = sums.of(scaled.reshape(-1, lines)).reshape(outputs, references, -1)
    double = sums.of(np.einsum("oan,obn->abn", scaled.conj(), scaled).reshape(-1, lines))
    lag = highest + np.subtract.outer(np.arange(highest + 1), np.arange(highest + 1))
    gram = plain[lag]
    gram[np.diag_indices_from(gram)] *= 1 + _RIDGE
    root = np.linalg.cholesky(gram)
    across = np.transpose(single[:, :, lag], (2, 0, 3, 1)).reshape(highest + 1, -1)
    solved = scipy.linalg.solve_triangular(root, across, lower=True, check_finite=False)
    blocks = np.transpose(double.reshape(references, references, -1)[:, :, lag], (2, 0, 3, 1))
    return NormalEquations(
        np.moveaxis(solved.reshape(highest + 1, outputs, -1), 0, 1),
        blocks.reshape(((highest + 1) * references,) * 2),
        float(omega[0]),
        delay,
    )


class _Sums:
    """Sums of values times exp(j m theta) over the frequencies, of lags m from -p to p."""

    def __init__(self, omega: np.ndarray, delay: float, turn: int, highest: int) -> None:
        self.lags = np.arange(-highest, highest + 1)
        self.turn = turn
        spacing = np.diff(omega)
        self.is_even = bool(np.ptp(spacing) <= EVEN * spacing.mean()) and turn > 2 * highest
        self.theta = (omega - omega[0]) * delay

    def of(self, values: np.ndarray) -> np.ndarray:
        """(q, 2 p + 1) of (q, n)."""
        if self.is_even:
            whole: np.ndarray = np.fft.ifft(values, self.turn, axis=-1)[:, self.lags] * self.turn
            return whole
        return values @ np.exp(1j * np.outer(self.theta, self.lags))


def _solved(equations: NormalEquations, rest: np.ndarray, order: int, references: int) -> OrderPoles:
    """Roots of the denominator of an order, with the left null vectors there."""
    size = order * references
    own, right = rest[:size, :size], -rest[:size, size : size + references]
    try:
        factor = scipy.linalg.cho_factor(own, lower=True, check_finite=False)
        coefficients = scipy.linalg.cho_solve(factor, right, check_finite=False)
    except np.linalg.LinAlgError:  # without noise a high order fits to the last digit
        coefficients = np.linalg.lstsq(own, right, rcond=None)[0]
    companion = np.eye(size, k=references, dtype=complex)
    companion[-references:] = -coefficients.T
    if references == 1:
        roots, vectors = np.linalg.eigvals(companion), np.ones((1, size), dtype=complex)
    else:
        roots, states = np.linalg.eig(companion)
        vectors = states[:references]
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = CIRCLE * math.pi
        turned = np.log(roots * cmath.exp(1j * middle)) - 1j * middle
        poles = 1j * equations.lowest - turned / equations.delay
        unit = vectors / np.linalg.norm(vectors, axis=0)
    kept = np.isfinite(poles) & np.all(np.isfinite(unit), axis=0)
    return OrderPoles(order, poles[kept], unit.T[kept])
