"""Measured responses: a few as curves, many as maps of functions over frequency; where coherence is low is marked."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.measure.channels import unit_of
from trivet.measure.imported import Imported
from trivet.show.maps import check_suffix

FEW = 6
"""Functions that are drawn as curves."""
MOST = 500
"""Functions that a map shows, at most."""
CELLS = 600_000
"""Of a map, about."""
NARROW, WIDE = 400, 4000
"""Columns of a map, and points of a curve, at least and at most."""
DEEP = -80.0
"""dB below the greatest magnitude of a function, down to which colours go."""


class Seen(NamedTuple):
    """Functions as they are drawn, frequencies that lie closer than can be seen taken together."""

    frequency: np.ndarray
    """(c,) Hz"""
    magnitude: np.ndarray
    """(q, c) SI: the greatest of those taken together."""
    phase: np.ndarray
    """(q, c) deg, there."""
    coherence: np.ndarray | None
    """(q, c): the least of them."""
    doubtful: np.ndarray
    """(q, c) whether one of them is in doubt."""
    labels: list[str]


def draw_measured(found: Imported, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw measured responses (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    if suffix == ".png":
        from trivet.show.measured_picture import write_picture as write_drawing
    else:
        from trivet.show.measured_page import write_page as write_drawing
    with replacing(path, overwrite=overwrite) as temporary:
        write_drawing(found, seen(found), temporary)


def seen(found: Imported) -> Seen:
    """What is drawn."""
    functions = found.functions
    shown = range(min(len(functions), MOST))
    n = len(functions.frequency)
    columns = WIDE if len(functions) <= FEW else int(np.clip(CELLS // len(shown), NARROW, WIDE))
    starts = np.unique(np.linspace(0, n, min(n, columns), endpoint=False).astype(int))
    ends = np.append(starts[1:], n)
    values = functions.values[list(shown)]
    magnitude = np.maximum.reduceat(np.abs(values), starts, axis=1)
    # The phase where the magnitude is greatest; where all have a column of their own that is simply there.
    at = np.array([[a + int(np.argmax(np.abs(row[a:b]))) for a, b in zip(starts, ends, strict=True)] for row in values])
    phase = np.degrees(np.angle(np.take_along_axis(values, at, axis=1)))
    coherence = functions.coherence
    low = None if coherence is None else np.minimum.reduceat(coherence[list(shown)], starts, axis=1)
    doubtful = np.logical_or.reduceat(found.doubtful[list(shown)], starts, axis=1)
    middles = (starts + ends - 1) // 2
    return Seen(functions.frequency[middles], magnitude, phase, low, doubtful, functions.labels[: len(shown)])


def below_peak(magnitude: np.ndarray) -> np.ndarray:
    """(q, c) dB below the greatest of each function."""
    greatest = np.maximum(magnitude.max(axis=1, keepdims=True), 1e-300)
    with np.errstate(divide="ignore"):
        level: np.ndarray = np.maximum(20 * np.log10(magnitude / greatest), DEEP)
    return level


def mean_square(magnitude: np.ndarray) -> np.ndarray:
    """(c,) dB: quadratic mean of all functions, each against its greatest."""
    level = below_peak(magnitude)
    found: np.ndarray = 10 * np.log10(np.mean(10 ** (level / 10), axis=0))
    return found


def unit(found: Imported) -> str:
    """Of the values, where they have one in common."""
    functions = found.functions
    units = {unit_of(*one) for one in zip(functions.motions, functions.responses, functions.references, strict=True)}
    return units.pop() if len(units) == 1 else "SI of each"


def title(found: Imported) -> list[str]:
    """Where it comes from, how much there is."""
    functions = found.functions
    low, high = functions.frequency[[0, -1]]
    count = f"{len(functions)} functions" if len(functions) != 1 else "1 function"
    first = f", the first {MOST} are shown" if len(functions) > MOST else ""
    doubt = int(found.doubtful.sum())
    low_words = f"; coherence below {found.least_coherence:g} at {doubt} lines (marked)" if doubt else ""
    source = functions.source if len(functions.source) <= 90 else functions.source[:89] + "…"
    lines = f"{count}{first}, {len(functions.frequency)} lines from {low:g} to {high:g} Hz{low_words}"
    return [source or "measured responses", lines]
