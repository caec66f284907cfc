"""Travel: what a joint's limits speak of, compared without inverse trigonometry."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import jax.numpy as jnp

from trivet.kinematics.walk import Coordinate, Posture, walk
from trivet.model import Leg, Machine
from trivet.model.elements import Drivable, Element, Joint, Revolute, Socket
from trivet.space.frame import Angle, Frame, about_z
from trivet.space.scalar import Scalar, cosine, sine


class Gauge(NamedTuple):
    """A joint against its travel: value, lower and upper limit on one monotonic scale."""

    joint: Joint
    value: Scalar
    low: Scalar
    high: Scalar
    scale: Literal["plain", "sine", "cosine"] = "plain"
    """What the three are: the coordinate (m, rad), or the sine or the cosine of an angle."""

    @property
    def margin(self) -> Scalar:
        """How far it is inside its travel, on the gauge's scale: 1 in the middle, 0 at an end, below zero outside."""
        if self.scale == "cosine":
            return (self.value - self.low) / (1 - self.low)
        return jnp.minimum(self.value - self.low, self.high - self.value) * (2 / (self.high - self.low))

    def plain(self, value: Scalar) -> Scalar:
        """A value on this scale in m or rad."""
        if self.scale == "plain":
            return value
        inside = jnp.clip(value, -1.0, 1.0)  # rounding of unit vectors
        return jnp.arcsin(inside) if self.scale == "sine" else jnp.arccos(inside)


def gauges(leg: Leg, posture: Posture, pose: Frame) -> list[Gauge]:
    """Every limited joint of a chain, at a platform pose."""
    seat = pose.place(leg.platform_frame())
    back = Angle(posture.heading.cos, -posture.heading.sin)
    turned = Frame(posture.end, *(about_z(back, axis) for axis in seat[1:]))
    return gauges_along(leg, walk(leg.chain.elements, posture), posture.coordinates, turned)


def gauges_along(
    leg: Leg, steps: list[tuple[Element, Frame, Coordinate]], coordinates: tuple[Coordinate, ...], seat: Frame
) -> list[Gauge]:
    """Every limited joint of a walk.

    Args:
        leg: the chain.
        steps: the walk, in axes whose z is upright.
        coordinates: they stand apart, as a walk may start at rest.
        seat: the frame of the platform joint, in the axes of the walk.
    """
    found = []
    for index, (element, frame, _) in enumerate(steps):
        limits = leg.limits[index]
        if limits is None:
            continue
        low, high = limits
        if isinstance(element, Socket):
            found.append(_socket(element, steps, index, seat, low, high))
            continue
        assert isinstance(element, Drivable)
        if not element.is_angular:
            found.append(Gauge(element, coordinates[index], low, high))
        elif isinstance(element, Revolute) and element.measure == "elevation":
            follower = next(e.axis_of_body for e, _, _ in steps[index + 1 :] if e.axis_of_body is not None)
            rise = element.advance(frame, steps[index][2]).direction(follower).z
            found.append(Gauge(element, rise, low, high, "sine"))
        else:
            # Counted from the middle of the travel, so that the cut of the arc tangent lies opposite of it.
            middle = (low + high) / 2
            own, (cos, sin) = coordinates[index], (cosine(middle), sine(middle))
            from_middle = jnp.arctan2(own.sin * cos - own.cos * sin, own.cos * cos + own.sin * sin)
            found.append(Gauge(element, middle + from_middle, low, high))
    return found


def _socket(
    joint: Socket, steps: list[tuple[Element, Frame, Coordinate]], index: int, seat: Frame, low: Scalar, high: Scalar
) -> Gauge:
    """A socket's stem against its neutral axis."""
    neutral = joint.neutral
    assert neutral is not None
    before, beyond = steps[index][1], seat if index == len(steps) - 1 else steps[index + 1][1]
    own, other = (beyond, before) if neutral.body == "beyond" else (before, beyond)
    if neutral.stem is not None:
        stem = other.direction(neutral.stem)
    elif neutral.body == "beyond":
        along, frame = next((e.axis_of_body, f) for e, f, _ in reversed(steps[:index]) if e.axis_of_body is not None)
        stem = -frame.direction(along)
    else:
        along, frame = next((e.axis_of_body, f) for e, f, _ in steps[index + 1 :] if e.axis_of_body is not None)
        stem = frame.direction(along)
    scale: Literal["sine", "cosine"] = "sine" if neutral.measure == "elevation" else "cosine"
    return Gauge(joint, stem @ own.direction(neutral.axis), low, high, scale)


def winding(machine: Machine) -> list[str]:
    """Joints that may turn by more than once round: of these a pose alone does not tell how far they have turned."""
    return [
        f"{leg.name}.{element.name}"
        for leg in machine.legs
        for element in leg.chain.elements
        if isinstance(element, Drivable) and element.is_angular and element.travel is not None
        and float(element.travel[1]) - float(element.travel[0]) > 2 * math.pi * (1 + 1e-9)
    ]  # fmt: skip


def within(leg: Leg, posture: Posture, pose: Frame) -> Scalar:
    """Whether a chain closes with every joint inside its travel; False, not NaN, where it does not close."""
    inside: Scalar = posture.reach >= 0
    for gauge in gauges(leg, posture, pose):
        inside = inside & (gauge.value >= gauge.low) & (gauge.value <= gauge.high)
    return inside


def margin(leg: Leg, posture: Posture, pose: Frame) -> Scalar:
    """The least `Gauge.margin` of a chain; minus infinity where it does not close, 1 where nothing is limited."""
    least: Scalar = 1.0
    for gauge in gauges(leg, posture, pose):
        least = jnp.minimum(least, gauge.margin)
    return jnp.where(posture.reach >= 0, least, -jnp.inf)


def room(leg: Leg, posture: Posture, pose: Frame, length: Scalar) -> Scalar:
    """How far a chain is from where it cannot stand: the least of `margin` and of its reach by the square of a length (m).

    0 where the chain is stretched, below zero where it does not close; unlike the margin it has slopes on both sides.
    """
    left = posture.reach / (length * length)
    return jnp.where(posture.reach >= 0, jnp.minimum(margin(leg, posture, pose), left), left)
