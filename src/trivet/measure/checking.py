"""What every set of measured responses has to be, wherever it comes from or goes."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from trivet.errors import InputError, shown
from trivet.measure.channels import UNIT_LENGTH, is_name
from trivet.measure.functions import MOTIONS, Functions
from trivet.model.quantity import LARGEST

PACKED = {"gzip": b"\x1f\x8b", "zip": b"PK\x03\x04", "bzip2": b"BZh", "xz": b"\xfd7zXZ\x00"}
"""First bytes of compressed files."""
MOST_VALUES = 20_000_000
"""Complex values of all functions together: a third of a gigabyte."""
MOST_FUNCTIONS = 10_000
LARGEST_FILE = 500_000_000
"""Bytes of a file of functions."""
HIGHEST = 1e9
"""Hz; no structure is measured there."""
FARTHEST = 1e4
"""m; a point so far from the origin of its axes was given in another unit."""


def check_size(path: str | os.PathLike[str]) -> None:
    """Refuse a file that is too large to be read, or that cannot be read.

    Raises:
        InputError: naming the size and the bound.
    """
    name = os.fspath(path)
    try:
        size = os.stat(name).st_size
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror or error}") from None
    if not os.path.isfile(name):
        raise InputError(f"{name}: is no regular file")
    check_plain(name)
    if size > LARGEST_FILE:
        raise InputError(
            f"{name}: has {size / 1e6:.0f} MB; expected at most {LARGEST_FILE / 1e6:.0f} MB; "
            "keep fewer functions or frequencies in it"
        )


def check_plain(name: str) -> None:
    """Refuse what is compressed.

    Raises:
        InputError: naming the way, or for a file that cannot be read.
    """
    try:
        with open(name, "rb") as file:
            start = file.read(6)
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror or error}") from None
    for way, mark in PACKED.items():
        if start.startswith(mark):
            raise InputError(f"{name}: is compressed ({way}); unpack it first")


def check_count(functions: int, frequencies: int, where: str) -> None:
    """Refuse, before anything is read, more functions and frequencies than are kept in memory."""
    if functions < 1 or frequencies < 1:
        raise InputError(f"{where}: {functions} functions at {frequencies} frequencies; expected at least one of each")
    if functions > MOST_FUNCTIONS or functions * frequencies > MOST_VALUES:
        raise InputError(
            f"{where}: {functions} functions at {frequencies} frequencies; expected at most {MOST_FUNCTIONS} functions and "
            f"{MOST_VALUES} values in all; keep fewer functions or frequencies"
        )


def check_functions(functions: Functions, where: str) -> None:
    """Refuse functions with anything in them that is no measured response.

    Args:
        functions: of the right types, as a reader has made them.
        where: with which a message begins.

    Raises:
        InputError: naming what is wrong, where, and what was expected.
    """
    count, lines = len(functions.motions), len(functions.frequency)
    check_count(count, lines, where)
    shapes = (np.shape(functions.values), (len(functions.responses), lines), (len(functions.references), lines))
    if any(shape != (count, lines) for shape in shapes):
        raise InputError(f"{where}: values, motions, responses and references do not belong together: {shapes}")
    check_frequencies(functions.frequency, where)
    for motion in functions.motions:
        if motion not in MOTIONS:
            raise InputError(f"{where}: motion {shown(motion)}; expected {', '.join(MOTIONS)}")
    for channel in (*functions.responses, *functions.references):
        if not is_name(channel.point) or not abs(np.linalg.norm(channel.direction) - 1) <= UNIT_LENGTH:
            raise InputError(f"{where}: channel {shown(str(channel))}; expected a named point and a unit vector")
    _check_values(functions, where)
    for point, position in functions.points.items():
        if not np.all(np.abs(position) <= FARTHEST):
            raise InputError(f"{where}: point {point}: {position} m; expected coordinates up to {FARTHEST:g} m")


def check_frequencies(frequency: Sequence[float] | np.ndarray, where: str) -> None:
    """Refuse frequencies (n,) in Hz that are not finite, below zero, beyond all that is measured, or do not rise."""
    numbers = np.asarray(frequency)
    wrong = np.flatnonzero(~((numbers >= 0) & (numbers <= HIGHEST)))  # a NaN is none either
    if len(wrong):
        k = int(wrong[0])
        expected = f"expected a finite one, 0 to {HIGHEST:g} Hz"
        raise InputError(f"{where}: frequency {k + 1} of {len(numbers)}: {numbers[k]:g} Hz; {expected}")
    falling = np.flatnonzero(np.diff(numbers) <= 0)
    if len(falling):
        k = int(falling[0]) + 1
        raise InputError(
            f"{where}: frequency {k + 1} of {len(numbers)}: {numbers[k]:g} Hz after {numbers[k - 1]:g} Hz; expected rising ones"
        )


def _check_values(functions: Functions, where: str) -> None:
    measured = (np.abs(functions.values.real) <= LARGEST) & (np.abs(functions.values.imag) <= LARGEST)
    if not measured.all():
        function, line = (int(k) for k in np.argwhere(~measured)[0])
        raise InputError(
            f"{where}: {functions.labels[function]} at {functions.frequency[line]:g} Hz: {functions.values[function, line]:g}; "
            f"expected a finite value up to {LARGEST:g}; leave out that frequency"
        )
    if functions.coherence is None:
        return
    if functions.coherence.shape != functions.values.shape:
        raise InputError(f"{where}: coherence: has shape {functions.coherence.shape}; expected {functions.values.shape}")
    wrong = np.argwhere((functions.coherence < 0) | (functions.coherence > 1 + 1e-6))
    if len(wrong):
        function, line = (int(k) for k in wrong[0])
        raise InputError(
            f"{where}: coherence of {functions.labels[function]} at {functions.frequency[line]:g} Hz: "
            f"{functions.coherence[function, line]:g}; expected 0 to 1"
        )
