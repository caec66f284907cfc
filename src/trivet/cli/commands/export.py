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
    file: Annotated[
        str,
        typer.Argument(
            help="File to write: .xml, a MuJoCo model with its loops closed; .urdf, the tree alone.",
            metavar="FILE.xml|FILE.urdf",
        ),
    ],
    mode: o.Mode = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Write the machine at home as a MuJoCo model (MJCF): bodies with masses, drives with what holds them, closed loops.

    Or as a URDF tree, which has no closed loops: joints are missing, and a warning names them.
    """
    from trivet.errors import InputError
    from trivet.interop.mjcf import write_mjcf
    from trivet.interop.urdf import open_loops, write_urdf
    from trivet.study.home import require_home

    chosen = choice.load()
    lost: list[str] = []
    if file.endswith(".xml"):
        require_home(chosen, mode, within_travel=False)
        write_mjcf(chosen, file, mode=mode, overwrite=overwrite)
    elif file.endswith(".urdf"):
        if mode is not None:
            raise InputError("--mode: a URDF tree has no working mode; its joints stand at zero")
        write_urdf(chosen, file, overwrite=overwrite)
        lost = open_loops(chosen)
    else:
        raise InputError(f'"{file}": a MuJoCo model ends in .xml, a tree in .urdf')
    if as_json:
        kind = "mjcf" if file.endswith(".xml") else "urdf"
        output.print_json({"machine": chosen.name, "format": kind, "file": file, "open_loops": lost})
    output.wrote(file)
    if lost:
        output.warn(f"URDF cannot close loops: {', '.join(lost)} {'are' if len(lost) > 1 else 'is'} not in the file")
