"""Platform poses: the frame {E} in {O}, R = Rz(alpha) Ry(beta) Rz(gamma)."""

from __future__ import annotations

from typing import Any

import numpy as np

from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar, mul, sub
from trivet.space.vector import Vec


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
