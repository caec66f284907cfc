"""Rods as meshes: a section's outline, its bore where it has one, drawn out along the rod."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.model.section import Section

AROUND = 32
"""Corners of a circle."""


class Mesh(NamedTuple):
    """A closed surface of triangles, anticlockwise seen from outside."""

    vertices: NDArray[Any]
    """(n, 3), m: along x, y and z of the beam's local axes."""
    faces: NDArray[Any]
    """(m, 3): numbers of vertices."""


def rod_mesh(section: Section, low: float, high: float) -> Mesh:
    """A rod of a section along x, from low to high (m)."""
    outline = section.outline
    size = np.array([float(outline.width), float(outline.height)]) / 2
    if not outline.is_round:
        return _drawn_out([np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * size], low, high)
    angles = 2 * math.pi * np.arange(AROUND) / AROUND
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    bore = float(outline.bore) / 2
    return _drawn_out([circle * size, *([circle * bore] if bore > 0 else [])], low, high)


def _drawn_out(rings: list[NDArray[Any]], low: float, high: float) -> Mesh:
    """A prism with an outer ring of corners and maybe an inner one of as many."""
    count = len(rings[0])
    here, beside = np.arange(count), np.roll(np.arange(count), -1)
    # Rings one after the other, each at its near and at its far end.
    vertices = [np.column_stack([np.full(count, x), ring]) for ring in rings for x in (low, high)]
    near, far = 0, count
    faces = _walls(near + here, near + beside, far + here, far + beside)
    if len(rings) == 2:
        inner, inner_far = 2 * count, 3 * count
        faces += _walls(inner + beside, inner + here, inner_far + beside, inner_far + here)
        faces += _walls(inner + here, inner + beside, near + here, near + beside)
        faces += _walls(far + here, far + beside, inner_far + here, inner_far + beside)
    else:
        fan = np.arange(1, count - 1)
        faces.append(np.stack([near + 0 * fan, near + fan + 1, near + fan], axis=1))
        faces.append(np.stack([far + 0 * fan, far + fan, far + fan + 1], axis=1))
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def _walls(a: NDArray[Any], b: NDArray[Any], c: NDArray[Any], d: NDArray[Any]) -> list[NDArray[Any]]:
    """Two triangles each between an edge a-b and the edge c-d beyond it."""
    return [np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)]
