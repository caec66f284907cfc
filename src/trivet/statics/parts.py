"""What a chain is made of mechanically, in order from the ground: ties that yield, beams, rigid arms, and masses.

Both ways to a structure's equations read this list: nodes and elements (`statics.assembly`, in {O}, with numbers), and the
exact dynamic stiffness of a chain (`vibration.spectral_chain`, in the chain's own axes, while JAX traces).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from trivet.kinematics.walk import Coordinate
from trivet.model.elements import Beam, Element, Flexibility, Joint, Offset, Prismatic, Profile, Stock
from trivet.model.elements.base import Direction
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist
from trivet.space.vector import Vec


class Tie(NamedTuple):
    """A joint between two bodies: slack along some screws, sprung along others, rigid along the rest."""

    element: Joint
    at: Vec
    """Point at which its screws are reduced, m."""
    slack: tuple[Twist, ...]
    sprung: tuple[Flexibility, ...]
    motion: tuple[Twist, ...]
    """Its freedoms, slack or not."""


class Bar(NamedTuple):
    """A straight beam from a frame along one of its directions; a negative length runs the other way, zero is rigid."""

    element: Element
    start: Frame
    axis: Direction
    length: Scalar
    profile: Profile

    @property
    def end(self) -> Vec:
        """Where it ends, m."""
        return self.start.origin + self.start.direction(self.axis) * self.length


class Arm(NamedTuple):
    """A rigid body between two points (m)."""

    element: Element
    start: Vec
    end: Vec


class Lump(NamedTuple):
    """A rigid mass (kg), and moments of inertia (kg m^2) about its centre along the axes of a frame that stands there."""

    element: Element
    frame: Frame
    mass: Scalar
    moments: tuple[Scalar, Scalar, Scalar]


Part = Tie | Bar | Arm | Lump


def parts(steps: Sequence[tuple[Element, Frame, Coordinate]], seat: Frame, stock: Stock) -> Iterator[Part]:
    """The parts of one chain.

    Args:
        steps: every element with the frame in which it starts and its coordinate, as `kinematics.walk` gives them.
        seat: the frame of the platform joint on the platform, in the same axes; its origin is not looked at.
        stock: sections and materials.
    """
    last, frame, coordinate = steps[-1]
    # How a ball stands that was never asked is how the platform stands; it does not move its own point.
    is_unasked = coordinate is None and isinstance(last, Joint)
    end = seat._replace(origin=frame.origin) if is_unasked else last.advance(frame, coordinate)
    beyond = [*(start for _, start, _ in steps[1:]), end]
    for (element, start, coordinate), end in zip(steps, beyond, strict=True):
        if isinstance(element, Offset):
            yield from _offset(element, start, end)
        elif isinstance(element, Beam):
            yield Bar(element, start, element.axis, element.length, element.profile)
        else:
            assert isinstance(element, Joint)
            yield from _joint(element, start, coordinate, end, stock)


def _offset(offset: Offset, start: Frame, end: Frame) -> Iterator[Part]:
    """A rigid body; half of its mass at either end."""
    if offset.mass is not None:
        yield Lump(offset, start, offset.mass / 2, (0, 0, 0))
    yield Arm(offset, start.origin, end.origin)
    if offset.mass is not None:
        yield Lump(offset, end, offset.mass / 2, (0, 0, 0))


def _joint(joint: Joint, start: Frame, coordinate: Coordinate, end: Frame, stock: Stock) -> Iterator[Part]:
    body = joint.beam if isinstance(joint, Prismatic) else None
    at = end.origin if body is None else start.origin
    # A beam on a slide is a part of its own here; only drive and bearing yield in the joint.
    bare: Any = dataclasses.replace(joint, beam=None) if isinstance(joint, Prismatic) else joint
    slack, sprung = bare.slack(start, coordinate, at), bare.flexibilities(start, coordinate, at, stock)
    yield Tie(joint, at, slack, sprung, bare.freedoms(start, coordinate, at))
    if body is not None:
        assert isinstance(joint, Prismatic)
        yield Bar(joint, start, joint.axis, coordinate, body)
    if joint.mass is not None:
        yield Lump(joint, end.shift(joint.centre_of_mass or (0, 0, 0)), joint.mass, joint.inertia or (0, 0, 0))
