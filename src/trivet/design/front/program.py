"""One step of polishing: sequential quadratic programming on a smooth model (D. Kraft, SLSQP, DFVLR-FB 88-28, 1988), in the
form of A. Pascoletti and P. Serafini (1984),

    least t  with  f_i(x) <= reference_i + t direction_i,

where constraints are f_i with reference and direction zero, and each f_i is the greatest of its rows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from trivet.design.front.box import Box
from trivet.design.front.problem import MET, Array, Model, Values

FAR = 100.0
"""How far from met a row counts at most, and one without value."""
BAND = 0.2
"""Rows this near the greatest of their owner take part from the start."""
AGAIN = 4
"""How often rows that were left out and became the greatest are taken in."""


class Goal(NamedTuple):
    """What to go for, over objectives and constraints, (m + k,) each."""

    reference: Array
    """Infinite for what plays no part."""
    direction: Array
    """Zero for what is a bound."""
    scale: Array
    """What is much of each."""

    def within(self, missed: Array) -> Goal:
        """The same with bounds that are tighter by what they are missed by (m + k,), as far as that is above zero."""
        is_bound = np.isfinite(self.reference) & (self.direction == 0)
        return self._replace(reference=self.reference - np.where(is_bound, np.maximum(missed, 0.0), 0.0))

    def attained(self, both: Array) -> tuple[Array, Array]:
        """Of rows (n, m + k) of objectives and constraints: by how much bounds are missed but for rounding, and t; (n,)."""
        bound = np.isfinite(self.reference) & (self.direction == 0)
        aimed = self.direction > 0
        missed = np.max((both[:, bound] - self.reference[bound]) / self.scale[bound], axis=1, initial=0.0)
        t = np.max((both[:, aimed] - self.reference[aimed]) / self.direction[aimed], axis=1, initial=-np.inf)
        has_value = np.isfinite(both).all(axis=1)
        return np.where(has_value, np.where(missed <= MET, 0.0, missed), np.inf), np.where(has_value, t, np.inf)


def improving(reference: Array, direction: Array, width: Array, constraints: int) -> Goal:
    """Towards lower objectives from a reference (m,) along a direction (m,), constraints met."""
    none = np.zeros(constraints)
    return Goal(np.concatenate([reference, none]), np.concatenate([direction, none]), np.concatenate([width, none + 1]))


def meeting(objectives: int, constraints: int) -> Goal:
    """Towards constraints that are met, whatever the objectives."""
    free, every = np.full(objectives, np.inf), np.ones(constraints)
    return Goal(
        np.concatenate([free, 0 * every]), np.concatenate([0 * np.ones(objectives), every]), np.ones(objectives + constraints)
    )


def gain(goal: Goal, before: Array, after: Array) -> float:
    """What rows (m + k,) come nearer to a goal: to its bounds while they are missed, in t then."""
    missed, t = goal.attained(np.array([before, after]))
    if missed[0] > 0:
        return float(missed[0] - missed[1])
    return float(t[0] - t[1]) if missed[1] == 0 else -np.inf


def joined(values: Values) -> Array:
    """Rows (n, m + k) of objectives and constraints."""
    return np.concatenate(values, axis=1)


@dataclass
class Program:
    """Variables: the genes (f,) that are free, and t."""

    model: Model
    box: Box
    design: Array
    """(d,) whose discrete variables are held."""
    goal: Goal
    radius: float
    """How far genes may go."""
    _last: tuple[bytes, Array] = field(default=(b"", np.zeros(0)), init=False)

    def __post_init__(self) -> None:
        self._owner = np.asarray(self.model.owner)
        self._counts = np.isfinite(self.goal.reference)[self._owner]
        self._reference, self._direction, self._scale = (part[self._owner] for part in self.goal)

    def solved(self, steps: int, precision: float) -> tuple[Array, float]:
        """The genes (f,) that the model's least t has, or comes to in so many steps, and what the model says they gain."""
        from scipy.optimize import Bounds, minimize

        first = self.box.genes(self.design[None])[0][self.box.is_free]
        here = self._spare(first, 0.0)
        aimed = self._counts & (self._direction > 0)
        t = float(np.max(-here[aimed] * self._scale[aimed] / self._direction[aimed], initial=-FAR))
        x = np.append(first, min(t, FAR))
        low, high = (
            np.append(np.maximum(first - self.radius, 0), -np.inf),
            np.append(np.minimum(first + self.radius, 1), np.inf),
        )
        taking = self._near(here, BAND)
        towards = np.append(np.zeros(len(first)), 1.0)
        for _ in range(AGAIN):
            parts = {
                "type": "ineq",
                "fun": lambda x, i=taking: self._spare(x[:-1], x[-1])[i],
                "jac": lambda x, i=taking: self._by(x)[i],
            }
            with np.errstate(all="ignore"):
                done = minimize(
                    lambda x: x[-1], x, jac=lambda x: towards, method="SLSQP", bounds=Bounds(low, high), constraints=[parts],
                    options={"maxiter": steps, "ftol": precision},
                )  # fmt: skip
            if not np.all(np.isfinite(done.x)):
                break
            x = np.clip(done.x, low, high)
            more = self._near(self._spare(x[:-1], 0.0), 0.0)
            if np.isin(more, taking).all():
                break
            taking = np.union1d(taking, self._near(self._spare(x[:-1], 0.0), BAND))
        return x[:-1], gain(self.goal, self.both(first), self.both(x[:-1]))

    def linear(self) -> Array:
        """The genes (f,) that the least t of the rows made linear has; those of the design where it has none.

        Bounds that are missed are not missed further.
        """
        from scipy.optimize import linprog

        first = self.box.genes(self.design[None])[0][self.box.is_free]
        by, spare = self._by(np.append(first, 0.0))[self._counts], self._spare(first, 0.0)[self._counts]
        slopes, aim = by[:, :-1], by[:, -1]
        spare = np.where(aim > 0, spare, np.maximum(spare, 0.0))
        taking = _deciding(slopes, aim, spare, self.radius)
        ends = np.maximum(first - self.radius, 0) - first, np.minimum(first + self.radius, 1) - first
        done = linprog(
            np.append(np.zeros(len(first)), 1.0), A_ub=-by[taking], b_ub=spare[taking],
            bounds=[*zip(*ends, strict=True), (None, None)], method="highs",
        )  # fmt: skip
        return first + done.x[:-1] if done.status == 0 else first

    def both(self, genes: Array) -> Array:
        """(m + k,) objectives and constraints of the model; those that have no rows are at their reference."""
        found = np.where(np.isfinite(self.goal.reference), self.goal.reference, 0.0)
        has_rows = np.isin(np.arange(len(found)), self._owner)
        found[has_rows] = -np.inf
        with np.errstate(invalid="ignore"):  # rows without value
            np.maximum.at(found, self._owner, self._rows(genes))
        return found

    def _rows(self, genes: Array) -> Array:
        if self._last[0] != genes.tobytes():
            self._last = (genes.tobytes(), np.asarray(self.model.rows(self.box.moved(self.design, genes[None])[0]), float))
        return self._last[1]

    def _spare(self, genes: Array, t: float) -> Array:
        """(r,) how far each row is below what it may be at t, in its scale."""
        reference = np.where(self._counts, self._reference, 0.0)
        spare = (reference + t * self._direction - self._rows(genes)) / self._scale
        return np.maximum(np.nan_to_num(spare, nan=-FAR, posinf=-FAR, neginf=-FAR), -FAR)

    def _by(self, x: Array) -> Array:
        """(r, f + 1) slopes of what is spare."""
        free = self.box.is_free
        slopes = (
            -np.asarray(self.model.slopes(self.box.moved(self.design, x[None, :-1])[0]), float)[:, free] * self.box.width[free]
        )
        made = np.column_stack([slopes, self._direction]) / self._scale[:, None]
        return np.nan_to_num(made, nan=0.0, posinf=0.0, neginf=0.0)

    def _near(self, spare: Array, band: float) -> Array:
        """The rows whose spare is at most so much above the least of their owner."""
        least = np.full(len(self.goal.reference), np.inf)
        np.minimum.at(least, self._owner, spare)
        return np.flatnonzero(self._counts & (spare <= least[self._owner] + band))


def _deciding(slopes: Array, aim: Array, spare: Array, radius: float) -> Array:
    """(r,) which rows of spare + slopes dx + aim t >= 0 can hold t, or dx, within a radius."""
    reach = np.abs(slopes).sum(axis=1) * radius
    aimed = aim > 0
    own = np.where(aimed, aim, 1.0)
    sure = np.max(-(spare + reach)[aimed] / own[aimed], initial=-np.inf)
    return np.asarray(np.where(aimed, -(spare - reach) / own >= sure, spare <= reach))
