"""Singular values of many small matrices, without LAPACK (see `elimination.solved`)."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

SWEEPS = 6
"""Over all pairs of columns; of 6 x 6 matrices the last one changes nothing but rounding."""
BLOCK = 128
"""Matrices worked on at a time: they stay in the fast cache of a core."""


def least_singular_values(matrices: jax.Array) -> jax.Array:
    """The smallest singular value (m,) of square matrices (n, n, m), n even; within a few roundings of the greatest one.

    Columns are turned in pairs until they are at right angles to each other (M. R. Hestenes, Inversion of matrices by
    biorthogonalization and related results, J. SIAM 6, 1958); the shortest of them is the answer.
    """
    size, _, many = matrices.shape
    blocks = -(-many // BLOCK)
    filled = jnp.pad(matrices, ((0, 0), (0, 0), (0, blocks * BLOCK - many)), mode="edge")
    parts = jnp.moveaxis(filled.reshape(size, size, blocks, BLOCK), 2, 0)
    return jax.lax.map(_least, jnp.swapaxes(parts, 1, 2)).reshape(blocks * BLOCK)[:many]


def _least(columns: jax.Array) -> jax.Array:
    """Of one block, columns first."""
    size = len(columns)
    half = size // 2
    # A round robin: column k meets column n - 1 - k, then all but the first move on by one place.
    order = np.r_[0, size - 1, 1 : size - 1]

    def meet(_: int, columns: jax.Array) -> jax.Array:
        one, two = columns[:half], columns[half:][::-1]
        first, second, both = ((a * b).sum(axis=1) for a, b in ((one, one), (two, two), (one, two)))
        slope = (second - first) / (2 * both)
        turn = jnp.where(slope < 0, -1.0, 1.0) / (jnp.abs(slope) + jnp.sqrt(1 + slope * slope))
        turn = jnp.where(both == 0, 0.0, turn)
        root = jnp.sqrt(1 + turn * turn)
        cos, sin = (1 / root)[:, None], (turn / root)[:, None]
        return jnp.concatenate([one * cos - two * sin, (two * cos + one * sin)[::-1]])[order]

    columns = jax.lax.fori_loop(0, SWEEPS * (size - 1), meet, columns)
    return jnp.sqrt((columns * columns).sum(axis=1).min(axis=0))
