"""Optimisation of machines: the front of every architecture, of all of them together, looked at again by other ways."""

from __future__ import annotations

import os
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from trivet.design.aims import Aims, aims_of, seen
from trivet.design.checking import checked
from trivet.design.evaluation import Array, Evaluation
from trivet.design.front.archive import is_best
from trivet.design.front.evolution import Evolution
from trivet.design.front.evolution import Progress as Step
from trivet.design.front.front import HELD, Bound, Front
from trivet.design.front.polisher import Polishing
from trivet.design.front.search import searched
from trivet.design.machine_problem import MachineProblem
from trivet.design.memo import kept
from trivet.design.study import Study
from trivet.errors import InputError, NoResultError
from trivet.model import Machine

Progress = Callable[[str, str, int, int, int], None]
"""Called with the machine, the stage, how much of it is done and of how much, and how many designs are on the front."""


class Member(NamedTuple):
    """A design on the front, or one that is dominated by few."""

    place: int
    """Which of the study's machines."""
    design: Array
    """(d,) SI."""
    values: Array
    """(q,) the quantities, SI."""
    is_polished: bool
    active: tuple[str, ...]
    """Limits that hold it."""
    bounds: tuple[str, ...]
    """Ends of ranges that hold it, in words."""
    again: Array
    """(q,) the quantities over finer check points and rolls; empty for alternatives."""
    structural: float
    """Difference from matrix structural analysis, see `checking.Checked`."""


@dataclass(frozen=True)
class Optimisation:
    """The best designs of a study."""

    study: Study
    aims: Aims
    members: tuple[Member, ...]
    """That no other design dominates, by the first objective."""
    alternatives: tuple[Member, ...]
    """Dominated ones beside them: of other machines, and next to the front."""
    missing: tuple[str, ...]
    """Machines without a design that meets all limits, each with the reason."""

    @property
    def columns(self) -> list[str]:
        """Names of the quantities."""
        return [own.name for own in self.study.quantities]

    def machine(self, member: Member) -> Machine:
        """The machine that a member is."""
        return self.study.machine(member.place, member.design)

    def objectives(self, members: tuple[Member, ...]) -> Array:
        """(n, m), all to be small."""
        values = np.array([member.values for member in members]).reshape(len(members), len(self.columns))
        return seen(self.aims.goals, self.columns, values)


def optimise(
    study: Study,
    *,
    store: str | os.PathLike[str] | None = None,
    points: int = 40,
    seconds: float = float("inf"),
    progress: Progress = lambda machine, stage, done, total, best: None,
    damaged: Callable[[int], None] = lambda cut: None,
) -> Optimisation:
    """The designs of a study's machines that no other dominates.

    Every machine evolves by itself, with as many evaluations, and its front is polished by slopes; then all are set against
    each other.  What is on the front is worked out again over more check points and rolls, and by the structural path.

    Args:
        study: with what it seeks.
        store: file that keeps what was worked out, so that an interrupted run goes on.
        points: designs told of each machine, at most.
        seconds: for polishing each machine's front.
        progress: called as it goes on.
        damaged: called with the bytes of the store that were damaged, and are worked out again.

    Raises:
        InputError: for aims that contradict each other, or a store of another study.
        NoResultError: when no design of any machine meets all limits.
    """
    if points < 2 or not seconds > 0:
        raise InputError(f"points: {points}, seconds: {seconds}; a front has 2 points or more, and its polishing some time")
    asked, aims = aims_of(study)
    given = asked.given.optimise
    evolution = Evolution(given.evaluations, population=given.population, seed=given.seed)
    fronts: dict[int, Front] = {}
    missing: list[str] = []
    # How long designs evolve, and from which seed, changes no value: a run may be made longer.
    with kept(store, asked.fingerprint([own.words for own in aims.all]), damaged) as memo:
        for place, name in enumerate(asked.names):
            problem = MachineProblem(asked, place, aims)
            own = _Prefixed(memo, f"{place}:".encode())
            start = np.clip(asked.described_of(place), problem.low, problem.high)[None]
            try:
                aims.require(asked.machines[place])
                fronts[place] = searched(
                    problem, evolution, Polishing(points, seconds), own, start, partial(_told, progress, name)
                )
            except NoResultError as error:
                missing.append(f"{name}: {error}")
    if not fronts:
        raise NoResultError("; ".join(missing))
    return _together(asked, aims, fronts, tuple(missing))


def _told(progress: Progress, name: str, step: Step) -> None:
    progress(name, step.stage, step.done, step.of, len(step.archive.best[0]))


class _Prefixed(MutableMapping[bytes, Array]):
    """The part of a memo that is one machine's."""

    def __init__(self, memo: MutableMapping[bytes, Array], prefix: bytes) -> None:
        self._memo, self._prefix = memo, prefix

    def __getitem__(self, key: bytes) -> Array:
        return self._memo[self._prefix + key]

    def __contains__(self, key: object) -> bool:
        return isinstance(key, bytes) and self._prefix + key in self._memo

    def __setitem__(self, key: bytes, values: Array) -> None:
        self._memo.update({self._prefix + key: values})

    def update(self, *others: Any, **_: Any) -> None:
        """Take in what is new, with one writing."""
        for other in others:
            items = other.items() if hasattr(other, "items") else other
            self._memo.update({self._prefix + key: values for key, values in items})

    def __delitem__(self, key: bytes) -> None:
        del self._memo[self._prefix + key]

    def __iter__(self) -> Any:
        return (key.removeprefix(self._prefix) for key in self._memo if key.startswith(self._prefix))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def _together(study: Study, aims: Aims, fronts: dict[int, Front], missing: tuple[str, ...]) -> Optimisation:
    members = [one for place, front in fronts.items() for one in _members(study, aims, place, front)]
    beside = [one for place, front in fronts.items() for one in _alternatives(study, place, front)]
    whole = Optimisation(study, aims, tuple(members), tuple(beside), missing)
    best = is_best(whole.objectives(whole.members))
    kept_members = [one for one, is_on in zip(members, best, strict=True) if is_on]
    others = [one for one, is_on in zip(members, best, strict=True) if not is_on]
    again = [one for place in fronts for one in _again(study, place, [m for m in kept_members if m.place == place])]
    order = np.argsort(whole.objectives(tuple(again))[:, 0], kind="stable")
    return Optimisation(study, aims, tuple(again[k] for k in order), (*others, *beside), missing)


def _members(study: Study, aims: Aims, place: int, front: Front) -> list[Member]:
    problem = MachineProblem(study, place, aims)
    active = [_active(problem, design) for design in front.designs]
    values = _values(study, place, front.designs)
    bounds = [_ends(study, place, own) for own in front.bounds]
    rows = zip(front.designs, values, front.is_polished.tolist(), active, bounds, strict=True)
    return [Member(place, *row, np.zeros(0), np.nan) for row in rows]


def _ends(study: Study, place: int, bounds: tuple[Bound, ...]) -> tuple[str, ...]:
    """In words; those of variables that a machine has no number of hold nothing."""
    has = {variable.name for variable in study.variables if variable.acts_on(place)}
    return tuple(f"{one.variable} at its {'greatest' if one.is_high else 'least'}" for one in bounds if one.variable in has)


def _active(problem: MachineProblem, design: Array) -> tuple[str, ...]:
    """Limits that hold a design: by its model, which knows how near a check point is to being out of reach."""
    model = problem.model(design)
    greatest = np.full(len(problem.aims.all), -np.inf)
    np.maximum.at(greatest, model.owner, model.rows(design))
    own = greatest[len(problem.aims.goals) :]
    return tuple(limit.words for limit, row in zip(problem.aims.limits, own, strict=True) if row >= -HELD)


def _alternatives(study: Study, place: int, front: Front) -> list[Member]:
    if not len(front.alternatives):
        return []
    rows = zip(front.alternatives, _values(study, place, front.alternatives), strict=True)
    return [Member(place, *row, False, (), (), np.zeros(0), np.nan) for row in rows]


def _values(study: Study, place: int, designs: Array) -> Array:
    return Evaluation(study.of(place).climbing())(designs).values


def _again(study: Study, place: int, members: list[Member]) -> list[Member]:
    """Members of one of the machines, with what other ways say of them."""
    if not members:
        return []
    found = checked(study, place, np.array([one.design for one in members]))
    rows = zip(members, found.values, found.structural.tolist(), strict=True)
    return [one._replace(again=values, structural=structural) for one, values, structural in rows]
