"""Foot: two slides in the base plane, a ball, a link, a hinge on the platform (the legs of Tahmasebi's machine).

The link turns about the platform's hinge until its foot lies in the base plane.  Elbow +: at small tilts the foot is outwards
of the hinge; the two feet change places where the hinge is vertical, or the link cannot reach the plane.
"""

from __future__ import annotations

import jax.numpy as jnp

from trivet.kinematics.chains import ELBOW
from trivet.kinematics.walk import Posture
from trivet.model import Leg
from trivet.model.elements import Beam, Element, Prismatic, Revolute, Spherical
from trivet.space.frame import IDENTITY, Angle, Frame, Turn
from trivet.space.scalar import Scalar, mul
from trivet.space.vector import Vec, Z

_KINDS = (Prismatic, Prismatic, Spherical, Beam, Revolute)


def matches(elements: tuple[Element, ...]) -> bool:
    """Whether a chain is two level slides at right angles, a ball, a link, and a hinge across the link."""
    if len(elements) != len(_KINDS) or not all(isinstance(e, kind) for e, kind in zip(elements, _KINDS, strict=True)):
        return False
    first, second, _, link, hinge = elements
    assert isinstance(first, Prismatic)
    assert isinstance(second, Prismatic)
    assert isinstance(link, Beam)
    assert isinstance(hinge, Revolute)
    level = first.axis[2] == 0 and second.axis[2] == 0 and first.locked is None and second.locked is None
    square = abs(Vec(*first.axis) @ Vec(*second.axis)) < 1e-12
    return level and square and hinge.locked is None and abs(Vec(*link.axis) @ Vec(*hinge.axis)) < 1e-12


def branches(elements: tuple[Element, ...]) -> tuple[int, ...]:
    """On which side of the hinge the foot stands."""
    return (ELBOW,)


def stand(leg: Leg, pose: Frame, signs: Scalar) -> Posture:
    """How the chain stands: the link from the platform down to the plane, the slides from the foot."""
    first, second, _, link, hinge = leg.chain.elements
    assert isinstance(first, Prismatic)
    assert isinstance(second, Prismatic)
    assert isinstance(link, Beam)
    assert isinstance(hinge, Revolute)
    base = leg.base_frame()
    joint = pose.place(leg.platform_frame())
    tip = Frame(_seen(base, joint.origin - base.origin), *(_seen(base, v) for v in joint[1:]))
    pin = tip.direction(hinge.axis)
    # Of the directions across the pin: a level one, outwards on a platform that lies level, and the one that rises most.  The
    # sense of the first is fixed in the platform: chosen by where it points, the branches would change places as it tilts.
    across = pin.cross(Z)
    level = across / jnp.sqrt(across @ across)
    steepest = level.cross(pin)
    rise = steepest.z  # sine of its elevation
    side = mul(signs[ELBOW], -1 if hinge.axis[1] < 0 else 1)
    up = tip.origin.z / rise
    reach = link.length * link.length - up * up
    along = (steepest * up - level * mul(side, jnp.sqrt(reach))) / link.length
    foot = tip.origin - along * link.length
    other = pin.cross(along)
    before = tip.direction(link.axis)
    turned = Angle(before @ along, before @ other)
    # The link's own frame has the pin and the link where the machine file says; a ball leads there from the level frame.
    pin_own, link_own = Vec(*hinge.axis), Vec(*link.axis)
    other_own = pin_own.cross(link_own)
    columns = [pin * pin_own[k] + along * link_own[k] + other * other_own[k] for k in range(3)]
    coordinates = (foot @ Vec(*first.axis), foot @ Vec(*second.axis), Turn(*columns), None, turned)
    heading = leg.base_turn if leg.chain.base is not None else Angle(1, 0)
    return Posture(heading, IDENTITY, tip.origin, coordinates, coordinates, reach)


def _seen(base: Frame, v: Vec) -> Vec:
    """A vector in the axes of the base, which are turned about z."""
    return Vec(v @ base.x, v @ base.y, v.z)
