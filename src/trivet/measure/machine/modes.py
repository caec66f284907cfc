"""Modes of a machine as its measured channels see them, which of them were measured, and how their poles change.

Frequencies are those of a mesh fine enough that its error (below 1e-3) does not matter beside a measured pole.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from trivet.measure.correlation import ModeSet
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
    """The poles of some modes, and their slopes: by Rayleigh's quotient, of which the shapes' change is no part."""
    vectors = found.vectors[:, order]
    columns = []
    for k, step in enumerate(STEP * free.spread):
        ends = []
        for sign in (1, -1):
            changed, loss = free.applied(machine, loss_factor, theta + sign * step * np.eye(len(theta))[k])
            structure, _ = with_sites(changed, placed)
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
