"""How uncertain quantities are, and what makes them so: to first order, by Sobol indices, and what is left of orderings."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.design.engine import Outcome
from trivet.design.orderings import Order, Pair, orders, pairs
from trivet.design.sampling import Saltelli
from trivet.design.slopes import FirstOrder, first_order, parts
from trivet.design.sobol import Indices, indices
from trivet.design.study import Study
from trivet.design.sweep import Progress, Sweep, sweep
from trivet.errors import InputError, NoResultError

Array = NDArray[Any]

QUANTILES = (0.05, 0.5, 0.95)


class Spread(NamedTuple):
    """How a quantity is spread over the samples that have it; SI, NaN where none has."""

    samples: int
    """That have it."""
    mean: float
    deviation: float
    """Of the population."""
    quantiles: tuple[float, ...]
    """At 5, 50 and 95 %."""


@dataclass(frozen=True)
class Uncertainty:
    """A study with its variables as unknowns: quantities are `study.columns`."""

    swept: Sweep
    """The designs of all samples."""
    sampling: Saltelli
    first: tuple[FirstOrder, ...]
    """Per machine."""

    @property
    def study(self) -> Study:
        """What was asked."""
        return self.swept.study

    @property
    def short_names(self) -> list[str]:
        """Machines without their settings, where that tells them apart."""
        short = [name.partition("@")[0] for name in self.study.names]
        return short if len(set(short)) == len(short) else self.study.names

    @property
    def column_names(self) -> list[str]:
        """Quantities, with their machines where there are several."""
        names = self.short_names
        return [c.asked.name if len(names) == 1 else f"{c.asked.name} of {names[c.place]}" for c in self.study.columns]

    @property
    def samples(self) -> int:
        """Samples of independent variables: two of every base sample."""
        return 2 * self.sampling.base

    @cached_property
    def spreads(self) -> list[Spread]:
        """Per column."""
        return [_spread(self._drawn(name)) for name in self.swept.quantities]

    @cached_property
    def indices(self) -> list[Indices]:
        """Per column."""
        return [indices(self._values(name)) for name in self.swept.quantities]

    @cached_property
    def pairs(self) -> list[list[Pair]]:
        """Per quantity every two machines; none of a single machine."""
        return [pairs(one) for one in self._compared()]

    @cached_property
    def orders(self) -> list[list[Order]]:
        """Per quantity the orders that occur of machines that have it, the most frequent first; none of a single machine."""
        machines = self.study.machines
        having = [[k for k, one in enumerate(machines) if own.lacks(one) is None] for own in self.study.quantities]
        return [orders(*own) for own in zip(self._compared(), having, strict=False)]

    def described(self, column: int) -> float:
        """A column's quantity of the machine as described."""
        return float(self.first[self.study.columns[column].place].value[self._asked(column)])

    def deviation(self, column: int) -> float:
        """Its standard deviation to first order."""
        return float(self.first[self.study.columns[column].place].deviations[self._asked(column)])

    def _asked(self, column: int) -> int:
        """Which of the quantities a column is of."""
        return column // len(self.study.subjects)

    def _compared(self) -> list[Array]:
        """Per quantity (samples, machines)."""
        machines = len(self.study.subjects)
        if machines < 2:
            return []
        names = self.swept.quantities
        own = [names[k : k + machines] for k in range(0, len(names), machines)]
        return [np.column_stack([self._drawn(name) for name in group]) for group in own]

    def _values(self, name: str) -> Array:
        """(base, d + 2)."""
        return self.swept.results.column(name, 0, self.swept.count).reshape(self.sampling.base, -1)

    def _drawn(self, name: str) -> Array:
        """(samples,) of variables that are independent of each other."""
        return self._values(name)[:, [0, -1]].reshape(-1)


def sensitivity(
    study: Study,
    store: str | os.PathLike[str],
    *,
    workers: int = 0,
    scheduler: str | None = None,
    progress: Progress = lambda done, total, remaining: None,
    first: Callable[[str, int, int], None] = lambda machine, done, total: None,
) -> tuple[Uncertainty, Outcome]:
    """Take a study's variables as unknowns, independent of each other.

    Args:
        study: with quantities; `sensitivity.count` of it says how many base samples.
        store: folder of the samples, made or gone on with, as of `sweep`; so are the arguments that are not told here.
        first: called while slopes are worked out, after the samples: with the machine, how many parts are done, of how many.

    Raises:
        InputError: for a study without quantities, variables of which none varies, or as of `sweep`.
        NoResultError: where most samples lack every quantity, or as of `sweep`.
    """
    check(study)
    given = study.given.sensitivity
    drawing = Saltelli(given.count, len(study.variables), given.seed)
    swept, outcome = sweep(study, store, drawing=drawing, workers=workers, scheduler=scheduler, progress=progress)
    found = Uncertainty(swept, drawing, _first_orders(study, first))
    most = max(spread.samples for spread in found.spreads)
    if most * 2 < found.samples and not outcome.failures:
        raise NoResultError(
            f"of {found.samples:,} samples {most:,} at most have a quantity; ranges reach too far beyond what the machines can"
        )
    return found, outcome


def check(study: Study) -> None:
    """Raise InputError for a study without what sensitivity needs: quantities, and variables that vary."""
    study.require_quantities()
    if not any(variable.law.deviation > 0 for variable in study.variables):
        raise InputError("variables: none of them varies; give one a range, a deviation or a second choice")


def _first_orders(study: Study, told: Callable[[str, int, int], None]) -> tuple[FirstOrder, ...]:
    """Of every machine."""
    counts = [parts(study, place) for place in range(len(study.subjects))]
    found = []
    for place, name in enumerate(study.names):
        done = count(sum(counts[:place]))

        def tell(name: str = name, done: Iterator[int] = done) -> None:
            told(name, next(done), sum(counts))

        tell()
        found.append(first_order(study, place, tell))
    return tuple(found)


def _spread(values: Array) -> Spread:
    own = values[np.isfinite(values)]
    if not len(own):
        return Spread(0, np.nan, np.nan, (np.nan,) * len(QUANTILES))
    return Spread(len(own), float(own.mean()), float(own.std()), tuple(float(q) for q in np.quantile(own, QUANTILES)))
