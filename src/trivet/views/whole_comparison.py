"""Machines side by side, static and dynamic."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from trivet.study.whole_comparison import WholeComparison
from trivet.views import comparison, dynamic_comparison


def tables(result: WholeComparison) -> Iterator[Any]:
    """The static half, then the dynamic one."""
    yield from comparison.tables(result.static)
    if result.dynamic is not None:
        yield from dynamic_comparison.tables(result.dynamic)
    elif result.missing:
        yield f"No dynamic comparison: {result.missing}"


def as_json(result: WholeComparison) -> dict[str, Any]:
    """The static half, and the dynamic one under a key of its own."""
    dynamic = None if result.dynamic is None else dynamic_comparison.as_json(result.dynamic)
    return comparison.as_json(result.static) | {"dynamics": dynamic, "dynamics_missing_because": result.missing or None}
