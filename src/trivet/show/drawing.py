"""Drawing a machine: a picture (PNG) or a page that can be turned with the mouse (HTML)."""

from __future__ import annotations

import math
import os
from pathlib import Path

from trivet.errors import InputError, nearest
from trivet.files import replacing
from trivet.kinematics.singularity import Motion
from trivet.model import Machine
from trivet.show.palette import paint
from trivet.show.scene import Scene, scene
from trivet.space.frame import Frame
from trivet.space.pose import zyz_angles

SUFFIXES = (".png", ".html")


def draw(
    machine: Machine,
    pose: Frame | None = None,
    mode: str | None = None,
    *,
    path: str | os.PathLike[str],
    status: str = "",
    motion: Motion | None = None,
    overwrite: bool = False,
) -> None:
    """Draw a machine at a pose into a file; it appears whole or not at all.

    Args:
        machine: the machine.
        pose: platform frame {E} in {O}, of floats (m), see `trivet.space.pose.zyz_frame`; home when not given.
        mode: working mode; the machine's own when not given.
        path: file to write; its suffix says what: .png is a picture of 1200 x 900, .html a page that needs no network.
        status: what is to be said about the pose; joints which it names ("leg-2.hinge is above its limit") are marked.
        motion: a motion of the platform to be shown, see `trivet.show.scene.scene`.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: when the suffix is another, the file exists unasked or cannot be written, or the mode does not fit.
        NoResultError: when a chain does not reach the pose.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: a drawing ends in {' or '.join(SUFFIXES)}{nearest(suffix, SUFFIXES) if suffix else ''}")
    with replacing(path, overwrite=overwrite) as temporary:
        seen = scene(machine, pose, mode, motion)
        painted = paint(seen.shapes, status)
        if suffix == ".png":
            from trivet.show.picture import write_picture as write_drawing
        else:
            from trivet.show.page import write_page as write_drawing
        write_drawing(painted, seen, heading(machine, seen, status), temporary)


def heading(machine: Machine, seen: Scene, status: str = "") -> list[str]:
    """Lines above a drawing: the machine, how it stands, and the status where there is one."""
    return title_lines(machine, seen.pose, seen.mode) + ([status] if status else [])


def title_lines(machine: Machine, pose: Frame, mode: str) -> list[str]:
    """The machine, and how it stands."""
    x, y, z = (1e3 * float(c) for c in pose.origin)
    azimuth, tilt, roll = (math.degrees(a) for a in zyz_angles(pose))
    stand = f"pose x {_short(x)}, y {_short(y)}, z {_short(z)} mm, α {_short(azimuth)}, β {_short(tilt)}, γ {_short(roll)} deg"
    signs = f"mode {mode}   ".replace("-", "−") if mode else ""
    return [f"{machine.name}: {machine.about.title}" if machine.about.title else machine.name, signs + stand]


def _short(value: float) -> str:
    """Four digits, without a negative zero."""
    return f"{round(value, 6) + 0.0:.4g}".replace("-", "−")
