"""Where the platform is: sliders and number boxes, working modes, assembly modes, and how the joints stand."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import viser

from trivet.kinematics.inverse import branches, has_closed_form
from trivet.model import Machine
from trivet.viewer import words
from trivet.viewer.panels.inputs import on_choice, on_number, on_press, on_switch
from trivet.viewer.standing import Standing
from trivet.viewer.state import PoseNumbers, State, home_of

ANGLES = ("azimuth", "tilt", "roll")
STEP_LENGTH, STEP_ANGLE = 0.1, 0.1
"""mm and degrees."""
REACH = 0.75
"""How far the sliders go from home, as a share of the machine's size."""
MOST_TILT = 180.0
"""Degrees."""


class PosePanel:
    """The pose and the modes."""

    def __init__(
        self, server: viser.ViserServer, state: State, size: float, change: Callable[..., None], seek: Callable[[], None]
    ):
        """`change` takes what of the state is to change; `seek` asks for the assembly modes."""
        self._gui, self._change = server.gui, change
        self._begin = home_of(state.machines[0])
        if len(state.machines) > 1:
            first, *others = (words.esc(machine.name) for machine in state.machines)
            self._gui.add_html(words.block(f"the pose of {first}; {', '.join(others)} moves as far from its own home"))
        self._sliders = [self._length(k, axis, size) for k, axis in enumerate("xyz")] + [self._angle(name) for name in ANGLES]
        for number, slider in enumerate(self._sliders):
            on_number(slider, partial(self._turned, number))
        buttons = self._gui.add_button("Home", icon=viser.Icon.HOME, hint="The home pose of the machine (key H)")
        on_press(buttons, self.go_home)
        handle = self._gui.add_checkbox(
            "Drag handle", state.shown.handle, hint="Arrows and arcs by which the platform is moved"
        )
        on_switch(handle, lambda on: change(handle=on))
        names = self._gui.add_checkbox("Names", state.shown.names, hint="Of chains, and of {O}")
        on_switch(names, lambda on: change(names=on))
        self._modes = [self._chains(server, state, number) for number in range(len(state.machines))]
        seeker = self._gui.add_button("Find assembly modes", hint="All poses of the platform with the drives where they are")
        on_press(seeker, seek)
        self._found = self._gui.add_dropdown("Assembly mode", ("none sought",), disabled=True)
        self._poses: dict[str, tuple[PoseNumbers, str]] = {}
        on_choice(self._found, self._assemble)
        self._joints = [self._gui.add_html("") for _ in state.machines]

    def _length(self, number: int, axis: str, size: float) -> Any:
        middle, reach = 1e3 * self._begin[number], 1e3 * REACH * size
        low, high = math.floor(middle - reach), math.ceil(middle + reach)
        return self._gui.add_slider(f"{axis}, mm", low, high, STEP_LENGTH, min(max(round(middle, 1), low), high))

    def _angle(self, name: str) -> Any:
        low, high = (0.0, MOST_TILT) if name == "tilt" else (-180.0, 180.0)
        hint = {
            "azimuth": "Direction in which the platform normal leans, alpha",
            "tilt": "Angle of the platform normal from the vertical, beta",
            "roll": "Turn about the platform normal, gamma",
        }[name]
        begin = math.degrees(getattr(self._begin, name))
        return self._gui.add_slider(f"{name}, °", low, high, STEP_ANGLE, min(max(round(begin, 1), low), high), hint=hint)

    def _turned(self, number: int, value: float) -> None:
        self._change(coordinate=(number, value / 1e3 if number < 3 else math.radians(value)), by="sliders")

    def go_home(self) -> None:
        """The home pose."""
        self._change(pose=self._begin, by="button")

    def _chains(self, server: viser.ViserServer, state: State, number: int) -> list[Any]:
        """A choice of branches for every chain of a machine that has one."""
        machine = state.machines[number]
        if not all(has_closed_form(leg) for leg in machine.legs) or not any(branches(leg) for leg in machine.legs):
            return []
        found = []
        with server.gui.add_folder(f"Working mode of {machine.name}", expand_by_default=False):
            for leg, signs in zip(machine.legs, _groups(machine, state.modes[number]), strict=True):
                if signs:
                    options = tuple("".join(own) for own in product("+-", repeat=len(signs)))
                    chosen = server.gui.add_dropdown(
                        leg.name, options, initial_value=signs, hint="Side of the carriage, then elbow"
                    )
                    on_choice(chosen, partial(self._switch, number))
                    found.append(chosen)
        return found

    def _switch(self, number: int, _: str) -> None:
        self._change(mode=(number, " ".join(choice.value for choice in self._modes[number])))

    def offer(self, poses: list[tuple[str, PoseNumbers, str]]) -> None:
        """Let people choose among assembly modes: their words, poses and working modes."""
        self._poses = {text: (pose, mode) for text, pose, mode in poses}
        self._found.options = ("choose", *self._poses)
        self._found.disabled = False

    def _assemble(self, text: str) -> None:
        if text in self._poses:
            pose, mode = self._poses[text]
            self._change(pose=pose, mode=(0, mode), by="button")

    def follow(self, state: State, by: str) -> None:
        """Set the controls to a state that came from elsewhere."""
        if by != "sliders":
            for number, (slider, value) in enumerate(zip(self._sliders, state.pose, strict=True)):
                own = 1e3 * value if number < 3 else math.degrees(value)
                slider.value = min(max(round(own, 3), slider.min), slider.max)
        for machine, mode, choices in zip(state.machines, state.modes, self._modes, strict=True):
            signs = [own for own in _groups(machine, mode) if own] if choices else []
            for choice, chosen in zip(choices, signs, strict=True):
                choice.value = chosen

    def tell(self, number: int, standing: Standing) -> None:
        """Show how the joints of a machine stand."""
        report = standing.report
        heading = f"<b>{words.esc(report.machine.name)}</b>" if report is not None and len(self._joints) > 1 else ""
        self._joints[number].content = "" if report is None else words.block(heading, words.joints(report))


def _groups(machine: Machine, mode: str) -> list[str]:
    """Signs of every chain in a written mode; empty for a chain without a choice."""
    groups = iter(mode.split())
    return [next(groups, "") if branches(leg) else "" for leg in machine.legs]
