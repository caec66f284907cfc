"""A quantity over the workpiece hemisphere, and its points to go to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from trivet.viewer import words
from trivet.viewer.mapping import MOST_STEPS, QUANTITIES, ROLLS
from trivet.viewer.panels.inputs import on_choice, on_number, on_press
from trivet.viewer.state import State

STEPS = 10
"""The paper's 317 points."""


class MapPanel:
    """What is mapped, and the legend."""

    def __init__(self, server: viser.ViserServer, state: State, seek: Callable[..., None], go: Callable[[int], None]) -> None:
        """`seek` asks for a map: number of the machine, quantity, steps, roll; `go` goes to a check point (from 0)."""
        gui, names = server.gui, tuple(machine.name for machine in state.machines)
        self._machine = gui.add_dropdown("Machine", names) if len(set(names)) > 1 else None
        self._quantity = gui.add_dropdown("Quantity", QUANTITIES)
        self._roll = gui.add_dropdown("Roll", ROLLS, hint="Stiffnesses are mapped with a best roll")
        self._steps = gui.add_slider("Steps from pole to rim", 2, MOST_STEPS, 1, STEPS)
        self._names = names
        on_number(self._steps, lambda value: None)
        for choice in (self._machine, self._quantity, self._roll):
            if choice is not None:
                on_choice(choice, lambda text: None)
        on_press(gui.add_button("Map it", icon=viser.Icon.MAP), lambda: self._asked(seek))
        self._bar: Any = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._legend = gui.add_html("")
        self._point: Any = gui.add_slider("Go to point", 0, 1, 1, 0, disabled=True, hint="As a click on the map does")
        on_number(self._point, lambda value: go(round(value) - 1) if value >= 1 else None)

    def _asked(self, seek: Callable[..., None]) -> None:
        name = None if self._machine is None else self._machine.value
        number = self._names.index(name) if name in self._names else 0
        seek(number, self._quantity.value, round(self._steps.value), self._roll.value)

    def advance(self, share: float | None) -> None:
        """How much of a map is done; None when it is."""
        self._bar.visible = share is not None
        if share is not None:
            self._bar.value = 100.0 * share

    def tell(self, legend: str, points: int) -> None:
        """Show the legend of a map with so many points."""
        self._legend.content = words.block(legend)
        self._point.max, self._point.disabled = max(points, 1), points == 0

    def stand(self, number: int) -> None:
        """Show which point (from 0) it is gone to."""
        self._point.value = number + 1
