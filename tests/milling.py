"""Milling simulated in time, tooth by tooth: an independent witness of what is said of chatter; NumPy alone.

Modes of unit modal mass, q'' + 2 zeta omega q' + omega^2 q = U^T F, by central differences; the force of every tooth in the
material from what the tool's displacement, now and one tooth before, adds to its chip.  The chip of the feed is left out, and
so is that a tooth which leaves the chip has no force: what is left is linear, and grows or dies away whatever its size.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, Any]

PER_WAVE = 70
"""Steps of the shortest wave."""


class Tool(NamedTuple):
    """Modes of a tool."""

    omega: Array
    """(m,) rad/s."""
    zeta: Array
    """(m,)."""
    shapes: Array
    """(2, m) along feed and normal, 1/sqrt(kg)."""


class Teeth(NamedTuple):
    """What cuts."""

    count: int
    entry: float
    """rad, from the normal of the feed, towards the feed."""
    leave: float
    tangential: float
    """Pa."""
    ratio: float


def growth(tool: Tool, teeth: Teeth, speeds: Array, depths: Array, periods: int = 300, per_wave: int = PER_WAVE) -> Array:
    """(n,) mean growth of the logarithm of the amplitude per tooth, over the second half of a run.

    Args:
        tool, teeth: what cuts.
        speeds: (n,) spindle speeds, rad/s.
        depths: (n,) m.
        periods: teeth that pass.
        per_wave: steps of the shortest wave; the error falls with their square.
    """
    delays = 2 * math.pi / (teeth.count * speeds)
    steps = max(300, math.ceil(per_wave * float(tool.omega.max() * delays.max()) / (2 * math.pi)))
    step = (delays / steps)[:, None]
    damped = tool.zeta * tool.omega * step
    stiff, before, after = 2 - (tool.omega * step) ** 2, 1 - damped, 1 / (1 + damped)
    push = teeth.tangential * depths[:, None] * step**2
    now = np.ones((len(speeds), len(tool.omega)))
    last = now.copy()
    waves = np.zeros((steps, len(speeds), 2))
    energy = np.zeros((periods, len(speeds)))
    turn = 2 * math.pi / teeth.count / steps
    matrices = [force(teeth, turn * (k - 0.5), turn * (k + 0.5)) for k in range(steps)]
    for period in range(periods):
        for k, matrix in enumerate(matrices):
            seen = now @ tool.shapes.T
            following = stiff * now - before * last
            if matrix is not None:
                following += push * (((seen - waves[k]) @ matrix.T) @ tool.shapes)
            waves[k] = seen
            last, now = now, following * after
        energy[period] = (waves**2).sum(axis=(0, 2))
        large = energy[period] > 1e100
        if large.any():  # linear: smaller, and it goes on as it did
            now[large], last[large], waves[:, large] = (part * 1e-50 for part in (now[large], last[large], waves[:, large]))
            energy[: period + 1, large] *= 1e-100
    half, window = periods // 2, periods // 6
    first, second = energy[half : half + window].mean(axis=0), energy[-window:].mean(axis=0)
    rate: Array = np.log(second / first) / 2 / (periods - window - half)
    return rate


def force(teeth: Teeth, low: float, high: float, samples: int = 40) -> Array | None:
    """(2, 2) mean force of all teeth, over displacement and specific force, while the first turns from low to high (rad)."""
    turned = low + (high - low) * (np.arange(samples) + 0.5) / samples
    phi = ((turned[:, None] + 2 * math.pi / teeth.count * np.arange(teeth.count)) % (2 * math.pi)).ravel()
    phi = phi[(teeth.entry <= phi) & (phi < teeth.leave)]
    if not len(phi):
        return None
    chip = np.array([np.sin(phi), np.cos(phi)])
    against = np.array([-np.cos(phi), np.sin(phi)])
    return (against - teeth.ratio * chip) @ chip.T / samples
