"""trivet reproduce."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.errors import one_line


def run(
    *,
    folder: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            help="Folder for the results: new, empty, or of an earlier run, whose work is taken where it fits.",
            metavar="FOLDER",
        ),
    ] = "reproduction",
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only", help="A table or figure, as in table-2 or fig-10; all by default. May be repeated.", metavar="NAME"
        ),
    ] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Print the report as PDF too, by a browser of this computer.")] = False,
    as_json: o.Json = False,
) -> None:
    """Rebuild the tables and figures of the paper from which the project started, with the deviations beside them."""
    from trivet.report.printing import find_browser
    from trivet.reproduce import view
    from trivet.reproduce.files import write_all
    from trivet.reproduce.paper import default_paper
    from trivet.reproduce.run import reproduce

    def tell(words: str) -> None:
        print(one_line(words), file=sys.stderr)

    names = only or []
    if pdf:
        find_browser()
    with output.progress(as_json, "") as advance:
        result = reproduce(default_paper(), Path(folder), names, advance=advance, tell=tell)
        written = write_all(result, Path(folder), shlex.join(["trivet", *sys.argv[1:]]), pdf=pdf, tell=tell)
    asked = result.only(names)
    for path in written:
        output.wrote(str(path))
    if as_json:
        output.print_json(view.as_json(asked))
    else:
        output.print_parts(view.tables(asked))
