"""Path files: poses to pass, and how fast (TOML, with units)."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from trivet.model.checked import read_checked
from trivet.model.quantity import (
    Acceleration,
    AngleValue,
    AngularAcceleration,
    AngularJerk,
    AngularSpeed,
    Duration,
    Jerk,
    Length,
    Speed,
)
from trivet.model.section import STRICT
from trivet.space.curve import Limits, Trajectory, straight, through, timed
from trivet.space.pose import zyz_frame

MOST_POSES = 10_000


@dataclass(frozen=True)
class GivenLimits:
    """How fast the platform may move; what is not given is as in `trivet.space.curve.Limits`."""

    __pydantic_config__ = STRICT

    speed: Speed | None = None
    acceleration: Acceleration | None = None
    jerk: Jerk | None = None
    angular_speed: AngularSpeed | None = None
    angular_acceleration: AngularAcceleration | None = None
    angular_jerk: AngularJerk | None = None

    def limits(self) -> Limits:
        """All of them."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        return Limits(**{name: value for name, value in given.items() if value is not None})


@dataclass(frozen=True)
class PathPose:
    """A pose to pass; angles that are not given are zero."""

    __pydantic_config__ = STRICT

    position: tuple[Length, Length, Length]
    azimuth: AngleValue = 0.0
    tilt: AngleValue = 0.0
    roll: AngleValue = 0.0


@dataclass(frozen=True)
class PathFile:
    """A path."""

    __pydantic_config__ = STRICT

    poses: Annotated[list[PathPose], Field(min_length=2, max_length=MOST_POSES)]
    """In their order; the first is where the path begins."""
    corners: Literal["smooth", "stop"] = "smooth"
    """Whether the platform passes the poses on a smooth way, or goes straight from each to the next and stops there."""
    limits: GivenLimits = GivenLimits()
    """How fast the platform may move."""
    duration: Duration | None = None
    """Of the whole motion, if it is to take longer than it must."""
    format: Literal[1] = 1
    """Version of the file format."""

    def trajectory(self, length: float) -> Trajectory:
        """The motion; `length` (m) compares turns with distances."""
        frames = [zyz_frame(p.position, p.azimuth, p.tilt, p.roll) for p in self.poses]
        if self.corners == "smooth":
            curves = [through(frames, length)]
        else:
            curves = [straight(start, end) for start, end in pairwise(frames)]
        return timed(curves, self.limits.limits(), self.duration)


def read_path(path: str | os.PathLike[str]) -> PathFile:
    """Read a path file.

    Raises:
        InputError: with the key, the value and what was expected.
    """
    return read_checked(path, PathFile, "a path file", {"poses": "a path has [[poses]] with a position each"})
