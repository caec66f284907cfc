"""How near is a pose to a singularity, and what would go wrong there?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.singularity import Singularity, conditions, singularity
from trivet.kinematics.standing import home_pose
from trivet.kinematics.transmission import Transmission, transmissions
from trivet.space.frame import Frame, Turn
from trivet.space.pose import zyz_angles, zyz_frame
from trivet.space.vector import Vec
from trivet.study.machines import MachineLike, choose

DIRECTIONS, TILTS = 24, 90
"""Directions in which the platform is tilted to find the next singularity, and steps to a right angle."""
HALVINGS = 40


class TiltMargin(NamedTuple):
    """The smallest tilt about the platform centre, out of `DIRECTIONS`, that leads to a Type 2 singularity."""

    angle: float
    """rad; found to rounding.  Infinite when there is none up to a right angle and as far as the chains reach."""
    azimuth: float
    """Direction of the tilt about the platform normal, from x of {E}, rad."""


@dataclass(frozen=True)
class SingularityReport:
    """Singularity and transmission at one pose."""

    singularity: Singularity

    @cached_property
    def transmission(self) -> Transmission:
        """Input and output transmission indices (n_actuators,) in the order of Q; without a unit, between 0 and 1."""
        machine, frame = self.singularity.machine, self.singularity.frame
        one = Frame(*(Vec(*(np.array([float(c)]) for c in v)) for v in frame))
        found = transmissions(machine, one, closed_form_signs(machine, self.singularity.mode))
        return Transmission(np.asarray(found.input)[0], np.asarray(found.output)[0])

    @cached_property
    def tilt_margin(self) -> TiltMargin:
        """How far the platform tilts, its centre held, until the drives lose it."""
        if self.singularity.type >= 2:
            return TiltMargin(0.0, 0.0)
        azimuths = 2 * math.pi / DIRECTIONS * np.arange(DIRECTIONS)
        steps = math.pi / 2 / TILTS * np.arange(TILTS + 1)
        side = np.sign(self._tilted(azimuths[:, None], steps)[:, 1:] * self.singularity.determinants.j_x)
        crossed = side <= 0  # and False where a chain does not reach
        open_ways = np.cumsum(np.isnan(side), axis=1) == 0
        first = np.where((crossed & open_ways).any(axis=1), (crossed & open_ways).argmax(axis=1), TILTS)
        if first.min() == TILTS:
            return TiltMargin(math.inf, math.nan)
        ways = np.flatnonzero(first == first.min())
        low, high = np.full(len(ways), steps[first.min()]), np.full(len(ways), steps[first.min() + 1])
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            ahead = self._tilted(azimuths[ways, None], middle[:, None])[:, 0] * self.singularity.determinants.j_x > 0
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        nearest = int(low.argmin())
        rest = self._tilted(azimuths[ways[nearest], None], low[nearest, None])
        if abs(rest.item()) > 1e-6 * abs(self.singularity.determinants.j_x):
            return TiltMargin(math.inf, math.nan)  # a jump from branch to branch, not a singularity
        return TiltMargin(float(high[nearest]), float(azimuths[ways[nearest]]))

    def _tilted(self, azimuth: NDArray[Any], angle: NDArray[Any]) -> NDArray[Any]:
        """det J_x with the platform tilted about its centre; azimuths and angles broadcast."""
        machine, frame = self.singularity.machine, self.singularity.frame
        tilt = zyz_frame(np.zeros(3), azimuth, angle, -azimuth)
        shape = np.broadcast_shapes(azimuth.shape, angle.shape)
        turned = frame.turned_by(Turn(tilt.x, tilt.y, tilt.z))
        poses = jax.tree.map(lambda c: np.broadcast_to(np.asarray(c, dtype=float), shape).ravel(), turned)
        signs = closed_form_signs(machine, self.singularity.mode)
        return np.asarray(conditions(machine, poses, signs).determinants.j_x).reshape(shape)

    @property
    def angles(self) -> tuple[float, float, float]:
        """alpha, beta, gamma of the pose, rad."""
        azimuth, tilt, roll = (float(a) for a in zyz_angles(self.singularity.frame))
        return azimuth, tilt, roll


def singularity_report(machine: MachineLike, pose: Frame | None = None, *, mode: str | None = None) -> SingularityReport:
    """Type, meaning and distance of singularities at one pose, and how well forces are transmitted there.

    Args:
        machine: machine, name or file; its chains in closed form.
        pose: platform frame {E} in {O}, of floats (m), see `trivet.space.pose.zyz_frame`; home when not given.
        mode: working mode; the machine's own when not given.

    Raises:
        InputError: for a machine with more or fewer drives than the platform has freedoms, or a chain without closed form.
        NoResultError: when a chain does not reach the pose.
    """
    chosen = choose(machine)
    closed_form_signs(chosen, mode)
    return SingularityReport(singularity(chosen, home_pose(chosen) if pose is None else pose, mode))
