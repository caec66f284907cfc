"""What the site makes of pages that read well without it, too.

In `index.md` a list of links under a heading becomes a part of the table of contents; in `api.md` and `api-parts.md` an item
that begins with a name becomes all that is documented of that name.  Texts outside this folder come along as files.
"""

from __future__ import annotations

import inspect
import re

import make_api
from sphinx.application import Sphinx

PART = re.compile(r"^## (.+)\n((?:.|\n)*?)(?=^## |\Z)", re.MULTILINE)
LINK = re.compile(r"^- \[.+?\]\((\w[\w-]*)\.md\)", re.MULTILINE)
OUTSIDE = re.compile(r"\[([^\]]+)\]\((\.\./[^)#]+\.md)\)")
NAME = re.compile(r"^- `(trivet[\w.]+)`.*(?:\n  .*)*$", re.MULTILINE)


def read(app: Sphinx, page: str, source: list[str]) -> None:
    source[0] = OUTSIDE.sub(r"{download}`\1 <\2>`", source[0])
    if page == "index":
        source[0] += "".join(contents(title, LINK.findall(text)) for title, text in PART.findall(source[0]))
    elif page in ("api", "api-parts"):
        source[0] = NAME.sub(documented, source[0])


def contents(title: str, pages: list[str]) -> str:
    return "\n".join(["", "```{toctree}", ":hidden:", f":caption: {title}", "", *pages, "```", ""])


def documented(found: re.Match[str]) -> str:
    kind = "function" if inspect.isfunction(make_api.the(found[1])) else "class"
    return f"```{{eval-rst}}\n.. auto{kind}:: {found[1]}{'' if kind == 'function' else '()'}\n```\n"


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
