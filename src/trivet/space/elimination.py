"""Small systems of linear equations: of named components with zeros known at trace time, and of arrays in great numbers."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp

from trivet.space.scalar import Scalar, add, is_known, is_zero, mul, sub

_LEAST_PIVOT = 1e-3
"""A known number below this is a rounding error of an oblique axis, or nearly one."""

Rows = list[list[Scalar]]
Array = jax.Array


def solve(matrix: Sequence[Sequence[Scalar]], right: Sequence[Sequence[Scalar]]) -> Rows:
    """X of A X = B by elimination (Gauss and Jordan); n rows each, A with n columns, B with any number.

    Pivots are numbers known while tracing where there are any, then what stands alone in its column, then the greatest entry of
    a column, which may be another at every pose of a batch.
    """
    size = len(matrix)
    rows = [[*a, *b] for a, b in zip(matrix, right, strict=True)]
    order: list[int] = [-1] * size
    todo, columns = list(range(size)), list(range(size))
    while columns:
        column, candidates = _next(rows, todo, columns)
        pivot = candidates[0]
        for other in candidates[1:]:
            swap = jnp.abs(rows[other][column]) > jnp.abs(rows[pivot][column])
            rows[pivot], rows[other] = (
                [_chosen(swap, b, a) for a, b in zip(rows[pivot], rows[other], strict=True)],
                [_chosen(swap, a, b) for a, b in zip(rows[pivot], rows[other], strict=True)],
            )
        _eliminate(rows, pivot, column)
        todo.remove(pivot)
        columns.remove(column)
        order[column] = pivot
    return [rows[order[column]][size:] for column in range(size)]


def inverse(matrix: Sequence[Sequence[Scalar]]) -> Rows:
    """The inverse of a square matrix."""
    return solve(matrix, [[int(i == j) for j in range(len(matrix))] for i in range(len(matrix))])


def expanded(matrix: Sequence[Sequence[Scalar]]) -> Scalar:
    """The determinant of a small square matrix of components, by the minors of its first rows (Laplace); no division."""
    minors: dict[int, Scalar] = {0: 1}  # by the set of their columns
    for row in matrix:
        wider: dict[int, Scalar] = {}
        for columns, minor in minors.items():
            for k, value in enumerate(row):
                if not columns >> k & 1:
                    sense = -1 if (columns >> k).bit_count() % 2 else 1
                    joined = columns | 1 << k
                    wider[joined] = add(wider.get(joined, 0), mul(mul(value, sense), minor))
        minors = {columns: minor for columns, minor in wider.items() if not is_zero(minor)}
    return minors.get((1 << len(matrix)) - 1, 0)


def _next(rows: Rows, todo: list[int], columns: list[int]) -> tuple[int, list[int]]:
    """The column to eliminate next and the rows from which its pivot is taken."""
    filled = {c: [r for r in todo if not is_zero(rows[r][c])] for c in columns}
    known = [(len(filled[c]), c, r) for c in columns for r in filled[c] if _is_pivot(rows[r][c])]
    if known:
        _, column, row = min(known)
        return column, [row]
    column = min(columns, key=lambda c: len(filled[c]))
    # A column without any entry is singular whatever the pose; a division by zero says so.
    return column, filled[column] or todo[:1]


def _is_pivot(value: Scalar) -> bool:
    return is_known(value) and abs(value) > _LEAST_PIVOT


def _eliminate(rows: Rows, pivot: int, column: int) -> None:
    head = rows[pivot][column]
    scale = jnp.nan if is_zero(head) else 1 / head
    rows[pivot] = [mul(value, scale) if k != column else 1 for k, value in enumerate(rows[pivot])]
    for other, row in enumerate(rows):
        factor = row[column]
        if other != pivot and not is_zero(factor):
            rows[other] = [
                0 if k == column else sub(value, mul(factor, own))
                for k, (value, own) in enumerate(zip(row, rows[pivot], strict=True))
            ]


def _chosen(condition: Scalar, this: Scalar, that: Scalar) -> Scalar:
    if is_known(this) and is_known(that) and this == that:
        return this
    return jnp.where(condition, this, that)


@jax.custom_jvp
def eliminated(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Solutions (n, s, m) of n sets of s equations, and their determinants (n,), up to one factor for all; NaN without any.

    Elimination after Gauss and Jordan with the greatest pivot of each column: LAPACK, called for many small matrices at a time
    from several places of one compiled kernel, now and then never returns (jaxlib 0.10).

    Args:
        matrix: (n, s, s).
        right: (n or 1, s, m) right hand sides.
    """
    size = matrix.shape[-1]
    whole = jnp.concatenate(
        [matrix, jnp.broadcast_to(right, (*matrix.shape[:-1], right.shape[-1])).astype(matrix.dtype)], axis=-1
    )
    rows = jnp.arange(size)

    def column(k: Array, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        whole, logarithm, phase = carry
        own = jax.lax.dynamic_index_in_dim(whole, k, axis=-1, keepdims=False)
        chosen = jnp.argmax(jnp.where(rows < k, -1.0, _size(own)), axis=-1)
        is_chosen, is_k = rows == chosen[..., None], rows == k
        pivot_row = jnp.where(is_chosen[..., None], whole, 0).sum(axis=-2)
        displaced = jax.lax.dynamic_index_in_dim(whole, k, axis=-2, keepdims=False)
        pivot = jax.lax.dynamic_index_in_dim(pivot_row, k, axis=-1, keepdims=False)
        scaled = pivot_row / pivot[..., None]
        swapped = jnp.where(is_chosen[..., None], displaced[..., None, :], whole)
        factors = jax.lax.dynamic_index_in_dim(swapped, k, axis=-1, keepdims=False)
        left = jnp.where(is_k[:, None], scaled[..., None, :], swapped - factors[..., None] * scaled[..., None, :])
        length = jnp.abs(pivot)
        sign = jnp.where(chosen == k, 1.0, -1.0)
        return left, logarithm + jnp.log(length), phase * (sign * pivot / length)

    first = jnp.zeros(matrix.shape[:-2]), jnp.ones(matrix.shape[:-2], dtype=matrix.dtype)
    whole, logarithm, phase = jax.lax.fori_loop(0, size, column, (whole, *first))
    return whole[..., size:], phase * jnp.exp(logarithm - logarithm.max())


@eliminated.defjvp
def _eliminated_slope(
    primals: tuple[Array, Array], tangents: tuple[Array, Array]
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """d(A^-1 B) = A^-1 (dB - dA A^-1 B), d det A = det A tr(A^-1 dA): the steps of the elimination need no derivatives."""
    (matrix, right), (matrix_slope, right_slope) = primals, tangents
    undone, determinant = eliminated(matrix, jnp.eye(matrix.shape[-1]))
    solved = product(undone, right)
    slope = product(undone, right_slope - product(matrix_slope, solved))
    return (solved, determinant), (slope, determinant * (undone * jnp.swapaxes(matrix_slope, -1, -2)).sum(axis=(-2, -1)))


def _size(value: Array) -> Array:
    """Absolute value, of complex numbers in the norm that takes no root."""
    return jnp.abs(value.real) + jnp.abs(value.imag) if jnp.iscomplexobj(value) else jnp.abs(value)


def product(first: Array, second: Array) -> Array:
    """Products of small matrices, in one loop."""
    return (first[..., None] * second[..., None, :, :]).sum(axis=-2)


def solved(matrix: Array, right: Array) -> Array:
    """X of A X = B for small arrays (n, n) and (n, m); NaN where A is exactly singular.

    Own elimination: LAPACK below `vmap`, called for thousands of matrices or from two threads, can stop XLA on CPUs for ever.
    """
    found, size = _reduced(matrix, right)
    return jnp.where(size == 0, jnp.nan, found)


def determinant(matrix: Array) -> Array:
    """Determinant of a small array (n, n); see `solved`."""
    return _reduced(matrix, jnp.zeros((len(matrix), 0)))[1]


def _reduced(matrix: Array, right: Array) -> tuple[Array, Array]:
    """A^-1 B, of no meaning where A is singular, and det A; by Gauss and Jordan with the greatest pivot of each column."""
    size = len(matrix)
    rows, determinant = jnp.concatenate([matrix, right], axis=1), jnp.ones(())
    for k in range(size):
        pivot = k + jnp.argmax(jnp.abs(rows[k:, k]))
        here, there = rows[k], rows[pivot]
        rows = rows.at[pivot].set(here)
        determinant = determinant * jnp.where(pivot == k, 1.0, -1.0) * there[k]
        head = there / jnp.where(there[k] == 0, 1.0, there[k])  # a determinant of zero stays zero, and no NaN
        rows = (rows - rows[:, k, None] * head).at[k].set(head)
    return rows[:, size:], determinant
