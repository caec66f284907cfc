"""Modes of a machine as its measured channels see them, which of them were measured, and how their poles change.

Frequencies are those of a mesh fine enough that its error (below 1e-3) does not matter beside a measured pole.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import scipy.optimize

from trivet.measure.parameters import Parameters
from trivet.measure.predicted import STEP, Model, with_sites
from trivet.model import Machine
from trivet.vibration.exact import pieces
from trivet.vibration.mesh import Mesh, mesh
from trivet.vibration.modes import held_modes

FINE = 0.4
"""Greatest wave number times length of an element."""
BEYOND = 1.6
"""Modes of the machine are looked at up to so many times the highest measured frequency."""
MOST_MODES = 80
ALIKE = 2e-3
"""Relative distance of frequencies within which modes are compared as a subspace: a basis of it is anybody's choice."""
OCTAVE = 0.5
"""What an octave between frequencies counts in pairing, beside a MAC of 1."""


class Poles(NamedTuple):
    """m measured poles."""

    frequency: np.ndarray
    """(m,) Hz."""
    damping: np.ndarray
    """(m,) ratios."""
    shapes: np.ndarray
    """(o, m) complex, at the outputs of the `Model`, of any scale."""


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
    """(o, k) at the outputs."""


class PolesOf(NamedTuple):
    """Poles of the machine that belong to measured ones, on logarithmic scales."""

    values: np.ndarray
    """(2 m,) ln frequency, then ln damping."""
    slopes: np.ndarray
    """(2 m, p) with respect to theta."""


def modes_of(model: Model, machine: Machine, loss_factor: float, highest: float) -> ModelModes:
    """Modes up to a highest frequency (Hz), and some more.

    Raises:
        NoResultError: the machine moves without resistance.
    """
    structure, sites = with_sites(machine, model.placed)
    elements = pieces(structure, 2 * math.pi * BEYOND * highest, FINE)
    chosen = mesh(structure, elements)
    frequency, vectors = held_modes(machine.name, chosen, MOST_MODES)
    keep = max(1, int(np.searchsorted(frequency, BEYOND * highest)))
    frequency, vectors = frequency[:keep], vectors[:, :keep]
    rows = [model.placed.along(c)[None] @ chosen.rows(sites[c.point].node, sites[c.point].at) for c in model.outputs]
    damping = np.exp(_log_poles(chosen, vectors, loss_factor)[keep:])
    return ModelModes(elements, frequency, damping, vectors, np.concatenate(rows) @ vectors)


def pairing(measured: Poles, found: ModelModes) -> np.ndarray:
    """(m,) which mode of the machine each measured one is: by MAC, and by frequency where shapes say little.

    The shape of a measured mode is compared with the subspace of all modes of one frequency.
    """
    mac = np.empty((len(measured.frequency), len(found.frequency)))
    for k, own in enumerate(found.frequency):
        cluster = np.abs(found.frequency / own - 1) < ALIKE
        base, size, _ = np.linalg.svd(found.shapes[:, cluster], full_matrices=False)
        base = base[:, size > 1e-9 * size[0]]
        inside = np.linalg.norm(base.conj().T @ measured.shapes, axis=0)
        mac[:, k] = (inside / np.linalg.norm(measured.shapes, axis=0)) ** 2
    apart = np.abs(np.log2(found.frequency / measured.frequency[:, None]))
    _, order = scipy.optimize.linear_sum_assignment(1 - mac + OCTAVE * apart)
    return np.asarray(order)


def poles_of(
    model: Model,
    machine: Machine,
    loss_factor: float,
    free: Parameters,
    theta: np.ndarray,
    found: ModelModes,
    order: np.ndarray,
) -> PolesOf:
    """The poles of some modes, and their slopes: by Rayleigh's quotient, of which the shapes' change is no part."""
    vectors = found.vectors[:, order]
    columns = []
    for k, step in enumerate(STEP * free.spread):
        ends = []
        for sign in (1, -1):
            changed, loss = free.applied(machine, loss_factor, theta + sign * step * np.eye(len(theta))[k])
            structure, _ = with_sites(changed, model.placed)
            ends.append(_log_poles(mesh(structure, found.elements), vectors, float(loss)))
        columns.append((ends[0] - ends[1]) / (2 * step))
    own = found.frequency[order], found.damping[order]
    return PolesOf(np.log(np.concatenate(own)), np.array(columns).T)


def _log_poles(chosen: Mesh, vectors: np.ndarray, loss_factor: float) -> np.ndarray:
    """(2 k,) ln of frequencies (Hz), then of damping ratios, of shapes (q, k)."""

    def energy(matrix: Any) -> np.ndarray:
        form: np.ndarray = np.einsum("im,im->m", vectors, matrix @ vectors)
        return form

    mass, stiffness = energy(chosen.mass), energy(chosen.stiffness)
    omega = np.sqrt(stiffness / mass)
    lost = energy(chosen.loss) + loss_factor * energy(chosen.undetermined) + omega * energy(chosen.viscosity)
    return np.log(np.concatenate([omega / (2 * math.pi), np.maximum(lost / (2 * stiffness), 1e-12)]))
