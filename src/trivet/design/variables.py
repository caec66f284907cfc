"""What varies of machines: variables as a study file gives them, and the machines that designs are.

A design is a row of d values, SI; that of a variable with choices is the number of the choice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from trivet.design.laws import Choices, Law, LogUniform, Normal, Uniform
from trivet.design.study_file import GivenVariable, Written
from trivet.errors import InputError, shown
from trivet.model import Machine
from trivet.model.numbers import Number, number
from trivet.model.quantity import Quantity, signs

Array = NDArray[Any]

FACTOR = Quantity("factor", "", "", positive=True)
CHOICE = Quantity("number of a choice", "", "", at_least_zero=True)


class Action(NamedTuple):
    """What a variable does to one machine."""

    leaves: tuple[int, ...]
    """Which leaves of the machine it changes."""
    is_factor: bool
    """Whether it multiplies them, rather than taking their place."""


@dataclass(frozen=True)
class Variable:
    """What varies."""

    name: str
    kind: Quantity
    law: Law
    steps: int | None
    """Of a grid."""
    choices: tuple[tuple[float, ...], ...]
    """(choices, leaves) SI; empty where it is a continuous number."""
    labels: tuple[str, ...]
    """The choices in words."""
    actions: tuple[Action | None, ...]
    """Per machine; None where a machine has no such numbers."""

    @property
    def is_discrete(self) -> bool:
        """Whether it takes only some values."""
        return bool(self.choices)

    def acts_on(self, place: int) -> bool:
        """Whether one of the machines has such numbers."""
        return self.actions[place] is not None

    def written(self, value: float) -> str:
        """A value with its unit as people read it, or the choice in words."""
        return signs(self.labels[int(value)]) if self.is_discrete else self.kind.told(value, 6)


def variables_of(given: Sequence[GivenVariable], machines: Sequence[Machine]) -> tuple[Variable, ...]:
    """Variables as a study file gives them.

    Raises:
        InputError: for paths that no machine has, ranges without room, two variables that set one number.
    """
    found = tuple(_variable(one, machines, k + 1) for k, one in enumerate(given))
    names = [one.name for one in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"variables: two are called '{name}'; give each a name of its own")
    for k, machine in enumerate(machines):
        owners: dict[tuple[int, bool], str] = {}
        for variable in found:
            action = variable.actions[k]
            for leaf in action.leaves if action is not None else ():
                own = (leaf, action is not None and action.is_factor)
                if not own[1] and own in owners:
                    raise InputError(f"variables: '{owners[own]}' and '{variable.name}' set the same number of {machine.name}")
                owners[own] = variable.name
    return found


def _variable(given: GivenVariable, machines: Sequence[Machine], place: int) -> Variable:
    if given.name and not (given.name.isprintable() and given.name.strip()):
        raise InputError(f"variables.{place}.name: {shown(given.name)}: must be letters that can be read")
    label = f"variables.{given.name or place}"
    if (given.of is None) == (given.scale is None):
        raise InputError(f"{label}: give either of (key paths that take the value) or scale (key paths that it multiplies)")
    written = given.of if given.of is not None else given.scale
    paths = [written] if isinstance(written, str) else list(written or ())
    numbers = _looked_up(label, paths, machines)
    is_factor = given.scale is not None
    actions = tuple(None if own is None else Action(tuple(n.leaf for n in own), is_factor) for own in numbers)
    own = next(own for own in numbers if own is not None)
    kinds = [FACTOR] if is_factor else [n.kind for n in own]
    name = given.name or ("scale of " if is_factor else "") + paths[0]
    if given.choices is not None:
        if is_factor:
            kinds = [FACTOR]
        return _choice(label, name, given, kinds, len(paths), actions)
    if len({(kind.si, kind.dimension) for kind in kinds}) > 1:
        raise InputError(
            f"{label}.of: {paths[0]} and others are of unlike kinds and cannot take one value; give choices instead"
        )
    start = 1.0 if is_factor else own[0].value
    return Variable(name, kinds[0], _law(label, given, kinds[0], start), given.steps, (), (), actions)


def _looked_up(label: str, paths: Sequence[str], machines: Sequence[Machine]) -> list[list[Number] | None]:
    """The numbers of the paths per machine; None for a machine that lacks one of them, an error where all do."""
    found: list[list[Number] | None] = []
    faults = []
    for machine in machines:
        try:
            found.append([number(machine, path) for path in paths])
        except InputError as error:
            found.append(None)
            faults.append(f"{machine.name}: {error}")
    if all(own is None for own in found):
        raise InputError(f"{label}: {faults[0]}")
    return found


def _parsed(label: str, kind: Quantity, value: Written) -> float:
    try:
        return kind.parse(value)
    except PydanticCustomError as error:
        raise InputError(f'{label}: "{value}": {error.message()}') from None


def _law(label: str, given: GivenVariable, kind: Quantity, start: float) -> Law:
    if given.law == "normal":
        if given.deviation is None or given.low is not None or given.high is not None:
            raise InputError(f"{label}: a normal distribution is about the machine's own value; give deviation, no low or high")
        deviation = _parsed(
            f"{label}.deviation", Quantity(kind.dimension, kind.si, kind.written, positive=True), given.deviation
        )
        return Normal(start, deviation)
    if given.deviation is not None:
        raise InputError(f'{label}.deviation: goes with law = "normal"')
    if given.low is None or given.high is None:
        raise InputError(f"{label}: needs low and high, or choices")
    low, high = _parsed(f"{label}.low", kind, given.low), _parsed(f"{label}.high", kind, given.high)
    if not low < high:
        raise InputError(f"{label}: runs from {kind.write(low)} to {kind.write(high)}; low must be below high")
    if given.law == "log-uniform":
        if low <= 0:
            raise InputError(f'{label}.low: {kind.write(low)}; must be above zero with law = "log-uniform"')
        return LogUniform(low, high)
    return Uniform(low, high)


def _choice(
    label: str, name: str, given: GivenVariable, kinds: Sequence[Quantity], count: int, actions: tuple[Action | None, ...]
) -> Variable:
    if given.low is not None or given.high is not None or given.deviation is not None or given.law != "uniform":
        raise InputError(f"{label}: has choices; low, high, law and deviation go without")
    width = len(kinds)
    rows, labels = [], []
    for place, choice in enumerate(given.choices or (), 1):
        key = f"{label}.choices.{place}"
        parts = choice if isinstance(choice, list) else [choice]
        if isinstance(choice, list) and len(parts) != width:
            told = f"[{', '.join(map(str, parts))}]: {len(parts)} given, {width} needed"
            raise InputError(f"{key}: {told}; a value that all are to have stands without brackets")
        values = [_parsed(key, kind, part) for kind, part in zip(kinds, parts * (width // len(parts)), strict=True)]
        rows.append(tuple(values * (count // width)))
        labels.append(" × ".join(dict.fromkeys(str(part) for part in parts)))
    if len(set(rows)) < len(rows):
        raise InputError(f"{label}.choices: the same choice is given twice")
    if given.steps is not None:
        raise InputError(f"{label}: has choices; a grid takes each of them, without steps")
    return Variable(name, CHOICE, Choices(len(rows)), len(rows), tuple(rows), tuple(labels), actions)


def machine_of(machine: Machine, place: int, variables: Sequence[Variable], design: Sequence[Any]) -> Machine:
    """A machine with the values of a design.

    Args:
        machine: the machine as described.
        place: which of the study's machines it is.
        variables: what varies.
        design: d values; numbers, NumPy arrays (n,) of as many designs, or what JAX traces.
    """
    numbers, structure = jax.tree.flatten(machine)
    for is_factor in (False, True):
        for leaf, value in _values(place, variables, design, is_factor):
            numbers[leaf] = numbers[leaf] * value if is_factor else value
    made: Machine = jax.tree.unflatten(structure, numbers)
    return made


def _values(place: int, variables: Sequence[Variable], design: Sequence[Any], is_factor: bool) -> Iterator[tuple[int, Any]]:
    for variable, value in zip(variables, design, strict=True):
        action = variable.actions[place]
        if action is None or action.is_factor != is_factor:
            continue
        for column, leaf in enumerate(action.leaves):
            yield leaf, _chosen(variable.choices, column, value) if variable.is_discrete else value


def _chosen(choices: tuple[tuple[float, ...], ...], column: int, value: Any) -> Any:
    values = [row[column] for row in choices]
    if isinstance(value, jax.Array):
        return jnp.asarray(values)[value.astype(int)]
    return np.asarray(values)[np.asarray(value, dtype=int)]
