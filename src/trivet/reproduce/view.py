"""The reproduction on a terminal, and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from trivet.reproduce.numbers import NONE
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.page import percent
from trivet.reproduce.run import Reproduction
from trivet.views.layout import table
from trivet.views.si import finite


def tables(result: Reproduction) -> Iterator[Any]:
    """Number by number, then what comes out of each table and figure."""
    for outcome in result.outcomes:
        item, rows = outcome.item, [row for row in outcome.rows if row.paper is not None]
        if rows:
            own = table(f"{item.where}: {item.title}", "", "machine", "unit", "paper", "ours", "deviation", "verdict", left=3)
            own.columns[-1].justify = "left"
            for row in rows:
                paper = row.paper.text if row.paper else NONE
                own.add_row(
                    row.quantity, row.machine, row.unit.shown, paper, row.unit.text(row.ours), percent(row.deviation),
                    row.verdict.words,
                )  # fmt: skip
            yield own
    whole = table("what comes out", "", "", left=2)
    for outcome in result.outcomes:
        whole.add_row(outcome.item.name, outcome.summary)
    yield whole


def as_json(result: Reproduction) -> dict[str, Any]:
    """Everything but the curves."""
    return {"items": [_item(outcome) for outcome in result.outcomes]}


def _item(outcome: Outcome) -> dict[str, Any]:
    item = outcome.item
    return {
        "name": item.name,
        "where": item.where,
        "title": item.title,
        "setting": item.setting,
        "command": item.command,
        "machines": list(item.machines),
        "numbers": [
            {
                "quantity": row.quantity, "machine": row.machine, "SI_unit": row.unit.quantity.si,
                "paper_SI": None if row.paper is None else row.paper.value, "ours_SI": finite(row.ours),
                "relative_deviation": finite(row.deviation), "setting": row.setting, "least_SI": finite(row.least),
                "greatest_SI": finite(row.greatest), "verdict": row.verdict.kind, "words": row.verdict.words,
                "reason": row.verdict.reason,
            }
            for row in outcome.rows
        ],
        "orderings": [
            {
                "quantity": o.quantity, "setting": o.setting, "paper": o.paper, "ours": o.ours, "pairs_in_order": o.agreeing,
                "pairs": o.pairs, "machines_without_a_number": o.missing,
            }
            for o in outcome.orderings
        ],
        "statements": [
            {
                "text": one.text, "quantity": one.quantity, "expected": one.expected, "ours": one.ours,
                "settings_in_which_it_holds": one.holding, "settings": one.settings, "settings_left_out": one.left_out,
                "in_the_papers_own_table": one.in_paper, "verdict": one.verdict.kind, "words": one.verdict.words,
                "reason": one.verdict.reason,
            }
            for one in outcome.statements
        ],
        "notes": list(outcome.found.notes),
    }  # fmt: skip
