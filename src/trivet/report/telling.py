"""Results as blocks of a document: by their views, their figures, and the commands that repeat them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from trivet.errors import TrivetError
from trivet.files import borrowed_folder
from trivet.report.document import Block, Listing, Picture, Table, Words


def told(parts: Iterable[Any]) -> tuple[Block, ...]:
    """What a view of `trivet.views` says: its tables, and its lines as paragraphs."""
    return tuple(_block(part) for part in parts if not isinstance(part, str) or part.strip())


def _block(part: Any) -> Block:
    if isinstance(part, str):
        return Words(part)
    heads = tuple(str(column.header) for column in part.columns)
    rows = zip(*(map(str, column.cells) for column in part.columns), strict=True)
    return Table("" if part.title is None else str(part.title), heads, tuple(rows))


def attempt(make: Callable[[], Iterable[Block]]) -> tuple[Block, ...]:
    """Blocks; or, where a machine gives none, why."""
    try:
        return tuple(make())
    except TrivetError as error:
        return (Words(f"There is nothing to show here. {error}"),)


def picture(result: Any, caption: str, alt: str) -> Picture:
    """A result as its figure."""
    return Picture(caption, alt, drawn(result))


def drawn(result: Any) -> bytes:
    """The figure of a result, PNG."""
    from trivet.show.figure import figure

    with borrowed_folder() as folder:
        path = folder / "figure.png"
        figure(result, path)
        return path.read_bytes()


def repeat(*commands: str) -> Listing:
    """The commands that make what a section shows."""
    return Listing("To repeat it", "\n".join(commands))
