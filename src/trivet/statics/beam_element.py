"""The 12-dof beam element of matrix structural analysis (paper Eq 36).

The degrees of freedom are (u, w) of the first node, then (u, w) of the second: three displacements (m) and three small
rotations (rad) each.  In local axes x runs from the first node to the second.  All arrays may carry leading batch axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trivet.model.elements import Profile, Stock

# Places of the bending dofs (v1, w1, v2, w2) of the two planes, and the sign with which a rotation follows the slope.
_PLANES = ((np.array([1, 5, 7, 11]), 1.0), (np.array([2, 4, 8, 10]), -1.0))


@dataclass(frozen=True)
class BeamElement:
    """A straight uniform beam between two nodes."""

    name: str
    """Chain and element to which it belongs: "leg-1.link"."""
    first: int
    """Number of the node at which it starts."""
    second: int
    """Number of the node at which it ends."""
    axes: np.ndarray
    """(..., 3, 3): columns are its local axes in {O}."""
    length: np.ndarray
    """(...): distance of its nodes, above zero, m."""
    stiffness: np.ndarray
    """(..., 12, 12): K^i of Eq 36, in its local axes."""
    line_mass: float
    """Mass per length, kg/m."""


def local_stiffness(length: np.ndarray, profile: Profile, stock: Stock) -> np.ndarray:
    """Stiffness (..., 12, 12) of a beam in its local axes, Euler-Bernoulli or Timoshenko as `stock.theory` says.

    Args:
        length: (...) above zero, m.
        profile: section and material, by name.
        stock: where the names lead.
    """
    material = stock.materials[profile.material]
    section = stock.sections[profile.section].properties(material.poisson_ratio)
    young, shear = float(material.youngs_modulus), float(material.shear_modulus)
    k = np.zeros((*np.shape(length), 12, 12))
    _spread(k, 0, young * float(section.area) / length)
    _spread(k, 3, shear * float(section.torsion) / length)
    bending = ((section.inertia_z, section.shear_area_y), (section.inertia_y, section.shear_area_z))
    for (places, sign), (inertia, shear_area) in zip(_PLANES, bending, strict=True):
        flexural = young * float(inertia)
        # Ratio of shear to bending deflection; zero makes the element Euler-Bernoulli's.
        phi = 12 * flexural / (shear * float(shear_area) * length**2) if stock.theory == "timoshenko" else np.zeros_like(length)
        k[..., places[:, None], places] = _bending(length, flexural, phi, sign)
    return k


def _spread(k: np.ndarray, place: int, rate: np.ndarray) -> None:
    """A spring between equal dofs of the two nodes."""
    k[..., place, place] = k[..., place + 6, place + 6] = rate
    k[..., place, place + 6] = k[..., place + 6, place] = -rate


def _bending(length: np.ndarray, flexural: float, phi: np.ndarray, sign: float) -> np.ndarray:
    """Stiffness (..., 4, 4) of bending in one plane (Przemieniecki, Theory of Matrix Structural Analysis, eq 5.116)."""
    one = np.ones_like(length)
    arm, near, far = 6 * sign * length, (4 + phi) * length**2, (2 - phi) * length**2
    rows = [[12 * one, arm, -12 * one, arm], [arm, near, -arm, far], [-12 * one, -arm, 12 * one, -arm], [arm, far, -arm, near]]
    pattern = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    rate: np.ndarray = flexural / (length**3 * (1 + phi))
    return pattern * rate[..., None, None]


def global_stiffness(beam: BeamElement) -> np.ndarray:
    """K^i of Eq 36, (..., 12, 12), in {O}."""
    local, axes = beam.stiffness, beam.axes
    blocks = local.reshape(*local.shape[:-2], 4, 3, 4, 3)
    turned: np.ndarray = np.einsum("...ip,...apbq,...jq->...aibj", axes, blocks, axes)
    return turned.reshape(local.shape)


def uniform_load(beam: BeamElement, line_load: np.ndarray) -> np.ndarray:
    """Consistent nodal loads (..., 12) in {O} of a uniform load along the beam.

    They are the reversed reactions of the beam with both ends held, qL/2 and qL^2/12 by symmetry in either beam theory, so
    that nodes move as under the distributed load itself.

    Args:
        beam: the element.
        line_load: (3,) load per length in {O}, N/m.
    """
    half = np.asarray(beam.length)[..., None] / 2 * line_load
    moment = np.cross(beam.axes[..., :, 0], half) * np.asarray(beam.length)[..., None] / 6
    return np.concatenate([half, moment, half, -moment], axis=-1)
