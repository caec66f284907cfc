"""Quantities that are studies of their own, worked out machine by machine."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from trivet.design.looked import Points
from trivet.errors import NoResultError
from trivet.model import Machine
from trivet.model.quantity import Quantity as Kind
from trivet.statics.objective import AXES

if TYPE_CHECKING:
    from trivet.study.frf import Minimum
    from trivet.study.modes import ModesReport
    from trivet.study.tilt import TiltReport
    from trivet.study.workspace import WorkspaceReport

TILT, CONNECTED, WORKSPACE, FREQUENCY = "tilt", "connected tilt", "workspace volume", "home frequency"
DYNAMIC = {f"home D_{axis}{axis if len(axis) == 1 else ''}": axis for axis in AXES}
NAMES = (TILT, CONNECTED, WORKSPACE, FREQUENCY, *DYNAMIC)

COLUMNS = 32
"""Of a workspace, along each axis."""


Study = Callable[[Machine, Points, str | None], Any]
"""Of a machine, the check points and the working mode; NoResultError where there is none."""


@dataclass(frozen=True)
class Studied:
    """A number that a study works out of one machine."""

    name: str
    kind: Kind
    """Its units."""
    study: Study
    """Which may tell several numbers."""
    pick: Callable[[Any], float]
    """This number of what the study gives."""
    cost: int
    """About as many poses of the map take as long as the study."""

    @property
    def is_over_points(self) -> bool:
        """Whether it asks for the check points."""
        return self.study is _tilt

    def check(self, machine: Machine) -> None:
        """All machines with a closed form have it."""

    def lacks(self, machine: Machine) -> None:
        """No kind of machine has none."""


def worked(asked: Sequence[Studied], machine: Machine, points: Points, mode: str | None) -> list[float]:
    """Numbers of one machine, NaN where there is none; what several of them are of is worked out once."""
    found: dict[Study, Any] = {}
    for own in asked:
        if own.study not in found:
            try:
                found[own.study] = own.study(machine, points, mode)
            except NoResultError:
                found[own.study] = None
    return [math.nan if found[own.study] is None else float(own.pick(found[own.study])) for own in asked]


def read(name: str) -> Studied | None:
    """The number of a name."""
    if name in (TILT, CONNECTED):
        pick = attrgetter("tilt" if name == TILT else "connected_tilt")
        return Studied(name, Kind("angle", "rad", "deg"), _tilt, pick, 30_000_000)
    if name == WORKSPACE:
        return Studied(name, Kind("volume", "m^3", "mm^3"), _workspace, attrgetter("volume"), 30_000_000)
    if name == FREQUENCY:
        return Studied(name, Kind("frequency", "Hz", "Hz"), _modes, lambda modes: modes.frequency[0], 3_000_000)
    if name in DYNAMIC:
        kind = (
            Kind("stiffness", "N/m", "N/um") if len(DYNAMIC[name]) == 1 else Kind("rotational stiffness", "N m/rad", "N m/rad")
        )
        axis = AXES.index(DYNAMIC[name])
        return Studied(name, kind, _minima, lambda minima: minima[axis].stiffness, 3_000_000)
    return None


def _tilt(machine: Machine, points: Points, mode: str | None) -> TiltReport:
    from trivet.study.tilt import tilt

    return tilt(machine, points.radius, points.height, mode=mode)


def _workspace(machine: Machine, points: Points, mode: str | None) -> WorkspaceReport:
    from trivet.study.workspace import workspace

    return workspace(machine, mode=mode, count=COLUMNS)


def _modes(machine: Machine, points: Points, mode: str | None) -> ModesReport:
    from trivet.study.modes import modes

    return modes(machine, mode=mode, count=1)


def _minima(machine: Machine, points: Points, mode: str | None) -> list[Minimum]:
    from trivet.study.frf import minimum_dynamic_stiffness
    from trivet.study.pose import pose

    return minimum_dynamic_stiffness(pose(machine, mode=mode))
