"""The paper's machine in plain NumPy, every working mode, after physics and not after trivet: a witness for plans."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

PLATFORM, GUIDE, STROKE, LOWEST, HIGHEST = 0.018, 0.162, 0.065, np.radians(5), np.radians(70)


class Met(NamedTuple):
    """What is met at poses (n,)."""

    closes: np.ndarray
    inside: np.ndarray
    sigma: np.ndarray
    determinant: np.ndarray
    heading: np.ndarray
    """(n, 3) azimuths of the carriages, rad."""


def rotation(azimuth: np.ndarray, tilt: np.ndarray, roll: np.ndarray) -> np.ndarray:
    """Rz(azimuth) Ry(tilt) Rz(roll), (n, 3, 3)."""

    def about_z(angle: np.ndarray) -> np.ndarray:
        c, s, o = np.cos(angle), np.sin(angle), 0 * angle
        return np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, o + 1]]), -1, 0)

    c, s, o = np.cos(tilt), np.sin(tilt), 0 * tilt
    about_y = np.moveaxis(np.array([[c, o, s], [o, o + 1, o], [-s, o, c]]), -1, 0)
    return about_z(azimuth) @ about_y @ about_z(roll)


def met(position: np.ndarray, turn: np.ndarray, mode: str, length: float) -> Met:
    """What is met at platform centres (n, 3) and rotations (n, 3, 3)."""
    rows, headings = [], []
    closes, inside = np.ones(len(position), dtype=bool), np.ones(len(position), dtype=bool)
    for k, signs in enumerate(mode.split()):
        side, elbow = (1.0 if s == "+" else -1.0 for s in signs)
        arm = turn @ np.array([PLATFORM * np.cos(2 * np.pi * k / 3), PLATFORM * np.sin(2 * np.pi * k / 3), 0.0])
        joint = position + arm
        out = np.hypot(joint[:, 0], joint[:, 1])
        radial = np.stack([joint[:, 0], joint[:, 1], 0 * out], axis=1) / out[:, None] * side
        rho, sine = side * out, joint[:, 2] / length
        closes &= np.abs(sine) < 1
        cosine = elbow * np.sqrt(np.maximum(1 - sine**2, 0))
        drive, angle = rho + length * cosine, np.arctan2(sine, cosine)
        inside &= (drive >= GUIDE) & (drive <= GUIDE + STROKE) & (angle >= LOWEST) & (angle <= HIGHEST)
        up = np.array([0.0, 0.0, 1.0])
        tangent, link = np.cross(up, radial), -cosine[:, None] * radial + sine[:, None] * up
        rows += [np.concatenate([v, np.cross(arm, v) / PLATFORM], axis=1) for v in (tangent, link)]
        headings.append(np.arctan2(radial[:, 1], radial[:, 0]))
    matrix = np.stack(rows, axis=1)
    values = np.linalg.svd(matrix, compute_uv=False)[:, -1]
    return Met(closes, inside, values, np.linalg.det(matrix), np.stack(headings, axis=1))
