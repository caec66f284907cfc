"""Universal files written and read without any library: numbers at fixed columns, as the formats are published."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

NONE = "NONE"


def dataset(kind: object, *records: str) -> bytes:
    """A dataset of text."""
    return "\n".join(["    -1", f"{kind:>6}", *records, "    -1", ""]).encode()


def units(length: float = 1.0, force: float = 1.0, code: int = 9) -> bytes:
    factors = "".join(f"{value:25.17E}".replace("E", "D") for value in (length, force, 1.0))
    return dataset(164, f"{code:10d}{'USER_DEFINED':<20}{2:10d}", factors, f"{273.15:25.17E}".replace("E", "D"))


def points(rows: Iterable[tuple[int, int, int, tuple[float, float, float]]]) -> bytes:
    """Dataset 2411: number, system of the position, system of the motion, place."""
    lines = []
    for number, own, along, place in rows:
        lines += [f"{number:10d}{own:10d}{along:10d}{8:10d}", "".join(f"{c:25.16E}".replace("E", "D") for c in place)]
    return dataset(2411, *lines)


def old_points(rows: Iterable[tuple[int, int, int, tuple[float, float, float]]]) -> bytes:
    """Dataset 15."""
    return dataset(15, *(f"{n:10d}{a:10d}{b:10d}{8:10d}" + "".join(f"{c:13.5E}" for c in place) for n, a, b, place in rows))


def systems(rows: Iterable[tuple[int, int, Any]]) -> bytes:
    """Dataset 2420: label, kind, four rows."""
    lines = [f"{1:10d}", "part"]
    for label, kind, matrix in rows:
        lines += [f"{label:10d}{kind:10d}{8:10d}", f"CS{label}"]
        lines += ["".join(f"{c:25.16E}" for c in row) for row in matrix]
    return dataset(2420, *lines)


def head(
    points: int,
    *,
    kind: int = 4,
    ordinate: int = 6,
    even: bool = True,
    first: float = 0.0,
    step: float = 1.0,
    response: tuple[int, int] = (1, 3),
    reference: tuple[int, int] = (2, -1),
    types: tuple[int, int, int] = (18, 12, 13),
    labels: tuple[str, str, str] = ("Hz", "m/s^2", "N"),
    exponents: tuple[tuple[int, int], tuple[int, int]] = ((0, 0), (0, 0)),
    names: tuple[str, str] = (NONE, NONE),
) -> list[str]:
    """The eleven lines of a function before its values."""
    both = zip(names, (response, reference), strict=True)
    ends = f"{kind:5d}{1:10d}{0:5d}{0:10d}" + "".join(f" {name:<10}{end[0]:10d}{end[1]:4d}" for name, end in both)
    form = f"{ordinate:10d}{points:10d}{int(even):10d}{first if even else 0:13.5E}{step if even else 0:13.5E}{0:13.5E}"
    axes = [
        f"{types[k]:10d}{powers[0]:5d}{powers[1]:5d}{0:5d} {'NONE':<20} {labels[k]:<20}"
        for k, powers in enumerate(((0, 0), *exponents))
    ]
    return [
        "response",
        NONE,
        "27-NOV-26 12:00:00",
        NONE,
        NONE,
        ends,
        form,
        *axes,
        f"{0:10d}{0:5d}{0:5d}{0:5d} {NONE:<20} {NONE:<20}",
    ]


def text_lines(values: Sequence[float], ordinate: int, even: bool) -> list[str]:
    """Values (abscissa first where it is uneven) as text."""
    if ordinate in (2, 5):
        formats, per_line = ["13.5E"], 6
    elif even:
        formats, per_line = ["20.12E"], 4
    else:
        formats, per_line = (["13.5E", "20.12E"], 4) if ordinate == 4 else (["13.5E", "20.12E", "20.12E"], 3)
    cells = [f"{value:{formats[k % len(formats)]}}" for k, value in enumerate(values)]
    return ["".join(cells[k : k + per_line]) for k in range(0, len(cells), per_line)]


def numbers(x: np.ndarray, y: np.ndarray, even: bool) -> list[float]:
    """Abscissa and ordinate as they follow each other."""
    columns = [] if even else [x]
    columns += [y.real, y.imag] if np.iscomplexobj(y) else [y]
    return np.column_stack(columns).ravel().tolist()


def function(x: np.ndarray, y: np.ndarray, **settings: Any) -> bytes:
    """Dataset 58 as text."""
    ordinate, even = settings.setdefault("ordinate", 6), settings.setdefault("even", True)
    settings.setdefault("first", x[0])
    settings.setdefault("step", x[1] - x[0])
    return dataset(58, *head(len(y), **settings), *text_lines(numbers(x, y, even), ordinate, even))


def function_bytes(x: np.ndarray, y: np.ndarray, order: str = "<", narrow: bool = False, **settings: Any) -> bytes:
    """Dataset 58b; `narrow` writes the abscissa of doubles in single precision."""
    ordinate, even = settings.setdefault("ordinate", 6), settings.setdefault("even", True)
    settings.setdefault("first", x[0])
    settings.setdefault("step", x[1] - x[0])
    item = "d" if ordinate in (4, 6) else "f"
    row = numbers(x, y, even)
    each = len(row) // len(y)
    codes = [("f" if narrow and not even and k % each == 0 else item) for k in range(len(row))]
    body = struct.pack(order + "".join(codes), *row)
    first = f"{58:6d}b{1 if order == '<' else 2:6d}{2:6d}{11:12d}{len(body):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return "\n".join(["    -1", first, *head(len(y), **settings), ""]).encode() + body + b"    -1\n"


def plain(value: str) -> float:
    return float(value.strip().replace("D", "E").replace("d", "e"))


def read(data: bytes) -> list[tuple[int, Any]]:
    """Datasets of a file, as (type, numbers); words as lines."""
    found: list[tuple[int, Any]] = []
    at = 0
    while (at := data.find(b"    -1", at)) >= 0:
        lines = data[at:].split(b"\n", 13)
        kind = int(lines[1][:6])
        if lines[1][6:7].lower() == b"b":
            start = at + sum(len(line) + 1 for line in lines[:13])
            size = int(lines[1][31:43])
            found.append((kind, _bytes(lines, data[start : start + size])))
            end = data.index(b"-1", start + size) + 2
        else:
            stop = data.index(b"\n    -1", at + 6)
            rows = data[at:stop].decode("latin-1").replace("\r", "").split("\n")[2:]
            found.append((kind, _TEXTS[kind](rows) if kind in _TEXTS else rows))
            end = stop + 7
        at = end
    return found


def _form(record: str) -> tuple[int, int, bool]:
    return int(record[:10]), int(record[10:20]), int(record[20:30]) == 1


def _bytes(lines: list[bytes], body: bytes) -> list[float]:
    ordinate, points, even = _form(lines[8].decode("latin-1"))
    order = "<" if int(lines[1][7:13]) == 1 else ">"
    each = (2 if ordinate in (5, 6) else 1) + (0 if even else 1)
    item = "d" if ordinate in (4, 6) else "f"
    wide = points * each * (8 if item == "d" else 4) == len(body)
    codes = [(item if wide or k % each else "f") for k in range(points * each)]
    return list(struct.unpack(order + "".join(codes), body))


def _function(rows: list[str]) -> list[float]:
    ordinate, points, even = _form(rows[6])
    each = (2 if ordinate in (5, 6) else 1) + (0 if even else 1)
    if ordinate in (2, 5):
        widths = [13] * 6
    elif even:
        widths = [20] * 4
    else:
        widths = [13, 20, 13, 20] if ordinate == 4 else [13, 20, 20]
    found: list[float] = []
    for row in rows[11:]:
        at = 0
        for width in widths:
            if row[at : at + width].strip():
                found.append(plain(row[at : at + width]))
            at += width
    return found[: points * each]


def _cells(row: str, *widths: int) -> list[float]:
    ends = np.cumsum([0, *widths]).tolist()
    return [plain(row[a:b]) for a, b in pairwise(ends)]


def _old_points(rows: list[str]) -> list[list[float]]:
    return [_cells(row, 10, 10, 10, 10, 13, 13, 13) for row in rows]


def _points(rows: list[str]) -> list[list[float]]:
    return [_cells(a, 10, 10, 10, 10) + _cells(b, 25, 25, 25) for a, b in zip(rows[::2], rows[1::2], strict=True)]


def _units(rows: list[str]) -> list[float]:
    return [*_cells(rows[1], 25, 25, 25), plain(rows[2])]


def _mode(rows: list[str]) -> list[float]:
    count = 6 if int(rows[5][40:50]) == 5 or int(rows[5][50:60]) == 6 else 3
    found = [plain(cell) for cell in (rows[7][k : k + 13] for k in range(0, len(rows[7].rstrip()), 13))]
    for number, row in zip(rows[8::2], rows[9::2], strict=True):
        found += [plain(number), *_cells(row, *[13] * count)]
    return found


_TEXTS = {15: _old_points, 55: _mode, 58: _function, 164: _units, 2411: _points}
