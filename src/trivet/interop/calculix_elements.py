"""Solids in the elements of CalculiX: bricks with 20 nodes, tetrahedra with 10.

Bricks here have 27 nodes; those in the middle of faces and of bricks are left out, where CalculiX goes by the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trivet.solids.ends import Face
from trivet.solids.grid import Grid, Kind, reference

TYPES: dict[Kind, str] = {"hexahedra": "C3D20R", "tetrahedra": "C3D10"}
"""Names of the elements; bricks with reduced integration, which do not lock in bending."""
_BOTTOM = ((0, 0), (2, 0), (2, 2), (0, 2))
_MIDDLES = ((1, 0), (2, 1), (1, 2), (0, 1))
_ORDER: dict[Kind, np.ndarray] = {
    "hexahedra": np.array(
        [(*at, level) for ring in (_BOTTOM, _MIDDLES) for level in (0, 2) for at in ring] + [(*at, 1) for at in _BOTTOM]
    ) / 2,
    "tetrahedra": np.array(
        [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
    ) / 2,
}  # fmt: skip
"""Where CalculiX has the nodes of an element in its unit cube, or unit tetrahedron: corners, then middles of edges."""


class Elements(NamedTuple):
    """The elements of a solid."""

    type: str
    nodes: np.ndarray
    """(k,): numbers of those nodes of the grid that they have."""
    corners: np.ndarray
    """(e, 20 or 10): of every element its nodes, by their places among `nodes`."""


def elements(grid: Grid) -> Elements:
    """A mesh in CalculiX's elements."""
    own = _dofs(grid)[_local(grid.kind)].T
    nodes, places = np.unique(own, return_inverse=True)
    return Elements(TYPES[grid.kind], nodes, places.reshape(own.shape))


def without_middles(grid: Grid, own: Face) -> Face:
    """An end face on the nodes that CalculiX has: what its middles have a share in goes to those around.

    On a face with 8 nodes the middle moves by half of the middles of edges, less a quarter of the corners.
    """
    if grid.kind == "tetrahedra":
        return own
    dofs, at, kept = _dofs(grid), reference(grid.kind), _local(grid.kind)
    shares, moments = np.zeros(grid.points.shape[1]), np.zeros((grid.points.shape[1], 3))
    shares[own.nodes], moments[own.nodes] = own.shares, own.moments
    middles = np.flatnonzero((at == 0.5).sum(axis=1) == 2)
    for middle in middles:
        across = int(np.flatnonzero(at[middle] != 0.5)[0])
        around = kept[at[kept, across] == at[middle, across]]
        weight = np.where((at[around] == 0.5).any(axis=1), 0.5, -0.25)
        here = np.isin(dofs[middle], own.nodes)
        ours, theirs = dofs[middle, here], dofs[around][:, here]
        np.add.at(shares, theirs, weight[:, None] * shares[ours])
        np.add.at(moments, theirs, weight[:, None, None] * moments[ours])
    left = np.isin(own.nodes, dofs[kept])
    nodes = own.nodes[left]
    return Face(nodes, own.arms[left], shares[nodes], moments[nodes])


def _dofs(grid: Grid) -> np.ndarray:
    """(27 or 10, e): numbers of the nodes of every element."""
    return np.asarray(grid.mesh.dofs.element_dofs)


def _local(kind: Kind) -> np.ndarray:
    """(20 or 10,): places of CalculiX's nodes among those of an element here."""
    apart = np.abs(_ORDER[kind][:, None] - reference(kind)).sum(axis=2)
    found: np.ndarray = np.argmin(apart, axis=1)
    return found
