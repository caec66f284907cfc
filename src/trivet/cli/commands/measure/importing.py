"""trivet measure import."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import DataOutput


def run(
    *,
    files: o.MeasuredFiles,
    units: Annotated[
        str | None,
        typer.Option(
            "--units",
            help="Of universal files that do not tell, or contradict themselves: 'm/s^2 per N', or 'g per N, mm' with points.",
        ),
    ] = None,
    least_coherence: Annotated[
        float, typer.Option("--least-coherence", help="Lines of functions with less are told, and marked in figures.")
    ] = 0.8,
    write: Annotated[
        str | None, typer.Option("--write", help="Write a universal file (.unv), in SI.", metavar="FILE.unv")
    ] = None,
    binary: Annotated[bool, typer.Option("--binary", help="With --write: values as bytes, to the last bit (58b).")] = False,
    out: DataOutput,
) -> None:
    """Read measured frequency responses, tell what they are, and keep them together in one file."""
    from trivet.errors import InputError
    from trivet.files import check_writable
    from trivet.measure.files.several import import_files
    from trivet.measure.files.suffixes import UNIVERSAL
    from trivet.measure.universal.writing import write_universal
    from trivet.views import imported as view

    if write is None and binary:
        raise InputError("--binary: is for the file of --write, which is missing")
    if write is not None and not write.lower().endswith(UNIVERSAL.suffixes):
        raise InputError(f'--write "{write}": a universal file ends in {", ".join(UNIVERSAL.suffixes)}')
    out.check()
    if write is not None:
        check_writable(write, overwrite=out.overwrite)
    with output.busy("reading files", out.as_json):
        found = import_files(files, units, least_coherence)
    if write is not None:
        write_universal(found.functions, write, found.modes, binary=binary, overwrite=out.overwrite)
        output.wrote(write)
    out.give(found, view)
