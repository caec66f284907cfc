"""Where a front has room between its points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trivet.design.front.problem import Array

FLATTEST = 0.05
"""Least part of the longest side of a gap that the others count as."""


class Gap(NamedTuple):
    """Between two points of a front that have no third one between them."""

    first: int
    second: int
    length: float
    """As a part of the front's extent."""
    middle: Array
    """(m,) halfway."""
    direction: Array
    """(m,) across the gap, where the front should be met."""


def gaps(objectives: Array, width: Array) -> list[Gap]:
    """Between points (n, m) of a front whose extent is `width` (m,), the longest first."""
    places = objectives / width
    found = []
    for i, j in _beside(places):
        side = np.abs(places[i] - places[j])
        across = side.max() / np.maximum(side, FLATTEST * side.max())
        direction = width * across / np.linalg.norm(across)
        found.append(Gap(int(i), int(j), float(np.linalg.norm(side)), (objectives[i] + objectives[j]) / 2, direction))
    return sorted(found, key=lambda gap: -gap.length)


def _beside(places: Array) -> Array:
    """Pairs (p, 2) of points (n, m) that are neighbours: along a line for two objectives, else by their Gabriel graph (K. R.
    Gabriel and R. R. Sokal, 1969), which joins those whose ball over both as ends of a diameter no other lies in."""
    if places.shape[1] == 2:
        order = np.lexsort(places.T[::-1])
        return np.stack([order[:-1], order[1:]], axis=1)
    apart = np.sum((places[:, None] - places) ** 2, axis=2)
    # A third point lies in the ball over i and j where it sees them at an obtuse angle.
    is_open = [~np.any(apart[i][:, None] + apart < apart[i] * (1 - 1e-12), axis=0) & (apart[i] > 0) for i in range(len(places))]
    return np.argwhere(np.triu(np.array(is_open).reshape(len(places), len(places))))
