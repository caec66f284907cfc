"""A carriage on a circle about z (paper Eq 2, with either side)."""

from __future__ import annotations

import jax.numpy as jnp

from trivet.kinematics.guides import ON_AXIS, Placing
from trivet.model.elements import Curvilinear, Element
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar, mul
from trivet.space.vector import Vec


def matches(elements: tuple[Element, ...]) -> int:
    """How many elements, from the first, make this guide."""
    return 1 if isinstance(elements[0], Curvilinear) else 0


def has_side(elements: tuple[Element, ...]) -> bool:
    """The carriage stands on the same side of the axis as the platform joint, or opposite."""
    return True


def place(elements: tuple[Element, ...], base: Frame, end: Vec, side: Scalar) -> Placing:
    """Side +: the carriage on the side of P."""
    local = end - base.origin
    square = local.x * local.x + local.y * local.y
    # sqrt(1/s), not 1/sqrt(s): XLA makes of the latter a call that stops vectorisation.
    inverse_radius = mul(side, jnp.sqrt(1 / square))
    heading = Angle(local.x * inverse_radius, local.y * inverse_radius)
    radius = square * inverse_radius
    turned = Angle(heading.cos * base.x.x + heading.sin * base.x.y, heading.sin * base.x.x - heading.cos * base.x.y)
    clear = square - ON_AXIS * ON_AXIS
    return Placing(heading, IDENTITY, Vec(radius, 0, local.z), (Angle(1, 0),), (turned,), clear)
