"""Where a machine cuts: the cutting plane at the tool point, and how it gives way there.

The tool leaves the platform along its normal z_E or against it, as the machine file says: towards `platform.tool_tip`.  Where
the tip does not tell, since there is none or it lies in the plane of the platform joints, the tool points to the workpiece,
which a platform that is tangent to it, as in maps and plans, has at -z_E.  The spindle turns clockwise as seen from the
platform along the tool, as most do.

In the cutting plane x is the feed, at an angle from the direction of growing tilt, the x axis of the roll-free frame
Rz(alpha) Ry(beta), so that the roll does not move it; the angle is counted about z_E.  The axis y is the cross product of x and
the tool, so that the cutter turns from y to x.  With z from the tip to the platform, against the tool, (x, y, z) is
right-handed, and seen from +z teeth turn clockwise, as in the literature of chatter.  A tool the other way would turn y round,
and with it the sign of G_xy and G_yx.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.space.pose import tangent_axes, zyz_angles
from trivet.statics.structure import carry
from trivet.vibration.places import point_of_platform


class ToolPoint(NamedTuple):
    """The point of a platform at which a cutter cuts."""

    place: str
    """"tool", the tip; or "platform", its centre, where the machine has no `platform.tool_tip`."""
    side: float
    """1 where the tool leaves the platform along z_E, -1 where against it."""
    axes: np.ndarray
    """(2, 3): unit vectors of the feed and of y, in {O}."""
    rows: np.ndarray
    """(2, 6): displacements along these at the point, from the twist of the platform centre in {O}."""

    def oriented(self, receptance: np.ndarray) -> np.ndarray:
        """(..., 2, 2) in the cutting plane, m/N, from receptances (..., 6, 6) at the platform centre in {O}."""
        plane: np.ndarray = self.rows @ receptance @ self.rows.T
        return plane


def tool_point(machine: Machine, pose: Frame, feed: float = 0.0, azimuth: float | None = None) -> ToolPoint:
    """The tool point of a machine at a pose.

    Args:
        machine: the machine.
        pose: platform frame {E} in {O}, m; numbers.
        feed: angle (rad) about z_E from the direction of growing tilt to the way of the tool against the workpiece.
        azimuth: alpha of the pose (rad); where the tilt is zero the frame does not tell it, and it is taken as 0 then.

    Raises:
        InputError: when the machine file does not say to which side the tool points.
    """
    alpha, beta, _ = zyz_angles(pose)
    normal, first, second = (np.array(axis, dtype=float) for axis in tangent_axes(alpha if azimuth is None else azimuth, beta))
    place = "platform" if machine.platform.tool_tip is None else "tool"
    side = side_of(machine)
    along = math.cos(feed) * first + math.sin(feed) * second
    axes = np.stack([along, np.cross(along, side * normal)])
    arm = point_of_platform(machine, pose, place) - np.array([float(c) for c in pose.origin])
    return ToolPoint(place, side, axes, axes @ carry(arm)[:3])


def side_of(machine: Machine) -> float:
    """1 where the tool of a machine leaves the platform along z_E, -1 where against it.

    Raises:
        InputError: when neither a tool tip nor a workpiece tells.
    """
    tip = machine.platform.tool_tip
    if tip is not None and float(tip[2]) != 0:
        return math.copysign(1.0, float(tip[2]))
    if machine.workpiece is not None:
        return -1.0
    raise InputError(
        f"{machine.name}: nothing tells on which side of the platform the tool is; give platform.tool_tip, off the plane of "
        "the platform joints, or a workpiece"
    )
