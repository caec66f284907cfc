"""What an optimisation is after: quantities that are to be great or small, and limits that designs keep."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from trivet.design.quantities import REACHED, Asked, Quantity, quantity
from trivet.design.study import Study
from trivet.design.study_file import GivenLimit
from trivet.errors import InputError, NoResultError
from trivet.model import Machine
from trivet.model.quantity import signs
from trivet.space.scalar import Scalar

Array = NDArray[Any]


@dataclass(frozen=True)
class Aim:
    """A quantity that is to be great, or small."""

    asked: Asked
    sign: float
    """-1 where it is to be great: the objective is sign times value, and is to be small."""

    @property
    def words(self) -> str:
        """In words."""
        return f"{'maximise' if self.sign < 0 else 'minimise'} {self.asked.name}"

    def of(self, value: Scalar) -> Scalar:
        """The objective, which is to be small, of a value of the quantity (SI)."""
        return self.sign * value


@dataclass(frozen=True)
class Limit:
    """A bound of a quantity."""

    asked: Asked
    bound: float
    """SI."""
    sign: float
    """-1 where the quantity is at least that: it is kept where sign (value - bound) is not above zero."""

    @property
    def words(self) -> str:
        """In words."""
        # All its digits: by its words the store of one study is told from that of another.
        bound = signs(str(self.asked.kind.write(self.bound))) if self.asked.kind.si else repr(self.bound).removesuffix(".0")
        return f"{self.asked.name} at {'least' if self.sign < 0 else 'most'} {bound}"

    @property
    def size(self) -> float:
        """What is much of it."""
        return 1.0 if not self.asked.kind.si or self.bound == 0 else abs(self.bound)

    def missed(self, by: float) -> str:
        """In words, with the value that is `by` from kept, as `of` gives it."""
        value = self.bound + self.sign * by * self.size
        return f"'{self.words}', at {self.asked.kind.told(value)}"

    def of(self, value: Scalar) -> Scalar:
        """How far it is from kept, of a value of the quantity (SI): above zero where it is not, about 1 is far."""
        return self.sign * (value - self.bound) / self.size


@dataclass(frozen=True)
class Aims:
    """What is sought."""

    goals: tuple[Aim, ...]
    limits: tuple[Limit, ...]

    @property
    def all(self) -> tuple[Aim | Limit, ...]:
        """Goals, then limits."""
        return (*self.goals, *self.limits)

    @property
    def asked(self) -> list[str]:
        """Names of all quantities, none twice."""
        return list(dict.fromkeys(own.asked.name for own in self.all))

    def require(self, machine: Machine) -> None:
        """Raise NoResultError for a machine of a kind that has no such number."""
        for own in self.all:
            reason = own.asked.lacks(machine)
            if reason is not None:
                raise NoResultError(f"has no {own.asked.name}: {reason}")


def aims_of(study: Study) -> tuple[Study, Aims]:
    """What a study file seeks, and the study that asks for it.

    A design must reach all check points, unless a limit on "reached" says otherwise: else means over few good points would win.

    Raises:
        InputError: for a quantity that is not known or that no machine has, none to seek, or limits that exclude each other.
    """
    given = study.given.optimise
    sought = ("maximise", given.maximise, -1.0), ("minimise", given.minimise, 1.0)
    goals = [Aim(quantity(name, f"optimise.{key}"), sign) for key, names, sign in sought for name in names]
    if not goals:
        raise InputError('optimise: seeks nothing; give maximise or minimise, as in maximise = ["mean K_xx"]')
    names = [goal.asked.name for goal in goals]
    if REACHED in names:
        raise InputError(f"optimise: '{REACHED}' is a share of the check points, which has no slope; give it as a limit")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"optimise: '{name}' is sought twice")
    limits = [limit for one in given.limits for limit in _limits(one)]
    asked = [own.asked for own in Aims(tuple(goals), tuple(limits)).all]
    over = any(isinstance(own, Quantity) and own.is_over_points for own in asked)
    if over and not any(limit.asked.name == REACHED for limit in limits):
        limits.append(Limit(quantity(REACHED), 1.0, -1.0))
    _check(limits)
    found = Aims(tuple(goals), tuple(limits))
    return study.asking(found.asked), found


def _limits(given: GivenLimit) -> list[Limit]:
    asked = quantity(given.quantity, "optimise.limits")
    found = []
    for key, text, sign in (("at_least", given.at_least, -1.0), ("at_most", given.at_most, 1.0)):
        if text is None:
            continue
        try:
            # As of a quantity of either sign: "at least -1 mm" is no mistake.
            kind = dataclasses.replace(asked.kind, positive=False, at_least_zero=False)
            found.append(Limit(asked, kind.parse(text), sign))
        except PydanticCustomError as error:
            raise InputError(f'optimise.limits: {asked.name}: {key} "{text}": {error.message()}') from None
    if not found:
        raise InputError(f"optimise.limits: {asked.name}: has no bound; give at_least or at_most")
    return found


def _check(limits: Sequence[Limit]) -> None:
    """Refuse limits that no number keeps."""
    for name in dict.fromkeys(limit.asked.name for limit in limits):
        own = [limit for limit in limits if limit.asked.name == name]
        least = max((limit for limit in own if limit.sign < 0), key=lambda limit: limit.bound, default=None)
        most = min((limit for limit in own if limit.sign > 0), key=lambda limit: limit.bound, default=None)
        if least is not None and most is not None and least.bound > most.bound:
            raise InputError(f"optimise.limits: {least.words}, yet {most.words}: no design can be both")
        if most is not None and name == REACHED:
            raise InputError(f"optimise.limits: {most.words}; of this only at_least can be asked")
        if least is not None and name == REACHED and least.bound > 1:
            raise InputError(f"optimise.limits: {least.words}; it is a share, 1 at most")


def seen(aims: Sequence[Aim | Limit], columns: Sequence[str], values: Array) -> Array:
    """Objectives or violations (n, k) of values (n, columns) of the quantities, SI."""
    rows = [own.of(values[:, columns.index(own.asked.name)]) for own in aims]
    return np.stack(rows, axis=1) if rows else np.zeros((len(values), 0))
