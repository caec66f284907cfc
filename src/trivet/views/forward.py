"""All assembly modes at drive coordinates."""

from __future__ import annotations

import math
from typing import Any

from trivet.kinematics.forward import Forward, drive_elements
from trivet.views.layout import decimals, plain_number, table
from trivet.views.si import finite, pose_keys


def tables(result: Forward) -> list[Any]:
    """All assembly modes at drive coordinates."""
    drives = table(f"{result.machine.name}: drives", "drive", "coordinate")
    for (name, value), element in zip(result.drives.items(), drive_elements(result.machine), strict=True):
        text = f"{plain_number(math.degrees(value))}°" if element.is_angular else f"{plain_number(value * 1e3)} mm"
        drives.add_row(name, text)
    columns = ("", "mode", "x mm", "y mm", "z mm", "α °", "β °", "γ °", "mirror", "home", "joints")
    poses = table("poses with these drive coordinates", *columns, left=2)
    for k, pose in enumerate(result.modes, 1):
        place = (decimals(v * 1e3) for v in pose.position)
        angles = (decimals(math.degrees(v)) for v in pose.angles)
        twin = "" if pose.mirror is None else f"{pose.mirror + 1}" + (" (itself)" if pose.mirror + 1 == k else "")
        joints = "inside" if pose.miss is None else f"{pose.miss.chain}.{pose.miss.joint} outside"
        number = f"{k}" if pose.multiplicity == 1 else f"{k} (double)"
        poses.add_row(number, pose.mode, *place, *angles, twin, pose.home, joints)
    if result.expected is not None:
        real = sum(pose.multiplicity for pose in result.modes)
        words = f"{result.found} of {result.expected} complex solutions found, {real} of them real" + (
            "; so these are all poses there are" if result.complete else f"; NOT complete: {result.remark}"
        )
    else:
        words = result.remark
    worst = max(pose.residual for pose in result.modes)
    return [drives, poses, f"{words}. Drives at these poses deviate by {worst:.1g} m or rad at most."]


def as_json(result: Forward) -> dict[str, Any]:
    """All assembly modes at drive coordinates."""
    return {
        "machine": result.machine.name,
        "drives_m_or_rad": result.drives,
        "complex_solutions_expected": result.expected,
        "complex_solutions_found": result.found,
        "complete": result.complete,
        "remark": result.remark,
        "poses": [
            {
                **pose_keys(pose.position, pose.angles),
                "rotation": [[float(c) for c in row] for row in pose.frame.matrix()],
                "hinges_rad": pose.hinges,
                "mode": pose.mode,
                "inside_travel": pose.miss is None,
                "reason": None if pose.miss is None else pose.miss.reason,
                "mirror": pose.mirror,
                "home": pose.home,
                "multiplicity": pose.multiplicity,
                "drive_residual_m_or_rad": finite(pose.residual),
                "angle_error_rad": finite(pose.error),
            }
            for pose in result.modes
        ],
    }
