"""Which mode of solids is which mode of beams: by their MAC, as motions of the nodes and of the axes of bodies.

A solid has no section that turns, but on the average: its nodes near a place on its axis move, in the mean, as a rigid body.
So both machines have the same motions, of the nodes of the structure and at the quarters of every beam, and one inner product
of them: the mass of beams of that many elements, and of all that is rigid.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from scipy.optimize import linear_sum_assignment

from trivet.solids.parts import Solid
from trivet.solids.reduction import PLACES
from trivet.statics.assembly import Structure
from trivet.vibration.assurance import assurance
from trivet.vibration.exact import pieces
from trivet.vibration.mesh import Mesh, dofs_of, mesh
from trivet.vibration.modes import held_modes

ALIKE = 1e-4
"""Relative difference of frequencies below which modes may be any mixture of them: of a symmetric pair, whatever rounding."""
BEYOND = 6
"""Modes that are looked at beyond as many as there are of the other machine."""
NOTHING = 1e-9
"""Mass of a motion, of the 1 that is a mode's, below which it is rounding: of the modes of a wall, say, which no beam has."""
PARTS = len(PLACES) + 1


class Shapes(NamedTuple):
    """Modes of a machine, as far as machines of beams and of solids have them in common."""

    frequency: np.ndarray
    """(m,) Hz, ascending."""
    motion: np.ndarray
    """(6 k, m): twists in {O}, of the nodes of the structure, then beam by beam at its quarters."""


class Pairs(NamedTuple):
    """Modes of one machine and those of another that are most like them."""

    first: np.ndarray
    """(p,) numbers, ascending."""
    second: np.ndarray
    """(p,) numbers."""
    mac: np.ndarray
    """(p,) between 0 and 1."""


def divided_alike(structure: Structure, highest: float, argument: float) -> dict[str, int]:
    """Elements of every beam, of which some end at its quarters; arguments as for `vibration.exact.pieces`."""
    return {name: PARTS * math.ceil(count / PARTS) for name, count in pieces(structure, highest, argument).items()}


def shapes(name: str, structure: Structure, chosen: Mesh, count: int, made: Iterable[Solid] = ()) -> Shapes:
    """The lowest modes of a machine.

    Args:
        name: of the machine.
        structure: of its beams, before any of them became solids.
        chosen: its mesh, divided as `divided_alike` says.
        count: how many modes; fewer where the mesh has fewer.
        made: the solids in it.

    Raises:
        NoResultError: the machine moves without resistance.
    """
    frequency, modes = held_modes(name, chosen, min(count, chosen.mass.shape[0]))
    whole = np.asarray(chosen.transform @ modes)
    quarters = _of_beams(chosen, whole) | _of_bodies(chosen, whole, {n: solid for solid in made for n in solid.names})
    inside = [quarters[beam.name] for beam in structure.beams if beam.name in quarters]
    return Shapes(frequency, np.concatenate([whole[: 6 * len(structure.nodes)], *inside]))


def pairs(structure: Structure, first: Shapes, second: Shapes) -> Pairs:
    """The pairs whose MAC add up to most; of modes whose frequencies coincide the MAC is that of the spaces which they span.

    Args:
        structure: of the beams of both machines.
        first, second: their modes; as many find a partner as the one has that has fewer.
    """
    size = len(first.motion)
    mass = mesh(structure, PARTS).inertia[:size, :size]
    runs = [_runs(own.frequency) for own in (first, second)]
    one, other = (_normal(own.motion, mass, run) for own, run in zip((first, second), runs, strict=True))
    alike = assurance(one.T @ (mass @ other), *runs)
    rows, columns = linear_sum_assignment(-alike)
    place = np.full(len(first.frequency), -1)
    place[rows] = columns
    for run in runs[0]:  # of modes that coincide the lower go with the lower
        own = [k for k in run if place[k] >= 0]
        place[own] = np.sort(place[own])
    return Pairs(rows, place[rows], np.minimum(alike[rows, place[rows]], 1.0))


def _of_beams(chosen: Mesh, whole: np.ndarray) -> dict[str, np.ndarray]:
    """(18, m) by the name of a beam: twists at its quarters."""
    ends: dict[str, list[int]] = {}
    for beam in chosen.structure.beams:
        ends.setdefault(beam.name, []).append(beam.second)
    found = {}
    for name, own in ends.items():
        nodes = own[len(own) // PARTS - 1 : -1 : len(own) // PARTS]
        found[name] = np.concatenate([whole[6 * node : 6 * node + 6] for node in nodes])
    return found


def _of_bodies(chosen: Mesh, whole: np.ndarray, of: Mapping[str, Solid]) -> dict[str, np.ndarray]:
    """The same of bodies."""
    place = 6 * len(chosen.structure.nodes) + sum(len(tie.rates) for tie in chosen.structure.connections)
    found = {}
    for body, dofs in zip(chosen.bodies, dofs_of(chosen.bodies, place), strict=True):
        to_world = np.kron(np.eye(2 * len(PLACES)), body.axes)
        to_own = scipy.linalg.block_diag(*[body.axes.T] * 4, np.eye(body.internal))
        found[body.name] = to_world @ of[body.name].reduced.axis @ to_own @ whole[dofs]
    return found


def _runs(frequency: np.ndarray) -> list[list[int]]:
    """Numbers of modes in runs whose frequencies are alike."""
    apart = np.flatnonzero(np.diff(frequency) > ALIKE * frequency[1:]) + 1
    return [[int(k) for k in run] for run in np.split(np.arange(len(frequency)), apart)]


def _normal(motion: np.ndarray, mass: Any, runs: Sequence[Sequence[int]]) -> np.ndarray:
    """Motions of unit mass, those of a run orthogonal; zero where machines have nothing of them in common."""
    found = np.empty_like(motion)
    for run in runs:
        own = motion[:, run]
        shares, turn = np.linalg.eigh(own.T @ (mass @ own))
        found[:, run] = own @ turn * np.where(shares > NOTHING, 1 / np.sqrt(np.maximum(shares, NOTHING)), 0.0)
    return found
