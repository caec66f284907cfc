"""trivet show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, Output

if TYPE_CHECKING:
    from trivet.model import Machine


def run(
    *,
    choice: Choice,
    toml: Annotated[bool, typer.Option("--toml", help="Print the machine file, a start for your own.")] = False,
    at: At,
    mode: o.Mode = None,
    out: Output,
) -> None:
    """Show a machine: its chains, dimensions and where the numbers come from; with --figure a 3-D picture at any pose."""
    from trivet.errors import InputError
    from trivet.model import printed
    from trivet.views import machine as view

    chosen = choice.load()
    if not out.figure and (at.is_given or mode is not None):
        raise InputError("--position, --azimuth, --tilt, --roll and --mode choose the pose of a picture; add --figure")
    if toml and out.as_json:
        raise InputError("--toml and --json: choose one of them")
    out.check()
    if toml:
        # Published values speak of the catalogue's machine, not of the one which somebody makes of it.
        output.say(printed(chosen), newline=False)
    elif out.as_json:
        output.print_json(view.as_json(chosen))
    else:
        output.print_parts(view.tables(chosen), wrapped=True)
    if out.figure:
        _draw(chosen, at, mode, out)
    elif not toml:
        output.warn_of_home(chosen, mode)


def _draw(machine: Machine, at: At, mode: str | None, out: Output) -> None:
    with output.busy("drawing", out.as_json):
        from trivet.show.drawing import draw

        frame = at.closing(machine, mode)
    for path in out.figure or []:
        with output.busy(f"drawing {path}", out.as_json):
            draw(machine, frame, mode, path=path, overwrite=out.overwrite)
        output.wrote(path)
