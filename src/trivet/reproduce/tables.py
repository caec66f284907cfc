"""Tables as files of comma-separated values, in the units of the paper."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from trivet.files import replacing
from trivet.reproduce.run import Reproduction

VALUES = (
    "item", "quantity", "machine", "unit", "paper", "ours", "deviation_percent", "setting", "least", "greatest", "verdict",
    "words", "reason",
)  # fmt: skip
ORDERINGS = ("item", "quantity", "setting", "paper", "ours", "pairs_in_order", "pairs", "machines_without_a_number")
STATEMENTS = (
    "item", "statement", "quantity", "expected", "ours", "settings_in_which_it_holds", "settings", "settings_left_out",
    "in_the_papers_own_table",
    "words", "reason",
)  # fmt: skip


def write_tables(result: Reproduction, folder: Path) -> list[Path]:
    """Write values.csv, orderings.csv and statements.csv; numbers have all their digits."""
    made = []
    for name, head, rows in (
        ("values", VALUES, _values(result)),
        ("orderings", ORDERINGS, _orderings(result)),
        ("statements", STATEMENTS, _statements(result)),
    ):
        path = folder / f"{name}.csv"
        with replacing(path, overwrite=True) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(head)
            writer.writerows(rows)
        made.append(path)
    return made


def _values(result: Reproduction) -> Iterable[Sequence[object]]:
    for outcome in result.outcomes:
        for row in outcome.rows:
            ours, least, greatest = (None if v is None else v / row.unit.factor for v in (row.ours, row.least, row.greatest))
            paper = None if row.paper is None else row.paper.text
            apart = None if row.deviation is None else 100 * row.deviation
            numbers = (paper, ours, apart, row.setting, least, greatest)
            yield (outcome.item.name, row.quantity, row.machine, row.unit.shown, *numbers, *row.verdict)


def _orderings(result: Reproduction) -> Iterable[Sequence[object]]:
    return ((outcome.item.name, *ordering) for outcome in result.outcomes for ordering in outcome.orderings)


def _statements(result: Reproduction) -> Iterable[Sequence[object]]:
    return (
        (outcome.item.name, *one[:-1], one.verdict.words, one.verdict.reason)
        for outcome in result.outcomes
        for one in outcome.statements
    )
