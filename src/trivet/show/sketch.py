"""Machines at home, small, without words, and all to one scale, so that a smaller machine looks smaller."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from trivet.errors import NoResultError
from trivet.model import Machine
from trivet.show.palette import Painted, paint
from trivet.show.picture import VIEW, lit
from trivet.show.raster import Facets, render
from trivet.show.scene import scene
from trivet.show.shapes import Array

EDGE, BAR = 8, 3
"""Pixels that stay empty around a machine, and by which the bar is thick."""


class Sketches(NamedTuple):
    """Pictures to one scale."""

    pictures: list[Array | None]
    """(height, width, 4) red, green, blue and opacity in 0..1, the first row on top; None where home is not reached."""
    bar: float
    """Length of the bar at the foot of every picture, m."""


def sketches(machines: list[Machine], mode: str | None, width: int, height: int) -> Sketches:
    """Pictures of machines at home, in pixels; `mode` is a working mode, each machine's own when not given."""
    seen = [_seen(machine, mode) for machine in machines]
    spans = np.array([np.ptp(_corners(own), axis=0)[:2] for own in seen if own]).reshape(-1, 2)
    room = np.array([width - 2 * EDGE, height - 3 * EDGE - BAR])
    scale = float((spans / room).max()) if len(spans) else 1.0
    bar = _round_length(0.4 * width * scale)
    pictures = [_picture(own, scale, width, height) if own else None for own in seen]
    for picture in pictures:
        if picture is not None:
            picture[-EDGE - BAR : -EDGE, EDGE : EDGE + round(bar / scale)] = (0.25, 0.25, 0.25, 1.0)
    return Sketches(pictures, bar)


def _seen(machine: Machine, mode: str | None) -> list[Painted]:
    """What a machine is made of, without the axes of frames; nothing where home is not reached."""
    try:
        shapes = scene(machine, None, mode).shapes
    except NoResultError:
        return []
    return paint(shape for shape in shapes if not shape.role.endswith("axis"))


def _on_page(points: Array) -> Array:
    """Points (n, 3) seen from afar: to the right, upwards, away from the eye."""
    up, around = (math.radians(VIEW[key]) for key in ("elev", "azim"))
    right = (-math.sin(around), math.cos(around), 0.0)
    above = (-math.sin(up) * math.cos(around), -math.sin(up) * math.sin(around), math.cos(up))
    towards = (math.cos(up) * math.cos(around), math.cos(up) * math.sin(around), math.sin(up))
    return points @ np.array([right, above, np.negative(towards)]).T


def _corners(painted: list[Painted]) -> Array:
    return _on_page(np.concatenate([item.shape.rings.reshape(-1, 3) for item in painted]))


def _picture(painted: list[Painted], scale: float, width: int, height: int) -> Array:
    corners = _corners(painted)
    low, high = corners.min(axis=0), corners.max(axis=0)
    # All stand on one floor.
    start = np.array([(low[0] + high[0]) / 2 - width * scale / 2, low[1] - (2 * EDGE + BAR) * scale, 0.0])
    bodies = []
    for item in painted:
        vertices, faces, colours = lit(item)
        bodies.append(Facets(((_on_page(vertices) - start) / scale)[faces], colours, item.opacity))
    return render(bodies, width, height)


def _round_length(most: float) -> float:
    """The greatest of 1, 2, 5, 10, … that is not more, m."""
    ten = 10.0 ** math.floor(math.log10(most))
    return max(ten * step for step in (1, 2, 5) if ten * step <= most)
