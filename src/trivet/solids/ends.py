"""Ends of a solid: how the nodes of an end face follow a point with six freedoms, the node of the machine at that end.

Three ways, of which beam theory means the first:

- "plane": the face stays plane and turns with the point; in its plane its mean displacement and mean turn are those of the
  point, and it is otherwise free.  It may contract as Poisson's ratio asks for; warping in torsion and in shear is held.
- "rigid": every node follows.  Contraction is held back as well.
- "mean": the mean displacement and the mean turn of the face follow, in all six freedoms; it may warp (a distributing
  coupling).

Means are over the area, so that a load at the point acts as an even traction, and a moment as a linear one.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from trivet.errors import InputError
from trivet.solids.grid import Grid, scikit_fem
from trivet.statics.structure import carry

Ends = Literal["plane", "rigid", "mean"]
ENDS: tuple[Ends, ...] = ("plane", "rigid", "mean")

MOST_ON_FACE = 1000
"""Nodes of an end face: what is free on it couples with all the rest of it."""


class Face(NamedTuple):
    """An end face of f nodes."""

    nodes: np.ndarray
    """(f,) numbers."""
    arms: np.ndarray
    """(f, 3) from the point at the end of the axis, m."""
    shares: np.ndarray
    """(f,): integral of the node's shape over the face, m^2."""
    moments: np.ndarray
    """(f, 3): that of the shape times the arm, m^3."""

    @property
    def area(self) -> float:
        """m^2."""
        return float(self.shares.sum())


def face(grid: Grid, at: float) -> Face:
    """The end face at x (m).

    Raises:
        InputError: there is none, or it has too many nodes.
    """
    made, facets = scikit_fem(), grid.faces(at)
    if not len(facets):
        raise InputError(f"{grid.name}: no end face at x = {1e3 * at:g} mm; an end is plane, and across the x axis")
    basis = made.FacetBasis(grid.mesh, grid.mesh.elem(), facets=facets, intorder=4)
    count, places = grid.points.shape[1], np.asarray(basis.global_coordinates()) - np.array([at, 0, 0])[:, None, None]
    shares, moments = np.zeros(count), np.zeros((count, 3))
    for own, dofs in zip(basis.basis, basis.element_dofs, strict=True):
        weight = np.broadcast_to(np.asarray(own[0]), basis.dx.shape) * basis.dx
        np.add.at(shares, dofs, weight.sum(axis=1))
        np.add.at(moments, dofs, (weight * places).sum(axis=2).T)
    nodes = np.unique(grid.mesh.dofs.get_facet_dofs(facets).flatten())
    if len(nodes) > MOST_ON_FACE:
        raise InputError(f"{grid.name}: {len(nodes):,} nodes on an end face; at most {MOST_ON_FACE:,}, give a coarser mesh")
    arms = grid.points[:, nodes].T - np.array([at, 0, 0])
    return Face(nodes, arms, shares[nodes], moments[nodes])


def coupling(grid: Grid, ends: Ends) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """(3 n, 12) and (3 n, i): all displacements from those of the two points, and from what is left free, independent.

    Of the 12 each point has three displacements (m) and three rotations (rad), the near end first.
    """
    count = grid.points.shape[1]
    faces = face(grid, 0.0), face(grid, grid.length)
    points, free, taken = [], [], np.zeros(count, dtype=bool)
    for own in faces:
        dofs = (3 * own.nodes[:, None] + np.arange(3)).ravel()
        rows = sp.csr_matrix((np.ones(len(dofs)), (dofs, np.arange(len(dofs)))), shape=(3 * count, len(dofs)))
        points.append(rows @ carry(own.arms)[:, :3].reshape(-1, 6))
        free.append(rows @ _free(own, ends))
        taken[own.nodes] = True
    rest = (3 * np.flatnonzero(~taken)[:, None] + np.arange(3)).ravel()
    inside = sp.csr_matrix((np.ones(len(rest)), (rest, np.arange(len(rest)))), shape=(3 * count, len(rest)))
    return sp.csr_matrix(np.hstack(points)), sp.csr_matrix(sp.hstack([inside, *free]))


def _free(own: Face, ends: Ends) -> np.ndarray:
    """(3 f, k) orthonormal: displacements of a face beside those of its point, as far as the point leaves them free."""
    count = len(own.nodes)
    if ends == "rigid":
        return np.zeros((3 * count, 0))
    across = slice(1, 3) if ends == "plane" else slice(0, 3)
    means = _means(own, ends)[:, across]
    conditions = means.reshape(-1, means.shape[-1])
    null = scipy.linalg.qr(conditions)[0][:, conditions.shape[1] :]
    whole = np.zeros((count, 3, null.shape[1]))
    whole[:, across] = null.reshape(count, -1, null.shape[1])
    found: np.ndarray = whole.reshape(3 * count, -1)
    return found


def held(own: Face, ends: Ends) -> np.ndarray:
    """(c, 3 f): what is zero of the displacements of a face beside those of its point, (x, y, z) node by node."""
    every = np.eye(3 * len(own.nodes))
    if ends == "rigid":
        return every
    means = _means(own, ends).reshape(len(every), -1).T
    return means if ends == "mean" else np.vstack([every[::3], means])


def _means(own: Face, ends: Ends) -> np.ndarray:
    """(f, 3, k): mean displacements, each by a share of the face, and mean turns, as far as they follow the point."""
    means = np.einsum("f,ab->fab", own.shares, np.eye(3))
    turns = np.stack([np.cross(unit, own.moments) for unit in np.eye(3)], axis=-1)
    rates = np.concatenate([means / own.area, turns / own.area**1.5], axis=-1)
    return rates[:, :, [1, 2, 3]] if ends == "plane" else rates
