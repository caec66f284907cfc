"""What is told of measured responses beside a machine, whether it is corrected or not."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from trivet.errors import nearest
from trivet.measure.correlation import mean
from trivet.measure.machine.setup import Placed


def criterion(value: float) -> str:
    """Four decimals; nothing where it is not defined."""
    return "" if math.isnan(value) else f"{value:.4f}"


def criteria(values: Sequence[np.ndarray], number: int) -> list[str]:
    """Those of one function, from arrays (q,) of several criteria."""
    return [criterion(float(own[number])) for own in values]


def means(values: Sequence[np.ndarray]) -> list[str]:
    """Each in the mean."""
    return [criterion(mean(own)) for own in values]


def idle(at: Placed) -> Iterator[str]:
    """Points of the set-up that were not measured: a name may be misspelt."""
    for point in at.idle:
        yield f"points.{point} of the set-up: no function has this point{nearest(point, at.sites)}"
