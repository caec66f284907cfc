"""Where a front has room between its points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trivet.design.front.problem import Array

FLATTEST = 0.05
"""Least part of the longest side of a gap that the others count as."""
MOST = 200
"""Points that are looked at, at most."""


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
    """Between points (n, m) of a front whose extent is `width` (m,), the longest first: the edges of their Gabriel graph (K. R.
    Gabriel and R. R. Sokal, 1969), no point lies in the ball over one."""
    places = objectives[:MOST] / width
    apart = np.sum((places[:, None] - places) ** 2, axis=2)
    # A third point lies in the ball over i and j where it sees them at an obtuse angle.
    is_open = [~np.any(apart[i][:, None] + apart < apart[i] * (1 - 1e-12), axis=0) & (apart[i] > 0) for i in range(len(places))]
    found = []
    for i, j in np.argwhere(np.triu(np.array(is_open))):
        side = np.abs(places[i] - places[j])
        across = side.max() / np.maximum(side, FLATTEST * side.max())
        direction = width * across / np.linalg.norm(across)
        found.append(Gap(int(i), int(j), float(np.sqrt(apart[i, j])), (objectives[i] + objectives[j]) / 2, direction))
    return sorted(found, key=lambda gap: -gap.length)
