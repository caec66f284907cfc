"""Shapes of modes, with what lies below and above the band, by linear least squares in the frequency domain.

Receptances of modes r with poles lambda_r, shapes psi_r and participation vectors l_r (Heylen, Lammens, Sas, "Modal analysis
theory and testing", 1997):

    H_oi = sum over r of [psi_or l_ir / (j omega - lambda_r) + conj(psi_or l_ir) / (j omega - conj(lambda_r))]
           + upper_oi - lower_oi / omega^2

Both residuals are complex, so that structural damping fits as well.  Mobilities and accelerances are taken as receptances with
the noise that they were measured with: what is fitted is the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

SILENT = 1e-5
TAIL = 4
"""Real unknowns per function beside the modes: two complex residuals."""
_ROUNDS = 3
"""Of iterative refinement: normal equations alone lose half of the digits."""


class Band(NamedTuple):
    """What is fitted."""

    omega: np.ndarray
    """(n,) rad/s, above zero, rising."""
    values: np.ndarray
    """(o, i, n) receptances; 0 where none was measured."""
    known: np.ndarray
    """(o, i) whether it was measured."""
    derivatives: np.ndarray
    """(o, i) 0, 1 or 2: of the motion that was measured."""

    def heard(self) -> Band:
        """Without functions that are silent: at all frequencies below `SILENT` of others of their sensor or load.

        Those are zero by symmetry, and whatever they hold is no noise of the kind that others have.
        """
        size = np.abs(self.values)
        beside = np.maximum(size.max(axis=0), size.max(axis=1, keepdims=True))
        loudest = np.max(size / np.where(beside > 0, beside, 1), axis=-1)
        return self._replace(known=self.known & (loudest > SILENT))

    @property
    def motion_size(self) -> np.ndarray:
        """(o, i, n): size of what was measured over that of the receptance."""
        size: np.ndarray = self.omega ** self.derivatives[:, :, None]
        return size


@dataclass(frozen=True)
class Modes:
    """R modes as the references see them; modes of one group have one pole and a space of shapes rather than shapes."""

    poles: np.ndarray
    """(R,) rad/s, of positive frequency."""
    participation: np.ndarray
    """(i, R) complex; unit vectors, orthonormal within a group."""
    group: np.ndarray
    """(R,) number of the group, 0 to the number of groups less one, rising."""

    def __len__(self) -> int:
        return len(self.poles)

    @classmethod
    def of(cls, poles: np.ndarray, participation: np.ndarray, group: np.ndarray | None = None) -> Modes:
        """In the order of frequency; every mode a group of its own unless said otherwise."""
        own = np.arange(len(poles)) if group is None else group
        mean = np.array([poles[own == one].mean() for one in own]) if len(poles) else poles
        order = np.lexsort((own, np.abs(mean)))
        _, first = np.unique(own[order], return_index=True)
        rank = np.argsort(np.argsort(first))
        names = np.unique(own[order], return_inverse=True)[1]
        return cls(mean[order], participation[:, order], rank[names]).orthonormal()

    def orthonormal(self) -> Modes:
        """The same modes; only lengths, and bases within groups, change."""
        made = np.array(self.participation, dtype=complex)
        for members in self.groups:
            made[:, members] = np.linalg.qr(made[:, members])[0]
        return replace(self, participation=made)

    @property
    def groups(self) -> list[np.ndarray]:
        """Numbers of the modes of every group."""
        return [np.flatnonzero(self.group == k) for k in range(self.group.max() + 1)] if len(self) else []

    def only(self, kept: np.ndarray) -> Modes:
        """Some of the modes."""
        return Modes.of(self.poles[kept], self.participation[:, kept], self.group[kept])


class Shapes(NamedTuple):
    """What is linear in the responses."""

    shapes: np.ndarray
    """(o, R) psi, m rad/s per unit participation and N."""
    upper: np.ndarray
    """(o, i) m/N"""
    lower: np.ndarray
    """(o, i) m rad^2/s^2 per N"""


def real_basis(omega: np.ndarray, poles: np.ndarray, slopes: bool = False) -> np.ndarray:
    """(2 n, 2 R + 4), real parts above imaginary ones: of unit real residues, unit imaginary ones, residuals at the end.

    With slopes (2 n, 4 R + 4): between them what a unit real and a unit imaginary product of residue and pole's change brings.
    """
    direct = 1 / (1j * omega[:, None] - poles)
    mirrored = 1 / (1j * omega[:, None] - poles.conj())
    parts = [direct + mirrored, 1j * (direct - mirrored)]
    if slopes:
        parts += [direct**2 + mirrored**2, 1j * (direct**2 - mirrored**2)]
    one, low = np.ones((len(omega), 1)), -1 / omega[:, None] ** 2
    whole = np.concatenate([*parts, one, 1j * one, low, 1j * low], axis=1)
    return np.concatenate([whole.real, whole.imag])


def stacked(values: np.ndarray) -> np.ndarray:
    """Real parts before imaginary ones, along the last axis."""
    return np.concatenate([values.real, values.imag], axis=-1)


def real_map(factors: np.ndarray) -> np.ndarray:
    """(..., 2 a, 2 b) of complex (..., a, b): the same product for real parts before imaginary ones."""
    return np.concatenate(
        [np.concatenate([factors.real, -factors.imag], axis=-1), np.concatenate([factors.imag, factors.real], axis=-1)], axis=-2
    )


def own_map(participation: np.ndarray) -> np.ndarray:
    """(i, 2 R + 4, 2 R + 4 i): from shapes and residuals of a response to the coefficients of `real_basis` per reference."""
    references, modes = participation.shape
    made = np.zeros((references, 2 * modes + TAIL, 2 * modes + TAIL * references))
    for k in range(references):
        made[k, : 2 * modes, : 2 * modes] = real_map(np.diag(participation[k]))
        at = 2 * modes + TAIL * k
        made[k, 2 * modes :, at : at + TAIL] = np.eye(TAIL)
    return made


def grams(basis: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(o, i, k, k) products of the columns of a basis (2 n, k), as of `real_basis`, by the weights (o, i, n) of functions."""
    rows = np.ascontiguousarray(basis.T).reshape(basis.shape[1], 2, -1)
    made = np.empty((*weight.shape[:2], len(rows), len(rows)))
    for k, row in enumerate(rows):
        made[..., k, k:] = made[..., k:, k] = weight @ (rows[k:] * row).sum(axis=1).T
    return made


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of positive definite equations, scaled to a unit diagonal; unknowns that nothing determines stay zero."""
    size = np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    scale = 1 / np.where(size > 0, size, 1)
    unit = matrix * scale[..., :, None] * scale[..., None, :]
    unit = unit + np.eye(matrix.shape[-1]) * np.where(size > 0, 1e-13, 1.0)[..., None]
    found: np.ndarray = scale[..., None] * np.linalg.solve(unit, scale[..., None] * right)
    return found


def shapes_of(band: Band, modes: Modes, weight: np.ndarray) -> tuple[Shapes, np.ndarray]:
    """Shapes and residuals of known poles and participation vectors, and what they leave (o, i, n).

    Args:
        weight: (o, i, n) of squared errors; nothing is taken from functions that were not measured.
    """
    basis, mapping = real_basis(band.omega, modes.poles), own_map(modes.participation)
    used = weight * band.known[:, :, None]
    outputs, references, _ = band.values.shape
    unknown = np.zeros((outputs, mapping.shape[-1]))
    normal = (np.swapaxes(mapping, 1, 2) @ grams(basis, used) @ mapping).sum(axis=1)
    rest = stacked(band.values * band.known[:, :, None])
    for _ in range(_ROUNDS):
        pull = np.einsum("oip,ipk->ok", (rest * np.tile(used, 2)) @ basis, mapping)
        step = solved(normal, pull[..., None])[..., 0]
        unknown += step
        rest = rest - np.einsum("ipk,ok->oip", mapping, step) @ basis.T
    count = len(modes)
    tail = unknown[:, 2 * count :].reshape(outputs, references, 2, 2)
    residuals = tail[..., 0] + 1j * tail[..., 1]
    found = Shapes(unknown[:, :count] + 1j * unknown[:, count : 2 * count], residuals[..., 0], residuals[..., 1])
    lines = len(band.omega)
    return found, rest[..., :lines] + 1j * rest[..., lines:]


def synthesised(omega: np.ndarray, modes: Modes, shapes: Shapes) -> np.ndarray:
    """(o, i, n) receptances of modes and residuals; above zero frequency."""
    residues = shapes.shapes[:, None, :] * modes.participation
    direct = 1 / (1j * omega - modes.poles[:, None])
    mirrored = 1 / (1j * omega - modes.poles.conj()[:, None])
    whole: np.ndarray = residues @ direct + residues.conj() @ mirrored
    return whole + shapes.upper[:, :, None] - shapes.lower[:, :, None] / omega**2
