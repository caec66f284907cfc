"""trivet measure fit."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import DataOutput


def run(
    *,
    measured: o.MeasuredFile,
    low: Annotated[str | None, typer.Option("--from", help="Lower end of the band; all that was measured by default.")] = None,
    high: Annotated[str | None, typer.Option("--to", help="Upper end of the band.")] = None,
    order: Annotated[
        int | None, typer.Option("--order", help="Highest order of the models; each reference brings so many poles. 80 in all.")
    ] = None,
    poles: Annotated[
        str | None,
        typer.Option(
            "--poles",
            help="Modes near these frequencies, as in '456 Hz, 512 Hz, 512 Hz', and no others; stable ones by default.",
            metavar="FREQUENCIES",
        ),
    ] = None,
    out: DataOutput,
) -> None:
    """Modes of measured responses: frequencies and dampings with intervals, shapes, participation."""
    from trivet.measure.files.by_suffix import read_functions
    from trivet.measure.modal.fitting import fit_modes
    from trivet.views import modal_fit as view

    ends = [o.quantity(name, text, "frequency", "Hz", True) for name, text in (("--from", low), ("--to", high))]
    wanted = None if poles is None else _frequencies(poles)
    out.check()
    functions = read_functions(measured)
    with output.busy("fitting modes", out.as_json):
        found = fit_modes(functions, *ends, order=order, poles=wanted)
    out.give(found, view)


def _frequencies(text: str) -> list[float]:
    """Frequencies (Hz) of a list with commas."""
    found = [o.quantity("--poles", part.strip(), "frequency", "Hz", True) for part in text.split(",")]
    return [frequency for frequency in found if frequency is not None]
