"""Stiffness over a surface of check points, each with its best roll."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.mode import closed_form_signs, mode_text, parse_mode
from trivet.kinematics.report import OUTSIDE_TRAVEL, JointState, Shortfall, joint_states, shortfall, travel_excess
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.surface import Surface, hemisphere
from trivet.statics.best_roll import BestRoll, best_roll
from trivet.statics.objective import Objective
from trivet.statics.objective import objective as read_objective
from trivet.statics.stiffness import stiffness
from trivet.study.machines import MachineLike, choose

NOISE = 1e-3
"""What a matrix times its inverse may differ from one; where it is more, the matrix is singular but for rounding."""
_ROLLS_FOR_REASONS, _POINTS_FOR_REASONS = 72, 64


@dataclass(frozen=True)
class StiffnessMap:
    """Stiffness of a machine over a surface; arrays over the n check points, NaN where no roll reaches."""

    machine: Machine
    mode: str
    surface: Surface
    objective: Objective
    best: BestRoll
    matrix: NDArray[Any]
    """(n, 6, 6) at the platform centre in {O}, forces first (SI)."""

    @property
    def used(self) -> NDArray[Any]:
        """(n,) points which some roll reaches."""
        return np.isfinite(self.best.roll)

    @property
    def ties_beyond_symmetry(self) -> NDArray[Any]:
        """(n,) points at which more rolls are equally good than the machine's own rotational symmetry explains."""
        return self.best.ties > roll_symmetry(self.machine, self.mode)

    def diagonal(self, name: str) -> NDArray[Any]:
        """(n,) an element of the diagonal, "K_xx" or "1/C_xx" (N/m; N m/rad for rotations)."""
        wanted = read_objective(name)
        axis = wanted.direction.index(1.0)
        if wanted.held:
            return self.matrix[:, axis, axis]
        return 1 / self.compliance[:, axis, axis]

    @cached_property
    def compliance(self) -> NDArray[Any]:
        """(n, 6, 6) inverse of the stiffness; infinite where the stiffness is singular."""
        result = np.full_like(self.matrix, np.nan)
        length = float(self.machine.characteristic_length or 1.0)
        scale = np.array([1.0] * 3 + [1 / length] * 3)
        matrix = self.matrix[self.used] * np.multiply.outer(scale, scale)
        try:
            found = np.linalg.inv(matrix)
        except np.linalg.LinAlgError:  # exactly singular at some point: one by one
            found = np.array([np.full((6, 6), np.inf) if np.linalg.matrix_rank(m) < 6 else np.linalg.inv(m) for m in matrix])
        with np.errstate(invalid="ignore"):
            is_noise = ~(np.abs(matrix @ found - np.eye(6)).max(axis=(1, 2)) < NOISE)  # NaN where it is infinite
        found = found * np.multiply.outer(scale, scale)
        found[is_noise] = np.inf
        result[self.used] = found
        return result

    @cached_property
    def poses(self) -> Frame:
        """Platform frames at the best rolls (zero roll where none reaches)."""
        roll = np.where(self.used, self.best.roll, 0.0)
        return zyz_frame(self.surface.position, self.surface.azimuth, self.surface.tilt, roll)

    @cached_property
    def joints(self) -> JointState:
        """Joint states at the best rolls, arrays (n, joints)."""
        return JointState(*(np.asarray(a) for a in joint_states(self.machine, self.poses, parse_mode(self.machine, self.mode))))

    @cached_property
    def excluded(self) -> dict[int, Shortfall]:
        """Why points are not reached: index of the point, and what is missing at the roll that comes nearest."""
        missing = np.flatnonzero(~self.used)
        signs = parse_mode(self.machine, self.mode)
        rolls = 2 * math.pi / _ROLLS_FOR_REASONS * np.arange(_ROLLS_FOR_REASONS)
        reasons: dict[int, Shortfall] = {}
        for start in range(0, len(missing), _POINTS_FOR_REASONS):
            points = missing[start : start + _POINTS_FOR_REASONS]
            # Always as many, the last one again and again, so that one compiled kernel serves.
            index = np.repeat(np.pad(points, (0, _POINTS_FOR_REASONS - len(points)), mode="edge"), _ROLLS_FOR_REASONS)
            surface, roll = self.surface, np.tile(rolls, _POINTS_FOR_REASONS)
            frames = zyz_frame(surface.position[index], surface.azimuth[index], surface.tilt[index], roll)
            states = [np.asarray(a) for a in joint_states(self.machine, frames, signs)]
            for k, point in enumerate(points):
                rows = slice(k * _ROLLS_FOR_REASONS, (k + 1) * _ROLLS_FOR_REASONS)
                reasons[int(point)] = _nearest_miss(self.machine, JointState(*(a[rows] for a in states)))
        return reasons

    def exclusions(self) -> dict[str, int]:
        """Counts of excluded points by what excludes them: "slide outside travel", "unreachable"."""
        words = (f"{s.joint} outside travel" if s.joint else "a chain cannot close" for s in self.excluded.values())
        return dict(Counter(words).most_common())


def roll_symmetry(machine: Machine, mode: str) -> int:
    """Number of rolls in a full turn at which the machine is the same but for the names of its chains.

    Copies of one chain on a circular guide change places when the platform rolls from one to the next; a chain with a base
    stays where it is, and so does a mode that differs from chain to chain.
    """
    if any(chain.base is not None for chain in machine.chains.values()) or len(set(mode.split())) > 1:
        return 1
    return math.gcd(*(chain.copies for chain in machine.chains.values()))


def _nearest_miss(machine: Machine, state: JointState) -> Shortfall:
    """Shortfall at the roll which comes nearest to reaching; a chain that cannot close counts as farther than any travel."""
    excess = travel_excess(state).max(axis=1)
    closes = np.all(state.reach >= 0, axis=1)
    reach = np.nan_to_num(np.min(state.reach, axis=1), nan=-np.inf)
    order = np.lexsort((-reach, np.nan_to_num(excess, nan=np.inf), ~closes))
    misses = (shortfall(machine, state, int(roll)) for roll in order)
    other = "it is reached, but only in a window of rolls narrower than the grid, or its stiffness is not a finite number"
    return next((m for m in misses if m is not None), Shortfall(OUTSIDE_TRAVEL, "", "roll", other))


def surface_of(machine: Machine, steps: int = 10, radius: float | None = None, height: float | None = None) -> Surface:
    """The machine's own workpiece hemisphere, or one given by radius and height of its centre (m).

    Raises:
        InputError: when the machine file has no workpiece and either number is missing.
    """
    chosen_height, chosen_radius = workpiece_of(machine, radius, height)
    return hemisphere(chosen_height, chosen_radius, steps)


def workpiece_of(machine: Machine, radius: float | None = None, height: float | None = None) -> tuple[float, float]:
    """Height of the centre and radius (m) of the machine's workpiece hemisphere, unless given; errors as for `surface_of`."""
    piece = machine.workpiece
    if piece is None and (radius is None or height is None):
        raise InputError(f"{machine.name}: has no [workpiece]; give the radius and the height of the hemisphere")
    chosen_radius = radius if radius is not None else float(piece.radius)  # type: ignore[union-attr]
    chosen_height = height if height is not None else float(piece.height)  # type: ignore[union-attr]
    return chosen_height, chosen_radius


def stiffness_map(
    machine: MachineLike,
    surface: Surface | None = None,
    *,
    objective: str = "K_xx",
    mode: str | None = None,
    rolls: int = 360,
    progress: Callable[[int], None] = lambda points: None,
) -> StiffnessMap:
    """Stiffness over a surface with the best roll at every point (paper section 3.3.1).

    Args:
        machine: machine, name or file.
        surface: check points; the machine's own workpiece with the paper's 317 points when not given.
        objective: what the roll maximises ("K_xx", "1/C_zz", "K(1,0,1)", …).
        mode: working mode; the machine's own when not given.
        rolls: rolls of the first grid.
        progress: called with the number of points done.

    Raises:
        NoResultError: when no point of the surface is reached; says what is in the way.
    """
    machine = choose(machine)
    surface = surface if surface is not None else surface_of(machine)
    scalar = read_objective(objective)
    signs = closed_form_signs(machine, mode)
    best = best_roll(machine, surface, signs, scalar, rolls, progress)
    used = np.isfinite(best.roll)
    matrix = np.full((len(surface), 6, 6), np.nan)
    if used.any():
        poses = zyz_frame(surface.position[used], surface.azimuth[used], surface.tilt[used], best.roll[used])
        matrix[used] = stiffness(machine, poses, signs)[0]
    result = StiffnessMap(machine, mode_text(machine, signs), surface, scalar, best, matrix)
    if not used.any():
        first = next(iter(result.excluded.values()))
        mode_words = f" in mode {result.mode}" if result.mode else ""
        raise NoResultError(f"{machine.name}: no point of the {surface.name} is reached{mode_words}; {first.reason}")
    return result
