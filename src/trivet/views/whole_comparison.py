"""Machines side by side, static and dynamic."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import pairwise
from typing import Any

from rich.table import Table

from trivet.study.comparison import HELD, Comparison
from trivet.study.dynamic_comparison import TRANSLATIONS, DynamicComparison
from trivet.study.whole_comparison import WholeComparison
from trivet.views import comparison, dynamic_comparison
from trivet.views.layout import table, wrapping

SIGNIFICANT = 0.05
"""p after Holm's correction up to which the test tells two means apart."""


def tables(result: WholeComparison) -> Iterator[Any]:
    """The static half, then the dynamic one, and the answer in short."""
    yield from comparison.tables(result.static)
    if result.dynamic is not None:
        yield from dynamic_comparison.tables(result.dynamic)
    elif result.missing:
        yield f"No dynamic comparison: {result.missing}"
    means = _means(result.static, result.machines)
    minima = {} if result.dynamic is None else _minima(result.dynamic, result.machines)
    yield _in_short(means | minima)
    yield "\n".join(_meanings(means, minima))


def _in_short(orders: dict[str, str]) -> Table:
    """All machines in order, number by number."""
    found = table("in short, N/µm", "", "the stiffest first", left=2)
    for quantity, order in orders.items():
        found.add_row(quantity, order)
    return wrapping(found)


def _meanings(means: dict[str, str], minima: dict[str, str]) -> Iterator[str]:
    """What the names and signs of that table stand for, as far as they are in it."""
    yield f"{', '.join(means)}: means over the check points"
    if minima:
        yield f"{', '.join(minima)}: minimum dynamic stiffness at home"
    if any(" ≈ " in order for order in (means | minima).values()):
        yield f"≈: not told apart, by Welch's test (p Holm above {SIGNIFICANT:g}) or in the digits shown"


def _means(static: Comparison, machines: tuple[str, ...]) -> dict[str, str]:
    """The order by every mean."""
    orders = {}
    for q in HELD:
        means = {name: own[q].mean for name, own in static.samples().items()}
        alike = {frozenset({t.first, t.second}) for t in static.tests if t.quantity == q and not t.p_holm <= SIGNIFICANT}
        orders[q] = _order(means, machines, 3, alike)
    return orders


def _minima(dynamic: DynamicComparison, machines: tuple[str, ...]) -> dict[str, str]:
    """The order by every minimum dynamic stiffness."""
    orders = {}
    for axis in TRANSLATIONS:
        least = {own.machine: one.stiffness for own in dynamic.described if (one := own.along(axis)) is not None}
        orders[f"D_{axis}{axis}"] = _order(least, machines, 4)
    return orders


def _order(values: dict[str, float], machines: tuple[str, ...], decimals: int, alike: Collection[frozenset[str]] = ()) -> str:
    """Machines by their values in N/m, the greatest first, those without one last; neighbours that are alike unranked."""
    cells = {name: f"{name} {values[name] / 1e6:.{decimals}f}" for name in sorted(values, key=lambda name: -values[name])}
    ranked = next(iter(cells.values()))
    for (a, one), (b, other) in pairwise(cells.items()):
        same = frozenset({a, b}) in alike or one.removeprefix(a) == other.removeprefix(b)
        ranked += f" {'≈' if same else '>'} {other}"
    return ", ".join([ranked, *(f"{name} –" for name in machines if name not in values)])


def as_json(result: WholeComparison) -> dict[str, Any]:
    """The static half, and the dynamic one under a key of its own."""
    dynamic = None if result.dynamic is None else dynamic_comparison.as_json(result.dynamic)
    return comparison.as_json(result.static) | {"dynamics": dynamic, "dynamics_missing_because": result.missing or None}
