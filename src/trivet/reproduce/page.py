"""The reproduction as a document: rules, an overview, and every table and figure with ours beside it."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime

from trivet.model import fingerprint
from trivet.report.document import Block, Document, Section, Table, Words
from trivet.report.provenance import versions
from trivet.report.telling import repeat
from trivet.reproduce.charts import plots
from trivet.reproduce.numbers import NONE
from trivet.reproduce.outcome import Outcome, Row
from trivet.reproduce.run import Reproduction
from trivet.reproduce.verdict import RULES
from trivet.study.machines import choose

HEADS = ("", "machine", "unit", "paper", "ours", "deviation", "least", "greatest", "verdict")
LEAD = (
    "Every table and figure of the paper from which the project started, rebuilt: its numbers, ours, how far they are apart. "
    "Curves of the paper cannot be set beside ours, since its text holds none; what the text says of them can."
)


def document(result: Reproduction, command: str) -> Document:
    """What a report says; `command` made it."""
    sections = (
        Section("Overview", (Words(result.paper.citation), overview(result))),
        Section("What the verdicts mean", tuple(Words(rule) for rule in RULES)),
        *(item_section(outcome) for outcome in result.outcomes),
    )
    return Document("The paper, reproduced", LEAD, sections, _provenance(result, command))


def overview(result: Reproduction) -> Table:
    """Every table and figure in a line."""
    rows = ((outcome.item.where, outcome.item.title, outcome.summary) for outcome in result.outcomes)
    return Table("", ("", "", "comes out"), tuple(rows))


def item_section(outcome: Outcome) -> Section:
    """A table or a figure: numbers, statements, orders, notes, charts, commands."""
    item = outcome.item
    blocks: list[Block] = [Words(f"{item.setting} In sum: {outcome.summary}.")]
    blocks += [Words(item.remark)] if item.remark else []
    blocks += _numbers(outcome)
    blocks += _statements(outcome)
    blocks += _orderings(outcome)
    blocks += [Words("\n".join(outcome.found.notes))] if outcome.found.notes else []
    blocks += plots(outcome.found.charts, item.where)
    blocks.append(repeat(f"trivet reproduce --only {item.name}", item.command))
    return Section(f"{item.where}: {item.title}", tuple(blocks))


def _numbers(outcome: Outcome) -> list[Block]:
    """The numbers, and under them the reasons by letter."""
    if not outcome.rows:
        return []
    reasons = letters(row.verdict.reason for row in outcome.rows)
    columns = [_cells(row, reasons) for row in outcome.rows]
    # Columns in which nothing stands are left out: what the paper has no number for, what was not varied.
    heads = [head for head in HEADS if any(cells.get(head, NONE) != NONE for cells in columns)]
    rows = tuple(tuple(cells[head] for head in heads) for cells in columns)
    return [Table("Numbers", tuple(heads), rows), *_reasons(reasons)]


def _cells(row: Row, reasons: dict[str, str]) -> dict[str, str]:
    mark = f" ({reasons[row.verdict.reason]})" if row.verdict.reason else ""
    return {
        "": row.quantity,
        "machine": row.machine,
        "unit": row.unit.shown,
        "paper": row.paper.text if row.paper else NONE,
        "ours": row.unit.text(row.ours),
        "deviation": percent(row.deviation),
        "least": row.unit.text(row.least),
        "greatest": row.unit.text(row.greatest),
        "verdict": NONE if row.paper is None else row.verdict.words + mark,
    }


def _statements(outcome: Outcome) -> list[Block]:
    if not outcome.statements:
        return []
    reasons = letters(one.verdict.reason for one in outcome.statements)
    rows = []
    for one in outcome.statements:
        mark = f" ({reasons[one.verdict.reason]})" if one.verdict.reason else ""
        own = {True: "yes", False: "no", None: NONE}[one.in_paper]
        count = _count(one.holding, one.settings, one.left_out)
        rows.append((one.text, one.quantity, one.ours, one.verdict.words + mark, count, own))
    heads = ("the paper says", "of", "ours", "verdict", "settings in which it holds", "in its own table")
    return [Table("Statements", heads, tuple(rows)), *_reasons(reasons)]


def _orderings(outcome: Outcome) -> list[Block]:
    """Orders by quantity: in the first setting, and in how many of all."""
    rows = []
    for quantity in outcome.settings:
        own = [o for o in outcome.orderings if o.quantity == quantity and o.pairs]
        if own:
            first, whole = own[0], [o for o in own if not o.missing]
            count = _count(sum(o.is_reproduced for o in whole), len(whole), len(own) - len(whole))
            rows.append((quantity, first.paper, first.ours, f"{first.agreeing} of {first.pairs}", count))
    heads = ("", "paper", "ours", "pairs in order", "settings with all in order")
    return [Table("Orderings, the greatest first", heads, tuple(rows))] if rows else []


def _count(holding: int, settings: int, left_out: int) -> str:
    """In how many settings something holds, and how many say nothing."""
    told = f"{holding} of {settings}" if settings else ""
    return ", ".join(part for part in (told, f"{left_out} left out" if left_out else "") if part) or NONE


def letters(reasons: Iterable[str]) -> dict[str, str]:
    """A letter per reason, in their order."""
    return {reason: chr(ord("a") + k) for k, reason in enumerate(dict.fromkeys(r for r in reasons if r))}


def _reasons(reasons: dict[str, str]) -> list[Block]:
    return [Words("\n".join(f"({letter}) because {reason}." for reason, letter in reasons.items()))] if reasons else []


def percent(part: float | None) -> str:
    """A deviation, "+1.4 %"."""
    return NONE if part is None else f"{round(100 * part, 1) + 0.0:+.1f} %".replace("-", "−")


def _provenance(result: Reproduction, command: str) -> tuple[tuple[str, str], ...]:
    names = dict.fromkeys(name for outcome in result.outcomes for name in outcome.item.machines)
    files = ((f"machine {name}", f"SHA-256 {fingerprint(choose(name))}") for name in names)
    return (("command", command), ("date", f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"), *versions(), *files)
