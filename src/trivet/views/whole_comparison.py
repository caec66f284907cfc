"""Machines side by side, static and dynamic."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.table import Table

from trivet.study.comparison import HELD
from trivet.study.dynamic_comparison import TRANSLATIONS
from trivet.study.whole_comparison import WholeComparison
from trivet.views import comparison, dynamic_comparison
from trivet.views.layout import table, wrapping


def tables(result: WholeComparison) -> Iterator[Any]:
    """The static half, then the dynamic one, and the answer in short."""
    yield from comparison.tables(result.static)
    if result.dynamic is not None:
        yield from dynamic_comparison.tables(result.dynamic)
    elif result.missing:
        yield f"No dynamic comparison: {result.missing}"
    yield _in_short(result)


def _in_short(result: WholeComparison) -> Table:
    """All machines in order, number by number."""
    title = "in short, N/µm: means over the points, least dynamic stiffness at home; the stiffest first"
    found = table(title, "number", "machines", left=2)
    orders = {q: {name: own[q].mean for name, own in result.static.samples().items()} for q in HELD}
    if result.dynamic is not None:
        for axis in TRANSLATIONS:
            least = {own.machine: own.along(axis) for own in result.dynamic.described}
            orders[f"D_{axis}{axis}"] = {name: one.stiffness for name, one in least.items() if one is not None}
    for quantity, values in orders.items():
        ordered = sorted(values, key=lambda name: -values[name])
        found.add_row(quantity, " > ".join(f"{name} {values[name] / 1e6:.4g}" for name in ordered))
    return wrapping(found)


def as_json(result: WholeComparison) -> dict[str, Any]:
    """The static half, and the dynamic one under a key of its own."""
    dynamic = None if result.dynamic is None else dynamic_comparison.as_json(result.dynamic)
    return comparison.as_json(result.static) | {"dynamics": dynamic, "dynamics_missing_because": result.missing or None}
