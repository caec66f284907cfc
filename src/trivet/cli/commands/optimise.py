"""trivet optimise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Output


@dataclass(frozen=True)
class MachinesOutput(Output):
    """Where a front goes, and its machines."""

    machines: Annotated[
        str | None,
        typer.Option("--machines", help="Write machine files of the designs on the front into this folder.", metavar="FOLDER"),
    ] = None

    def check(self) -> None:
        super().check()
        if self.machines is not None:
            o.check_folder("--machines", self.machines, self.overwrite)

    def _write(self, result: Any) -> None:
        from trivet.design.writing import write_machines

        if self.machines is not None:
            for path in write_machines(result, self.machines, overwrite=self.overwrite):
                output.wrote(path)
        super()._write(result)


def run(
    *,
    study: o.Study,
    store: Annotated[
        str | None,
        typer.Option(
            "--store",
            help="File that keeps what is worked out, so that an interrupted run goes on; by default the name of the study "
            "file with .evaluations.",
            metavar="FILE",
        ),
    ] = None,
    points: Annotated[int, typer.Option("--points", help="Designs told of each machine, at most.", min=2, max=500)] = 40,
    polish: Annotated[
        str | None,
        typer.Option(
            "--polish",
            help="Time for polishing each machine's front, half of it for the coarse turns between those of evolution, half "
            "for the last one; kernels compiled in them count, evolution does not. Until it is done by default.",
            metavar="TIME",
        ),
    ] = None,
    out: MachinesOutput,
) -> None:
    """Seek the best designs of machines, as a study file says: a front by evolution, polished by slopes."""
    from pathlib import Path

    from trivet.design.aims import aims_of
    from trivet.design.optimisation import optimise
    from trivet.design.study import read_study
    from trivet.views import optimisation as view

    asked = read_study(study, aims_of)
    seconds = o.quantity("--polish", polish, "time", "s", positive=True)
    out.check()
    file = store if store is not None else f"{Path(study).stem}.evaluations"
    names = asked.names
    where = {name: f"{name} ({k} of {len(names)})" if len(names) > 1 else name for k, name in enumerate(names, 1)}
    with output.goes_on(file), output.stages(out.as_json) as show:

        def tell(machine: str, stage: str, done: int, total: int | None, best: int) -> None:
            show(f"{where[machine]}, {stage}", done, total, f"{best:,} that no other dominates")

        result = optimise(
            asked,
            store=file,
            points=points,
            seconds=float("inf") if seconds is None else seconds,
            progress=tell,
            damaged=lambda cut: output.warn(f"{file}: {cut} bytes were damaged; what they held is worked out again"),
        )
    out.give(result, view, wrapped=True)
