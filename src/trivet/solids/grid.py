"""A solid as a mesh of second order, in its own frame: x from its near end (0, 0, 0) to its far end (length, 0, 0).

The elements, their shape functions and quadrature are those of scikit-fem (Gustafsson and McBain, J. Open Source Software
5:2369, 2020), which is imported when it is first needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from trivet.errors import InputError

MOST_NODES = 15_000
"""Of one part; a compact one takes minutes then, and its factors fill 1 GB."""
FLAT = 1e-6
"""Distance from an end, against the length, within which a node lies on it."""

Kind = Literal["hexahedra", "tetrahedra"]


@dataclass(frozen=True)
class Grid:
    """A mesh of one solid."""

    name: str
    """What messages call it."""
    kind: Kind
    mesh: Any
    """scikit-fem's, of triquadratic hexahedra or quadratic tetrahedra; m."""
    length: float
    """m."""
    size: float
    """Edge of an element as it was asked for, m."""

    @property
    def points(self) -> np.ndarray:
        """(3, n) nodes, m."""
        return np.asarray(self.mesh.doflocs)

    @property
    def elements(self) -> int:
        """How many."""
        return int(self.mesh.t.shape[1])

    def faces(self, at: float) -> np.ndarray:
        """Numbers of the faces of elements on the end at x (m)."""
        found: np.ndarray = self.mesh.facets_satisfying(lambda x: np.abs(x[0] - at) < FLAT * self.length, boundaries_only=True)
        return found


def grid(name: str, kind: Kind, points: np.ndarray, elements: np.ndarray, length: float, size: float) -> Grid:
    """A mesh from its nodes.

    Args:
        name: what messages call it.
        kind: of elements.
        points: (3, n) m, every one of them a node of some element.
        elements: (27 or 10, e) numbers of nodes, in the order of `reference`.
        length, size: m.

    Raises:
        InputError: for too many nodes, or without scikit-fem.
    """
    if points.shape[1] > MOST_NODES:
        raise InputError(f"{name}: a mesh of {points.shape[1]:,} nodes; at most {MOST_NODES:,}, give a coarser mesh")
    made = scikit_fem()
    shape = made.MeshHex2 if kind == "hexahedra" else made.MeshTet2
    return Grid(name, kind, shape(points, elements), length, size)


def reference(kind: Kind) -> np.ndarray:
    """(27 or 10, 3): where the nodes of an element lie in its unit cube, or unit tetrahedron."""
    made = scikit_fem()
    return np.asarray((made.ElementHex2() if kind == "hexahedra" else made.ElementTetP2()).doflocs)


def scikit_fem() -> Any:
    """The module.

    Raises:
        InputError: it is not installed.
    """
    try:
        import skfem
    except ImportError:
        raise InputError("solids need scikit-fem; install it with: pip install 'trivet[solids]'") from None
    return skfem
