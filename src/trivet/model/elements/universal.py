"""Universal joint."""

from __future__ import annotations

from typing import Literal

import equinox as eqx

from trivet.model.elements.base import Axis, Flexibility, Stock
from trivet.model.elements.socket import Socket
from trivet.model.quantity import RotationalDamping, RotationalFriction
from trivet.space.frame import Angle, Frame
from trivet.space.screw import Twist, rotation
from trivet.space.vector import Vec


class Universal(Socket):
    """A cross joint: two hinges in succession, at right angles; its coordinates are the two angles."""

    COORDINATES = ("angle", "angle")

    type: Literal["universal"] = eqx.field(static=True)
    axes: tuple[Axis, Axis] = eqx.field(static=True)
    """First and second axis, in the frame at zero angles."""
    damping: RotationalDamping | None = eqx.field(default=None, kw_only=True)
    """Viscous damping about every axis; none when not given."""
    friction: RotationalFriction | None = eqx.field(default=None, kw_only=True)
    """Coulomb friction about either axis; none when not given."""

    def advance(self, frame: Frame, coordinate: tuple[Angle, Angle]) -> Frame:
        return frame.turn(self.axes[0], coordinate[0]).turn(self.axes[1], coordinate[1])

    def freedoms(self, frame: Frame, coordinate: tuple[Angle, Angle], at: Vec) -> tuple[Twist, ...]:
        turned = frame.turn(self.axes[0], coordinate[0])
        return (
            rotation(frame.direction(self.axes[0]), frame.origin, at),
            rotation(turned.direction(self.axes[1]), frame.origin, at),
        )

    def slack(self, frame: Frame, coordinate: tuple[Angle, Angle], at: Vec) -> tuple[Twist, ...]:
        return self.freedoms(frame, coordinate, at)

    def flexibilities(self, frame: Frame, coordinate: tuple[Angle, Angle], at: Vec, stock: Stock) -> tuple[Flexibility, ...]:
        return self.bearing_flexibilities(frame, coordinate, at)
