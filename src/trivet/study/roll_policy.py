"""How the roll about the platform normal is chosen where a study leaves it open."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, nearest
from trivet.model import Machine
from trivet.space.surface import Surface
from trivet.statics.best_roll import ROLLS, best_roll
from trivet.statics.objective import objective

Array = NDArray[Any]


class RollPolicy(Protocol):
    """How the roll is chosen at every point."""

    @property
    def name(self) -> str:
        """As people write it."""
        ...

    def choose(self, machine: Machine, surface: Surface, signs: Any, /) -> Array:
        """Rolls (n,) in rad for a machine, a surface and signs; NaN where none is reached."""
        ...


class _Rule(NamedTuple):
    """A policy."""

    name: str
    choose: Callable[[Machine, Surface, Any], Array]


def roll_policy(roll: str | float, rolls: int = ROLLS, progress: Callable[[int], None] = lambda points: None) -> RollPolicy:
    """Read a policy for the roll.

    Args:
        roll: an angle (rad) for a fixed roll; "-alpha" for a roll against the azimuth, so that the platform leans without
            spinning; "best K_xx" (or any other objective) for the roll of greatest stiffness.
        rolls: rolls of the first grid of a best roll.
        progress: called with the number of points done of a best roll.

    Raises:
        InputError: for anything else.
    """
    if not isinstance(roll, str):
        if not math.isfinite(roll):
            raise InputError(f"roll {roll}: a fixed roll is a finite angle")
        return _Rule(f"{math.degrees(roll):.6g} deg", lambda machine, surface, signs: np.full(len(surface), float(roll)))
    if roll == "-alpha":
        return _Rule(roll, lambda machine, surface, signs: -surface.azimuth)
    word, _, name = roll.partition(" ")
    if word != "best":
        raise InputError(
            f'roll "{roll}" is not known: an angle, -alpha or best OBJECTIVE{nearest(roll, ("-alpha", "best K_xx"))}'
        )
    scalar = objective(name or "K_xx")

    def choose_best(machine: Machine, surface: Surface, signs: Any) -> Array:
        return best_roll(machine, surface, signs, scalar, rolls, progress).roll

    return _Rule(f"best {scalar.name}", choose_best)
