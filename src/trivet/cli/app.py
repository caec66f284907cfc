"""The program: every module of `cli.commands` is a command, every one of `cli.commands.measure` a command of `measure`."""

from __future__ import annotations

import importlib
from typing import Annotated

import typer

from trivet.cli.commands import NAMES
from trivet.cli.commands.measure import COMMANDS
from trivet.cli.groups import expanded

app = typer.Typer(
    name="trivet",
    help="Analysis and design of parallel kinematic machines: from a machine file to its stiffness, and which one is stiffer.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def version(show: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False) -> None:
    """Print the version."""
    if show:
        from importlib.metadata import version as installed

        typer.echo(f"trivet {installed('trivet')}")
        raise typer.Exit()


for _name in NAMES:
    app.command(_name)(expanded(importlib.import_module(f"trivet.cli.commands.{_name}").run))

measure = typer.Typer(help="Measured responses: read them, fit modes, compare them with a machine, correct its numbers.")
for _name, _module in COMMANDS.items():
    measure.command(_name)(expanded(importlib.import_module(f"trivet.cli.commands.measure.{_module}").run))
app.add_typer(measure, name="measure", no_args_is_help=True)
