"""Whether a machine reaches its home pose, and what would: the first thing to know of a file that somebody wrote."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from trivet.errors import NoResultError
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.report import UNREACHABLE, Shortfall, joint_state_once, joint_states, shortfall, travel_excess
from trivet.kinematics.standing import home_pose
from trivet.model import Machine
from trivet.space.pose import zyz_frame

NOT_REACHED = "the pose is not reached"

STEPS, COARSEST, UNKNOWN = 2000, 0.01, 0.1
"""Heights above and below the ground at which home is tried; their step as a part of home's own height, rounded down to a power
of ten; and what stands for that height where it is zero (m)."""


def require_home(machine: Machine, mode: str | None = None, *, within_travel: bool = True) -> None:
    """Raise NoResultError, by its key, for a home that is not reached; or, without travel, only where a chain cannot close."""
    signs = parse_mode(machine, mode)
    try:
        miss = shortfall(machine, joint_state_once(machine, home_pose(machine), signs))
    except NoResultError as error:  # closed numerically
        miss = Shortfall(UNREACHABLE, "", None, str(error))
    if miss is not None and (within_travel or miss.joint is None):
        raise NoResultError(home_words(machine, miss, signs))


def home_words(machine: Machine, miss: Shortfall, signs: Any) -> str:
    """One line for a home that is not reached: key, value, which chain or joint does not, and the nearest height that is."""
    position = ", ".join(f"{1e3 * float(v):g} mm" for v in machine.home.position)
    return f"{machine.name}: home.position {position}: {NOT_REACHED}: {miss.reason}{what_would(machine, signs)}"


def what_would(machine: Machine, signs: Any) -> str:
    """The height nearest to home's own with which home is reached, as the end of a line; empty where none is found."""
    height = None if signs is None else nearest_height(machine, signs)
    return "" if height is None else f"; with z at {1e3 * height:.6g} mm it is"


def nearest_height(machine: Machine, signs: Any) -> float | None:
    """The round z (m) nearest to home's at which the rest of home is reached, in closed form; None where none is found."""
    home = machine.home
    x, y, z = (float(v) for v in home.position)
    step = 10.0 ** math.floor(math.log10(COARSEST * (abs(z) or UNKNOWN)))
    heights = step * np.arange(-STEPS, STEPS + 1)
    centres = np.stack([np.full_like(heights, x), np.full_like(heights, y), heights], axis=1)
    angles = (np.full_like(heights, float(a)) for a in (home.azimuth, home.tilt, home.roll))
    state = joint_states(machine, zyz_frame(centres, *angles), signs)
    closes = np.all(np.asarray(state.reach) >= 0, axis=1)
    reached = heights[closes & np.all(travel_excess(state) <= 0, axis=1)]
    return float(reached[np.argmin(np.abs(reached - z))]) if len(reached) else None
