"""How stiff the machine is at the pose, what a deflection is lost in, and how near a singularity is."""

from __future__ import annotations

from collections.abc import Callable

import viser

from trivet.statics.objective import AXES
from trivet.viewer import words
from trivet.viewer.panels.inputs import on_choice, on_switch
from trivet.viewer.state import State


class StiffnessPanel:
    """Static stiffness and singularity."""

    def __init__(self, server: viser.ViserServer, state: State, change: Callable[..., None]) -> None:
        gui = server.gui
        ellipsoid = gui.add_checkbox("Compliance ellipsoid", state.shown.ellipsoid, hint="How far unit forces move the centre")
        on_switch(ellipsoid, lambda on: change(ellipsoid=on))
        twist = gui.add_checkbox("Least controlled motion", state.shown.twist, hint="One head: translation; two: turn")
        on_switch(twist, lambda on: change(twist=on))
        direction = gui.add_dropdown("Budget of a load along", AXES, initial_value=state.shown.direction)
        on_choice(direction, lambda axis: change(direction=axis))
        self._told = [gui.add_html("") for _ in state.machines]

    def tell(self, number: int, pieces: list[str]) -> None:
        """Show what is to be said of a machine, pieces of HTML."""
        self._told[number].content = words.block(*pieces)
