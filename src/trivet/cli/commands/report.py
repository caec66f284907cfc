"""trivet report."""

from __future__ import annotations

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
        list[str] | None,
        typer.Option(
            "--sections",
            help=f"Some of {', '.join(SECTIONS)}, by commas or repeated; all that there is to say by default.",
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
    from trivet.report.making import check_target, empty_sections, report_of
    from trivet.study.comparison import PAPER_MACHINES

    names = [word for name in ",".join(sections).split(",") if (word := name.strip())] if sections else None
    subjects = [_subject(word, settings or [], mode, points, model) for word in machines or PAPER_MACHINES]
    check_target(target, overwrite=overwrite)
    measurement = test.read()
    for one in subjects:
        output.warn_of_home(one.machine, mode)
    with output.progress(False, "sections") as advance:
        command = shlex.join(["trivet", *sys.argv[1:]])
        document = report_of(subjects, names, measurement, command, advance, _tell)
        write_document(document, target, overwrite=overwrite)
    for line in empty_sections(document):
        output.warn(line)
    output.wrote(target)


def _tell(words: str) -> None:
    """Say what is done where no bar shows it."""
    if not sys.stderr.isatty():
        print(words, file=sys.stderr, flush=True)


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
