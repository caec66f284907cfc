"""The best roll at every check point, within a kernel over designs: the same as `statics.best_roll` of one machine, with NumPy.

A grid of rolls finds the hills.  A sweep takes the best roll of the grid, which is what makes it fast; an optimisation climbs
the highest hills, since a value that hangs on a grid has no slope.
"""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from trivet.model import Mechanism
from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar
from trivet.statics.best_roll import TIE, objective_at, on_grid
from trivet.statics.objective import Objective

HILLS = 6
"""Of a whole turn, that are climbed."""
CANDIDATES, LEVELS = 9, 10
"""Per level the zoom narrows four-fold: 1 degree to 2e-8 rad."""


def turns(rolls: int, symmetry: int) -> Angle:
    """So many rolls of a full turn, or those of one period of a machine that looks the same after a part of a turn (m,)."""
    own = rolls // symmetry if rolls % symmetry == 0 else rolls
    angle = 2 * math.pi / rolls * np.arange(own)
    return Angle(np.cos(angle), np.sin(angle))


def on_the_grid(values: Scalar, rolls: Angle) -> tuple[Angle, Scalar]:
    """The best of the rolls (m,) by values (n, m), and whether any reaches (n,)."""
    best = values.max(axis=1)
    number = _first(_is_best(values, best))
    return Angle(rolls.cos[number], rolls.sin[number]), best > -jnp.inf


def _is_best(values: Scalar, best: Scalar) -> Scalar:
    """Not those alone which rounding would make the best of equally good ones."""
    return values >= (best - TIE * jnp.abs(best))[:, None]


def _first(chosen: Scalar) -> Scalar:
    """The first column that is chosen (n,); not argmax, which XLA does not vectorise."""
    count = chosen.shape[1]
    number = jnp.where(chosen, jnp.arange(float(count)), float(count)).min(axis=1)
    return jnp.minimum(number, count - 1).astype(int)


def climbed(
    mechanism: Mechanism, frames: Frame, signs: Any, scalar: Objective, rolls: int, symmetry: int
) -> tuple[Angle, Scalar]:
    """The best roll of all at check points (n,), the first of those equally good, and whether any is reached."""
    every = jax.tree.map(jnp.asarray, turns(rolls, symmetry))
    values = on_grid(mechanism, frames, every, signs, scalar)
    hills = _hills(values, max(2, HILLS // symmetry) if rolls % symmetry == 0 else HILLS)
    count = hills.shape[1]
    step = 2 * math.pi / rolls * 0.25 ** np.arange(1, LEVELS + 1)
    offset = step[:, None] * np.arange(-(CANDIDATES // 2), CANDIDATES // 2 + 1)
    repeated = jax.tree.map(lambda c: jnp.repeat(c, count), frames)

    def at(frame: Frame, row: Angle) -> Scalar:
        return jax.vmap(lambda roll: objective_at(mechanism, frame, roll, signs, scalar))(row)

    def narrow(centre: Angle, offset: Angle) -> tuple[Angle, Scalar]:
        tried = _turned(Angle(centre.cos[:, None], centre.sin[:, None]), offset)
        found = jax.vmap(at)(repeated, tried)
        top = found.max(axis=1)
        best = _first(found == top[:, None])
        return _turned(centre, Angle(offset.cos[best], offset.sin[best])), top

    start = Angle(*(c[hills.ravel()] for c in every))
    last, tops = jax.lax.scan(narrow, start, Angle(jnp.cos(offset), jnp.sin(offset)))
    # A hill that the grid did not reach has no top, even where the zoom happened upon one beside it.
    tops = jnp.where(jnp.take_along_axis(values, hills, 1) > -jnp.inf, tops[-1].reshape(hills.shape), -jnp.inf)
    best = tops.max(axis=1)
    chosen = jnp.arange(len(best)) * count + _first(_is_best(tops, best))
    return Angle(last.cos[chosen], last.sin[chosen]), best > -jnp.inf


def _hills(values: Scalar, most: int) -> Scalar:
    """Columns (n, most) of the highest local tops along the closed last axis, by height."""
    is_top = (values >= jnp.roll(values, 1, axis=1)) & (values > jnp.roll(values, -1, axis=1))
    left = jnp.where(is_top, values, -jnp.inf)
    # A row on which all values are equal has no local top; its first column serves.
    left = jnp.concatenate([jnp.where(is_top.any(axis=1), left[:, 0], values[:, 0])[:, None], left[:, 1:]], axis=1)
    found = []
    for _ in range(most):
        found.append(_first(left == left.max(axis=1)[:, None]))
        left = jnp.where(jnp.arange(left.shape[1]) == found[-1][:, None], -jnp.inf, left)
    return jnp.sort(jnp.stack(found, axis=1), axis=1)


def _turned(roll: Angle, by: Angle) -> Angle:
    """Sum of angles: no sine or cosine inside the kernel."""
    return Angle(roll.cos * by.cos - roll.sin * by.sin, roll.sin * by.cos + roll.cos * by.sin)
