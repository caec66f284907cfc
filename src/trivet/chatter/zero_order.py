"""Stability lobes of milling by the zero-order approach (Altintas and Budak, CIRP Annals 44:357, 1995).

Of the forces, periodic with the teeth, the mean is kept: F = a K_t D (u(t) - u(t - T)), T the time between teeth.  With the
receptance G in the cutting plane, and mu an eigenvalue of D G at a chatter frequency omega, the cut is at the limit where
a K_t (1 - exp(-i omega T)) mu = 1.  The numbers 1 - exp(-i eps) lie on the circle of radius 1 about 1, on which the argument
(pi - eps) / 2 belongs to the length 2 cos of it; so a depth is real where eps = pi + 2 arg(mu), modulo a turn, and it is
a = 1 / (2 K_t Re(mu)), a depth where Re(mu) > 0; there |arg(mu)| < pi / 2, so that eps lies within a turn.  With k whole waves
between teeth more, omega T = eps + 2 pi k: each pair of an eigenvalue and a k is a lobe, and k is omega T / 2 pi, rounded down.
(Their Lambda is -N / (4 pi mu); the limit is the same.)

At a given speed the limits are the places where (omega T - pi - 2 arg mu) / 2 pi passes a whole number.  This function is
continuous along a branch of the eigenvalue, whatever the sign of Re(mu), so no lobe and no crossing of lobes is missed between
the frequencies of a grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from trivet.chatter.cut import Cut

FINER = 4
"""Frequencies of the branches per frequency of the receptance, which is smooth between its own."""
AT_ONCE = 4_000_000
"""Values that are looked at together: 32 MB."""


@dataclass(frozen=True)
class Branches:
    """Eigenvalues of the oriented receptance over frequency, each a continuous curve."""

    omega: np.ndarray
    """(f,) rad/s."""
    gain: np.ndarray
    """(2, f): 2 K_t Re(mu), the inverse of a depth, 1/m."""
    phase: np.ndarray
    """(2, f): pi + 2 arg(mu), without jumps, rad."""


@dataclass(frozen=True)
class Limits:
    """The stable depth of cut over spindle speed."""

    depth: np.ndarray
    """(n,) m; infinite where no chatter frequency of the range limits it."""
    frequency: np.ndarray
    """(n,) chatter frequency, Hz; NaN where there is none."""
    waves: np.ndarray
    """(n,): k, whole waves between teeth; -1 where there is none."""


def branches(cut: Cut, frequency: np.ndarray, receptance: np.ndarray) -> Branches:
    """The eigenvalues of a cut.

    Args:
        cut: the cut.
        frequency: (f,) rising, Hz; near enough to each other for a smooth curve through resonances.
        receptance: (f, 2, 2) in the cutting plane at these, m/N.
    """
    steps = np.arange(len(frequency))
    fine = np.interp(np.arange((len(frequency) - 1) * FINER + 1) / FINER, steps, frequency)
    product = cut.directional @ CubicSpline(frequency, receptance)(fine)
    half = (product[:, 0, 0] + product[:, 1, 1]) / 2
    root = np.sqrt(half**2 - np.linalg.det(product) + 0j)
    # The square root jumps at its cut; along a branch it does not.
    turned = np.r_[1.0, np.where((root[1:] * np.conj(root[:-1])).real < 0, -1.0, 1.0)]
    root = root * np.cumprod(turned)
    values = np.stack([half + root, half - root])
    return Branches(2 * math.pi * fine, 2 * cut.tangential * values.real, math.pi + 2 * np.unwrap(np.angle(values), axis=1))


def limits(cut: Cut, found: Branches, speeds: np.ndarray) -> Limits:
    """The least depth of all lobes at spindle speeds (n,), rad/s."""
    each = max(1, AT_ONCE // found.gain.size)
    parts = [_limits(cut, found, speeds[start : start + each]) for start in range(0, len(speeds), each)]
    return Limits(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _limits(cut: Cut, found: Branches, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    delay = 2 * math.pi / (cut.teeth * speeds)
    turns = (delay[:, None, None] * found.omega - found.phase) / (2 * math.pi)
    first, second = turns[..., :-1], turns[..., 1:]
    # Of the whole numbers between two frequencies the one nearest to the greater gain has the least depth.
    rises = found.gain[:, 1:] >= found.gain[:, :-1]
    far, near = np.where(rises, first, second), np.where(rises, second, first)
    whole = np.where(near >= far, np.floor(near), np.ceil(near))
    step = near - far
    part = (whole - far) / np.where(step == 0, math.nan, step)
    weak, strong = np.minimum(found.gain[:, 1:], found.gain[:, :-1]), np.maximum(found.gain[:, 1:], found.gain[:, :-1])
    gain = np.where(part >= 0, weak + part * (strong - weak), 0.0)
    best = np.argmax(gain.reshape(len(speeds), -1), axis=1)
    branch, segment = np.divmod(best, len(found.omega) - 1)
    chosen = (np.arange(len(speeds)), branch, segment)
    most, along = gain[chosen], np.where(rises[branch, segment], part[chosen], 1 - part[chosen])
    omega = found.omega[segment] + along * (found.omega[segment + 1] - found.omega[segment])
    has = most > 0
    depth = np.full(len(speeds), math.inf)
    depth[has] = 1 / most[has]
    # Not `whole`: the branch may have wound round the origin, and then its phase is not within the turn from which waves count.
    frequency = np.where(has, omega / (2 * math.pi), math.nan)
    return depth, frequency, np.where(has, np.floor(frequency * delay), -1).astype(int)


def lowest(found: Branches) -> tuple[float, float]:
    """The depth (m) that is stable at every spindle speed, and the chatter frequency (Hz) above it.

    Some speed meets the greatest gain, so that decides.  Infinite and NaN where no frequency limits the depth.
    """
    branch, at = np.unravel_index(int(np.argmax(found.gain)), found.gain.shape)
    if found.gain[branch, at] <= 0:
        return math.inf, math.nan
    return 1 / float(found.gain[branch, at]), float(found.omega[at]) / (2 * math.pi)
