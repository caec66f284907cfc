"""Measured responses as a table of comma-separated values, every column with its channel, its motion and its unit.

    # trivet measured responses
    # source: hammer test of the first prototype
    # point 12: 100 mm, 0 mm, 20 mm
    # frequency: Hz
    response,12:+z,12:+z,12:+x,12:+x,12:+x
    reference,3:-x,3:-x,3:-x,3:-x,3:-x
    motion,acceleration,acceleration,displacement,displacement,displacement
    unit,m/s^2/N,m/s^2/N,um/N,deg,1
    part,real,imag,amplitude,phase,coherence
    10,0.0123,-0.0004,1.25,-3.1,0.99

Columns of a function stand side by side: real and imag, or amplitude and phase, then its coherence where there is one.
"""

from __future__ import annotations

import csv
import math
import os
from array import array
from collections.abc import Iterator

import numpy as np

from trivet.errors import InputError, shown
from trivet.files import check_room, replacing
from trivet.measure.channels import unit_of, written
from trivet.measure.checking import check_count
from trivet.measure.files.table_head import FIRST, KEYS, Column, Head, Rows, read_head
from trivet.measure.functions import Functions
from trivet.measure.imported import Content

LETTERS = 45.0
"""Of a complex number in a table, with its commas, at most."""


def read_table(path: str) -> Content:
    """Read a table.

    Raises:
        InputError: with the line, the column, what stands there and what was expected.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            rows = Rows(path, file)
            each = iter(rows)
            head, first = read_head(rows, each)
            functions = _functions(head, _numbers(rows, each, head, first))
            return Content.of(path, functions, [head.columns[k].unit for k in head.firsts])
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text in UTF-8: {error.reason}") from None


def _numbers(rows: Rows, each: Iterator[list[str]], head: Head, first: list[str]) -> np.ndarray:
    """(n, 1 + columns) numbers as they stand, the frequencies first."""
    data, lines, last = array("d"), 0, -math.inf
    width = 1 + len(head.columns)
    row: list[str] | None = first
    while row is not None:
        if len(row) != width:
            hint = "; is the table separated by commas?" if len(row) == 1 else ""
            raise rows.error(f"has {len(row)} cells; expected {width}: the frequency and {width - 1} columns{hint}")
        frequency = rows.number(row[0].strip(), 1)
        if frequency < 0 or frequency <= last:
            after = f" after {last:g}" if lines else ""
            raise rows.error(f"frequency {frequency:g}{after}: expected frequencies that rise, from 0 or more", 1)
        data.append(frequency)
        data.extend(_cell(rows, cell.strip(), k, head.columns[k]) for k, cell in enumerate(row[1:]))
        last = frequency
        lines += 1
        check_count(len(head.firsts), lines, f"{rows.name}: line {rows.line}")
        row = next(each, None)
    return np.frombuffer(data, dtype=float).reshape(lines, width)


def _cell(rows: Rows, text: str, k: int, column: Column) -> float:
    if column.part == "coherence" and not text:
        return math.nan
    value = rows.number(text, k + 2)
    if column.part == "amplitude" and value < 0:
        raise rows.error(f"{shown(text)}: expected an amplitude, 0 or more", k + 2)
    return value


def _functions(head: Head, data: np.ndarray) -> Functions:
    columns = [head.columns[k] for k in head.firsts]
    values = np.empty((len(columns), len(data)), dtype=complex)
    coherence = np.full(values.shape, math.nan)
    for k, start in enumerate(head.firsts):
        one, other = (data[:, 1 + n] * head.columns[n].factor for n in (start, start + 1))
        if columns[k].part == "real":
            values[k].real, values[k].imag = one, other
        else:
            values[k] = one * np.exp(1j * other)
        if start + 2 < len(head.columns) and head.columns[start + 2].part == "coherence":
            coherence[k] = data[:, start + 3]
    return Functions(
        data[:, 0] * head.frequency_factor,
        values,
        tuple(column.motion for column in columns),
        tuple(column.response for column in columns),
        tuple(column.reference for column in columns),
        head.points,
        None if np.isnan(coherence).all() else coherence,
        head.source,
    )


def write_table(functions: Functions, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write responses that `check_functions` takes, as real and imaginary parts."""
    check_room(path, LETTERS * functions.values.size)
    coherence = np.full(functions.values.shape, math.nan) if functions.coherence is None else functions.coherence
    has_coherence = ~np.isnan(coherence).all(axis=1)
    with replacing(path, overwrite=overwrite) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerows([text] for text in _comments(functions))
        rows.writerows(_keyed(functions, has_coherence))
        for n, frequency in enumerate(functions.frequency.tolist()):
            row = [repr(frequency)]
            for k, value in enumerate(functions.values[:, n].tolist()):
                row += [repr(value.real), repr(value.imag)]
                if has_coherence[k]:
                    row.append("" if math.isnan(coherence[k, n]) else repr(float(coherence[k, n])))
            rows.writerow(row)


def _comments(functions: Functions) -> Iterator[str]:
    yield FIRST
    if functions.source:
        yield f"# source: {functions.source}"
    for point, position in functions.points.items():
        yield f"# point {point}: {', '.join(f'{float(c)!r} m' for c in position)}"
    yield "# frequency: Hz"


def _keyed(functions: Functions, has_coherence: np.ndarray) -> list[list[str]]:
    keyed: dict[str, list[str]] = {key: [key] for key in KEYS}
    for k, coherent in enumerate(has_coherence):
        response, reference, motion = functions.responses[k], functions.references[k], functions.motions[k]
        for part in ("real", "imag", "coherence")[: 3 if coherent else 2]:
            unit = "1" if part == "coherence" else unit_of(motion, response, reference)
            for key, cell in zip(KEYS, (written(response), written(reference), motion, unit, part), strict=True):
                keyed[key].append(cell)
    return list(keyed.values())
