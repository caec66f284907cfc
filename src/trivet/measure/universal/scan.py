"""What stands in a universal file: its datasets, where each begins and ends, before anything is read out of them.

Datasets are text between lines of "-1".  The values of a function may be bytes instead (type 58b), where a "-1" means nothing:
there the scan follows what the dataset declares of itself.  Formats: universal files of SDRC I-DEAS, as the Structural
Dynamics Research Laboratory of the University of Cincinnati publishes them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from trivet.errors import InputError, shown
from trivet.measure.checking import check_plain

LARGEST = 512 * 2**20
"""Bytes of a file, at most: it is held in memory as a whole."""
HEAD = 13
"""Lines of a function before its values: "-1", the type, five lines of words, six of numbers."""

_OPEN = re.compile(rb" *-1\s*")
_KIND = re.compile(rb" *(\d{1,6})([bB]?)(.*)", re.DOTALL)
_CLOSE = re.compile(rb"^ {0,4}-1[ \t\r]*$", re.MULTILINE)
_CLOSE_OF_BYTES = re.compile(rb"[\r\n]{0,2} {0,4}-1[ \t\r]*(?:\n|\Z)")
_NO_TEXT = re.compile(rb"[^\x20-\x7e\s]")
_TEXT = re.compile(rb"[-+.\deEdD\s]{24}")


@dataclass(frozen=True)
class Block:
    """A dataset as it stands in a file."""

    path: str
    number: int
    """In its file, from 1."""
    kind: int
    """Type of the dataset: 58, 2411, …"""
    line: int
    """Of its opening "-1", from 1."""
    text: bytes
    """From the opening "-1" to what comes before the closing one; of bytes their 13 lines of head only."""
    body: bytes | None = None
    """Values, where they are bytes."""

    @property
    def title(self) -> str:
        """As messages name it: "a.unv: dataset 3 (type 58b, line 41)"."""
        return f"{self.path}: dataset {self.number} (type {self.kind}{'b' if self.body is not None else ''}, line {self.line})"

    def error(self, what: str, record: int | None = None) -> InputError:
        """An error that names the dataset, and the line of one of its records, which count from its "-1" at 0."""
        place = "" if record is None else f"line {self.line + record}: "
        return InputError(f"{self.title}: {place}{what}")

    def lines(self, most: int | None = None) -> list[str]:
        """Its text, a record a line: in UTF-8, or else in Latin letters (ISO 8859-1); control characters as blanks.

        Args:
            most: of the first lines that are wanted; all by default.
        """
        raw = self.text if most is None else b"\n".join(self.text.split(b"\n", most)[:most])
        try:
            text = raw.decode()
        except UnicodeDecodeError:
            text = raw.decode("latin-1")
        records = text.split("\n")[: HEAD if self.body is not None else None]
        return [_plain(record.rstrip()) for record in records]


def _plain(record: str) -> str:
    """A record with blanks in place of control characters, at which some split lines."""
    return record if record.isprintable() else "".join(c if c.isprintable() else " " for c in record)


class Form(NamedTuple):
    """How the values of a function are written: record 7 of dataset 58."""

    points: int
    is_complex: bool
    is_double: bool
    is_even: bool
    """Whether the abscissa is told by its first value and a step."""

    @property
    def each(self) -> int:
        """Numbers per point."""
        return (2 if self.is_complex else 1) + (0 if self.is_even else 1)

    @property
    def per_line(self) -> int:
        """Numbers on a full line of text."""
        return 6 if not self.is_double else 3 if self.is_complex and not self.is_even else 4

    @property
    def width(self) -> int:
        """Characters of a number, or of the numbers of one point where they differ."""
        if not self.is_double:
            return 13
        return 20 if self.is_even else 13 + 20 * (self.each - 1)

    @property
    def sizes(self) -> list[int]:
        """Bytes of all values: the abscissa of doubles is written as doubles by some, in single precision by others."""
        item = 8 if self.is_double else 4
        whole = [self.points * self.each * item]
        return whole if self.is_even or not self.is_double else [*whole, self.points * (self.each * item - 4)]


def form_of(block: Block, record: str) -> Form:
    """Record 7 of a function; raises InputError for what is none."""
    parts = [record[:10], record[10:20], record[20:30]]
    try:
        ordinate, points, spacing = (int(part) for part in parts)
    except ValueError:
        raise block.error(f"{shown(record)}: expected type of ordinate, number of points and spacing as integers", 8) from None
    if ordinate not in (2, 4, 5, 6) or spacing not in (0, 1):
        raise block.error(f"type of ordinate {ordinate}, spacing {spacing}; expected 2, 4, 5 or 6, and 0 or 1", 8)
    if points < 1:
        raise block.error(f"{points} points; expected 1 or more", 8)
    return Form(points, ordinate in (5, 6), ordinate in (4, 6), spacing == 1)


def scan(path: str | os.PathLike[str]) -> list[Block]:
    """All datasets of a file, in their order.

    Raises:
        InputError: for a file that cannot be read, is too large, or is no universal file; where a dataset is cut off, or its
            values are not what it declares.
    """
    name = os.fspath(path)
    data = _content(Path(path), name)
    found = list(_blocks(name, data))
    if not found:
        raise InputError(f'{name}: holds no dataset; a universal file begins with a line of "    -1"')
    return found


def _content(path: Path, name: str) -> bytes:
    try:
        if not path.is_file() and path.exists():
            raise InputError(f"{name}: is not a regular file")
        size = path.stat().st_size
        if size > LARGEST:
            bound = f"universal files are read up to {LARGEST // 2**20} MiB"
            raise InputError(f"{name}: has {size / 2**20:.0f} MiB; {bound}: divide it into several")
        check_plain(name)
        return path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror or error}") from None


def _blocks(name: str, data: bytes) -> Iterator[Block]:
    at, line, number = 0, 1, 0
    while at < len(data):
        text, after = _line(data, at)
        if not text.strip():
            at, line = after, line + 1
            continue
        if not _OPEN.fullmatch(text):
            words = shown(text[:40].decode("latin-1").strip())
            raise InputError(f'{name}: line {line}: {words} stands outside any dataset; expected "    -1", which opens one')
        number += 1
        block, end = _block(name, data, at, line, number)
        yield block
        line += data.count(b"\n", at, end)
        at = end


def _line(data: bytes, at: int) -> tuple[bytes, int]:
    """A line without its end, and where the next one begins."""
    end = data.find(b"\n", at)
    return (data[at:], len(data)) if end < 0 else (data[at:end], end + 1)


def _block(name: str, data: bytes, at: int, line: int, number: int) -> tuple[Block, int]:
    """The dataset which begins at a place, and where the next one may begin."""
    second, after = _line(data, _line(data, at)[1])
    kind = _KIND.fullmatch(second)
    if kind is None:
        words = shown(second[:40].decode("latin-1").strip())
        raise InputError(f"{name}: dataset {number}, line {line + 1}: {words} is no type of a dataset, such as 58")
    block = Block(name, number, int(kind[1]), line, b"")
    if kind[2]:
        return _block_of_bytes(block, data, at, after, kind[3])
    close = _CLOSE.search(data, after)
    if block.kind == 58:
        _check_text(block, data[at : len(data) if close is None else close.start()])
    if close is None:
        raise block.error('is cut off: the file ends before its closing "    -1"')
    return Block(name, number, block.kind, line, data[at : close.start()]), _line(data, close.start())[1]


def _check_text(block: Block, text: bytes) -> None:
    """Refuse bytes where text was announced; the head may have letters that are not of English."""
    lines = text.split(b"\n", HEAD)
    if len(lines) > HEAD and _NO_TEXT.search(lines[HEAD]):
        raise block.error("is marked as text (58), but its values are bytes; a b is to follow 58", HEAD)


def _block_of_bytes(block: Block, data: bytes, at: int, after: int, settings: bytes) -> tuple[Block, int]:
    """A function whose values are bytes."""
    marked = Block(block.path, block.number, block.kind, block.line, b"", b"")
    if block.kind != 58:
        raise marked.error("only functions (type 58) have values as bytes")
    start = after
    for _ in range(HEAD - 2):
        _, start = _line(data, start)
    head = Block(block.path, block.number, 58, block.line, data[at:start], b"")
    lines = head.lines()
    if len(lines) < HEAD:
        raise marked.error("is cut off: the file ends within its head")
    form = form_of(head, lines[8])
    _check_settings(head, settings)
    for size in form.sizes:
        close = _CLOSE_OF_BYTES.match(data, start + size)
        if close is not None and start + size <= len(data):
            return Block(block.path, block.number, 58, block.line, data[at:start], data[start : start + size]), close.end()
    expected = f"{form.points} points, which are {' or '.join(map(str, form.sizes))} bytes"
    if _TEXT.match(data, start):
        raise head.error("is marked as bytes (58b), but its values are text; the b after 58 is to go", HEAD)
    if start + form.sizes[-1] > len(data):
        raise head.error(f"is cut off: declares {expected}; the file has {len(data) - start} more")
    raise head.error(f'declares {expected}; no closing "    -1" stands behind them')


def _check_settings(head: Block, settings: bytes) -> None:
    """How bytes are to be read: the rest of the line of the type."""
    fields = [settings[:6], settings[6:12], settings[12:24]]
    try:
        order, floats, lines = (int(field) for field in fields)
    except ValueError:
        raise head.error("expected byte order, kind of floats, lines of text and bytes as integers behind 58b", 1) from None
    if order not in (1, 2) or floats != 2 or lines != HEAD - 2:
        raise head.error(
            f"byte order {order}, kind of floats {floats}, {lines} lines of text; expected 1 or 2, 2 (IEEE), 11", 1
        )
