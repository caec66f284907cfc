"""The least dynamic stiffness over frequency and a smooth bound of it, with their slopes in every dimension.

The least value of 1/|H| is where its derivative with respect to the frequency vanishes, so that with respect to a dimension is
taken at that frequency (envelope theorem): one more solution of the chains.  As a dimension grows one resonance may take over
from another, and the slope jumps.  The p-norm of |H| over a fixed grid of frequencies has no such jumps, and as it is never
less than the greatest |H|, its inverse is a lower bound.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.model import Machine, dimensions
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec
from trivet.vibration import spectral
from trivet.vibration.directional import Asked, Entries, Greatest, greatest, own_frequency
from trivet.vibration.resonance import grid
from trivet.vibration.spectral_chain import Effort
from trivet.vibration.spectral_machine import Stand

Array = NDArray[Any]

SHARPNESS = 16
"""Exponent of the norm.  Of a single resonance the two frequencies of the grid beside the top show each at least 0.97 of its
height; up to an exponent of 22 the norm is then no less than the top.  At 16 it is at most 2 % more."""
POLISH = 1e-5
"""Greatest step to the very top of a peak, against its frequency.  What is left of a search among values, whose error goes with
the square of that of the frequency, would show in slopes, whose error goes with the frequency itself."""
ROWS = 16
"""Poses of a call for slopes."""


class Least(NamedTuple):
    """Least dynamic stiffness over frequency, or its bound, at p poses along k entries, with slopes."""

    stiffness: Array
    """(p, k) N/m, N/rad, N m/rad."""
    frequency: Array | None
    """(p, k) Hz, where it is; None of the bound."""
    slopes: dict[str, Array]
    """(p, k) per dimension, by its key path, in SI."""


def least(asked: Asked, low: float, high: float, least_damping: float) -> Least:
    """The least dynamic stiffness over a range of frequencies (Hz), and its slopes; arguments as for `greatest`."""
    return with_slopes(asked, greatest(asked, low, high, least_damping))


def with_slopes(asked: Asked, found: Greatest) -> Least:
    """Slopes at frequencies that are known."""
    size, shape = found.size.size, found.size.shape
    model = jax.tree.map(jnp.asarray, asked.machine)
    pose, entry = (index.ravel() for index in np.indices(shape))
    omega = 2 * math.pi * np.where(np.isfinite(found.frequency), found.frequency, 1.0).ravel()
    effort = spectral.plan(asked.machine, asked.poses, asked.stand, float(omega.max())).effort
    tops, parts = [], []
    for start in range(0, size, ROWS):
        index = np.minimum(np.arange(start, start + min(ROWS, size)), size - 1)
        some = asked.part(pose[index])
        stand = None if some.stand.postures is None else some.stand
        rows = some.poses, stand, some.arms, omega[index], entry[index]
        top, slopes = _row_slopes(model, *rows, asked.stand.signs, asked.loss_factor, asked.entries, effort)
        tops.append(np.asarray(top)[: size - start])
        parts.append({path: np.asarray(slope)[: size - start] for path, slope in dimensions(slopes).items()})
    slopes = {path: np.concatenate([part[path] for part in parts]).reshape(shape) for path in parts[0]}
    frequency = np.concatenate(tops).reshape(shape) / (2 * math.pi)
    return Least(1 / found.size, np.where(np.isfinite(found.frequency), frequency, np.nan), slopes)


@partial(jax.jit, static_argnames=("entries", "effort"))
def _row_slopes(
    machine: Machine,
    poses: Frame,
    stand: Stand | None,
    arms: Vec | None,
    omega: Array,
    entry: Array,
    signs: Any,
    loss_factor: Scalar,
    entries: Entries,
    effort: Effort,
) -> tuple[Any, Machine]:
    """Frequencies of the tops (rows,) in rad/s, and the machine's dimensions replaced by slopes (rows,) of 1/|H| there.

    Each row is at its own pose, near its own frequency, and of its own entry.
    """

    def row(pose: Frame, stand: Stand | None, arm: Vec | None, omega: Any, entry: Any) -> tuple[Any, Machine]:
        one = jax.tree.map(lambda c: jnp.asarray(c)[None], (pose, stand, arm))

        def stiffness(machine: Machine, omega: Any) -> Any:
            own = Asked(machine, one[0], one[1] or Stand(signs, None), entries, one[2], loss_factor)
            return 1 / jnp.abs(own_frequency(own, omega[None], effort)[0][entry])

        def slope(omega: Any) -> Any:
            return jax.jvp(partial(stiffness, machine), (omega,), (jnp.ones(()),))[1]

        rise, curvature = jax.jvp(slope, (omega,), (jnp.ones(()),))
        step = rise / curvature
        top = omega - jnp.where((curvature > 0) & (jnp.abs(step) < POLISH * omega), step, 0.0)
        return top, jax.grad(stiffness)(machine, top)

    return jax.vmap(row)(poses, stand, arms, omega, entry)


def bound(asked: Asked, low: float, high: float, least_damping: float, *, slopes: bool = True) -> Least:
    """A smooth lower bound of the least dynamic stiffness; arguments as for `greatest`."""
    omega = 2 * math.pi * grid(low, high, least_damping)
    highest = float(omega.max())
    values, found = [], []
    for k in range(len(asked)):
        one = asked.part(np.array([k]))
        chosen = spectral.plan(one.machine, one.poses, one.stand, highest)
        rest: Any = {"finish": one.entries, "arms": one.arms}
        chosen = spectral.divided(one.machine, one.poses, one.stand, omega, one.loss_factor, chosen, **rest)

        def norms(machine: Machine, one: Asked = one, rest: Any = rest, chosen: spectral.Plan = chosen) -> Any:
            return 1 / _norm(spectral.kernel(machine, one.poses, one.stand, omega, one.loss_factor, chosen, **rest)[0])

        if not slopes:
            values.append(np.asarray(norms(one.machine)))
            continue
        value, pull = jax.vjp(norms, jax.tree.map(jnp.asarray, one.machine))
        values.append(np.asarray(value))
        found.append([dimensions(pull(unit)[0]) for unit in jnp.eye(len(value))])
    paths = found[0][0] if found else {}
    gathered = {path: np.array([[float(entry[path]) for entry in pose] for pose in found]) for path in paths}
    return Least(np.array(values), None, gathered)


@jax.jit
def _norm(receptance: Any) -> Any:
    """p-norm (k,) of absolute values (k, n)."""
    square = receptance.real**2 + receptance.imag**2
    most = jax.lax.stop_gradient(square.max(axis=-1, keepdims=True))
    return jnp.sqrt(most[:, 0]) * ((square / most) ** (SHARPNESS // 2)).sum(axis=-1) ** (1 / SHARPNESS)
