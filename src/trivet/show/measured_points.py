"""Measured points on a machine: where they were measured, where they lie on it, along what they respond and are loaded."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

import numpy as np

from trivet.files import replacing
from trivet.measure.functions import Channel, Functions
from trivet.measure.machine.setup import Placed, Site
from trivet.show import shapes
from trivet.show.drawing import title_lines
from trivet.show.maps import check_suffix
from trivet.show.palette import paint
from trivet.show.scene import Label, Scene, scene
from trivet.show.shapes import Array, Role, Shape
from trivet.study.correlate import MappedPoints, distances

NAMED = 20
"""Points whose names are drawn, at most: those that were measured farthest from where they lie."""
LONGEST = 10
"""Letters of a name that are drawn."""
ARROW = 0.13
"""Length of an arrow, as a share of the machine's size."""
NEAR = 1e-9
"""m, within which a point was measured where it lies."""
DOT = 0.012
"""Radius of a point, likewise."""


def draw_points(mapped: MappedPoints, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw measured points on their machine (PNG or self-contained HTML); what leads from a ball to a ball is the distance."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        seen = points_scene(*mapped)
        if suffix == ".png":
            from trivet.show.picture import write_picture as write_drawing
        else:
            from trivet.show.page import write_page as write_drawing
        write_drawing(paint(seen.shapes), seen, _heading(mapped.placed, seen), temporary)


def points_scene(placed: Placed, functions: Functions) -> Scene:
    """The machine in grey, and all that was measured in colour."""
    seen = scene(placed.machine, placed.frame, placed.pose.mode)
    machine = [
        shape if shape.name.startswith("{") else shape._replace(role="machine")
        for shape in seen.shapes
        if shape.role != "workpiece"
    ]
    corners = np.concatenate([shape.rings.reshape(-1, 3) for shape in machine])
    size = float(np.ptp(corners, axis=0).max())
    found: list[Shape] = []
    for site in placed.sites.values():
        found += _site(site, size)
        channels: tuple[tuple[Role, tuple[Channel, ...]], ...] = (
            ("response", functions.responses),
            ("load", functions.references),
        )
        for role, own in channels:
            for channel in dict.fromkeys(c for c in own if c.point == site.point):
                direction = placed.turn @ np.array(channel.direction, dtype=float)
                found += _arrow(channel, role, site.at, direction, size)
    order = sorted(placed.sites.values(), key=lambda site: -site.distance if not math.isnan(site.distance) else 1.0)
    labels = tuple(Label(_words(site), site.at) for site in order[:NAMED])
    return seen._replace(shapes=tuple(machine + found), joints=labels, first=frozenset(label.text for label in labels))


def _words(site: Site) -> str:
    """Its name and its distance."""
    return f"{site.point[:LONGEST]}: {'?' if math.isnan(site.distance) else f'{site.distance * 1e3:.3g}'} mm"


def _site(site: Site, size: float) -> Iterator[Shape]:
    name = f"{site.point} on {site.on}"
    yield shapes.ball(name, "point on the machine", site.at, DOT * size)
    if site.measured is None or site.distance <= NEAR:
        return
    yield shapes.ball(name, "measured point", site.measured, DOT * size)
    yield shapes.bar(f"{name}, {_words(site)}", "measured point", site.measured, site.at, (0.4 * DOT * size,) * 2)


def _arrow(channel: Channel, role: Role, start: Array, direction: Array, size: float) -> Iterator[Shape]:
    """From a point along a response, or onto it along a load; about the direction, for a turn, with a second head."""
    name, length = str(channel), ARROW * size
    if role == "load":  # a hammer comes from outside
        start = start - direction * (length + DOT * size)
    tip, head, thick = start + length * direction, 0.28 * length * direction, 0.3 * DOT * size
    yield shapes.bar(name, role, start, tip - head, (2 * thick, 2 * thick))
    for end in (tip, tip - head) if channel.is_rotation else (tip,):
        yield shapes.cone(name, role, end - head, end, 7 * thick)


def _heading(placed: Placed, seen: Scene) -> list[str]:
    far, count = distances(placed), len(placed.sites)
    told = [f"{count} measured point{'s' if count > 1 else ''}"]
    if far.greatest > NEAR:
        told.append(f"the farthest was measured {far.greatest * 1e3:.3g} mm from where it lies on the machine: {far.point}")
    if far.unknown:
        told.append(f"{far.unknown} without a position")
    return [*title_lines(placed.machine, placed.frame, seen.mode), "; ".join(told)]
