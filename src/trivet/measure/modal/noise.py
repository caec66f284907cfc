"""How noisy measured functions are, from what a fit leaves: the variance of each is a + b |H|^2.

The first part is what sensors and converters add, the second what grows with the response (leakage, amplitude, averaging).
Both are found by the multiplicative updates of Fevotte, Bertin, Durrieu, Neural Computation 21 (2009) 793 (Itakura-Saito
divergence), which is the likelihood of complex normal errors; what a fit takes away from errors, line by line, is put back
(restricted likelihood).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

ROUNDS = 60
GROWS = 2.33
"""Standard deviations that speak for noise which grows with the response, in all functions together: without any, twice the
logarithm of the likelihood gains 1/2 by it a function, with a variance of 5/4 (Chernoff, Ann. Math. Stat. 25 (1954) 573)."""
_FLOOR = 1e-9
"""Least standard deviation, as a part of the root mean square of a function: what is exact needs some weight too."""


class Noise(NamedTuple):
    """Of every function, in its own unit."""

    added: np.ndarray
    """(o, i) variance a of the complex error; NaN where nothing was measured."""
    relative: np.ndarray
    """(o, i) b, variance per square of the magnitude."""

    def variance(self, size: np.ndarray) -> np.ndarray:
        """(o, i, n) at magnitudes (o, i, n)."""
        return self.added[:, :, None] + self.relative[:, :, None] * size**2


def estimated(errors: np.ndarray, size: np.ndarray, leverage: np.ndarray, start: Noise | None = None) -> Noise:
    """Both parts from errors and magnitudes (o, i, n); leverage (o, i, n) is the part of every error that the fit took.

    Where nothing speaks for the second part it is nought: as no variance is found below nought, functions would have some of it
    on the average, and most of it on the resonances.
    """
    power, square, free = np.abs(errors) ** 2, size**2, 1 - np.clip(leverage, 0, 0.95)
    mean = square.mean(axis=-1)
    floor = _FLOOR**2 * mean
    level = np.maximum(power.sum(axis=-1) / free.sum(axis=-1), floor)
    if start is None or not start.relative.any():
        start = Noise(0.5 * level, 0.5 * level / np.where(mean > 0, mean, 1))
    added, relative = start
    for _ in range(ROUNDS):
        inverse = 1 / (np.maximum(added, floor)[..., None] + relative[..., None] * square)
        surprise, expected = power * inverse**2, free * inverse
        added = added * surprise.sum(-1) / expected.sum(-1)
        relative = relative * (surprise * square).sum(-1) / np.maximum((expected * square).sum(-1), np.finfo(float).tiny)
    found = Noise(np.maximum(added, floor), relative)
    flat = Noise(level, np.zeros_like(level))
    gain = 2 * (_unlikeliness(flat, power, size, free) - _unlikeliness(found, power, size, free))[level > floor]
    return found if gain.sum() > len(gain) / 2 + GROWS * math.sqrt(1.25 * len(gain)) else flat


def _unlikeliness(noise: Noise, power: np.ndarray, size: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(o, i) minus the logarithm of the restricted likelihood."""
    variance = noise.variance(size)
    found: np.ndarray = np.sum(free * np.log(variance) + power / variance, axis=-1)
    return found
