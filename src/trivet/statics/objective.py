"""Scalars of a stiffness: what a roll may be chosen for and what maps show.

Spelled alike in commands and in Python: `K_xx` (diagonal of the stiffness, all other displacements held), `1/C_xx` (inverse of
the diagonal of the compliance, all other directions unloaded), x, y, z for translations and rx, ry, rz for rotations, and
`K(1,0,1)` or `1/C(1,0,1)` along any direction of {O}.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from trivet.errors import InputError, nearest
from trivet.space.scalar import Scalar, add, mul
from trivet.space.symmetric import Symmetric

AXES = ("x", "y", "z", "rx", "ry", "rz")
NAMES = tuple(f"{kind}_{a}{a}" for kind in ("K", "1/C") for a in AXES[:3]) + tuple(
    f"{kind}_{a}" for kind in ("K", "1/C") for a in AXES[3:]
)
_ALONG = re.compile(r"(K|1/C)\(([^,()]+),([^,()]+),([^,()]+)\)")


@dataclass(frozen=True)
class Objective:
    """A scalar of a stiffness matrix; greater is stiffer."""

    name: str
    held: bool
    """Whether the other displacements are held (K) or the other directions unloaded (1/C)."""
    direction: tuple[float, ...]
    """Unit vector over (x, y, z, rx, ry, rz)."""

    def __call__(self, stiffness: Symmetric) -> Scalar:
        """Value for one 6 x 6 stiffness (N/m, or N m/rad along a rotation)."""
        matrix = stiffness if self.held else stiffness.inverse()
        total: Scalar = 0
        for i, a in enumerate(self.direction):
            for j, b in enumerate(self.direction):
                total = add(total, mul(matrix[i, j], a * b))
        return total if self.held else 1 / total

    @property
    def is_rotational(self) -> bool:
        """Whether its unit is N m/rad rather than N/m."""
        return any(self.direction[3:])


def objective(name: str) -> Objective:
    """Read an objective.

    Raises:
        InputError: for an unknown name or a direction without length.
    """
    if name in NAMES:
        kind, axis = name.rsplit("_", 1)
        axis = axis if axis in AXES else axis[0]
        return Objective(name, kind == "K", tuple(1.0 if a == axis else 0.0 for a in AXES))
    match = _ALONG.fullmatch(name.replace(" ", ""))
    if match is None:
        raise InputError(f"objective '{name}' is not known{nearest(name, (*NAMES, 'K(1,0,1)'))}")
    try:
        vector = [float(v) for v in match.groups()[1:]]
    except ValueError:
        vector = [math.nan]
    size = math.sqrt(sum(v * v for v in vector))
    if not 0 < size < math.inf:
        raise InputError(f"objective '{name}': its direction needs three numbers, not all zero")
    return Objective(name, match[1] == "K", (*(v / size for v in vector), 0.0, 0.0, 0.0))


K_XX = objective("K_xx")
