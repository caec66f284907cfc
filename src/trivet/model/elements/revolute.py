"""Revolute joint."""

from __future__ import annotations

from typing import Literal

import equinox as eqx

from trivet.model.elements.base import Axis, Drivable, Flexibility, Stock
from trivet.model.quantity import AngleValue, Inertia, RotationalDamping, RotationalFriction, RotationalStiffness
from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar, sine
from trivet.space.screw import Twist, rotation
from trivet.space.vector import Vec


class Revolute(Drivable):
    """A hinge about an axis of the frame; its coordinate is the angle turned."""

    COORDINATES = ("angle",)

    type: Literal["revolute"] = eqx.field(static=True)
    axis: Axis = eqx.field(static=True)
    """Axis of the hinge."""
    travel: tuple[AngleValue, AngleValue] | None = eqx.field(default=None, kw_only=True)
    """Range of what `measure` says; unlimited when not given."""
    measure: Literal["angle", "elevation"] = eqx.field(static=True, default="angle")
    """What the travel limits: the angle turned, or the elevation of the next body above the base plane (asin(P_z/L))."""
    stiffness: RotationalStiffness | None = eqx.field(default=None, kw_only=True)
    """Stiffness about the axis; of an actuated hinge rigid, of a passive one zero when not given."""
    damping: RotationalDamping | None = eqx.field(default=None, kw_only=True)
    """Viscous damping about the axis; none when not given."""
    friction: RotationalFriction | None = eqx.field(default=None, kw_only=True)
    """Coulomb friction about the axis; none when not given."""
    reflected_inertia: Inertia | None = eqx.field(default=None, kw_only=True)
    """Inertia of motor and gear as it is felt about the axis, the motor's times ratio^2; none when not given."""
    locked: AngleValue | None = eqx.field(default=None, kw_only=True)
    """Angle at which the joint is held while the machine works; free when not given."""

    @property
    def limits(self) -> tuple[Scalar, Scalar] | None:
        """The travel; of an elevation its sine, which needs no inverse trigonometry at every pose."""
        if self.measure == "angle" or self.travel is None:
            return self.travel
        low, high = self.travel
        return sine(low), sine(high)

    def advance(self, frame: Frame, coordinate: Angle) -> Frame:
        return frame.turn(self.axis, coordinate)

    def motion(self, frame: Frame, at: Vec) -> Twist:
        return rotation(frame.direction(self.axis), frame.origin, at)

    def flexibilities(self, frame: Frame, coordinate: Angle, at: Vec, stock: Stock) -> tuple[Flexibility, ...]:
        bearing = self.bearing_flexibilities(frame, coordinate, at)
        if self.stiffness is None:
            return bearing
        return (Flexibility(1 / self.stiffness, self.motion(frame, at), self.part), *bearing)
