"""Write docs/commands.md, all commands with all their options, from the program's own help.

python docs/make_commands.py
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from trivet.cli.app import app

PAGE = Path(__file__).parent / "commands.md"

HEAD = """# Commands

What `--help` prints, of all commands; made from it by `python docs/make_commands.py`. A quantity is a number
with its unit (`"20 deg"`, `"3 N/um"`), three of them are separated by commas (`"0 mm, 0 mm, 125 mm"`). A value that begins
with a minus is joined by an equals sign (`--roll=-alpha`). Every command takes `--help`.

Exit codes: 0 done, 1 no result (a pose that cannot be reached, say), 2 wrong input, 130 interrupted, 143 ended by SIGTERM."""


def page() -> str:
    """The page as it should be."""
    return "\n\n".join([HEAD, *sections(typer.main.get_command(app), "trivet")]) + "\n"


def sections(group: Any, path: str) -> Iterator[str]:
    """Every command of a group, those of groups in it after their group."""
    context = group.context_class(group, info_name=path)
    for name, command in group.commands.items():
        yield section(command, context, f"{path} {name}")
        if hasattr(command, "commands"):
            yield from sections(command, f"{path} {name}")


def section(command: Any, parent: Any, path: str) -> str:
    """What one command does, and takes."""
    context = command.context_class(command, info_name=path)
    usage = " ".join([path, *command.collect_usage_pieces(context)])
    records = (parameter.get_help_record(context) for parameter in command.get_params(context) if parameter.name != "help")
    rows = [f"| `{cell(names)}` | {spoken(cell(help))} |" for names, help in filter(None, records)]
    table = "\n".join(["| option | meaning |", "|---|---|", *rows]) if rows else ""
    return "\n\n".join(filter(None, [f"## {path}", spoken(command.help), f"```text usage\n{usage}\n```", table]))


def spoken(text: str) -> str:
    """A text with the options in it as code."""
    return re.sub(r"(?<![\w`-])--[a-z][a-z-]*", r"`\g<0>`", text)


def cell(text: str) -> str:
    """A text in a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
