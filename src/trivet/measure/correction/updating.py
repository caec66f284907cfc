"""Numbers of a machine corrected by what was measured: log|H| and poles, weighed against what was known beforehand.

Wanted is the theta (`measure.machine.parameters`) at which the sum of squares of

    (ln|H_measured| - ln|H|) / s          at every frequency of every function (near nought with a floor beneath),
    (ln f_measured - ln f) / s_f,  (ln zeta_measured - ln zeta) / s_zeta          of every measured pole that the machine has,
    (theta - theta beforehand) / spread

is least: the most probable theta where all are normal.  What s is, the residuals say.  A machine and its model differ by more
than noise; their difference at one frequency is that at the next, and in one function that in others.  So s contains the root
of the number of lines, and of functions, over which residuals are alike; else a measurement would count for more the finer its
lines and the more its sensors are.  Far residuals (zeros of the response,
which move with anything) count less (Huber, Annals of Mathematical Statistics 35:73, 1964).

The poles go first and bring resonances together; log|H| alone has minima where one resonance meets another.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize

from trivet.errors import NoResultError
from trivet.measure.correction.terms import (
    HUBER,
    Problem,
    Residuals,
    Term,
    beforehand,
    is_seen,
    of_poles,
    of_responses,
    scaled,
)
from trivet.measure.machine.parameters import Parameters

FIRST_SPREAD = 0.5
"""s, before there are residuals: ln of a factor of 1.6."""
LEAST_SPREAD = 1e-3
"""s at the least: no instrument is calibrated better."""
ROUNDS = 6
"""Rounds in which s is found anew."""
SETTLED = 0.02
"""Relative change of s that ends the rounds."""


@dataclass(frozen=True)
class Updated:
    """The most probable theta."""

    theta: np.ndarray
    """(p,)"""
    information: np.ndarray
    """(p, p) of the measurements alone: J^T J."""
    spread: float
    """s without what residuals that are alike add: standard deviation of ln|H_measured| - ln|H|."""
    lines_alike: float
    """Lines over which residuals are alike."""
    functions_alike: float
    """Functions in which they are."""
    steps: int
    """Of the search: thetas at which residuals and slopes were worked out after the first."""

    @property
    def alike(self) -> float:
        """Residuals that count as one."""
        return self.lines_alike * self.functions_alike

    def covariance(self, free: Parameters) -> np.ndarray:
        """(p, p) of theta, with what was known beforehand."""
        whole: np.ndarray = np.linalg.inv(self.information + np.diag(1 / free.spread**2))
        return whole


class _Search:
    """Searches one after another, their steps counted."""

    def __init__(self, free: Parameters, progress: Callable[[int], None]) -> None:
        self.free, self.progress, self.steps = free, progress, 0

    def least(self, terms: tuple[Term, ...], start: np.ndarray) -> np.ndarray:
        """The theta at which the sum of squares of all terms, and of what was known beforehand, is least."""
        own = (*terms, beforehand(self.free))

        def values(theta: np.ndarray) -> np.ndarray:
            self.steps += not np.array_equal(theta, start)
            self.progress(self.steps)
            return joined(own, theta).values

        answer: Any = scipy.optimize.least_squares(
            values, start, lambda theta: joined(own, theta).slopes, bounds=tuple(self.free.bounds), x_scale=self.free.spread
        )
        if not answer.success or not np.all(np.isfinite(answer.x)):
            raise NoResultError(f"updating: the search came to no end after {self.steps} steps ({answer.message})")
        found: np.ndarray = answer.x
        return found


def joined(terms: tuple[Term, ...], theta: np.ndarray) -> Residuals:
    """Residuals of all terms, one after another."""
    values, slopes = zip(*(term(theta) for term in terms), strict=True)
    return Residuals(np.concatenate(values), np.concatenate(slopes))


def updated(problem: Problem, progress: Callable[[int], None] = lambda count: None) -> Updated:
    """The most probable theta.

    Raises:
        InputError: for a measurement whose logarithm is no number.
        NoResultError: the search comes to no end, or leads where the machine does not stand.
    """
    search, apart = _Search(problem.free, progress), of_responses(problem)
    poles = () if problem.poles is None else (of_poles(problem, problem.poles),)
    theta = problem.free.theta(problem.free.start)
    if poles:
        theta = search.least(poles, theta)
    spread, lines, functions = FIRST_SPREAD, 1.0, 1.0
    for _ in range(ROUNDS):
        last = spread * math.sqrt(lines * functions)
        theta = search.least((scaled(apart, spread, lines * functions), *poles), theta)
        shown = np.where(is_seen(problem.functions), apart(theta).values.reshape(len(problem.functions), -1), np.nan)
        spread, lines = max(LEAST_SPREAD, robust_spread(shown)), lines_alike(shown)
        functions = functions_alike(shown, lines)
        if abs(spread * math.sqrt(lines * functions) / last - 1) < SETTLED:
            break
    slopes = joined((scaled(apart, spread, lines * functions), *poles), theta).slopes
    return Updated(theta, slopes.T @ slopes, spread, lines, functions, search.steps)


def robust_spread(apart: np.ndarray) -> float:
    """Standard deviation of normal numbers about zero that has the same median absolute value; NaN do not count."""
    return float(np.nanmedian(np.abs(apart)) / 0.6744897501960817)


def _clipped(apart: np.ndarray) -> np.ndarray:
    """Residuals (q, n), far ones at the limit, unknown ones nought."""
    limit = HUBER * robust_spread(apart)
    found: np.ndarray = np.nan_to_num(np.clip(apart, -limit, limit))
    return found


def functions_alike(apart: np.ndarray, lines: float) -> float:
    """Functions in which residuals (q, n) are alike, some lines being so: the mean square of the eigenvalues of their matrix of
    correlations, which is 1 where all are independent and q where they are the same, less what chance puts there (Bretherton et
    al., Journal of Climate 12:1990, 1999)."""
    own = _clipped(apart)
    size = np.linalg.norm(own, axis=1)
    own = own[size > 0] / size[size > 0, None]
    squares, count, independent = (own @ own.T) ** 2, len(own), max(1.0, apart.shape[1] / lines)
    if count < 2 or independent < 2:
        return float(max(1, count))
    chance = 1 / independent
    excess = max(0.0, float(squares.sum()) - count - count * (count - 1) * chance) / (1 - chance)
    return 1 + excess / count


def lines_alike(apart: np.ndarray) -> float:
    """Lines over which residuals (q, n) are alike, NaN apart: 1 + 2 times the sum of their autocorrelations, as long as these
    fall and are above zero (Geyer, Statistical Science 7:473, 1992)."""
    n = apart.shape[1]
    transform = np.fft.rfft(_clipped(apart), 2 * n, axis=1)
    power = np.fft.irfft(np.abs(transform) ** 2, axis=1)[:, :n].sum(axis=0)
    if not power[0] > 0:
        return 1.0
    correlation = power / power[0]
    pairs = correlation[: 2 * (n // 2)].reshape(-1, 2).sum(axis=1)
    ends = np.nonzero(pairs <= 0)[0]
    falling = np.minimum.accumulate(pairs[: ends[0] if len(ends) else len(pairs)])
    return float(max(1.0, 2 * falling.sum() - 1))
