"""trivet pose."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli.groups import At, Choice, Model, Output


def run(
    *,
    choice: Choice,
    at: At,
    mode: o.Mode = None,
    model: Model,
    force: Annotated[
        str | None, typer.Option("--force", help="Force at the tool tip in {O}, as in '0 N, 10 N, 0 N'.", metavar="X,Y,Z")
    ] = None,
    moment: Annotated[
        str | None,
        typer.Option("--moment", help="Moment at the tool tip in {O}, as in '0 N m, 0 N m, 1 N m'.", metavar="X,Y,Z"),
    ] = None,
    weight: Annotated[bool, typer.Option("--weight", help="Add the machine's own weight, gravity along -z.")] = False,
    anyway: o.Anyway = False,
    out: Output,
) -> None:
    """Everything about one pose: joints and limits, stiffness, what it is lost in, and the deflection under a load."""
    from trivet.model.mass import STANDARD_GRAVITY
    from trivet.study.pose import pose
    from trivet.views import pose as view

    none = (0.0, 0.0, 0.0)
    loads = o.triple("--force", force, "force", "N"), o.triple("--moment", moment, "moment", "N m")
    chosen = choice.load(model)
    out.check()
    report = pose(chosen, *at.numbers(), mode=mode, anyway=anyway)
    loaded = weight or any(load is not None for load in loads)
    load = (
        report.load(loads[0] or none, loads[1] or none, (0.0, 0.0, -STANDARD_GRAVITY) if weight else none) if loaded else None
    )
    out.give(report, view, load)
