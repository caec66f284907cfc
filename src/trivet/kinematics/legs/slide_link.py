"""Slide and link: a prismatic joint in the plane, a hinge, a link of fixed length, a ball (paper Eqs 3-4).

With the slide radial this is the leg of the paper's machine, with the slide vertical Eclipse's column; any direction in the
plane will do.  Elbow +: the link points inward and up along the slide (inward from a radial slide, up from a column).
"""

from __future__ import annotations

import jax.numpy as jnp

from trivet.kinematics.legs.plane import hinge_angle, is_ball, is_hinge, is_link, is_slide
from trivet.kinematics.walk import Coordinate
from trivet.model.elements import Beam, Element, Prismatic, Revolute
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, mul
from trivet.space.vector import Vec, Y

HAS_ELBOW = True


def matches(elements: tuple[Element, ...]) -> bool:
    """Whether a chain, less its guide, is of this family."""
    tests = (is_slide, is_hinge, is_link, is_ball)
    return len(elements) == len(tests) and all(test(e) for test, e in zip(tests, elements, strict=True))


def solve(elements: tuple[Element, ...], frame: Frame, end: Vec, elbow: Scalar) -> tuple[tuple[Coordinate, ...], Scalar]:
    """Coordinates (slide m, hinge Angle) and reach (m^2)."""
    slide, hinge, link, _ = elements
    assert isinstance(slide, Prismatic)
    assert isinstance(hinge, Revolute)
    assert isinstance(link, Beam)
    along = frame.direction(slide.axis)
    across = Y.cross(along)
    to_end = end - frame.origin
    height = to_end @ across
    reach = link.length * link.length - height * height
    run = mul(mul(elbow, _forward(along)), jnp.sqrt(reach))
    direction = (along * run + across * height) * (1 / link.length)
    angle = hinge_angle(hinge, frame.direction(link.axis), direction)
    return ((to_end @ along) - run, angle, None, None), reach


def is_locked_flat(elements: tuple[Element, ...]) -> bool:
    """Whether the slide is locked and radial, so that the link alone decides how far out its end is at a given height."""
    slide = elements[0]
    return isinstance(slide, Prismatic) and slide.locked is not None and slide.axis[2] == 0


def outwards(elements: tuple[Element, ...], frame: Frame, height: Scalar, elbow: Scalar) -> tuple[Scalar, Scalar]:
    """How far out (m) the end of the link is at a height (m) when the slide is locked, and the reach (m^2)."""
    slide, _, link, _ = elements
    assert isinstance(slide, Prismatic)
    assert isinstance(link, Beam)
    along = frame.direction(slide.axis)
    hinge = frame.origin + along * slide.locked
    rise = height - hinge.z
    reach = link.length * link.length - rise * rise
    return hinge.x + along.x * mul(mul(elbow, _forward(along)), jnp.sqrt(reach)), reach


def _forward(along: Vec) -> float:
    """Which way along the slide is inward and up: +1 or -1; inward decides at 45 degrees."""
    inward_up = float(along.z) - float(along.x)
    return 1.0 if inward_up > 0 or (inward_up == 0 and along.x < 0) else -1.0
