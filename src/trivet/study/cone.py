"""A roll for every direction within a cone, continuous all over it, that keeps off singularities, limits and collisions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.mode import mode_text, mode_words
from trivet.model import Machine
from trivet.reach.certificate import Patches, Proof
from trivet.reach.neutral import Reference
from trivet.reach.sheets import Sheet, highest_sheet
from trivet.reach.touch import Touch
from trivet.study.closest import Closest, closest
from trivet.study.machines import MachineLike
from trivet.study.requirements import Requirements, Settings, on_sphere, verdict
from trivet.study.roll_grid import LARGEST_GRID, Along, RollGrid, Rules, field_of, met

Array = NDArray[Any]

AZIMUTHS, STEP, ROLLS = 36, math.radians(2.0), 120
STRIDE = 3
"""By how many rolls of the grid neighbouring directions differ, at most."""


@dataclass(frozen=True, repr=False)
class ConePlan:
    """Rolls over a cone of directions in one working mode."""

    rules: Rules
    neutral: Reference
    knots: Touch
    """(azimuths + 1, tilts) poses at the nodes of the surface, bilinear between; zero rolls where there is no sheet."""
    sheet: Sheet | None
    """None where no continuous roll is allowed all over the cone."""
    samples: Along | None
    """What is met at nodes and between them."""
    proof: Proof | None
    largest: float
    """Tilt (rad) of the widest cone of this grid that has a sheet; NaN for none."""

    @property
    def machine(self) -> Machine:
        """The machine, its neutral axes as they were taken."""
        return self.rules.machine

    @property
    def mode(self) -> str:
        """The working mode."""
        return mode_text(self.machine, self.rules.signs)

    @property
    def is_possible(self) -> bool:
        """Whether there is a continuous roll all over the cone."""
        return self.sheet is not None

    @property
    def is_safe(self) -> bool:
        """Whether it is proven that all poses of the sheet are free."""
        return self.proof is not None and self.proof.is_proven

    @property
    def is_refuted(self) -> bool:
        """Whether it is known that a pose of the sheet is not free."""
        return self.proof is not None and self.proof.is_refuted

    @property
    def verdict(self) -> str:
        """What became of it, in a word or two."""
        return verdict(self.proof) if self.is_possible else "no continuous roll"

    @cached_property
    def closest(self) -> Closest | None:
        """What the samples come closest to."""
        return None if self.samples is None else closest(self.rules, self.samples)

    @property
    def value(self) -> float:
        """The least value at samples; NaN for none."""
        return math.nan if self.samples is None else float(self.samples.value.min())

    @property
    def worst(self) -> int:
        """Which of the samples has the least value."""
        return -1 if self.samples is None else int(self.samples.value.argmin())

    def __repr__(self) -> str:
        tilt, value = math.degrees(self.knots.tilt.max()), f", least value {self.value:.4g}" if self.is_possible else ""
        return f"<ConePlan: {self.machine.name}, {mode_words(self.mode)}, up to {tilt:.4g} deg: {self.verdict}{value}>"


def cone(
    machine: MachineLike,
    tilt: float,
    radius: float | None = None,
    height: float | None = None,
    *,
    solid: bool = False,
    azimuths: int = AZIMUTHS,
    step: float | None = None,
    rolls: int = ROLLS,
    progress: Callable[[str, int, int], None] = lambda name, done, total: None,
    **settings: Unpack[Settings],
) -> ConePlan:
    """A roll for every direction within a cone about z, continuous all over it, on a sphere.

    Args:
        machine, radius, height, solid, settings: as for `trivet.plan`.
        tilt: of the cone, rad.
        azimuths: of the grid, evenly all round.
        step: of its tilts, rad; `STEP`, or the tilt where that is less, when not given.
        rolls: of the grid, evenly all round.
        progress: called with what is being done, and how many of how many are.

    Raises:
        InputError: as for `trivet.plan`.
    """
    step = min(STEP, tilt) if step is None else step
    _check(tilt, azimuths, step, rolls)
    wanted = Requirements(**settings)
    rules, height = on_sphere(wanted.rules(machine), radius, height, solid)
    tilts = np.linspace(0.0, tilt, max(2, round(tilt / step) + 1))
    around = 2 * math.pi / azimuths * np.arange(azimuths)
    values, sides = [], []
    for k, azimuth in enumerate(around):
        field = field_of(rules, RollGrid(_ray(height, azimuth, tilts), 2 * math.pi / rolls, rolls))
        values.append(field.value)
        sides.append(field.side)
        progress("azimuths", k + 1, azimuths)
    value, side = np.stack(values), np.stack(sides)
    value[:, 0], side[:, 0] = value[0, 0], side[0, 0]
    sheet, largest = _sheet(value, side, len(tilts), progress), tilt
    if sheet is None:
        rows = next((n for n in range(len(tilts) - 1, 1, -1) if _sheet(value[:, :n], side[:, :n], n) is not None), 0)
        largest = float(tilts[rows - 1]) if rows else math.nan
    columns = np.zeros(value.shape[:2]) if sheet is None else sheet.columns
    closed = np.concatenate([columns, columns[:1]])
    alpha, beta = np.meshgrid(np.append(around, 2 * math.pi), tilts, indexing="ij")
    still = np.zeros(alpha.shape)
    knots = Touch(still, still, still + height, alpha, beta, closed * (2 * math.pi / rolls) - alpha)
    if sheet is None:
        return ConePlan(rules, wanted.neutral, knots, None, None, None, largest)
    patches = Patches.over(np.stack(knots))
    touched = _samples(patches)
    samples = met(rules, touched, np.zeros(len(touched.roll)))
    proof = wanted.prove(rules, patches, samples, lambda looked, left: progress("pieces of the proof", looked, looked + left))
    return ConePlan(rules, wanted.neutral, knots, sheet, samples, proof, largest)


def _check(tilt: float, azimuths: int, step: float, rolls: int) -> None:
    if max(azimuths, rolls) > LARGEST_GRID:
        raise InputError(f"too many azimuths or rolls; no more than {LARGEST_GRID:.0e} poses")
    if not (0 < tilt <= math.pi / 2 and 0 < step <= tilt and azimuths >= 3 and rolls >= 8):
        raise InputError(
            f"a cone of {math.degrees(tilt):g} deg in steps of {math.degrees(step):g} deg, {azimuths} azimuths and {rolls} "
            "rolls; expected a tilt above zero, up to 90 deg, no step above it, at least 3 azimuths and 8 rolls"
        )
    if azimuths * rolls * (tilt / step + 1) > LARGEST_GRID:
        raise InputError(f"no more than {LARGEST_GRID:.0e} poses; take wider steps")


def _sheet(value: Array, side: Array, rows: int, progress: Callable[[str, int, int], None] | None = None) -> Sheet | None:
    found = []
    for sign in (-1.0, 1.0):
        told = (lambda done, total: progress("thresholds", done, total)) if progress is not None else (lambda done, total: None)
        sheet = highest_sheet(np.where(side == sign, value, -np.inf), STRIDE, told)
        found += [sheet] if sheet is not None else []
    return max(found, key=lambda sheet: sheet.value, default=None)


def _ray(height: float, azimuth: float, tilts: Array) -> Touch:
    x, y, z, alpha, gamma = (np.full(len(tilts), value) for value in (0.0, 0.0, height, azimuth, -azimuth))
    return Touch(x, y, z, alpha, tilts, gamma)


def _samples(patches: Patches) -> Touch:
    """Corners, middles of sides and middles of patches."""
    parts = [(u, v) for u in (-1.0, 0.0, 1.0) for v in (-1.0, 0.0, 1.0)]
    found = [patches.middle + u * patches.first + v * patches.second + u * v * patches.twist for u, v in parts]
    return Touch(*np.concatenate(found, axis=1))
