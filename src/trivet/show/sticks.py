"""A machine as lines: every chain from its foot to the platform, and the platform's outline."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.standing import stand
from trivet.model import Machine
from trivet.model.elements import Curvilinear
from trivet.space.frame import Frame


def sticks(machine: Machine, pose: Frame, signs: Any) -> list[NDArray[Any]]:
    """Polylines (n, 3) in {O}, mm: one per chain, and the closed outline of the platform last.

    Args:
        machine: the machine.
        pose: platform frame of floats.
        signs: (n_chains, 2) working mode.
    """
    found = []
    for one in stand(machine, pose, signs):
        tip = pose.shift(one.leg.platform_frame().origin).origin
        # A circular guide starts in the middle of its circle, where nothing of it is.
        starts = [frame.origin for element, frame, _ in one.steps if not isinstance(element, Curvilinear)]
        found.append(1e3 * np.array([[float(c) for c in origin] for origin in (*starts, tip)]))
    tips = np.array([line[-1] for line in found])
    inner = (tips - 1e3 * np.array([float(c) for c in pose.origin])) @ np.array(pose.matrix(), dtype=float)
    around = np.argsort(np.arctan2(inner[:, 1], inner[:, 0]))
    return [*found, tips[np.r_[around, around[:1]]]]
