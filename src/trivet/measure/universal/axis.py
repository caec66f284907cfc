"""Frequency axes of universal files, which write a first value and a step in six digits."""

from __future__ import annotations

import math

import numpy as np

DYADIC = 12
"""Greatest power of two by which a step is taken to be divided."""


def even_axis(first: float, step: float, points: int) -> np.ndarray:
    """(n,) frequencies from a first value and a step as they stand in a file.

    Analysers divide round sampling rates by powers of two: steps end after a few binary digits, yet may take more than six
    decimal ones. 0.1953125 is written as 0.195313, which is 3 mHz too much after 6400 lines.  So a step that fills its six
    digits is taken as the fraction p/2^k which rounds to it, where there is one, and the first value as the multiple of the
    step which rounds to it.  Either way the axis agrees with all digits of the file.
    """
    whole = _plainest(step)
    times = round(first / whole) if whole else 0
    start = times * whole if abs(times * whole - first) <= _half_digit(first) else first
    return start + whole * np.arange(points)


def is_even(frequency: np.ndarray) -> bool:
    """Whether an axis, written as a first value and a step, is read back to the last bit."""
    first, step = (float(f"{value:.5e}") for value in (frequency[0], frequency[1] - frequency[0]))
    return bool(np.array_equal(even_axis(first, step, len(frequency)), frequency))


def has_six_digits(frequency: np.ndarray) -> bool:
    """Whether every frequency is read back from six digits to the last bit."""
    return all(float(f"{value:.5e}") == value for value in frequency.tolist())


def _half_digit(value: float) -> float:
    """Half a unit of the sixth digit."""
    return 0.0 if value == 0 else 0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - 5) * (1 + 1e-9)


def _plainest(step: float) -> float:
    text = f"{step:.5e}"
    if float(text) != step or text[6] == "0":
        return step
    half = _half_digit(step)
    for power in range(DYADIC + 1):
        if 2.0**-power < 40 * half:  # so many fractions that one is always near
            break
        near = round(step * 2**power) / 2**power
        if abs(near - step) <= half:
            return near
    return step
