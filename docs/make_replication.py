"""Write what a reproduction of the paper finds into docs/replication.md.

python docs/make_replication.py [FOLDER]

FOLDER is that of `trivet reproduce`, "reproduction" by default; what is there and fits is taken, the rest is worked out.
"""

from __future__ import annotations

import sys
from pathlib import Path

from trivet.report.document import Block, Section, Table, Words
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.page import item_section, overview
from trivet.reproduce.paper import default_paper
from trivet.reproduce.run import Reproduction, reproduce
from trivet.reproduce.verdict import RULES

PAGE = Path(__file__).parent / "replication.md"
BEGIN, END = (f"<!-- {word}: what docs/make_replication.py writes -->" for word in ("from here", "up to here"))


def rules_text() -> str:
    """How verdicts are found."""
    return "\n".join(f"- {rule}" for rule in RULES)


def overview_text(result: Reproduction) -> str:
    """All tables and figures in a line each."""
    return block_text(overview(result))


def item_text(outcome: Outcome) -> str:
    """A table or a figure; its charts are in the report only."""
    section: Section = item_section(outcome)
    parts = [text for block in section.blocks if (text := block_text(block))]
    return "\n\n".join([f"### {section.heading}", *parts])


def block_text(block: Block) -> str:
    if isinstance(block, Words):
        return "  \n".join(block.text.splitlines())
    if not isinstance(block, Table):
        return ""
    cells = [block.columns, ("---",) * len(block.columns), *block.rows]
    rows = "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in cells)
    return f"*{block.caption}*\n\n{rows}" if block.caption else rows


def page(result: Reproduction) -> str:
    """The page with what is between the marks written anew."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    parts = ["## What the verdicts mean", rules_text(), "## What comes out", overview_text(result)]
    made = "\n\n".join([*parts, *map(item_text, result.outcomes)])
    return f"{before}{BEGIN}\n\n{made}\n\n{END}{after}"


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "reproduction")
    PAGE.write_text(page(reproduce(default_paper(), folder, tell=print)), encoding="utf-8")


if __name__ == "__main__":
    main()
