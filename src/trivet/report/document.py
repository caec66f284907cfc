"""A document as plain values: what a report says, before it is a page."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from trivet.errors import InputError
from trivet.files import replacing

SUFFIXES = (".html", ".pdf")


class Words(NamedTuple):
    """A paragraph."""

    text: str
    says_why: bool = False
    """Whether it stands in place of something that cannot be told, and says why."""


class Table(NamedTuple):
    """Rows under columns; columns of numbers are set right-aligned, and wide tables scroll."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Picture(NamedTuple):
    """A picture."""

    caption: str
    alt: str
    """What is to be seen, for who cannot see it."""
    png: bytes


class Plot(NamedTuple):
    """A picture that can be turned, zoomed and asked for its values; the caption says what its own title would."""

    caption: str
    alt: str
    """What is to be seen, for who cannot see it."""
    figure: Any
    """A plotly figure."""
    still: bytes = b""
    """The same as a PNG picture, for paper and for browsers that cannot draw it; made by the browser when not given."""


class Listing(NamedTuple):
    """Text as it stands in a file or on a command line."""

    caption: str
    text: str


Block: TypeAlias = Words | Table | Picture | Plot | Listing


class Section(NamedTuple):
    """A heading and what stands under it: blocks, then sections of its own."""

    heading: str
    blocks: tuple[Block, ...]
    sections: tuple[Section, ...] = ()


def all_sections(sections: Iterable[Section]) -> Iterator[Section]:
    """Sections with all that stand within them, as they are read."""
    for section in sections:
        yield section
        yield from all_sections(section.sections)


class Document(NamedTuple):
    """A document; all texts are plain, nothing in them is read as HTML."""

    title: str
    lead: str
    """What it is about, in a few sentences."""
    sections: tuple[Section, ...]
    provenance: tuple[tuple[str, str], ...]
    """Names and values: versions, date, files with their hashes, the command line."""


def check_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of a document, in lower case; raises InputError for one that is neither HTML nor PDF."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        name = Path(path).with_suffix(".html").name if Path(path).name else "report.html"
        raise InputError(f"{os.fspath(path)}: a report ends in .html (a page) or .pdf (printed); name it {name}, say")
    return suffix


def write_document(document: Document, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a document into one file that needs no network; it appears whole or not at all.

    Args:
        document: what to write.
        path: .html is a page, .pdf the same page printed by a browser of this computer.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: for another suffix, a file that exists unasked or cannot be written.
        NoResultError: when there is no browser to print with.
    """
    from trivet.report.page import page_of
    from trivet.report.printing import print_page

    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        page = page_of(document)
        if suffix == ".html":
            temporary.write_text(page, encoding="utf-8")
        else:
            print_page(page, temporary)
