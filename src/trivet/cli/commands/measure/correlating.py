"""trivet measure correlate."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Choice, DataOutput, Measurement, Model


def run(
    *,
    measured: o.MeasuredFile,
    choice: Choice,
    test: Measurement,
    entry: Annotated[
        list[str] | None,
        typer.Option(
            "--entry", help="Function in the figure, as in '12:+z / 3:-x'; those that respond most by default. May be repeated."
        ),
    ] = None,
    setup_figure: Annotated[
        list[str] | None,
        typer.Option(
            "--setup-figure", help="Draw the measured points on the machine: .png or .html. May be repeated.", metavar="FILE"
        ),
    ] = None,
    model: Model,
    out: DataOutput,
) -> None:
    """How alike measured responses and those of a machine are: FRAC and FAAC, CSAC and CSF, modes by MAC."""
    from trivet.errors import InputError
    from trivet.measure.files.by_suffix import read_functions
    from trivet.study.correlate import MappedPoints, ShownCorrelation, correlate
    from trivet.views import correlation as view

    low, high = test.ends()
    if entry and not out.figure:
        raise InputError("--entry: chooses what is drawn; give --figure as well")
    output.check_files([*(out.figure or []), *(setup_figure or [])], out.data, out.overwrite)
    chosen, setup = choice.load(model), test.setup()
    with output.busy("reading and comparing", out.as_json):
        functions = read_functions(measured).between(0.0 if low is None else low, float("inf") if high is None else high)
        fitted = test.modes()
        found = correlate(chosen, setup, functions, fitted, loss_factor=test.loss_factor)
    shown = ShownCorrelation(found, tuple(found.numbers(entry)) if entry else None)
    output.draw(MappedPoints(found.placed, functions), setup_figure or [], out.overwrite, out.as_json)
    out.give(shown, view)
