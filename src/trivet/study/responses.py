"""What is asked of a machine's responses at many poses: the entries, the point, the damping and the range of frequencies."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.mode import closed_form_signs
from trivet.model import Machine
from trivet.reach.margins import travel_margin
from trivet.space.family import Places
from trivet.space.search import lowest_angles
from trivet.statics.best_roll import ROLLS
from trivet.study.frf import HIGHEST, directions
from trivet.study.roll_policy import RollPolicy, roll_policy
from trivet.vibration.damping import least_damping
from trivet.vibration.directional import CHUNK, Asked, Entries, greatest

Array = NDArray[Any]

AT_LIMIT = 1e-9
"""Share of its travel by which a joint may seem beyond a limit at which a best roll left it."""
DYNAMIC = "best D_"
"""How the policies begin that choose the roll by the least dynamic stiffness."""
DYNAMIC_ROLLS = 36
"""Rolls of the first grid of those, unless said otherwise: a look costs a frequency response."""
POINTS_AT_ONCE = 64
"""Points whose rolls are sought together, between which progress is told."""


@dataclass(frozen=True)
class Responses:
    """All that responses depend on besides the poses."""

    machine: Machine
    signs: Any
    """(n_chains, 2) working mode."""
    entries: Entries
    loss_factor: float
    """Of all that has none of its own."""
    least_damping: float
    tip: tuple[float, float, float] | None
    """Of the tool in {E}, m; None for the platform centre."""
    low: float
    high: float
    """Hz."""

    @classmethod
    def of(
        cls, machine: Machine, mode: str | None, entries: Sequence[str], point: str, loss_factor: float, low: float, high: float
    ) -> Responses:
        """From what people write.

        Raises:
            InputError: for a wrong entry, point, range or mode, or no damping.
        """
        if not (math.isfinite(low) and math.isfinite(high) and 0 < low < high <= HIGHEST):
            expected = f"expected a range that rises from above 0 Hz, up to {HIGHEST:g} Hz"
            raise InputError(f"frequencies: {low:g} Hz to {high:g} Hz; {expected}")
        if point not in ("platform", "tool"):
            raise InputError(f"point '{point}': expected platform (its centre) or tool (its tip)")
        if not entries:
            raise InputError("entries: none; name at least one, as in xx or x_ry")
        tip = machine.platform.tool_tip if point == "tool" else None
        if point == "tool" and tip is None:
            raise InputError(f"point tool: {machine.name} has no platform.tool_tip; give one, or write platform")
        if not 0 <= loss_factor < 2:
            raise InputError(f"loss factor: {loss_factor:g}; expected 0 or more, and below 2")
        signs = closed_form_signs(machine, mode)
        damping = least_damping(machine, loss_factor)
        return cls(machine, signs, _named(entries), loss_factor, damping, tip, low, high)

    def along(self, entries: Sequence[str]) -> Responses:
        """The same along other entries."""
        return replace(self, entries=_named(entries))

    def asked(self, places: Places) -> Asked:
        """At places, rolls included."""
        return Asked.of(self.machine, places.frames(), self.signs, self.entries, self.loss_factor, self.tip)

    def stiffness(self, places: Places) -> tuple[Array, Array]:
        """Least dynamic stiffness (m, k) and where it is, Hz; NaN at poses that are not reached."""
        size, frequency = (np.full((len(places.tilt), len(self.entries.pairs)), np.nan) for _ in range(2))
        there = np.flatnonzero(self.reached(places))
        if len(there):
            # Filled up, since kernels are compiled for every number of poses.
            index = np.resize(there, -(-len(there) // CHUNK) * CHUNK)
            found = greatest(self.asked(places.some(index)), self.low, self.high, self.least_damping)
            size[there], frequency[there] = (a[: len(there)] for a in found)
        return 1 / size, frequency

    def reached(self, places: Places) -> Array:
        """(m,) whether all joints are inside their travel."""
        assert places.roll is not None
        known: Array = np.all(np.isfinite(places.position), axis=1) & np.isfinite(places.roll)
        with np.errstate(invalid="ignore"):
            known &= travel_margin(self.machine, places.frames(), self.signs) >= -AT_LIMIT
        return known

    def roll_policy(
        self, roll: str | float, rolls: int | None = None, progress: Callable[[int], None] = lambda points: None
    ) -> RollPolicy:
        """A policy for the roll: `study.roll_policy`'s, or "best D_xx" (or any other entry) for the roll of greatest least
        dynamic stiffness 1/|H_xx| over the range of frequencies."""
        if not isinstance(roll, str) or not roll.startswith(DYNAMIC):
            return roll_policy(roll, rolls or ROLLS, progress)
        own, steps = self.along([roll.removeprefix(DYNAMIC)]), rolls or DYNAMIC_ROLLS
        if steps < 3:
            raise InputError(f"rolls: {steps}; at least 3 are needed to find the hills")

        def choose(machine: Machine, surface: Any, signs: Any) -> Array:
            found = np.empty(len(surface))
            for start in range(0, len(surface), POINTS_AT_ONCE):
                part = np.arange(start, min(start + POINTS_AT_ONCE, len(surface)))

                def size(which: Array, angle: Array, part: Array = part) -> Array:
                    at = part[which]
                    there = Places(surface.position[at], surface.azimuth[at], surface.tilt[at], angle)
                    compliance: Array = 1 / own.stiffness(there)[0][:, 0]
                    return compliance

                found[part] = lowest_angles(size, len(part), steps).angle
                progress(int(part[-1]) + 1)
            return found

        return RollPolicy(roll, choose)


def _named(entries: Sequence[str]) -> Entries:
    return Entries.named([directions(name) for name in entries])
