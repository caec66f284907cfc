"""What a page shows, as plain values: machines, their working modes, one pose, and what is to be seen of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from trivet.errors import InputError
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame

MOST_MACHINES = 2
"""Side by side."""


class PoseNumbers(NamedTuple):
    """A pose as people give it: the platform centre in {O}, m, and the angles of R = Rz(alpha) Ry(beta) Rz(gamma), rad."""

    x: float
    y: float
    z: float
    azimuth: float
    tilt: float
    roll: float

    @property
    def frame(self) -> Frame:
        """The platform frame {E} in {O}, of floats."""
        found = zyz_frame((self.x, self.y, self.z), self.azimuth, self.tilt, self.roll)
        return Frame(*(type(v)(*(float(c) for c in v)) for v in found))

    def moved(self, start: PoseNumbers, end: PoseNumbers) -> PoseNumbers:
        """This pose changed by as much as another one was from `start` to `end`."""
        return PoseNumbers(*(own + (b - a) for own, a, b in zip(self, start, end, strict=True)))


def home_of(machine: Machine) -> PoseNumbers:
    """The home pose."""
    home = machine.home
    return PoseNumbers(*(float(v) for v in (*home.position, home.azimuth, home.tilt, home.roll)))


@dataclass(frozen=True)
class Shown:
    """What is to be seen."""

    ellipsoid: bool = False
    """How far the platform centre goes under unit forces of all directions."""
    twist: bool = False
    """The motion of the platform that the drives control least."""
    handle: bool = True
    """By which the platform is dragged."""
    names: bool = True
    """Of chains and frames."""
    direction: str = "z"
    """Of the load whose deflection is divided up."""
    entry: str = "zz"
    """Of the frequency response: motion, then load."""
    ringing: int | None = None
    """The natural mode in which the machines are seen to move, from 0."""


@dataclass(frozen=True)
class State:
    """What a page shows."""

    machines: tuple[Machine, ...]
    """As they are now, one or two."""
    modes: tuple[str, ...]
    """Their working modes as written."""
    pose: PoseNumbers
    """Of the first machine; the others are as far from their own homes."""
    shown: Shown = field(default_factory=Shown)

    def pose_of(self, number: int) -> PoseNumbers:
        """The pose of one of the machines."""
        if number == 0:
            return self.pose
        return home_of(self.machines[number]).moved(home_of(self.machines[0]), self.pose)


def state_of(machines: list[Machine], modes: list[str | None], pose: PoseNumbers | None = None) -> State:
    """Where a page begins: the machines in their own modes, unless others are given, at home, unless a pose is given.

    Raises:
        InputError: for no machine or too many, or a mode that a machine does not have.
    """
    if not 1 <= len(machines) <= MOST_MACHINES:
        raise InputError(f"{len(machines)} machines; a page shows one, or {MOST_MACHINES} side by side")
    written = tuple(mode_text(m, parse_mode(m, mode)) for m, mode in zip(machines, modes, strict=True))
    begin = home_of(machines[0]) if pose is None else pose
    if not all(math.isfinite(v) for v in begin):
        raise InputError("the pose needs three finite coordinates and three finite angles")
    return State(tuple(machines), written, begin)
