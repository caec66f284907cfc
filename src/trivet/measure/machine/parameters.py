"""Numbers of a machine that measurements are to correct: by key path, with what is known of them beforehand.

Every parameter is handled on a scale of its own, on which it is a plain number theta: its logarithm where it is above zero and
stays so (a stiffness, a mass, a loss factor), else the number itself (a position, an angle).  On that scale it is known
beforehand as a normal distribution about the value of the machine file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import InputError
from trivet.model import Machine
from trivet.model.numbers import number
from trivet.model.quantity import Quantity

LOSS_FACTOR = "loss_factor"
"""The loss factor of the analysis, of all that has none of its own, by this name."""
LOSS = Quantity("loss factor", "", "", at_least_zero=True)
FACTOR = 3.0
"""Factor within which a number above zero is taken to be known, as a standard deviation, where nothing is said."""


class Free(NamedTuple):
    """A number that may change."""

    path: str
    """Key path in the machine file, or an abbreviation of it; or "loss_factor"."""
    spread: float | None = None
    """Standard deviation of what is known beforehand: relative (0.2 is a factor of 1.2) for what has no sign, else in SI."""
    low: float = -math.inf
    """Bound, SI."""
    high: float = math.inf
    """Bound, SI."""


class Number(NamedTuple):
    """A number of a machine, or the loss factor of the analysis."""

    path: str
    """Key path in full."""
    leaf: int | None
    """Which leaf of the machine it is; None is the loss factor of the analysis."""
    kind: Quantity
    value: float
    """SI."""

    @property
    def is_unsigned(self) -> bool:
        """Whether it is never below zero."""
        return self.kind.positive or self.kind.at_least_zero


@dataclass(frozen=True)
class Parameters:
    """p numbers of a machine that may change."""

    paths: tuple[str, ...]
    leaves: tuple[int | None, ...]
    """Which leaf of the machine each is; None is the loss factor of the analysis."""
    kinds: tuple[Quantity, ...]
    """(p,) their units."""
    start: np.ndarray
    """(p,) values in the machine file, SI."""
    is_log: tuple[bool, ...]
    """Whether theta is the logarithm."""
    spread: np.ndarray
    """(p,) standard deviations beforehand, of theta."""
    bounds: np.ndarray
    """(2, p) least and greatest theta."""

    def __len__(self) -> int:
        return len(self.paths)

    def theta(self, values: Any) -> np.ndarray:
        """(p,) from values in SI."""
        return np.array([math.log(v) if log else float(v) for v, log in zip(values, self.is_log, strict=True)])

    def values(self, theta: Any) -> Any:
        """(p,) in SI; JAX may trace theta."""
        return jnp.where(np.array(self.is_log), jnp.exp(jnp.where(np.array(self.is_log), theta, 0.0)), theta)

    def scale(self, values: np.ndarray) -> np.ndarray:
        """(p,) d value / d theta."""
        return np.where(self.is_log, values, 1.0)

    def applied(self, machine: Machine, loss_factor: Any, theta: Any) -> tuple[Machine, Any]:
        """The machine and the loss factor of the analysis with these numbers; JAX may trace theta."""
        own = self.values(theta)
        leaves, tree = jax.tree.flatten(machine)
        for k, leaf in enumerate(self.leaves):
            if leaf is None:
                loss_factor = own[k]
            else:
                leaves[leaf] = own[k]
        return jax.tree.unflatten(tree, leaves), loss_factor


def parameters(machine: Machine, free: Sequence[Free], loss_factor: float) -> Parameters:
    """What is free, looked up in a machine.

    Raises:
        InputError: for a path that the machine does not have or that is no number, one given twice, bounds without room, or a
            number of either sign without a spread.
    """
    if not free:
        raise InputError("nothing is free to change; name a number of the machine file, such as ball.stiffness")
    paths: list[str] = []
    leaves: list[int | None] = []
    own_kinds: list[Quantity] = []
    start, logs, spreads, bounds = [], [], [], []
    for one in free:
        number = look_up(machine, one.path, loss_factor)
        if number.path in paths:
            raise InputError(f"{one.path}: is named twice as free")
        is_log, spread, low, high = _known(one, number)
        paths.append(number.path)
        leaves.append(number.leaf)
        own_kinds.append(number.kind)
        start.append(number.value)
        logs.append(is_log)
        spreads.append(spread)
        bounds.append((low, high))
    numbers = np.array(start), tuple(logs), np.array(spreads), np.array(bounds).T
    return Parameters(tuple(paths), tuple(leaves), tuple(own_kinds), *numbers)


def look_up(machine: Machine, path: str, loss_factor: float) -> Number:
    """A number of a machine by its key path or an abbreviation, or the loss factor of the analysis.

    Raises:
        InputError: as `model.numbers.number`.
    """
    if path == LOSS_FACTOR:
        return Number(path, None, LOSS, loss_factor)
    return Number(*number(machine, path))


def _known(one: Free, number: Number) -> tuple[bool, float, float, float]:
    """Whether theta is the logarithm, its standard deviation, and its bounds."""
    kind, value = number.kind, number.value
    low, high = max(one.low, 0.0) if number.is_unsigned else one.low, one.high
    if not low <= value <= high or not low < high:
        raise InputError(f"{one.path}: is {kind.write(value)}, outside of its bounds {low:g} to {high:g} {kind.si}".rstrip())
    if one.spread is not None and not (one.spread > 0 and math.isfinite(one.spread)):
        raise InputError(f"{one.path}: spread {one.spread:g}; expected above zero")
    if not number.is_unsigned or value == 0:
        if one.spread is None:
            raise InputError(
                f"{one.path}: is {kind.write(value)}, no factor can change it; say by a spread how well it is known"
            )
        return False, one.spread, low, high
    spread = math.log(FACTOR) if one.spread is None else math.log1p(one.spread)
    return True, spread, math.log(low) if low > 0 else -math.inf, math.log(high) if math.isfinite(high) else math.inf
