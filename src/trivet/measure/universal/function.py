"""Functions of universal files, dataset 58, as numbers: read by pyuff, with what it takes silently checked before and after.

pyuff cuts lines at fixed columns, and takes what is too short or too long as it is.  So all numbers of a function are found a
second time, without columns, and compared.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from trivet.errors import shown
from trivet.measure.universal.plain import FORTRAN, INTEGER, NUMBER, Fields, ask
from trivet.measure.universal.scan import HEAD, Block, Form, form_of
from trivet.model.quantity import LARGEST, SMALLEST

MOST_POINTS = 1_000_000
"""Values of the abscissa of a function that is read, at most."""
BEYOND = 0.05
"""Part of the values outside of what is measured from which on they are in doubt."""
_INTEGERS = {7: (0, 5, 15, 20, 30, 41, 51, 55, 66, 76, 80), **dict.fromkeys((9, 10, 11), (0, 10, 15, 20, 25))}
"""Columns of integers in the head of a function, by its lines; pyuff takes what is none there for zero."""
_WORDS = (30, 55)
"""First columns of words between them."""


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
            if (cell := lines[record][start:end].strip()) and not INTEGER.fullmatch(cell) and start not in _WORDS:
                raise block.error(f"{shown(cell)}: expected an integer", record)
    lines = [*lines[:8], FORTRAN.sub("E", lines[8]), *lines[9:HEAD]]
    return ask(block, dataset_58._extract58, "\n".join(lines).encode(), record=HEAD, header_only=True)


def function(block: Block) -> Fields:
    """Dataset 58, with all its values."""
    from pyuff.datasets import dataset_58

    lines = block.lines()
    _head(block, lines)
    form = form_of(block, lines[8])
    _check_order(block, form)
    if form.points > MOST_POINTS:
        raise block.error(f"{form.points} points; functions are read up to {MOST_POINTS}", 8)
    lines[8] = FORTRAN.sub("E", lines[8])
    values = None
    if block.body is not None:
        text = "\n".join([*lines[:HEAD], ""]).encode() + _widened(block.body, form, ">" if _is_big(lines[1]) else "<")
    else:
        body = [FORTRAN.sub("E", line) for line in lines[HEAD:] if line]
        values = _values(block, body, form)
        text = "\n".join([*lines[:HEAD], *_filled(body, values, form)]).encode()
    columns = f"numbers do not stand in the columns of their form, {form.width} characters wide"
    found = ask(block, dataset_58._extract58, text, columns, HEAD)
    if not len(found["data"]) == len(found["x"]) == form.points:
        raise block.error(columns, HEAD)
    _check_finite(block, found)
    if values is not None and not _is_same(found, values, form):
        raise block.error(columns, HEAD)
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
    rest = NUMBER.sub("", whole).split()
    if rest:
        wrong = next(k for k, line in enumerate(body) if NUMBER.sub("", line).strip())
        raise block.error(f"{shown(body[wrong])}: expected numbers", HEAD + wrong)
    values = np.array(NUMBER.findall(whole), dtype=float)
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
    if len(NUMBER.findall(body[-1])) > last:
        numbers = list(NUMBER.finditer(body[-1]))
        body = [*body[:-1], body[-1][: numbers[last - 1].end()]]
    return [line.ljust(-(-len(line) // form.width) * form.width) for line in body]


def _is_same(found: Fields, values: np.ndarray, form: Form) -> bool:
    """Whether columns gave the numbers that stand there."""
    data = found["data"]
    parts = [data.real, data.imag] if form.is_complex else [data]
    columns = parts if form.is_even else [found["x"], *parts]
    return bool(np.array_equal(np.column_stack(columns).ravel(), values))
