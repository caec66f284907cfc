"""Small symmetric matrices of named components, with structural zeros.

A matrix is a list of rows; only the upper triangle is stored and zeros that are known at trace time stay Python zeros.
Inversion splits the matrix into its structurally independent blocks, so that the in-plane and out-of-plane halves of a
planar chain are inverted apart without anybody saying so.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from trivet.space.scalar import Scalar, add, is_zero, mul, sub

Rows = list[list[Scalar]]


class Symmetric:
    """A symmetric n x n matrix of scalars."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.rows: Rows = [[0] * size for _ in range(size)]

    def __getitem__(self, index: tuple[int, int]) -> Scalar:
        i, j = index
        return self.rows[min(i, j)][max(i, j)]

    def __setitem__(self, index: tuple[int, int], value: Scalar) -> None:
        i, j = index
        self.rows[min(i, j)][max(i, j)] = value

    @classmethod
    def of(cls, size: int, upper: Iterable[Scalar]) -> Symmetric:
        """A matrix from its upper triangle by rows."""
        matrix, entries = cls(size), iter(upper)
        for i in range(size):
            for j in range(i, size):
                matrix[i, j] = next(entries)
        return matrix

    def upper(self) -> list[Scalar]:
        """The upper triangle by rows."""
        return [self[i, j] for i in range(self.size) for j in range(i, self.size)]

    def plus(self, other: Symmetric) -> Symmetric:
        """Sum of two matrices of one size."""
        result = Symmetric(self.size)
        for i in range(self.size):
            for j in range(i, self.size):
                result[i, j] = add(self[i, j], other[i, j])
        return result

    def add_dyad(self, v: Sequence[Scalar], factor: Scalar = 1) -> None:
        """Add factor * v v^T."""
        for i in range(self.size):
            scaled = mul(factor, v[i])
            for j in range(i, self.size):
                self[i, j] = add(self[i, j], mul(scaled, v[j]))

    def block(self, indices: Sequence[int]) -> Symmetric:
        """The submatrix of the given rows and columns."""
        part = Symmetric(len(indices))
        for a, i in enumerate(indices):
            for b in range(a, len(indices)):
                part[a, b] = self[i, indices[b]]
        return part

    def blocks(self) -> Iterable[list[int]]:
        """Index sets that no structural nonzero couples."""
        left = set(range(self.size))
        while left:
            found, todo = set[int](), [min(left)]
            while todo:
                i = todo.pop()
                found.add(i)
                todo += [j for j in left - found if not is_zero(self[i, j])]
            left -= found
            yield sorted(found)

    def inverse(self) -> Symmetric:
        """The inverse, block by block."""
        result = Symmetric(self.size)
        for indices in self.blocks():
            inner = _inverse(self.block(indices))
            for a, i in enumerate(indices):
                for b in range(a, len(indices)):
                    result[i, indices[b]] = inner[a, b]
        return result

    def products(self, columns: Sequence[Sequence[Scalar]], pairs: Sequence[tuple[int, int]]) -> tuple[list[Scalar], Scalar]:
        """a^T M^-1 b of pairs (a, b) of columns, and det M, by elimination from the last row to the first."""
        rows, left = [list(row) for row in self.full()], [list(column) for column in columns]
        found: list[Scalar] = [0] * len(pairs)
        determinant: Scalar = 1
        for last in reversed(range(self.size)):
            pivot = rows[last][last]
            determinant = mul(determinant, pivot)
            for k, (a, b) in enumerate(pairs):
                product = mul(left[a][last], left[b][last])
                found[k] = add(found[k], 0 if is_zero(product) else product / pivot)
            for i in range(last):
                if not is_zero(rows[i][last]):
                    share = rows[i][last] / pivot
                    for j in range(i + 1):
                        rows[i][j] = sub(rows[i][j], mul(share, rows[last][j]))
                    for column in left:
                        column[i] = sub(column[i], mul(share, column[last]))
            for i in range(last):
                for j in range(i):
                    rows[j][i] = rows[i][j]
        return found, determinant

    def full(self) -> tuple[tuple[Scalar, ...], ...]:
        """All entries by rows."""
        return tuple(tuple(self[i, j] for j in range(self.size)) for i in range(self.size))


def _inverse(m: Symmetric) -> Symmetric:
    """Inverse of one block: adjugate up to 3 x 3, above that by the Schur complement of the leading 3 x 3."""
    if m.size > 3:
        return _inverse_by_complement(m)
    adjugate = Symmetric(m.size)
    if m.size == 1:
        adjugate[0, 0] = 1
    elif m.size == 2:
        adjugate[0, 0], adjugate[0, 1], adjugate[1, 1] = m[1, 1], -m[0, 1], m[0, 0]
    else:
        for i in range(3):
            for j in range(i, 3):
                # Cyclic cofactors carry their own sign.
                p, q, r, s = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
                adjugate[i, j] = sub(mul(m[p, r], m[q, s]), mul(m[p, s], m[q, r]))
    determinant: Scalar = 0
    for j in range(m.size):
        determinant = add(determinant, mul(m[0, j], adjugate[0, j]))
    scale = 1 / determinant
    for i in range(m.size):
        for j in range(i, m.size):
            adjugate[i, j] = mul(adjugate[i, j], scale)
    return adjugate


def _inverse_by_complement(m: Symmetric) -> Symmetric:
    head, tail = list(range(3)), list(range(3, m.size))
    a_inverse = m.block(head).inverse()
    coupling = [[m[i, j] for j in tail] for i in head]
    # g = A^-1 B, complement = D - B^T g
    g = [[dot([a_inverse[i, k] for k in head], [row[j] for row in coupling]) for j in range(len(tail))] for i in head]
    complement = m.block(tail)
    for a in range(len(tail)):
        for b in range(a, len(tail)):
            complement[a, b] = sub(complement[a, b], dot([row[a] for row in coupling], [row[b] for row in g]))
    d = complement.inverse()
    gd = [[dot(row, [d[k, b] for k in range(len(tail))]) for b in range(len(tail))] for row in g]
    result = Symmetric(m.size)
    for i in head:
        for j in range(i, 3):
            result[i, j] = add(a_inverse[i, j], dot(gd[i], g[j]))
        for b, j in enumerate(tail):
            result[i, j] = mul(-1, gd[i][b])
    for a, i in enumerate(tail):
        for b in range(a, len(tail)):
            result[i, tail[b]] = d[a, b]
    return result


def dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    """Sum of products."""
    total: Scalar = 0
    for p, q in zip(a, b, strict=True):
        total = add(total, mul(p, q))
    return total
