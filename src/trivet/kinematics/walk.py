"""The walk down a chain: the frame at every element, from the carriage of the first joint to the platform joint (paper Eq 5).

The walk is written in the chain's own axes, which its guide carries along: there a circular guide has its axis along z, the
carriage stands above the x axis, and a planar chain keeps its zeros.  A joint's screw is the same seen from either of the
bodies that it connects, so the guide's own screws need no motion.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from trivet.model.elements import Element
from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

Coordinate = Any
"""A joint coordinate: a length (m), an Angle, several Angles, or a Turn; None for a body, and where nobody asked."""


class Posture(NamedTuple):
    """How one chain stands."""

    heading: Angle
    """Rotation about z, from {O}, of the axes in which the walk is written."""
    start: Frame
    """Where the first joint stands, in those axes; their origin is free, since wrenches are reduced at P."""
    end: Vec
    """The platform joint P in those axes, m."""
    walked: tuple[Coordinate, ...]
    """Coordinates as the walk takes them: joints that carry the axes along are at rest in them."""
    coordinates: tuple[Coordinate, ...]
    """One per element."""
    reach: Scalar
    """Below zero where the chain cannot close: squared length (m^2) that is missing."""


def walk(elements: tuple[Element, ...], posture: Posture) -> list[tuple[Element, Frame, Coordinate]]:
    """Every element with the frame in which it starts and its coordinate, in the chain's own axes."""
    return walk_from(posture.start, elements, posture.walked)


def walk_from(
    frame: Frame, elements: tuple[Element, ...], coordinates: tuple[Coordinate, ...]
) -> list[tuple[Element, Frame, Coordinate]]:
    """Every element with the frame in which it starts and its coordinate, in the axes of the first frame."""
    steps = []
    for element, coordinate in zip(elements, coordinates, strict=True):
        steps.append((element, frame, coordinate))
        if element is not elements[-1]:
            frame = element.advance(frame, coordinate)
    return steps
