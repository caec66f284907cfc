"""Curvilinear joint: a prismatic joint on a circular guide (the paper's P with coordinate theta)."""

from __future__ import annotations

from typing import Literal

import equinox as eqx

from trivet.model.elements.base import Drivable, Flexibility, Stock
from trivet.model.quantity import AngleValue, Damping, Friction, Mass, PositiveLength, Stiffness
from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist, rotation, translation
from trivet.space.vector import Vec


class Curvilinear(Drivable):
    """A carriage on a circular guide about the frame's z axis; its coordinate is the angle on the circle."""

    COORDINATES = ("angle",)

    type: Literal["curvilinear"] = eqx.field(static=True)
    radius: PositiveLength
    """Radius of the guide circle."""
    travel: tuple[AngleValue, AngleValue] | None = eqx.field(default=None, kw_only=True)
    """Range of the angle; all round when not given."""
    stiffness: Stiffness | None = eqx.field(default=None, kw_only=True)
    """Stiffness of drive and carriage along the guide; rigid when not given."""
    damping: Damping | None = eqx.field(default=None, kw_only=True)
    """Viscous damping along the guide; none when not given."""
    friction: Friction | None = eqx.field(default=None, kw_only=True)
    """Coulomb friction along the guide; none when not given."""
    reflected_inertia: Mass | None = eqx.field(default=None, kw_only=True)
    """Inertia of motor and gear as it is felt along the guide, J / r^2 of a pinion; none when not given."""
    locked: AngleValue | None = eqx.field(default=None, kw_only=True)
    """Angle at which the joint is held while the machine works; free when not given."""
    yields: Literal["translation", "rotation"] = eqx.field(static=True, default="translation")
    """How the carriage gives way: straight along the tangent, or along the circle (turning with it)."""

    def advance(self, frame: Frame, coordinate: Angle) -> Frame:
        return frame.turn((0.0, 0.0, 1.0), coordinate).shift((self.radius, 0, 0))

    def motion(self, frame: Frame, at: Vec) -> Twist:
        return rotation(frame.z, frame.origin, at)

    @property
    def viscosity(self) -> float | None:
        straight = self.stiffness is not None and self.yields == "translation"
        return self.damping if straight or self.damping is None else self.damping * self.lever * self.lever

    @property
    def lever(self) -> Scalar:
        return self.radius

    def flexibilities(self, frame: Frame, coordinate: Angle, at: Vec, stock: Stock) -> tuple[Flexibility, ...]:
        bearing = self.bearing_flexibilities(frame, coordinate, at)
        if self.stiffness is None:
            return bearing
        if self.yields == "rotation":
            rate = self.stiffness * self.radius * self.radius
            return (Flexibility(1 / rate, self.motion(frame, at), self.part), *bearing)
        tangent = frame.turn((0.0, 0.0, 1.0), coordinate).y
        return (Flexibility(1 / self.stiffness, translation(tangent), self.part), *bearing)

    def bearing_flexibilities(self, frame: Frame, coordinate: Angle, at: Vec) -> tuple[Flexibility, ...]:
        # The bearing is that of the carriage, on the circle.
        return () if self.bearing is None else self.bearing.flexibilities(self.advance(frame, coordinate), at)
