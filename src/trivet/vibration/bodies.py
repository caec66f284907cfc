"""Bodies of any shape between two nodes of a structure, reduced to the motions of their ends and a few shapes of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg


@dataclass(frozen=True)
class Body:
    """A body in place of a beam: 12 freedoms at its ends, ordered as in `statics.beam_element`, then i internal coordinates."""

    name: str
    """Chain and element to which it belongs: "leg-1.link"."""
    first: int
    """Number of the node at which it starts."""
    second: int
    """Number of the node at which it ends."""
    axes: np.ndarray
    """(3, 3): columns are its own axes in {O}, x from the first node to the second."""
    stiffness: np.ndarray
    """(12 + i, 12 + i): its ends in its own axes, SI."""
    mass: np.ndarray
    """(12 + i, 12 + i), SI."""
    loss_factor: float | None
    """Structural damping of its material; that of the analysis when None."""

    @property
    def internal(self) -> int:
        """How many internal coordinates it has."""
        return len(self.stiffness) - 12

    def in_world(self, own: np.ndarray) -> np.ndarray:
        """(12 + i, 12 + i): a matrix with the ends turned to {O}; internal coordinates know no direction."""
        turn = scipy.linalg.block_diag(*[self.axes] * 4, np.eye(self.internal))
        turned: np.ndarray = turn @ own @ turn.T
        return turned
