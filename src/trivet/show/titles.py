"""Titles of pictures and pages of designs: a line that names them, and lines that say more."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

WIDE, HIGH = 1280, 800
"""Pixels of a picture."""
FIRST, OTHER = 110, 150
"""Letters of a line."""
TOP, LINE = 34, 24
"""Pixels from the edge to the first line, and from line to line."""


@contextmanager
def literal() -> Iterator[None]:
    """Pictures whose texts are shown as they are: in names that users give, "$" begins no formula."""
    from matplotlib import rc_context

    with rc_context({"text.parse_math": False}):
        yield


def wrapped(title: list[str]) -> list[tuple[str, bool]]:
    """Lines that are no wider than the page, each with whether it is of the first."""
    widths = [FIRST, *([OTHER] * (len(title) - 1))]
    return [(line, not k) for k, own in enumerate(title) for line in textwrap.wrap(own, widths[k])]


def height(title: list[str]) -> float:
    """Pixels that a title takes."""
    return TOP + LINE * len(wrapped(title))


def write(canvas: Any, title: list[str]) -> None:
    """Write a title on a figure of matplotlib."""
    tall, wide = canvas.bbox.height, canvas.bbox.width
    for k, (line, is_first) in enumerate(wrapped(title)):
        canvas.text(24 / wide, 1 - (TOP + LINE * k) / tall, line, fontsize=14 if is_first else 11)


def on_page(title: list[str], more: int = 0) -> dict[str, Any]:
    """A title, and room for it, for the layout of a page so many pixels higher than a picture."""
    lines = [
        f'<span style="font-size:{17 if is_first else 13}px">{html.escape(line)}</span>' for line, is_first in wrapped(title)
    ]
    place = {"x": 0.02, "y": 1, "yref": "container", "yanchor": "top", "pad": {"t": 20}}
    return {
        "title": {"text": "<br>".join(lines), "font": {"size": 17}, **place},
        "template": "simple_white",
        "height": HIGH + more,
        "margin": {"l": 80, "t": height(title) + 10, "r": 90, "b": 50},
    }
