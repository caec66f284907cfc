"""Quantities that are studies of their own, worked out machine by machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from trivet.design.looked import Points
from trivet.errors import NoResultError
from trivet.model import Machine
from trivet.model.quantity import Quantity as Kind
from trivet.statics.objective import AXES

TILT, CONNECTED, WORKSPACE, FREQUENCY = "tilt", "connected tilt", "workspace volume", "home frequency"
DYNAMIC = {f"home D_{axis}{axis if len(axis) == 1 else ''}": axis for axis in AXES}
NAMES = (TILT, CONNECTED, WORKSPACE, FREQUENCY, *DYNAMIC)

COLUMNS = 32
"""Of a workspace, along each axis."""


@dataclass(frozen=True)
class Studied:
    """A number that a study works out of one machine."""

    name: str
    kind: Kind
    """Its units."""
    work: Callable[[Machine, Points, str | None], float]
    """Of a machine, the check points and the working mode; NoResultError where there is none."""
    cost: int
    """About as many poses of the map take as long."""

    def check(self, machine: Machine) -> None:
        """All machines with a closed form have it."""

    def of(self, machine: Machine, points: Points, mode: str | None) -> float:
        """The number, NaN where there is none."""
        try:
            return float(self.work(machine, points, mode))
        except NoResultError:
            return math.nan


def read(name: str) -> Studied | None:
    """The study of a name."""
    if name in (TILT, CONNECTED):
        return Studied(name, Kind("angle", "rad", "deg"), partial(_tilt, name == CONNECTED), 30_000_000)
    if name == WORKSPACE:
        return Studied(name, Kind("volume", "m^3", "mm^3"), _workspace, 30_000_000)
    if name == FREQUENCY:
        return Studied(name, Kind("frequency", "Hz", "Hz"), _frequency, 3_000_000)
    if name in DYNAMIC:
        kind = (
            Kind("stiffness", "N/m", "N/um") if len(DYNAMIC[name]) == 1 else Kind("rotational stiffness", "N m/rad", "N m/rad")
        )
        return Studied(name, kind, partial(_dynamic, DYNAMIC[name]), 3_000_000)
    return None


def _tilt(connected: bool, machine: Machine, points: Points, mode: str | None) -> float:
    from trivet.study.tilt import tilt

    found = tilt(machine, points.radius, points.height, mode=mode)
    return found.connected_tilt if connected else found.tilt


def _workspace(machine: Machine, points: Points, mode: str | None) -> float:
    from trivet.study.workspace import workspace

    return workspace(machine, mode=mode, count=COLUMNS).volume


def _frequency(machine: Machine, points: Points, mode: str | None) -> float:
    from trivet.study.modes import modes

    return float(modes(machine, mode=mode, count=1).frequency[0])


def _dynamic(axis: str, machine: Machine, points: Points, mode: str | None) -> float:
    from trivet.study.frf import minimum_dynamic_stiffness
    from trivet.study.pose import pose

    return minimum_dynamic_stiffness(pose(machine, mode=mode))[AXES.index(axis)].stiffness
