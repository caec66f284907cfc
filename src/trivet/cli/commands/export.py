"""trivet export."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Choice


def run(
    *,
    choice: Choice,
    file: Annotated[str, typer.Argument(help="File to write: .xml, a MuJoCo model with its loops closed.", metavar="FILE.xml")],
    mode: o.Mode = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Write the machine at home as a MuJoCo model (MJCF): bodies with masses, joints with travel, closed loops."""
    from trivet.errors import InputError
    from trivet.interop.mjcf import write_mjcf

    if not file.endswith(".xml"):
        raise InputError(f'"{file}": a MuJoCo model ends in .xml')
    chosen = choice.load()
    write_mjcf(chosen, file, mode=mode, overwrite=overwrite)
    if as_json:
        output.print_json({"machine": chosen.name, "format": "mjcf", "file": file})
    output.wrote(file)
