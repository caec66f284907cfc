"""Modes as vectors whose inner product is the mass: what modes at different poses are compared by.

The kinetic energy of a vibrating structure is a sum of squares: of every element of a beam, its displacements in its own axes
times the Cholesky factor of its mass; of every rigid mass, the motion of its centre times the root of the mass and the rotation
times the root of the inertia.  Stacked, the terms of all parts make a vector: modes of one pose are orthonormal ones, whatever
the units.  Beams are seen in their own axes, the platform in {E}: a machine that turns as a whole has the vectors it had.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from trivet.statics.assembly import PLATFORM, NodeMass
from trivet.statics.structure import carry
from trivet.vibration.beam_mass import local_mass
from trivet.vibration.modes import Modes


class Layout:
    """Which rows of the vectors belong to which part, the same at all poses.

    A beam that is all but drawn in is a joint of the mesh there, and has no elements: its rows are zero then, as its mass is
    next to nothing.  Rows of a part that appears only later come last, and vectors from before are shorter.
    """

    def __init__(self) -> None:
        self._rows: dict[str, slice] = {}
        self._size = 0

    def vectors(self, modes: Modes, axes: np.ndarray) -> np.ndarray:
        """(N, m): modes as vectors.

        Args:
            modes: at a pose, of unit modal mass.
            axes: (3, 3) axes of the platform there, as columns.
        """
        found = {f"beam {name}": terms for name, terms in _beams(modes).items()}
        for k, lump in enumerate(modes.mesh.structure.masses):
            # The masses of stubs come after those that every pose has.
            found[f"mass {k} {lump.name}"] = _rigid(modes, lump, axes)
        for name, terms in found.items():
            if name not in self._rows:
                self._rows[name] = slice(self._size, self._size + len(terms))
                self._size += len(terms)
        whole = np.zeros((self._size, modes.shapes.shape[1]))
        for name, terms in found.items():
            whole[self._rows[name]] = terms
        return whole


def _beams(modes: Modes) -> dict[str, np.ndarray]:
    """Terms (12 n, m) of beams of n elements by their names; of none without mass."""
    pieces: dict[str, list[np.ndarray]] = {}
    factors: dict[str, np.ndarray] = {}
    for beam in modes.mesh.structure.beams:
        if beam.made_of.mass == 0:
            continue
        if beam.name not in factors:
            # Cholesky's factor, and no other root, scales as the displacements do when their units change.
            factors[beam.name] = scipy.linalg.cholesky(local_mass(beam))
        ends = np.concatenate([modes.displacements[beam.first], modes.displacements[beam.second]])
        pieces.setdefault(beam.name, []).append(factors[beam.name] @ np.kron(np.eye(4), beam.axes.T) @ ends)
    return {name: np.concatenate(terms) for name, terms in pieces.items()}


def _rigid(modes: Modes, lump: NodeMass, axes: np.ndarray) -> np.ndarray:
    """Terms (6, m) of a rigid mass; in {O}, but in the platform's axes where it moves with the platform."""
    seen = axes if lump.node == PLATFORM else np.eye(3)
    moved = carry(lump.at - modes.mesh.structure.nodes[lump.node]) @ modes.displacements[lump.node]
    moments, principal = np.linalg.eigh(seen.T @ lump.inertia @ seen)
    root = (principal * np.sqrt(np.maximum(moments, 0))) @ principal.T
    return np.concatenate([np.sqrt(lump.mass) * (seen.T @ moved[:3]), root @ (seen.T @ moved[3:])])
