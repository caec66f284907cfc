"""trivet frf."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, cast

import typer

from trivet.cli import options as o
from trivet.cli import output as to
from trivet.cli.groups import At, Choice, DataOutput, Model

if TYPE_CHECKING:
    from trivet.vibration.response import Damping, Method


def run(
    *,
    choice: Choice,
    at: At,
    mode: o.Mode = None,
    model: Model,
    low: Annotated[str, typer.Option("--from", help="Lowest frequency.", metavar="FREQUENCY")] = "5 Hz",
    high: Annotated[str, typer.Option("--to", help="Highest frequency.", metavar="FREQUENCY")] = "3000 Hz",
    points: Annotated[
        int, typer.Option("--points", help="Equally spaced frequencies; around every resonance more are added.")
    ] = 2000,
    response: Annotated[
        str,
        typer.Option(
            "--response",
            help="Where the motion is: platform, tool, a joint such as leg-1.hinge, or leg-1.link@0.5.",
            metavar="PLACE",
        ),
    ] = "platform",
    excitation: Annotated[str, typer.Option("--excitation", help="Where the loads are.", metavar="PLACE")] = "platform",
    method: Annotated[
        str,
        typer.Option(
            "--method", help="Exact, without a mesh; or a mesh solved directly, or by its modes.", metavar="exact|direct|modal"
        ),
    ] = "exact",
    damping: Annotated[
        str,
        typer.Option("--damping", help="Structural, or modal with --method modal.", metavar="structural|modal"),
    ] = "structural",
    loss_factor: Annotated[
        float, typer.Option("--loss-factor", help="Of all that has none of its own; twice the damping ratio.")
    ] = 0.02,
    output: Annotated[
        str,
        typer.Option(
            "--output", help="Displacement, velocity or acceleration per load.", metavar="receptance|mobility|accelerance"
        ),
    ] = "receptance",
    entries: Annotated[
        str,
        typer.Option("--entries", help="Directions of the motion and of the load, such as xx, z_ry, rz_rz.", metavar="NAMES"),
    ] = "xx,yy,zz",
    anyway: o.Anyway = False,
    out: DataOutput,
) -> None:
    """Frequency responses between two places of a machine at a pose, and its minimum dynamic stiffness."""
    from trivet.study.frf import frf
    from trivet.study.response_summary import ShownResponse, check_entries
    from trivet.views import frf as view

    names = check_entries(entries.split(","), output)
    chosen = choice.load(model)
    lowest, highest = (o.quantity(name, text, "frequency", "Hz", True) for name, text in (("--from", low), ("--to", high)))
    assert lowest is not None
    assert highest is not None
    out.check()
    with to.busy("working out responses", out.as_json):
        whole = frf(
            chosen,
            *at.numbers(),
            mode=mode,
            anyway=anyway,
            low=lowest,
            high=highest,
            points=points,
            response=response,
            excitation=excitation,
            method=cast("Method", method),
            damping=cast("Damping", damping),
            loss_factor=loss_factor,
        )
        result = ShownResponse(whole, output, names)
        _ = result.minima  # worked out when they are first asked for
    out.give(result, view)
