"""Where to hold drives so that the least of a measure over poses is greatest.

First a grid (`lock_grid`): every chain is worked out by itself at coordinates within the travel of its held drives, those which
do not reach all poses are left out, and what is left is combined.  From the best of it slopes lead on (`epigraph`).  A look
around of shrinking steps ends it, where slopes have no meaning.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.study.epigraph import Chosen, Epigraph, drawn_back
from trivet.study.lock_grid import ROLLS
from trivet.study.lock_measures import Measure
from trivet.study.lock_values import Holding, Poses, ends, over_poses, picked, span, values_at

Array = NDArray[Any]

STEPS = 60
"""Of sequential quadratic programming, at most."""
FINEST = 1e-6
"""Part of the travel at which a look around ends."""
LEVELS = 10
"""How often a grid of rolls about the best is made finer, by a third each."""


def polished(asked: Measure, holdings: Sequence[Holding], poses: Poses) -> Holding:
    """The best near some, never worse than any of them."""
    tried = [*holdings, *(_climbed(asked, holding, poses) for holding in holdings)]
    best = max(tried, key=lambda holding: holding.value)
    return best if asked.is_costly else _around(asked, best, poses)


def _climbed(asked: Measure, holding: Holding, poses: Poses) -> Holding:
    same = np.ones((len(poses), 1))
    program = Epigraph(asked, holding.ways, poses, same, holding.value)
    start = Chosen(holding.values[None], holding.rolls)
    found = drawn_back(program.climbed(start, STEPS), start, lambda one: bool(np.all(np.isfinite(program.values(one)))))
    return Holding(holding.ways, found.coefficients[0], np.mod(found.rolls, 2 * math.pi), program.values(found))


def _around(asked: Measure, start: Holding, poses: Poses) -> Holding:
    """Looks around of shrinking steps, rolls kept."""
    width, (low, high) = span(start.ways), ends(start.ways)
    ahead = np.eye(len(width)) if len(width) > 4 else np.array([v for v in product((-1, 0, 1), repeat=len(width)) if any(v)])
    directions = np.concatenate([ahead, -ahead]) if len(width) > 4 else ahead
    random, step, found = np.random.default_rng(0), 0.02, start
    while step > FINEST and len(width):
        turn, _ = np.linalg.qr(random.normal(size=(len(width), len(width))))
        tried = np.clip(found.values + step * width * (directions @ turn), low, high)
        least = over_poses(asked, start.ways, tried, poses.frames, found.rolls)
        best = int(np.argmax(least.min(axis=1)))
        if least[best].min() > found.value:
            found = found._replace(values=tried[best], least=least[best])
        else:
            step *= 0.4
    return found


def with_best_rolls(asked: Measure, holding: Holding, poses: Poses) -> Holding:
    """The same coordinates at poses of their own, with the best rolls where these are free."""
    if poses.rolls is not None:
        least = over_poses(asked, holding.ways, holding.values[None], poses.frames, poses.rolls)[0]
        return Holding(holding.ways, holding.values, poses.rolls, least)
    step = 2 * math.pi / (3 * ROLLS)
    centre, offsets = np.zeros(len(poses)), step * np.arange(3 * ROLLS)
    best, least = centre, np.full(len(poses), -np.inf)
    for _ in range(LEVELS + 1):
        tried = centre[:, None] + offsets
        p, r = (a.ravel() for a in np.indices(tried.shape))
        values = np.tile(holding.values, (len(p), 1))
        found = values_at(asked, holding.ways, values, picked(poses.frames, p), tried[p, r]).reshape(tried.shape)
        top = found.argmax(axis=1)
        here = found[np.arange(len(top)), top]
        best, least = np.where(here > least, tried[np.arange(len(top)), top], best), np.maximum(here, least)
        centre, step = best, step / 3
        offsets = step * np.arange(-4, 5)
    return Holding(holding.ways, holding.values, np.mod(best, 2 * math.pi), least)
