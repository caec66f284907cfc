"""Natural frequencies and mode shapes of a machine at a pose, and which parts move and yield in them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg

from trivet.errors import InputError, NoResultError
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.statics.assembly import PLATFORM, Structure, assemble
from trivet.statics.beam_element import global_stiffness
from trivet.statics.structure import carry
from trivet.vibration.exact import ExactStructure, exact_mesh
from trivet.vibration.mesh import Mesh, dofs_of, mesh

LARGEST_DENSE = 1500
"""Displacements up to which all eigenvalues are found at once; above, the lowest ones by Lanczos iterations."""
ELEMENTS = 8
"""Elements of a beam when nothing is said."""
LOOSE = 1e-9
"""Stiffness of a motion, against the median of all, below which nothing resists it."""
TRACE = 1e-9
"""Mass which `exact_frequencies` lends to what has none, as a share of its stiffness over the square of the frequency."""
NEAR = 3e-8
"""Relative difference of omega^2 over which the linearised problem is as good as the exact one."""
ROUNDING = 1e-12
"""Error of the omega^2 of a mode, against the highest, that is rounding: rigid motions have no more exact one."""
MOST_STEPS = 40
"""Steps from a mode of the mesh to the exact one; three are usual."""
ALIKE = 3
"""Modes that are looked at together: what coincides is found at once."""
RIGID = 1.0
"""omega^2, (rad/s)^2, below which a motion is as good as one of a rigid body."""
FREE = 1e-13
"""Strain energy of a mode, against the terms of which it is the sum, below which it is rounding."""


@dataclass(frozen=True)
class Modes:
    """The lowest m modes of a mesh."""

    structure: Structure
    """Before its beams were divided."""
    mesh: Mesh
    mesh_frequency: np.ndarray
    """(m,) of the mesh, Hz."""
    shapes: np.ndarray
    """(q, m): independent displacements, of unit modal mass (1/sqrt(kg) and rad/(m sqrt(kg)))."""

    @cached_property
    def frequency(self) -> np.ndarray:
        """(m,) natural frequencies without the error of the mesh, Hz; with bodies in it, those of the mesh."""
        if self.mesh.bodies:
            return self.mesh_frequency
        return exact_frequencies(self.structure, self.mesh_frequency)

    @cached_property
    def displacements(self) -> np.ndarray:
        """(n, 6, m): twists of the nodes in {O}."""
        whole = self.mesh.transform @ self.shapes
        nodes = len(self.mesh.structure.nodes)
        return np.asarray(whole[: 6 * nodes]).reshape(nodes, 6, -1)

    @property
    def platform(self) -> np.ndarray:
        """(6, m): twist of the platform centre in {O}."""
        return self.displacements[PLATFORM]

    @cached_property
    def strain_shares(self) -> dict[str, np.ndarray]:
        """Share (m,) of every beam, body and sprung joint ("leg-1.link") in the strain energy of every mode."""
        structure, found = self.mesh.structure, dict[str, np.ndarray]()
        for beam in structure.beams:
            ends = np.concatenate([self.displacements[beam.first], self.displacements[beam.second]])
            energy = np.einsum("im,ij,jm->m", ends, global_stiffness(beam), ends)
            found[beam.name] = found.get(beam.name, 0) + energy
        whole = np.asarray(self.mesh.transform @ self.shapes)
        deflections = whole[6 * len(structure.nodes) :]
        place = 0
        for tie in structure.connections:
            own = deflections[place : place + len(tie.rates)]
            place += len(tie.rates)
            if np.any(tie.rates > 0):
                found[tie.name] = found.get(tie.name, 0) + tie.rates @ own**2
        for body, dofs in zip(self.mesh.bodies, dofs_of(self.mesh.bodies, 6 * len(structure.nodes) + place), strict=True):
            found[body.name] = np.einsum("im,ij,jm->m", whole[dofs], body.in_world(body.stiffness), whole[dofs])
        total = sum(found.values())
        return {name: energy / total for name, energy in found.items()}

    @cached_property
    def effective_mass(self) -> np.ndarray:
        """(6, m): mass (kg) and moment of inertia about the origin of {O} (kg m^2) that take part when the ground shakes.

        Along x, y, z and about x, y, z; over all modes they add up to the machine's mass and inertia, but for what stands on
        the ground.
        """
        rigid = np.zeros((self.mesh.transform.shape[0], 6))
        for node, at in enumerate(self.mesh.structure.nodes):
            rigid[6 * node : 6 * node + 6] = carry(at)
        taking: np.ndarray = (rigid.T @ self.mesh.inertia @ (self.mesh.transform @ self.shapes)) ** 2
        return taking


def modes(
    machine: Machine,
    pose: Frame,
    signs: Any,
    count: int = 12,
    elements: int | Mapping[str, int] | None = None,
) -> Modes:
    """The lowest modes of a machine at a pose.

    Args:
        machine: the machine, its actuators at rest.
        pose: platform frame {E} in {O}, m; numbers.
        signs: (n_chains, 2) working mode; None for a machine without.
        count: how many.
        elements: of every beam, or by name; `ELEMENTS` when not given.

    Raises:
        NoResultError: a chain does not reach the pose, or the machine moves without resistance (naming the joint).
        InputError: for a count or elements out of range.
    """
    structure = assemble(machine, pose, signs)
    chosen = mesh(structure, ELEMENTS if elements is None else elements)
    return Modes(structure, chosen, *held_modes(machine.name, chosen, count))


def held_modes(name: str, chosen: Mesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """`eigenmodes` of a machine of that name, which must resist every motion.

    Raises:
        NoResultError: naming the joints that move freely.
    """
    try:
        frequencies, shapes = eigenmodes(chosen, count)
    except NoResultError as error:
        raise NoResultError(f"{name}: {error}") from error
    first = shapes[:, 0]
    energy, terms = first @ (chosen.stiffness @ first), abs(first) @ (abs(chosen.stiffness) @ abs(first))
    if energy < FREE * terms:
        raise NoResultError(f"{name}: {_loose(chosen)}")
    return frequencies, shapes


def _loose(chosen: Mesh) -> NoResultError:
    return NoResultError(f"the structure moves without resistance at this pose; freely moves {free_joints(chosen)}")


def eigenmodes(chosen: Mesh, count: int, shift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Lowest frequencies (m,) in Hz and shapes (q, m) of unit modal mass of a mesh.

    Args:
        chosen: the mesh.
        count: how many; fewer come back where fewer displacements have mass.
        shift: (rad/s)^2 added to all squares while solving, above zero for a structure that may move freely.

    Raises:
        NoResultError: the structure moves without resistance (naming the joint), or has no mass.
    """
    if count < 1:
        raise InputError(f"count: {count}; expected at least 1 mode")
    if not chosen.mass.nnz or not chosen.mass.diagonal().any():
        raise NoResultError("nothing in this structure has a mass; give beams a density, or joints and the platform a mass")
    stiff = chosen.stiffness + shift * chosen.mass
    try:
        if chosen.mass.shape[0] <= LARGEST_DENSE:
            inverse, shapes = _dense(stiff, chosen.mass, count)
        else:
            inverse, shapes = _sparse(stiff, chosen.mass, count)
    except (np.linalg.LinAlgError, RuntimeError) as error:
        raise _loose(chosen) from error
    keep = inverse > 0
    squares = 1 / inverse[keep] - shift
    frequencies = np.sqrt(np.maximum(squares, 0)) / (2 * math.pi)
    normal = shapes[:, keep]
    masses = np.einsum("im,im->m", normal, chosen.mass @ normal)
    return frequencies, normal / np.sqrt(masses)


def _dense(stiff: sp.csc_matrix, mass: sp.csc_matrix, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Greatest eigenvalues 1/omega^2 of M x = mu K x first, with shapes: what has no mass is no trouble."""
    # In units in which the stiffness has a diagonal of one, so that rounding is the same everywhere.
    units = 1 / np.sqrt(stiff.diagonal())
    if not np.all(np.isfinite(units)):
        raise np.linalg.LinAlgError
    scaled, inertia = (units[:, None] * m.toarray() * units for m in (stiff, mass))
    size = len(units)
    least = max(0, size - count)
    inverse, shapes = scipy.linalg.eigh(inertia, scaled, subset_by_index=[least, size - 1])
    return inverse[::-1], units[:, None] * shapes[:, ::-1]


def _sparse(stiff: sp.csc_matrix, mass: sp.csc_matrix, count: int) -> tuple[np.ndarray, np.ndarray]:
    start = np.cos(np.arange(stiff.shape[0]) ** 2)  # any vector, but the same every time
    squares, shapes = scipy.sparse.linalg.eigsh(stiff, count, mass, sigma=0.0, v0=start, ncv=max(2 * count + 20, 40))
    order = np.argsort(squares)
    return 1 / squares[order], shapes[:, order]


def free_joints(chosen: Mesh) -> str:
    """Names of the joints (or "the platform") that move in the motions which nothing resists.

    Of joints that have one freedom at most three, those which move most; balls and crosses are named only where no other moves,
    since they follow whatever is loose.
    """
    structure = chosen.structure
    transform = chosen.transform.toarray()
    first_joint = 6 * len(structure.nodes)
    units = np.ones(len(transform))
    units[:first_joint] = np.tile(np.r_[np.full(3, 1 / structure.scale), np.ones(3)], len(structure.nodes))
    turns = [np.any(tie.screws[3:, :] != 0, axis=0) for tie in structure.connections]
    own_units = np.where(np.concatenate(turns), 1.0, 1 / structure.scale)
    units[first_joint : first_joint + len(own_units)] = own_units
    metric = (units[:, None] * transform).T @ (units[:, None] * transform)
    rates, motions = scipy.linalg.eigh(chosen.stiffness.toarray(), metric)
    loose = np.abs(rates) < LOOSE * np.median(np.abs(rates))
    loose[0] = True
    size = np.linalg.norm(units[:, None] * (transform @ motions[:, loose]), axis=1)[first_joint:]
    single: dict[str, float] = {}
    several: dict[str, float] = {}
    place = 0
    for tie in structure.connections:
        slack = tie.rates == 0
        own = size[place : place + len(slack)][slack]
        place += len(slack)
        if len(own):
            (single if len(own) == 1 else several)[tie.name] = float(own.max())
    for group in (single, several):
        moving = sorted((name for name in group if group[name] > 0.1 * max(group.values())), key=lambda n: -group[n])
        if moving and max(group.values()) > 1e-3 * size.max():
            return ", ".join(moving[:3])
    return "the platform"


def exact_frequencies(structure: Structure, start: np.ndarray) -> np.ndarray:
    """Natural frequencies (m,) in Hz free of the error of the mesh on which they were found, mode by mode.

    On elements too short to resonate between their ends, the number of negative eigenvalues of the dynamic stiffness is the
    number of modes below (Wittrick and Williams, Q. J. Mech. Appl. Math. 24:263, 1971); so the r-th eigenvalue of the problem
    linearised at a frequency near the r-th mode leads to the r-th mode and no other, double ones included.
    """
    squares = (2 * math.pi * np.asarray(start, dtype=float)) ** 2
    exact = ExactStructure(exact_mesh(structure, math.sqrt(squares.max()) * 1.2))
    still, _ = exact.real(0.0)
    index = 0
    while index < len(squares):
        square, low, high = float(squares[index]), 0.0, math.inf
        last = min(index + ALIKE, len(squares)) - 1
        for _ in range(MOST_STEPS):
            stiffness, mass = exact.real(square)
            # What has no mass of its own gets a trace of it: that shortens steps, and moves no zero.
            mass = mass + TRACE / max(square, RIGID) * still
            steps = scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=[index, last])
            # The error of a step goes with its square.
            is_small = np.abs(steps) < max(NEAR * square, ROUNDING * squares[-1])
            found = len(steps) if is_small.all() else int(np.argmin(is_small))
            if found:
                squares[index : index + found] = square + steps[:found]
                index += found
                break
            # The sign of a step is that of what is left: modes lie between the places from which steps led up and down.
            low, high = (square, high) if steps[0] > 0 else (low, square)
            square += float(steps[0])
            if not low < square < high:
                square = (low + min(high, 4 * low)) / 2
        else:
            raise NoResultError(f"mode {index + 1}, near {math.sqrt(square) / (2 * math.pi):.6g} Hz, was not found exactly")
    return np.sqrt(np.maximum(squares, 0)) / (2 * math.pi)
