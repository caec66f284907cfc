"""Frequency responses over many poses: the least dynamic stiffness at each, and the worst pose and frequency of all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.mode import mode_text, mode_words
from trivet.model import Machine
from trivet.space.family import Family, Places
from trivet.space.frame import Frame
from trivet.study.families import hemisphere_of
from trivet.study.machines import MachineLike, choose
from trivet.study.responses import Responses
from trivet.study.worst import Worst, rolled, unbounded, worst, worst_of_points
from trivet.vibration.directional import Peaks, climbed, is_rounding, receptances
from trivet.vibration.resonance import grid

Array = NDArray[Any]
Progress = Callable[[str, int, int], None]

DEFAULT = ("xx", "yy", "zz")
"""Entries, unless said otherwise."""
POINTS = 2000
"""Frequencies, unless said otherwise."""


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
    """(n, k) least of 1/|H| over the range of frequencies, N/m, N, N/rad, N m/rad; infinite where H is nothing but rounding, as
    symmetry makes it of entries off the diagonal."""
    at_frequency: Array
    """(n, k) where it is, Hz; NaN where that is nowhere."""
    least: Array
    """(k, f) least |H| over the poses that are reached, m/N, m/(N m), rad/N, rad/(N m)."""
    greatest: Array
    """(k, f) greatest |H| over the poses that are reached."""
    worst: tuple[Worst, ...]
    """Per entry."""
    sought: bool
    """Whether these were sought between the points of the grid; they are the worst of its points otherwise."""

    @property
    def used(self) -> Array:
        """(n,) points at which the pose is reached with all joints inside their travel."""
        return ~np.any(np.isnan(self.stiffness), axis=1)

    @cached_property
    def poses(self) -> Frame:
        """Platform frames of the grid."""
        return self.places.frames()

    def receptances(self) -> Iterator[tuple[slice, Array]]:
        """(some, k, f) receptances of the points in their order, worked out anew and a few at a time; NaN where not reached."""
        low, high = self.frequency[[0, -1]].tolist()
        own = Responses.of(self.machine, self.mode or None, self.entries, self.point, self.loss_factor, low, high)
        for rows, values in receptances(own.asked(self.places), self.frequency):
            yield rows, np.where(self.used[rows][:, None, None], values, np.nan)


def atlas(
    machine: MachineLike,
    family: Family | None = None,
    *,
    entries: Sequence[str] = DEFAULT,
    point: str = "platform",
    roll: str | float | None = None,
    mode: str | None = None,
    rolls: int | None = None,
    low: float = 5.0,
    high: float = 3000.0,
    points: int = POINTS,
    loss_factor: float = 0.02,
    search: bool = True,
    progress: Progress = lambda what, done, total: None,
) -> Atlas:
    """Frequency responses over a family of poses; memory does not grow with their number beyond what is told per pose.

    Args:
        machine: machine, name or file.
        family: see `over_hemisphere`, `in_block`, `along_path`, `along`; by default the machine's own workpiece, at 317
            points.
        entries: motion, then load: "xx", "z_ry".
        point: "platform" (its centre) or "tool" (its tip).
        roll: policy for the roll where the family leaves it free, see `Responses.roll_policy`; "best K_xx" by default.
        mode: working mode; the machine's own when not given.
        rolls: rolls of the first grid of a best roll.
        low, high: range of frequencies, Hz.
        points: equally spaced frequencies of the responses; least dynamic stiffnesses are sought between them.
        loss_factor: structural damping eta of all that has no loss factor of its own.
        search: whether the worst poses are sought between the points too, which takes the greater part of the time.
        progress: called with what is being done, how much of it is done, and how much there is.

    Raises:
        InputError: for a wrong entry, point, range, policy or mode, or no damping.
        NoResultError: when no pose is reached.
    """
    chosen = choose(machine)
    if points < 2:
        raise InputError(f"points: {points}; expected at least 2 frequencies")
    family = family if family is not None else hemisphere_of(chosen)
    asked = Responses.of(chosen, mode, entries, point, loss_factor, low, high)
    free = family.places(family.coordinates)
    policy, places = None, free
    if free.roll is None:
        wanted = "best K_xx" if roll is None else roll
        policy = asked.roll_policy(wanted, rolls)
        told = asked.roll_policy(wanted, rolls, lambda done: progress("best rolls", done, len(family)))
        places = rolled(asked, told, free)
    elif roll is not None or rolls is not None:
        raise InputError(f"roll: the {family.name} has rolls of its own; leave the policy and its grid out")
    there = np.flatnonzero(asked.reached(places))
    name = mode_text(chosen, asked.signs)
    if not len(there):
        with_policy = f", with the roll {policy.name}" if policy is not None else ""
        raise NoResultError(f"{chosen.name}: no pose of the {family.name} is reached, {mode_words(name)}{with_policy}")
    frequency = np.linspace(low, high, points)
    stiffness, at_frequency, least, most = _swept(asked, places.some(there), frequency, partial(progress, "responses"))
    whole, where = (np.full((len(family), len(entries)), np.nan) for _ in range(2))
    whole[there], where[there] = stiffness, at_frequency

    def worst_along(entry: str, on_grid: Array) -> Worst:
        own = asked.along([entry])
        if not np.any(np.isfinite(on_grid)):
            return unbounded(entry)
        if not search:
            return worst_of_points(own, places, on_grid)
        return worst(own, policy, family, places, on_grid, partial(progress, f"worst pose, {entry}"))

    return Atlas(
        chosen, name, family, "as given" if policy is None else policy.name, places, point, tuple(entries), frequency,
        loss_factor, whole, where, least, most, tuple(map(worst_along, entries, whole.T)), search,
    )  # fmt: skip


def _swept(
    asked: Responses, places: Places, frequency: Array, progress: Callable[[int, int], None]
) -> tuple[Array, Array, Array, Array]:
    """Least stiffness and where (m, k), least and greatest |H| (k, f) over the places, which are all reached."""
    fine = grid(asked.low, asked.high, asked.least_damping)
    together = np.unique(np.concatenate([frequency, fine]))
    wanted = np.searchsorted(together, frequency)
    there, peaks = asked.asked(places), list[Peaks]()
    least, most = (np.full((len(asked.names), len(frequency)), sign * np.inf) for sign in (1, -1))
    for rows, values in receptances(there, together):
        sizes = np.abs(values)
        peaks.append(Peaks.of(together, sizes, asked.least_damping, rows.start))
        least = np.minimum(least, sizes[..., wanted].min(axis=0))
        most = np.maximum(most, sizes[..., wanted].max(axis=0))
        progress(rows.stop, len(there))
    found = climbed(there, Peaks.joined(peaks), asked.high)
    is_none = is_rounding(there, found, asked.high)
    return np.where(is_none, np.inf, 1 / found.size), np.where(is_none, np.nan, found.frequency), least, most
