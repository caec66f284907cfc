"""How near is a pose to a singularity, and what would go wrong there?"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.singularity import Singularity, singularity
from trivet.kinematics.standing import home_pose
from trivet.kinematics.transmission import Transmission, transmissions
from trivet.space.frame import Frame
from trivet.space.pose import zyz_angles
from trivet.space.vector import Vec
from trivet.study.machines import MachineLike, choose


@dataclass(frozen=True)
class SingularityReport:
    """Singularity and transmission at one pose."""

    singularity: Singularity

    @cached_property
    def transmission(self) -> Transmission:
        """Input and output transmission indices (n_actuators,) in the order of Q; without a unit, between 0 and 1."""
        machine, frame = self.singularity.machine, self.singularity.frame
        one = Frame(*(Vec(*(np.array([float(c)]) for c in v)) for v in frame))
        found = transmissions(machine, one, closed_form_signs(machine, self.singularity.mode or None))
        return Transmission(np.asarray(found.input)[0], np.asarray(found.output)[0])

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
