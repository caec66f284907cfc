"""Joints whose travel is a cone: balls and cross joints, limited by where their stem touches the socket."""

from __future__ import annotations

from typing import Annotated, Literal

import equinox as eqx
from pydantic import Field

from trivet.model.elements.base import Axis, Joint
from trivet.model.quantity import AngleValue
from trivet.model.section import STRICT
from trivet.space.scalar import Scalar, cosine, sine


class Neutral(eqx.Module):
    """The axis of a socket, and what deviates from it."""

    __pydantic_config__ = STRICT

    axis: Axis = eqx.field(static=True)
    """Direction of the neutral axis, in the frame which its body has at the joint."""
    body: Literal["before", "beyond"] = eqx.field(static=True, default="beyond")
    """In which body it is fixed: that before the joint, nearer to the ground, or that beyond it."""
    stem: Axis | None = eqx.field(static=True, default=None)
    """Direction in the other body, in its frame at the joint; along the nearest beam or slide, and away, by default."""
    measure: Literal["deviation", "elevation"] = eqx.field(static=True, default="deviation")
    """What the cone limits: the angle from axis to stem, or the stem's elevation from the plane across the axis, both ways."""


class Socket(Joint):
    """A joint of several rotations which is limited by a cone."""

    cone: Annotated[
        AngleValue | None,
        Field(description="Greatest deviation of the stem from the neutral axis; not checked unless `neutral` gives that."),
    ] = eqx.field(default=None, kw_only=True)
    neutral: Annotated[
        Neutral | None, Field(description="The neutral axis of the cone; a source that gives a cone rarely says.")
    ] = eqx.field(default=None, kw_only=True)

    @property
    def is_angular(self) -> bool:
        """Its deviation is told as an angle."""
        return True

    @property
    def unit(self) -> Literal["m", "rad"]:
        """Unit of the deviation."""
        return "rad"

    @property
    def is_driven(self) -> bool:
        """No drive moves it."""
        return False

    @property
    def locked(self) -> float | None:
        """Nothing holds it."""
        return None

    @property
    def is_limited(self) -> bool:
        """Whether there is a cone, and a neutral axis."""
        return self.cone is not None and self.neutral is not None

    @property
    def limits(self) -> tuple[Scalar, Scalar] | None:
        """Lower and upper limit of the cosine of the deviation, or of the sine of the elevation."""
        if self.cone is None or self.neutral is None:
            return None
        if self.neutral.measure == "elevation":
            return -sine(self.cone), sine(self.cone)
        return cosine(self.cone), 2.0  # no deviation is too small
