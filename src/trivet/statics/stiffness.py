"""Stiffness of many poses: fixed chunks, each a batch of the one-pose kernel, over all cores, in constant memory."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from trivet.model import Machine, Mechanism
from trivet.space.batches import in_threads
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.statics.compliance import leg_stiffnesses, total

TILE = 4096
"""Poses worked on at a time: few enough that the intermediate arrays of the fused kernel stay in the cache of one core."""
CHUNK = 8
"""Tiles per call."""
SMALL = 320
"""Poses per call of small batches, which have a compiled kernel of their own."""

UPPER = tuple((i, j) for i in range(6) for j in range(i, 6))


@jax.jit
def _tiles(mechanism: Mechanism, poses: Frame, signs: Scalar) -> tuple[Scalar, tuple[list[Scalar], Scalar]]:
    """The 21 upper entries by rows, and whether the pose is reached, for poses (tiles, poses); second of two results.

    XLA computes what several results share once per result, unless it is itself a result.  So the scan hands it on from tile
    to tile, in place, where every entry finds it; that of the last tile is the first result, which nobody wants.
    """

    def tile(poses: Frame) -> tuple[tuple[Scalar, ...], tuple[list[Scalar], Scalar]]:
        def entries(pose: Frame) -> tuple[tuple[Scalar, ...], tuple[list[Scalar], Scalar]]:
            parts = leg_stiffnesses(mechanism, pose, signs)
            stiffness, reached = total(parts)
            return tuple(s for part in parts for s in part.shared), (stiffness.upper(), reached)

        return jax.vmap(entries)(poses)

    shapes = jax.eval_shape(tile, jax.tree.map(lambda component: component[0], poses))[0]
    return jax.lax.scan(lambda _, poses: tile(poses), tuple(jnp.zeros(s.shape) for s in shapes), poses)


def stream(machine: Machine, poses: Iterator[Frame], signs: Any) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Stiffness of an unending row of batches of poses, each of CHUNK * TILE poses, in their order and in constant memory.

    Args:
        machine: the machine.
        poses: batches of platform frames with component arrays of shape (CHUNK, TILE).
        signs: (n_chains, 2) working mode.

    Yields:
        The 21 upper entries (SI) and the reached flags, arrays of shape (CHUNK, TILE).
    """
    run = partial(_tiles, jax.tree.map(jnp.asarray, machine.mechanism), signs=jnp.asarray(signs))
    yield from in_threads(lambda pose: jax.block_until_ready(run(pose))[1], poses)  # type: ignore[no-untyped-call]


def stiffness(machine: Machine, poses: Frame, signs: Any) -> tuple[Any, Any]:
    """Stiffness of a batch of poses.

    Args:
        machine: the machine.
        poses: platform frames {E} in {O}, component arrays of shape (n,).
        signs: (n_chains, 2) working mode.

    Returns:
        (n, 6, 6) stiffness at the platform centre in {O}, forces first (N/m, N/rad, N m/rad), NaN where a chain cannot close,
        and (n,) whether the pose is reached with all joints inside their travel.
    """
    components = [np.asarray(c, dtype=float).ravel() for c in jax.tree.leaves(poses)]
    count = components[0].size
    rows, tile = (CHUNK, TILE) if count > 8 * SMALL else (1, SMALL)
    size = tile * rows
    structure = jax.tree.structure(poses)

    def batches() -> Iterator[Frame]:
        for start in range(0, count, size):
            index = np.minimum(np.arange(start, start + size), count - 1).reshape(rows, tile)
            yield jax.tree.unflatten(structure, [jnp.asarray(c[index]) for c in components])

    matrix = np.empty((count, 6, 6))
    reached = np.empty(count, dtype=bool)
    for k, (entries, inside) in enumerate(stream(machine, batches(), signs)):
        keep = slice(k * size, min((k + 1) * size, count))
        taken = keep.stop - keep.start
        for (i, j), entry in zip(UPPER, entries, strict=True):
            matrix[keep, i, j] = matrix[keep, j, i] = np.asarray(entry).ravel()[:taken]
        reached[keep] = np.asarray(inside).ravel()[:taken]
    return matrix, reached
