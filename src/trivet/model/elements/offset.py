"""Offset: a rigid body between two places of a chain."""

from __future__ import annotations

from typing import Literal

import equinox as eqx

from trivet.model.elements.base import Body
from trivet.model.quantity import Length, Mass
from trivet.space.frame import Frame


class Offset(Body):
    """A rigid step along the frame's x, y and z axes."""

    type: Literal["offset"] = eqx.field(static=True)
    vector: tuple[Length, Length, Length]
    """The step."""
    mass: Mass | None = None
    """Mass, taken half at either end."""

    def advance(self, frame: Frame, coordinate: None = None) -> Frame:
        return frame.shift(self.vector)
