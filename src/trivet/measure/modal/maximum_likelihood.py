"""Modes of greatest likelihood: poles, participation vectors and shapes refined together, with what noise makes of them.

Weighted nonlinear least squares (Guillaume, Verboven, Vanlanduit, "Frequency-domain maximum likelihood identification of modal
parameters with confidence intervals", ISMA 23, 1998) by variable projection: shapes and residuals follow from poles and
participation vectors response by response (Golub, Pereyra, Inverse Problems 19 (2003) R1), and what is left of the normal
equations without them is small.  Steps are Gauss-Newton's, damped where they would not descend (Marquardt).

A participation vector moves only across itself, a space of them only across that space: nothing is counted twice, and the
information matrix has full rank also where modes of a group have one pole.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg

from trivet.measure.modal.residues import (
    TAIL,
    Band,
    Modes,
    Shapes,
    grams,
    own_map,
    real_basis,
    real_map,
    shapes_of,
    solved,
    stacked,
)

STEPS = 40
ENOUGH = 1e-3
"""Decrease of the weighted squares that a step must promise: what a thirtieth of a standard deviation brings."""
HIDDEN = 1e-11
"""Eigenvalues of the scaled normal equations, against the greatest, that are rounding."""
_STALE = 1e10


@dataclass(frozen=True)
class Refined:
    """Modes at the least weighted squares."""

    modes: Modes
    shapes: Shapes
    rest: np.ndarray
    """(o, i, n) measured less synthesised receptance; 0 where nothing was measured."""
    weight: np.ndarray
    """(o, i, n) 1 / variance of the complex error; 0 where nothing was measured."""

    @property
    def cost(self) -> float:
        """Weighted sum of squares: one per line where the weights are right."""
        return float(np.sum(self.weight * np.abs(self.rest) ** 2))


class Directions(NamedTuple):
    """How shared unknowns change the residues and poles behind every function: complex (o, i, R, s)."""

    residue: np.ndarray
    """Change of the residue of every mode."""
    pole: np.ndarray
    """Change of the pole times residue, for every mode's slope."""


class Information(NamedTuple):
    """Normal equations, reduced to the shared unknowns: poles of groups, then participation across."""

    matrix: np.ndarray
    """(2 s, 2 s) real, for real parts before imaginary ones."""
    pull: np.ndarray
    """(2 s,)"""
    elimination: np.ndarray
    """(o, 2 R + 4 i, 2 s): what own unknowns do when shared ones move."""
    own: np.ndarray
    """(o, 2 R + 4 i, 2 R + 4 i) normal equations of the own unknowns."""

    def step(self, damping: float = 0.0) -> np.ndarray:
        """(2 s,) to the least squares of the linearised problem; nothing along directions that rounding hides."""
        size = np.sqrt(np.diag(self.matrix))
        scale = 1 / np.where(size > 0, size, 1)
        values, vectors = np.linalg.eigh(self.matrix * scale[:, None] * scale)
        inverse = np.where(values > HIDDEN * values[-1], 1 / np.maximum(values + damping, np.finfo(float).tiny), 0)
        found: np.ndarray = scale * (vectors @ (inverse * (vectors.T @ (scale * self.pull))))
        return found


def directions(modes: Modes, shapes: Shapes, apart: np.ndarray | None = None) -> Directions:
    """Poles of groups first, then participation across; with `apart`, a group, its poles last, as a matrix less its trace."""
    outputs, count = shapes.shapes.shape
    references = len(modes.participation)
    residues = shapes.shapes[:, None, :] * modes.participation
    pole = [np.where(modes.group == k, residues, 0) for k in range(len(modes.groups))]
    across: list[np.ndarray] = []
    for members in modes.groups:
        normal = _across(modes.participation[:, members])
        for r in members:
            moved = np.zeros((normal.shape[1], outputs, references, count), dtype=complex)
            moved[..., r] = normal.T[:, None, :] * shapes.shapes[:, r][:, None]
            across.extend(moved)
    nothing = np.zeros((outputs, references, count), dtype=complex)
    mixed = [] if apart is None else _mixed(modes, shapes, apart)
    return Directions(
        np.stack([nothing] * len(pole) + across + [nothing] * len(mixed), axis=-1),
        np.stack(pole + [nothing] * len(across) + mixed, axis=-1),
    )


def _across(vectors: np.ndarray) -> np.ndarray:
    """(i, i - m) orthonormal basis of what is orthogonal to m vectors."""
    return np.linalg.qr(vectors, mode="complete")[0][:, vectors.shape[1] :]


def _mixed(modes: Modes, shapes: Shapes, members: np.ndarray) -> list[np.ndarray]:
    """Directions in which a group's poles come apart: psi_a l_b for a other than b, psi_a l_a less that of the last."""
    found = []
    for a in members:
        for b in members:
            if a == b == members[-1]:
                continue
            made = np.zeros((*shapes.shapes.shape[:1], *modes.participation.shape), dtype=complex)
            made[..., a] = shapes.shapes[:, a, None] * modes.participation[:, b]
            if a == b:
                last = members[-1]
                made[..., last] -= shapes.shapes[:, last, None] * modes.participation[:, last]
            found.append(made)
    return found


def information(band: Band, at: Refined, along: Directions) -> Information:
    """Normal equations of everything, response by response, and the shared part of them."""
    modes, count = at.modes, len(at.modes)
    basis = real_basis(band.omega, modes.poles, slopes=True)
    own = _spread(own_map(modes.participation), count)
    pulls, squares = (stacked(at.rest) * np.tile(at.weight, 2)) @ basis, grams(basis, at.weight)
    size, shared = own.shape[-1], 2 * along.pole.shape[-1]
    matrix, pull = np.zeros((shared, shared)), np.zeros(shared)
    outputs = len(at.weight)
    elimination, blocks = np.empty((outputs, size, shared)), np.empty((outputs, size, size))
    for o in range(outputs):
        moved = _shared_map(along, o)
        owned = np.swapaxes(own, 1, 2) @ squares[o]
        blocks[o] = (owned @ own).sum(axis=0)
        across = (owned @ moved).sum(axis=0)
        elimination[o] = solved(blocks[o], across)
        matrix += (np.swapaxes(moved, 1, 2) @ (squares[o] @ moved)).sum(axis=0) - across.T @ elimination[o]
        pull += np.einsum("ips,ip->s", moved, pulls[o]) - elimination[o].T @ np.einsum("ipk,ip->k", own, pulls[o])
    return Information((matrix + matrix.T) / 2, pull, elimination, blocks)


def _spread(own: np.ndarray, count: int) -> np.ndarray:
    """An `own_map` over a basis with slopes."""
    made = np.zeros((own.shape[0], own.shape[1] + 2 * count, own.shape[2]))
    made[:, : 2 * count] = own[:, : 2 * count]
    made[:, 4 * count :] = own[:, 2 * count :]
    return made


def _shared_map(along: Directions, output: int) -> np.ndarray:
    """(i, 4 R + 4, 2 s): from the shared unknowns to coefficients of a basis with slopes, of one response."""
    residue, pole = real_map(along.residue[output]), real_map(along.pole[output])
    return np.concatenate([residue, pole, np.zeros((len(residue), TAIL, residue.shape[-1]))], axis=1)


def refine(band: Band, modes: Modes, weight: np.ndarray, steps: int = STEPS) -> Refined:
    """Least weighted squares from a start.

    Args:
        weight: (o, i, n) 1 / variance of the complex error of the receptances.
        steps: at most.
    """
    at = projected(band, modes, weight)
    damping, cost = 0.0, at.cost
    for _ in range(steps):
        found = information(band, at, directions(at.modes, at.shapes))
        while True:
            step = found.step(damping)
            promised = float(step @ found.pull)
            if promised < ENOUGH:
                return at
            tried = projected(band, moved(at.modes, step), weight)
            if np.isfinite(tried.cost) and tried.cost < cost:
                break
            damping = max(1e-3, 10 * damping)
            if damping > _STALE:
                return at
        at, cost = tried, tried.cost
        damping = damping / 10 if damping > 1e-4 else 0.0
    return at


def projected(band: Band, modes: Modes, weight: np.ndarray) -> Refined:
    """The best shapes of known poles and participation vectors."""
    shapes, rest = shapes_of(band, modes, weight)
    known = band.known[:, :, None]
    return Refined(modes, shapes, rest * known, weight * known)


def moved(modes: Modes, step: np.ndarray) -> Modes:
    """Modes after a step of the shared unknowns."""
    change = step[: len(step) // 2] + 1j * step[len(step) // 2 :]
    poles, made = modes.poles.copy(), np.array(modes.participation)
    at = len(modes.groups)
    for k, members in enumerate(modes.groups):
        poles[members] += change[k]
        normal = _across(modes.participation[:, members])
        for r in members:
            made[:, r] += normal @ change[at : at + normal.shape[1]]
            at += normal.shape[1]
    return Modes(poles, made, modes.group).orthonormal()


def covariance(found: Information) -> np.ndarray:
    """(2 s, 2 s) of the shared unknowns: half the inverse, for errors with half the variance in each part."""
    size = np.sqrt(np.diag(found.matrix))
    scale = 1 / np.where(size > 0, size, 1)
    whole: np.ndarray = 0.5 * scale[:, None] * scipy.linalg.pinvh(found.matrix * scale[:, None] * scale) * scale
    return whole


def leverage(band: Band, at: Refined, found: Information, along: Directions) -> np.ndarray:
    """(o, i, n): the part of every error that the fit takes away; their sum is half the number of real unknowns."""
    basis = real_basis(band.omega, at.modes.poles, slopes=True)
    own = _spread(own_map(at.modes.participation), len(at.modes))
    shared = 2 * covariance(found)
    made = np.zeros_like(at.weight)
    lines = len(band.omega)
    for o in range(len(made)):
        alone = solved(found.own[o], np.eye(found.own.shape[-1]))
        for i in range(made.shape[1]):
            change = _shared_map(along, o)[i] - own[i] @ found.elimination[o]
            spread = own[i] @ alone @ own[i].T + change @ shared @ change.T
            both = np.einsum("np,np->n", basis @ spread, basis)
            made[o, i] = at.weight[o, i] * (both[:lines] + both[lines:]) / 2
    return made
