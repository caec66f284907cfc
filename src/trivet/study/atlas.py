"""Frequency responses over many poses: the least dynamic stiffness at each, and the worst pose and frequency of all."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.mode import closed_form_signs, mode_text, mode_words
from trivet.model import Machine
from trivet.reach.margins import travel_margin
from trivet.space.family import Family, Places, lowest, over_hemisphere
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.statics.best_roll import ROLLS
from trivet.study.frf import HIGHEST, directions
from trivet.study.machines import MachineLike, choose
from trivet.study.singularity_map import roll_policy
from trivet.study.stiffness_map import workpiece_of
from trivet.vibration.damping import least_damping
from trivet.vibration.directional import CHUNK, Asked, Entries, climbed, greatest, receptances
from trivet.vibration.resonance import grid
from trivet.vibration.spectral import plan

Array = NDArray[Any]

AT_LIMIT = 1e-9
"""Share of its travel by which a joint may seem beyond a limit at which a best roll left it."""


class Worst(NamedTuple):
    """The pose at which a dynamic stiffness is least, sought between the points of the grid."""

    entry: str
    stiffness: float
    """N/m, N/rad, N m/rad."""
    frequency: float
    """Hz."""
    position: tuple[float, float, float]
    """m in {O}."""
    azimuth: float
    tilt: float
    roll: float
    """rad."""
    on_grid: float
    """The least at a point of the grid."""


@dataclass(frozen=True)
class Atlas:
    """Frequency responses of a machine over a family of poses; arrays over its n points, NaN where none is reached."""

    machine: Machine
    mode: str
    family: Family
    policy: str
    """How the roll was chosen: "best K_xx", "-alpha", "30 deg"; "as given" along a path."""
    places: Places
    """Of the grid, rolls included."""
    point: str
    """"platform" (its centre) or "tool" (its tip)."""
    entries: tuple[str, ...]
    """k of them, motion, then load: "xx", "x_ry"."""
    frequency: Array
    """(f,) Hz."""
    loss_factor: float
    stiffness: Array
    """(n, k) least of 1/|H| over the range of frequencies, N/m, N/rad, N m/rad."""
    at_frequency: Array
    """(n, k) where it is, Hz."""
    least: Array
    """(k, f) least |H| over the poses that are reached, m/N, m/(N m), rad/N, rad/(N m)."""
    greatest: Array
    """(k, f) greatest |H| over the poses that are reached."""
    worst: tuple[Worst, ...]
    """Per entry."""

    @property
    def used(self) -> Array:
        """(n,) points at which the pose is reached with all joints inside their travel."""
        return np.all(np.isfinite(self.stiffness), axis=1)

    @cached_property
    def poses(self) -> Frame:
        """Platform frames of the grid."""
        return _frames(self.places)

    def receptances(self) -> Iterator[tuple[slice, Array]]:
        """(some, k, f) receptances of the points in their order, worked out anew and a few at a time; NaN where not reached."""
        for rows, values in receptances(self._asked, self.frequency):
            yield rows, np.where(self.used[rows][:, None, None], values, np.nan)

    @property
    def _asked(self) -> Asked:
        return _Setting.of(self).asked(self.places)


@dataclass(frozen=True)
class _Setting:
    """All that the responses depend on besides the places."""

    machine: Machine
    signs: Any
    entries: Entries
    loss_factor: float
    least_damping: float
    tip: tuple[float, float, float] | None
    low: float
    high: float

    @classmethod
    def of(cls, atlas: Atlas) -> _Setting:
        return _setting(
            atlas.machine, atlas.mode or None, atlas.entries, atlas.point, atlas.loss_factor, *atlas.frequency[[0, -1]].tolist()
        )

    def asked(self, places: Places) -> Asked:
        return Asked.of(self.machine, _frames(places), self.signs, self.entries, self.loss_factor, self.tip)

    def stiffness(self, places: Places) -> tuple[Array, Array]:
        """Least dynamic stiffness (m, k) and where it is; NaN at poses that are not reached."""
        size, frequency = (np.full((len(places.tilt), len(self.entries.pairs)), np.nan) for _ in range(2))
        there = np.flatnonzero(self.reached(places))
        if len(there):
            # Filled up, since kernels are compiled for every number of poses.
            index = np.resize(there, -(-len(there) // CHUNK) * CHUNK)
            found = greatest(self.asked(_some(places, index)), self.low, self.high, self.least_damping)
            size[there], frequency[there] = (a[: len(there)] for a in found)
        return 1 / size, frequency

    def reached(self, places: Places) -> Array:
        """(m,) whether all joints are inside their travel."""
        assert places.roll is not None
        known: Array = np.all(np.isfinite(places.position), axis=1) & np.isfinite(places.roll)
        with np.errstate(invalid="ignore"):
            known &= travel_margin(self.machine, _frames(places), self.signs) >= -AT_LIMIT
        return known


def atlas(
    machine: MachineLike,
    family: Family | None = None,
    *,
    entries: Sequence[str] = ("xx", "yy", "zz"),
    point: str = "platform",
    roll: str | float = "best K_xx",
    mode: str | None = None,
    rolls: int = ROLLS,
    low: float = 5.0,
    high: float = 3000.0,
    points: int = 2000,
    loss_factor: float = 0.02,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Atlas:
    """Frequency responses over a family of poses; memory does not grow with their number beyond what is told per pose.

    Args:
        machine: machine, name or file.
        family: see `over_hemisphere`, `in_block`, `along`; the machine's own workpiece, at 317 points, by default.
        entries: motion, then load: "xx", "z_ry".
        point: "platform" (its centre) or "tool" (its tip).
        roll: policy for the roll where the family leaves it free, see `roll_policy`.
        mode: working mode; the machine's own when not given.
        rolls: rolls of the first grid of a best roll.
        low, high: range of frequencies, Hz.
        points: equally spaced frequencies of the responses; least dynamic stiffnesses are sought between them.
        loss_factor: structural damping eta of all that has no loss factor of its own.
        progress: called with the poses that are done, and their number.

    Raises:
        InputError: for a wrong entry, point, range, policy or mode, or no damping.
        NoResultError: when no pose is reached.
    """
    chosen = choose(machine)
    if not (math.isfinite(low) and math.isfinite(high) and 0 < low < high <= HIGHEST):
        expected = f"expected a range that rises from above 0 Hz, up to {HIGHEST:g} Hz"
        raise InputError(f"frequencies: {low:g} Hz to {high:g} Hz; {expected}")
    if points < 2:
        raise InputError(f"points: {points}; expected at least 2 frequencies")
    family = family if family is not None else hemisphere_of(chosen)
    setting = _setting(chosen, mode, entries, point, loss_factor, low, high)
    free = family.places(family.coordinates)
    policy = roll_policy(roll, rolls) if free.roll is None else None

    def with_roll(places: Places) -> Places:
        if policy is None:
            return places
        known: Array = np.all(np.isfinite(places.position), axis=1)
        rolls = np.full(len(known), np.nan)
        if known.any():
            rolls[known] = policy.choose(chosen, _some(places, np.flatnonzero(known)).surface(family.name), setting.signs)
        return places._replace(roll=rolls)

    places = with_roll(free)
    there = np.flatnonzero(setting.reached(places))
    name = mode_text(chosen, setting.signs)
    if not len(there):
        with_policy = f", with the roll {policy.name}" if policy is not None else ""
        raise NoResultError(f"{chosen.name}: no pose of the {family.name} is reached, {mode_words(name)}{with_policy}")
    frequency = np.linspace(low, high, points)
    stiffness, at_frequency, least, most = _swept(setting, _some(places, there), frequency, progress)
    whole, where = (np.full((len(family), len(setting.entries.pairs)), np.nan) for _ in range(2))
    whole[there], where[there] = stiffness, at_frequency

    def worst(k: int, entry: str) -> Worst:
        def value(coordinates: Array) -> Array:
            return setting.stiffness(with_roll(family.places(coordinates)))[0][:, k]

        found = lowest(family, whole[:, k], value)
        there = with_roll(family.places(found.coordinates[None]))
        own, at = setting.stiffness(there)
        assert there.roll is not None
        x, y, z = there.position[0].tolist()
        azimuth, tilt, angle = (float(a[0]) for a in (there.azimuth, there.tilt, there.roll))
        on_grid = float(np.nanmin(whole[:, k]))
        return Worst(entry, float(own[0, k]), float(at[0, k]), (x, y, z), azimuth, tilt, angle, on_grid)

    return Atlas(
        chosen,
        name,
        family,
        "as given" if policy is None else policy.name,
        places,
        point,
        tuple(entries),
        frequency,
        loss_factor,
        whole,
        where,
        least,
        most,
        tuple(worst(k, entry) for k, entry in enumerate(entries)),
    )


def _swept(
    setting: _Setting, places: Places, frequency: Array, progress: Callable[[int, int], None]
) -> tuple[Array, Array, Array, Array]:
    """Least stiffness and where (m, k), least and greatest |H| (k, f) over the places, which are all reached."""
    fine = grid(setting.low, setting.high, setting.least_damping)
    together = np.unique(np.concatenate([frequency, fine]))
    wanted = np.searchsorted(together, frequency)
    asked = setting.asked(places)
    effort = plan(asked.machine, asked.poses, asked.stand, 2 * math.pi * setting.high).effort
    size, at = (np.empty((len(asked), len(setting.entries.pairs))) for _ in range(2))
    least, most = (np.full((size.shape[1], len(frequency)), sign * np.inf) for sign in (1, -1))
    for rows, values in receptances(asked, together):
        sizes = np.abs(values)
        some = asked.part(np.arange(rows.start, rows.stop))
        size[rows], at[rows] = climbed(some, together, sizes, setting.least_damping, effort)
        least = np.minimum(least, sizes[..., wanted].min(axis=0))
        most = np.maximum(most, sizes[..., wanted].max(axis=0))
        progress(rows.stop, len(asked))
    return 1 / size, at, least, most


def _setting(
    machine: Machine, mode: str | None, entries: Sequence[str], point: str, loss_factor: float, low: float, high: float
) -> _Setting:
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
    named = Entries.named([directions(name) for name in entries])
    return _Setting(machine, signs, named, loss_factor, damping, tip, low, high)


def hemisphere_of(machine: Machine, steps: int = 10, radius: float | None = None, height: float | None = None) -> Family:
    """The machine's own workpiece hemisphere, or one given by radius and height of its centre (m).

    Raises:
        InputError: when the machine file has no workpiece and either number is missing.
    """
    return over_hemisphere(*workpiece_of(machine, radius, height), steps)


def _frames(places: Places) -> Frame:
    return zyz_frame(places.position, places.azimuth, places.tilt, places.roll)


def _some(places: Places, index: Array) -> Places:
    roll = None if places.roll is None else places.roll[index]
    return Places(places.position[index], places.azimuth[index], places.tilt[index], roll)
