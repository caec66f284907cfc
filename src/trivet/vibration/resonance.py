"""Peaks of a response over frequency, found to rounding: the minimum of the dynamic stiffness is a minimum."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError

POINTS = 24
"""Frequencies per refinement, which is what the exact path does at once."""
NARROWEST = 1e-9
"""Width of a bracket, against its frequency, at which refinement ends."""
CONTENDERS = 2.0
"""Peaks of the grid that reach the greatest divided by this are refined."""
MOST = 60
"""Peaks of the grid that are refined at most: where a response is flat to rounding every other frequency is one."""
SHARPEST = 1e-3
"""Loss factor below which a grid grows no finer: what shows of a narrower peak is its flank."""


FAINTEST = 1e-8
"""Loss factor below which rounding decides how high a peak is."""


class Peak(NamedTuple):
    """Where a response is greatest."""

    frequency: float
    """Hz."""
    size: float


def check_damping(loss_factor: float) -> None:
    """Refuse the least damping there is where it leaves peaks no height."""
    if not loss_factor >= FAINTEST:
        raise InputError(
            f"loss factor: {loss_factor:g}; expected {FAINTEST:g} or more: a peak has a height only with damping above zero"
        )


def grid(low: float, high: float, loss_factor: float) -> np.ndarray:
    """Frequencies (n,) from low to high (Hz) on which no resonance of this damping hides: four across its half-power width
    (but see `SHARPEST`)."""
    if not 0 < low < high:
        raise InputError(f"frequencies: {low:g} Hz to {high:g} Hz; expected a range that rises from above 0 Hz")
    check_damping(loss_factor)
    count = int(np.ceil(np.log(high / low) / (max(loss_factor, SHARPEST) / 4))) + 2
    return np.geomspace(low, high, count)


def greatest(size: Callable[[np.ndarray], np.ndarray], low: float, high: float, loss_factor: float) -> list[Peak]:
    """The greatest values of k responses over a range of frequencies.

    Args:
        size: gives (n, k) magnitudes at (n,) frequencies (Hz).
        low, high: the range, Hz.
        loss_factor: the least damping there is, above zero.

    Raises:
        InputError: for a range that does not rise from above zero, or no damping.
    """
    places = grid(low, high, loss_factor)
    values = size(places)
    within = CONTENDERS * max(1.0, SHARPEST / loss_factor)  # so much higher a peak may be than its flank
    return [_highest(size, places, values, k, within) for k in range(values.shape[1])]


def _highest(
    size: Callable[[np.ndarray], np.ndarray], places: np.ndarray, values: np.ndarray, response: int, within: float
) -> Peak:
    own: np.ndarray = np.asarray(values[:, response], dtype=float)
    if not np.all(np.isfinite(own)):
        return Peak(float("nan"), float("nan"))
    padded = np.r_[-np.inf, own, -np.inf]
    peaks = np.flatnonzero((own >= padded[:-2]) & (own >= padded[2:]) & (own >= float(own.max()) / within))
    peaks = peaks[np.argsort(-own[peaks], kind="stable")[:MOST]]
    last = len(places) - 1
    brackets = [(float(places[max(int(k) - 1, 0)]), float(places[min(int(k) + 1, last)])) for k in peaks]
    return max((_refined(size, *bracket, response) for bracket in brackets), key=lambda peak: peak.size)


def _refined(size: Callable[[np.ndarray], np.ndarray], low: float, high: float, response: int) -> Peak:
    while True:
        places = np.linspace(low, high, POINTS)
        own = size(places)[:, response]
        top = int(np.argmax(own))
        if high - low <= NARROWEST * high:
            return Peak(float(places[top]), float(own[top]))
        low, high = places[max(top - 1, 0)], places[min(top + 1, POINTS - 1)]
