"""Strut: a universal joint on the ground, a prismatic joint along the strut, a ball (the legs of a Gough-Stewart platform).

Of the two ways in which a cross can point a strut, the one with its second angle within a right angle is taken; they differ in
nothing but the cross.
"""

from __future__ import annotations

import jax.numpy as jnp

from trivet.kinematics.walk import Posture
from trivet.model import Leg
from trivet.model.elements import Element, Prismatic, Spherical, Universal
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

SHORTEST = 1e-9
"""Length (m) at which a strut, or what the first axis of its cross leaves of it, has no direction any more."""


def matches(elements: tuple[Element, ...]) -> bool:
    """Whether a chain is a strut that stands across both axes of its cross."""
    if len(elements) != 3:
        return False
    cross, slide, ball = elements
    if not (isinstance(cross, Universal) and isinstance(slide, Prismatic) and isinstance(ball, Spherical)):
        return False
    return slide.locked is None and abs(abs(_across(cross) @ Vec(*slide.axis)) - 1) < 1e-12


def branches(elements: tuple[Element, ...]) -> tuple[int, ...]:
    """There is no choice."""
    return ()


def _across(cross: Universal) -> Vec:
    """The direction across both axes at zero angles."""
    return Vec(*cross.axes[0]).cross(Vec(*cross.axes[1]))


def stand(leg: Leg, pose: Frame, signs: Scalar) -> Posture:
    """How the strut stands: both angles of the cross from its direction, the coordinate from its length."""
    cross, slide, _ = leg.chain.elements
    assert isinstance(cross, Universal)
    assert isinstance(slide, Prismatic)
    base = leg.base_frame()
    apart = pose.shift(leg.platform_frame().origin).origin - base.origin
    end = Vec(apart @ base.x, apart @ base.y, apart.z)
    length = jnp.sqrt(end @ end)
    # The strut's axis is +-(a1 x a2); with e = +-end it is a1 x a2 itself.
    first, second, across = Vec(*cross.axes[0]), Vec(*cross.axes[1]), _across(cross)
    towards = end * (across @ Vec(*slide.axis))
    # R(a1, alpha) R(a2, beta) (a1 x a2) = a1 sin beta + cos beta (cos alpha (a1 x a2) - sin alpha a2)
    up, aside = towards @ across, -(towards @ second)
    rest = jnp.sqrt(up * up + aside * aside)
    angles = Angle(up / rest, aside / rest), Angle(rest / length, (towards @ first) / length)
    coordinates = (angles, length, None)
    reach = rest * rest - SHORTEST * SHORTEST
    return Posture(leg.base_turn if leg.chain.base is not None else Angle(1, 0), IDENTITY, end, coordinates, coordinates, reach)
