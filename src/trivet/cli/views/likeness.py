"""Criteria of likeness as people read them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from trivet.measure.correlation import mean


def criterion(value: float) -> str:
    """Four decimals; nothing where it is not defined."""
    return "" if math.isnan(value) else f"{value:.4f}"


def criteria(values: Sequence[np.ndarray], number: int) -> list[str]:
    """Those of one function, from arrays (q,) of several criteria."""
    return [criterion(float(own[number])) for own in values]


def means(values: Sequence[np.ndarray]) -> list[str]:
    """Each in the mean."""
    return [criterion(mean(own)) for own in values]
