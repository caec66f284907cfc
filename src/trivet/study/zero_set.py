"""Where a function over a surface is zero, as curves.

The check points are joined to triangles.  Along an edge the surface is the circular arc which has the positions and the normals
at its ends (exact on spheres, cylinders and planes).  Where the function has different signs at the ends its zero is found by
bisection; the zeros on two sides of a triangle belong to one curve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.space.surface import Surface

Array = NDArray[Any]

HALVINGS = 40
"""Of an edge: its zero is known to 1e-12 of its length."""
JUMP = 1e-3
"""Function at a change of sign, relative to the ends of the edge, above which it jumps there instead of passing zero."""


class ZeroSet(NamedTuple):
    """Curves on a surface, and how often the sign changed without a zero."""

    curves: list[tuple[Surface, bool]]
    """Points of each curve in order, and whether it is closed; the first point is then repeated at the end."""
    jumps: int
    """Edges along which the function jumps from one sign to the other."""


def zero_set(surface: Surface, values: Array, function: Callable[[Surface], Array]) -> ZeroSet:
    """The zero set of a function over a surface.

    Args:
        surface: n check points; seen along their mean normal no two coincide.
        values: (n,) the function there; edges with an end where it is NaN are left out.
        function: its values at any points of the surface.

    Raises:
        InputError: when check points coincide, or have no mean normal.
    """
    triangles = _triangles(surface)
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    edges, side_edges = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    side_edges = side_edges.reshape(-1, 3)
    ends = values[edges]
    crossed = np.flatnonzero(np.isfinite(ends).all(axis=1) & ((ends[:, 0] > 0) != (ends[:, 1] > 0)))
    points, is_zero = _bisected(surface, edges[crossed], ends[crossed], function)
    row = np.full(len(edges), -1)
    row[crossed[is_zero]] = np.flatnonzero(is_zero)
    links = [found for found in (line[line >= 0] for line in row[side_edges]) if len(found) == 2]
    curves = [(_some(points, np.array(line)), line[0] == line[-1]) for line in _chains(links)]
    return ZeroSet(curves, int(np.sum(~is_zero)))


def _triangles(surface: Surface) -> Array:
    """Triangles (m, 3) between the check points, as they are seen along their mean normal."""
    from scipy.spatial import Delaunay, QhullError

    mean = _normals(surface).mean(axis=0)
    if len(surface) < 3 or np.linalg.norm(mean) < 1e-6:
        raise InputError(
            f"surface {surface.name}: its {len(surface)} points face no one direction; curves need a side to look from"
        )
    across = np.linalg.svd(mean[None])[2][1:]
    try:
        found = Delaunay(surface.position @ across.T)
    except QhullError:
        raise InputError(f"surface {surface.name}: its points lie on a line; curves need points side by side") from None
    if len(found.coplanar):
        raise InputError(f"surface {surface.name}: point {found.coplanar[0, 0]} coincides with another; give each point once")
    return np.asarray(found.simplices)


def _normals(surface: Surface) -> Array:
    flat = np.sin(surface.tilt)
    return np.stack([np.cos(surface.azimuth) * flat, np.sin(surface.azimuth) * flat, np.cos(surface.tilt)], axis=1)


def _between(surface: Surface, edges: Array, share: Array) -> Surface:
    """Points of the surface on edges (k, 2), at shares (k,) of the way from the first end to the second."""
    position, normal = surface.position[edges], _normals(surface)[edges]
    step, turn = position[:, 1] - position[:, 0], normal[:, 1] - normal[:, 0]
    square = np.sum(turn * turn, axis=1)
    radius = np.where(square > 0, np.sum(step * turn, axis=1) / np.where(square > 0, square, 1.0), 0.0)
    centre = position - radius[:, None, None] * normal

    def mixed(ends: Array) -> Array:
        return ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])

    facing = mixed(normal)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    tilt = np.arctan2(np.hypot(facing[:, 0], facing[:, 1]), facing[:, 2])
    azimuth = np.arctan2(facing[:, 1], facing[:, 0])
    return Surface(surface.name, mixed(centre) + radius[:, None] * facing, azimuth, tilt)


def _bisected(surface: Surface, edges: Array, ends: Array, function: Callable[[Surface], Array]) -> tuple[Surface, Array]:
    """Where the function changes its sign on edges (k, 2), and whether it is zero there."""
    low, high = np.zeros(len(edges)), np.ones(len(edges))
    value = ends[:, 0]
    for _ in range(HALVINGS if len(edges) else 0):
        middle = (low + high) / 2
        value = function(_between(surface, edges, middle))
        is_first = (value > 0) == (ends[:, 0] > 0)
        low, high = np.where(is_first, middle, low), np.where(is_first, high, middle)
    # NaN, where the function is not known on the way, is no zero.
    return _between(surface, edges, (low + high) / 2), np.abs(value) <= JUMP * np.abs(ends).max(axis=1, initial=0.0)


def _some(points: Surface, rows: Array) -> Surface:
    return Surface(points.name, points.position[rows], points.azimuth[rows], points.tilt[rows])


def _chains(links: list[Array]) -> Iterator[list[int]]:
    """Pairs of neighbours, each point with one or two of them, as lines; a closed line ends with its first point."""
    neighbours: dict[int, list[int]] = {}
    for a, b in links:
        neighbours.setdefault(int(a), []).append(int(b))
        neighbours.setdefault(int(b), []).append(int(a))
    # Open lines from their ends first; what is left then is closed.
    for start in sorted(neighbours, key=lambda point: len(neighbours[point])):
        line = [start]
        while line[-1] in neighbours and neighbours[line[-1]]:
            following = neighbours[line[-1]].pop()
            neighbours[following].remove(line[-1])
            line.append(following)
        if len(line) > 1:
            yield line
