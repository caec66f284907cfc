"""A tool point by its modes: poles and shapes in the cutting plane, for methods that work in time.

What modes that are left out add to the receptance, the residual flexibility, is missing: they follow forces as springs do,
which lifts the real part of the receptance a little and with it the depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from trivet.chatter.tool_point import ToolPoint
from trivet.errors import NoResultError
from trivet.vibration.modes import Modes

SLIGHT = 1e-3
"""Flexibility of a mode at resonance, against the greatest, below which it is left out."""
LEAST_DAMPING = 1e-6
"""Damping ratio as which none counts where modes are compared."""


@dataclass(frozen=True)
class ModalModel:
    """Modes as they move the tool point in the cutting plane."""

    omega: np.ndarray
    """(m,) natural frequencies, rad/s."""
    damping: np.ndarray
    """(m,) damping ratios zeta."""
    shapes: np.ndarray
    """(2, m) displacements along x and y, of unit modal mass, 1/sqrt(kg)."""

    @property
    def flexibility(self) -> np.ndarray:
        """(m,) of every mode at its resonance, for comparisons, 2 m/N; undamped ones count as hardly damped."""
        found: np.ndarray = (self.shapes**2).sum(axis=0) / (self.omega**2 * np.maximum(self.damping, LEAST_DAMPING))
        return found

    def receptance(self, frequency: np.ndarray) -> np.ndarray:
        """(n, 2, 2) in the cutting plane at frequencies (n,) in Hz, m/N."""
        omega = 2 * math.pi * np.asarray(frequency, dtype=float)[:, None]
        below = self.omega**2 - omega**2 + 2j * self.damping * self.omega * omega
        answer: np.ndarray = np.einsum("am,nm,bm->nab", self.shapes, 1 / below, self.shapes)
        return answer


def modal_model(found: Modes, point: ToolPoint, loss_factor: float, highest: float) -> ModalModel:
    """The modes of a machine up to a highest frequency (Hz) that move its tool point in the cutting plane.

    A mode has the damping ratio of half the loss factor, its own where parts have theirs, and what dashpots add; what damping
    couples between modes is left out.

    Raises:
        NoResultError: no mode up to that frequency moves the point.
    """
    mesh, shapes = found.mesh, found.shapes
    below = found.mesh_frequency <= highest
    omega = 2 * math.pi * found.mesh_frequency[below]
    shapes = shapes[:, below]
    lost = np.einsum("im,im->m", shapes, (mesh.loss + loss_factor * mesh.undetermined) @ shapes)
    dashed = np.einsum("im,im->m", shapes, mesh.viscosity @ shapes)
    damping = lost / (2 * omega**2) + dashed / (2 * omega)
    moved = point.rows @ found.platform[:, below]
    flexibility = ModalModel(omega, damping, moved).flexibility
    keep = flexibility > SLIGHT * flexibility.max(initial=0.0)
    if not keep.any():
        raise NoResultError(f"no mode up to {highest:g} Hz moves the tool in the cutting plane; take a higher frequency")
    return ModalModel(omega[keep], damping[keep], moved[:, keep])
