"""A carriage on a straight line across the plane of the leg."""

from __future__ import annotations

import math

from trivet.kinematics.guides import Placing
from trivet.model.elements import Element, Prismatic
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec


def matches(elements: tuple[Element, ...]) -> int:
    """How many elements, from the first, make this guide."""
    return 1 if is_cross_slide(elements[0]) else 0


def is_cross_slide(element: Element) -> bool:
    """A prismatic joint across the plane of the leg."""
    return isinstance(element, Prismatic) and abs(element.axis[1]) == 1


def has_side(elements: tuple[Element, ...]) -> bool:
    """There is no choice."""
    return False


def place(elements: tuple[Element, ...], base: Frame, end: Vec, side: Scalar) -> Placing:
    """The carriage stands where the plane of the leg contains P."""
    guide = elements[0]
    assert isinstance(guide, Prismatic)
    local = end - base.origin
    along = (local @ base.y) * guide.axis[1]
    plane_end = Vec(local @ base.x, 0, local.z)
    return Placing(Angle(base.x.x, base.x.y), IDENTITY, plane_end, (0,), (along,), math.inf)
