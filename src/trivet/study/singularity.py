"""How near is a pose to a singularity, and what would go wrong there?"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
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

DIRECTIONS, STEPS = 24, 90
"""Directions in which the platform is tilted to find the next singularity, and steps on each way."""
SHIFTS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
SHIFTS /= np.linalg.norm(SHIFTS, axis=1, keepdims=True)
"""(26, 3) directions in {O} in which the centre is moved to find it."""
HALVINGS = 40


class TiltMargin(NamedTuple):
    """The smallest tilt about the platform centre, out of `DIRECTIONS`, that leads to a Type 2 singularity."""

    angle: float
    """rad; found to rounding.  Infinite when there is none up to a right angle and as far as the chains reach."""
    azimuth: float
    """Direction of the tilt about the platform normal, from x of {E}, rad."""


class ShiftMargin(NamedTuple):
    """The smallest displacement of the platform centre, out of the directions `SHIFTS`, that leads to a Type 2 singularity."""

    length: float
    """m; found to rounding.  Infinite when there is none as far as the chains reach."""
    direction: tuple[float, float, float]
    """In {O}, of length one."""


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
        angle, way = self._met(lambda ways, angles: self._tilted(azimuths[ways], angles), DIRECTIONS, math.pi / 2)
        return TiltMargin(angle, math.nan if math.isinf(angle) else float(azimuths[way]))

    @cached_property
    def shift_margin(self) -> ShiftMargin:
        """How far the platform centre moves, the platform not turned, until the drives lose it."""
        if self.singularity.type >= 2:
            return ShiftMargin(0.0, (0.0, 0.0, 0.0))
        centre = np.array(self.singularity.frame.origin, dtype=float)
        feet = [np.array(leg.base_frame().origin, dtype=float) for leg in self.singularity.machine.legs]
        farthest = max(float(np.linalg.norm(foot - centre)) for foot in feet)
        length, way = self._met(lambda ways, lengths: self._shifted(SHIFTS[ways], lengths), len(SHIFTS), farthest)
        x, y, z = (math.nan,) * 3 if math.isinf(length) else SHIFTS[way]
        return ShiftMargin(length, (float(x), float(y), float(z)))

    def _met(self, there: Callable[[NDArray[Any], NDArray[Any]], NDArray[Any]], count: int, most: float) -> tuple[float, int]:
        """The least amount, up to `most`, at which det J_x vanishes on one of so many ways, and the number of that way.

        Args:
            there: det J_x on ways by their numbers and at amounts, which broadcast; NaN where a chain does not reach.
            count: of ways.
            most: amounts go in `STEPS` steps from zero to this.

        Returns:
            Infinity and 0 where it vanishes on none before the chains end.
        """
        here, steps = self.singularity.determinants.j_x, most / STEPS * np.arange(STEPS + 1)
        side = np.sign(there(np.arange(count)[:, None], steps)[:, 1:] * here)
        crossed = side <= 0  # and False where a chain does not reach
        open_ways = np.cumsum(np.isnan(side), axis=1) == 0
        first = np.where((crossed & open_ways).any(axis=1), (crossed & open_ways).argmax(axis=1), STEPS)
        if first.min() == STEPS:
            return math.inf, 0
        numbers, met = np.arange(count), first == first.min()
        low, high = np.full(count, steps[first.min()]), np.full(count, steps[first.min() + 1])
        for _ in range(HALVINGS):  # all ways, so that there is one kernel however many are met
            middle = (low + high) / 2
            ahead = there(numbers[:, None], middle[:, None])[:, 0] * here > 0
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        nearest = int(np.where(met, low, math.inf).argmin())
        if abs(there(numbers[:, None], low[:, None])[nearest, 0]) > 1e-6 * abs(here):
            return math.inf, 0  # a jump from branch to branch, not a singularity
        return float(high[nearest]), nearest

    def _tilted(self, azimuth: NDArray[Any], angle: NDArray[Any]) -> NDArray[Any]:
        """det J_x with the platform tilted about its centre; azimuths and angles broadcast."""
        tilt = zyz_frame(np.zeros(3), azimuth, angle, -azimuth)
        turned = self.singularity.frame.turned_by(Turn(tilt.x, tilt.y, tilt.z))
        return self._determinants(turned, np.broadcast_shapes(azimuth.shape, angle.shape))

    def _shifted(self, directions: NDArray[Any], length: NDArray[Any]) -> NDArray[Any]:
        """det J_x with the platform moved along directions (…, 3) by lengths that broadcast."""
        frame = self.singularity.frame
        moved = Vec(*(own + directions[..., k] * length for k, own in enumerate(frame.origin)))
        return self._determinants(frame._replace(origin=moved), np.broadcast_shapes(directions.shape[:-1], length.shape))

    def _determinants(self, poses: Frame, shape: tuple[int, ...]) -> NDArray[Any]:
        """det J_x at poses of a shape."""
        machine = self.singularity.machine
        rows = jax.tree.map(lambda c: np.broadcast_to(np.asarray(c, dtype=float), shape).ravel(), poses)
        signs = closed_form_signs(machine, self.singularity.mode)
        return np.asarray(conditions(machine, rows, signs).determinants.j_x).reshape(shape)

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
