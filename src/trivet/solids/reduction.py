"""A solid reduced to the motions of its two ends and its slow fixed-interface modes (Craig and Bampton, AIAA J. 6:1313, 1968).

The static answer to motions of the ends is exact, and so is the mass that moves with them; what is left out is how modes that
are faster than the cut-off, with the ends held, resist.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from trivet.errors import InputError
from trivet.model.section import Material
from trivet.solids.elasticity import Elastic, elastic
from trivet.solids.ends import Ends, coupling
from trivet.solids.grid import Grid
from trivet.statics.structure import carry

BEYOND = 8.0
"""Cut-off of fixed-interface modes, against the highest frequency that is asked for."""
LEAST_MODES, MOST_MODES = 24, 400
"""Fixed-interface modes of every solid but for the last of them and its like, also beyond the cut-off; and at most."""
PLACES = (0.25, 0.5, 0.75)
"""Where the motion of the axis is known, against the length."""
PAIR = 1e-3
"""Relative difference of frequencies within which modes may be a pair."""


class Reduced(NamedTuple):
    """A solid with 12 freedoms at its ends, (u, w) of the near and of the far one, and i fixed-interface modes of unit mass."""

    stiffness: np.ndarray
    """(12 + i, 12 + i), SI."""
    mass: np.ndarray
    """(12 + i, 12 + i), SI."""
    grid: Grid
    ends: Ends
    cut_off: float
    """Hz: all fixed-interface modes below are among the internal coordinates, and some beyond where these are few."""
    modes: np.ndarray
    """(i,) their frequencies, Hz."""
    weight: float
    """kg."""
    centre: np.ndarray
    """(3,) m, from the near point."""
    inertia: np.ndarray
    """(3, 3) about the centre, kg m^2."""
    axis: np.ndarray
    """(18, 12 + i): twists at `PLACES` on the axis, mean ones of the nodes within one element of there."""


def reduced(grid: Grid, material: Material, highest: float, ends: Ends = "plane") -> Reduced:
    """A solid reduced for frequencies (Hz) up to a highest one.

    Raises:
        InputError: for a mesh, or ends, that cannot be; a solid with too many modes below the cut-off.
    """
    whole = elastic(grid, material)
    points, free = coupling(grid, ends)
    stiffness, mass = (sp.csc_matrix(free.T @ m @ free) for m in whole)
    factors = scipy.sparse.linalg.splu(
        stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    follow = -factors.solve((free.T @ whole.stiffness @ points).toarray())
    static = points.toarray() + free @ follow
    cut_off = BEYOND * highest
    frequencies, shapes = _held(grid.name, stiffness, mass, factors, cut_off)
    basis = np.hstack([static, free @ shapes])
    small = basis.T @ (whole.mass @ basis)
    rates = np.zeros_like(small)
    rates[:12, :12] = _without_rigid(static.T @ (whole.stiffness @ static), grid.length)
    inner = np.arange(12, len(small))
    rates[inner, inner] = (2 * math.pi * frequencies) ** 2
    small = (small + small.T) / 2
    return Reduced(rates, small, grid, ends, cut_off, frequencies, *_weight(whole, grid), _axis(grid, basis))


def _held(
    name: str, stiffness: sp.csc_matrix, mass: sp.csc_matrix, factors: Any, cut_off: float
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (i,) in Hz and shapes (n, i) of unit modal mass of a solid whose ends are held, those below the cut-off (Hz),
    and some beyond where these are few."""
    size = stiffness.shape[0]
    if not mass.diagonal().any():
        return np.zeros(0), np.zeros((size, 0))
    inverse = scipy.sparse.linalg.LinearOperator((size, size), matvec=factors.solve)
    start = np.cos(np.arange(size) ** 2)  # any vector, but the same every time
    count = min(LEAST_MODES, size // 2)
    while True:
        squares, shapes = scipy.sparse.linalg.eigsh(stiffness, count, mass, sigma=0.0, OPinv=inverse, v0=start)
        frequencies = np.sqrt(np.sort(squares)) / (2 * math.pi)
        if frequencies[-1] > cut_off:
            break
        if count >= MOST_MODES:
            raise InputError(
                f"{name}: more than {MOST_MODES} modes below {cut_off:g} Hz with its ends held, {BEYOND:g} times the highest "
                "frequency; lower that"
            )
        count = min(2 * count, MOST_MODES, size // 2)
    # Never one of a pair alone: symmetric parts must stay symmetric.
    last = frequencies[min(count, LEAST_MODES) - 1]
    own = np.argsort(squares)[frequencies < max(cut_off, (1 - PAIR) * last)]
    normal = shapes[:, own]
    return frequencies[: len(own)], normal / np.sqrt(np.einsum("im,im->m", normal, mass @ normal))


def _without_rigid(stiffness: np.ndarray, length: float) -> np.ndarray:
    """A stiffness (12, 12) freed of what rounding makes rigid motions cost."""
    scale = np.repeat([1.0, 1 / length, 1.0, 1 / length], 3)  # rotations times the length are displacements
    rigid = np.vstack([np.eye(6), np.eye(6)])
    rigid[7, 5], rigid[8, 4] = length, -length
    basis = np.linalg.qr(rigid / scale[:, None])[0]
    keep = np.eye(12) - basis @ basis.T
    inside = keep @ (scale[:, None] * (stiffness + stiffness.T) / 2 * scale) @ keep
    found: np.ndarray = inside / scale[:, None] / scale
    return (found + found.T) / 2


def _weight(whole: Elastic, grid: Grid) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre, and inertia about it."""
    points = grid.points.T
    moved = np.zeros((len(points), 3, 6))
    moved[:, :, :3] = np.eye(3)
    for axis in range(3):
        moved[:, :, 3 + axis] = np.cross(np.eye(3)[axis], points)
    flat = moved.reshape(-1, 6)
    six = flat.T @ (whole.mass @ flat)
    mass = float(six[0, 0])
    first = np.array([six[5, 1], six[3, 2], six[4, 0]])
    centre = first / mass if mass else first
    inertia = six[3:, 3:] - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return mass, centre, inertia


def _axis(grid: Grid, basis: np.ndarray) -> np.ndarray:
    """(18, 12 + i), as `Reduced` has it, from the displacements (3 n, 12 + i) of all nodes."""
    found = []
    for place in PLACES:
        arms = grid.points.T - np.array([place * grid.length, 0, 0])
        near = np.abs(arms[:, 0]) < grid.size
        rigid = carry(arms[near])[:, :3].reshape(-1, 6)
        found.append(np.linalg.lstsq(rigid, basis[np.repeat(near, 3)])[0])
    return np.concatenate(found)
