"""Small systems of linear equations of named components, with zeros known at trace time."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp

from trivet.space.scalar import Scalar, is_known, is_zero, mul, sub

_LEAST_PIVOT = 1e-3
"""A known number below this is a rounding error of an oblique axis, or nearly one."""

Rows = list[list[Scalar]]


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
