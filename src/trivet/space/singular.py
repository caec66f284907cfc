"""The smallest singular values of many small matrices, without LAPACK (see `elimination.solved`)."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from trivet.space.scalar import Scalar

BLOCK = 96
"""Matrices worked on at a time: they stay in the fastest cache of a core."""
ENOUGH = 1e-14
"""A step of the search, in parts of what has been found, after which none follows."""
STEPS = 60
"""At most; three do where the two smallest values differ, forty where three are equal."""


def least_singular_values(matrices: Scalar) -> Scalar:
    """The smallest singular value (m,) of square matrices (n, n, m), n even; within a few roundings of the greatest one,
    or 1e-8 of it where all are as nearly equal as that.  Squares of their elements must neither overflow nor vanish.

    Mirrors from either side leave two diagonals (G. Golub and W. Kahan, Calculating the singular values and pseudo-inverse of a
    matrix, SIAM J. Numer. Anal. 2, 1965), from which the square of the value is sought from below.
    """
    return jax.lax.platform_dependent(matrices, cpu=_block_by_block, default=_least)


def _block_by_block(matrices: Scalar) -> Scalar:
    """As a processor's cores like it; accelerators take all matrices at once."""
    size, _, many = matrices.shape
    blocks = -(-many // BLOCK)
    filled = jnp.pad(matrices, ((0, 0), (0, 0), (0, blocks * BLOCK - many)), mode="edge")
    parts = jnp.moveaxis(filled.reshape(size, size, blocks, BLOCK), 2, 0)
    return jax.lax.map(_least, parts).reshape(blocks * BLOCK)[:many]


def _least(matrix: Scalar) -> Scalar:
    """Of matrices worked on together."""
    diagonal: list[Scalar] = []
    beside: list[Scalar] = []
    while len(matrix) > 2:
        # Two rows and columns at a time: loops keep XLA from working out mirrors anew for each place that they are used in.
        empty = jnp.zeros((2, matrix.shape[2]))
        matrix, own, next_to = jax.lax.fori_loop(0, 2, _mirrored, (matrix, empty, empty))
        diagonal, beside, matrix = [*diagonal, *own], [*beside, *next_to], matrix[:-2, :-2]
    first, second = matrix[:, 0], matrix[:, 1]
    length, product = (first * first).sum(axis=0), (first * second).sum(axis=0)
    determinant = first[0] * second[1] - first[1] * second[0]
    per_length = 1 / jnp.where(length == 0, 1.0, length)
    diagonal += [length, determinant * determinant * per_length]
    return _from_below(diagonal, [*beside, product * product * per_length])


def _mirrored(step: int, found: tuple[Scalar, Scalar, Scalar]) -> tuple[Scalar, Scalar, Scalar]:
    """A matrix (n, n, m) with its first column mirrored onto its first element and its first row onto the second one, less
    both; what they became, squared, is put among what was found before."""
    matrix, diagonal, beside = found
    length, mirror, weight = _mirror(matrix[:, 0])
    matrix = matrix - mirror[:, None] * ((mirror[:, None] * matrix).sum(axis=0) * weight)
    next_to, mirror, weight = _mirror(matrix[0, 1:])
    rest = matrix[1:, 1:]
    rest = rest - ((rest * mirror).sum(axis=1) * weight)[:, None] * mirror
    return jnp.pad(rest, ((0, 1), (0, 1), (0, 0))), diagonal.at[step].set(length), beside.at[step].set(next_to)


def _mirror(vector: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Squared length of vectors (n, m), the normal of the mirror that turns them onto the first axis, and 2 over its square."""
    square = (vector * vector).sum(axis=0)
    length = jnp.sqrt(square)
    lead = vector[0] + jnp.where(vector[0] < 0, -length, length)
    half = length * jnp.abs(lead)
    return square, jnp.concatenate([lead[None], vector[1:]]), jnp.where(half > 0, 1 / jnp.where(half > 0, half, 1.0), 0.0)


def _from_below(diagonal: list[Scalar], beside: list[Scalar]) -> Scalar:
    """The smallest singular value of matrices of two diagonals, whose squared elements are given."""

    def is_moving(state: tuple[Scalar, Scalar, int]) -> Scalar:
        value, step, count = state
        return jnp.any(step > ENOUGH * value) & (count < STEPS)

    def moved(state: tuple[Scalar, Scalar, int]) -> tuple[Scalar, Scalar, int]:
        value, _, count = state
        step = _laguerre(diagonal, beside, value)
        return value + step, step, count + 1

    nothing = jnp.zeros_like(diagonal[0])
    square, _, _ = jax.lax.while_loop(is_moving, moved, (nothing, nothing + 1, 0))
    return jnp.sqrt(square + 0 * diagonal[-1])  # NaN stays NaN


def _laguerre(diagonal: list[Scalar], beside: list[Scalar], value: Scalar) -> Scalar:
    """How far the least squared singular value is above a number below it: Laguerre's bound; 0 where rounding ends it.

    The bound asks the sums of 1/(s - value) and of their squares over all squared singular values s.  They come of the pivots
    of B^T B - value and their slopes, by the differential quotient-difference algorithm, in which nothing cancels (K. V.
    Fernando and B. N. Parlett, Accurate singular values and differential qd algorithms, Numer. Math. 67, 1994).
    """
    count = len(diagonal)
    shift, slope, bend = -value, -jnp.ones_like(value), jnp.zeros_like(value)
    first, second, is_below = jnp.zeros_like(value), jnp.zeros_like(value), jnp.ones_like(value, dtype=bool)
    for own, next_to in zip(diagonal, [*beside, jnp.zeros_like(value)], strict=True):
        pivot = own + shift
        over = 1 / pivot
        is_below &= pivot > 0
        part = -slope * over
        first, second = first + part, second + part * part - bend * over
        ratio = next_to * over
        part = ratio * own * over
        shift, slope, bend = ratio * shift - value, part * slope - 1, part * (bend - 2 * slope * slope * over)
    spread = jnp.maximum((count - 1) * (count * second - first * first), 0)
    return jnp.where(is_below, count / (first + jnp.sqrt(spread)), 0.0)
