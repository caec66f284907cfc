"""Matrix structural analysis (paper section 3.3.1): the equations of a structure with Lagrange multipliers, and their solution.

With x = (displacements of the nodes, deflections eta of the joints), K_T of the beam elements (Eq 36) and the joints' springs,
and A_K of the ties between bodies,

    [K_T  A_K^T] [   x    ]   [f]
    [A_K    0  ] [lambda_M] = [0]                                                                                   (Eq 37).

This path shares with the condensed one (`statics.compliance`) the machine and where its joints are, not the mechanics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from trivet.errors import NoResultError
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.statics.assembly import GROUND, PLATFORM, Connection, Structure, assemble
from trivet.statics.beam_element import global_stiffness, local_stiffness

__all__ = [
    "GROUND", "PLATFORM", "Connection", "Solution", "Structure",
    "a_k", "assemble", "carry", "k_t", "solve", "structural_stiffness",
]  # fmt: skip

LARGEST_RESPONSE = 1e13
"""Response of the scaled equations to a load of order one above which a structure counts as loose or held twice."""


@dataclass(frozen=True)
class Solution:
    """How a structure answers c load columns."""

    displacements: np.ndarray
    """(..., n, 6, c): twists of the nodes, in {O}, m and rad."""
    deflections: np.ndarray
    """(..., k, c): eta of all connections' screws, in their order, m or rad."""
    ties: np.ndarray
    """(..., t, 6, c): wrench which the first body of every connection takes over from the second, at the connection's point."""
    held: np.ndarray
    """(..., 6, c): wrench at the platform centre that holds the platform where it was put; empty columns when it is free."""


def structural_stiffness(machine: Machine, pose: Frame, signs: Any) -> np.ndarray:
    """Stiffness (..., 6, 6) of a machine at the platform centre in {O}: [F; M] = K [u; w], N/m, N/rad, N m/rad.

    The platform is moved by six unit twists, and the wrenches that hold it are read off; so K is found in singular poses too.

    Args:
        machine, pose, signs: as for `assemble`.

    Raises:
        NoResultError: a chain does not reach the pose, or has a part that turns freely.
        InputError: as `assemble`.
    """
    structure = assemble(machine, pose, signs)
    loads = np.zeros((*structure.nodes.shape[:-1], 6, 6))
    return solve(structure, loads, platform_twists=np.eye(6)).held


def k_t(structure: Structure) -> np.ndarray:
    """K_T of Eq 37, (..., N, N): beams on the nodes' dofs, then the rates of the joints' springs on their eta."""
    batch, n = structure.nodes.shape[:-2], structure.nodes.shape[-2]
    rates = _rates(structure)
    matrix = np.zeros((*batch, 6 * n + len(rates), 6 * n + len(rates)))
    for beam in structure.beams:
        dofs = np.concatenate([np.arange(6) + 6 * beam.first, np.arange(6) + 6 * beam.second])
        matrix[..., dofs[:, None], dofs] += global_stiffness(beam)
    eta = np.arange(6 * n, 6 * n + len(rates))
    matrix[..., eta, eta] = rates
    return matrix


def a_k(structure: Structure) -> np.ndarray:
    """A_K of Eq 37, (..., 6 + 6 t, N): the ground at rest, then the six rows of every connection at its point."""
    batch, n = structure.nodes.shape[:-2], structure.nodes.shape[-2]
    matrix = np.zeros((*batch, 6 + 6 * len(structure.connections), 6 * n + len(_rates(structure))))
    matrix[..., :6, _dofs(GROUND)] = np.eye(6)
    eta = 6 * n
    for number, tie in enumerate(structure.connections):
        rows = slice(6 + 6 * number, 12 + 6 * number)
        matrix[..., rows, _dofs(tie.second)] = carry(tie.at - structure.nodes[..., tie.second, :])
        matrix[..., rows, _dofs(tie.first)] = -carry(tie.at - structure.nodes[..., tie.first, :])
        matrix[..., rows, eta : eta + len(tie.rates)] = -tie.screws
        eta += len(tie.rates)
    return matrix


def solve(structure: Structure, loads: np.ndarray, platform_twists: np.ndarray | None = None) -> Solution:
    """Solve Eq 37.

    Args:
        structure: the structure.
        loads: (..., n, 6, c) wrenches on the nodes in {O}, N and N m.
        platform_twists: (6, c) twists which the platform is made to take, when it is not free.

    Raises:
        NoResultError: the structure moves without resistance, or rigid parts hold it twice.
    """
    batch, n, columns = structure.nodes.shape[:-2], structure.nodes.shape[-2], loads.shape[-1]
    held = platform_twists is not None
    ties = a_k(structure)
    if held:
        hold = np.zeros((*batch, 6, ties.shape[-1]))
        hold[..., _dofs(PLATFORM)] = np.eye(6)
        ties = np.concatenate([ties, hold], axis=-2)
    size, rows = ties.shape[-1], ties.shape[-2]
    right = np.zeros((*batch, size + rows, columns))
    right[..., : 6 * n, :] = loads.reshape(*batch, 6 * n, columns)
    if held:
        right[..., -6:, :] = platform_twists
    matrix = np.zeros((*batch, size + rows, size + rows))
    matrix[..., :size, :size] = _relative_stiffness(structure)
    relations = _relations(structure)
    for near, far, arm, turn in reversed(relations):  # A_K H and H^T f
        ties[..., near] += ties[..., far] @ arm
        ties[..., far] = ties[..., far] @ turn
        right[..., near, :] += _transposed(arm) @ right[..., far, :]
        right[..., far, :] = _transposed(turn) @ right[..., far, :]
    matrix[..., size:, :size] = ties
    matrix[..., :size, size:] = _transposed(ties)
    found = _solve_scaled(matrix, right, _units(structure), structure.scale)
    for near, far, arm, turn in relations:  # x = H y
        found[..., far, :] = turn @ found[..., far, :] + arm @ found[..., near, :]
    nodes = found[..., : 6 * n, :].reshape(*batch, n, 6, columns)
    wrenches = found[..., size:, :].reshape(*batch, rows // 6, 6, columns)
    count = len(structure.connections)
    holding = -wrenches[..., -1, :, :] if held else np.zeros((*batch, 6, 0))
    return Solution(nodes, found[..., 6 * n : size, :], wrenches[..., 1 : 1 + count, :, :], holding)


def _relative_stiffness(structure: Structure) -> np.ndarray:
    """H^T K_T H, where x = H y measures the far node of every beam from where its near node would carry it, in the beam's axes.

    A beam resists no rigid motion, so of every 12 x 12 element just the 6 x 6 block of its far node is left.  In the nodes' own
    displacements the large stiffness of a short beam (as L^-3) would drown the rest in rounding; here it stands alone.
    """
    n, rates = structure.nodes.shape[-2], _rates(structure)
    matrix = np.zeros((*structure.nodes.shape[:-2], 6 * n + len(rates), 6 * n + len(rates)))
    for beam in structure.beams:
        matrix[..., _dofs(beam.second), _dofs(beam.second)] = local_stiffness(beam)[..., 6:, 6:]
    eta = np.arange(6 * n, 6 * n + len(rates))
    matrix[..., eta, eta] = rates
    return matrix


def _relations(structure: Structure) -> list[tuple[slice, slice, np.ndarray, np.ndarray]]:
    """H by its blocks: per beam the dofs of its near and far node, and far = arm @ near + turn @ y_far."""
    found = []
    for beam in structure.beams:
        turn = np.zeros((*beam.axes.shape[:-2], 6, 6))
        turn[..., :3, :3] = turn[..., 3:, 3:] = beam.axes
        arm = carry(structure.nodes[..., beam.second, :] - structure.nodes[..., beam.first, :])
        found.append((_dofs(beam.first), _dofs(beam.second), arm, turn))
    return found


def _transposed(matrix: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrix, -1, -2)


def _units(structure: Structure) -> np.ndarray:
    """(N,) unit of every displacement: the structure's scale (m) of lengths, 1 of rotations."""
    six = np.r_[np.full(3, structure.scale), np.ones(3)]
    turns = [np.any(tie.screws[..., 3:, :] != 0, axis=tuple(range(tie.screws.ndim - 1))) for tie in structure.connections]
    return np.concatenate([np.tile(six, structure.nodes.shape[-2]), np.where(np.concatenate(turns), 1.0, structure.scale)])


def _solve_scaled(matrix: np.ndarray, right: np.ndarray, units: np.ndarray, scale: float) -> np.ndarray:
    """Solve the equations, made free of units: displacements by `units`, stiffnesses by their median."""
    size = len(units)
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)[..., :size] * units**2
    # The median: a mean, even a geometric one, would follow the stiffness of a very short beam.
    rate = float(np.median(diagonal[diagonal > 0])) if np.any(diagonal > 0) else 1.0
    # The rows of A_K come in sixes; a multiplier is a force or a moment.
    forces = np.tile(np.r_[np.full(3, rate / scale), np.full(3, rate)], (matrix.shape[-1] - size) // 6)
    by = np.concatenate([units, forces])[:, None]
    # One more column, a load on everything: its response measures the inverse.
    probe = np.broadcast_to(np.cos(np.arange(len(by)) ** 2)[:, None], (*right.shape[:-1], 1))
    try:
        found = np.linalg.solve(matrix * (by / rate * by.T), np.concatenate([right * (by / rate), probe], axis=-1))
    except np.linalg.LinAlgError:
        found = np.full((*right.shape[:-1], right.shape[-1] + 1), np.inf)
    if not np.all(np.abs(found[..., -1]) < LARGEST_RESPONSE):
        raise NoResultError("the structure moves without resistance at this pose, or rigid parts hold it twice")
    return by * found[..., :-1]


def carry(arm: np.ndarray) -> np.ndarray:
    """(..., 6, 6): takes the twist of a body at one point to its twist at the point an arm (..., 3) further, same axes."""
    matrix = np.zeros((*arm.shape[:-1], 6, 6))
    matrix[..., range(6), range(6)] = 1
    x, y, z = arm[..., 0], arm[..., 1], arm[..., 2]
    matrix[..., 0, 4], matrix[..., 0, 5] = z, -y
    matrix[..., 1, 3], matrix[..., 1, 5] = -z, x
    matrix[..., 2, 3], matrix[..., 2, 4] = y, -x
    return matrix


def _dofs(node: int) -> slice:
    return slice(6 * node, 6 * node + 6)


def _rates(structure: Structure) -> np.ndarray:
    return np.concatenate([tie.rates for tie in structure.connections])
