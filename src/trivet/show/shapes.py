"""Primitive shapes of a scene: every one a skin stretched over a row of rings.

Bars, blocks, balls, plates, domes, cones and curves differ in their rings only, so that a drawing needs to know one kind.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

Array: TypeAlias = Any
Role: TypeAlias = Literal[
    "link",
    "actuated joint",
    "locked joint",
    "passive joint",
    "guide",
    "ground",
    "platform",
    "tool",
    "workpiece",
    "motion",
    "machine",
    "measured point",
    "point on the machine",
    "response",
    "load",
    "x axis",
    "y axis",
    "z axis",
]

_AROUND = 28
"""Corners of what is round."""


class Shape(NamedTuple):
    """A shape with its place in {O}."""

    name: str
    """Of a chain's shapes "leg-1.link": the chain and the element."""
    role: Role
    rings: Array
    """Corners (rings, corners, 3), m; the first and the last ring are closed by a lid."""
    start: Array
    """Where it begins (3,), m: of a bar the middle of its first end, of a joint its centre."""
    end: Array
    """Where it ends (3,), m."""
    carriers: tuple[int, int] = (0, 0)
    """With which of the frames of `kinematics.standing.Bodies` its first ring moves, and its last one; the ground's is 0."""

    def on(self, first: int, last: int | None = None) -> Shape:
        """The shape as what moves with a frame, or with two where it is drawn out between them."""
        return self._replace(carriers=(first, first if last is None else last))

    def mesh(self) -> tuple[Array, Array]:
        """Vertices (n, 3) in m and triangles (m, 3) of vertex numbers."""
        count, corners, _ = self.rings.shape
        lids = np.stack([self.rings[0].mean(axis=0), self.rings[-1].mean(axis=0)])
        vertices = np.concatenate([self.rings.reshape(-1, 3), lids])
        here = np.arange(corners)
        beside = (here + 1) % corners
        triangles = []
        for ring in range(count - 1):
            a, b = ring * corners + here, ring * corners + beside
            triangles += [np.stack([a, b, b + corners], axis=1), np.stack([a, b + corners, a + corners], axis=1)]
        first, last = count * corners, count * corners + 1
        triangles.append(np.stack([np.full(corners, first), beside, here], axis=1))
        top = (count - 1) * corners
        triangles.append(np.stack([np.full(corners, last), top + here, top + beside], axis=1))
        return vertices, np.concatenate(triangles)


def _profile(width: float, height: float, is_round: bool) -> Array:
    """Corners (n, 2) of a section around its middle."""
    if not is_round:
        return np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (width / 2, height / 2)
    angles = np.arange(_AROUND) * 2 * math.pi / _AROUND
    return np.stack([np.cos(angles) * width / 2, np.sin(angles) * height / 2], axis=1)


def across(direction: Array) -> Array:
    """Some unit vector at right angles to a direction, level where possible."""
    flat = np.cross((0.0, 0.0, 1.0), direction)
    return flat / np.linalg.norm(flat) if np.linalg.norm(flat) > 1e-9 * np.linalg.norm(direction) else np.array((1.0, 0.0, 0.0))


def bar(
    name: str, role: Role, start: Array, end: Array, size: tuple[float, float], is_round: bool = True, side: Array | None = None
) -> Shape:
    """A straight bar; size (m) along `side` (a unit vector across the bar) and at right angles to it."""
    along = end - start
    length = float(np.linalg.norm(along))
    y = across(along) if side is None else side
    z = np.cross(along, y) / length if length > 0 else across(y)
    skin = _profile(*size, is_round) @ np.stack([y, z])
    return Shape(name, role, np.stack([start + skin, end + skin]), start, end)


def block(name: str, role: Role, centre: Array, axes: Array, size: tuple[float, float, float]) -> Shape:
    """A box; axes (3, 3) hold its directions in their columns, size its edges along them (m)."""
    half = axes[:, 0] * size[0] / 2
    box = bar(name, role, centre - half, centre + half, (size[1], size[2]), is_round=False, side=axes[:, 1])
    return box._replace(start=centre, end=centre)


def pin(name: str, role: Role, centre: Array, axis: Array, length: float, diameter: float) -> Shape:
    """A round pin about a centre."""
    half = axis * length / 2
    return bar(name, role, centre - half, centre + half, (diameter, diameter))._replace(start=centre, end=centre)


def ball(name: str, role: Role, centre: Array, radius: float) -> Shape:
    """A ball."""
    return _turned(name, role, centre, radius, np.linspace(-math.pi / 2, math.pi / 2, 11))


def dome(name: str, role: Role, centre: Array, radius: float) -> Shape:
    """The upper half of a ball."""
    return _turned(name, role, centre, radius, np.linspace(0, math.pi / 2, 7))


def _turned(name: str, role: Role, centre: Array, radius: float, latitudes: Array) -> Shape:
    circle = _profile(2.0, 2.0, True)
    rings = [
        centre + radius * np.column_stack([circle * math.cos(latitude), np.full(len(circle), math.sin(latitude))])
        for latitude in latitudes
    ]
    return Shape(name, role, np.stack(rings), centre, centre)


def cone(name: str, role: Role, start: Array, tip: Array, diameter: float) -> Shape:
    """A cone with its base around `start`."""
    full = bar(name, role, start, tip, (diameter, diameter))
    rings = np.stack([full.rings[0], np.broadcast_to(tip, full.rings[0].shape)])
    return Shape(name, role, rings, start, tip)


def plate(name: str, role: Role, rim: Array, normal: Array, thickness: float) -> Shape:
    """A flat convex plate; rim (n, 3) runs around its middle plane, anticlockwise about the normal."""
    middle, half = rim.mean(axis=0), normal * thickness / 2
    return Shape(name, role, np.stack([rim - half, rim + half]), middle, middle)


def curve(name: str, role: Role, points: Array, up: Array, size: tuple[float, float]) -> Shape:
    """A rail along points (n, 3); size (m) across and along `up`."""
    along = np.gradient(points, axis=0)
    if np.allclose(points[0], points[-1], rtol=0, atol=1e-12):
        along[0] = along[-1] = points[1] - points[-2]
    sideways = np.cross(up, along)
    sideways /= np.linalg.norm(sideways, axis=1)[:, None]
    corners = _profile(*size, is_round=False)
    rings = points[:, None, :] + corners[None, :, :1] * sideways[:, None, :] + corners[None, :, 1:] * up
    return Shape(name, role, rings, points[0], points[-1])
