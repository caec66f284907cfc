"""What a correction counts: terms of a sum of squares, each of them residuals over their s, and how they grow with theta."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError
from trivet.measure.correlation import assigned
from trivet.measure.functions import Functions
from trivet.measure.machine.modes import modes_of, poles_of
from trivet.measure.machine.parameters import Parameters
from trivet.measure.machine.predicted import Receptances, Slopes
from trivet.measure.machine.setup import Placed
from trivet.measure.modal.fitted import FittedModes
from trivet.model import Machine

FREQUENCY_ERROR = 0.01
"""s_f: relative error of natural frequencies that a model of beams and springs may have."""
DAMPING_ERROR = 0.3
"""s_zeta: relative error of damping ratios."""
FLOOR = 1e-3
"""Responses below so much of the greatest of their kind at the same frequency count as this: what is nought in a machine by its
symmetry is small in a real one, and the logarithm of nought says nothing."""
HUBER = 1.5
"""Residuals beyond so many times their spread count by their size, not by their square."""
KEPT = 8
"""Thetas whose residuals are kept: a search asks for slopes where it had residuals, and ends some trials after its best."""


class Problem(NamedTuple):
    """What is to be explained, and by what."""

    placed: Placed
    functions: Functions
    free: Parameters
    poles: FittedModes | None
    """Modes that were fitted, with shapes at placed channels."""
    loss_factor: float
    receptances: Receptances
    """At the channels and frequencies of the functions."""

    @property
    def machine(self) -> Machine:
        """The machine as its file says."""
        return self.placed.machine

    def at(self, theta: np.ndarray) -> tuple[Machine, float]:
        """The machine and the loss factor of the analysis with some theta."""
        machine, loss = self.free.applied(self.machine, self.loss_factor, theta)
        return machine, float(loss)


class Residuals(NamedTuple):
    """r residuals at some theta (p,)."""

    values: np.ndarray
    """(r,)"""
    slopes: np.ndarray
    """(r, p)"""


Term = Callable[[np.ndarray], Residuals]
"""Residuals at any theta."""


def kept(own: Term) -> Term:
    """The same, its last answers kept."""

    @lru_cache(maxsize=KEPT)
    def answer(*theta: float) -> Residuals:
        return own(np.array(theta))

    return lambda theta: answer(*theta.tolist())


def beforehand(free: Parameters) -> Term:
    """What was known of the numbers before they were measured."""
    start, slopes = free.theta(free.start), np.diag(1 / free.spread)
    return lambda theta: Residuals((theta - start) / free.spread, slopes)


def of_poles(problem: Problem, poles: FittedModes) -> Term:
    """ln f and ln zeta of poles, each beside that of the mode which it is."""
    frequency, damping, _ = poles.modes
    measured = logarithms(np.concatenate([frequency, damping]), "frequencies and damping ratios of poles")
    errors = np.repeat([FREQUENCY_ERROR, DAMPING_ERROR], len(frequency))

    def residuals(theta: np.ndarray) -> Residuals:
        found = modes_of(problem.placed, *problem.at(theta), float(frequency.max()), poles.channels)
        order = assigned(poles.modes, found.as_set)[1]
        own = poles_of(problem.placed, problem.machine, problem.loss_factor, problem.free, theta, found, order)
        return Residuals((own.values - measured) / errors, own.slopes / errors[:, None])

    return kept(residuals)


def scaled(apart: Term, spread: float, alike: float) -> Term:
    """Residuals over s, which is their spread times the root of the number that are alike; far ones count less."""
    root = math.sqrt(alike)

    def residuals(theta: np.ndarray) -> Residuals:
        found = apart(theta)
        values, growth = huber(found.values / spread)
        return Residuals(values / root, (growth / (spread * root))[:, None] * found.slopes)

    return residuals


def of_responses(problem: Problem) -> Term:
    """ln|H| - ln|H_measured| (q n,), function after function."""
    under = floor(problem.functions)
    measured = logarithms(np.hypot(np.abs(problem.functions.receptance), under), "measured responses")

    def residuals(theta: np.ndarray) -> Residuals:
        found = problem.receptances.slopes(problem.machine, problem.loss_factor, problem.free, theta)
        values = np.log(np.hypot(np.abs(found.values), under)) - measured
        return Residuals(values.ravel(), log_slopes(found, under))

    return kept(residuals)


def logarithms(measured: np.ndarray, what: str) -> np.ndarray:
    """Of what was measured."""
    if bad := np.count_nonzero(~(measured > 0)):
        raise InputError(f"{what}: {bad} of {measured.size} have no logarithm; leave out what is nought or below")
    return np.log(measured)


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


def huber(apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers whose squares grow like those of residuals up to `HUBER`, then like their size; and how they grow themselves."""
    size = np.abs(apart)
    far = np.sqrt(HUBER * np.maximum(2 * size - HUBER, HUBER))
    return np.where(size > HUBER, np.sign(apart) * far, apart), np.where(size > HUBER, HUBER / far, 1.0)
