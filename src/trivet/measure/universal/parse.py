"""Datasets of universal files as numbers: read by pyuff, with what pyuff takes silently checked before.

pyuff cuts lines at fixed columns, knows one form of exponents, and takes what is too short or too long as it is.  So it is
given one dataset at a time, in plain form.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from trivet.errors import shown
from trivet.measure.universal.function import function
from trivet.measure.universal.plain import FORTRAN, INTEGER, NUMBER, Fields, ask
from trivet.measure.universal.scan import Block


def parse(block: Block) -> Fields | None:
    """A dataset of one of the types that are read; None for all others.

    Raises:
        InputError: with file, dataset and line, for one that is not written as its type demands.
    """
    reader = _READERS.get(block.kind)
    return None if reader is None else reader(block)


def _header(block: Block) -> Fields:
    from pyuff.datasets import dataset_151

    lines = block.lines()
    return ask(block, dataset_151._extract151, "\n".join([*lines, *[" "] * 9]))


def _units(block: Block) -> Fields:
    from pyuff.datasets import dataset_164

    lines = block.lines()
    lines[3:] = [_row(block, line.split(), 3 if k == 3 else 1, k) for k, line in enumerate(lines) if k > 2 and line.strip()]
    found = ask(block, dataset_164._extract164, "\n".join(lines))
    for name in ("length", "force"):
        if not 0 < found[name] < np.inf:
            raise block.error(f"factor of {name} {found[name]}; expected above zero", 3)
    return found


def _points(block: Block) -> Fields:
    """Dataset 15: a point a line; numbers without a blank between them are cut at their columns."""
    from pyuff.datasets import dataset_15

    rows = []
    for k, line in enumerate(block.lines()[2:], 2):
        if line.strip():
            cut = [line[a:b].strip() for a, b in pairwise((0, 10, 20, 30, 40, 53, 66, 79))]
            rows.append(_row(block, cut if len(line.split()) != 7 else line.split(), 7, k, 4))
    return ask(block, dataset_15._extract15, "\n".join(["    -1", "    15", *rows]))


def _precise_points(block: Block) -> Fields:
    from pyuff.datasets import dataset_2411

    lines = [(k, line) for k, line in enumerate(block.lines()) if k > 1 and line.strip()]
    rows = [_row(block, line.split(), *((3, k) if j % 2 else (4, k, 4))) for j, (k, line) in enumerate(lines)]
    if len(rows) % 2:
        raise block.error("two lines a point were expected; the last point has one")
    return ask(block, dataset_2411._extract2411, "\n".join(["    -1", "  2411", *rows]))


def _row(block: Block, fields: list[str], count: int, record: int, integers: int = 0) -> str:
    """A line of numbers, the first ones integers, with a blank before each."""
    plain = [FORTRAN.sub("E", field) for field in fields]
    if len(plain) != count or not all(NUMBER.fullmatch(field) for field in plain):
        raise block.error(f"{shown(' '.join(fields))}: expected {count} numbers", record)
    if not all(np.isfinite(float(field)) for field in plain):
        raise block.error(f"{shown(' '.join(fields))}: a number is not finite", record)
    if not all(INTEGER.fullmatch(field) for field in plain[:integers]):
        raise block.error(f"{shown(' '.join(fields))}: expected integers for labels", record)
    return " " + " ".join(plain)


def _systems(block: Block) -> Fields:
    from pyuff.datasets import dataset_2420

    lines = block.lines()
    while lines and not lines[-1].strip():
        lines.pop()
    if len(lines) < 10 or (len(lines) - 4) % 6:
        raise block.error("expected two lines, then six for each coordinate system")
    for k in range(4, len(lines), 6):
        lines[k] = _row(block, lines[k].split()[:3], 3, k, 3)
        lines[k + 2 : k + 6] = [_row(block, line.split(), 3, j) for j, line in enumerate(lines[k + 2 : k + 6], k + 2)]
    lines[2] = lines[2].split()[0] if lines[2].split() else "0"
    return ask(block, dataset_2420._extract2420, "\n".join(lines))


def _mode(block: Block) -> Fields | None:
    """Dataset 55, of the kinds that are modes and that pyuff reads: three real or complex, or six real numbers a point."""
    from pyuff.datasets import dataset_55

    lines = block.lines()
    lines[10:] = [line for line in lines[10:] if line]
    if len(lines) < 10:
        raise block.error("is cut off within its head")
    try:
        analysis, values, each = (int(lines[7][a : a + 10]) for a in (10, 40, 50))
    except ValueError:
        raise block.error(f"{shown(lines[7])}: expected six integers", 7) from None
    if analysis not in (2, 3, 7) or (values, each) not in ((2, 3), (2, 6), (5, 3)):
        return None
    lines[9:] = [FORTRAN.sub("E", line) for line in lines[9:]]
    for j, line in enumerate(lines[10:]):
        count = 1 if j % 2 == 0 else 6 if (values, each) != (2, 3) else 3
        if count == 1:
            _row(block, [line.strip()], 1, 10 + j, 1)
            continue
        cells = [line[k : k + 13].strip() for k in range(0, max(13 * count, len(line)), 13)]
        _row(block, cells, count, 10 + j)
        lines[10 + j] = line.ljust(13 * count)
    return ask(block, dataset_55._extract55, "\n".join(lines))


_READERS: dict[int, Callable[[Block], Fields | None]] = {
    15: _points,
    55: _mode,
    58: function,
    151: _header,
    164: _units,
    2411: _precise_points,
    2420: _systems,
}
