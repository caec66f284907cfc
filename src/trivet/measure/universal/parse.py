"""Datasets of universal files as numbers: read by pyuff, with what pyuff takes silently checked before and after.

pyuff cuts lines at fixed columns, knows one form of exponents, and takes what is too short or too long as it is.  So it is
given one dataset at a time, in plain form; and all numbers of a function are found a second time, without columns, and
compared.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from trivet.errors import shown
from trivet.measure.universal.scan import HEAD, Block, Form, form_of

Fields = dict[str, Any]
"""A dataset as pyuff gives it."""

MOST_POINTS = 1_000_000
"""Values of the abscissa of a function that is read, at most."""
SMALLEST, LARGEST = 1e-30, 1e24
"""Between which measured numbers lie, in whatever unit."""
BEYOND = 0.05
"""Part of the numbers outside from which on they are in doubt."""
_NUMBER = re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_INTEGER = re.compile(r"[-+]?\d+")
_INTEGERS = {7: (0, 5, 15, 20, 30, 41, 51, 55, 66, 76, 80), **dict.fromkeys((9, 10, 11), (0, 10, 15, 20, 25))}
"""Columns of integers in the head of a function, by its lines; pyuff takes what is none there for zero."""
_WORDS = (30, 55)
"""First columns of words between them."""
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[-+ ]?\d)")


def parse(block: Block) -> Fields | None:
    """A dataset of one of the types that are read; None for all others.

    Raises:
        InputError: with file, dataset and line, for one that is not written as its type demands.
    """
    reader = _READERS.get(block.kind)
    return None if reader is None else reader(block)


def head(block: Block) -> Fields:
    """The head of a function."""
    return _head(block, block.lines(HEAD))


def _head(block: Block, lines: list[str]) -> Fields:
    from pyuff.datasets import dataset_58

    if len(lines) < HEAD:
        raise block.error(f"a function has {HEAD - 2} lines of head; found {max(0, len(lines) - 2)}")
    form_of(block, lines[8])
    for record, starts in _INTEGERS.items():
        for start, end in pairwise(starts):
            if (cell := lines[record][start:end].strip()) and not _INTEGER.fullmatch(cell) and start not in _WORDS:
                raise block.error(f"{shown(cell)}: expected an integer", record)
    lines = [*lines[:8], _FORTRAN.sub("E", lines[8]), *lines[9:HEAD]]
    return _ask(block, dataset_58._extract58, "\n".join(lines).encode(), header_only=True)


def _ask(block: Block, extract: Callable[..., Fields], text: str | bytes, **options: Any) -> Fields:
    """What pyuff makes of a dataset."""
    try:
        return extract(text, **options)
    except Exception:  # pyuff raises bare exceptions, without a place or a reason
        what = "is not written as its type demands, and cannot be read"
        if block.kind == 58 and not options:
            what = (
                f"numbers do not stand in the columns of their form, {form_of(block, block.lines()[8]).width} characters wide"
            )
        raise block.error(what, HEAD if block.kind == 58 else None) from None


def function(block: Block) -> Fields:
    """Dataset 58, with all its values."""
    from pyuff.datasets import dataset_58

    lines = block.lines()
    _head(block, lines)
    form = form_of(block, lines[8])
    _check_order(block, form)
    if form.points > MOST_POINTS:
        raise block.error(f"{form.points} points; functions are read up to {MOST_POINTS}", 8)
    lines[8] = _FORTRAN.sub("E", lines[8])
    if block.body is not None:
        text = "\n".join([*lines[:HEAD], ""]).encode() + _widened(block.body, form, ">" if _is_big(lines[1]) else "<")
        found = _ask(block, dataset_58._extract58, text)
    else:
        body = [_FORTRAN.sub("E", line) for line in lines[HEAD:] if line]
        values = _values(block, body, form)
        found = _ask(block, dataset_58._extract58, "\n".join([*lines[:HEAD], *_filled(body, values, form)]).encode())
    if not len(found["data"]) == len(found["x"]) == form.points:
        raise block.error(f"numbers do not stand in the columns of their form, {form.width} characters wide", HEAD)
    _check_finite(block, found)
    if block.body is None:
        _compare(block, found, values, form)
    return found


def record_of(block: Block, point: int) -> int | None:
    """The line with a point of a function, counted from 0 at the "-1" of the dataset; None where values are bytes."""
    form = form_of(block, block.lines()[8])
    return None if block.body is not None else HEAD + point * form.each // form.per_line


def _check_finite(block: Block, found: Fields) -> None:
    """Raise InputError where a value or its abscissa is not a finite number."""
    x, data = found["x"], found["data"]
    wrong = np.flatnonzero(~np.isfinite(data) | ~np.isfinite(x))
    if len(wrong):
        k = int(wrong[0])
        at = f" (at {x[k]:.6g} on its abscissa)" if np.isfinite(x[k]) else ""
        raise block.error(f"frequency line {k + 1}{at} is not finite; expected numbers", record_of(block, k))


def _is_big(record: str) -> bool:
    return record[7:13].strip() == "2"


def _check_order(block: Block, form: Form) -> None:
    """Raise InputError where values as bytes make sense in the other order only: many are beyond all reason, few turned."""
    if block.body is None:
        return
    raw = block.body
    if len(raw) != form.sizes[0]:  # leave the abscissa out, which is in single precision
        raw = np.frombuffer(raw, dtype=[("x", "V4"), ("y", f"V{8 * (form.each - 1)}")])["y"].tobytes()
    item = 8 if form.is_double else 4
    little, big = (_share_beyond(np.frombuffer(raw, dtype=f"{order}f{item}")) for order in "<>")
    told, own, right, other = (2, big, 1, little) if _is_big(block.lines(HEAD)[1]) else (1, little, 2, big)
    if own > BEYOND and other < BEYOND / 2:
        what = f"{own:.0%} of its values are beyond all reason, and {other:.0%} with {right}"
        raise block.error(f"byte order {told} is wrong: {what}; write {right} behind 58b", 1)


def _share_beyond(numbers: np.ndarray) -> float:
    """Part of the numbers, zeros left aside, that is too large or too small for any measured one."""
    with np.errstate(invalid="ignore"):
        size = np.abs(numbers[numbers != 0].astype(float))
    return float(np.mean(~((size >= SMALLEST) & (size <= LARGEST)))) if len(size) else 0.0


def _widened(body: bytes, form: Form, order: str) -> bytes:
    """Values with an abscissa in single precision as pyuff takes them, which knows doubles only."""
    if len(body) == form.sizes[0]:
        return body
    doubles = form.each - 1
    narrow = np.frombuffer(body, dtype=[("x", f"{order}f4"), ("y", f"{order}f8", (doubles,))])
    return np.column_stack([narrow["x"].astype(f"{order}f8"), narrow["y"]]).astype(f"{order}f8").tobytes()


def _values(block: Block, body: list[str], form: Form) -> np.ndarray:
    """All numbers of a function, wherever on their lines they stand."""
    whole = "\n".join(body)
    rest = _NUMBER.sub("", whole).split()
    if rest:
        wrong = next(k for k, line in enumerate(body) if _NUMBER.sub("", line).strip())
        raise block.error(f"{shown(body[wrong])}: expected numbers", HEAD + wrong)
    values = np.array(_NUMBER.findall(whole), dtype=float)
    expected = form.points * form.each
    missing = expected - len(values)
    # Some programs fill up the last line with zeros.
    if missing > 0 or len(values) - expected >= form.per_line or np.any(values[expected:]):
        each = f"{form.points} points, which are {expected} numbers"
        raise block.error(f"declares {each}; holds {len(values)}", HEAD + max(0, len(body) - 1))
    return values[:expected]


def _filled(body: list[str], values: np.ndarray, form: Form) -> list[str]:
    """Lines of values, blanks to the end of their last column, without what fills up the last line."""
    last = (len(values) - 1) % form.per_line + 1
    if len(_NUMBER.findall(body[-1])) > last:
        numbers = list(_NUMBER.finditer(body[-1]))
        body = [*body[:-1], body[-1][: numbers[last - 1].end()]]
    return [line.ljust(-(-len(line) // form.width) * form.width) for line in body]


def _compare(block: Block, found: Fields, values: np.ndarray, form: Form) -> None:
    """Raise InputError where columns gave other numbers than those that stand there."""
    data = found["data"]
    parts = [data.real, data.imag] if form.is_complex else [data]
    columns = parts if form.is_even else [found["x"], *parts]
    if not np.array_equal(np.column_stack(columns).ravel(), values):
        raise block.error(f"numbers do not stand in the columns of their form, {form.width} characters wide", HEAD)


def _header(block: Block) -> Fields:
    from pyuff.datasets import dataset_151

    lines = block.lines()
    return _ask(block, dataset_151._extract151, "\n".join([*lines, *[" "] * 9]))


def _units(block: Block) -> Fields:
    from pyuff.datasets import dataset_164

    lines = block.lines()
    lines[3:] = [_row(block, line.split(), 3 if k == 3 else 1, k) for k, line in enumerate(lines) if k > 2 and line.strip()]
    found = _ask(block, dataset_164._extract164, "\n".join(lines))
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
    return _ask(block, dataset_15._extract15, "\n".join(["    -1", "    15", *rows]))


def _precise_points(block: Block) -> Fields:
    from pyuff.datasets import dataset_2411

    lines = [(k, line) for k, line in enumerate(block.lines()) if k > 1 and line.strip()]
    rows = [_row(block, line.split(), *((3, k) if j % 2 else (4, k, 4))) for j, (k, line) in enumerate(lines)]
    if len(rows) % 2:
        raise block.error("two lines a point were expected; the last point has one")
    return _ask(block, dataset_2411._extract2411, "\n".join(["    -1", "  2411", *rows]))


def _row(block: Block, fields: list[str], count: int, record: int, integers: int = 0) -> str:
    """A line of numbers, the first ones integers, with a blank before each."""
    plain = [_FORTRAN.sub("E", field) for field in fields]
    if len(plain) != count or not all(_NUMBER.fullmatch(field) for field in plain):
        raise block.error(f"{shown(' '.join(fields))}: expected {count} numbers", record)
    if not all(np.isfinite(float(field)) for field in plain):
        raise block.error(f"{shown(' '.join(fields))}: a number is not finite", record)
    if not all(_INTEGER.fullmatch(field) for field in plain[:integers]):
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
    return _ask(block, dataset_2420._extract2420, "\n".join(lines))


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
    lines[9:] = [_FORTRAN.sub("E", line) for line in lines[9:]]
    for j, line in enumerate(lines[10:]):
        count = 1 if j % 2 == 0 else 6 if (values, each) != (2, 3) else 3
        if count == 1:
            _row(block, [line.strip()], 1, 10 + j, 1)
            continue
        cells = [line[k : k + 13].strip() for k in range(0, max(13 * count, len(line)), 13)]
        _row(block, cells, count, 10 + j)
        lines[10 + j] = line.ljust(13 * count)
    return _ask(block, dataset_55._extract55, "\n".join(lines))


_READERS: dict[int, Callable[[Block], Fields | None]] = {
    15: _points,
    55: _mode,
    58: function,
    151: _header,
    164: _units,
    2411: _precise_points,
    2420: _systems,
}
