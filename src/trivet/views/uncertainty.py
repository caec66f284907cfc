"""Uncertain quantities, what makes them so, and orderings, as tables and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from trivet.design.engine import Outcome
from trivet.design.laws import Choices, LogUniform, Normal
from trivet.design.orderings import Share
from trivet.design.uncertainty import Uncertainty
from trivet.design.variables import Variable
from trivet.views.fitted import Fitted
from trivet.views.layout import more, table, wrapping
from trivet.views.si import finite, key
from trivet.views.sweep import design_json

INTERVALS = (
    "95 % of a share: Wilson's interval of so many independent samples; these are points of a Sobol sequence, which as a rule "
    "come nearer"
)

ORDERS = 6
"""Orders of all machines that are told of a quantity."""


def tables(result: Uncertainty, outcome: Outcome) -> Iterator[Any]:
    """Variables, how quantities are spread, what makes them so in two ways, and orderings of machines."""
    statuses = "; ".join(f"{count:,} {word}" for word, count in result.swept.statuses.items())
    base, designs = result.sampling.base, result.swept.count
    yield f"{', '.join(result.short_names)}: {base:,} base samples, {designs:,} designs, {statuses}"
    yield _variables(result)
    yield _spreads(result)
    columns = range(len(result.study.columns))
    shares = [_own(result, k).shares[_row(result, k)] for k in columns]
    yield _by_variable(result, "first order at the machine as described: parts of the variance", [_percents(s) for s in shares])
    slopes = [_own(result, k).elasticities[_row(result, k)] for k in columns]
    yield _by_variable(result, "relative change of a quantity per relative change", [[_signed(v) for v in s] for s in slopes])
    first = [_margins(one.first, one.first_margin) for one in result.indices]
    yield _by_variable(result, "Sobol indices, of the variable alone (95 %)", first)
    total = [_margins(one.total, one.total_margin) for one in result.indices]
    yield _by_variable(result, "Sobol indices, with all that it does together with others (95 %)", total)
    yield from _notes(result)
    if result.pairs:
        yield _pairs(result)
        yield _orders(result)
        yield INTERVALS
    yield from (f"mended: {fault}" for fault in outcome.mended)
    yield from (f"left out: {failure}" for failure in outcome.failures)


def law_words(variable: Variable) -> str:
    """How a variable is spread."""
    if isinstance(variable.law, Choices):
        return f"one of {variable.law.count}"
    if isinstance(variable.law, Normal):
        return f"normal, deviation {variable.written(variable.law.deviation)}"
    return "log-uniform" if isinstance(variable.law, LogUniform) else "uniform"


def _variables(result: Uncertainty) -> Any:
    rows = table("unknowns, independent of each other", "", "spread", "from", "to", left=2)
    for one in result.study.variables:
        if one.is_discrete:
            rows.add_row(one.name, law_words(one), one.labels[0], one.labels[-1])
        elif isinstance(one.law, Normal):
            rows.add_row(one.name, f"{law_words(one)} about {one.written(one.law.middle)}", "", "")
        else:
            rows.add_row(one.name, law_words(one), one.written(one.law.low), one.written(one.law.high))
    return wrapping(rows, 1)


def _spreads(result: Uncertainty) -> Any:
    heads = ("samples", "as described", "mean", "5 %", "50 %", "95 %", "deviation", "to first order")
    rows = table(f"quantities over {result.samples:,} samples", "", "unit", *heads, left=2)
    for k, (name, one) in enumerate(zip(result.column_names, result.spreads, strict=True)):
        kind = result.study.columns[k].asked.kind
        values = (result.described(k), one.mean, *one.quantiles, one.deviation, result.deviation(k))
        rows.add_row(name, kind.symbol, f"{one.samples:,}", *(kind.number(value, 4) for value in values))
    return Fitted(rows, names=2)


def _by_variable(result: Uncertainty, title: str, cells: Sequence[Sequence[str]]) -> Any:
    """A row per quantity, a column per variable; a dash by one that the machine has no such number of."""
    variables = result.study.variables
    rows = table(title, "", *(variable.name for variable in variables))
    for name, column, row in zip(result.column_names, result.study.columns, cells, strict=True):
        rows.add_row(name, *(cell if one.acts_on(column.place) else "-" for one, cell in zip(variables, row, strict=True)))
    return Fitted(rows)


def _own(result: Uncertainty, column: int) -> Any:
    return result.first[result.study.columns[column].place]


def _row(result: Uncertainty, column: int) -> int:
    return column // len(result.study.subjects)


def _percents(values: np.ndarray) -> list[str]:
    return [f"{100 * v:.1f} %" if np.isfinite(v) else "-" for v in values]


def _signed(value: float) -> str:
    return f"{value:+.3f}" if np.isfinite(value) else "-"


def _margins(values: np.ndarray, margins: np.ndarray) -> list[str]:
    return [f"{v + 0.0:.3f} ± {m:.3f}" if np.isfinite(v) else "-" for v, m in zip(values, margins, strict=True)]


def _notes(result: Uncertainty) -> Iterator[str]:
    """What has no indices, and of which samples others are."""
    names = [one.name for one in result.study.variables if one.is_discrete]
    if names:
        yield f"to first order there is nothing of choices: {', '.join(names)}"
    for place, machine in enumerate(result.short_names):
        for own in result.study.replaced(place):
            choice = own.written(result.first[place].design[result.study.variables.index(own)])
            yield f"{machine} as described has {own.name} {choice} here: its own is none of the choices"
    for name, one in zip(result.column_names, result.indices, strict=True):
        if one.left_out:
            rest = (
                "the indices are of the rest, in which variables are no longer independent" if one.has_values else "no indices"
            )
            yield f"{name}: {one.left_out:,} of {one.base:,} base samples lack a value; {rest}"


def _share(one: Share) -> tuple[str, str, str]:
    if not one.samples:
        return "0", "-", "-"
    low, high = one.interval
    return f"{one.samples:,}", f"{100 * one.value:.1f} %", f"{100 * low:.1f} to {100 * high:.1f} %"


def _pairs(result: Uncertainty) -> Any:
    rows = table("how often one machine has more than another", "", "", "samples", "share", "95 %", "as described", left=2)
    names = result.short_names
    for k, (own, group) in enumerate(zip(result.study.quantities, result.pairs, strict=True)):
        for pair in group:
            first, second = (result.described(k * len(names) + place) for place in (pair.first, pair.second))
            holds = ("yes" if first > second else "no") if np.isfinite([first, second]).all() else "-"
            rows.add_row(own.name, f"{names[pair.first]} > {names[pair.second]}", *_share(pair.greater), holds)
    return wrapping(rows, 1)


def _orders(result: Uncertainty) -> Any:
    rows = table("orders of all machines", "", "", "samples", "share", "95 %", left=2)
    names = result.short_names
    for own, group in zip(result.study.quantities, result.orders, strict=True):
        for order in group[:ORDERS]:
            rows.add_row(own.name, " > ".join(names[place] for place in order.places), *_share(order.share))
        more(rows, len(group), ORDERS)
    return wrapping(rows, 1)


def as_json(result: Uncertainty, outcome: Outcome) -> dict[str, Any]:
    """The same for programs, in SI."""
    study = result.study
    return {
        "store": str(result.swept.results.path),
        "machines": study.names,
        "base_samples": result.sampling.base,
        "samples": result.samples,
        "designs": result.swept.count,
        "statuses": result.swept.statuses,
        "variables": [_variable_json(one) for one in study.variables],
        "as_described": [design_json(study, place, one.design) for place, one in enumerate(result.first)],
        "quantities": [_quantity_json(result, k) for k in range(len(study.columns))],
        "pairs": [
            {
                "quantity": own.name,
                "first": study.names[pair.first],
                "second": study.names[pair.second],
                **_share_json(pair.greater),
                "equal": pair.equal,
            }
            for own, group in zip(study.quantities, result.pairs, strict=bool(result.pairs))
            for pair in group
        ],
        "orders": [
            {"quantity": own.name, "order": [study.names[place] for place in order.places], **_share_json(order.share)}
            for own, group in zip(study.quantities, result.orders, strict=bool(result.orders))
            for order in group
        ],
        "chunks": {"done": outcome.done, "of": outcome.total},
        "mended": [str(fault) for fault in outcome.mended],
        "failures": [str(failure) for failure in outcome.failures],
    }


def _variable_json(one: Variable) -> dict[str, Any]:
    if one.is_discrete:
        return {"name": one.name, "choices": list(one.labels)}
    law = {"law": law_words(one).partition(",")[0], "unit": one.kind.si, "deviation": one.law.deviation}
    ends = {"middle": one.law.middle} if isinstance(one.law, Normal) else {"low": one.law.low, "high": one.law.high}
    return {"name": one.name, **law, **ends}


def _quantity_json(result: Uncertainty, column: int) -> dict[str, Any]:
    own, spread, index = result.study.columns[column], result.spreads[column], result.indices[column]
    first, row = _own(result, column), _row(result, column)
    kind, variables = own.asked.kind, result.study.variables

    def by_variable(values: np.ndarray) -> dict[str, Any]:
        return {
            one.name: finite(value) if one.acts_on(own.place) else None for one, value in zip(variables, values, strict=True)
        }

    return {
        "name": own.asked.name,
        "machine": result.study.names[own.place],
        "unit": kind.si,
        "samples": spread.samples,
        key("mean", kind): finite(spread.mean),
        key("deviation", kind): finite(spread.deviation),
        **{key(f"quantile_{q}", kind): finite(v) for q, v in zip(("05", "50", "95"), spread.quantiles, strict=True)},
        "first_order": {
            key("value", kind): finite(result.described(column)),
            key("deviation", kind): finite(result.deviation(column)),
            "slopes_SI": by_variable(first.slope[row]),
            "shares": by_variable(first.shares[row]),
            "elasticities": by_variable(first.elasticities[row]),
        },
        "sobol": {
            "base_samples_left_out": index.left_out,
            "first": by_variable(index.first),
            "first_margin": by_variable(index.first_margin),
            "total": by_variable(index.total),
            "total_margin": by_variable(index.total_margin),
        },
    }


def _share_json(one: Share) -> dict[str, Any]:
    return {
        "count": one.times,
        "samples": one.samples,
        "share": finite(one.value),
        "interval_of_independent_samples": finite(one.interval),
    }
