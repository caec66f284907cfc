"""How a variable is spread: from points of the unit interval to values, and back to bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

FARTHEST = 1e-12
"""Probability beyond which the tails of a normal distribution are cut off, 7 standard deviations from its middle."""


class Law(Protocol):
    """A distribution of one variable."""

    @property
    def low(self) -> float:
        """Least value, SI."""

    @property
    def high(self) -> float:
        """Greatest value, SI."""

    @property
    def middle(self) -> float:
        """The median, SI."""

    @property
    def deviation(self) -> float:
        """Standard deviation, SI."""

    def deviation_at(self, value: float) -> float:
        """The deviation that goes with a slope at a value: of what spans decades, that of its logarithm times the value."""

    def values(self, points: Array) -> Array:
        """Quantiles (n,) at points (n,) of the unit interval."""


@dataclass(frozen=True)
class Uniform:
    """Between two bounds."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    @property
    def deviation(self) -> float:
        return (self.high - self.low) / math.sqrt(12)

    def deviation_at(self, value: float) -> float:
        return self.deviation

    def values(self, points: Array) -> Array:
        # Of both ends, so that neither is missed by rounding.
        return self.low * (1 - points) + self.high * points


@dataclass(frozen=True)
class LogUniform:
    """Between two bounds above zero, its logarithm uniform."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return math.sqrt(self.low * self.high)

    @property
    def deviation(self) -> float:
        width = math.log(self.high / self.low)
        if width == 0:
            return 0.0
        mean = (self.high - self.low) / width
        return math.sqrt(max((self.high**2 - self.low**2) / (2 * width) - mean**2, 0.0))

    def deviation_at(self, value: float) -> float:
        # A straight line in the logarithm tells more than one in the value.
        return value * math.log(self.high / self.low) / math.sqrt(12)

    def values(self, points: Array) -> Array:
        found: Array = np.exp(math.log(self.low) * (1 - points) + math.log(self.high) * points)
        return np.clip(found, self.low, self.high)


@dataclass(frozen=True)
class Normal:
    """About a value."""

    middle: float
    deviation: float

    @property
    def low(self) -> float:
        return float(self.values(np.zeros(1))[0])

    @property
    def high(self) -> float:
        return float(self.values(np.ones(1))[0])

    def deviation_at(self, value: float) -> float:
        return self.deviation

    def values(self, points: Array) -> Array:
        from scipy.special import ndtri

        return self.middle + self.deviation * ndtri(np.clip(points, FARTHEST, 1 - FARTHEST))


@dataclass(frozen=True)
class Choices:
    """One of several, by its number, each as likely as the others."""

    count: int

    @property
    def low(self) -> float:
        return 0.0

    @property
    def high(self) -> float:
        return self.count - 1.0

    @property
    def middle(self) -> float:
        return float((self.count - 1) // 2)

    @property
    def deviation(self) -> float:
        return math.sqrt((self.count**2 - 1) / 12)

    def deviation_at(self, value: float) -> float:
        return self.deviation

    def values(self, points: Array) -> Array:
        found: Array = np.minimum(np.floor(points * self.count), self.count - 1)
        return found
