"""Spherical joint."""

from __future__ import annotations

from typing import Literal

import equinox as eqx

from trivet.model.elements.base import Flexibility, Stock
from trivet.model.elements.socket import Socket
from trivet.model.quantity import RotationalDamping, RotationalFriction, RotationalStiffness
from trivet.space.frame import Angle, Frame, Turn
from trivet.space.screw import Twist, rotation
from trivet.space.vector import Vec

_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Spherical(Socket):
    """A ball joint; its coordinates are three successive turns about x, y and z of the frame, or one rotation."""

    COORDINATES = ("angle", "angle", "angle")

    type: Literal["spherical"] = eqx.field(static=True)
    rotation: Literal["free", "clamped", "elastic"] = eqx.field(static=True, default="free")
    """In statics: free (transmits three forces), clamped (transmits moments too, as in the paper's tables), or elastic."""
    stiffness: RotationalStiffness | None = None
    """Rotational stiffness about every axis, of an elastic joint."""
    damping: RotationalDamping | None = eqx.field(default=None, kw_only=True)
    """Viscous damping about every axis; none when not given."""
    friction: RotationalFriction | None = eqx.field(default=None, kw_only=True)
    """Coulomb friction about the axis on which the ball turns; none when not given."""

    def advance(self, frame: Frame, coordinate: tuple[Angle, Angle, Angle] | Turn) -> Frame:
        if isinstance(coordinate, Turn):
            return frame.turned_by(coordinate)
        for axis, angle in zip(_AXES, coordinate, strict=True):
            frame = frame.turn(axis, angle)
        return frame

    def freedoms(self, frame: Frame, coordinate: tuple[Angle, Angle, Angle] | Turn | None, at: Vec) -> tuple[Twist, ...]:
        # Any three axes span the freedoms of a ball; those in which the walk is written keep their zeros.
        return tuple(rotation(Vec(*axis), frame.origin, at) for axis in _AXES)

    def slack(self, frame: Frame, coordinate: tuple[Angle, Angle, Angle] | Turn | None, at: Vec) -> tuple[Twist, ...]:
        return self.freedoms(frame, coordinate, at) if self.rotation == "free" else ()

    def flexibilities(
        self, frame: Frame, coordinate: tuple[Angle, Angle, Angle] | Turn | None, at: Vec, stock: Stock
    ) -> tuple[Flexibility, ...]:
        bearing = self.bearing_flexibilities(frame, coordinate, at)
        if self.rotation != "elastic":
            return bearing
        assert self.stiffness is not None, "checked when the file is read"
        turning = (Flexibility(1 / self.stiffness, twist, "joint") for twist in self.freedoms(frame, coordinate, at))
        return (*turning, *bearing)
