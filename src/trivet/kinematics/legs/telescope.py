"""Telescope: a hinge, a prismatic joint along the leg, a ball (the leg of Alizade's and Behi's machines).  It has no elbow."""

from __future__ import annotations

import jax.numpy as jnp

from trivet.kinematics.legs.plane import hinge_angle, is_ball, is_hinge, is_slide
from trivet.kinematics.walk import Coordinate
from trivet.model.elements import Element, Prismatic, Revolute
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

HAS_ELBOW = False
SHORTEST = 1e-9
"""Length (m) at which a telescope has no direction any more."""


def matches(elements: tuple[Element, ...]) -> bool:
    """Whether a chain, less its guide, is of this family."""
    tests = (is_hinge, is_slide, is_ball)
    return len(elements) == len(tests) and all(test(e) for test, e in zip(tests, elements, strict=True))


def solve(elements: tuple[Element, ...], frame: Frame, end: Vec, elbow: Scalar) -> tuple[tuple[Coordinate, ...], Scalar]:
    """Coordinates (hinge Angle, length m) and reach (m^2)."""
    hinge, slide, _ = elements
    assert isinstance(hinge, Revolute)
    assert isinstance(slide, Prismatic)
    to_end = end - frame.origin
    square = to_end @ to_end
    length = jnp.sqrt(square)
    direction = Vec(to_end.x / length, 0, to_end.z / length)
    angle = hinge_angle(hinge, frame.direction(slide.axis), direction)
    return (angle, length, None), square - SHORTEST * SHORTEST
