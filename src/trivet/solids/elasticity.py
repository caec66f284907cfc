"""Stiffness and consistent mass of a solid: linear, isotropic, small displacements."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from trivet.errors import InputError
from trivet.model.section import Material
from trivet.solids.grid import Grid, scikit_fem

ORDER = {"hexahedra": 5, "tetrahedra": 4}
"""Degree of polynomials that quadrature integrates exactly: that of the mass of an element with straight edges."""
AT_ONCE = 2000
"""Elements whose matrices are worked out together: some 200 MB."""


class Elastic(NamedTuple):
    """Matrices of a solid on its 3 n displacements, (x, y, z) node by node."""

    stiffness: sp.csc_matrix
    """(3 n, 3 n), N/m."""
    mass: sp.csc_matrix
    """(3 n, 3 n), kg."""


def elastic(grid: Grid, material: Material) -> Elastic:
    """The matrices of a solid.

    Raises:
        InputError: the mesh has an element that is turned inside out.
    """
    made = scikit_fem()
    basis = made.Basis(grid.mesh, grid.mesh.elem(), intorder=ORDER[grid.kind])
    if np.any(_determinants(basis) <= 0):
        raise InputError(f"{grid.name}: the mesh has elements turned inside out; give a finer mesh, or mend the shape")
    shear = float(material.shear_modulus)
    poisson = float(material.poisson_ratio)
    lame = 2 * shear * poisson / (1 - 2 * poisson)
    values = np.array([np.broadcast_to(np.asarray(own[0]), basis.dx.shape) for own in basis.basis])  # (i, e, q)
    slopes = np.array([own[0].grad for own in basis.basis])  # (i, 3, e, q)
    dofs = np.asarray(basis.element_dofs)
    size = 3 * grid.points.shape[1]
    stiffness, mass = sp.csc_matrix((size, size)), sp.csc_matrix((size, size))
    for start in range(0, grid.elements, AT_ONCE):
        some = slice(start, start + AT_ONCE)
        weight = basis.dx[some]
        stiffness += _scattered(_stiffnesses(slopes[:, :, some], weight, lame, shear), dofs[:, some], size)
        mass += _scattered(_masses(values[:, some], weight * float(material.density)), dofs[:, some], size)
    return Elastic(stiffness, mass)


def _determinants(basis: object) -> np.ndarray:
    """(e, q) of the maps from the unit element, all of one sign where no element is turned inside out."""
    own = basis.mapping.detDF(basis.X)  # type: ignore[attr-defined]
    signed: np.ndarray = own * np.sign(np.median(own))
    return signed


def _stiffnesses(slopes: np.ndarray, weight: np.ndarray, lame: float, shear: float) -> np.ndarray:
    """(e, k, 3, k, 3) of every element: lame div u div v + 2 shear eps(u) : eps(v)."""
    nodes, _, count, places = slopes.shape
    flat = slopes.transpose(2, 0, 1, 3).reshape(count, 3 * nodes, places)
    products = ((flat * weight[:, None, :]) @ flat.transpose(0, 2, 1)).reshape(count, nodes, 3, nodes, 3)
    found: np.ndarray = lame * products + shear * products.transpose(0, 1, 4, 3, 2)
    whole = shear * np.einsum("eiaja->eij", products)
    for axis in range(3):
        found[:, :, axis, :, axis] += whole
    return found


def _masses(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(e, k, 3, k, 3) of every element."""
    flat = values.transpose(1, 0, 2)
    plain = (flat * weight[:, None, :]) @ flat.transpose(0, 2, 1)
    whole: np.ndarray = np.einsum("eij,ab->eiajb", plain, np.eye(3))
    return whole


def _scattered(blocks: np.ndarray, dofs: np.ndarray, size: int) -> sp.csc_matrix:
    own = (3 * dofs.T[:, :, None] + np.arange(3)).reshape(len(blocks), -1).astype(np.int32)
    shape = (len(blocks), own.shape[1], own.shape[1])
    rows, columns = np.broadcast_to(own[:, :, None], shape), np.broadcast_to(own[:, None, :], shape)
    return sp.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsc()
