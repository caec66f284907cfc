"""Offset: a rigid body between two places of a chain."""

from __future__ import annotations

from typing import Literal

import equinox as eqx

from trivet.model.elements.base import Body, Stock
from trivet.model.mass import RigidMass, point_mass
from trivet.model.quantity import Length, Mass
from trivet.space.frame import Frame
from trivet.space.vector import ZERO, Vec


class Offset(Body):
    """A rigid step along the frame's x, y and z axes."""

    type: Literal["offset"] = eqx.field(static=True)
    vector: tuple[Length, Length, Length]
    """The step."""
    mass: Mass | None = None
    """Mass, taken half at either end."""

    def weigh(self, stock: Stock) -> RigidMass:
        if self.mass is None:
            return RigidMass.none()
        half = self.mass / 2
        return point_mass(half, ZERO).plus(point_mass(half, -Vec(*self.vector)))

    def advance(self, frame: Frame, coordinate: None = None) -> Frame:
        return frame.shift(self.vector)
