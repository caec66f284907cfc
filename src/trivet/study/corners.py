"""A path as a polygon in its coordinates: centre, azimuth, tilt and roll change evenly between its poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.space.pose import steady_angles
from trivet.study.pathfile import PathFile

Array = NDArray[Any]

STILL = 1e-9
"""Change of a coordinate (m or rad) that is none."""


def corners_of(path: PathFile) -> Array:
    """(c, 6): the poses of a path as they are gone through, centre (m), azimuth, tilt and roll (rad).

    Raises:
        InputError: for less than two poses, or a pose that is the one before.
    """
    if len(path.poses) < 2:
        raise InputError(f"poses: {len(path.poses)} of a path; expected at least 2")
    place = np.array([pose.position for pose in path.poses], dtype=float)
    angles = steady_angles(*np.array([(pose.azimuth, pose.tilt, pose.roll) for pose in path.poses], dtype=float).T)
    corners = np.column_stack([place, *angles])
    for k, change in enumerate(np.abs(np.diff(corners, axis=0)).max(axis=1)):
        if not change > STILL:
            raise InputError(f"poses: the pose {k + 2} of the path is where the pose {k + 1} is; leave one of them out")
    return corners


def pose_along(corners: Array, place: Any) -> Array:
    """(..., 6): poses at places along a path of corners (c, 6), 1 being the first."""
    known = np.arange(1, len(corners) + 1)
    return np.stack([np.interp(place, known, column) for column in corners.T], axis=-1)


def places_along(corners: Array, length: float, steps: int) -> list[float]:
    """Places along a path of corners (c, 6), so many steps or a few more of about the same size, every corner among them.

    The length (m) compares turns with distances.
    """
    change = np.abs(np.diff(corners, axis=0))
    moved = np.linalg.norm(change[:, :3], axis=1) / (length or 1.0)
    size = np.maximum(moved, change[:, 3:].max(axis=1))
    counts = np.maximum(np.ceil(steps * size / size.sum() - STILL), 1).astype(int)
    return [1.0] + [1 + k + float(part) / count for k, count in enumerate(counts) for part in range(1, count + 1)]
