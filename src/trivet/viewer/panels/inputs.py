"""What people put into controls, checked: viser hands on whatever a browser sent."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import viser

Slider = Any
"""A `viser.GuiSliderHandle[float]` or a number box of the same kind."""


def on_number(handle: Slider, then: Callable[[float], None]) -> None:
    """Call `then` with the value of a slider or number box when somebody changed it; what is no number within its bounds is not
    taken."""
    kept = [float(handle.value)]

    async def changed(event: viser.GuiEvent[Any]) -> None:
        value = float(handle.value)
        if event.client is None:  # set by the page itself
            kept[0] = value
        elif math.isfinite(value) and handle.min <= value <= handle.max:
            kept[0] = value
            then(value)
        else:
            handle.value = kept[0]

    handle.on_update(changed)


def on_choice(handle: Any, then: Callable[[str], None]) -> None:
    """Call `then` with what somebody chose from a dropdown."""
    kept = [handle.value]

    async def changed(event: viser.GuiEvent[Any]) -> None:
        if handle.value not in handle.options:
            handle.value = kept[0] if kept[0] in handle.options else handle.options[0]
            return
        kept[0] = handle.value
        if event.client is not None:
            then(handle.value)

    handle.on_update(changed)


def on_switch(handle: Any, then: Callable[[bool], None]) -> None:
    """Call `then` when somebody turned a checkbox on or off."""

    async def changed(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:
            then(bool(handle.value))

    handle.on_update(changed)


def on_press(handle: Any, then: Callable[[], None]) -> None:
    """Call `then` when somebody pressed a button."""

    async def pressed(event: viser.GuiEvent[Any]) -> None:
        then()

    handle.on_click(pressed)
