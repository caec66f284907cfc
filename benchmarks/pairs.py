"""Timing two calls in turn, so that a machine whose speed drifts does not decide the ratio."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

PAIRS = 21
CALLS = 20
"""Calls per timing.  The threads of numba's loop and of XLA spin for milliseconds after work; in strict turns each would be
timed against the other's idle spinning."""


@dataclass(frozen=True)
class Paired:
    """Times (s) of interleaved pairs."""

    ours: np.ndarray
    peer: np.ndarray

    @property
    def ratio(self) -> tuple[float, float, float]:
        """Median and quartiles of peer time over our time, pair by pair: how many times faster we are."""
        return tuple(float(q) for q in np.quantile(self.peer / self.ours, [0.5, 0.25, 0.75]))  # type: ignore[return-value]


def seconds(call: Callable[[], Any], calls: int) -> float:
    """Mean time of some calls in a row."""
    start = time.perf_counter()
    for _ in range(calls):
        call()
    return (time.perf_counter() - start) / calls


def paired(ours: Callable[[], Any], peer: Callable[[], Any], pairs: int = PAIRS, calls: int = CALLS) -> Paired:
    """Both calls warmed twice, then timed in turn; each must return only when its work is done."""
    for _ in range(2):
        ours()
        peer()
    times = np.array([(seconds(ours, calls), seconds(peer, calls)) for _ in range(pairs)])
    return Paired(times[:, 0], times[:, 1])
