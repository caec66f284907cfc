"""The 12-dof beam element of matrix structural analysis (paper Eq 36).

The degrees of freedom are (u, w) of the first node, then (u, w) of the second: three displacements (m) and three small
rotations (rad) each.  In local axes x runs from the first node to the second.  All arrays may carry leading batch axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trivet.model.elements import Profile, Stock
from trivet.space.scalar import Scalar, mul

# Places of the bending dofs (v1, w1, v2, w2) of the two planes, and the sign with which a rotation follows the slope.
PLANES = ((np.array([1, 5, 7, 11]), 1.0), (np.array([2, 4, 8, 10]), -1.0))


class Uniform(NamedTuple):
    """What a uniform beam is made of, per length; y and z are its local axes."""

    axial: Scalar
    """EA, N."""
    torsion: Scalar
    """GJ, N m^2."""
    flexural_y: Scalar
    """E I_y, of bending about y, N m^2."""
    flexural_z: Scalar
    """E I_z, N m^2."""
    shear_y: Scalar
    """G A_y along y, N; infinite for an Euler-Bernoulli beam."""
    shear_z: Scalar
    """G A_z, N."""
    mass: Scalar
    """Mass per length, kg/m."""
    rotary_y: Scalar
    """Moment of inertia of the section about y per length, rho I_y, kg m; zero without rotary inertia."""
    rotary_z: Scalar
    """rho I_z, kg m."""
    polar: Scalar
    """Moment of inertia about the axis per length, rho (I_y + I_z), kg m."""
    loss_factor: Scalar | None
    """Structural damping of the material; that of the analysis when None."""

    def numbers(self) -> Uniform:
        """The same in plain numbers."""
        return Uniform(*(None if value is None else float(value) for value in self))


def uniform(profile: Profile, stock: Stock) -> Uniform:
    """What a beam of a profile is made of, Euler-Bernoulli or Timoshenko as `stock.theory` says."""
    material = stock.materials[profile.material]
    section = stock.sections[profile.section].properties(material.poisson_ratio)
    young, shear, density = material.youngs_modulus, material.shear_modulus, material.density
    rigid = stock.theory != "timoshenko"
    rotary = density if stock.rotary_inertia else 0
    return Uniform(
        axial=young * section.area,
        torsion=shear * section.torsion,
        flexural_y=young * section.inertia_y,
        flexural_z=young * section.inertia_z,
        shear_y=math.inf if rigid else shear * section.shear_area_y,
        shear_z=math.inf if rigid else shear * section.shear_area_z,
        mass=density * section.area,
        rotary_y=mul(rotary, section.inertia_y),
        rotary_z=mul(rotary, section.inertia_z),
        polar=density * (section.inertia_y + section.inertia_z),
        loss_factor=material.loss_factor,
    )


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
    made_of: Uniform
    """Section and material."""


def local_stiffness(beam: BeamElement) -> np.ndarray:
    """K^i of Eq 36, (..., 12, 12), in the beam's local axes."""
    length, made = np.asarray(beam.length), beam.made_of
    k = np.zeros((*length.shape, 12, 12))
    _spread(k, 0, made.axial / length)
    _spread(k, 3, made.torsion / length)
    bending = ((made.flexural_z, made.shear_y), (made.flexural_y, made.shear_z))
    for (places, sign), (flexural, shear) in zip(PLANES, bending, strict=True):
        # Ratio of shear to bending deflection.
        phi = 12 * flexural / (shear * length**2)
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
    return turned(local_stiffness(beam), beam.axes)


def turned(local: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """A matrix (..., 12, 12) of a beam from its local axes, the columns of (..., 3, 3), to {O}."""
    blocks = local.reshape(*local.shape[:-2], 4, 3, 4, 3)
    outside: np.ndarray = np.einsum("...ip,...apbq,...jq->...aibj", axes, blocks, axes)
    return outside.reshape(local.shape)


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
