"""Beams of a section as structured meshes of hexahedra with 27 nodes, whose curved faces follow the circles.

A section is a few blocks, each the image of a unit square; the same blocks stand at every place along the beam.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError
from trivet.model.section import General, Rectangle, Section, Tube
from trivet.solids.grid import MOST_NODES, Grid, grid, reference

AROUND = 12
"""Elements around a circle at fineness 1."""
ACROSS = 2
"""Elements across the shorter side of a rectangle at fineness 1."""
CORE = 0.55
"""Where the corners of a rod's square core lie, against its radius."""
MOST_ACROSS = 12
"""Elements along the longer side of a rectangle, against those along the shorter: beyond, they are longer than thick."""
SHORTER = 4
"""Elements at the ends, over one size of those between."""
SAME = 1e-9
"""Distance of nodes, against the size of a section, below which they are one."""

Place = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


class Block(NamedTuple):
    """A part of a section."""

    place: Place
    """y and z (m) from two coordinates between 0 and 1."""
    counts: tuple[int, int]
    """Elements along either."""


def bricks(name: str, section: Section, length: float, fineness: float) -> Grid:
    """A beam of a section as a mesh.

    Args:
        name: what messages call it.
        section: its width is along y, its height along z.
        length: m.
        fineness: 1, or more for smaller elements.

    Raises:
        InputError: for a section that is given by its numbers, or too many elements.
    """
    blocks, size = _blocks(name, section, fineness)
    if 4 * length / size * sum(b.counts[0] * b.counts[1] for b in blocks) > MOST_NODES:
        raise InputError(f"{name}: {length / size:.0f} elements along it; too many for a mesh of {MOST_NODES:,} nodes")
    flat, cells = _section(blocks, float(section.outline.width))
    corners = _stations(length, size)
    along = len(corners) - 1
    layers = np.interp(np.arange(2 * along + 1) / 2, np.arange(along + 1), corners)
    points = np.stack([np.repeat(layers, len(flat)), *np.tile(flat.T, len(layers))])
    # Two layers of nodes per element; of a cell 9 nodes in each of three layers.
    own = [cells[k] + len(flat) * layer for k, layer in _of_cell()]
    elements = np.concatenate([np.array(own) + 2 * len(flat) * k for k in range(along)], axis=1)
    return grid(name, "hexahedra", points, elements, length, size)


def _stations(length: float, size: float) -> np.ndarray:
    """Where layers of elements meet (m): of a size (m), shorter at the ends, where what a face holds dies away."""
    ending = size * np.arange(SHORTER + 1) / SHORTER
    if length <= 3 * size:
        return np.linspace(0, length, max(2, math.ceil(SHORTER * length / size)) + 1)
    middle = np.linspace(size, length - size, math.ceil(length / size - 2) + 1)
    return np.concatenate([ending[:-1], middle, length - ending[-2::-1]])


def _of_cell() -> list[tuple[int, int]]:
    """Per node of a hexahedron the node of its cell (0 to 8, third coordinate fastest) and the layer."""
    return [(int(4 * 1.5 * v + 2 * w), int(2 * u)) for u, v, w in reference("hexahedra")]


def _section(blocks: list[Block], size: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) nodes of a section, and (9, c) the nodes of its cells, those of neighbouring blocks being one."""
    places, cells, count = [], [], 0
    for block in blocks:
        m, n = (2 * k + 1 for k in block.counts)
        u, v = np.meshgrid(np.linspace(0, 1, m), np.linspace(0, 1, n), indexing="ij")
        places.append(np.stack(block.place(u, v), axis=-1).reshape(-1, 2))
        number = count + np.arange(m * n).reshape(m, n)
        count += m * n
        cells.append(np.array([number[i : m - 2 + i : 2, j : n - 2 + j : 2].ravel() for i in range(3) for j in range(3)]))
    points, whole = np.concatenate(places), np.concatenate(cells, axis=1)
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    kept, number = np.unique(np.argmax(apart < SAME * size, axis=1), return_inverse=True)
    return points[kept], number[whole]


def _blocks(name: str, section: Section, fineness: float) -> tuple[list[Block], float]:
    """The blocks of a section, and the length (m) of an element along the beam."""
    if isinstance(section, General):
        raise InputError(
            f"{name}: its section is given by its numbers and has no shape; give a solid as a file, {name}=part.step, or "
            "name other parts"
        )
    if isinstance(section, Rectangle):
        return _rectangle(float(section.width), float(section.height), fineness)
    outer = float(section.outer_diameter if isinstance(section, Tube) else section.diameter) / 2
    inner = float(section.inner_diameter) / 2 if isinstance(section, Tube) else 0.0
    return (_tube(outer, inner, fineness) if inner else _rod(outer, fineness)), 2 * outer / fineness


def _rectangle(width: float, height: float, fineness: float) -> tuple[list[Block], float]:
    short, least = min(width, height), math.ceil(ACROSS * fineness)
    counts = tuple(least * min(max(1, round(side / short)), MOST_ACROSS) for side in (width, height))
    plain = Block(lambda u, v: (width * (u - 0.5), height * (v - 0.5)), (counts[0], counts[1]))
    return [plain], math.sqrt(width * height) / fineness


def _tube(outer: float, inner: float, fineness: float) -> list[Block]:
    around = math.ceil(AROUND * fineness)
    wall = max(1, round((outer - inner) / (math.pi * (outer + inner) / around)))

    def place(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        radius = inner + (outer - inner) * u
        return radius * np.cos(2 * np.pi * v), radius * np.sin(2 * np.pi * v)

    return [Block(place, (wall, around))]


def _rod(radius: float, fineness: float) -> list[Block]:
    """A square core, and four blocks between its sides and the circle."""
    half, side, ring = CORE * radius / math.sqrt(2), math.ceil(AROUND / 4 * fineness), math.ceil(fineness)

    def sector(turn: int) -> Place:
        cos, sin = round(math.cos(turn * math.pi / 2)), round(math.sin(turn * math.pi / 2))

        def place(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            angle = np.pi / 4 * (2 * v - 1)
            y = (1 - u) * half + u * radius * np.cos(angle)
            z = (1 - u) * half * (2 * v - 1) + u * radius * np.sin(angle)
            return cos * y - sin * z, sin * y + cos * z

        return place

    core = Block(lambda u, v: (half * (2 * u - 1), half * (2 * v - 1)), (side, side))
    return [core, *(Block(sector(turn), (ring, side)) for turn in range(4))]
