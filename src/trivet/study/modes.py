"""Modes of a machine at a pose: at which frequencies it rings, how it moves then, and which part to stiffen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from trivet.study.machines import MachineLike
from trivet.study.pose import PoseReport, pose
from trivet.vibration.modes import Modes
from trivet.vibration.modes import modes as modes_at


class PartShare(NamedTuple):
    """Share of one part in the strain energy of a mode."""

    part: str
    """Chain and element, "leg-1.link"."""
    share: float


@dataclass(frozen=True)
class ModesReport:
    """The lowest modes at a pose; all in SI and {O}."""

    at: PoseReport
    modes: Modes

    @property
    def frequency(self) -> np.ndarray:
        """(m,) natural frequencies, Hz."""
        return self.modes.frequency

    @property
    def platform(self) -> np.ndarray:
        """(6, m) twist of the platform centre in every mode, of unit modal mass."""
        return self.modes.platform

    @cached_property
    def shares(self) -> list[list[PartShare]]:
        """Per mode the parts that yield, the greatest share first."""
        found = self.modes.strain_shares
        return [
            sorted((PartShare(name, float(share[k])) for name, share in found.items()), key=lambda s: -s.share)
            for k in range(len(self.modes.mesh_frequency))
        ]

    @property
    def effective_mass(self) -> np.ndarray:
        """(6, m): mass (kg) and moment of inertia (kg m^2) that a mode takes with it when the ground moves, see `Modes`."""
        return self.modes.effective_mass


def modes(
    machine: MachineLike,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    *,
    mode: str | None = None,
    anyway: bool = False,
    count: int = 12,
    elements: int | Mapping[str, int] | None = None,
) -> ModesReport:
    """The lowest modes of a machine at a pose.

    Args:
        machine, position, azimuth, tilt, roll, mode, anyway: as for `pose`.
        count: how many modes.
        elements: finite elements of every beam, or by name; the frequencies do not depend on them, the shapes hardly.

    Raises:
        NoResultError: the pose is not reached, or the machine moves there without resistance (naming the joint).
        InputError: for a count or elements out of range.
    """
    at = pose(machine, position, azimuth, tilt, roll, mode=mode, anyway=anyway)
    return ModesReport(at, modes_at(at.machine, at.frame, at.signs, count, elements))
