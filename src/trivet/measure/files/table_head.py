"""What stands above the numbers in a table of measured responses (see `table.py`)."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple, TextIO

from pydantic_core import PydanticCustomError

from trivet.errors import InputError, nearest, shown
from trivet.measure.channels import channel_of, factor_of, is_name
from trivet.measure.functions import MOTIONS, Channel, Motion
from trivet.model.quantity import Quantity

FIRST = "# trivet measured responses"
HEADER = "# frequency: Hz, and rows response,12:+z,… reference,… motion,… unit,… part,real,… above the numbers"
"""What stands above the numbers, for messages."""
KEYS = ("response", "reference", "motion", "unit", "part")
PARTS = ("real", "imag", "amplitude", "phase", "coherence")
PAIRS = (PARTS[:2], PARTS[2:4])
LETTERS = 32
"""Of a number in a file, at most."""
LONGEST_LINE = 3_000_000
"""Letters of a line, at most: a row is in memory as a whole."""
_KINDS = {
    "frequency": Quantity("frequency", "Hz", "Hz"),
    "phase": Quantity("angle", "rad", "deg"),
    "position": Quantity("length", "m", "mm"),
}


class Column(NamedTuple):
    """What a column holds."""

    response: Channel
    reference: Channel
    motion: Motion
    part: str
    unit: str
    """As the table has it."""
    factor: float
    """SI value of one unit of it."""

    @property
    def function(self) -> tuple[Channel, Channel, Motion]:
        """What is alike in the columns of one function."""
        return self.response, self.reference, self.motion


class Head(NamedTuple):
    """All that is said above the numbers."""

    columns: list[Column]
    """Behind the frequency."""
    firsts: list[int]
    """The first column of every function."""
    frequency_factor: float
    """Hz per unit of the frequency."""
    points: dict[str, tuple[float, float, float]]
    source: str


class Said(NamedTuple):
    """What a row says of every column."""

    line: int
    cells: list[str]


class Rows:
    """Rows of a table, one after the other, and complaints that say where they are."""

    def __init__(self, name: str, file: TextIO) -> None:
        self.name = name
        self._rows = csv.reader(self._lines(file), strict=True)

    def __iter__(self) -> Iterator[list[str]]:
        """Rows with anything in them."""
        try:
            for row in self._rows:
                if any(cell.strip() for cell in row):
                    yield row
        except csv.Error as error:
            raise self.error(f"is no row of comma-separated values: {error}") from None

    def _lines(self, file: TextIO) -> Iterator[str]:
        while line := file.readline(LONGEST_LINE):
            if len(line) == LONGEST_LINE:
                raise InputError(f"{self.name}: line {self._rows.line_num + 1}: is longer than {LONGEST_LINE} letters")
            yield line

    @property
    def line(self) -> int:
        """Number of the line at which reading is, from 1."""
        return max(self._rows.line_num, 1)

    def error(self, text: str, column: int | None = None, line: int | None = None) -> InputError:
        """A complaint about a line, the one at which reading is by default, or about a column of it, counted from 1."""
        where = f"line {self.line if line is None else line}" + ("" if column is None else f", column {column}")
        return InputError(f"{self.name}: {where}: {text}")

    def number(self, text: str, column: int | None = None) -> float:
        """A finite number; no other spelling of one than with digits, a point and an exponent."""
        try:
            value = float(text) if len(text) <= LETTERS and "_" not in text else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(f"{shown(text)}: expected a finite number", column)
        return value


def unit_factor(kind: str, unit: str) -> float:
    """SI value of a unit of a frequency, a phase or a position.

    Raises:
        InputError: for a text that is none.
    """
    try:
        return _KINDS[kind].parse(f"1 {unit}")
    except PydanticCustomError as error:
        raise InputError(f"unit {shown(unit)} of {kind}: {error.message()}") from None


def read_head(rows: Rows, each: Iterator[list[str]]) -> tuple[Head, list[str]]:
    """Reads up to the numbers; gives what was said, and the first row of numbers.

    Raises:
        InputError: with the line, the column, what stands there and what was expected.
    """
    if next(each, [""])[0].strip() != FIRST:
        raise rows.error(f"expected the first line to be {FIRST}, then {HEADER}; docs/measure.md has an example")
    comments: dict[str, str] = {}
    factor: float | None = None
    points: dict[str, tuple[float, float, float]] = {}
    keyed: dict[str, Said] = {}
    for row in each:
        first = row[0].strip()
        if first.startswith("#"):
            # Programs for tables put what has commas between quotes, or it falls into cells.
            text = row[0] if len(row) == 1 else ",".join(row).rstrip(", ")
            key, value = _comment(rows, text.lstrip().removeprefix("#").lstrip(), comments)
            if key == "frequency":
                factor = _here(rows, "frequency", value)
            elif key.startswith("point "):
                points[key.removeprefix("point ")] = _position(rows, value)
            comments[key] = value
        elif first in KEYS:
            keyed[first] = _keyed(rows, row, keyed)
        elif first[:1].isalpha():
            hint = "; is the table separated by commas?" if len(row) == 1 else nearest(first, KEYS)
            raise rows.error(f"{shown(first)}: expected a row of {', '.join(KEYS)}, or numbers{hint}")
        else:
            columns = _columns(rows, keyed)
            if factor is None:
                raise rows.error("expected a line # frequency: Hz above the numbers, the unit of the first column")
            firsts = _firsts(rows, columns, keyed["part"].line)
            return Head(columns, firsts, factor, points, comments.get("source", "")), row
    raise rows.error("expected rows of numbers; there are none")


def _comment(rows: Rows, text: str, before: Iterable[str]) -> tuple[str, str]:
    """Key and value of a line of the header: frequency, source, or point NAME."""
    if text.startswith("point "):
        key, _, value = text.rpartition(":")
    else:
        key, _, value = text.partition(":")
    if key not in ("frequency", "source") and not (key.startswith("point ") and is_name(key.removeprefix("point "))):
        hint = nearest(key, ("frequency", "source"))
        raise rows.error(f"{shown('# ' + text)}: expected # frequency, # source or # point NAME{hint}")
    if key in before:
        raise rows.error(f"# {key}: is given twice")
    return key, value.removeprefix(" ") if key == "source" else value.strip()


def _position(rows: Rows, text: str) -> tuple[float, float, float]:
    parts = text.split(",")
    if len(parts) != 3:
        raise rows.error(f"{shown(text)}: expected three lengths with their units, such as 0 mm, 100 mm, 20 mm")
    x, y, z = (_length(rows, part) for part in parts)
    return x, y, z


def _length(rows: Rows, text: str) -> float:
    number, _, unit = text.strip().partition(" ")
    return rows.number(number) * _here(rows, "position", unit)


def _here(rows: Rows, kind: str, unit: str) -> float:
    try:
        return unit_factor(kind, unit)
    except InputError as error:
        raise rows.error(str(error)) from None


def _keyed(rows: Rows, row: list[str], keyed: dict[str, Said]) -> Said:
    """A row that says something of every column."""
    key, cells = row[0].strip(), [cell.strip() for cell in row[1:]]
    if key in keyed:
        raise rows.error(f"{key}: there is such a row already")
    for other, before in keyed.items():
        if len(before.cells) != len(cells):
            raise rows.error(f"{key}: has {len(cells)} columns; the row {other} has {len(before.cells)}")
    return Said(rows.line, cells)


def _columns(rows: Rows, keyed: dict[str, Said]) -> list[Column]:
    for key in KEYS:
        if key not in keyed:
            raise rows.error(f"expected a row {key},… above the numbers, which says it of every column")
    known = {str(motion): motion for motion in MOTIONS}
    columns = []
    for k, words in enumerate(zip(*(keyed[key].cells for key in KEYS), strict=True)):
        said = dict(zip(KEYS, words, strict=True))
        key = "motion"  # of which is spoken
        try:
            motion = known[_known(said["motion"], tuple(known))]
            key = "part"
            part = _known(said["part"], PARTS)
            key = "response"
            response = channel_of(said["response"])
            key = "reference"
            reference = channel_of(said["reference"])
            key = "unit"
            factor = _factor(said["unit"], part, motion, response, reference)
        except InputError as error:
            raise rows.error(str(error), k + 2, keyed[key].line) from None
        columns.append(Column(response, reference, motion, part, said["unit"], factor))
    return columns


def _known(word: str, words: tuple[str, ...]) -> str:
    if word not in words:
        raise InputError(f"{shown(word)}: expected one of {', '.join(words)}{nearest(word, words)}")
    return word


def _factor(unit: str, part: str, motion: Motion, response: Channel, reference: Channel) -> float:
    """SI value of one unit of a column."""
    if part == "phase":
        return unit_factor("phase", unit)
    if part == "coherence":
        if unit not in ("", "1"):
            raise InputError(f"unit {shown(unit)} of coherence: expected 1")
        return 1.0
    return factor_of(unit, motion, response, reference)


def _firsts(rows: Rows, columns: list[Column], line: int) -> list[int]:
    """The first column of every function; two columns belong to it, or three where a coherence follows."""
    firsts = [0]
    while True:
        start = firsts[-1]
        pair = columns[start : start + 2]
        if tuple(c.part for c in pair) not in PAIRS or pair[0].function != pair[1].function:
            raise rows.error("expected real and imag, or amplitude and phase, of one function side by side", start + 2, line)
        after = columns[start + 2 : start + 3]
        has_coherence = bool(after) and after[0].part == "coherence" and after[0].function == pair[0].function
        start += 3 if has_coherence else 2
        if start >= len(columns):
            return firsts
        firsts.append(start)
