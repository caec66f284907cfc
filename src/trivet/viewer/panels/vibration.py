"""How the machine vibrates at the pose: frequency responses, least dynamic stiffness, natural modes that can be seen."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import viser
from viser import uplot

from trivet.show.palette import BLUE, ORANGE
from trivet.statics.objective import AXES
from trivet.study.frf import FrequencyResponse
from trivet.viewer import words
from trivet.viewer.panels.inputs import on_choice
from trivet.viewer.state import State

ENTRIES = tuple(f"{a}{b}" for a, b in product(AXES[:3], repeat=2))
LINES = (BLUE, ORANGE)
STILL = "at rest"
HEIGHT = 220
"""Of the plot, pixels."""
PADDING = (12, 18, 0, 0)
"""Above, right of, below and left of it, pixels: numbers at its ends must not be cut off."""
TICKS = uplot.Axis_Ticks(stroke="gray", width=0.5, size=4)
"""On a scale by decades there are nine of them each."""


class VibrationPanel:
    """Responses and modes."""

    def __init__(self, server: viser.ViserServer, state: State, change: Callable[..., None]) -> None:
        gui, names = server.gui, [machine.name for machine in state.machines]
        entry = gui.add_dropdown(
            "Response", ENTRIES, initial_value=state.shown.entry, hint="Motion, then force, at the platform centre"
        )
        on_choice(entry, lambda name: change(entry=name))
        lines = (uplot.Series(label=name, stroke=colour, width=2) for name, colour in zip(names, LINES, strict=False))
        series = (uplot.Series(label="Hz"), *lines)
        blank = np.array([1.0, 2.0])
        self._plot = gui.add_uplot(
            (blank, *(blank for _ in names)), series, height=HEIGHT, title="",
            scales={"x": uplot.Scale(time=False), "y": uplot.Scale(distr=3)},
            axes=(
                uplot.Axis(label="Hz", stroke="gray", ticks=TICKS),
                uplot.Axis(label="µm/N", stroke="gray", size=64, ticks=TICKS),
            ),
            padding=PADDING,
        )  # fmt: skip
        self._told = [gui.add_html("") for _ in names]
        self._modes: Any = gui.add_dropdown(
            "Natural mode", (STILL,), initial_value=STILL, hint="The machine is seen to swing in it"
        )
        on_choice(self._modes, lambda text: change(ringing=None if text == STILL else int(text.split(":")[0]) - 1))

    def plot(self, found: list[FrequencyResponse | None], entry: str) -> None:
        """Show |H| of the machines over a common row of frequencies."""
        rows = [own.frequency for own in found if own is not None]
        if not rows:
            return
        frequency = np.unique(np.concatenate(rows))
        lines = [self._line(own, entry, frequency) for own in found]
        self._plot.title = f"|H_{entry}|"
        self._plot.data = (frequency, *lines)

    @staticmethod
    def _line(own: FrequencyResponse | None, entry: str, frequency: np.ndarray) -> np.ndarray:
        if own is None:
            return np.full_like(frequency, np.nan)
        size = np.maximum(1e6 * np.abs(own.entry(entry)), 1e-12)
        line: np.ndarray = np.exp(np.interp(frequency, own.frequency, np.log(size)))
        return line

    def tell(self, number: int, pieces: list[str]) -> None:
        """Show what is to be said of a machine, pieces of HTML."""
        self._told[number].content = words.block(*pieces)

    def offer(self, modes: list[str], chosen: int | None) -> None:
        """Let people choose among natural modes, in words each."""
        options = (STILL, *(f"{number}: {text}" for number, text in enumerate(modes, start=1)))
        if self._modes.options != options:
            self._modes.options = options
        self._modes.value = options[0 if chosen is None else min(chosen + 1, len(modes))]
