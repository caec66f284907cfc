"""Families of poses that go with a machine: over its workpiece, along a path file, or of one pose alone."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.model import Machine
from trivet.space.family import Axis, Family, Places, over_hemisphere
from trivet.study.corners import corners_of, places_along, pose_along
from trivet.study.machines import LARGEST_ANGLE, MachineLike, choose
from trivet.study.pathfile import PathFile, read_path
from trivet.study.stiffness_map import workpiece_of

STEPS = 24
"""Steps of a path, unless said otherwise."""
MOST_STEPS = 100_000


def hemisphere_of(machine: Machine, steps: int = 10, radius: float | None = None, height: float | None = None) -> Family:
    """The machine's own workpiece hemisphere, or one given by radius and height of its centre (m).

    Raises:
        InputError: when the machine file has no workpiece and either number is missing.
    """
    return over_hemisphere(*workpiece_of(machine, radius, height), steps)


def one_pose(pose: Sequence[float]) -> Family:
    """A single pose as a family, roll included, for studies that seek nothing between its points.

    Args:
        pose: x, y, z, azimuth, tilt, roll; m and rad.

    Raises:
        InputError: for other than six finite numbers, or angles of many turns.
    """
    own = np.array(pose, dtype=float)
    if own.shape != (6,) or not np.all(np.isfinite(own)) or np.any(np.abs(own[3:]) > LARGEST_ANGLE):
        raise InputError("pose: expected (x, y, z, azimuth, tilt, roll), finite numbers in m and rad, angles of a few turns")

    def places(coordinates: NDArray[Any]) -> Places:
        there = np.where(coordinates == 0, own, np.nan)
        return Places(there[:, :3], there[:, 3], there[:, 4], there[:, 5])

    return Family("pose", np.zeros((1, 1)), np.ones(1), places, (Axis("pose"),), np.zeros_like)


def along_path(machine: MachineLike, path: PathFile | str | os.PathLike[str], steps: int = STEPS) -> Family:
    """Poses along a path, rolls included, which change evenly from each pose of the path to the next; the coordinate is 1 at
    the first pose of the path, 2 at the second, and so on.

    Args:
        machine: machine, name or file; its characteristic length compares turns with distances.
        path: the poses, or their file.
        steps: over the whole path, every pose of it being among the grid.

    Raises:
        InputError: for a path of one pose or without extent, or steps out of range.
    """
    if not 1 <= steps <= MOST_STEPS:
        raise InputError(f"steps: {steps} along a path; expected 1 to {MOST_STEPS}")
    corners = corners_of(path if isinstance(path, PathFile) else read_path(path))
    grid = np.array(places_along(corners, float(choose(machine).characteristic_length), steps))

    def places(coordinates: NDArray[Any]) -> Places:
        at = coordinates[:, 0]
        inside = (at >= 1) & (at <= len(corners))
        pose = np.where(inside[:, None], pose_along(corners, at), np.nan)
        return Places(pose[:, :3], pose[:, 3], pose[:, 4], pose[:, 5])

    axis = Axis("pose of the path")
    name, spacing = f"path of {len(corners)} poses", np.diff(grid).max(keepdims=True)
    return Family(name, grid[:, None], spacing, places, (axis,), lambda c: np.clip(c, 1, len(corners)))
