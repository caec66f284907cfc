"""Measured responses as they were imported."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.measure.imported import Imported
from trivet.views.layout import more, table
from trivet.views.si import finite, functions_json

ROWS = 40
"""Of a table, at most."""


def tables(found: Imported) -> Iterator[Any]:
    """What there is, function by function; points, modes; what was passed over, what should be known."""
    functions = found.functions
    low, high = functions.frequency[[0, -1]]
    ends = f"{len(set(functions.responses))} responses to {len(set(functions.references))} references"
    lines = f"{len(functions.frequency)} lines from {low:g} to {high:g} Hz"
    yield f"{functions.source or 'measured responses'}\n{_counted(len(functions), 'function')}, {ends}; {lines}"
    yield _functions(found)
    if functions.points:
        yield _points(found)
    if found.modes:
        yield _modes(found)
    if found.unused:
        yield _unused(found)
    if found.notes:
        yield "\n".join(found.notes)


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _functions(found: Imported) -> Any:
    functions = found.functions
    words = ("response", "reference", "motion", "unit in file")
    rows = table("functions", *words, "peak, SI", "at Hz", "coherence from", "in doubt", left=len(words))
    lowest, doubtful = lowest_coherence(found), found.doubtful.sum(axis=1)
    for k in range(min(len(functions), ROWS)):
        peak = int(np.argmax(np.abs(functions.values[k])))
        cells = (str(functions.responses[k]), str(functions.references[k]), functions.motions[k], found.units[k])
        has = np.isfinite(lowest[k])
        numbers = (f"{abs(functions.values[k, peak]):.4g}", f"{functions.frequency[peak]:.6g}")
        rows.add_row(*cells, *numbers, f"{lowest[k]:.3f}" if has else "", str(doubtful[k]) if has else "")
    more(rows, len(functions), ROWS)
    return rows


def lowest_coherence(found: Imported) -> np.ndarray:
    """(q,) NaN where there is none."""
    coherence = found.functions.coherence
    if coherence is None:
        return np.full(len(found.functions), np.nan)
    lowest: np.ndarray = np.where(np.isnan(coherence), np.inf, coherence).min(axis=1)
    return np.where(np.isinf(lowest), np.nan, lowest)


def _points(found: Imported) -> Any:
    functions = found.functions
    rows = table("points", "", "x mm", "y mm", "z mm", "responses", "references")
    for name, at in list(functions.points.items())[:ROWS]:
        ends = [len({end for end in own if end.point == name}) for own in (functions.responses, functions.references)]
        rows.add_row(name, *(f"{1e3 * c + 0.0:.3f}" for c in at), *(str(count) if count else "" for count in ends))
    more(rows, len(functions.points), ROWS)
    return rows


def _modes(found: Imported) -> Any:
    rows = table("modes", "", "Hz", "damping %", "points", "title")
    rows.columns[-1].justify = "left"
    for k, mode in enumerate(found.modes[:ROWS], 1):
        rows.add_row(str(k), f"{mode.frequency:.4f}", f"{100 * mode.damping:.4f}", str(len(mode.points)), mode.title)
    more(rows, len(found.modes), ROWS)
    return rows


def _unused(found: Imported) -> Any:
    """Datasets by file and kind."""
    kinds: dict[tuple[str, int, str], list[int]] = {}
    for one in found.unused:
        kinds.setdefault((one.path, one.kind, one.what), []).append(one.number)
    rows = table("not used", "file", "type", "what", "datasets", left=4)
    for (path, kind, what), numbers in list(kinds.items())[:ROWS]:
        listed = ", ".join(map(str, numbers[:8])) + (f", … ({len(numbers)})" if len(numbers) > 8 else "")
        rows.add_row(path, str(kind), what, listed)
    more(rows, len(kinds), ROWS)
    return rows


def as_json(found: Imported) -> dict[str, Any]:
    """All but the values, which are in the file of --data."""
    functions = found.functions
    lowest, doubtful = lowest_coherence(found), found.doubtful.sum(axis=1)
    return {
        "source": functions.source,
        "lines": len(functions.frequency),
        "frequency_Hz": finite(functions.frequency),
        "functions": [
            one
            | {
                "unit_in_file": found.units[k],
                "lowest_coherence": finite(lowest[k]),
                "lines_in_doubt": int(doubtful[k]),
            }
            for k, one in enumerate(functions_json(functions))
        ],
        "least_coherence": found.least_coherence,
        "points": [{"name": name, "position_m": list(at)} for name, at in functions.points.items()],
        "modes": [
            {
                "frequency_Hz": mode.frequency,
                "damping_ratio": mode.damping,
                "pole_rad_per_s": {"real": mode.pole.real, "imaginary": mode.pole.imag},
                "points": list(mode.points),
                "shape_real": finite(mode.shape.real),
                "shape_imaginary": finite(mode.shape.imag),
                "title": mode.title,
            }
            for mode in found.modes
        ],
        "not_used": [{"file": one.path, "dataset": one.number, "type": one.kind, "what": one.what} for one in found.unused],
        "notes": list(found.notes),
    }
