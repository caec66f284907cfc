"""Guides, one file each: the joints that put the platform joint into the vertical plane of a leg.

A guide has `matches(elements)` (how many elements it is made of, 0 when it is not this guide), `has_side(elements)`, and
`place`, which gives the `Placing`.
"""

from __future__ import annotations

from typing import NamedTuple

from trivet.kinematics.walk import Coordinate
from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

ON_AXIS = 1e-9
"""Distance (m) from the axis of a circular guide at which a carriage has no place any more (a Type 1 singularity)."""


class Placing(NamedTuple):
    """Where a guide puts the plane of its leg."""

    heading: Angle
    """Rotation of the plane about z, from {O}."""
    start: Frame
    """Where the first joint stands, in the axes of the plane (x outwards, z up)."""
    end: Vec
    """The platform joint in those axes, m; its y is zero."""
    walked: tuple[Coordinate, ...]
    """Coordinates with which the walk passes the guide, which carries its axes along."""
    coordinates: tuple[Coordinate, ...]
    """The guide's own."""
    clear: Scalar
    """Below zero where the guide has no place for the platform joint (m^2)."""
