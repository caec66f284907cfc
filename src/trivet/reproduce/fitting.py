"""Whether what is kept can be of an item: a file is not believed because it is whole."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

from trivet.errors import InputError
from trivet.reproduce.found import Found
from trivet.reproduce.numbers import unit_named
from trivet.reproduce.paper import Item


def misfit(item: Item, found: Found) -> str:
    """What does not fit, the first of it; empty where all does."""
    return next(_misfits(item, found), "")


def _misfits(item: Item, found: Found) -> Iterator[str]:
    if not found.ours:
        yield "holds no numbers"
    machines: dict[tuple[str, str], list[str]] = defaultdict(list)
    kinds: dict[str, set[str]] = defaultdict(set)
    for own in found.ours:
        machines[own.quantity, own.setting].append(own.machine)
        try:
            kinds[own.quantity].add(unit_named(own.unit).quantity.si)
        except InputError as error:
            yield f"tells {own.quantity} in a unit that is none: {error}"
        if own.value is not None and not math.isfinite(own.value):
            yield f"tells {own.value} for {own.quantity} of {own.machine}"
    for asked in item.asked:
        kinds[asked.quantity] |= {number.unit.quantity.si for number in asked.paper.values() if number is not None}
    for quantity, own_kinds in kinds.items():
        if len(own_kinds) > 1:
            yield f"tells {quantity} in units of several kinds"
    needed = {asked.quantity for asked in item.asked} | {asked.ordered_by for asked in item.asked}
    needed |= {quantity for claim in item.claims for quantity in claim.quantities}
    for missing in sorted(needed - {quantity for quantity, _ in machines}):
        yield f"holds no {missing}"
    for (quantity, setting), names in machines.items():
        if len(set(names)) < len(names):
            yield f"tells {quantity} of one machine twice, {setting}"
        if quantity in needed and set(names) != set(item.machines):
            yield f"tells {quantity} of other machines, {setting}"
    if any(len(series.x) != len(series.y) for chart in found.charts for series in chart.series):
        yield "holds a curve whose points are not pairs"
