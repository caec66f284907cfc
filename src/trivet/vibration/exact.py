"""Exact dynamic stiffness between all nodes of a structure: its beams by their transfer matrices, the rest as in the mesh.

It goes where the fast path of `vibration.spectral` does not: to any point of a machine, and to its modes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import InputError
from trivet.statics.assembly import Structure
from trivet.statics.beam_element import BeamElement, Uniform, turned
from trivet.vibration.mesh import MOST_ELEMENTS, Mesh, inertia_at_node, mesh
from trivet.vibration.spectral_beam import Array, terms_for, transfer_matrix, wave_numbers

AT_ONCE = 32
"""Frequencies whose matrices are in memory at the same time."""
SHORT = 2.0
"""Wave number times length of an element below which no element resonates between its own ends (the first at 3.14)."""


def exact_mesh(structure: Structure, highest: float) -> Mesh:
    """A structure, its beams divided so that no element resonates between its ends up to a highest frequency (rad/s)."""
    return mesh(structure, pieces(structure, highest, SHORT))


def pieces(structure: Structure, highest: float, argument: float) -> dict[str, int]:
    """Into how many elements to divide every beam, by its name, for a greatest wave number times length of an element.

    Raises:
        InputError: for a frequency (rad/s) at which a beam would need more elements than a mesh takes.
    """
    counts: dict[str, int] = {}
    for beam in structure.beams:
        own = float(wave_numbers(beam.made_of, highest).max()) * float(beam.length) / argument
        if not own < MOST_ELEMENTS:
            hertz = highest / (2 * math.pi)
            raise InputError(f"frequency {hertz:g} Hz: {beam.name} would need {own:.0f} elements, more than {MOST_ELEMENTS}")
        counts[beam.name] = max(counts.get(beam.name, 1), math.ceil(own))
    return counts


class ExactStructure:
    """Dynamic stiffness of a structure as a function of frequency, on the independent displacements of a mesh."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        structure = mesh.structure
        self._transform = mesh.transform.toarray()
        self._beams = _kinds(structure.beams)
        self._dofs = [np.r_[6 * b.first : 6 * b.first + 6, 6 * b.second : 6 * b.second + 6] for b in structure.beams]
        size = self._transform.shape[0]
        self._mass = np.zeros((size, size))
        for lump in structure.masses:
            own = slice(6 * lump.node, 6 * lump.node + 6)
            self._mass[own, own] += inertia_at_node(structure, lump)
        self._ties = structure.connections
        self._first_joint = 6 * len(structure.nodes)

    def real(self, square: float) -> tuple[np.ndarray, np.ndarray]:
        """(q, q) undamped dynamic stiffness at omega^2, and its derivative with respect to omega^2, with the sign of a mass."""
        size = len(self._transform)
        stiffness, mass = np.zeros((size, size)), self._mass.copy()
        for (made, length, terms), numbers in self._beams:
            value, slope = _undamped(made, length, terms, square)
            for number in numbers:
                axes, dofs = self.mesh.structure.beams[number].axes, self._dofs[number]
                stiffness[np.ix_(dofs, dofs)] += turned(np.asarray(value), axes)
                mass[np.ix_(dofs, dofs)] -= turned(np.asarray(slope), axes)
        stiffness -= square * self._mass
        self._add_springs(stiffness, lambda tie: tie.rates)
        return self._transform.T @ stiffness @ self._transform, self._transform.T @ mass @ self._transform

    def damped(self, omega: np.ndarray, loss_factor: float) -> np.ndarray:
        """(n, q, q) complex dynamic stiffness at frequencies (n,) in rad/s."""
        omega = np.asarray(omega, dtype=float)
        size = len(self._transform)
        stiffness = np.zeros((len(omega), size, size), dtype=complex)
        for (made, length, terms), numbers in self._beams:
            own = loss_factor if made.loss_factor is None else made.loss_factor
            value = np.asarray(_damped(made, length, terms, omega**2, own))
            for number in numbers:
                dofs = self._dofs[number]
                stiffness[:, dofs[:, None], dofs] += turned(value, self.mesh.structure.beams[number].axes)
        stiffness -= omega[:, None, None] ** 2 * self._mass

        def rates(tie: Any) -> np.ndarray:
            own = loss_factor if tie.loss_factor is None else tie.loss_factor
            complex_rates: np.ndarray = tie.rates * (1 + 1j * own) + 1j * omega[:, None] * tie.viscosity
            return complex_rates

        self._add_springs(stiffness, rates)
        return self._transform.T @ stiffness @ self._transform

    def receptance(self, rows: np.ndarray, columns: np.ndarray, omega: np.ndarray, loss_factor: float) -> np.ndarray:
        """(n, a, b) of what is looked at and what is loaded, (a, q) and (b, q) of the independent displacements."""
        parts = np.array_split(omega, -(-len(omega) // AT_ONCE))
        return np.concatenate([rows @ np.linalg.solve(self.damped(part, loss_factor), columns.T) for part in parts])

    def _add_springs(self, stiffness: np.ndarray, rates: Callable[[Any], np.ndarray]) -> None:
        place = self._first_joint
        for tie in self._ties:
            own = np.arange(place, place + len(tie.rates))
            stiffness[..., own, own] += rates(tie)
            place += len(tie.rates)


def _kinds(beams: tuple[BeamElement, ...]) -> list[tuple[tuple[Uniform, float, int], list[int]]]:
    """Beams that are alike, with their numbers."""
    found: dict[tuple[Uniform, float, int], list[int]] = {}
    for number, beam in enumerate(beams):
        found.setdefault((beam.made_of, float(beam.length), terms_for(2 * SHORT)), []).append(number)
    return list(found.items())


def _between_ends(made: Uniform, length: Any, terms: int, square: Any, elastic: Any) -> Array:
    """(12, 12): loads at both ends of a beam from the motions of both, in local axes."""
    matrix = transfer_matrix(made, length, jnp.asarray(square)[None], elastic, terms)[0]
    near, far = slice(0, 6), slice(6, 12)
    soft = jnp.linalg.inv(matrix[near, far])
    here, there = soft @ matrix[near, near], matrix[far, far] @ soft
    both: Array = jnp.block([[here, -soft], [-soft.T, there]])
    return both


@partial(jax.jit, static_argnums=2)
def _undamped(made: Uniform, length: float, terms: int, square: float) -> tuple[Array, Array]:
    return jax.jvp(lambda s: _between_ends(made, length, terms, s, 1.0), (jnp.asarray(square),), (jnp.asarray(1.0),))


@partial(jax.jit, static_argnums=2)
def _damped(made: Uniform, length: float, terms: int, squares: Array, loss_factor: float) -> Array:
    """(n, 12, 12) at n omega^2."""
    return jax.vmap(lambda square: _between_ends(made, length, terms, square, 1 + 1j * loss_factor))(squares)
