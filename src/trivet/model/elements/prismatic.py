"""Prismatic joint: a slide along a straight line, whose extended part may be a beam."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax.numpy as jnp

from trivet.model.elements.base import Axis, Direction, Drivable, Flexibility, Profile, Stock
from trivet.model.elements.beam import along, beam_flexibilities
from trivet.model.mass import Rod
from trivet.model.quantity import Damping, Friction, Length, Mass, Stiffness
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist, translation
from trivet.space.vector import Vec


class Prismatic(Drivable):
    """A slide along an axis of the frame; its coordinate is the distance from where the frame stands."""

    COORDINATES = ("length",)

    type: Literal["prismatic"] = eqx.field(static=True)
    axis: Axis = eqx.field(static=True)
    """Direction of positive travel."""
    travel: tuple[Length, Length] | None = eqx.field(default=None, kw_only=True)
    """Range of the distance; unlimited when not given."""
    stiffness: Stiffness | None = eqx.field(default=None, kw_only=True)
    """Stiffness of the drive along the axis; rigid when not given."""
    damping: Damping | None = eqx.field(default=None, kw_only=True)
    """Viscous damping along the axis; none when not given."""
    friction: Friction | None = eqx.field(default=None, kw_only=True)
    """Coulomb friction along the axis; none when not given."""
    reflected_inertia: Mass | None = eqx.field(default=None, kw_only=True)
    """Inertia of motor and gear as it is felt along the axis, J (2 pi / lead)^2 of a screw; none when not given."""
    locked: Length | None = eqx.field(default=None, kw_only=True)
    """Distance at which the joint is held while the machine works; free when not given."""
    beam: Profile | None = None
    """The extended part, an elastic beam as long as the coordinate (zero is rigid); rigid when not given."""

    @property
    def rod(self) -> Rod | None:
        """The whole rod: it moves with the slide, and reaches back to where the slide starts over all of the travel.

        Without a travel nobody knows how long that is.
        """
        if self.beam is None or self.travel is None:
            return None
        low, high = self.travel
        # Not the maximum, whose slope at zero is neither that of a longer nor that of a shorter travel.
        return Rod(self.axis, -jnp.where(high > 0, high, 0.0), -jnp.where(low < 0, low, 0.0), self.beam)

    @property
    def axis_of_body(self) -> Direction:
        return self.axis

    def advance(self, frame: Frame, coordinate: Scalar) -> Frame:
        return along(frame, self.axis, coordinate)

    def motion(self, frame: Frame, at: Vec) -> Twist:
        return translation(frame.direction(self.axis))

    def flexibilities(self, frame: Frame, coordinate: Scalar, at: Vec, stock: Stock) -> tuple[Flexibility, ...]:
        yielding = self.bearing_flexibilities(frame, coordinate, at)
        if self.stiffness is not None:
            yielding = (Flexibility(1 / self.stiffness, self.motion(frame, at), self.part), *yielding)
        if self.beam is None:
            return yielding
        return yielding + beam_flexibilities(frame, self.axis, coordinate, self.beam, at, stock)
