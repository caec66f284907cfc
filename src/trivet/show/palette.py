"""Colours of drawings: those of Okabe and Ito, which the colour-blind can tell apart."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from trivet.show.shapes import Role, Shape

# Okabe and Ito, "Color universal design" (2008), and greys.
BLUE, SKY, GREEN, PURPLE = "#0072B2", "#56B4E9", "#009E73", "#CC79A7"
ORANGE, VERMILLION, YELLOW, BLACK = "#E69F00", "#D55E00", "#F0E442", "#000000"
GRID, GREY = "#EBEBEB", "#8C8C8C"
"""Of lines behind curves, and of what stays behind the rest."""

VALUES = "viridis"
"""Of values in order; none of its colours is grey, which is for what has no value."""

COLOURS: dict[Role, str] = {
    "link": BLUE,
    "actuated joint": ORANGE,
    "locked joint": "#7A5200",
    "passive joint": GREEN,
    "guide": GREY,
    "ground": "#D9D9D9",
    "platform": SKY,
    "tool": "#404040",
    "workpiece": PURPLE,
    "motion": YELLOW,
    "machine": "#B4BCC6",
    "measured point": VERMILLION,
    "point on the machine": BLACK,
    "response": BLUE,
    "load": ORANGE,
    "x axis": BLACK,
    "y axis": BLACK,
    "z axis": BLACK,
}

LEGEND: tuple[Role, ...] = (
    "actuated joint", "locked joint", "passive joint", "link", "guide", "platform", "tool", "workpiece", "motion",
    "machine", "measured point", "point on the machine", "response", "load",
)  # fmt: skip
"""What a legend lists, in this order."""

MARKED = VERMILLION
"""Colour of joints which a status names."""

SEE_THROUGH: dict[Role, float] = {"platform": 0.6, "ground": 0.5, "machine": 0.5}
"""Opacity of what would hide the rest."""


class Painted(NamedTuple):
    """A shape with its colour (#RRGGBB) and opacity."""

    shape: Shape
    colour: str
    opacity: float
    is_marked: bool


def paint(found: Iterable[Shape], status: str = "") -> list[Painted]:
    """Colours for shapes; the joints which a status names by their full names ("leg-2.hinge") are marked."""
    named = set(re.findall(r"[a-z][a-z0-9_-]*\.[a-z][a-z0-9_-]*", status))
    painted = []
    for shape in found:
        marked = shape.role.endswith("joint") and shape.name in named
        painted.append(Painted(shape, MARKED if marked else COLOURS[shape.role], SEE_THROUGH.get(shape.role, 1.0), marked))
    return painted
