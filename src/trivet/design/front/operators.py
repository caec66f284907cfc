"""How designs with discrete variables are crossed and mutated, for pymoo.

Continuous variables take simulated binary crossover and polynomial mutation (K. Deb and R. B. Agrawal, 1995; K. Deb and
M. Goyal, 1996).  Discrete ones are numbers of values: parents swap them, and a mutation goes to a value beside or to any.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.core.crossover import Crossover
from pymoo.core.mutation import Mutation
from pymoo.core.sampling import Sampling
from pymoo.operators.crossover.sbx import cross_sbx
from pymoo.operators.mutation.pm import mut_pm
from scipy.stats import qmc

from trivet.design.front.problem import Array

NEAR = 15.0
"""Distribution index of the crossover: the greater, the nearer to the parents."""
FINE = 20.0
"""Distribution index of the mutation."""


class Crossed(Crossover):  # type: ignore[misc]
    """Two children of two parents."""

    def __init__(self, counts: Array) -> None:
        super().__init__(2, 2, prob=0.9)
        self.counts = counts

    def _do(self, problem: Any, X: Array, *args: Any, random_state: Any = None, **others: Any) -> Array:
        pairs = X.shape[1]
        eta, half = np.full((pairs, 1), NEAR), np.full((pairs, 1), 0.5)
        made: Array = cross_sbx(X.astype(float), problem.xl, problem.xu, eta, 0.5, half, random_state=random_state)
        discrete = self.counts > 0
        swapped = np.where(random_state.random((pairs, len(discrete))) < 0.5, X[::-1], X)
        made[..., discrete] = swapped[..., discrete]
        return made


class Mutated(Mutation):  # type: ignore[misc]
    """One variable in each design on the average."""

    def __init__(self, counts: Array) -> None:
        super().__init__(prob=1.0)
        self.counts = counts

    def _do(self, problem: Any, X: Array, *args: Any, random_state: Any = None, **others: Any) -> Array:
        X = X.astype(float)
        rate = np.full(len(X), min(0.5, 1 / X.shape[1]))
        made: Array = mut_pm(X, problem.xl, problem.xu, np.full(len(X), FINE), rate, False, random_state=random_state)
        discrete, most = self.counts > 0, np.maximum(self.counts - 1, 0)
        beside = X + random_state.choice([-1.0, 1.0], X.shape)
        beside = np.where((beside < 0) | (beside > most), 2 * X - beside, beside)
        anywhere = np.floor(random_state.random(X.shape) * self.counts)
        chosen = np.clip(np.where(random_state.random(X.shape) < 0.5, beside, anywhere), 0, most)
        changes = random_state.random(X.shape) < rate[:, None]
        made[:, discrete] = np.where(changes, chosen, X)[:, discrete]
        return made


class Spread(Sampling):  # type: ignore[misc]
    """Designs to begin with: those that are given, then a Latin hypercube."""

    def __init__(self, counts: Array, given: Array) -> None:
        super().__init__()
        self.counts, self.given = counts, given

    def _do(self, problem: Any, n_samples: int, *args: Any, random_state: Any = None, **others: Any) -> Array:
        points = qmc.LatinHypercube(len(self.counts), rng=random_state).random(n_samples)
        made = np.where(self.counts > 0, np.floor(points * self.counts), points)
        return np.concatenate([self.given, made])[:n_samples]
