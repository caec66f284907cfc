"""A sweep as tables and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.design.engine import Outcome
from trivet.design.sweep import Summary, Sweep
from trivet.model.quantity import Quantity
from trivet.views.layout import table
from trivet.views.quantity import key, number, unit
from trivet.views.si import finite


def tables(result: Sweep, outcome: Outcome) -> Iterator[Any]:
    """What the designs have come to, every quantity in short, and the designs at both of its ends."""
    done = result.results.done
    yield f"{', '.join(result.study.names)}: {result.count:,} designs, {_words(result.statuses)}"
    yield _quantities(result)
    yield _designs(result)
    for fault in outcome.mended:
        yield f"mended: {fault}"
    for failure in outcome.failures:
        yield f"left out: {failure}"
    if not done.all():
        yield f"{int((~done).sum())} of {len(done)} chunks are missing; the same command goes on with them"


def _words(statuses: dict[str, int]) -> str:
    return "; ".join(f"{count:,} {word}" for word, count in statuses.items())


def _kinds(result: Sweep) -> dict[str, Quantity]:
    return {column.name: column.asked.kind for column in result.study.columns}


def _quantities(result: Sweep) -> Any:
    kinds = _kinds(result)
    rows = table("quantities over the designs", "", "unit", "designs", "least", "mean", "deviation", "greatest", left=2)
    for one in result.summaries:
        kind = kinds[one.name]
        values = (number(kind, value) for value in (one.least, one.mean, one.deviation, one.greatest))
        rows.add_row(one.name, unit(kind), f"{one.designs:,}", *values)
    return rows


def _designs(result: Sweep) -> Any:
    rows = table("designs at the ends", "", "at its", "design", *result.variables, left=2)
    for one in result.summaries:
        for end, index in _ends(one):
            values = zip(result.study.variables, result.design(index), strict=True)
            rows.add_row(one.name, end, str(index), *(variable.written(value) for variable, value in values))
    return rows


def _ends(one: Summary) -> list[tuple[str, int]]:
    if not one.designs or one.least == one.greatest:
        return []
    return [("least", one.at_least), ("greatest", one.at_greatest)]


def as_json(result: Sweep, outcome: Outcome) -> dict[str, Any]:
    """The same for programs, in SI; the numbers of all designs are in the store."""
    kinds = _kinds(result)
    return {
        "store": str(result.results.path),
        "machines": result.study.names,
        "designs": result.count,
        "statuses": result.statuses,
        "chunks": {"done": outcome.done, "of": outcome.total},
        "quantities": [_quantity_json(result, one, kinds[one.name]) for one in result.summaries],
        "mended": [str(fault) for fault in outcome.mended],
        "failures": [str(failure) for failure in outcome.failures],
    }


def _quantity_json(result: Sweep, one: Summary, kind: Quantity) -> dict[str, Any]:
    def design(index: int) -> Any:
        return None if not one.designs else {"design": index} | design_json(result.study.variables, result.design(index))

    return {
        "name": one.name,
        "unit": kind.si,
        "designs": one.designs,
        "least": finite(one.least),
        "mean": finite(one.mean),
        "deviation": finite(one.deviation),
        "greatest": finite(one.greatest),
        "least_at": design(one.at_least),
        "greatest_at": design(one.at_greatest),
    }


def design_json(variables: Any, design: np.ndarray) -> dict[str, Any]:
    """Values of a design by key, choices in words."""
    return {
        (variable.name if variable.is_discrete else key(variable.name, variable.kind)): (
            variable.labels[int(value)] if variable.is_discrete else float(value)
        )
        for variable, value in zip(variables, design, strict=True)
    }
