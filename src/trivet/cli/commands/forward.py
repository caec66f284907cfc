"""trivet forward."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, Output


def run(
    *,
    choice: Choice,
    drives: Annotated[
        str | None,
        typer.Option("--drives", help="Coordinates of all drives in the order of Q, with their units, separated by commas."),
    ] = None,
    drive: Annotated[
        list[str] | None,
        typer.Option(
            "--drive",
            help="Coordinate of one drive, as in leg-1.slide='30 mm'; the others are as at the pose. May be repeated.",
            metavar="DRIVE=VALUE",
        ),
    ] = None,
    at: At,
    mode: o.Mode = None,
    anyway: o.Anyway = False,
    out: Output,
) -> None:
    """All poses that the machine can take with its drives at given coordinates, or at those of a pose."""
    from trivet.kinematics.inverse import require_six_freedoms
    from trivet.study.forward import forward, parse_drives
    from trivet.views import forward as view

    chosen = choice.load()
    out.check()
    given = parse_drives(chosen, drives, drive or [])
    with output.busy("finding all poses", out.as_json):
        require_six_freedoms(chosen)
        start = at.frame(chosen) if drives else at.closing(chosen, mode)
        result = forward(chosen, given, start=start, mode=mode, anyway=anyway)
    out.give(result, view)
