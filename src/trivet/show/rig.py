"""A scene that moves with its machine: shapes drawn once, and moved with the frames of its bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trivet.kinematics.standing import Bodies
from trivet.show.shapes import Array, Shape


class Placed(NamedTuple):
    """Where shapes are."""

    origin: Array
    """(n, 3) in {O}, m."""
    axes: Array
    """(n, 3, 3) their axes in the columns."""
    stretch: Array
    """(n,) by which a shape is longer along its z axis than it was drawn; 1 for all that moves with one frame."""


class Rig(NamedTuple):
    """Shapes in axes of their own; z runs along those that are drawn out between two frames."""

    shapes: tuple[Shape, ...]
    carriers: Array
    """(n, 2) frames of `Bodies` with which the first ring and the last one move."""
    first: Array
    """(n, 3) origin of a shape's axes in the frame of its first ring, m."""
    last: Array
    """(n, 3) the far end of a shape that is drawn out, in the frame of its last ring, m."""
    axes: Array
    """(n, 3, 3) a shape's axes in the frame of its first ring."""
    length: Array
    """(n,) of shapes that are drawn out, as they were drawn, m; 0 of others."""

    def placed(self, bodies: Bodies) -> Placed:
        """Where the shapes are when the bodies are there."""
        frames = np.asarray(bodies.frames)[self.carriers]
        turns = frames[:, :, 1:].swapaxes(2, 3)
        origin = frames[:, 0, 0] + np.einsum("nij,nj->ni", turns[:, 0], self.first)
        axes = turns[:, 0] @ self.axes
        far = frames[:, 1, 0] + np.einsum("nij,nj->ni", turns[:, 1], self.last)
        out = self.length > 0
        length = np.where(out, np.linalg.norm(far - origin, axis=1), 1.0)
        return Placed(origin, axes, np.where(out, length / np.where(out, self.length, 1.0), 1.0))


def rig(shapes: tuple[Shape, ...], bodies: Bodies) -> Rig:
    """Shapes of a scene made to move with the bodies, which stand as they are drawn.

    Args:
        shapes: in {O}.
        bodies: at the pose at which the shapes are drawn.
    """
    carriers = np.array([shape.carriers for shape in shapes])
    frames = np.asarray(bodies.frames)[carriers]
    turns = frames[:, :, 1:].swapaxes(2, 3)
    drawn_out = carriers[:, 0] != carriers[:, 1]
    start, end = np.array([shape.start for shape in shapes]), np.array([shape.end for shape in shapes])
    axes = np.stack(
        [_along(*ends) if out else turn for out, turn, *ends in zip(drawn_out, turns[:, 0], start, end, strict=True)]
    )
    own = tuple(
        shape._replace(rings=(shape.rings - s) @ a, start=np.zeros(3), end=(e - s) @ a)
        for shape, s, e, a in zip(shapes, start, end, axes, strict=True)
    )
    first = np.einsum("nji,nj->ni", turns[:, 0], start - frames[:, 0, 0])
    last = np.einsum("nji,nj->ni", turns[:, 1], end - frames[:, 1, 0])
    length = np.where(drawn_out, np.linalg.norm(end - start, axis=1), 0.0)
    return Rig(own, carriers, first, last, turns[:, 0].swapaxes(1, 2) @ axes, length)


def _along(start: Array, end: Array) -> Array:
    """(3, 3) axes of which z runs from one point to another."""
    z = (end - start) / np.linalg.norm(end - start)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)
