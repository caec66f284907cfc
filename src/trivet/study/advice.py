"""Advice: the smallest change of a dimension that lets a machine pass where its joints' travel stops it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import TrivetError
from trivet.kinematics.inverse import inverse
from trivet.kinematics.travel import margin
from trivet.model import Machine, dimensions, document_of
from trivet.model.paths import find
from trivet.reach.certificate import Touch
from trivet.study.plan import Plan, replanned, with_dimension
from trivet.study.roll_grid import RESERVE_TRAVEL, Aim, best_way, field_of

LEAST_SIGMA = 0.05
"""sigma_min below which no way is worth a change of the machine."""
TRIED, STEPS = 6, (1.0, 1.5, 2.5)
"""Dimensions that are tried, those that need the least change first, and how much of what the slope asks for."""
HALVINGS = 5
"""Between a change that does not serve and one that does."""
HEIGHT = "height of the sphere"


@dataclass(frozen=True)
class Change:
    """A change of one dimension, SI."""

    dimension: str
    """Key path in the machine file, or the height of the sphere."""
    now: float
    needed: float
    """As tried; to first order when it does not pass."""
    passes: bool
    """Whether there is a way with it; on the grid, not proven."""
    written: tuple[str, str]
    """Both values with their unit, as the machine file writes them."""

    @property
    def part(self) -> float:
        """How great the change is, in parts of the dimension; infinite where that is zero."""
        return abs(self.needed / self.now - 1) if self.now else math.inf


def advice(plan: Plan) -> tuple[Change, ...]:
    """Which dimension to change so that a way is inside all travel, those that need the least change first.

    Of all ways that only travel forbids the one with the greatest worst margin is taken; the slopes of that margin by the
    dimensions, at its worst place, estimate what each would have to be (as if the way stayed there, which holds to first order
    where one joint alone decides: the envelope theorem).  Each is then tried, and narrowed down by halving.

    Args:
        plan: one without a way.

    Returns:
        None of them where no way exists even without limits, or there is one already.
    """
    if plan.is_possible or not plan.rules.limits:
        return ()
    freer = plan.rules._replace(limits=False, aims=(Aim("travel", None, 1.0),), least_sigma=LEAST_SIGMA)
    field = field_of(freer, plan.grid)
    way, _, _ = best_way(field, plan.start, all_round=True)
    if way is None:
        return ()
    values = field.value[way.rows, way.columns % plan.grid.columns]
    k = int(values.argmin())
    worst = Touch(*(jnp.asarray(c[k]) for c in plan.grid.at(way.rows, way.columns)))
    machine = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), plan.machine)
    slopes, of_height = jax.grad(_margin, argnums=(0, 1))(
        machine, worst.z, worst, plan.rules.radius, np.asarray(plan.rules.signs)
    )
    now = {name: float(value) for name, value in dimensions(plan.machine).items()} | {HEIGHT: float(worst.z)}
    by = {name: float(value) for name, value in dimensions(slopes).items()} | {HEIGHT: float(of_height)}
    lacking = 2 * RESERVE_TRAVEL - float(values[k])
    wanted = {name: now[name] + lacking / slope for name, slope in by.items() if slope and math.isfinite(slope)}
    size = float(plan.machine.characteristic_length)
    order = sorted(wanted, key=lambda name: abs(wanted[name] - now[name]) / (abs(now[name]) or size))
    return tuple(_tried(plan, name, now[name], wanted[name]) for name in order[:TRIED])


def _margin(machine: Machine, height: Any, worst: Touch, radius: float, signs: Any) -> Any:
    pose = worst._replace(z=height).frame(radius)
    return jnp.min(jnp.stack([margin(leg, inverse(leg, pose, signs[k]), pose) for k, leg in enumerate(machine.legs)]))


def _tried(plan: Plan, name: str, now: float, wanted: float) -> Change:
    low = 0.0
    for high in STEPS:
        if _passes(plan, name, now + high * (wanted - now)):
            for _ in range(HALVINGS):
                middle = (low + high) / 2
                low, high = (low, middle) if _passes(plan, name, now + middle * (wanted - now)) else (middle, high)
            value = now + high * (wanted - now)
            return Change(name, now, value, True, _written(plan.machine, name, now, value))
        low = high
    return Change(name, now, wanted, False, _written(plan.machine, name, now, wanted))


def _passes(plan: Plan, name: str, value: float) -> bool:
    try:
        return replanned(plan, name if name != HEIGHT else None, value).is_possible
    except TrivetError:  # beyond what a machine can be
        return False


def _written(machine: Machine, name: str, *values: float) -> tuple[str, str]:
    if name == HEIGHT:
        now, needed = (f"{value * 1e3:.5g} mm" for value in values)
        return now, needed
    whole, _, last = name.rpartition(".")
    path, entry = (whole, int(last) - 1) if last.isdecimal() else (name, None)  # one of several numbers in a row
    found = []
    for value in values:
        document: Any = document_of(with_dimension(machine, name, value))
        for key in find(document, path):
            document = document[key]
        document = document if entry is None else document[entry]
        number, _, unit = str(document).partition(" ")
        size, unit = (1e3 * float(number), "mm") if unit == "m" else (float(number), unit)
        found.append(f"{size:.5g} {unit}".strip())
    return found[0], found[1]
