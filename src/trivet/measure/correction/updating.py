"""Numbers of a machine corrected by what was measured: log|H| and poles, weighed against what was known beforehand.

Wanted is the theta (`measure.parameters`) at which the sum of squares of

    (ln|H_measured| - ln|H|) / s          at every frequency of every function (near nought with a floor beneath),
    (ln f_measured - ln f) / s_f,  (ln zeta_measured - ln zeta) / s_zeta          of every measured pole that the machine has,
    (theta - theta beforehand) / spread

is least: the most probable theta where all are normal.  What s is, the residuals say.  A machine and its model differ by more
than noise, and their difference at one frequency is that at the next, so s contains the root of the number of lines over which
residuals are alike; else a measurement would count for more the finer its lines are.  Far residuals (zeros of the response,
which move with anything) count less (Huber, Annals of Mathematical Statistics 35:73, 1964).

The poles go first and bring resonances together; log|H| alone has minima where one resonance meets another.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.optimize

from trivet.errors import NoResultError
from trivet.measure.correlation import assigned
from trivet.measure.functions import Functions
from trivet.measure.machine.modes import modes_of, poles_of
from trivet.measure.machine.parameters import Parameters
from trivet.measure.machine.predicted import Model, Slopes
from trivet.measure.machine.setup import Placed
from trivet.measure.modal.fitted import FittedModes
from trivet.model import Machine

FREQUENCY_ERROR = 0.01
"""s_f: relative error of natural frequencies that a model of beams and springs may have."""
DAMPING_ERROR = 0.3
"""s_zeta: relative error of damping ratios."""
FIRST_SPREAD = 0.5
"""s, before there are residuals: ln of a factor of 1.6."""
FLOOR = 1e-3
"""Responses below so much of the greatest of their kind at the same frequency count as this: what is nought in a machine by its
symmetry is small in a real one, and the logarithm of nought says nothing."""
LEAST_SPREAD = 1e-3
"""s at the least: no instrument is calibrated better."""
HUBER = 1.5
"""Residuals beyond so many s count by their size, not by their square."""
ROUNDS = 6
"""Rounds in which s is found anew."""
SETTLED = 0.02
"""Relative change of s that ends the rounds."""


class Problem(NamedTuple):
    """What is to be explained, and by what."""

    placed: Placed
    functions: Functions
    free: Parameters
    poles: FittedModes | None
    """Modes that were fitted, with shapes at placed channels."""
    loss_factor: float
    model: Model

    @property
    def machine(self) -> Machine:
        """The machine as its file says."""
        return self.placed.machine

    def at(self, theta: np.ndarray) -> tuple[Machine, float]:
        """The machine and the loss factor of the analysis with some theta."""
        machine, loss = self.free.applied(self.machine, self.loss_factor, theta)
        return machine, float(loss)


@dataclass(frozen=True)
class Updated:
    """The most probable theta."""

    theta: np.ndarray
    """(p,)"""
    information: np.ndarray
    """(p, p) of the measurements alone: J^T J."""
    spread: float
    """s without what residuals that are alike add: standard deviation of ln|H_measured| - ln|H|."""
    alike: float
    """Lines over which residuals are alike."""
    order: np.ndarray | None
    """(m,) which mode of the machine each measured pole is."""
    evaluations: int

    def covariance(self, free: Parameters) -> np.ndarray:
        """(p, p) of theta, with what was known beforehand."""
        whole: np.ndarray = np.linalg.inv(self.information + np.diag(1 / free.spread**2))
        return whole


class _Residuals:
    """Residuals and slopes of the sum of squares, the last ones kept."""

    def __init__(self, problem: Problem, scale: float, with_functions: bool) -> None:
        self.problem, self.scale, self.with_functions = problem, scale, with_functions
        self.count = 0
        self._theta: np.ndarray | None = None
        self._found: tuple[np.ndarray, np.ndarray] | None = None
        self.order: np.ndarray | None = None

    def both(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (r,), each over its s, and slopes (r, p); what was known beforehand comes last, log|H| first."""
        if self._theta is not None and np.array_equal(theta, self._theta) and self._found is not None:
            return self._found
        self.count += 1
        values, slopes = [], []
        if self.with_functions:
            apart, own = log_residuals(self.problem, theta)
            value, slope = _huber(apart / self.scale)
            values.append(value)
            slopes.append((slope / self.scale)[:, None] * own)
        if self.problem.poles is not None:
            apart, own = self._of_poles(theta, self.problem.poles)
            values.append(apart)
            slopes.append(own)
        spread = self.problem.free.spread
        values.append((theta - self.problem.free.theta(self.problem.free.start)) / spread)
        slopes.append(np.diag(1 / spread))
        self._theta, self._found = theta.copy(), (np.concatenate(values), np.concatenate(slopes))
        return self._found

    def _of_poles(self, theta: np.ndarray, poles: FittedModes) -> tuple[np.ndarray, np.ndarray]:
        problem = self.problem
        machine, loss = problem.at(theta)
        frequency, damping, _ = poles.modes
        found = modes_of(problem.placed, machine, loss, float(frequency.max()), poles.channels)
        _, self.order, _ = assigned(poles.modes, found.as_set)
        own = poles_of(problem.placed, problem.machine, problem.loss_factor, problem.free, theta, found, self.order)
        over = 1 / np.repeat([FREQUENCY_ERROR, DAMPING_ERROR], len(frequency))
        return over * (own.values - np.log(np.concatenate([frequency, damping]))), over[:, None] * own.slopes


def updated(problem: Problem, progress: Callable[[int], None] = lambda count: None) -> Updated:
    """The most probable theta.

    Raises:
        NoResultError: the search comes to no end, or leads where the machine does not stand.
    """
    theta = problem.free.theta(problem.free.start)
    count = 0

    def step(residuals: _Residuals, start: np.ndarray) -> np.ndarray:
        nonlocal count

        def values(theta: np.ndarray) -> np.ndarray:
            found = residuals.both(theta)[0]
            progress(count + residuals.count)
            return found

        answer: Any = scipy.optimize.least_squares(
            values, start, lambda t: residuals.both(t)[1], bounds=tuple(problem.free.bounds), x_scale=problem.free.spread
        )
        count += residuals.count
        if not answer.success or not np.all(np.isfinite(answer.x)):
            raise NoResultError(f"updating: the search came to no end after {count} evaluations ({answer.message})")
        found: np.ndarray = answer.x
        return found

    if problem.poles is not None:
        theta = step(_Residuals(problem, 1.0, with_functions=False), theta)
    scale = spread = FIRST_SPREAD
    alike = 1.0
    for _ in range(ROUNDS):
        residuals = _Residuals(problem, scale, with_functions=True)
        theta = step(residuals, theta)
        apart, _ = log_residuals(problem, theta)
        apart = np.where(is_seen(problem.functions), apart.reshape(len(problem.functions), -1), np.nan)
        spread = max(LEAST_SPREAD, robust_spread(apart))
        alike = alike_over(apart)
        last, scale = scale, spread * math.sqrt(alike)
        if abs(scale / last - 1) < SETTLED:
            break
    residuals = _Residuals(problem, scale, with_functions=True)
    _, slopes = residuals.both(theta)
    own = slopes[: -len(theta)]
    return Updated(theta, own.T @ own, spread, alike, residuals.order, count)


def log_residuals(problem: Problem, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ln|H| - ln|H_measured| (q n,), function after function, and slopes (q n, p)."""
    found = problem.model.slopes(problem.machine, problem.loss_factor, problem.free, theta)
    measured, under = np.abs(problem.functions.receptance), floor(problem.functions)
    apart = np.log(np.hypot(np.abs(found.values), under)) - np.log(np.hypot(measured, under))
    return apart.ravel(), log_slopes(found, under)


def log_slopes(found: Slopes, under: np.ndarray) -> np.ndarray:
    """(q n, p): slopes of ln|H| above a floor (q, n)."""
    square = np.abs(found.values) ** 2 + under**2
    slopes: np.ndarray = np.real(found.slopes * found.values.conj() / square).reshape(len(found.slopes), -1).T
    return slopes


def floor(functions: Functions) -> np.ndarray:
    """(q, n) what lies beneath receptances, those of motions and loads of one kind together."""
    kinds = [(a.is_rotation, b.is_rotation) for a, b in zip(functions.responses, functions.references, strict=True)]
    size = np.abs(functions.receptance)
    greatest = {kind: size[[own == kind for own in kinds]].max(axis=0) for kind in kinds}
    return FLOOR * np.array([greatest[kind] for kind in kinds])


def is_seen(functions: Functions) -> np.ndarray:
    """(q, n) whether what was measured is above the floor: what is below does not say how far machine and model are apart."""
    above: np.ndarray = np.abs(functions.receptance) > floor(functions)
    return above


def robust_spread(apart: np.ndarray) -> float:
    """Standard deviation of normal numbers about zero that has the same median absolute value; NaN do not count."""
    return float(np.nanmedian(np.abs(apart)) / 0.6744897501960817)


def alike_over(apart: np.ndarray) -> float:
    """Lines over which residuals (q, n) are alike, NaN apart: 1 + 2 times the sum of their autocorrelations, as long as these
    fall and are above zero (Geyer, Statistical Science 7:473, 1992)."""
    n = apart.shape[1]
    clipped = np.nan_to_num(np.clip(apart, *(HUBER * robust_spread(apart) * np.array([-1, 1]))))
    transform = np.fft.rfft(clipped, 2 * n, axis=1)
    power = np.fft.irfft(np.abs(transform) ** 2, axis=1)[:, :n].sum(axis=0)
    if not power[0] > 0:
        return 1.0
    correlation = power / power[0]
    pairs = correlation[: 2 * (n // 2)].reshape(-1, 2).sum(axis=1)
    ends = np.nonzero(pairs <= 0)[0]
    falling = np.minimum.accumulate(pairs[: ends[0] if len(ends) else len(pairs)])
    return float(max(1.0, 2 * falling.sum() - 1))


def _huber(apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers whose squares grow like those of residuals up to `HUBER`, then like their size; and how they grow themselves."""
    size = np.abs(apart)
    far = np.sqrt(HUBER * np.maximum(2 * size - HUBER, HUBER))
    return np.where(size > HUBER, np.sign(apart) * far, apart), np.where(size > HUBER, HUBER / far, 1.0)
