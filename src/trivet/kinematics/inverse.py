"""Inverse kinematics in closed form: a guide, which puts the platform joint into a plane, carrying a planar leg.

The guide fixes the chain's frame and with it the plane; the leg families (`legs/`) solve the plane.  Families are chosen by
what the chain is made of.
"""

from __future__ import annotations

import math
from types import ModuleType

import jax.numpy as jnp

from trivet.errors import InputError
from trivet.kinematics.legs import elbow, slide_link, telescope
from trivet.kinematics.walk import Posture, at_rest
from trivet.model import Leg
from trivet.model.elements import Curvilinear, Element, Offset, Prismatic
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar, mul
from trivet.space.vector import Vec

SIDE, ELBOW = 0, 1
"""Columns of the signs of a working mode."""

ON_AXIS = 1e-9
"""Distance (m) from the axis of a circular guide at which a carriage has no place any more (a Type 1 singularity)."""

FAMILIES: tuple[ModuleType, ...] = (slide_link, telescope, elbow)


def family_of(leg: Leg) -> ModuleType:
    """The leg family which solves a chain.

    Raises:
        InputError: when no family matches.
    """
    guide, *rest = leg.chain.elements
    if isinstance(guide, Curvilinear) or (isinstance(guide, Prismatic) and abs(guide.axis[1]) == 1):
        core = _after_offsets(tuple(rest))
        for family in FAMILIES:
            if family.matches(core):
                return family
    kinds = " ".join(e.type for e in leg.chain.elements)
    raise InputError(
        f"chains.{leg.name}: no closed-form inverse kinematics for the chain {kinds}; solved are a circular or "
        "straight guide with a slide and link, a telescope or two links (the machine can be shown)"
    )


def has_closed_form(leg: Leg) -> bool:
    """Whether a leg family solves a chain."""
    try:
        family_of(leg)
    except InputError:
        return False
    return True


def _after_offsets(elements: tuple[Element, ...]) -> tuple[Element, ...]:
    return _after_offsets(elements[1:]) if isinstance(elements[0], Offset) else elements


def branches(leg: Leg) -> tuple[int, ...]:
    """The choices which a chain's inverse kinematics has, out of SIDE and ELBOW."""
    side = (SIDE,) if isinstance(leg.chain.elements[0], Curvilinear) else ()
    return side + ((ELBOW,) if family_of(leg).HAS_ELBOW else ())


def inverse(leg: Leg, pose: Frame, signs: Scalar) -> Posture:
    """How one chain stands at a platform pose (paper Eqs 2-4, with every branch).

    Args:
        leg: the chain.
        pose: platform frame {E} in {O}; component arrays of one batch shape.
        signs: (2,) side and elbow, +1 or -1.

    Returns:
        The posture; coordinates are NaN where `reach` is below zero.
    """
    family = family_of(leg)
    end = pose.shift(leg.platform_frame().origin).origin
    guide, *rest = leg.chain.elements
    heading, plane_end, coordinate, clear = _on_guide(guide, leg.base_frame(), end, signs[SIDE])
    frame = guide.advance(IDENTITY, at_rest(guide))
    core = _after_offsets(tuple(rest))
    leading = rest[: len(rest) - len(core)]
    for offset in leading:
        assert isinstance(offset, Offset)
        frame = offset.advance(frame)
    solved, reach = family.solve(core, frame, plane_end, signs[ELBOW])
    return Posture(heading, plane_end, (coordinate, *(None for _ in leading), *solved), jnp.minimum(reach, clear))


def _on_guide(guide: Element, base: Frame, end: Vec, side: Scalar) -> tuple[Angle, Vec, Scalar, Scalar]:
    """Heading of the chain's frame, P in it, the coordinate of the guide, and a reach: below zero on the axis of a circle."""
    local = end - base.origin
    if isinstance(guide, Curvilinear):
        square = local.x * local.x + local.y * local.y
        # sqrt(1/s), not 1/sqrt(s): XLA makes of the latter a call that stops vectorisation.
        inverse_radius = mul(side, jnp.sqrt(1 / square))
        heading = Angle(local.x * inverse_radius, local.y * inverse_radius)
        radius = square * inverse_radius
        turned = Angle(heading.cos * base.x.x + heading.sin * base.x.y, heading.sin * base.x.x - heading.cos * base.x.y)
        return heading, Vec(radius, 0, local.z), turned, square - ON_AXIS * ON_AXIS
    assert isinstance(guide, Prismatic)
    along = local @ base.y
    return Angle(base.x.x, base.x.y), Vec(local @ base.x, 0, local.z), along * guide.axis[1], math.inf
