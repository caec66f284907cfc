"""Elbow: a hinge, a link, a hinge, a link, a ball (the leg of Glozman's machine).

Elbow +: the middle hinge lies on the outer, upper side of the line from the first hinge to the platform joint.
"""

from __future__ import annotations

import jax.numpy as jnp

from trivet.kinematics.legs.plane import hinge_angle, is_ball, is_hinge, is_link
from trivet.kinematics.walk import Coordinate
from trivet.model.elements import Beam, Element, Revolute
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, mul
from trivet.space.vector import Vec

HAS_ELBOW = True


def matches(elements: tuple[Element, ...]) -> bool:
    """Whether a chain, less its guide, is of this family."""
    tests = (is_hinge, is_link, is_hinge, is_link, is_ball)
    return len(elements) == len(tests) and all(test(e) for test, e in zip(tests, elements, strict=True))


def solve(elements: tuple[Element, ...], frame: Frame, end: Vec, elbow: Scalar) -> tuple[tuple[Coordinate, ...], Scalar]:
    """Coordinates (two hinge Angles, the second relative to the first link) and reach (m^2)."""
    first, lower, second, upper, _ = elements
    assert isinstance(first, Revolute)
    assert isinstance(lower, Beam)
    assert isinstance(second, Revolute)
    assert isinstance(upper, Beam)
    to_end = end - frame.origin
    square = to_end @ to_end
    # Foot of the middle hinge on the line to the end, and its distance from that line.
    foot = 0.5 * (1 + (lower.length * lower.length - upper.length * upper.length) / square)
    reach = lower.length * lower.length - foot * foot * square
    aside = mul(elbow, jnp.sqrt(reach / square))
    knee = Vec(to_end.x * foot + to_end.z * aside, 0, to_end.z * foot - to_end.x * aside)
    lower_direction, upper_direction = knee * (1 / lower.length), (to_end - knee) * (1 / upper.length)
    turned = hinge_angle(first, frame.direction(lower.axis), lower_direction)
    beyond = first.advance(frame, turned)
    relative = hinge_angle(second, beyond.direction(upper.axis), upper_direction)
    return (turned, None, relative, None, None), reach
