"""The walk down a chain: the frame at every element, from the carriage of the first joint to the platform joint.

The walk is written in the chain's own frame, which the first joint carries with it: there a circular guide has its axis along
z, the carriage stands on the x axis, and a planar chain keeps its zeros.  A joint's screw is the same seen from either of the
bodies it connects, so the first joint's own screw needs no motion.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from trivet.model.elements import Curvilinear, Element, Prismatic
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

Coordinate = Any
"""A joint coordinate: a length (m), an Angle, or several Angles; None for a body, and for a last joint that nobody asked."""


class Posture(NamedTuple):
    """How one chain stands."""

    heading: Angle
    """Rotation of the chain's frame about z, from {O}."""
    end: Vec
    """The platform joint P in the chain's frame, m."""
    coordinates: tuple[Coordinate, ...]
    """One per element."""
    reach: Scalar
    """Below zero where the chain cannot close: squared length (m^2) that is missing."""


def at_rest(joint: Element) -> Coordinate:
    """Zero coordinate of a first joint, known at trace time."""
    return Angle(1, 0) if isinstance(joint, Curvilinear) else 0 if isinstance(joint, Prismatic) else None


def walk(elements: tuple[Element, ...], posture: Posture) -> list[tuple[Element, Frame, Coordinate]]:
    """Every element with the frame in which it starts and its coordinate, in the chain's own frame."""
    return walk_from(IDENTITY, elements, (at_rest(elements[0]), *posture.coordinates[1:]))


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
