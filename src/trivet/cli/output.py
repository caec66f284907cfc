"""What commands print and write, and the signs of life while they work."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

from trivet.errors import one_line

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


def draw(result: Any, paths: list[str], overwrite: bool, quiet: bool) -> None:
    """Draw a result into files."""
    if not paths:
        return
    with busy("drawing", quiet):
        from trivet.show.figure import figure

    for path in paths:
        with busy(f"drawing {path}", quiet):
            figure(result, path, overwrite=overwrite)
        wrote(path)


def save(result: Any, path: str, overwrite: bool) -> None:
    """Write a result as NetCDF."""
    from trivet.study.datasets import save as save_data

    save_data(result, path, overwrite=overwrite)
    wrote(path)


def wrote(path: str) -> None:
    """Say which file there is now."""
    settle()
    print(f"wrote {one_line(path)}", file=sys.stderr)


def warn(text: str) -> None:
    """Say what the user should know about what was made."""
    settle()
    print(f"trivet: warning: {one_line(text)}", file=sys.stderr)


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
    say(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))


def say(text: str, newline: bool = True) -> None:
    """Print text as it is."""
    settle()
    typer.echo(text, nl=newline)


def print_parts(parts: Iterable[Any], *, wrapped: bool = False) -> None:
    """Print tables and lines, a blank line after each; `wrapped` within the terminal, or 100 letters where there is none."""
    from rich.console import Console
    from rich.text import Text

    settle()
    # A pipe gets whole lines, not a terminal's width of them; a narrow terminal breaks lines, which is better than cut numbers.
    console = Console(highlight=False, soft_wrap=False)
    widths = (console.width, 100) if wrapped else (max(console.width, 110), 160)
    # Names of variables and files are no markup: "[/x]" is shown as it is.
    console = Console(highlight=False, markup=False, emoji=False, width=widths[0 if console.is_terminal else 1])
    for part in parts:
        console.print(part if not isinstance(part, str) else Text(part))
        console.print()


class _Starting:
    """The sign of life of a command that has not said anything yet."""

    shown: Any = None


@contextmanager
def goes_on(path: str) -> Iterator[None]:
    """Say, where the work is interrupted, that what is done, which may be nothing yet, is kept, and where."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit) as leaving:
        if isinstance(leaving, KeyboardInterrupt) or int(leaving.code or 0) > 128:  # by a signal
            settle()
            print(f"whatever {one_line(path)} holds by now is kept; the same command goes on from there", file=sys.stderr)
        raise


@contextmanager
def starting(quiet: bool) -> Iterator[None]:
    """A sign of life from the start on, while libraries are read and kernels compiled, until the command says something."""
    if not quiet and sys.stderr is not None and sys.stderr.isatty():
        from rich.console import Console
        from rich.live import Live
        from rich.spinner import Spinner

        console = Console(stderr=True)
        # What goes to the standard output stays there, and whoever is interrupted keeps a cursor.
        spinner = Spinner("dots", "getting ready …")
        _Starting.shown = Live(spinner, console=console, transient=True, redirect_stdout=False, redirect_stderr=False)
        _Starting.shown.start()
        console.show_cursor(True)
    try:
        yield
    finally:
        settle()


def settle() -> None:
    """Take the first sign of life away."""
    if _Starting.shown is not None:
        _Starting.shown.stop()
        _Starting.shown = None


def busy(doing: str, quiet: bool) -> Any:
    """A sign of life for work that cannot say how far it is; the first run of a kind of machine compiles kernels."""
    from rich.console import Console
    from rich.text import Text

    settle()
    return Console(stderr=True, quiet=quiet or not sys.stderr.isatty()).status(Text(f"{doing} …"))


def counted(done: int, total: int | None) -> str:
    """How many are done, and of how many where that is known."""
    return f"{done:,}" if total is None else f"{done:,} of {total:,}"


_FIRST = "getting ready"


@contextmanager
def progress(quiet: bool, unit: str = "points") -> Iterator[Callable[..., None]]:
    """A bar per name; gives what is called with a name and how many are done (of how many, where that is known).

    Until it is called first there is a bar that says no more than that something goes on.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[count]}"),
        TimeElapsedColumn(),
    )
    tasks: dict[str, Any] = {}
    settle()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=quiet or not sys.stderr.isatty()) as bar:
        tasks[_FIRST] = bar.add_task(_FIRST, total=None, count="")

        def advance(name: str, done: int, total: int | None = None) -> None:
            if _FIRST in tasks:
                bar.remove_task(tasks.pop(_FIRST))
            if name not in tasks:
                tasks[name] = bar.add_task(name, total=total, count="")
            bar.update(tasks[name], completed=done, total=total, count=f"{counted(done, total)} {unit}".rstrip())

        yield advance


@contextmanager
def remaining(quiet: bool, unit: str) -> Iterator[Callable[..., None]]:
    """A bar for long work; gives what is called with how many are done, of how many, the seconds that the rest takes, and what
    is done where that is not the unit."""
    with stages(quiet) as show:

        def advance(done: int, total: int, seconds: float | None = None, doing: str = unit) -> None:
            show(doing, done, total, "" if seconds is None else f"about {lasting(seconds)} left")

        yield advance


@contextmanager
def stages(quiet: bool) -> Iterator[Callable[[str, int, int | None, str], None]]:
    """One bar, of what is running; gives what is called with what that is, how many are done, of how many where that is known,
    and what is to be said beside it."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[count]}"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[beside]}"),
    )
    settle()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=quiet or not sys.stderr.isatty()) as bar:
        bar.add_task(_FIRST, total=None, count="", beside="")

        def show(doing: str, done: int, total: int | None, beside: str) -> None:
            (task,) = bar.tasks
            # An update takes no total for that of before, and a bar that was full once stands still.
            task.total, task.finished_time = total, None
            count = counted(done, total) if total is not None else f"{counted(done, None)} done"
            bar.update(task.id, description=doing, completed=done, count=count, beside=beside)

        yield show


def lasting(seconds: float) -> str:
    """A time in words, no finer than one knows it."""
    for size, word in ((86400, "d"), (3600, "h"), (60, "min")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {word}"
    return f"{seconds:.0f} s"
