"""Results as blocks of a document: by their views, their figures, and the commands that repeat them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

from trivet.errors import TrivetError
from trivet.files import borrowed_folder
from trivet.report.document import Block, Listing, Picture, Table, Words

COLOURS = 256
"""Of a picture, at most."""


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
        return (Words(f"There is nothing to show here. {error}", says_why=True),)


def picture(result: Any, caption: str, alt: str, **settings: Any) -> Picture:
    """A result as its figure."""
    return Picture(caption, alt, drawn(result, **settings))


def drawn(result: Any, draw: Callable[..., None] | None = None, **settings: Any) -> bytes:
    """The figure of a result, PNG; `draw` draws it with settings of its own in place of `trivet.show.figure`."""
    from trivet.show.figure import figure

    with borrowed_folder() as folder:
        path = folder / "figure.png"
        (figure if draw is None else draw)(result, path, **settings)
        return _slim(path)


def _slim(path: Path) -> bytes:
    """A picture in 256 colours, which is a third as large and looks the same."""
    from PIL import Image

    with Image.open(path) as whole:
        plain = Image.new("RGBA", whole.size, "white")
        plain.alpha_composite(whole.convert("RGBA"))
    made = BytesIO()
    plain.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(made, "PNG", optimize=True)
    return made.getvalue()


def repeat(*commands: str) -> Listing:
    """The commands that make what a section shows."""
    return Listing("To repeat it", "\n".join(commands))
