"""All drives of a machine at work: its spare ones chosen along a path, so that the least of a measure is greatest.

Where the spare drives stand is a smooth function of the path (cubic B-splines), and how fast they go is bounded.  The search
begins with the best lock sets, which are constant functions, and with the best way over a grid of coordinates, pose after pose
(bottleneck dynamic programming); it goes on in epigraph form, as that of lock sets does.  So what is found is never below the
best lock set.  Beside it stands the best that every pose by itself allows: no way of the spare drives is above that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.held import Held
from trivet.model import Machine
from trivet.space.family import Family, Places
from trivet.study.epigraph import Chosen, Epigraph, drawn_back
from trivet.study.lock_advice import LocksAdvised, Modes, advise_locks
from trivet.study.lock_best import LockAdvice, Search
from trivet.study.lock_grid import Miss, Table, starts, table
from trivet.study.lock_measures import Goal
from trivet.study.lock_search import polished
from trivet.study.lock_task import poses_of
from trivet.study.lock_values import Holding, mode_of, span, split
from trivet.study.machines import MachineLike
from trivet.study.spare_ways import Spline, Stretch, way_over_grid

Array = NDArray[Any]

STEPS, FEW_STEPS = 80, 20
"""Of sequential quadratic programming, at most; fewer where a pose costs much."""
RATE = 2.0
"""Travels of itself that a spare drive may cover along a path, were it to go as fast all along."""
CHARTS = 2
"""Best lock sets whose spare drives are let go."""
WAYS = 3
"""Of each of them: at rest, what slopes make of that, and of the best way over a grid."""
SLACK = 1e-9
"""Part by which rates may seem beyond their bound."""


@dataclass(frozen=True)
class RedundantPath:
    """All drives along a path; arrays over n places of it."""

    fixed: LocksAdvised
    """The best lock sets on the same path, beside which it stands."""
    rate: float
    along: Array
    """(n,) coordinate of the path."""
    places: Places
    """Poses there."""
    drives: tuple[str, ...]
    spare: tuple[str, ...]
    """Drives in terms of which the choice was made: those that the lock set holds from which it began."""
    mode: str
    coordinates: Array
    """(n, drives) m or rad."""
    value: Array
    """(n,) the measure."""
    on_locks: Array
    """(n,) the measure with the best lock set."""
    alone: Array
    """(n,) the best that the pose allows by itself; NaN at places where it was not sought."""

    @property
    def machine(self) -> Machine:
        """Its drives free."""
        return self.fixed.machine

    @property
    def least(self) -> float:
        """The least of the measure."""
        return float(self.value.min())

    @property
    def locked_least(self) -> float:
        """The least with the best lock set."""
        return float(self.on_locks.min())

    @property
    def bound(self) -> float:
        """The least over the poses of what each allows by itself."""
        return float(np.nanmin(self.alone))


def redundant_path(
    machine: MachineLike,
    path: Family,
    goal: Goal | str = "1/C_xx",
    *,
    rate: float = RATE,
    modes: Modes = "all",
    progress: Callable[[str, int, int], None] = lambda doing, done, total: None,
) -> RedundantPath:
    """The best choice of all drives along a path.

    Args:
        machine: machine, name or file, with more drives than six.
        path: a family with one coordinate and rolls of its own (`along_path`, `along`).
        goal: as for `advise_locks`.
        rate: how far a spare drive may go along the path, in its travels, were it to go as fast all along.
        modes: as for `advise_locks`.
        progress: called with what is done, and how much of how many.

    Raises:
        InputError: as `advise_locks`, for poses that are no path, or a rate that is not above zero.
        NoResultError: no lock set reaches the whole path.
    """
    if len(path.spacing) != 1 or path.places(path.coordinates[:1]).roll is None:
        raise InputError(f"{path.name}: all drives are chosen along a path whose poses have rolls; this is none")
    if not (rate > 0 and np.isfinite(rate)):
        raise InputError(f"rate: {rate:g} travels along the path; must be above zero")
    fixed = advise_locks(machine, path, goal, modes=modes, progress=progress)
    return _Chooser(fixed, path, rate).found(progress)


class _Chooser:
    """The choice along one path."""

    def __init__(self, fixed: LocksAdvised, path: Family, rate: float) -> None:
        self.fixed, self.rate, self.asked = fixed, rate, fixed.measure
        self.along = _halved(_halved(path.coordinates[:, 0]))
        self.places = path.places(self.along[:, None])
        part = (self.along - self.along[0]) / (self.along[-1] - self.along[0])
        self.checked = Stretch(part, poses_of(self.places))
        self.stretch = Stretch(part[::2], self.checked.poses.some(np.arange(0, len(part), 2)))

    def found(self, progress: Callable[[str, int, int], None]) -> RedundantPath:
        """The best of all that is tried, by its least at twice as many places as it was sought at."""
        charts = sorted(self.fixed.reached, key=lambda a: (a is not self.fixed.best, -a.value))[:CHARTS]
        tried = []
        for k, advice in enumerate(charts):
            for n, one in enumerate(self._from(advice)):
                progress("ways", WAYS * k + n, WAYS * len(charts))
                tried.append(one)
        progress("ways", WAYS * len(charts), WAYS * len(charts))
        values = [self.checked.values(self.asked, ways, chosen) for ways, chosen in tried]
        best = int(np.argmax([own.min() for own in values]))
        ways, chosen = tried[best]
        alone = np.full(len(self.along), np.nan)
        alone[::2] = self._alone(ways, chosen[::2], progress)
        frames, rolls = self.checked.poses.frames, self.checked.rolls
        own = [way.coordinates(c, frames, rolls) for way, c in zip(ways, split(ways, chosen), strict=True)]
        drives = {name: along for each in own for name, along in each.items()}
        return RedundantPath(
            self.fixed, self.rate, self.along, self.places, tuple(drives), tuple(n for way in ways for n in way.drives),
            mode_of(ways), np.stack([*drives.values()], axis=1), values[best], values[0], alone,
        )  # fmt: skip

    def _from(self, advice: LockAdvice) -> Iterator[tuple[tuple[Held, ...], Array]]:
        """Coordinates (n, d) at the checked places, one after the other: those of the lock set itself, and what is better."""
        assert advice.holding is not None
        ways, still, spline = advice.holding.ways, advice.holding.values, Spline(len(self.stretch.part))
        program = Epigraph(self.asked, ways, self.stretch.poses, spline.matrix(self.stretch.part), advice.value)
        first = Chosen(np.tile(still, (spline.count, 1)), self.stretch.rolls)
        over = way_over_grid(self.asked, ways, self.stretch, self.rate)
        begun = [first]
        if over is not None:
            begun.append(first._replace(coefficients=np.linalg.lstsq(program.matrix, over, rcond=None)[0]))
        yield ways, np.tile(still, (len(self.checked.part), 1))
        at, steps = spline.matrix(self.checked.part), FEW_STEPS if self.asked.is_costly else STEPS

        def is_met(chosen: Chosen) -> bool:
            pace = np.abs(spline.rates @ (chosen.coefficients / span(ways))).max()
            inside = np.isfinite(self.checked.values(self.asked, ways, at @ chosen.coefficients))
            return bool(pace <= self.rate * (1 + SLACK) and np.all(inside))

        for start in begun:
            found = program.climbed(start, steps, spline.rates, self.rate)
            yield ways, at @ drawn_back(found, first, is_met).coefficients  # at the lock set nothing moves

    def _alone(self, ways: tuple[Held, ...], chosen: Array, progress: Callable[[str, int, int], None]) -> Array:
        """(p,) the best that every pose by itself allows, never less than what is chosen."""
        options, count = self._options(), len(self.stretch.part)
        best = np.empty(count)
        for p in range(count):
            progress("poses by themselves", p, count)
            one = self.stretch.poses.some(np.array([p]))
            least = self.stretch._replace(poses=one).values(self.asked, ways, chosen[[p]])
            begun = [Holding(ways, chosen[p], self.stretch.rolls[[p]], least)]
            tables = [table(self.asked, held, one) for held in options]
            if not any(isinstance(t, Miss) for t in tables):
                begun += starts(self.asked, [t for t in tables if isinstance(t, Table)], one, 1)
            best[p] = polished(self.asked, begun, one).value
        progress("poses by themselves", count, count)
        return best

    def _options(self) -> list[list[Held]]:
        """Per chain, every way in which some lock set holds it: together they are all that its spare drives can do."""
        search = Search(self.fixed.machine, self.asked, self.fixed.task, self.fixed.signs)
        held: list[dict[tuple[str, ...], list[Held]]] = [{} for _ in self.fixed.machine.legs]
        for locks in self.fixed.sets.whole:
            with suppress(InputError):
                for number, own in enumerate(search.ways(locks)):
                    held[number].setdefault(own[0].joints, own)
        return [[way for own in each.values() for way in own] for each in held]


def _halved(along: Array) -> Array:
    """Coordinates, and those in the middle between them."""
    both = np.empty(2 * len(along) - 1)
    both[::2], both[1::2] = along, (along[1:] + along[:-1]) / 2
    return both
