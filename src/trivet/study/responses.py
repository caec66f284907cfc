"""What is asked of a machine's responses at many poses: the entries, the point, the damping and the range of frequencies."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.mode import closed_form_signs, mode_text
from trivet.model import Machine
from trivet.reach.margins import travel_margin
from trivet.space.family import Places
from trivet.space.pose import zyz_frame
from trivet.space.search import LowestAngles, lowest_angles
from trivet.space.surface import Surface
from trivet.statics.best_roll import ROLLS
from trivet.study.frf import check_range, directions
from trivet.study.response_summary import check_entries
from trivet.study.roll_policy import RollPolicy, roll_policy
from trivet.study.stiffness_map import roll_symmetry
from trivet.vibration.damping import check_loss_factor, least_damping
from trivet.vibration.directional import CHUNK, Asked, Entries, greatest
from trivet.vibration.platform import platform_inertia

Array = NDArray[Any]

AT_LIMIT = 1e-9
"""Share of its travel by which a joint may seem beyond a limit at which a best roll left it."""
ALIKE = 1e-12
"""Differences of the platform's inertia, against its greatest entry, that are rounding."""
DYNAMIC = "best D_"
"""How the policies begin that choose the roll by the least dynamic stiffness."""
DYNAMIC_ROLLS = 72
"""Rolls of the first grid of those over a turn, unless said otherwise: a look costs a frequency response."""
FEWEST_ROLLS, MOST_ROLLS = 8, 3600
POINTS_AT_ONCE = 64
"""Points whose rolls are sought together, between which progress is told."""


@dataclass(frozen=True)
class Responses:
    """All that responses depend on besides the poses."""

    machine: Machine
    signs: Any
    """(n_chains, 2) working mode."""
    names: tuple[str, ...]
    """Of the entries: motion, then load: "xx", "z_ry"."""
    loss_factor: float
    """Of all that has none of its own."""
    least_damping: float
    tip: tuple[float, float, float] | None
    """Of the tool in {E}, m; None for the platform centre."""
    low: float
    high: float
    """Hz."""

    @property
    def entries(self) -> Entries:
        """As the kernels take them."""
        return Entries.named([directions(name) for name in self.names])

    @classmethod
    def of(
        cls, machine: Machine, mode: str | None, entries: Sequence[str], point: str, loss_factor: float, low: float, high: float
    ) -> Responses:
        """From what people write.

        Raises:
            InputError: for a wrong entry, point, range or mode, or no damping.
        """
        check_range(low, high)
        if point not in ("platform", "tool"):
            raise InputError(f"point '{point}': expected platform (its centre) or tool (its tip)")
        if not entries:
            raise InputError("entries: none; name at least one, as in xx or x_ry")
        tip = machine.platform.tool_tip if point == "tool" else None
        if point == "tool" and tip is None:
            raise InputError(f"point tool: {machine.name} has no platform.tool_tip; give one, or write platform")
        check_loss_factor(loss_factor)
        names = check_entries(entries, "receptance")
        signs = closed_form_signs(machine, mode)
        damping = least_damping(machine, loss_factor)
        return cls(machine, signs, names, loss_factor, damping, tip, low, high)

    def along(self, entries: Sequence[str]) -> Responses:
        """The same along other entries."""
        return replace(self, names=tuple(entries))

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
        """A policy for the roll: `study.roll_policy`'s, or "best D_xx" (or any other entry), see `DynamicRoll`."""
        if not isinstance(roll, str) or not roll.startswith(DYNAMIC):
            return roll_policy(roll, ROLLS if rolls is None else rolls, progress)
        steps = DYNAMIC_ROLLS if rolls is None else rolls
        if not FEWEST_ROLLS <= steps <= MOST_ROLLS:
            raise InputError(f"rolls: {steps}; between {FEWEST_ROLLS} and {MOST_ROLLS} are needed to find the hills")
        entry = roll.removeprefix(DYNAMIC)
        directions(entry)
        return DynamicRoll(self.along([entry]), steps, self.roll_symmetry(), progress)

    def roll_symmetry(self) -> int:
        """Number of rolls in a full turn at which the responses are the same."""
        count = roll_symmetry(self.machine, mode_text(self.machine, self.signs))
        upright = zyz_frame(np.zeros((2, 3)), np.zeros(2), np.zeros(2), np.array([0.0, 2 * math.pi / count]))
        there, turned = np.asarray(platform_inertia(self.machine, upright))
        is_alike = np.allclose(there, turned, rtol=0, atol=ALIKE * np.abs(there).max())
        return count if is_alike and (self.tip is None or not np.any(self.tip[:2])) else 1


@dataclass(frozen=True)
class DynamicRoll:
    """The roll at which the least dynamic stiffness 1/|H| over the range of frequencies is greatest along an entry."""

    responses: Responses
    """Along that entry."""
    rolls: int
    """Of the first grid over a turn; hills narrower than 360/rolls degrees can be missed."""
    symmetry: int
    """In so many parts of a turn the same is found."""
    progress: Callable[[int], None]

    @property
    def name(self) -> str:
        """As people write it."""
        return DYNAMIC + self.responses.names[0]

    def choose(self, machine: Machine, surface: Surface, signs: Any) -> Array:
        """Rolls (n,) at check points, rad; NaN where none is reached.  Machine and mode are those of the responses."""
        found = np.empty(len(surface))
        for start in range(0, len(surface), POINTS_AT_ONCE):
            part = slice(start, start + POINTS_AT_ONCE)
            some = Places(surface.position[part], surface.azimuth[part], surface.tilt[part], None)
            found[part] = self.search(some).angle
            self.progress(min(part.stop, len(surface)))
        return found

    def search(self, places: Places, tried: Array | None = None, enough: Array | None = None) -> LowestAngles:
        """Rolls (m,) and the greatest |H| over the range there, which are least; what is tried, and what enough, as for
        `lowest_angles`."""

        def size(which: Array, angle: Array) -> Array:
            stiffness, _ = self.responses.stiffness(places.some(which)._replace(roll=angle))
            own: Array = 1 / stiffness[:, 0]
            return own

        steps, period = -(-self.rolls // self.symmetry), 2 * math.pi / self.symmetry
        return lowest_angles(size, len(places.tilt), steps, period=period, tried=tried, enough=enough)
