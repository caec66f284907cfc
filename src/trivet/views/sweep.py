"""A sweep as tables and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.table import Table

from trivet.design.engine import Outcome
from trivet.design.study import PARTLY, STATUSES, Column, Study
from trivet.design.sweep import Summary, Sweep
from trivet.views.fitted import Fitted
from trivet.views.layout import table
from trivet.views.si import finite, key

REACHED_ALONE = 'of a design the check points that it reaches count alone; the quantity "reached" tells their share'


def tables(result: Sweep, outcome: Outcome) -> Iterator[Any]:
    """What the designs have come to, every quantity in short, and the designs at both of its ends."""
    done = result.results.done
    yield f"{', '.join(result.study.names)}: {result.count:,} designs, {_words(result.statuses)}"
    yield _quantities(result)
    ends = _designs(result)
    if ends.row_count:
        yield Fitted(ends, names=2, note=REACHED_ALONE if STATUSES[PARTLY] in result.statuses else "")
    for fault in outcome.mended:
        yield f"mended: {fault}"
    for failure in outcome.failures:
        yield f"left out: {failure}"
    if not done.all():
        yield f"{int((~done).sum())} of {len(done)} chunks are missing; the same command goes on with them"


def _words(statuses: dict[str, int]) -> str:
    return "; ".join(f"{count:,} {word}" for word, count in statuses.items())


def _quantities(result: Sweep) -> Any:
    rows = table("quantities over the designs", "", "unit", "designs", "least", "mean", "deviation", "greatest", left=2)
    for one, column in zip(result.summaries, result.study.columns, strict=True):
        kind = column.asked.kind
        values = (kind.number(value) for value in (one.least, one.mean, one.deviation, one.greatest))
        rows.add_row(one.name, kind.symbol, f"{one.designs:,}", *values)
    return Fitted(rows, names=2)


def _designs(result: Sweep) -> Table:
    rows = table("designs at the ends", "", "at its", "design", *result.variables, left=2)
    for one, column in zip(result.summaries, result.study.columns, strict=True):
        for end, index in _ends(one):
            rows.add_row(one.name, end, str(index), *design_words(result.study, column.place, result.design(index)))
    return rows


def _ends(one: Summary) -> list[tuple[str, int]]:
    if not one.designs or one.least == one.greatest:
        return []
    return [("least", one.at_least), ("greatest", one.at_greatest)]


def as_json(result: Sweep, outcome: Outcome) -> dict[str, Any]:
    """The same for programs, in SI; the numbers of all designs are in the store."""
    return {
        "store": str(result.results.path),
        "machines": result.study.names,
        "designs": result.count,
        "statuses": result.statuses,
        "chunks": {"done": outcome.done, "of": outcome.total},
        "quantities": [_quantity_json(result, *own) for own in zip(result.summaries, result.study.columns, strict=True)],
        "mended": [str(fault) for fault in outcome.mended],
        "failures": [str(failure) for failure in outcome.failures],
    }


def _quantity_json(result: Sweep, one: Summary, column: Column) -> dict[str, Any]:
    def design(index: int) -> Any:
        return None if not one.designs else {"design": index} | design_json(result.study, column.place, result.design(index))

    return {
        "name": one.name,
        "unit": column.asked.kind.si,
        "designs": one.designs,
        "least": finite(one.least),
        "mean": finite(one.mean),
        "deviation": finite(one.deviation),
        "greatest": finite(one.greatest),
        "least_at": design(one.at_least),
        "greatest_at": design(one.at_greatest),
    }


def design_words(study: Study, place: int, design: np.ndarray) -> list[str]:
    """Values of a design of one of the machines; a dash for a variable that it has no number of."""
    values = zip(study.variables, design, strict=True)
    return [variable.written(value) if variable.acts_on(place) else "-" for variable, value in values]


def design_json(study: Study, place: int, design: np.ndarray) -> dict[str, Any]:
    """Values of a design of one of the machines by key, choices in words; null for a variable that it has no number of."""
    found: dict[str, Any] = {}
    for variable, value in zip(study.variables, design, strict=True):
        own = variable.labels[int(value)] if variable.is_discrete else float(value)
        name = variable.name if variable.is_discrete else key(variable.name, variable.kind)
        found[name] = own if variable.acts_on(place) else None
    return found
