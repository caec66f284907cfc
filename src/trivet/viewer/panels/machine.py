"""What the machine is: a slider for every dimension, and what follows from it at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import viser

from trivet.errors import TrivetError
from trivet.model import Machine, dimensions
from trivet.model.check import check
from trivet.model.kinds import kinds
from trivet.model.quantity import Quantity
from trivet.viewer import words
from trivet.viewer.panels.inputs import on_number, on_press

RANGE = 0.5
"""A slider goes as far below and above its first value, as a share of that."""
STEPS = 200
AROUND_ZERO = {"m": 0.2, "rad": math.pi / 4}
"""Where the first value is zero, m and rad; other numbers that are zero have no slider."""
ENDS = ("least", "greatest")
"""What the numbers of a travel are."""
LEFT_OUT = ("home.",)
"""The home pose has the sliders of the pose."""


class _Dimension(NamedTuple):
    path: str
    leaf: int
    kind: Quantity
    factor: float
    """From SI to the unit that is written."""
    slider: Any
    start: float
    """SI."""


class MachinePanel:
    """The dimensions of one machine."""

    def __init__(self, server: viser.ViserServer, number: int, machine: Machine, change: Callable[..., None]) -> None:
        """`change` takes what of the state is to change."""
        self._number, self._change = number, change
        self._first = machine
        self._rows: list[_Dimension] = []
        self._values: list[float] = []
        known, own = dimensions(machine), kinds(machine)
        groups: dict[str, list[tuple[str, int]]] = {}
        for leaf, path in enumerate(known):
            if not path.startswith(LEFT_OUT):
                groups.setdefault(_group(path), []).append((path, leaf))
        reset = server.gui.add_button(f"Reset {machine.name}", hint="All dimensions as in the machine file")
        on_press(reset, self.reset)
        self._told = server.gui.add_html("")
        for group, members in groups.items():
            with server.gui.add_folder(group, expand_by_default=False):
                for path, leaf in members:
                    self._add(server, path, leaf, own[path], float(known[path]))

    def _add(self, server: viser.ViserServer, path: str, leaf: int, kind: Quantity, value: float) -> None:
        reach = RANGE * abs(value) or AROUND_ZERO.get(kind.si, 0.0)
        factor = _factor(kind)
        if reach == 0.0:
            return
        low, high = ((value - reach) * factor, (value + reach) * factor)
        if (kind.positive or kind.at_least_zero) and low < 0:
            low = 0.0
        label = _label(path, kind.symbol)
        step = 10 ** math.floor(math.log10((high - low) / STEPS))
        slider = server.gui.add_slider(label, low, high, step, value * factor, hint=path)
        on_number(slider, partial(self._turned, len(self._rows)))
        self._values.append(float(slider.value))
        self._rows.append(_Dimension(path, leaf, kind, factor, slider, value))

    def _turned(self, number: int, value: float) -> None:
        wanted = [*self._values[:number], value, *self._values[number + 1 :]]
        leaves, tree = jax.tree.flatten(self._first)
        for row, own in zip(self._rows, wanted, strict=True):
            if own != row.start * row.factor:
                leaves[row.leaf] = own / row.factor
        changed: Machine = jax.tree.unflatten(tree, leaves)
        try:
            check(changed)
        except TrivetError as error:
            self._told.content = words.block(words.esc(str(error)))
            self._rows[number].slider.value = self._values[number]
            return
        self._values = wanted
        self._told.content = ""
        self._change(machine=(self._number, changed), by="dimension")

    def reset(self) -> None:
        """All dimensions as they were."""
        self._told.content = ""
        self._values = [row.start * row.factor for row in self._rows]
        for row, own in zip(self._rows, self._values, strict=True):
            row.slider.value = own
        self._change(machine=(self._number, self._first), by="dimension")


def _factor(kind: Quantity) -> float:
    return 1 / kind.parse(f"1 {kind.written}") if kind.written else 1.0


def _label(path: str, unit: str) -> str:
    """What a slider is called: "hinge travel, greatest, °" for the second number of a travel."""
    *above, owner, key = path.split(".")
    if key.isdigit():
        owner, key = above[-1], f"{owner}, {(ENDS if owner == 'travel' else 'xyz')[int(key) - 1]}"
    return f"{owner} {key}, {unit}".rstrip(", ").replace("_", " ")


def _group(path: str) -> str:
    """The folder of a dimension: "platform", "chain leg", "section tube"."""
    first, *rest = path.split(".")
    singular = {"chains": "chain", "sections": "section", "materials": "material", "fixtures": "fixture"}
    return f"{singular[first]} {rest[0]}" if first in singular else first
