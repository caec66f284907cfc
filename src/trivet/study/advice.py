"""Advice: the smallest change of a dimension that lets a machine pass where travel, bodies or a demanded sigma_min stop it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np

from trivet.errors import TrivetError
from trivet.model import Machine, dimensions, document_of, parse
from trivet.model.paths import get, join, leaves
from trivet.study.plan import Plan, replanned
from trivet.study.roll_grid import best_way, field_of
from trivet.study.spare import Margin, demanded, slopes, spare, without

IN_HAND = 0.005
"""What is to be left of a margin beyond what is demanded."""
TRIED, STEPS = 6, (1.0, 1.5, 2.5)
"""Dimensions that are tried, those that need the least change first, and how much of what the slope asks for."""
LARGEST = 1.0
"""Part of a dimension, above which no change is worth a try."""
HALVINGS = 5
"""Between a change that does not serve and one that does."""
DIGITS = 5
"""Of the values that are tried and told."""
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
    mends: Margin
    """What stops the machine now, and what the change is to give more of."""
    written: tuple[str, str]
    """Both values with their unit, as the machine file writes them."""
    option: tuple[str, str]
    """The option of the command that makes the change, and its value."""
    part: float
    """How great the change is: in parts of the dimension, of an end of travel in parts of the travel."""


def advice(plan: Plan, machine: Machine | None = None) -> tuple[Change, ...]:
    """Which dimension to change so that a way keeps all margins, those that need the least change first.

    Of all ways that one kind of margin (travel, clearance, sigma_min) alone forbids, or else all kinds together, the one whose
    worst margin is greatest is taken; the slopes of that margin by the dimensions, at its worst place, estimate what each would
    have to be (as if the way stayed there, which holds to first order where one joint or pair of bodies alone decides: the
    envelope theorem).  Each is then tried, and narrowed down by halving.

    Args:
        plan: one without a way.
        machine: as its file has it; only its dimensions are told of.  That of the plan when not given, whose chains are other
            ones where neutral axes that differ from copy to copy have been laid down.

    Returns:
        None of them where no way exists even without these margins (the Type 2 singularities are in the way, or chains do not
        close), or there is one already.
    """
    if plan.is_possible:
        return ()
    asked = demanded(plan.rules)
    wishes = [wish for margin in asked for wish in _wishes(plan, (margin,))] or list(_wishes(plan, asked))
    known = {HEIGHT, *dimensions(plan.machine if machine is None else machine)}
    least: dict[str, _Wish] = {}
    for wish in sorted(wishes, key=lambda wish: wish.size):
        if wish.size <= LARGEST and wish.place.name in known and _may_be(plan, wish):
            least.setdefault(wish.place.name, wish)
    changes = [_tried(plan, wish) for wish in list(least.values())[:TRIED]]
    return tuple(sorted(changes, key=lambda change: (not change.passes, change.part)))


class _Place(NamedTuple):
    """Where a dimension stands, and how it is written."""

    name: str
    keys: tuple[str | int, ...] = ()
    """In the document of a machine; none of the height of the sphere."""
    entry: int | None = None
    """Which of several numbers in a row it is."""
    unit: str = "mm"
    per_si: float = 1e3
    """The number that is written for one in SI."""

    @classmethod
    def of(cls, machine: Machine, name: str) -> _Place:
        """That of a dimension of a machine."""
        document = document_of(with_dimension(machine, name, 1.0))
        places = {join(document, keys): keys for keys in leaves(document)}
        row, _, last = name.rpartition(".")
        keys, entry = (places[name], None) if name in places else (places[row], int(last) - 1)
        number, _, unit = _row(document, keys)[entry or 0].partition(" ")
        return cls(name, keys, entry, unit, float(number))

    def rounded(self, value: float) -> float:
        """A value (SI) as it is written."""
        return float(f"{value * self.per_si:.{DIGITS}g}") / self.per_si

    def text(self, value: float) -> str:
        """A value (SI) with its unit."""
        return f"{value * self.per_si:.{DIGITS}g} {self.unit}".strip()

    def option(self, machine: Machine, value: float) -> tuple[str, str]:
        """How the command is told a value (SI)."""
        if not self.keys:
            return "--height", self.text(value)
        document = document_of(machine)
        row = _row(document, self.keys)
        row[self.entry or 0] = self.text(value)
        return "--set", f"{join(document, self.keys)}={', '.join(row)}"


def _row(document: Any, keys: tuple[str | int, ...]) -> list[str]:
    """The numbers at a place of a document, one or more."""
    found = get(document, keys)
    found = found["value"] if isinstance(found, dict) else found
    return [str(value) for value in found] if isinstance(found, list) else [str(found)]


class _Wish(NamedTuple):
    """What a slope asks of a dimension."""

    place: _Place
    mends: Margin
    now: float
    wanted: float
    """To first order, SI."""
    great: float
    """A change by which counts as one, SI: the dimension itself, or its travel of an end of travel."""

    @property
    def size(self) -> float:
        """How great the change is."""
        return abs(self.wanted - self.now) / self.great

    def at(self, part: float) -> float:
        """The value with some part of the change, as it is written."""
        return self.place.rounded(self.now + part * (self.wanted - self.now))


def _wishes(plan: Plan, margins: tuple[Margin, ...]) -> Iterator[_Wish]:
    """What would mend margins, all of which may be below what is demanded; nothing where no way leads even so."""
    field = field_of(without(plan.rules, margins), plan.grid)
    allowed = np.nonzero(field.side)
    if not margins or not len(allowed[0]):
        return
    touch = plan.grid.at(*allowed)
    field.value[allowed] = np.min([spare(plan.rules, touch, margin) for margin in margins], axis=0)
    way, _, _ = best_way(field, plan.start, all_round=True)
    if way is None:
        return
    k = int(field.value[way.rows, way.columns % plan.grid.columns].argmin())
    worst = plan.grid.at(way.rows[[k]], way.columns[[k]])
    left = {margin: float(spare(plan.rules, worst, margin)[0]) for margin in margins}
    mends = min(margins, key=lambda margin: left[margin])
    by_machine, by_rise = slopes(plan.rules, worst, mends)
    lacking = IN_HAND - left[mends]
    now, by = dimensions(plan.machine), dimensions(by_machine)
    places = [(_Place.of(plan.machine, name), float(now[name]), float(by[name])) for name in now if float(by[name])]
    if plan.grid.poses is None:  # a path is where it is
        places.append((_Place(HEIGHT), float(worst.z[0]), by_rise))
    for place, value, slope in places:
        if slope and math.isfinite(slope):
            yield _Wish(place, mends, value, value + lacking / slope, _great(plan.machine, place, value, now))


def _great(machine: Machine, place: _Place, value: float, now: dict[str, Any]) -> float:
    """A change of a dimension that counts as one, SI."""
    if place.entry is not None:  # one of several: the ends of a travel
        row = place.name.rpartition(".")[0]
        ends = [float(own) for name, own in now.items() if name.rpartition(".")[0] == row]
        return max(ends) - min(ends)
    return abs(value) or (1.0 if place.unit == "deg" else float(machine.characteristic_length))


def _tried(plan: Plan, wish: _Wish) -> Change:
    low, needed, passes = 0.0, wish.at(1.0), False
    for high in STEPS:
        passes = _passes(plan, wish.place, wish.at(high))
        if passes:
            for _ in range(HALVINGS):
                middle = (low + high) / 2
                low, high = (low, middle) if _passes(plan, wish.place, wish.at(middle)) else (middle, high)
            needed = wish.at(high)
            break
        low = high
    place, written = wish.place, (wish.place.text(wish.now), wish.place.text(needed))
    part = abs(needed - wish.now) / wish.great
    return Change(place.name, wish.now, needed, passes, wish.mends, written, place.option(plan.machine, needed), part)


def _may_be(plan: Plan, wish: _Wish) -> bool:
    return wish.place.name == HEIGHT or _changed(plan.machine, wish.place, wish.at(1.0)) is not None


def _passes(plan: Plan, place: _Place, value: float) -> bool:
    try:
        if place.name == HEIGHT:
            return replanned(plan, height=value).is_possible
        changed = _changed(plan.machine, place, value)
        return changed is not None and replanned(plan, machine=changed).is_possible
    except TrivetError:
        return False


def _changed(machine: Machine, place: _Place, value: float) -> Machine | None:
    """A machine with one of its dimensions changed; None for numbers that no machine file may have."""
    changed = with_dimension(machine, place.name, value)
    try:
        parse(document_of(changed.renamed("changed")))
    except TrivetError:
        return None
    return changed


def with_dimension(machine: Machine, dimension: str, value: float) -> Machine:
    """A machine with one of its `dimensions` changed (SI), as yet unchecked."""
    at, structure = jax.tree.flatten(machine)
    at[list(dimensions(machine)).index(dimension)] = value
    changed: Machine = jax.tree.unflatten(structure, at)
    return changed
