"""Modes along a path: every mode followed from pose to pose, where frequencies cross, and where modes exchange their shapes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.inverse import require_six_freedoms
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.report import joint_state_once, shortfall
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.study.corners import STILL, corners_of, places_along, pose_along
from trivet.study.machines import MachineLike, choose
from trivet.study.pathfile import PathFile, read_path
from trivet.vibration.encounters import Encounter
from trivet.vibration.kinetic import Layout
from trivet.vibration.modes import Modes
from trivet.vibration.modes import modes as modes_at
from trivet.vibration.tracking import Branches, Sample, track

Array = NDArray[Any]
Progress = Callable[[int, int], None]

STEPS = 24
MOST_STEPS = 2000
AGREED = 2.0**-20
"""How closely it is told, as a share of a step, where a path leaves what a machine reaches."""
COORDINATES = (("x", "mm"), ("y", "mm"), ("z", "mm"), ("azimuth", "°"), ("tilt", "°"), ("roll", "°"))


class Scale(NamedTuple):
    """What places along a path are told by."""

    name: str
    """The only coordinate that changes, or "pose"."""
    unit: str
    """As people read it; empty for the number of a pose."""
    values: Array
    """At the poses of the path file, in that unit."""

    def at(self, place: Any) -> Any:
        """In that unit, at places along the path."""
        return np.interp(place, np.arange(1, len(self.values) + 1), self.values)


@dataclass(frozen=True, repr=False)
class ModePaths:
    """Modes along a path, as k branches; all in SI and {O}."""

    machine: Machine
    mode: str
    corners: Array
    """(c, 6) poses of the path: centre (m), azimuth, tilt and roll (rad), which change evenly in between."""
    count: int
    """How many modes are the lowest ones, which all are among the branches at every pose."""
    branches: Branches
    """On the mesh, over places: 1 is the first pose of the path, 2 the second, and so on."""
    frequency: Array
    """(n, k) at the poses that were asked for, without the error of the mesh, Hz; NaN for a branch above what is looked at."""
    platform: Array
    """(n, 6, k) twist of the platform centre there, of unit modal mass."""
    largest: Array
    """(n, k) the largest displacement of any node there, of unit modal mass."""
    length: float
    """By which rotations are compared with displacements, m."""

    @property
    def place(self) -> Array:
        """(n,) along the path."""
        return self.branches.place

    @property
    def poses(self) -> Array:
        """(n, 6): centre (m), azimuth, tilt and roll (rad)."""
        return pose_along(self.corners, self.place)

    @cached_property
    def scale(self) -> Scale:
        """What places are told by."""
        changes = np.diff(self.corners, axis=0)
        (moving,) = np.nonzero(np.abs(changes).max(axis=0) > STILL)
        if len(moving) == 1 and (np.all(changes[:, moving] > 0) or np.all(changes[:, moving] < 0)):
            name, unit = COORDINATES[moving[0]]
            return Scale(name, unit, self.corners[:, moving[0]] * (1e3 if unit == "mm" else math.degrees(1)))
        return Scale("pose", "", np.arange(1.0, len(self.corners) + 1))

    @cached_property
    def fine_frequency(self) -> Array:
        """(f, k) at all places that were looked at, Hz: of the mesh, less its error as it is at the poses on either side."""
        fine = self.branches.fine_frequency.copy()
        error = self.frequency / self.branches.frequency
        for k in range(fine.shape[1]):
            known = np.isfinite(error[:, k])
            fine[:, k] *= np.interp(self.branches.fine_place, self.place[known], error[known, k])
        return fine

    @cached_property
    def encounters(self) -> list[Encounter]:
        """Where branches cross, touch or veer: places and gaps of the mesh, frequencies less its error."""
        middle = self.fine_frequency
        return [
            one._replace(
                frequency=float(np.interp(one.place, self.branches.fine_place, middle[:, [one.first, one.second]].mean(axis=1)))
            )
            for one in self.branches.encounters
        ]

    def __repr__(self) -> str:
        return f"<ModePaths: {self.machine.name}, {self.frequency.shape[1]} branches over {len(self.place)} poses>"


def modes_along(
    machine: MachineLike,
    path: PathFile | str | os.PathLike[str],
    *,
    count: int = 12,
    steps: int = STEPS,
    elements: int | Mapping[str, int] | None = None,
    mode: str | None = None,
    anyway: bool = False,
    progress: Progress = lambda done, total: None,
) -> ModePaths:
    """The lowest modes of a machine along a path, each followed as one branch.

    Between the poses of the path centre, azimuth, tilt and roll change evenly, angles by the shorter way round; where the
    platform is level the azimuth is that of the pose before it, or after it, and azimuth + roll is what it was.

    Args:
        machine: machine, name or file.
        path: the poses, or their file; how fast it is run through does not matter here.
        count: how many modes at every pose.
        steps: between poses that are told of, over the whole path; shorter ones are made where following modes asks for them.
        elements: finite elements of every beam, or by name.
        mode: working mode; the machine's own when not given.
        anyway: go on where a joint is outside its travel.
        progress: called with the number of poses that are done, and of all.

    Raises:
        InputError: for a path of one pose or without extent, a count, steps or elements out of range.
        NoResultError: naming the place, the chain, the joint and the value, where the path leaves what the machine reaches, or
            the joint where it moves without resistance.
    """
    chosen = choose(machine)
    if not 1 <= steps <= MOST_STEPS:
        raise InputError(f"steps: {steps}; expected 1 to {MOST_STEPS}")
    if count < 1:
        raise InputError(f"count: {count}; expected at least 1 mode")
    require_six_freedoms(chosen)
    way = _Walk(chosen, parse_mode(chosen, mode), corners_of(path if isinstance(path, PathFile) else read_path(path)), anyway)
    places = places_along(way.corners, float(chosen.characteristic_length), steps)
    way.require_reached(places)
    # The exact frequencies take about as long as following the modes.
    total = 2 * len(places)
    layout, kept = Layout(), dict[float, Modes]()

    def solve(place: float, wanted: int) -> Sample:
        found = way.modes(place, wanted, elements)
        if place in asked:
            kept[place] = found
        return Sample(found.mesh_frequency, layout.vectors(found, np.array(way.frame(place).matrix(), dtype=float)))

    asked = set(places)
    followed = track(solve, places, count, lambda done: progress(done + 1, total))
    frequency, platform, largest = [], [], []
    for done, (place, number, turn) in enumerate(zip(places, followed.number, followed.turn, strict=True), start=1):
        found = kept.pop(place)
        there = number >= 0
        highest = number.max() + 1
        exact = Modes(found.structure, found.mesh, found.mesh_frequency[:highest], found.shapes[:, :highest]).frequency
        frequency.append(np.where(there, exact[number], np.nan))
        platform.append(np.where(there, found.platform @ turn, np.nan))
        moved = np.linalg.norm(found.displacements[:, :3] @ turn, axis=1).max(axis=0)
        largest.append(np.where(there, moved, np.nan))
        progress(len(places) + done, total)
    return ModePaths(
        chosen,
        mode_text(chosen, way.signs),
        way.corners,
        count,
        followed,
        np.array(frequency),
        np.array(platform),
        np.array(largest),
        found.structure.scale,
    )


@dataclass(frozen=True)
class _Walk:
    """A machine on a path."""

    machine: Machine
    signs: Any
    corners: Array
    anyway: bool

    def frame(self, place: float) -> Frame:
        """The platform frame."""
        pose = pose_along(self.corners, place)
        return zyz_frame(pose[:3], *pose[3:])

    def miss(self, place: float) -> str | None:
        """Why the pose there is not reached; None where it is."""
        try:
            found = shortfall(self.machine, joint_state_once(self.machine, self.frame(place), self.signs))
        except NoResultError as error:
            return str(error).removeprefix(f"{self.machine.name}: ")
        return None if found is None or (self.anyway and found.joint is not None) else found.reason

    def require_reached(self, places: list[float]) -> None:
        """Raise NoResultError for the first place that is not reached."""
        for before, place in zip([places[0], *places], places, strict=False):
            reason = self.miss(place)
            if reason is None:
                continue
            low, high = before, place
            while high - low > AGREED * (place - before):
                middle = (low + high) / 2
                low, high = (middle, high) if self.miss(middle) is None else (low, middle)
            # At the very limit a value and its limit read alike: the reason is that of the pose one step on.
            after = f"{'' if high == place else '; one step on'}: {reason}"
            raise NoResultError(f"{self.machine.name}: the path leaves what the machine reaches {self.words(high)}{after}")

    def modes(self, place: float, count: int, elements: int | Mapping[str, int] | None) -> Modes:
        """The lowest modes there."""
        try:
            return modes_at(self.machine, self.frame(place), self.signs, count, elements)
        except NoResultError as error:
            raise NoResultError(f"{self.machine.name}: {self.words(place)}: {error}") from error

    def words(self, place: float) -> str:
        """A place in words."""
        x, y, z, alpha, beta, gamma = pose_along(self.corners, place)
        number = math.floor(place)
        part = f" and {place - number:.2f} of the way to the next" if place > number else ""
        angles = ", ".join(f"{name} {math.degrees(v):.4g}°" for name, v in (("alpha", alpha), ("beta", beta), ("gamma", gamma)))
        return f"at pose {number}{part}, centre ({x * 1e3:.5g}, {y * 1e3:.5g}, {z * 1e3:.5g}) mm, {angles}"
