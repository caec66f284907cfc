"""Frequency responses between places of a machine: by modes, on the mesh directly, or exactly.

All give receptances (n, 6, 6) in {O}, [u; w] of the one place = H [F; M] of the other, and take the places as rows that lead
from independent displacements to their twists.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from trivet.errors import InputError
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.statics.assembly import assemble
from trivet.statics.structure import carry
from trivet.vibration import spectral
from trivet.vibration.exact import ExactStructure, exact_mesh, pieces
from trivet.vibration.mesh import Mesh, mesh
from trivet.vibration.modes import Modes, eigenmodes
from trivet.vibration.places import Place, place_of, point_of_platform

Method = Literal["exact", "direct", "modal"]
Damping = Literal["structural", "modal"]
METHODS: tuple[Method, ...] = ("exact", "direct", "modal")

FINE = 0.4
"""Greatest wave number times length of an element of a mesh when nothing is said."""
OUTPUTS = ("receptance", "mobility", "accelerance")
"""Displacement, velocity, or acceleration per load."""


def modal_receptance(
    found: Modes,
    rows: Any,
    columns: Any,
    frequency: np.ndarray,
    loss_factor: float,
    damping: Damping = "structural",
    corrected: bool = True,
) -> np.ndarray:
    """Receptance (n, a, b) from modes.

    Args:
        found: the modes, see `eigenmodes`.
        rows, columns: (a, q) and (b, q), what is looked at and what is loaded, from the independent displacements.
        frequency: (n,) Hz.
        loss_factor: eta; the modal damping ratio is zeta = eta / 2.
        damping: "structural", omega_r^2 (1 + i eta); or "modal", 2 i zeta omega_r omega.
        corrected: add the static response of the modes that are left out.
    """
    omega = 2 * math.pi * np.asarray(frequency, dtype=float)
    squares = (2 * math.pi * found.mesh_frequency) ** 2
    left, right = rows @ found.shapes, columns @ found.shapes
    if damping == "structural":
        below = squares * (1 + 1j * loss_factor) - omega[:, None] ** 2
    else:
        below = squares - omega[:, None] ** 2 + 1j * loss_factor * np.sqrt(squares) * omega[:, None]
    pairs = (left[:, None, :] * right[None, :, :]).reshape(-1, len(squares))
    response = ((1 / below) @ pairs.T).reshape(len(omega), left.shape[0], right.shape[0])
    if corrected:
        static = _static(found.mesh, rows, columns) - (left / squares) @ right.T
        response = response + static / (1 + 1j * loss_factor if damping == "structural" else 1)
    answer: np.ndarray = response
    return answer


def _static(chosen: Mesh, rows: Any, columns: Any) -> np.ndarray:
    load = columns.toarray().T if sp.issparse(columns) else np.asarray(columns).T
    moved: np.ndarray = rows @ scipy.sparse.linalg.splu(chosen.stiffness).solve(np.ascontiguousarray(load))
    return moved


def direct_receptance(chosen: Mesh, rows: Any, columns: Any, frequency: np.ndarray, loss_factor: float) -> np.ndarray:
    """Receptance (n, a, b) on a mesh, solved at every frequency; arguments as for `modal_receptance`."""
    load = np.asarray(columns.toarray().T, dtype=complex)
    answer = []
    for f in np.asarray(frequency, dtype=float):
        solver = scipy.sparse.linalg.splu(sp.csc_matrix(chosen.dynamic_stiffness(2 * math.pi * f, loss_factor)))
        answer.append(rows @ solver.solve(load))
    return np.array(answer)


def exact_receptance(exact: ExactStructure, rows: Any, columns: Any, frequency: np.ndarray, loss_factor: float) -> np.ndarray:
    """Receptance (n, a, b) without the error of a mesh, solved at every frequency; arguments as for `modal_receptance`."""
    omega = 2 * math.pi * np.asarray(frequency, dtype=float)
    return exact.receptance(rows.toarray(), columns.toarray(), omega, loss_factor)


def receptance(
    machine: Machine,
    pose: Frame,
    signs: Any,
    frequency: np.ndarray,
    *,
    response: str = "platform",
    excitation: str = "platform",
    method: Method = "exact",
    loss_factor: float = 0.02,
    damping: Damping = "structural",
    elements: int | None = None,
    count: int | None = None,
) -> np.ndarray:
    """Receptance (n, 6, 6) between two places of a machine, in {O}, m/N, rad/N, rad/(N m).

    Args:
        machine: the machine, its actuators at rest.
        pose: platform frame {E} in {O}, m; numbers.
        signs: (n_chains, 2) working mode; None for a machine without.
        frequency: (n,) Hz, above zero.
        response, excitation: places, see `places.place_of`.
        method: "exact", without a mesh; "direct", a mesh solved at every frequency; "modal", the modes of a mesh with the
            static response of those left out.
        loss_factor: structural damping eta of all that has none of its own; modal damping is zeta = eta / 2.
        damping: "structural" or "modal"; modal damping needs modes.
        elements: of every beam of a mesh; as many as the highest frequency needs when not given.
        count: modes; all below twice the highest frequency, and ten more, when not given.

    Raises:
        NoResultError: a chain does not reach the pose, or a part turns freely.
        InputError: for a place that is not known, or a damping that the method does not have.
    """
    frequency = np.asarray(frequency, dtype=float)
    if damping == "modal" and method != "modal":
        raise InputError(f"damping: modal damping needs modes; with method {method} it is structural; choose the method modal")
    if method == "exact" and {response, excitation} <= {"platform", "tool"}:
        centre = np.asarray(spectral.receptance(machine, pose, signs, frequency, loss_factor))
        seen, loaded = (_from_centre(machine, pose, name) for name in (response, excitation))
        answer: np.ndarray = seen @ centre @ loaded.T
        return answer
    structure = assemble(machine, pose, signs)
    first = place_of(machine, pose, structure, excitation)
    second = place_of(machine, pose, first.structure, response)
    structure = second.structure
    if method == "exact":
        chosen = exact_mesh(structure, 2 * math.pi * float(frequency.max()))
        return exact_receptance(ExactStructure(chosen), *_rows(chosen, second, first), frequency, loss_factor)
    highest = 2 * math.pi * float(frequency.max())
    chosen = mesh(structure, pieces(structure, highest, FINE) if elements is None else elements)
    rows, columns = _rows(chosen, second, first)
    if method == "direct":
        return direct_receptance(chosen, rows, columns, frequency, loss_factor)
    if chosen.loss.nnz or chosen.viscosity.nnz:
        raise InputError("method modal: parts with damping of their own couple the modes; use exact or direct")
    natural, shapes = eigenmodes(chosen, chosen.mass.shape[0] if count is None else count)
    if count is None:
        below = int(np.searchsorted(natural, 2 * frequency.max())) + 10
        natural, shapes = natural[:below], shapes[:, :below]
    return modal_receptance(Modes(structure, chosen, natural, shapes), rows, columns, frequency, loss_factor, damping)


def _rows(chosen: Mesh, second: Place, first: Place) -> tuple[Any, Any]:
    return chosen.rows(second.node, second.at), chosen.rows(first.node, first.at)


def _from_centre(machine: Machine, pose: Frame, name: str) -> np.ndarray:
    return carry(point_of_platform(machine, pose, name) - np.array([float(c) for c in pose.origin]))


def per(output: str, receptances: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """Receptances (n, ...) as one of `OUTPUTS`: times 1, i omega, -omega^2."""
    factor = (2j * math.pi * np.asarray(frequency)) ** OUTPUTS.index(output)
    scaled: np.ndarray = receptances * factor.reshape(-1, *[1] * (receptances.ndim - 1))
    return scaled
