"""A mesh reduced to its slow modes and the static answer to loads at a place: receptances at thousands of frequencies."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse.linalg

from trivet.vibration.mesh import Mesh
from trivet.vibration.modes import held_modes

BEYOND = 4.0
"""Modes up to this many times the highest frequency are kept."""
BATCH = 60
"""Modes that are sought at first."""
AT_ONCE = 500
"""Frequencies that are solved together."""
NOTHING = 1e-10
"""Share of a static answer beside the modes below which it is rounding."""


class Ritz(NamedTuple):
    """Matrices (k, k) of a mesh on k shapes, and the twist (6, k) of a place in them."""

    stiffness: np.ndarray
    mass: np.ndarray
    loss: np.ndarray
    undetermined: np.ndarray
    viscosity: np.ndarray
    place: np.ndarray
    natural: np.ndarray
    """(m,) natural frequencies up to `BEYOND` the highest, Hz."""

    def receptance(self, frequency: np.ndarray, loss_factor: float) -> np.ndarray:
        """(n, 6, 6) at the place, in {O}, m/N, rad/N, rad/(N m)."""
        damped = self.stiffness + 1j * (self.loss + loss_factor * self.undetermined)
        answer = np.empty((len(frequency), 6, 6), dtype=complex)
        for start in range(0, len(frequency), AT_ONCE):
            omega = 2 * math.pi * np.asarray(frequency[start : start + AT_ONCE], dtype=float)[:, None, None]
            dynamic = damped + 1j * omega * self.viscosity - omega**2 * self.mass
            answer[start : start + AT_ONCE] = self.place @ np.linalg.solve(dynamic, self.place.T[None])
        return answer


def ritz(name: str, chosen: Mesh, rows: Any, highest: float) -> Ritz:
    """A mesh reduced for frequencies (Hz) up to a highest one, and loads at one place.

    Args:
        name: of the machine.
        chosen: its mesh.
        rows: (6, q), the twist of the place from the independent displacements.
        highest: Hz.

    Raises:
        NoResultError: the machine moves without resistance.
    """
    count, size = BATCH, chosen.mass.shape[0]
    while True:
        natural, shapes = held_modes(name, chosen, min(count, size))
        if len(natural) < count or natural[-1] > BEYOND * highest:
            break
        count *= 2
    natural = natural[natural <= BEYOND * highest]
    shapes = shapes[:, : len(natural)]
    load = np.ascontiguousarray(rows.toarray().T)
    static = scipy.sparse.linalg.splu(chosen.stiffness).solve(load)
    beside = static - shapes @ ((shapes.T @ load) / (2 * math.pi * natural[:, None]) ** 2)
    energy, of_all = (np.einsum("im,im->m", x, chosen.stiffness @ x) for x in (beside, static))
    keep = energy > NOTHING * of_all
    # Of the size of the modes: as stiff as one at the highest frequency.
    basis = np.hstack([shapes, beside[:, keep] / np.sqrt(energy[keep]) * 2 * math.pi * highest])
    whole = (chosen.stiffness, chosen.mass, chosen.loss, chosen.undetermined, chosen.viscosity)
    stiffness, mass, loss, undetermined, viscosity = (basis.T @ (matrix @ basis) for matrix in whole)
    return Ritz(stiffness, mass, loss, undetermined, viscosity, rows @ basis, natural)
