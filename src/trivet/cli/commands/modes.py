"""trivet modes."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, DataOutput, Model


def run(
    *,
    choice: Choice,
    at: At,
    mode: o.Mode = None,
    model: Model,
    count: Annotated[int, typer.Option("--count", help="How many modes.", min=1, max=100)] = 12,
    elements: Annotated[
        int | None, typer.Option("--elements", help="Finite elements of every beam for the shapes; 8 by default.")
    ] = None,
    anyway: o.Anyway = False,
    out: DataOutput,
) -> None:
    """Natural frequencies at a pose: how the platform moves in every mode, which parts yield, how much mass takes part."""
    from trivet.cli.views import modes as view
    from trivet.study.mode_summary import aligned
    from trivet.study.modes import modes

    chosen = choice.load(model)
    out.check()
    with output.busy("finding modes", out.as_json):
        found = modes(chosen, *at.numbers(), mode=mode, anyway=anyway, count=count, elements=elements)
        result = aligned(found)
        _ = result.frequency  # worked out when it is first asked for
    out.give(result, view)
