"""A cross slide on a carriage on a circle about z, one of the two locked (the stages of the redundant prototype, section 5).

With the drive of the leg locked instead, the leg alone decides how far from the axis its platform joint is, and both move.
"""

from __future__ import annotations

import math

import jax.numpy as jnp

from trivet.kinematics.guides import ON_AXIS, Placing
from trivet.kinematics.guides.straight import is_cross_slide
from trivet.model.elements import Curvilinear, Element, Prismatic
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar, cosine, mul, sine
from trivet.space.vector import Vec


def matches(elements: tuple[Element, ...]) -> int:
    """How many elements, from the first, make this guide."""
    return 2 if isinstance(elements[0], Curvilinear) and is_cross_slide(elements[1]) else 0


def has_side(elements: tuple[Element, ...]) -> bool:
    """With the circle locked there is no choice."""
    circle, _ = elements[:2]
    assert isinstance(circle, Curvilinear)
    return circle.locked is None


def is_open(elements: tuple[Element, ...]) -> bool:
    """Whether neither of the two is locked, so that the leg must be."""
    circle, cross = elements[:2]
    assert isinstance(circle, Curvilinear)
    assert isinstance(cross, Prismatic)
    return circle.locked is None and cross.locked is None


def place(elements: tuple[Element, ...], base: Frame, end: Vec, side: Scalar, outwards: Scalar = None) -> Placing:
    """Side +: P outwards of the axis (cross slide locked), or the cross slide at a positive coordinate (leg locked).

    Args:
        elements, base, end, side: as of any guide.
        outwards: distance of P from the axis within the plane of the leg (m), when the leg is locked.
    """
    circle, cross = elements[:2]
    assert isinstance(circle, Curvilinear)
    assert isinstance(cross, Prismatic)
    local = end - base.origin
    x, y = local @ base.x, local @ base.y
    square = x * x + y * y
    clear: Scalar = math.inf
    if circle.locked is not None:
        turn = Angle(cosine(circle.locked), sine(circle.locked))
        out, across = x * turn.cos + y * turn.sin, y * turn.cos - x * turn.sin
    else:
        if cross.locked is not None:
            across = mul(cross.locked, cross.axis[1])
            clear = square - across * across
            out = mul(side, jnp.sqrt(clear))
        else:
            clear = square - outwards * outwards
            out, across = outwards, mul(mul(side, cross.axis[1]), jnp.sqrt(clear))
        clear = jnp.minimum(clear, square - ON_AXIS * ON_AXIS)
        turn = Angle((x * out + y * across) / square, (y * out - x * across) / square)
    heading = Angle(base.x.x * turn.cos - base.x.y * turn.sin, base.x.y * turn.cos + base.x.x * turn.sin)
    slid = mul(across, cross.axis[1])
    # The plane's axes go along with the cross slide, so the axis of the circle stands beside them.
    return Placing(heading, IDENTITY.shift((0, -across, 0)), Vec(out, 0, local.z), (Angle(1, 0), slid), (turn, slid), clear)
