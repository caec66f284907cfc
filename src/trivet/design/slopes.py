"""Slopes of a machine's quantities by the variables, at the design which the machine is as described.

By JAX, with best rolls that follow (`following.py`); what only a study of its own knows by central differences.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.design.evaluation import Evaluation
from trivet.design.following import Follower, Held, nowhere
from trivet.design.machine_problem import STEP, standing
from trivet.design.quantities import REACHED, Quantity
from trivet.design.studied import Studied
from trivet.design.study import Study

Array = NDArray[Any]


class FirstOrder(NamedTuple):
    """Quantities (q,) of one machine to first order in d variables; SI."""

    design: Array
    """(d,) the machine as described, as `Study.described_of`."""
    value: Array
    """(q,) NaN where there is none."""
    slope: Array
    """(q, d) per unit of each variable; NaN by choices, and of the share of poses that are reached, which goes by steps."""
    deviation: Array
    """(d,) standard deviations of the variables (log-uniform: of the logarithm, times the value); NaN of choices."""

    @property
    def contributions(self) -> Array:
        """(q, d) what each variable adds to the standard deviation of a quantity, with its sign."""
        return self.slope * self.deviation

    @property
    def deviations(self) -> Array:
        """(q,) standard deviations of the quantities, of independent variables; choices are left out."""
        return np.sqrt(_sum(self.contributions**2))

    @property
    def shares(self) -> Array:
        """(q, d) of the variance."""
        with np.errstate(invalid="ignore"):
            return self.contributions**2 / _sum(self.contributions**2)[:, None]

    @property
    def elasticities(self) -> Array:
        """(q, d) relative change of the quantity per relative change of the variable."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.value[:, None] == 0, np.nan, self.slope * self.design / self.value[:, None])


class _Asked(NamedTuple):
    """Quantities of a machine by what tells their slopes; those that it has no number of are nowhere among them."""

    smooth: dict[int, Quantity]
    studied: dict[int, str]
    steps: dict[int, str]
    """Which go by steps and have no slopes."""

    @classmethod
    def of(cls, study: Study, place: int) -> _Asked:
        found = cls({}, {}, {})
        for k, own in enumerate(study.quantities):
            if own.lacks(study.machines[place]) is not None:
                continue
            if isinstance(own, Studied):
                found.studied[k] = own.name
            elif own.name == REACHED:
                found.steps[k] = own.name
            else:
                found.smooth[k] = own
        return found

    @property
    def is_over_points(self) -> bool:
        return any(own.is_over_points for own in self.smooth.values())


def parts(study: Study, place: int) -> int:
    """How many parts of the work `first_order` tells of."""
    own = _Asked.of(study, place)
    studied = 1 + len(_moved(study, place)) if own.studied else 0
    return own.is_over_points + bool(own.smooth) + studied + bool(own.steps)


def first_order(study: Study, place: int, told: Callable[[], None] = lambda: None) -> FirstOrder:
    """Quantities of one of a study's machines to first order; calls `told` after every part of the work."""
    single = study.of(place).climbing()
    design = single.described_of(0)
    own = _Asked.of(single, 0)
    value = np.full(len(single.quantities), np.nan)
    slope = np.full((len(value), len(design)), np.nan)
    if own.smooth:
        value[list(own.smooth)], slope[list(own.smooth)] = _by_jax(single, design, own, told)
    for some in (own.studied, own.steps):
        if some:
            value[list(some)] = _at(single, some.values(), design[None])[0]
            told()
    if own.studied:
        slope[list(own.studied)] = _by_differences(single, own.studied.values(), design, told)
    is_discrete = np.array([variable.is_discrete for variable in single.variables])
    deviation = np.array([variable.law.deviation_at(own) for variable, own in zip(single.variables, design, strict=True)])
    slope[:, is_discrete] = np.nan
    return FirstOrder(design, value, slope, np.where(is_discrete, np.nan, deviation))


def _by_jax(single: Study, design: Array, asked: _Asked, told: Callable[[], None]) -> tuple[Array, Array]:
    """Values (q,) and slopes (q, d)."""
    stand = partial(standing, single)
    widths = np.array([variable.law.high - variable.law.low for variable in single.variables])
    held = nowhere(design)
    if asked.is_over_points:
        held = Follower(stand, widths).about(design)
        told()

    def values(design: Any, held: Held) -> Any:
        own = stand(design)
        found = jnp.stack([one.value(own, lambda: held.looked(own, design)) for one in asked.smooth.values()])
        return found, found

    slopes, found = (np.asarray(own) for own in jax.jit(jax.jacfwd(values, has_aux=True))(design, held))
    told()
    return found, slopes


def _moved(study: Study, place: int) -> list[int]:
    """Variables of which a difference is taken."""
    return [k for k, own in enumerate(study.variables) if own.acts_on(place) and not own.is_discrete]


def _by_differences(single: Study, names: Iterable[str], design: Array, told: Callable[[], None]) -> Array:
    """Slopes (q, d) of quantities; within the range of each variable, widened to the design."""
    found = np.zeros((len(list(names)), len(design)))
    for k in _moved(single, 0):
        low, high = single.variables[k].law.low, single.variables[k].law.high
        both = np.repeat(design[None], 2, axis=0)
        least, most = min(low, design[k]), max(high, design[k])
        both[:, k] = np.clip(design[k] + np.array([-1, 1]) * STEP * (high - low), least, most)
        found[:, k] = np.diff(_at(single, names, both), axis=0)[0] / np.diff(both[:, k])[0]
        told()
    return found


def _at(single: Study, names: Iterable[str], designs: Array) -> Array:
    """Quantities (n, q) of designs."""
    return Evaluation(single.asking(list(names)), len(designs))(designs).values


def _sum(squares: Array) -> Array:
    """(q,) over the variables which have slopes; NaN where none has."""
    total: Array = np.nansum(squares, axis=1)
    return np.where(np.isfinite(squares).any(axis=1), total, np.nan)
