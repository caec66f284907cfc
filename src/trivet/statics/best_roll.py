"""Best roll: over a surface of check points, the roll about the platform normal which maximises a scalar of the stiffness.

Per point: a grid of rolls finds the hills, a zoom on the highest hills finds their tops as a continuous optimum.  Where a limit
of a joint cuts a hill, the zoom ends at the limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.inverse import inverse
from trivet.kinematics.travel import margin
from trivet.model import Machine, Mechanism, dimensions
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled, tangent_axes
from trivet.space.scalar import Scalar
from trivet.space.surface import Surface
from trivet.space.vector import Vec
from trivet.statics.compliance import platform_stiffness, platform_stiffness_by_copies
from trivet.statics.objective import Objective

ROLLS = 360
"""Rolls of the first grid, unless said otherwise."""
POINTS_PER_CHUNK = 320
"""Fixed, so that every surface uses the same compiled kernel; the paper's 317 points fill one chunk."""
HILLS = 6
"""Highest hills of the grid that are climbed; a three-fold symmetric machine has three of equal height."""
CANDIDATES, LEVELS = 9, 13
"""The zoom looks at so many rolls per level and narrows four-fold each time: 1 degree to below 1e-9 rad."""
TIE = 1e-9
"""Relative difference below which two tops count as equal."""
SAME = 1e-5
"""Rolls closer than this (rad) are the same: a flat top is found to about the root of the rounding error."""


@dataclass(frozen=True)
class BestRoll:
    """Best roll per point of a surface; NaN at points which no roll reaches."""

    roll: NDArray[Any]
    """(n,) rad in [0, 2 pi); the smallest of the ties."""
    value: NDArray[Any]
    """(n,) objective (SI)."""
    ties: NDArray[Any]
    """(n,) number of rolls that are equally good; 0 where no roll reaches."""
    at_limit: NDArray[Any]
    """(n,) whether a joint's limit, rather than the top of a hill, decides."""


def unrolled(position: Any, azimuth: Any, tilt: Any) -> Frame:
    """Tangent frames at zero roll; component arrays of shape (n,)."""
    normal, x, y = tangent_axes(np.asarray(azimuth, dtype=float), np.asarray(tilt, dtype=float))
    return Frame(Vec(*np.moveaxis(np.asarray(position, dtype=float), -1, 0)), x, y, normal)


def objective_at(mechanism: Mechanism, frame: Frame, roll: Angle, signs: Scalar, scalar: Objective) -> Scalar:
    """Objective at one rolled pose; minus infinity where it is not reached."""
    stiffness, reached = platform_stiffness(mechanism, rolled(frame, roll), signs)
    value = scalar(stiffness)
    return jnp.where(reached & jnp.isfinite(value), value, -jnp.inf)


@partial(jax.jit, static_argnames="scalar")
def on_grid(mechanism: Mechanism, frames: Frame, rolls: Angle, signs: Scalar, scalar: Objective) -> Scalar:
    """Objective at every point and roll: frames (n,), rolls (m,), result (n, m); minus infinity where not reached."""

    def row(frame: Frame) -> Scalar:
        return jax.vmap(lambda roll: objective_at(mechanism, frame, roll, signs, scalar))(rolls)

    return jax.vmap(row)(frames)


@partial(jax.jit, static_argnames="scalar")
def _zoom(mechanism: Mechanism, frames: Frame, hills: Angle, offsets: Angle, signs: Scalar, scalar: Objective) -> Any:
    """Climb hills: frames (n,), rolls of the hills (n, k), offsets (levels, candidates).

    Gives the tops, their rolls, and whether a limit cuts the hill within the last, tiny, step of its top (n, k).
    """

    def climb(frame: Frame, hill: Angle) -> Any:
        def narrow(centre: Angle, offset: Angle) -> tuple[Angle, Any]:
            # Angle addition: no sine or cosine inside the kernel.
            tried = Angle(centre.cos * offset.cos - centre.sin * offset.sin, centre.sin * offset.cos + centre.cos * offset.sin)
            values = jax.vmap(lambda roll: objective_at(mechanism, frame, roll, signs, scalar))(tried)
            best = jnp.argmax(values)
            return Angle(tried.cos[best], tried.sin[best]), (values[best], jnp.isfinite(values).all())

        last, (tops, free) = jax.lax.scan(narrow, hill, offsets)
        return tops[-1], jnp.arctan2(last.sin, last.cos), ~free[-1]

    # Points and hills as one batch: JAX transforms the kernel once per level of batching.
    shape = hills.cos.shape
    repeated = jax.tree.map(lambda c: jnp.repeat(c, shape[1]), frames)
    climbed = jax.vmap(climb)(repeated, Angle(hills.cos.ravel(), hills.sin.ravel()))
    return tuple(a.reshape(shape) for a in climbed)


def best_roll(
    machine: Machine,
    surface: Surface,
    signs: Any,
    scalar: Objective,
    rolls: int = ROLLS,
    progress: Callable[[int], None] = lambda points: None,
) -> BestRoll:
    """The roll which maximises a scalar of the stiffness at every point of a surface.

    Args:
        machine: the machine.
        surface: n check points.
        signs: (n_chains, 2) working mode.
        scalar: what to maximise.
        rolls: rolls of the first grid; hills or reachable windows narrower than 360/rolls degrees can be missed.
        progress: called with the number of points done, chunk by chunk.

    Raises:
        InputError: for an empty surface or fewer than 8 rolls.
    """
    if len(surface) == 0:
        raise InputError(f"surface {surface.name}: has no points")
    if not 8 <= rolls <= 100_000:
        raise InputError(f"rolls: {rolls}; between 8 and 100000 are needed to find the hills")
    count = len(surface)
    size = POINTS_PER_CHUNK
    mechanism, branch = jax.tree.map(jnp.asarray, machine.mechanism), jnp.asarray(signs)
    parts = []
    for start in range(0, count, size):
        index = np.minimum(np.arange(start, start + size), count - 1)
        frames = unrolled(surface.position[index], surface.azimuth[index], surface.tilt[index])
        parts.append([a[: count - start] for a in _search(mechanism, frames, branch, scalar, rolls)])
        progress(min(start + size, count))
    return BestRoll(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _search(mechanism: Mechanism, frames: Frame, signs: Scalar, scalar: Objective, rolls: int) -> tuple[Any, ...]:
    step = 2 * math.pi / rolls
    grid = step * np.arange(rolls)
    values = np.asarray(on_grid(mechanism, frames, Angle(np.cos(grid), np.sin(grid)), signs, scalar))
    hills = _hills(values, min(HILLS, rolls))
    spacing = step * 0.25 ** np.arange(1, LEVELS + 1)
    offset = spacing[:, None] * np.arange(-(CANDIDATES // 2), CANDIDATES // 2 + 1)
    tops, roll, cut = _zoom(
        mechanism, frames, Angle(np.cos(grid[hills]), np.sin(grid[hills])), Angle(np.cos(offset), np.sin(offset)), signs, scalar
    )
    # A hill that the grid did not reach has no top, even where the zoom happened upon one beside it.
    tops = np.where(np.isfinite(np.take_along_axis(values, hills, 1)), np.asarray(tops), -np.inf)
    return _settle(tops, np.mod(np.asarray(roll), 2 * math.pi), np.asarray(cut))


def _hills(values: NDArray[Any], most: int) -> NDArray[Any]:
    """Columns of the highest local maxima along the closed last axis (n, most)."""
    is_top = (values >= np.roll(values, 1, axis=1)) & (values > np.roll(values, -1, axis=1)) & np.isfinite(values)
    # A grid on which all values are equal has no local maximum; its first column serves.
    is_top[:, 0] |= ~is_top.any(axis=1)
    ranked = np.where(is_top, values, -np.inf)
    return np.argsort(-ranked, axis=1, kind="stable")[:, :most]


def _settle(tops: NDArray[Any], roll: NDArray[Any], cut: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """Of the tops: the smallest roll of the best, its value, how many are as good, whether a limit decided."""
    best = tops.max(axis=1)
    found = np.isfinite(best)
    equal = np.isfinite(tops) & (tops >= np.where(found, best - TIE * np.abs(best), 0)[:, None])
    candidates = np.where(equal, roll, np.inf)
    column = candidates.argmin(axis=1)[:, None]
    chosen = np.take_along_axis(roll, column, 1)[:, 0]
    at_limit = found & np.take_along_axis(cut, column, 1)[:, 0]
    return np.where(found, chosen, np.nan), np.where(found, best, np.nan), _count_distinct(roll, equal), at_limit


def _count_distinct(roll: NDArray[Any], counted: NDArray[Any]) -> NDArray[Any]:
    """How many different angles there are per row; two hills may lead to the same top."""
    apart = np.abs(roll[:, :, None] - roll[:, None, :])
    same = np.minimum(apart, 2 * math.pi - apart) < SAME
    earlier = np.tri(roll.shape[1], k=-1, dtype=bool)
    repeats = (same & earlier & counted[:, None, :]).any(axis=2)
    return (counted & ~repeats).sum(axis=1)


@partial(jax.jit, static_argnames="scalar")
def mean_objective(
    machine: Machine, frames: Frame, roll: Angle, cut: Scalar | None, signs: Scalar, scalar: Objective
) -> Scalar:
    """Mean of the objective over poses (n,) at given rolls; differentiable in every dimension.

    At interior best rolls the derivative of the mean with respect to a dimension is that of the mean best-roll objective, since
    the objective's derivative with respect to the roll vanishes there (envelope theorem).  Where a limit cuts the hill it does
    not, and the roll goes with the limit, where the margin m of travel stays zero: d roll / dx = -m_x / m_roll.  `cut` (n,)
    tells where; None for nowhere.
    """

    def value(frame: Frame, angle: Angle, is_cut: Scalar | None) -> Scalar:
        def least(turn: Scalar) -> Scalar:
            return _travel_margin(machine, _turned(frame, angle, turn), signs)

        if is_cut is None:
            return scalar(platform_stiffness_by_copies(machine, rolled(frame, angle), signs))
        here, narrowing = jax.jvp(least, (0.0,), (1.0,))
        # Zero in value, with the slopes of the roll that follows.
        turn = jnp.where(is_cut, jax.lax.stop_gradient(here) - here, 0.0)
        turn = turn / jnp.where(is_cut, jax.lax.stop_gradient(narrowing), 1.0)
        return scalar(platform_stiffness_by_copies(machine, _turned(frame, angle, turn), signs))

    return jnp.mean(jax.vmap(value)(frames, roll, cut))


def _turned(frame: Frame, roll: Angle, turn: Scalar) -> Frame:
    """A frame at a roll, and turned on by a little (rad)."""
    return rolled(rolled(frame, roll), Angle(jnp.cos(turn), jnp.sin(turn)))


def _travel_margin(machine: Machine, pose: Frame, signs: Scalar) -> Scalar:
    """The least margin of all joints at one pose."""
    legs = machine.legs_unnamed
    return jnp.min(jnp.stack([margin(leg, inverse(leg, pose, signs[k]), pose) for k, leg in enumerate(legs)]))


_mean_and_gradient = jax.jit(jax.value_and_grad(mean_objective), static_argnames="scalar")


def mean_and_gradient(
    machine: Machine, surface: Surface, best: BestRoll, signs: Any, scalar: Objective
) -> tuple[float, dict[str, float]]:
    """Mean best-roll objective over the reached points and its derivative with respect to every dimension by key path (SI).

    Rolls that a limit decides go with the limit.
    """
    used = np.isfinite(best.roll)
    frames = unrolled(surface.position[used], surface.azimuth[used], surface.tilt[used])
    roll = Angle(np.cos(best.roll[used]), np.sin(best.roll[used]))
    cut = best.at_limit[used] if best.at_limit[used].any() else None
    model = jax.tree.map(jnp.asarray, machine)
    value, gradient = _mean_and_gradient(model, frames, roll, cut, jnp.asarray(signs), scalar)
    return float(value), {path: float(slope) for path, slope in dimensions(gradient).items()}
