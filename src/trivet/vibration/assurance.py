"""The modal assurance criterion: how alike modes are, and modes that coincide.

The MAC of two modes is the square of the cosine between them (R. J. Allemang and D. L. Brown, A correlation coefficient for
modal vector analysis, Proc. 1st IMAC, 1982, 110-116); here between vectors whose inner product is mass (`vibration.kinetic`).
"""

from __future__ import annotations

import numpy as np

DOUBLE = 1e-6
"""Relative difference of frequencies below which modes are as good as any mixture of them."""


def coinciding(frequency: np.ndarray) -> list[list[int]]:
    """Numbers of modes in runs whose frequencies (p,), ascending, are alike."""
    apart = np.flatnonzero(np.diff(frequency) > DOUBLE * frequency[1:]) + 1
    return [[int(k) for k in run] for run in np.split(np.arange(len(frequency)), apart)]


def overlap(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(p, q): inner products of vectors (N, p) and (N', q), the shorter ones going on with zeros."""
    rows = min(len(first), len(second))
    found: np.ndarray = first[:rows].T @ second[:rows]
    return found


def assurance(cosines: np.ndarray, before: list[list[int]], after: list[list[int]]) -> np.ndarray:
    """(p, q) MAC of modes with inner products (p, q); of runs that coincide, that of the spaces which they span.

    Of two spaces it is the mean square of the cosines of their principal angles, in as many directions as the smaller one has.
    """
    found = np.zeros_like(cosines)
    for one in before:
        for other in after:
            block = np.ix_(one, other)
            found[block] = np.sum(cosines[block] ** 2) / min(len(one), len(other))
    return found


def nearest(cosines: np.ndarray) -> np.ndarray:
    """(q, q) orthogonal: its first r columns mix q vectors to what is nearest to r others; from inner products (r, q)."""
    left, _, right = np.linalg.svd(cosines)
    turn = right.T.copy()
    turn[:, : len(left)] = turn[:, : len(left)] @ left.T
    return turn


def run_numbers(frequency: np.ndarray) -> np.ndarray:
    """(p,): the same number for modes that coincide."""
    runs = coinciding(frequency)
    return np.repeat(np.arange(len(runs)), [len(run) for run in runs])


def difference(one: float, other: float) -> float:
    """Of the squares of two frequencies; none where they are alike."""
    return 0.0 if abs(one - other) <= DOUBLE * max(one, other) else float(one**2 - other**2)
