"""Platform poses: the frame {E} in {O}, R = Rz(alpha) Ry(beta) Rz(gamma) of the paper's Eq 1."""

from __future__ import annotations

from typing import Any

import numpy as np

from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar, mul, sub
from trivet.space.vector import Vec

UPRIGHT = 1e-12
"""Sine of the tilt below which azimuth and roll are one angle."""


def zyz_frame(position: Any, azimuth: Any, tilt: Any, roll: Any) -> Frame:
    """Pose frames from positions (..., 3) in m and the angles alpha, beta, gamma in rad, with NumPy; batch shapes broadcast.

    Kernels take the rotation's components: sines and cosines are cheap here and dear inside a fused loop.
    """
    p = np.asarray(position, dtype=float)
    normal, first, second = tangent_axes(azimuth, tilt)
    unrolled = Frame(Vec(p[..., 0], p[..., 1], p[..., 2]), first, second, normal)
    return rolled(unrolled, Angle(np.cos(roll), np.sin(roll)))


def tangent_axes(azimuth: Any, tilt: Any) -> tuple[Vec, Vec, Vec]:
    """Columns z, x, y of Rz(alpha) Ry(beta): the platform normal and the unrolled x and y axes."""
    ca, sa, cb, sb = np.cos(azimuth), np.sin(azimuth), np.cos(tilt), np.sin(tilt)
    zero = 0.0 * ca * cb
    return Vec(ca * sb, sa * sb, cb + zero), Vec(ca * cb, sa * cb, -sb + zero), Vec(-sa + zero, ca + zero, zero)


def rolled(frame: Frame, roll: Angle) -> Frame:
    """A pose turned about its own normal."""

    def mix(a: Scalar, b: Scalar, c: Scalar, s: Scalar) -> Scalar:
        return sub(mul(a, c), mul(-1, mul(b, s)))

    x = Vec(*(mix(a, b, roll.cos, roll.sin) for a, b in zip(frame.x, frame.y, strict=True)))
    y = Vec(*(mix(b, a, roll.cos, -roll.sin) for a, b in zip(frame.x, frame.y, strict=True)))
    return Frame(frame.origin, x, y, frame.z)


def zyz_angles(frame: Frame) -> tuple[Any, Any, Any]:
    """alpha, beta, gamma (rad) of R = Rz(alpha) Ry(beta) Rz(gamma), beta in [0, pi]; alpha is 0 where the axis is upright."""
    sine = np.hypot(frame.z.x, frame.z.y)
    upright = sine < UPRIGHT
    azimuth = np.where(upright, 0.0, np.arctan2(frame.z.y, frame.z.x))
    # With alpha = 0: x = (cos beta cos gamma, sin gamma, ...), y = (..., cos gamma, ...).
    roll = np.where(upright, np.arctan2(frame.x.y, frame.y.y), np.arctan2(frame.y.z, -np.asarray(frame.x.z)))
    return azimuth, np.arctan2(sine, frame.z.z), roll


def steady_angles(azimuth: Any, tilt: Any, roll: Any) -> tuple[Any, Any, Any]:
    """alpha, beta, gamma (n,) of the same poses in rad, such that they may change evenly from each pose to the next.

    Azimuth and roll go the shorter way round.  Where the platform is level, they are one angle: the azimuth is that of the last
    pose before it that leans, or else of the first one after it, and the roll makes up for it.
    """
    level = np.abs(np.sin(tilt)) < UPRIGHT
    leaning = np.flatnonzero(~level)
    if len(leaning):
        last = np.maximum(np.searchsorted(leaning, np.arange(len(tilt)), side="right") - 1, 0)
        led = azimuth[leaning[last]]
        # Upside down the roll turns against the azimuth.
        roll = np.where(level, roll + np.sign(np.cos(tilt)) * (azimuth - led), roll)
        azimuth = led
    return np.unwrap(azimuth), tilt, np.unwrap(roll)


def between(start: Frame, end: Frame, part: Any) -> Frame:
    """Poses on the straight way from one pose of floats to another, at parts (n,) of it from 0 to 1; components (n,)."""
    from scipy.spatial.transform import Rotation

    first, second = (Rotation.from_matrix(np.array(f.matrix(), dtype=float)) for f in (start, end))
    arc = (second * first.inv()).as_rotvec()
    columns = (Rotation.from_rotvec(np.multiply.outer(part, arc)) * first).as_matrix()
    place = np.asarray(start.origin, dtype=float) + np.multiply.outer(part, np.subtract(end.origin, start.origin, dtype=float))
    return Frame(Vec(*place.T), *(Vec(*columns[:, :, k].T) for k in range(3)))


def moved(frame: Frame, twist: Any) -> Frame:
    """A pose of floats after a finite motion (6,): the origin shifted (m), the axes turned by the rotation vector (rad)."""
    from scipy.spatial.transform import Rotation

    columns = (Rotation.from_rotvec(twist[3:]) * Rotation.from_matrix(np.array(frame.matrix(), dtype=float))).as_matrix().T
    return Frame(Vec(*(np.asarray(frame.origin, dtype=float) + twist[:3]).tolist()), *(Vec(*c) for c in columns.tolist()))
