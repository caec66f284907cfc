"""Travel: what a joint's limits speak of, compared without inverse trigonometry."""

from __future__ import annotations

import math
from typing import NamedTuple

import jax.numpy as jnp

from trivet.kinematics.walk import Coordinate, Posture, walk
from trivet.model import Leg
from trivet.model.elements import Drivable, Element, Revolute
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar


class Gauge(NamedTuple):
    """A joint against its travel: value, lower and upper limit on one monotonic scale (m, rad, or the sine of an elevation)."""

    joint: Drivable
    value: Scalar
    low: Scalar
    high: Scalar

    @property
    def is_sine(self) -> bool:
        """Whether the scale is the sine of an elevation."""
        return isinstance(self.joint, Revolute) and self.joint.measure == "elevation"


def gauges(leg: Leg, posture: Posture) -> list[Gauge]:
    """Every limited joint of a chain."""
    return gauges_along(leg, walk(leg.chain.elements, posture), posture.coordinates)


def gauges_along(leg: Leg, steps: list[tuple[Element, Frame, Coordinate]], coordinates: tuple[Coordinate, ...]) -> list[Gauge]:
    """Every limited joint of a walk whose frames have z upright; the coordinates stand apart, as a walk may start at rest."""
    found = []
    for index, (element, frame, coordinate) in enumerate(steps):
        limits = leg.limits[index]
        if limits is None:
            continue
        assert isinstance(element, Drivable)
        low, high = limits
        if not element.is_angular:
            found.append(Gauge(element, coordinates[index], low, high))
        elif isinstance(element, Revolute) and element.measure == "elevation":
            follower = next(e.axis_of_body for e, _, _ in steps[index + 1 :] if e.axis_of_body is not None)
            sine = element.advance(frame, coordinate).direction(follower).z
            found.append(Gauge(element, sine, low, high))
        else:
            angle = element.number(coordinates[index])
            # The turn nearest to the middle of the travel, so that a travel may lie across 180 degrees.
            turns = jnp.round(((low + high) / 2 - angle) / (2 * math.pi))
            found.append(Gauge(element, angle + 2 * math.pi * turns, low, high))
    return found


def within(leg: Leg, posture: Posture) -> Scalar:
    """Whether a chain closes with every joint inside its travel; False, not NaN, where it does not close."""
    inside: Scalar = posture.reach >= 0
    for gauge in gauges(leg, posture):
        inside = inside & (gauge.value >= gauge.low) & (gauge.value <= gauge.high)
    return inside
