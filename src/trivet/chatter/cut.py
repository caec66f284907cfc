"""A cut by milling: the cutter, where its teeth are in the material, and the forces that a chip takes.

Conventions are those of Altintas and Budak (CIRP Annals 44:357, 1995).  In the cutting plane x is the feed, the way of the tool
against the workpiece, and y is normal to it; the immersion phi of a tooth is counted from y, and the cutter turns from y to x.
A tooth at phi cuts, with the tool displaced by (dx, dy) against the last pass, a chip thicker by dx sin(phi) + dy cos(phi);
per depth of cut it takes the tangential force K_t per thickness against its motion, and K_r K_t towards the cutter's axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from trivet.chatter.materials import material_named
from trivet.errors import InputError, nearest

Side = Literal["up", "down"]
SIDES: tuple[Side, ...] = ("up", "down")
MOST_TEETH = 200
"""Teeth of a cutter; the largest face mills have some dozens."""
WHOLE = 1e-9
"""Radial depth against the diameter, short of it, up to which a cut is a slot."""


@dataclass(frozen=True)
class Cut:
    """A cutter with straight flutes, evenly spaced, in a material; see `Cut.of` for one by its radial depth."""

    diameter: float
    """m."""
    teeth: int
    entry: float
    """Immersion (rad) at which a tooth enters the material, from 0."""
    exit: float
    """Immersion (rad) at which it leaves, up to pi."""
    tangential: float
    """Tangential specific force K_t, Pa: force per chip thickness and depth of cut."""
    radial_ratio: float
    """K_r: radial force against the tangential one."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.diameter) and self.diameter > 0):
            raise InputError(f"diameter: {self.diameter * 1e3:g} mm; a cutter has one above zero")
        if not (isinstance(self.teeth, int) and 1 <= self.teeth <= MOST_TEETH):
            raise InputError(f"teeth: {self.teeth}; a cutter has 1 to {MOST_TEETH} teeth")
        if not 0 <= self.entry < self.exit <= math.pi * (1 + 1e-12):
            at = f"{math.degrees(self.entry):g} deg to {math.degrees(self.exit):g} deg"
            raise InputError(f"immersion: {at}; expected angles that rise within 0 deg to 180 deg")
        if not (math.isfinite(self.tangential) and self.tangential > 0):
            raise InputError(f"tangential: {self.tangential / 1e6:g} N/mm^2; a chip takes a force above zero")
        if not 0 <= self.radial_ratio <= 10:
            raise InputError(f"radial ratio: {self.radial_ratio:g}; expected radial over tangential force, 0 to 10")

    @classmethod
    def of(
        cls,
        diameter: float,
        teeth: int,
        radial_depth: float,
        side: Side = "up",
        *,
        material: str | None = None,
        tangential: float | None = None,
        radial_ratio: float | None = None,
    ) -> Cut:
        """A cut by its radial depth.

        Args:
            diameter: of the cutter, m.
            teeth: how many.
            radial_depth: width of the cut, m; a slot where it is the diameter.
            side: "up" (teeth enter where the chip is thin) or "down" (they leave there); of no account in a slot.
            material: name of a workpiece material that trivet knows; or instead
            tangential, radial_ratio: K_t (Pa) and K_r.

        Raises:
            InputError: for what is out of range, an unknown material, or forces that are given twice or not at all.
        """
        if side not in SIDES:
            raise InputError(f"side '{side}': expected up or down{nearest(side, SIDES)}")
        if not (math.isfinite(diameter) and diameter > 0):
            raise InputError(f"diameter: {diameter * 1e3:g} mm; a cutter has one above zero")
        if not 0 < radial_depth <= diameter * (1 + WHOLE):
            raise InputError(
                f"radial depth: {radial_depth * 1e3:g} mm; expected above zero, up to the diameter of {diameter * 1e3:g} mm, "
                "which makes a slot"
            )
        if (material is None) == (tangential is None) or (tangential is None) != (radial_ratio is None):
            raise InputError("cutting forces: give either a material, or both tangential force and radial ratio")
        if material is not None:
            known = material_named(material)
            tangential, radial_ratio = known.tangential, known.radial / known.tangential
        assert tangential is not None
        assert radial_ratio is not None
        swept = math.acos(max(-1.0, 1 - 2 * radial_depth / diameter))
        entry, leave = (0.0, swept) if side == "up" else (math.pi - swept, math.pi)
        return cls(float(diameter), teeth, entry, leave, float(tangential), float(radial_ratio))

    @property
    def pitch(self) -> float:
        """Angle between teeth, rad."""
        return 2 * math.pi / self.teeth

    @property
    def is_slot(self) -> bool:
        """Whether teeth are in the material over half a turn."""
        return self.exit - self.entry >= math.pi * (1 - 1e-6)

    @property
    def engaged(self) -> float:
        """How many teeth are in the material, in the mean; below a half force comes in blows, with pauses between."""
        return (self.exit - self.entry) / self.pitch

    def averaged(self, low: float, high: float) -> np.ndarray:
        """(2, 2): D of all teeth, F = a K_t D (dx, dy), averaged while one of them turns from immersion low to high (rad).

        The others are pitches ahead of that one; 0 <= low < high <= pitch.
        """
        total = np.zeros((2, 2))
        for tooth in range(self.teeth):
            start, end = max(low + tooth * self.pitch, self.entry), min(high + tooth * self.pitch, self.exit)
            if end > start:
                total += self._integral(end) - self._integral(start)
        mean: np.ndarray = total / (high - low)
        return mean

    def _integral(self, phi: float) -> np.ndarray:
        """Antiderivative over the immersion of what one tooth adds."""
        double, ratio = 2 * phi, self.radial_ratio
        sine, cosine = math.sin(double), math.cos(double)
        return 0.25 * np.array([
            [cosine - ratio * double + ratio * sine, -sine - double + ratio * cosine],
            [double - sine + ratio * cosine, -cosine - ratio * double - ratio * sine],
        ])  # fmt: skip

    @property
    def directional(self) -> np.ndarray:
        """(2, 2): D averaged over a pitch, the only harmonic that the zero-order approach keeps."""
        return self.averaged(0.0, self.pitch)
