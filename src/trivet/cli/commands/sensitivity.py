"""trivet sensitivity."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Output


def run(
    *,
    study: o.Study,
    store: Annotated[
        str | None,
        typer.Option(
            "--store",
            help="Folder of the samples, made or gone on with; the name of the study file with .sensitivity.zarr by default.",
            metavar="FOLDER",
        ),
    ] = None,
    workers: o.Workers = 0,
    scheduler: o.Scheduler = None,
    out: Output,
) -> None:
    """Take the variables of a study file as unknowns: how uncertain quantities are, due to what, and which orderings hold."""
    from pathlib import Path

    from trivet.design.study import read_study
    from trivet.design.uncertainty import check, sensitivity
    from trivet.errors import NoResultError
    from trivet.views import uncertainty as view

    asked = read_study(study, check)
    out.check()
    folder = store if store is not None else f"{Path(study).stem}.sensitivity.zarr"
    with output.goes_on(folder), output.remaining(out.as_json, "designs") as advance:
        result, outcome = sensitivity(
            asked, folder, workers=workers, scheduler=scheduler, progress=advance,
            first=lambda machine, done, total: advance(done, total, doing=f"slopes of {machine}"),
        )  # fmt: skip
    output.wrote(folder)
    out.give(result, view, outcome, wrapped=True)
    if outcome.failures:
        raise NoResultError(f"{len(outcome.failures)} chunks failed; the same command tries them again")
