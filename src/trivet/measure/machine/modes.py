"""Modes of a machine as its measured channels see them, which of them were measured, and how their poles change.

Frequencies are those of a mesh fine enough that its error (below 1e-3) does not matter beside a measured pole.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from trivet.measure.correlation import ModeSet, runs
from trivet.measure.functions import Channel
from trivet.measure.machine.parameters import Parameters
from trivet.measure.machine.predicted import STEP, with_sites
from trivet.measure.machine.setup import Placed
from trivet.measure.modal.fitted import units
from trivet.model import Machine
from trivet.vibration.exact import pieces
from trivet.vibration.mesh import Mesh, mesh
from trivet.vibration.modes import held_modes

FINE = 0.4
"""Greatest wave number times length of an element."""
BEYOND = 1.6
"""Modes of the machine are looked at up to so many times the highest measured frequency."""
MOST_MODES = 80
TINY = 1e-300
"""Stands for a loss of nought."""


class ModelModes(NamedTuple):
    """k modes of the machine."""

    elements: dict[str, int]
    """Of every beam of the mesh."""
    frequency: np.ndarray
    """(k,) Hz."""
    damping: np.ndarray
    """(k,) ratios, to first order in the damping."""
    vectors: np.ndarray
    """(q, k) of unit modal mass."""
    shapes: np.ndarray
    """(o, k) at the channels; where these turn in m, times the machine's characteristic length."""

    @property
    def as_set(self) -> ModeSet:
        """As modes are compared."""
        return ModeSet(self.frequency, self.damping, self.shapes)


class PolesOf(NamedTuple):
    """Poles of the machine that belong to measured ones, on logarithmic scales."""

    values: np.ndarray
    """(2 m,) ln frequency, then ln damping."""
    slopes: np.ndarray
    """(2 m, p) with respect to theta."""


def modes_of(placed: Placed, machine: Machine, loss_factor: float, highest: float, channels: Sequence[Channel]) -> ModelModes:
    """Modes up to a highest frequency (Hz), and some more, with shapes at some channels.

    Raises:
        NoResultError: the machine moves without resistance.
    """
    structure, sites = with_sites(machine, placed)
    elements = pieces(structure, 2 * math.pi * BEYOND * highest, FINE)
    chosen = mesh(structure, elements)
    frequency, vectors = held_modes(machine.name, chosen, MOST_MODES)
    keep = max(1, int(np.searchsorted(frequency, BEYOND * highest)))
    frequency, vectors = frequency[:keep], vectors[:, :keep]
    rows = [placed.along(c)[None] @ chosen.rows(sites[c.point].node, sites[c.point].at) for c in channels]
    damping = np.exp(_log_poles(chosen, vectors, loss_factor)[keep:])
    shapes = units(channels, float(machine.characteristic_length)) * (np.concatenate(rows) @ vectors)
    return ModelModes(elements, frequency, damping, vectors, shapes)


def poles_of(
    placed: Placed,
    machine: Machine,
    loss_factor: float,
    free: Parameters,
    theta: np.ndarray,
    found: ModelModes,
    order: np.ndarray,
) -> PolesOf:
    """The poles of some modes, and their slopes.

    A shape changes too, which matters to damping (to the frequency it does not: it is stationary).  Modes of one frequency have
    no shapes of their own; what they take of each other is no part of it.
    """
    omega, vectors = 2 * math.pi * found.frequency[order], found.vectors[:, order]
    columns, forces = [], []
    for k, step in enumerate(STEP * free.spread):
        (before, less), (after, more) = (
            _meshed(placed, found, *free.applied(machine, loss_factor, theta + sign * step * np.eye(len(theta))[k]))
            for sign in (-1, 1)
        )
        columns.append((_log_poles(after, vectors, more) - _log_poles(before, vectors, less)) / (2 * step))
        stiffer, heavier = after.stiffness - before.stiffness, after.mass - before.mass
        forces.append((stiffer @ vectors - heavier @ vectors * omega**2) / (2 * step))
    slopes, chosen, loss = np.array(columns).T, *_meshed(placed, found, *free.applied(machine, loss_factor, theta))
    for row, mode in enumerate(order):
        lost = (chosen.loss + loss * chosen.undetermined + omega[row] * chosen.viscosity) @ vectors[:, row]
        changes = _shape_slopes(chosen, found, int(mode), np.array([force[:, row] for force in forces]).T)
        slopes[len(order) + row] += 2 * (lost @ changes) / max(lost @ vectors[:, row], TINY)
    return PolesOf(np.log(np.concatenate([found.frequency[order], found.damping[order]])), slopes)


def _meshed(placed: Placed, found: ModelModes, machine: Machine, loss_factor: Any) -> tuple[Mesh, float]:
    """The mesh of some modes, of a machine with other numbers; the loss factor in numbers."""
    return mesh(with_sites(machine, placed)[0], found.elements), float(loss_factor)


def _shape_slopes(chosen: Mesh, found: ModelModes, mode: int, forces: np.ndarray) -> np.ndarray:
    """(q, p): how the shape of a mode changes, but for what it has of the modes of its own frequency.

    (K - omega^2 M) dphi = -(dK - omega^2 dM) phi, bordered by the group (Nelson, AIAA Journal 14:1201, 1976).

    Args:
        forces: (q, p) of (dK - omega^2 dM) phi for each number.
    """
    group = next(own for own in runs(found.frequency) if mode in own)
    border = sp.csc_matrix(chosen.mass @ found.vectors[:, group])
    rest = chosen.stiffness - (2 * math.pi * found.frequency[mode]) ** 2 * chosen.mass
    whole = sp.bmat([[rest, border], [border.T, None]], format="csc")
    given = np.concatenate([-forces, np.zeros((len(group), forces.shape[1]))])
    solved: np.ndarray = splu(whole).solve(given)[: len(forces)]
    return solved


def _log_poles(chosen: Mesh, vectors: np.ndarray, loss_factor: float) -> np.ndarray:
    """(2 k,) ln of frequencies (Hz), then of damping ratios, of shapes (q, k)."""

    def energy(matrix: Any) -> np.ndarray:
        form: np.ndarray = np.einsum("im,im->m", vectors, matrix @ vectors)
        return form

    mass, stiffness = energy(chosen.mass), energy(chosen.stiffness)
    omega = np.sqrt(stiffness / mass)
    lost = energy(chosen.loss) + loss_factor * energy(chosen.undetermined) + omega * energy(chosen.viscosity)
    return np.log(np.concatenate([omega / (2 * math.pi), np.maximum(lost / (2 * stiffness), 1e-12)]))
