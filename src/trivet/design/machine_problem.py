"""An optimisation of one machine as the core of `front/` takes it: values in batches, and a smooth model about a design.

The rolls that are best at the design follow it to first order (`following.py`).  What is maximised over the roll is never below
its value at any other roll that is reached, so that climbing the model climbs it.  The least over poses has a row per pose.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.design.aims import Aim, Aims, Limit, seen
from trivet.design.evaluation import Evaluation
from trivet.design.fields import margins
from trivet.design.following import Follower, Held, nowhere
from trivet.design.front.problem import Values
from trivet.design.looked import Stand
from trivet.design.quantities import REACHED, Quantity
from trivet.design.study import Study
from trivet.design.variables import machine_of

Array = NDArray[Any]

PIECE = 2
"""Designs per call: polishing looks at four together, which two cores share."""
STEP = 1e-4
"""Of a central difference, as a part of a variable's range, for what only studies of their own know."""
ROUNDING = 1e-9
"""Of a number of check points that is a share of all."""


def standing(single: Study, design: Any) -> Stand:
    """The machine that a design (d,) is, in a study of one machine alone; JAX may trace the design."""
    subject = single.subjects[0]
    machine = machine_of(subject.machine, 0, single.variables, list(jnp.asarray(design)))
    return Stand(machine, subject.points, subject.signs, subject.scene, single.load)


class MachineProblem:
    """The problem of one of a study's machines."""

    def __init__(self, study: Study, place: int, aims: Aims) -> None:
        self.study, self.place, self.aims = study, place, aims
        single = study.of(place).climbing()
        self.evaluation = Evaluation(single, PIECE)
        self.columns = [column.asked.name for column in single.columns]
        variables = single.variables
        self.variables = tuple(variable.name for variable in variables)
        self.objectives = tuple(goal.words for goal in aims.goals)
        self.constraints = tuple(limit.words for limit in aims.limits)
        self.low = np.array([variable.law.low for variable in variables])
        self.high = np.array([variable.law.high for variable in variables])
        self.discrete = tuple(tuple(float(k) for k in range(len(v.choices))) if v.is_discrete else None for v in variables)
        self.single = single

    def values(self, designs: Array) -> Values:
        """Of designs (n, d)."""
        found = self.evaluation(designs).values
        return Values(seen(self.aims.goals, self.columns, found), seen(self.aims.limits, self.columns, found))

    def model(self, design: Array) -> MachineModel:
        """About a design (d,)."""
        return MachineModel(self, np.asarray(design, dtype=float))

    def missed(self, constraint: int, value: float) -> str:
        """Words for a limit that is not kept, and what is reached instead."""
        return self.aims.limits[constraint].missed(value)

    @cached_property
    def follower(self) -> Follower:
        """How rolls follow designs."""
        return Follower(self.stand, self.high - self.low)

    def held(self, design: Array) -> Held:
        """The rolls about a design."""
        return self.follower.about(design) if self.evaluation.is_over_points else nowhere(design)

    @cached_property
    def rows(self) -> Callable[[Array, Held], Any]:
        """Rows of all objectives and constraints of a design, with rolls held; compiled."""
        return jax.jit(self._rows)

    @cached_property
    def slopes(self) -> Callable[[Array, Held], Any]:
        """Their slopes by the variables; compiled."""
        return jax.jit(jax.jacfwd(self._rows))

    @cached_property
    def owner(self) -> Array:
        """(r,) whose row each is."""
        held = self.held(self.low)
        counts = [jax.eval_shape(partial(self._of, own), self.low, held).shape[0] for own in self.aims.all]
        return np.repeat(np.arange(len(counts)), counts)

    def stand(self, design: Any) -> Stand:
        """The machine of a design, traced."""
        return standing(self.single, design)

    def _rows(self, design: Any, held: Held) -> Any:
        return jnp.concatenate([self._of(own, design, held) for own in self.aims.all])

    def _of(self, own: Aim | Limit, design: Any, held: Held) -> Any:
        """Rows of one objective or constraint; what only a study knows has one row of zero, which the model fills."""
        if not isinstance(own.asked, Quantity):
            return jnp.zeros(1)
        stand = self.stand(design)
        if own.asked.name == REACHED:
            assert isinstance(own, Limit)
            # As many as the limit asks for; of those that are not reached, rows and slopes tell what is missing.
            count = math.ceil(own.bound * len(held.roll) - ROUNDING)
            return -margins.room(held.freely(stand, max(1, count)))
        return own.of(own.asked.rows(stand, lambda: held.looked(stand, design), own.sign))


class MachineModel:
    """A smooth model about one design."""

    def __init__(self, problem: MachineProblem, design: Array) -> None:
        self._problem = problem
        self._held = problem.held(design)
        self.owner = problem.owner

    def rows(self, design: Array) -> Array:
        """(r,) at a design."""
        found = np.array(self._problem.rows(design, self._held))
        rows, aims = self._studied()
        if rows:
            found[rows] = self._by_study(aims, design[None])[0]
        return found

    def slopes(self, design: Array) -> Array:
        """(r, d) at a design."""
        found = np.array(self._problem.slopes(design, self._held))
        low, high = self._problem.low, self._problem.high
        rows, aims = self._studied()
        for k, values in enumerate(self._problem.discrete):
            width = (high[k] - low[k]) * STEP
            ends = np.clip(design[k] + np.array([-width, width]), low[k], high[k])
            if not rows or values is not None or not ends[1] > ends[0]:
                continue
            both = np.repeat(design[None], 2, axis=0)
            both[:, k] = ends
            found[rows, k] = np.diff(self._by_study(aims, both), axis=0)[0] / (ends[1] - ends[0])
        return found

    def _studied(self) -> tuple[list[int], list[Aim | Limit]]:
        """Rows of what only a study knows, and what they are of."""
        aims = self._problem.aims.all
        own = [k for k, one in enumerate(aims) if not isinstance(one.asked, Quantity)]
        return [int(np.argmax(self.owner == k)) for k in own], [aims[k] for k in own]

    def _by_study(self, aims: list[Aim | Limit], designs: Array) -> Array:
        """(n, a), together, since studies may tell several numbers."""
        names = list(dict.fromkeys(own.asked.name for own in aims))
        return seen(aims, names, Evaluation(self._problem.single.asking(names))(designs).values)
