"""What commands print and write, and the signs of life while they work."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from trivet.model import Machine


def check_files(figures: list[str], data: str | None, overwrite: bool) -> None:
    """Refuse before the work, not after it, files that cannot be written."""
    from trivet.errors import InputError
    from trivet.files import check_writable
    from trivet.show.maps import check_suffix

    for path in figures:
        check_suffix(path)
    if data is not None and not data.endswith(".nc"):
        raise InputError(f'--data "{data}": a NetCDF file ends in .nc')
    paths = [*figures, *([data] if data is not None else [])]
    places = [os.path.realpath(path) for path in paths]
    for path, place in zip(paths, places, strict=True):
        if places.count(place) > 1:
            raise InputError(f"{path}: given twice")
        check_writable(path, overwrite=overwrite)


def draw(result: Any, paths: list[str], overwrite: bool) -> None:
    """Draw a result into files."""
    if not paths:
        return
    from trivet.show.figure import figure

    for path in paths:
        figure(result, path, overwrite=overwrite)
        wrote(path)


def save(result: Any, path: str, overwrite: bool) -> None:
    """Write a result as NetCDF."""
    from trivet.study.datasets import save as save_data

    save_data(result, path, overwrite=overwrite)
    wrote(path)


def wrote(path: str) -> None:
    """Say which file there is now."""
    print(f"wrote {path}", file=sys.stderr)


def warn(text: str) -> None:
    """Say what the user should know about what was made."""
    print(f"trivet: warning: {text}", file=sys.stderr)


def warn_of_home(machine: Machine, mode: str | None = None) -> None:
    """Say early that home is not reached, where it is not: whatever stands at home will fail."""
    from trivet.errors import NoResultError
    from trivet.study.home import require_home

    try:
        require_home(machine, mode)
    except NoResultError as error:
        warn(str(error))


def print_json(value: Any) -> None:
    """Print JSON."""
    typer.echo(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))


def print_parts(parts: Iterable[Any]) -> None:
    """Print tables and lines of text, a blank line after each."""
    from rich.console import Console
    from rich.text import Text

    # A pipe gets whole lines, not a terminal's width of them; a narrow terminal breaks lines, which is better than cut numbers.
    console = Console(highlight=False, soft_wrap=False)
    console = Console(highlight=False, width=max(console.width, 110) if console.is_terminal else 160)
    for part in parts:
        console.print(part if not isinstance(part, str) else Text(part))
        console.print()


def busy(doing: str, quiet: bool) -> Any:
    """A sign of life for work that cannot say how far it is; the first run of a kind of machine compiles kernels."""
    from rich.console import Console

    return Console(stderr=True, quiet=quiet or not sys.stderr.isatty()).status(f"{doing} …")


@contextmanager
def progress(quiet: bool, unit: str = "points") -> Iterator[Callable[..., None]]:
    """A bar per name; gives what is called with a name and how many are done (of how many, where that is known)."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(unit),
        TimeElapsedColumn(),
    )
    tasks: dict[str, Any] = {}
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=quiet or not sys.stderr.isatty()) as bar:

        def advance(name: str, done: int, total: int | None = None) -> None:
            if name not in tasks:
                tasks[name] = bar.add_task(name, total=total)
            bar.update(tasks[name], completed=done, total=total)

        yield advance
