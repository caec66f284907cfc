"""What the leg families share: recognising elements, and angles in the plane."""

from __future__ import annotations

from trivet.model.elements import Beam, Element, Joint, Prismatic, Revolute, Spherical
from trivet.space.frame import Angle
from trivet.space.scalar import mul
from trivet.space.vector import Vec


def is_hinge(element: Element) -> bool:
    """A revolute joint across the plane."""
    return isinstance(element, Revolute) and abs(element.axis[1]) == 1


def is_slide(element: Element) -> bool:
    """A prismatic joint in the plane."""
    return isinstance(element, Prismatic) and element.axis[1] == 0


def is_link(element: Element) -> bool:
    """A beam in the plane."""
    return isinstance(element, Beam) and element.axis[1] == 0


def is_ball(element: Element) -> bool:
    """A spherical joint."""
    return isinstance(element, Spherical)


def hinge_angle(hinge: Joint, before: Vec, after: Vec) -> Angle:
    """The angle by which a hinge has turned a direction in the plane into another; both of unit length."""
    assert isinstance(hinge, Revolute)
    return Angle(before @ after, mul(before.cross(after).y, hinge.axis[1]))
