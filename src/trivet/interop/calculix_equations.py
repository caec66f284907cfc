"""Linear equations between freedoms as CalculiX wants them: each solved for a freedom which no other is solved for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import scipy.linalg

from trivet.statics.assembly import PLATFORM, Structure
from trivet.vibration.independent import independent

NOTHING = 1e-12
"""Coefficient, against that of the freedom for which an equation is solved, that is rounding."""
PREFERRED = 1e3
"""How much rather the platform and the joints than other nodes keep their freedoms."""
PER_LINE = 4
"""Terms of an equation on a line."""

Freedom = tuple[int, int]
"""Number of a node, and 1, 2 or 3."""


class Dependence(NamedTuple):
    """How the displacements of a structure follow from some of them: 6 per node, then the deflections of joints' screws."""

    fixed: np.ndarray
    """Numbers of those that are zero."""
    free: np.ndarray
    """(f,) numbers of those from which others follow."""
    rest: np.ndarray
    """(r,) numbers of the others."""
    follow: np.ndarray
    """(r, f): the others from the free ones."""


def dependence(structure: Structure) -> Dependence:
    """What the joints of a structure make of its displacements."""
    whole = independent(structure).toarray()
    weight, joints = np.ones(len(whole)), 6 * len(structure.nodes)
    weight[6 * PLATFORM : 6 * PLATFORM + 6] = weight[joints:] = PREFERRED
    order = scipy.linalg.qr((weight[:, None] * whole).T, mode="r", pivoting=True)[1]
    moves = np.abs(whole).max(axis=1) > NOTHING
    free = np.sort(order[: whole.shape[1]])
    rest = np.setdiff1d(np.flatnonzero(moves), free)
    return Dependence(np.flatnonzero(~moves), free, rest, np.linalg.solve(whole[free].T, whole[rest].T).T)


def solved(rows: np.ndarray, dependent: int) -> Iterator[np.ndarray]:
    """Rows (c, m) times freedoms that are zero, so combined that each has a 1 where the others have none.

    That freedom, which comes first in what is given, is one of the first `dependent`.

    Yields:
        Per row the places of its terms.  The rows are changed in place.
    """
    pivots: list[int] = []
    for number, row in enumerate(rows):
        pivots.append(int(np.argmax(np.abs(row[:dependent]))))
        row /= row[pivots[-1]]
        others = np.flatnonzero(rows[:, pivots[-1]])
        others = others[others != number]
        rows[others] -= np.outer(rows[others, pivots[-1]], row)
    for row, pivot in zip(rows, pivots, strict=True):
        terms = np.flatnonzero(np.abs(row) > NOTHING)
        yield np.r_[pivot, terms[terms != pivot]]


def equation(freedoms: Sequence[Freedom], coefficients: Sequence[float] | np.ndarray) -> Iterator[str]:
    """Lines that make a sum of freedoms times coefficients zero, solved for the first."""
    yield f"*EQUATION\n{len(freedoms)}"
    terms = [f"{node}, {way}, {own:.12e}" for (node, way), own in zip(freedoms, coefficients, strict=True)]
    for start in range(0, len(terms), PER_LINE):
        yield ", ".join(terms[start : start + PER_LINE])
