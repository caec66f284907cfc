"""trivet report."""

from __future__ import annotations

import os
import shlex
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Hemisphere, Model
from trivet.report.sections import SECTIONS

if TYPE_CHECKING:
    from trivet.report.sections.measured import Measurement
    from trivet.report.subject import Subject


@dataclass(frozen=True)
class Measured:
    """What was measured, to be set beside the machines."""

    measured: Annotated[
        str | None,
        typer.Option("--measured", help="Measured responses to set beside those of the machines.", metavar="FILE"),
    ] = None
    setup: Annotated[
        str | None,
        typer.Option("--setup", help="Where the measured points lie on the machine, with --measured.", metavar="FILE.toml"),
    ] = None
    fit: Annotated[
        str | None, typer.Option("--fit", help="Modes fitted to them, as measure fit --data writes them.", metavar="FILE.nc")
    ] = None

    def read(self) -> Measurement | None:
        """All of it."""
        from trivet.report.making import measurement_of

        return measurement_of(self.measured, self.setup, self.fit)


def run(
    *,
    machines: o.Machines = None,
    target: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            help="The report: .html is one page that needs no network, .pdf the same, printed.",
            metavar="FILE",
        ),
    ],
    sections: Annotated[
        str | None,
        typer.Option(
            "--sections",
            help=f"Some of {', '.join(SECTIONS)}; all that there is to say by default.",
            metavar="NAMES",
        ),
    ] = None,
    mode: o.Mode = None,
    points: Hemisphere,
    settings: o.Settings = None,
    model: Model,
    test: Measured,
    overwrite: o.Overwrite = False,
) -> None:
    """A report of machines in one file: pictures, tables, maps, statistics, and the commands that repeat them."""
    from trivet.report.document import write_document
    from trivet.report.making import check_target, report_of
    from trivet.study.comparison import PAPER_MACHINES

    names = None if sections is None else [word for name in sections.split(",") if (word := name.strip())]
    subjects = [_subject(word, settings or [], mode, points, model) for word in machines or PAPER_MACHINES]
    check_target(target, overwrite=overwrite)
    with output.progress(False, "sections") as advance:
        command = shlex.join(["trivet", *sys.argv[1:]])
        document = report_of(subjects, names, test.read(), command, advance)
        write_document(document, target, overwrite=overwrite)
    typer.echo(f"{os.path.realpath(target)}: {_size(os.path.getsize(target))}")


def _subject(word: str, settings: list[str], mode: str | None, points: Hemisphere, model: Model) -> Subject:
    """A machine with its settings in its name, so that every command in the report names it as it is."""
    from trivet.report import subject
    from trivet.study.machines import choose

    if settings:
        word += ("," if "@" in word else "@") + ",".join(settings)
    chosen = choose(word)
    radius, height = points.lengths()
    over = subject.CheckPoints(points.steps, radius, height)
    return subject.Subject(word, chosen, model.of(chosen), model.options(), mode, over)


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count / 1e3:.0f} kB"
