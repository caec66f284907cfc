"""Receptances along chosen directions at many poses, and where over frequency they are greatest.

A pose costs a few dozen solutions of its chains (`vibration.spectral`), whatever the number of frequencies.  The greatest value
of a receptance is the least dynamic stiffness 1/|H|.  A grid of frequencies on which no resonance hides shows the peaks; beside
one, 1/|H|^2 is nearly a parabola in omega^2, as it is exactly for one degree of freedom, so a few parabolas find its top.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.model import Machine
from trivet.space.batches import in_threads
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, add
from trivet.space.symmetric import Symmetric
from trivet.space.vector import Vec
from trivet.statics.objective import AXES
from trivet.vibration import spectral
from trivet.vibration.resonance import SHARPEST, grid
from trivet.vibration.spectral_chain import Effort
from trivet.vibration.spectral_machine import Stand, at_nodes, sampled, standing

CHUNK = 16
"""Poses of a call: few enough for the intermediate arrays to stay near a cache, and for little of the last to be in vain."""
ROWS = 64
"""Poses, each at its own frequency, of a call."""
BESIDE = 1.1
"""Peaks of the grid that reach the greatest divided by this are climbed: a grid shows at least 0.97 of a peak."""
MOST = 8
"""Peaks of a response that are climbed at most: where it is flat to rounding every other frequency is one."""
STEPS = 5
"""Parabolas; each about squares the error."""
NARROW = 1e-10
"""Distance from the top, against its omega^2, below which a peak is climbed."""

ROUNDING = 1e-12
"""Share of the geometric mean of H_ii and H_jj up to which H_ij is nothing but rounding, a thousandth or less of this as a
rule."""

Array = NDArray[Any]


class Entries(NamedTuple):
    """Entries of the receptance at a point of the platform, (p, k, n): a `spectral.Finish`."""

    directions: tuple[tuple[float, ...], ...]
    """Six numbers each: unit force and moment, hence displacement and rotation, in {O}."""
    pairs: tuple[tuple[int, int], ...]
    """k pairs of directions: of the motion and of the load."""

    @classmethod
    def named(cls, names: Sequence[tuple[str, str]]) -> Entries:
        """Of axes: ("x", "x") or ("x", "ry")."""
        axes = list(dict.fromkeys(axis for pair in names for axis in pair))
        directions = tuple(tuple(float(axis == other) for other in AXES) for axis in axes)
        return cls(directions, tuple((axes.index(a), axes.index(b)) for a, b in names))

    def own(self) -> Entries:
        """Of every direction the motion along it under a load along it."""
        return Entries(self.directions, tuple((k, k) for k in range(len(self.directions))))

    def __call__(self, matrix: Symmetric, arms: Vec | None) -> tuple[jax.Array, jax.Array]:
        columns = []
        for direction in self.directions:
            force, moment = (Vec(*(0 if c == 0 else c for c in part)) for part in (direction[:3], direction[3:]))
            if arms is not None:
                arm = Vec(*(jnp.asarray(c)[:, None] for c in arms))
                moment = Vec(*(add(a, b) for a, b in zip(moment, arm.cross(force), strict=True)))
            columns.append((*force, *moment))
        found, determinant = matrix.products(columns, self.pairs)
        shape = jnp.shape(matrix[0, 0])
        whole = [jnp.broadcast_to(jnp.asarray(value, dtype=complex), shape) for value in (*found, determinant)]
        return jnp.stack(whole[:-1], axis=-2), whole[-1]

    def shaped(self, values: jax.Array) -> jax.Array:
        """As they are."""
        return values


@dataclass(frozen=True)
class Asked:
    """What is asked of a machine at p poses."""

    machine: Machine
    poses: Frame
    """Components (p,)."""
    stand: Stand
    entries: Entries
    arms: Vec | None
    """(p,) from the platform centre to the point of the platform, in {O}, m; None for the centre."""
    loss_factor: Scalar
    """Of all that has none of its own."""

    @classmethod
    def of(
        cls,
        machine: Machine,
        poses: Frame,
        signs: Any,
        entries: Entries,
        loss_factor: Scalar = 0.02,
        point: Sequence[float] | None = None,
    ) -> Asked:
        """With a point of the platform in {E} (m); its centre when not given."""
        count = np.broadcast_shapes((1,), *(np.shape(c) for c in jax.tree.leaves(poses)))
        many = jax.tree.map(lambda c: np.broadcast_to(np.asarray(c, dtype=float), count), poses)
        stand = standing(machine, poses, signs)
        arms = None if point is None else jax.tree.map(lambda c: np.broadcast_to(c, count), many.direction(Vec(*point)))
        return cls(machine, many, stand, entries, arms, loss_factor)

    def __len__(self) -> int:
        return len(self.poses.origin.x)

    def part(self, index: Array) -> Asked:
        """The same at some of the poses."""
        poses, arms, postures = jax.tree.map(lambda c: c[index], (self.poses, self.arms, self.stand.postures))
        return replace(self, poses=poses, arms=arms, stand=self.stand._replace(postures=postures))


class Greatest(NamedTuple):
    """Greatest absolute values over frequency of k receptances at p poses; NaN where a pose is not reached."""

    size: Array
    """(p, k)."""
    frequency: Array
    """(p, k) Hz."""


def receptances(asked: Asked, frequency: Array) -> Iterator[tuple[slice, Array]]:
    """Receptances (some, k, n) of poses in their order, at frequencies (n,) in Hz; memory does not grow with the poses."""
    omega = 2 * math.pi * np.asarray(frequency, dtype=float)
    chosen = spectral.plan(asked.machine, asked.poses, asked.stand, float(omega.max()))
    count = len(asked)

    def work(places: slice, chosen: spectral.Plan) -> tuple[Array, spectral.Plan]:
        # Always as many, the last one again and again, so that one compiled kernel serves.
        some = asked.part(np.minimum(np.arange(min(CHUNK, count)) + places.start, count - 1))
        loss = some.loss_factor
        found, divided = spectral.solved(some.machine, some.poses, some.stand, omega, loss, chosen, some.entries, some.arms)
        return np.asarray(found)[: places.stop - places.start], divided

    first, *rest = (slice(start, min(start + CHUNK, count)) for start in range(0, count, CHUNK))
    # With the panels that the first poses ask for, few others ask for more.
    found, chosen = work(first, chosen)
    yield first, found
    yield from in_threads(lambda places: (places, work(places, chosen)[0]), iter(rest))


def greatest(asked: Asked, low: float, high: float, least_damping: float) -> Greatest:
    """The greatest values over a range of frequencies (Hz).

    Args:
        asked: of what, and where.
        low, high: the range, Hz.
        least_damping: the least loss factor above zero of any part.

    Raises:
        InputError: for a range that does not rise from above zero, or no damping.
    """
    places = grid(low, high, least_damping)
    parts = [Peaks.of(places, np.abs(values), least_damping, rows.start) for rows, values in receptances(asked, places)]
    return climbed(asked, Peaks.joined(parts), high)


class Peaks(NamedTuple):
    """r peaks on a grid of frequencies."""

    pose: Array
    """(r,)."""
    entry: Array
    """(r,)."""
    squares: Array
    """(3, r) omega^2 of the grid at the peak and on both sides."""
    values: Array
    """(3, r) 1/|H|^2 there."""

    @classmethod
    def of(cls, frequency: Array, sizes: Array, least_damping: float, first: int) -> Peaks:
        """Those that may lead to the greatest of sizes (p, k, n), on a grid of frequencies (n,) in Hz on which no resonance
        hides; `first` is the number of the first pose."""
        padded = np.pad(sizes, ((0, 0), (0, 0), (1, 1)), constant_values=-np.inf)
        within = BESIDE * max(1.0, SHARPEST / least_damping)
        with np.errstate(invalid="ignore"):
            is_peak = (sizes >= padded[..., :-2]) & (sizes >= padded[..., 2:])
            is_peak &= sizes >= sizes.max(axis=-1, keepdims=True) / within
        heights = np.where(is_peak, sizes, -np.inf)
        most = min(MOST, heights.shape[-1])
        pose, entry, top = np.nonzero(is_peak & (heights >= -np.partition(-heights, most - 1, axis=-1)[..., most - 1 : most]))
        around = np.stack([np.maximum(top - 1, 0), top, np.minimum(top + 1, len(frequency) - 1)])
        squares = np.square(2 * math.pi * frequency)[around]
        return cls(first + pose, entry, squares, 1 / np.square(sizes[pose, entry, around]))

    @classmethod
    def joined(cls, parts: Sequence[Peaks]) -> Peaks:
        """All of them."""
        return cls(*(np.concatenate(column, axis=-1) for column in zip(*parts, strict=True)))


def climbed(asked: Asked, peaks: Peaks, high: float) -> Greatest:
    """The greatest values, from peaks up to a highest frequency (Hz)."""
    shape = len(asked), len(asked.entries.pairs)
    found = Greatest(np.full(shape, np.nan), np.full(shape, np.nan))
    if not len(peaks.pose):
        return found
    effort = spectral.plan(asked.machine, asked.poses, asked.stand, 2 * math.pi * high).effort
    peak, height = _tops(asked.part(peaks.pose), peaks, effort)
    order = np.argsort(height, kind="stable")
    where = peaks.pose[order], peaks.entry[order]
    found.size[where] = height[order]
    found.frequency[where] = np.sqrt(peak[order]) / (2 * math.pi)
    return found


def is_rounding(asked: Asked, found: Greatest, high: float) -> Array:
    """(p, k) whether a greatest value is nothing but rounding, as where symmetry leaves motion and load nothing to do with each
    other; `high` as of `climbed`."""
    effort = spectral.plan(asked.machine, asked.poses, asked.stand, 2 * math.pi * high).effort
    own = replace(asked, entries=asked.entries.own())
    answer = np.zeros(found.size.shape, dtype=bool)
    for k, (motion, load) in enumerate(asked.entries.pairs):
        if motion != load:
            sizes = np.abs(at_frequencies(own, 2 * math.pi * found.frequency[:, k], effort))
            answer[:, k] = found.size[:, k] <= ROUNDING * np.sqrt(sizes[:, motion] * sizes[:, load])
    return answer


def _tops(asked: Asked, peaks: Peaks, effort: Effort) -> tuple[Array, Array]:
    """omega^2 (r,) and sizes (r,) of the tops; the poses are those of the peaks, one after the other."""
    squares, values = peaks.squares.copy(), peaks.values.copy()
    left = np.arange(len(peaks.pose))
    for _ in range(STEPS):
        tried = _vertex(squares[:, left], values[:, left])
        size = np.abs(at_frequencies(asked.part(left), np.sqrt(tried), effort))[np.arange(len(left)), peaks.entry[left]]
        squares[:, left], values[:, left] = _bracket(squares[:, left], values[:, left], tried, 1 / np.square(size))
        left = left[(squares[2, left] - squares[0, left]) > NARROW * squares[1, left]]
        if not len(left):
            break
    return squares[1], 1 / np.sqrt(values[1])


def _vertex(x: Array, y: Array) -> Array:
    """Where to look next between three places (3, r): at the vertex of the parabola, or halfway into the wider side."""
    left, right = x[1] - x[0], x[2] - x[1]
    with np.errstate(invalid="ignore", divide="ignore"):
        falls, rises = (y[0] - y[1]) / left, (y[2] - y[1]) / right
        vertex = x[1] + (falls * right - rises * left) / (2 * (falls + rises)) * np.where(falls + rises == 0, np.nan, 1.0)
    inside = (vertex > x[0]) & (vertex < x[2]) & (np.abs(vertex - x[1]) > NARROW / 10 * x[1])
    halfway = np.where(left > right, (x[0] + x[1]) / 2, (x[1] + x[2]) / 2)
    settled = np.abs(vertex - x[1]) <= NARROW / 10 * x[1]
    beside = x[1] + np.where(left > right, -1, 1) * NARROW / 2 * x[1]
    return np.where(inside, vertex, np.where(settled, np.clip(beside, x[0], x[2]), halfway))


def _bracket(x: Array, y: Array, tried: Array, value: Array) -> tuple[Array, Array]:
    """The least of four places, and its neighbours."""
    places, values = np.concatenate([x, tried[None]]), np.concatenate([y, value[None]])
    order = np.argsort(places, axis=0, kind="stable")
    places, values = (np.take_along_axis(a, order, axis=0) for a in (places, values))
    best = np.argmin(values, axis=0)
    index = np.stack([np.maximum(best - 1, 0), best, np.minimum(best + 1, 3)])
    return np.take_along_axis(places, index, axis=0), np.take_along_axis(values, index, axis=0)


def at_frequencies(asked: Asked, omega: Array, effort: Effort) -> Array:
    """Receptances (p, k), every pose at its own frequency (p,) in rad/s."""
    count = len(asked)

    def work(start: int) -> Array:
        index = np.minimum(np.arange(start, start + ROWS), count - 1)
        return np.asarray(own_frequency(asked.part(index), omega[index], effort))[: count - start]

    return np.concatenate(list(in_threads(work, iter(range(0, count, ROWS)))))


def own_frequency(asked: Asked, omega: Any, effort: Effort) -> jax.Array:
    """`at_frequencies` as JAX traces it."""
    nodes = jnp.asarray(omega)[:, None]
    samples = sampled(asked.machine, asked.poses, asked.stand, nodes, asked.loss_factor, effort)
    return at_nodes(samples, nodes, asked.entries, asked.arms)[..., 0]
