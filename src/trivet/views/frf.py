"""Frequency responses at a pose."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.table import Table

from trivet.study.response_summary import ShownResponse, unit_of_stiffness
from trivet.views.layout import reached, table, where
from trivet.views.si import finite, minima_json, pose_keys


def tables(shown: ShownResponse) -> Iterator[Any]:
    """Natural frequencies, the response there, minimum dynamic stiffness."""
    whole = shown.whole
    at, low, high = whole.at, whole.frequency[0], whole.frequency[-1]
    own = " (some parts have damping of their own)" if whole.has_own_damping else ""
    yield (
        f"{where(at.machine.name, at.mode, at.position, at.angles)}\n{reached(at.miss)}\n"
        f"{shown.output} of {whole.response} under loads at {whole.excitation}, method {whole.method}, "
        f"{whole.damping} damping with loss factor {whole.loss_factor:g}{own}, {low:g} to {high:g} Hz"
    )
    yield _resonances(shown) if len(whole.natural) else f"no natural frequency from {low:g} to {high:g} Hz"
    if shown.minima:
        yield _minima(shown)
    elif not whole.is_bounded:
        yield "Without damping the response has no bound at a natural frequency, and the dynamic stiffness goes down to zero."


def _resonances(shown: ShownResponse) -> Table:
    entries = shown.entries if shown.whole.is_bounded else ()  # else there is no bound
    heads = [head for entry in entries for head in (f"{entry} {shown.unit(entry).written}", "phase °")]
    title = f"natural frequencies and the {shown.output} there" if entries else "natural frequencies"
    found = table(title, "", "Hz", *heads)
    values = [shown.unit(entry).factor * shown.at_resonances(entry) for entry in entries]
    for k, frequency in enumerate(shown.whole.natural):
        cells = [cell for own in values for cell in _polar(own[k])]
        found.add_row(str(k + 1), f"{frequency:.2f}", *cells)
    return found


def _polar(value: complex) -> tuple[str, str]:
    return (f"{abs(value):.4g}", f"{np.degrees(np.angle(value)):.1f}") if value else ("0", "")


def _minima(shown: ShownResponse) -> Table:
    found = table("minimum dynamic stiffness", "direction", "load per motion", "at Hz", "")
    found.columns[3].justify = "left"
    for minimum in shown.minima:
        own = unit_of_stiffness(minimum.direction)
        value = f"{own.factor * minimum.stiffness:.5g} {own.written}"
        end = "end of the range, there may be less beyond" if shown.is_at_end(minimum) else ""
        found.add_row(minimum.direction, value, f"{minimum.frequency:.2f}", end)
    return found


def as_json(shown: ShownResponse) -> dict[str, Any]:
    """The whole response of the chosen entries."""
    whole = shown.whole
    at = whole.at
    return {
        "machine": at.machine.name,
        "mode": at.mode,
        **pose_keys(at.position, at.angles),
        "reached": at.miss is None,
        "response": whole.response,
        "excitation": whole.excitation,
        "output": shown.output,
        "method": whole.method,
        "damping": whole.damping,
        "loss_factor": whole.loss_factor,
        "natural_frequencies_Hz": finite(whole.natural),
        "minimum_dynamic_stiffness": minima_json(shown.minima),
        "frequency_Hz": finite(whole.frequency),
        "entries": {
            entry: {
                "unit": shown.unit(entry).si,
                "re": finite(shown.values(entry).real),
                "im": finite(shown.values(entry).imag),
            }
            for entry in shown.entries
        },
    }
