"""What docstrings and types say, for autodoc."""

from __future__ import annotations

import re
from functools import reduce
from operator import or_
from types import UnionType
from typing import Any, Literal, Union, Unpack, get_args, get_origin

import make_api
import numpy as np
from sphinx.application import Sphinx
from sphinx.ext.napoleon import Config, GoogleDocstring

CODE = re.compile(r"(`+[^`]*`+)")
COUNTED = re.compile(r"(^ *|: )([a-zA-Z]|[ivxlcdm]+)\.(?= |$)", re.MULTILINE)
"""What reStructuredText takes for the number of an item: a unit, say, "m." alone."""


def read(app: Sphinx, what: str, name: str, value: object, options: Any, lines: list[str]) -> None:
    """Marks are as in Markdown, sections as Google writes them."""
    if lines and lines[0].startswith("Alias for field number"):  # of a named tuple: says nothing
        lines.clear()
    parts = (f"``{part.strip('`')}``" if part.startswith("`") else part for part in CODE.split("\n".join(lines)))
    text = "".join(re.sub(r"([|*])", r"\\\1", part) if k % 2 == 0 else part for k, part in enumerate(parts))
    lines[:] = COUNTED.sub(r"\1\2\\.", text).split("\n")
    if what not in ("attribute", "property"):  # a colon in what these say tells no type
        lines[:] = GoogleDocstring(lines, Config(napoleon_use_rtype=False), app, what, name, value, options).lines()


def sign(app: Sphinx, what: str, *rest: Any) -> tuple[str, None] | None:
    """A class is made from its fields, which are listed anyhow."""
    return ("", None) if what in ("class", "exception") else None


def simplify(app: Sphinx) -> None:
    """Types as people read them."""
    for name in make_api.public() + make_api.parts():
        for one, hints in make_api.types(make_api.the(name)):
            one.__annotations__ = {own: plain(hints[own]) for own in one.__annotations__ if own in hints}


def plain(hint: Any) -> Any:
    """A type, arrays without what they are arrays of."""
    origin, arguments = get_origin(hint), get_args(hint)
    if isinstance(hint, list):
        return [plain(one) for one in hint]
    if origin is np.ndarray:
        return np.ndarray
    if origin in (Union, UnionType):
        return reduce(or_, map(plain, arguments))
    if origin in (None, Literal, Unpack):
        return hint
    return origin[tuple(plain(one) for one in arguments)]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", simplify)
    app.connect("autodoc-process-docstring", read)
    app.connect("autodoc-process-signature", sign)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
