"""How deep a machine mills without chatter, over spindle speed, at a pose and along a path of poses."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Required, TypedDict, Unpack

import numpy as np

from trivet.chatter.cut import Cut
from trivet.chatter.modal import ModalModel, modal_model
from trivet.chatter.semi_discretisation import stable_depth
from trivet.chatter.tool_point import ToolPoint, tool_point
from trivet.chatter.zero_order import Limits, branches, limits, lowest
from trivet.errors import InputError, NoResultError
from trivet.study.frf import BATCH, HIGHEST
from trivet.study.machines import MachineLike, choose
from trivet.study.pathfile import PathFile, read_path
from trivet.study.pose import PoseReport, pose
from trivet.vibration import spectral
from trivet.vibration.damping import check_loss_factor, least_damping
from trivet.vibration.modes import Modes, modes

LOWEST = 5.0
"""Chatter frequency (Hz) below which none is sought: machines are stiff there."""
MOST_SPEEDS = 10_000
FASTEST = 1e5
"""Spindle speed, rad/s; ten times what the smallest cutters turn at."""
RPM = 2 * math.pi / 60
"""rad/s."""
REGULAR = 1000
"""Equally spaced frequencies."""
AROUND = np.sinh(np.linspace(-5, 5, 81))
"""Where, in half-power half-widths from a resonance, the receptance is looked at besides."""
END = 1e-3
"""Distance from the highest frequency, against it, up to which the lowest limit is said to lie there."""


class Checked(NamedTuple):
    """Stable depths at one spindle speed by two ways."""

    speed: float
    """rad/s."""
    zero_order: float
    """By the lobes, m."""
    semi_discretisation: float
    """In time, with the modes of a mesh, m."""


@dataclass(frozen=True)
class Lobes:
    """Stability lobes of a machine at one pose; SI."""

    at: PoseReport
    cut: Cut
    feed: float
    """Angle of the feed from the direction of growing tilt, rad."""
    point: ToolPoint
    speeds: np.ndarray
    """(n,) rad/s."""
    limits: Limits
    """Over these."""
    lowest_depth: float
    """Stable at every spindle speed, m; infinite where no frequency limits it."""
    lowest_frequency: float
    """At which it chatters above that, Hz."""
    highest: float
    """Highest chatter frequency that is sought, Hz."""
    loss_factor: float
    modes: Modes
    """Of a mesh, up to that."""
    frequency: np.ndarray
    """(f,) at which the receptance is worked out, Hz."""
    receptance: np.ndarray
    """(f, 2, 2) of the tool point along the feed and y, m/N."""

    @property
    def depth(self) -> np.ndarray:
        """(n,) stable depth of cut, m; infinite where none is unstable."""
        return self.limits.depth

    @property
    def is_limited(self) -> bool:
        """Whether there is a lobe in the range of speeds."""
        return bool(np.any(np.isfinite(self.depth)))

    @property
    def is_at_end(self) -> bool:
        """Whether the lowest limit lies at the highest frequency, beyond which there may be a lower one."""
        return bool(self.lowest_frequency > (1 - END) * self.highest)

    @property
    def pockets(self) -> np.ndarray:
        """Places (of `speeds`) between lobes, where the depth is greater than at both sides, the deepest first."""
        return deepest_first(self.depth)

    @property
    def natural(self) -> np.ndarray:
        """Natural frequencies of the mesh up to the highest frequency, Hz."""
        found = self.modes.mesh_frequency
        return found[found <= self.highest]

    @cached_property
    def model(self) -> ModalModel:
        """The tool point by the modes of the mesh up to the highest frequency, without what those above add."""
        return modal_model(self.modes, self.point, self.loss_factor, self.highest)

    def check(
        self, count: int = 8, progress: Callable[[str, int, int], None] = lambda name, done, total: None
    ) -> list[Checked]:
        """Lobes beside semi-discretisation, at so many of the speeds, evenly over them.

        Raises:
            InputError: for no speeds, or more than there are.
            NoResultError: no mode moves the tool.
        """
        if not 1 <= count <= len(self.speeds):
            raise InputError(f"check: {count} speeds; expected 1 to {len(self.speeds)}, those of the lobes")
        rows = []
        for k, place in enumerate(np.linspace(0, len(self.speeds) - 1, count + 2).round().astype(int)[1:-1]):
            speed, own = float(self.speeds[place]), float(self.depth[place])
            guess = own if math.isfinite(own) else self.lowest_depth if math.isfinite(self.lowest_depth) else self.cut.diameter
            rows.append(Checked(speed, own, stable_depth(self.cut, self.model, speed, guess)))
            progress("check", k + 1, count)
        return rows


@dataclass(frozen=True)
class LobesAlong:
    """Stability lobes at the poses of a path."""

    poses: tuple[Lobes, ...]
    """In their order; all over the same speeds."""

    @property
    def speeds(self) -> np.ndarray:
        """(n,) rad/s."""
        return self.poses[0].speeds

    @property
    def depth(self) -> np.ndarray:
        """(p, n) stable depth of cut by pose and speed, m."""
        return np.array([one.depth for one in self.poses])

    @property
    def least(self) -> np.ndarray:
        """(n,) depth that is stable at all poses, m."""
        least: np.ndarray = self.depth.min(axis=0)
        return least

    @property
    def pockets(self) -> np.ndarray:
        """Places (of `speeds`) where that depth is greater than at both sides, the deepest first."""
        return deepest_first(self.least)

    @property
    def worst(self) -> int:
        """The pose whose depth at every spindle speed is the lowest, from 0."""
        return int(np.argmin([one.lowest_depth for one in self.poses]))

    @property
    def is_limited(self) -> bool:
        """Whether there is a lobe in the range of speeds."""
        return any(one.is_limited for one in self.poses)


class Settings(TypedDict, total=False):
    """What `lobes` takes besides the machine and the pose, where its defaults are."""

    cut: Required[Cut]
    feed: float
    slowest: float
    fastest: float
    points: int
    highest: float
    loss_factor: float
    mode: str | None
    anyway: bool


def deepest_first(depth: np.ndarray) -> np.ndarray:
    """Places at which a depth (n,) is greater than at both sides, the deepest first; ends of the range are none."""
    inside = depth[1:-1]
    places = 1 + np.flatnonzero((inside > depth[:-2]) & (inside >= depth[2:]))
    return places[np.argsort(-depth[places], kind="stable")]


def lobes(
    machine: MachineLike,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    *,
    cut: Cut,
    feed: float = 0.0,
    slowest: float = 2000 * RPM,
    fastest: float = 20000 * RPM,
    points: int = 400,
    highest: float = 3000.0,
    loss_factor: float = 0.02,
    mode: str | None = None,
    anyway: bool = False,
) -> Lobes:
    """Stability lobes of a machine at a pose, from its exact receptance.

    Args:
        machine, position, azimuth, tilt, roll, mode, anyway: as for `pose`.
        cut: cutter, immersion and cutting forces, see `Cut.of`.
        feed: way of the tool against the workpiece, an angle (rad) about the platform normal from the direction of growing
            tilt.
        slowest, fastest: range of spindle speeds, rad/s.
        points: equally spaced speeds.
        highest: highest chatter frequency that is sought, Hz.
        loss_factor: eta of all that has none of its own, twice the damping ratio.

    Raises:
        InputError: for ranges that do not rise from above zero, nothing that is damped, or a machine that does not say to which
            side its tool points.
        NoResultError: the pose is not reached, or the machine moves there without resistance.
    """
    _check(slowest, fastest, points, highest, loss_factor, feed)
    at = pose(machine, position, azimuth, tilt, roll, mode=mode, anyway=anyway)
    damping = least_damping(at.machine, loss_factor)
    if not damping > 0:
        raise InputError(f"loss factor: {loss_factor:g}, and no part has its own; what is not damped chatters at any depth")
    point = tool_point(at.machine, at.frame, feed, at.angles[0])
    natural = _modes(at, highest)
    around = (natural.mesh_frequency[:, None] * (1 + damping / 2 * AROUND)).ravel()
    frequency = np.unique(np.r_[np.linspace(LOWEST, highest, REGULAR), around[(around > LOWEST) & (around < highest)]])
    answer = spectral.prepared(at.machine, at.frame, at.signs, highest, loss_factor)(frequency)
    oriented = point.oriented(np.asarray(answer))
    found = branches(cut, frequency, oriented)
    speeds = np.linspace(slowest, fastest, points)
    least = limits(cut, found, speeds)
    return Lobes(
        at, cut, feed, point, speeds, least, *lowest(found), highest, loss_factor, natural, frequency, oriented
    )  # fmt: skip


def lobes_along(
    machine: MachineLike,
    path: PathFile | str | os.PathLike[str],
    *,
    progress: Callable[[str, int, int], None] = lambda name, done, total: None,
    **settings: Unpack[Settings],
) -> LobesAlong:
    """Stability lobes of a machine at every pose of a path; how fast it is run through does not matter here.

    Args:
        machine: machine, name or file.
        path: the poses, or their file.
        progress: called with what is being done, and how many of how many poses are.
        settings: as for `lobes`; the feed has the same angle at all poses.

    Raises:
        InputError: as `lobes`.
        NoResultError: naming the pose that is not reached, counted from 1.
    """
    chosen = choose(machine)
    poses = (path if isinstance(path, PathFile) else read_path(path)).poses
    found = []
    for k, at in enumerate(poses):
        try:
            found.append(lobes(chosen, at.position, at.azimuth, at.tilt, at.roll, **settings))
        except NoResultError as error:
            raise NoResultError(f"pose {k + 1} of {len(poses)}: {error}") from error
        progress("lobes", k + 1, len(poses))
    return LobesAlong(tuple(found))


def _modes(at: PoseReport, highest: float) -> Modes:
    """The modes of a mesh up to a highest frequency (Hz), and some above."""
    count = BATCH
    while True:
        found = modes(at.machine, at.frame, at.signs, count)
        if found.mesh_frequency[-1] > highest or len(found.mesh_frequency) < count:
            return found
        count *= 2


def _check(slowest: float, fastest: float, points: int, highest: float, loss_factor: float, feed: float) -> None:
    if not 0 < slowest < fastest <= FASTEST:
        raise InputError(
            f"spindle speeds: {slowest / RPM:g} rpm to {fastest / RPM:g} rpm; expected a range that rises from above 0 rpm, up "
            f"to {FASTEST / RPM:.3g} rpm"
        )
    if not 2 <= points <= MOST_SPEEDS:
        raise InputError(f"points: {points}; expected 2 to {MOST_SPEEDS} spindle speeds")
    if not LOWEST < highest <= HIGHEST:
        raise InputError(f"highest frequency: {highest:g} Hz; expected above {LOWEST:g} Hz, up to {HIGHEST:g} Hz")
    check_loss_factor(loss_factor)
    if not math.isfinite(feed):
        raise InputError(f"feed: {feed:g} rad; expected an angle")
