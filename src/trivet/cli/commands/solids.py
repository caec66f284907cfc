"""trivet solids."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, cast

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, DataOutput, Model

if TYPE_CHECKING:
    from trivet.solids.ends import Ends


def run(
    *,
    choice: Choice,
    at: At,
    mode: o.Mode = None,
    model: Model,
    parts: Annotated[
        list[str] | None,
        typer.Option(
            "--part",
            help="A beam to be made solid, leg.link or leg-1.link, from its section or a STEP file; all by default. May be "
            "repeated.",
            metavar="NAME[=FILE.step]",
        ),
    ] = None,
    low: Annotated[str, typer.Option("--from", help="Lowest frequency.", metavar="FREQUENCY")] = "5 Hz",
    high: Annotated[str, typer.Option("--to", help="Highest frequency.", metavar="FREQUENCY")] = "3000 Hz",
    points: Annotated[
        int, typer.Option("--points", help="Equally spaced frequencies; around every resonance more are added.")
    ] = 1000,
    loss_factor: Annotated[
        float, typer.Option("--loss-factor", help="Of all that has none of its own; twice the damping ratio.")
    ] = 0.02,
    fineness: Annotated[float, typer.Option("--fineness", help="Of the meshes; more for smaller elements.")] = 1.0,
    ends: Annotated[
        str,
        typer.Option("--ends", help="Ends of solids stay plane, are rigid, or follow in the mean.", metavar="plane|rigid|mean"),
    ] = "plane",
    deck: Annotated[
        str | None,
        typer.Option(
            "--calculix",
            help="Write the machine for CalculiX, to check the frequencies of the solids; all beams are solids then.",
            metavar="FILE.inp",
        ),
    ] = None,
    anyway: o.Anyway = False,
    out: DataOutput,
) -> None:
    """Are beams good enough: natural frequencies and dynamic stiffness with beams, and with solid bodies in their place."""
    from trivet.files import check_writable
    from trivet.interop.calculix import check_ending, write_calculix
    from trivet.study.solid_check import solid_check
    from trivet.views import solids as view

    chosen = choice.load(model)
    lowest, highest = (o.quantity(name, text, "frequency", "Hz", True) for name, text in (("--from", low), ("--to", high)))
    assert lowest is not None
    assert highest is not None
    out.check()
    if deck is not None:
        check_ending(deck)
        check_writable(deck, overwrite=out.overwrite)
    with output.busy("meshing solids and working out responses", out.as_json):
        result = solid_check(
            chosen,
            parts,
            *at.numbers(),
            mode=mode,
            anyway=anyway,
            low=lowest,
            high=highest,
            points=points,
            loss_factor=loss_factor,
            fineness=fineness,
            ends=cast("Ends", ends),
            whole=deck is not None,
        )
    if deck is not None:
        write_calculix(result, deck, overwrite=out.overwrite)
        output.wrote(deck)
    out.give(result, view)
