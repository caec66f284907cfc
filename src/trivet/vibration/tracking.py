"""Modes followed while a parameter changes, by the modal assurance criterion (`vibration.assurance`).

Which modes make one branch is no matter of judgement: the modes of a structure that depends on one parameter analytically can
be numbered so that frequencies and shapes do so too, through coincidences as well (F. Rellich, Math. Ann. 113:600, 1937), and
in one way only but where they coincide all along.  So steps are made short enough to see which numbering that is: where a MAC
is too low, and where frequencies seem to have changed places, since beyond a veering each mode looks as the other did before.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from trivet.errors import InputError
from trivet.vibration.assurance import assurance, coinciding, difference, nearest, overlap, run_numbers
from trivet.vibration.encounters import Encounter, Pace, encounters

CERTAIN = 0.8
"""MAC from which two modes are one: all others together have the rest of 1."""
KEPT = 0.2
"""MAC below which a branch ends, and another begins."""
TOP = 0.9
"""Share of the highest frequency that is looked at, above which a mode may go beyond it within a step."""
BUFFER = 6
"""Modes that are looked at beyond those asked for, so that those which come down are known; half of them as closely."""
FINEST = 1e-7
"""Shortest step, as a share of that between two of the places asked for."""
MOST_SOLUTIONS = 160
"""Places between two of those asked for, at most."""


class Sample(NamedTuple):
    """The lowest modes at one place."""

    frequency: np.ndarray
    """(p,) ascending, Hz."""
    vectors: np.ndarray
    """(N, p) orthonormal columns; vectors of other lengths go on with zeros."""


class Doubt(NamedTuple):
    """A step over which a mode is not known for certain to be the one that it was."""

    branch: int
    start: float
    end: float
    """Places of the step."""
    mac: float


@dataclass(frozen=True)
class Branches:
    """Modes along n places, as k branches."""

    place: np.ndarray
    """(n,) as asked for."""
    frequency: np.ndarray
    """(n, k) Hz; NaN where a branch is above the modes that were looked at."""
    number: np.ndarray
    """(n, k): which of the modes at that place it is, by frequency from 0; -1 for none."""
    turn: tuple[np.ndarray, ...]
    """Per place (p, k): what makes the shapes of branches from those of the modes, signs and mixtures of double ones."""
    mac: np.ndarray
    """(n - 1, k): the least MAC on the way from place to place; NaN for none."""
    steps: np.ndarray
    """(n - 1,): into how many steps the way from place to place was divided."""
    encounters: tuple[Encounter, ...]
    """Where branches cross, touch or veer, by place."""
    doubts: tuple[Doubt, ...]
    """By place."""
    fine_place: np.ndarray
    """(f,): all places that were looked at."""
    fine_frequency: np.ndarray
    """(f, k) Hz; NaN for none."""


def track(
    solve: Callable[[float, int], Sample],
    places: Sequence[float],
    count: int,
    progress: Callable[[int], None] = lambda done: None,
) -> Branches:
    """Follow the modes that are among the lowest somewhere on a way.

    Args:
        solve: the lowest modes, at a place and so many of them; fewer where there are no more.
        places: rising; `solve` is called between them as well.
        count: how many modes are the lowest ones; branches are numbered by their frequency where they begin.
        progress: called with the number of places that have been passed.

    Raises:
        InputError: for less than two places, places that do not rise, or no modes.
    """
    if count < 1:
        raise InputError(f"count: {count}; expected at least 1 mode")
    if len(places) < 2 or not all(a < b for a, b in pairwise(places)):
        raise InputError("places: expected at least two, each beyond the one before")
    way = _Way(solve, count, float(places[0]))
    for done, goal in enumerate(places[1:], start=1):
        way.go(float(goal))
        progress(done)
    return way.result([float(place) for place in places])


class _Here(NamedTuple):
    """Modes at a place as they go on from the place before."""

    place: float
    frequency: np.ndarray
    """(p,)"""
    vectors: np.ndarray
    """(N, p), turned."""
    turn: np.ndarray
    """(p, p): turns the modes as they were solved for."""
    branch: np.ndarray
    """(p,): number of the branch to which each belongs."""
    loose: list[list[int]]
    """Modes that have coincided from the beginning of the way: nothing has told yet which mixtures of them go on."""


class _Step(NamedTuple):
    """From one place to another."""

    here: _Here
    place: float
    sample: Sample
    cosines: np.ndarray
    """(p, q)."""
    rows: np.ndarray
    columns: np.ndarray
    """Modes here and there that are one."""
    mac: np.ndarray
    """Of each."""


@dataclass
class _Way:
    """A way as far as it has been gone."""

    solve: Callable[[float, int], Sample]
    count: int
    start: float
    samples: dict[float, Sample] = field(default_factory=dict)
    passed: list[_Here] = field(default_factory=list)
    """Without vectors, but for the last."""
    paces: list[Pace] = field(default_factory=list)
    known: int = 0
    """Branches so far."""

    def __post_init__(self) -> None:
        sample = self._sample(self.start)
        size = len(sample.frequency)
        loose = [run for run in coinciding(sample.frequency) if len(run) > 1]
        self.passed.append(_Here(self.start, *sample, np.eye(size), self._new(size), loose))

    def _sample(self, place: float) -> Sample:
        if place not in self.samples:
            self.samples[place] = self.solve(place, self.count + BUFFER)
        return self.samples[place]

    def _new(self, size: int) -> np.ndarray:
        self.known += size
        return np.arange(self.known - size, self.known)

    def go(self, goal: float) -> None:
        """To the next place, in as many steps as it takes."""
        shortest = FINEST * (goal - self.passed[-1].place)
        todo, solved = [goal], len(self.samples)
        while todo:
            step = self._step(todo[-1])
            cut = self._cut(step) if len(self.samples) - solved < MOST_SOLUTIONS else None
            if cut is None or min(cut - step.here.place, step.place - cut) < shortest:
                self._take(step)
                self.samples.pop(todo.pop())
            else:
                todo.append(cut)

    def _step(self, place: float) -> _Step:
        here, sample = self.passed[-1], self._sample(place)
        cosines = overlap(here.vectors, sample.vectors)
        bound = {k for run in here.loose for k in run}
        before = here.loose + [[k] for k in range(len(here.frequency)) if k not in bound]
        alike = assurance(cosines, before, coinciding(sample.frequency))
        rows, columns = linear_sum_assignment(-alike)
        mac = np.minimum(alike[rows, columns], 1.0)
        keep = mac >= KEPT
        for run in here.loose:
            # Whichever mixtures part, the lower number goes to the lower frequency.
            own = np.flatnonzero(np.isin(rows, run) & keep)
            order = own[np.argsort(columns[own])]
            columns[own], mac[own] = columns[order], mac[order]
        return _Step(here, place, sample, cosines, rows[keep], columns[keep], mac[keep])

    def _cut(self, step: _Step) -> float | None:
        """A place at which to divide a step; None where it shows what becomes of every mode."""
        here, there = step.here, step.sample
        middle = (here.place + step.place) / 2
        looked_at = self.count + BUFFER // 2
        partner = dict(zip(step.rows.tolist(), zip(step.columns.tolist(), step.mac.tolist(), strict=True), strict=True))
        seen = np.sum(step.cosines**2, axis=1)
        for k in range(min(looked_at, len(here.frequency))):
            # What is beyond the modes that are looked at has nothing of them.
            may_leave = here.frequency[k] > TOP * there.frequency[-1] and seen[k] < CERTAIN
            if partner.get(k, (0, 0.0))[1] < CERTAIN and not may_leave:
                return middle
        came = set(step.columns.tolist())
        has = np.sum(step.cosines**2, axis=0)
        for k in range(min(looked_at, len(there.frequency))):
            may_come = there.frequency[k] > TOP * here.frequency[-1] and has[k] < CERTAIN
            if k not in came and not may_come:
                return middle
        return _swap(here, step.place, there.frequency, {k: j for k, (j, _) in partner.items() if min(k, j) < looked_at})

    def _take(self, step: _Step) -> None:
        """Make a step."""
        here, sample = step.here, step.sample
        runs = coinciding(sample.frequency)
        run_of = {k: tuple(run) for run in runs for k in run}
        goes_to = dict(zip(step.rows.tolist(), step.columns.tolist(), strict=True))
        cosines, loose = step.cosines.copy(), list[list[int]]()
        for group in here.loose:
            own = [k for k in group if k in goes_to]
            targets = [goes_to[k] for k in own]
            if len({run_of[k] for k in targets}) > 1:
                # Now it shows which mixtures go on; they are those of all places before.
                cosines[own] = self._settle(own, cosines[np.ix_(own, targets)]) @ cosines[own]
            loose += [[k for k in targets if run_of[k] == one] for one in {run_of[k] for k in targets}]
        turn = np.eye(len(sample.frequency))
        comes_from = {j: k for k, j in goes_to.items()}
        for run in runs:
            known = [j for j in run if j in comes_from]
            if known:
                turn[np.ix_(run, known + [j for j in run if j not in known])] = nearest(
                    cosines[np.ix_([comes_from[j] for j in known], run)]
                )
        turned = cosines @ turn
        branch = np.full(len(sample.frequency), -1)
        branch[step.columns] = here.branch[step.rows]
        branch[branch < 0] = self._new(int(np.sum(branch < 0)))
        self.passed[-1] = here._replace(vectors=np.zeros((0, 0)))
        self.passed.append(
            _Here(step.place, sample.frequency, sample.vectors @ turn, turn, branch, [one for one in loose if len(one) > 1])
        )
        self.paces.append(Pace(here.branch[step.rows], step.mac, turned[np.ix_(step.rows, step.columns)]))

    def _settle(self, own: list[int], cosines: np.ndarray) -> np.ndarray:
        """Turn modes that have been loose so far, here and at all places before; gives the turn, transposed."""
        left, _, right = np.linalg.svd(cosines)
        turn = left @ right
        names = self.passed[-1].branch[own]
        for at in self.passed:
            columns = [int(np.flatnonzero(at.branch == name)[0]) for name in names]
            at.turn[:, columns] = at.turn[:, columns] @ turn
            if len(at.vectors):
                at.vectors[:, columns] = at.vectors[:, columns] @ turn
        return np.asarray(turn.T)

    def result(self, places: list[float]) -> Branches:
        """Branches that are among the lowest modes at one of the places asked for, by where they begin."""
        at = {here.place: here for here in self.passed}
        asked, ends = [at[place] for place in places], [k for k, here in enumerate(self.passed) if here.place in set(places)]
        # Numbers of branches rise with the place at which they begin, and there with the frequency.
        names = np.unique([here.branch[: self.count] for here in asked])
        every = np.array([here.place for here in self.passed])
        fine = _spread(((here.branch, here.frequency) for here in self.passed), names)
        runs = _spread(((here.branch, run_numbers(here.frequency)) for here in self.passed), names)
        mac = _spread(((pace.branch, pace.mac) for pace in self.paces), names)
        number = _spread(((here.branch, np.arange(len(here.branch))) for here in asked), names)
        return Branches(
            np.array(places),
            fine[ends],
            np.where(np.isnan(number), -1, number).astype(int),
            tuple(_columns(here, names) for here in asked),
            np.array([np.fmin.reduce(mac[a:b]) for a, b in pairwise(ends)]),
            np.diff(ends),
            tuple(encounters(every, fine, runs, [pace.angles(names) for pace in self.paces])),
            tuple(Doubt(int(k), every[n], every[n + 1], float(mac[n, k])) for n, k in np.argwhere(mac < CERTAIN)),
            every,
            fine,
        )


def _swap(here: _Here, place: float, frequency: np.ndarray, partner: dict[int, int]) -> float | None:
    """The first place at which two modes change places if the squares of their frequencies go straight; None for none."""
    shares = []
    for (k, j), (other, there) in combinations(partner.items(), 2):
        before = difference(here.frequency[k], here.frequency[other])
        after = difference(frequency[j], frequency[there])
        if before * after < 0:
            shares.append(before / (before - after))
    return here.place + min(shares) * (place - here.place) if shares else None


def _spread(rows: Iterable[tuple[np.ndarray, np.ndarray]], names: np.ndarray) -> np.ndarray:
    """(n, k) from n rows of branches (p,) and their values (p,): those of k branches, NaN for none."""
    found = []
    for branch, values in rows:
        row = np.full(len(names), np.nan)
        _, to, of = np.intersect1d(names, branch, return_indices=True)
        row[to] = values[of]
        found.append(row)
    return np.array(found)


def _columns(here: _Here, names: np.ndarray) -> np.ndarray:
    """(p, k): what turns modes into branches; zeros for none."""
    turn = np.zeros((len(here.turn), len(names)))
    _, to, of = np.intersect1d(names, here.branch, return_indices=True)
    turn[:, to] = here.turn[:, of]
    return turn
