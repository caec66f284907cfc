"""Optimisation of machines: the front of every architecture, of all of them together, looked at again by other ways."""

from __future__ import annotations

import os
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from trivet.design.aims import Aims, Limit, aims_of, seen
from trivet.design.checking import checked
from trivet.design.evaluation import Array, Evaluation
from trivet.design.front.archive import is_best
from trivet.design.front.evolution import Evolution
from trivet.design.front.evolution import Progress as Step
from trivet.design.front.front import HELD, Bound, Front
from trivet.design.front.polisher import Polishing
from trivet.design.front.search import searched
from trivet.design.machine_problem import MachineProblem
from trivet.design.memo import Part, kept, remembered
from trivet.design.study import Study
from trivet.errors import InputError, NoResultError
from trivet.model import Machine

KEPT = 1e-3
"""By how much a limit may be missed over finer check points, between those at which it was held, and counts as kept."""

Progress = Callable[[str, str, int, int | None, int], None]
"""Called with the machine, the stage, how many designs are done and of how many (None where that is not known), and how many of
the machine's designs no other dominates so far."""


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

    def missed(self, member: Member) -> dict[Limit, float]:
        """Limits that a member of the front does not keep over finer check points and rolls, and by how much (`Limit.of`)."""
        values = dict(zip(self.columns, member.again.tolist(), strict=True))
        found = {limit: float(limit.of(values[limit.asked.name])) for limit in self.aims.limits}
        return {limit: by for limit, by in found.items() if not by <= KEPT}

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
        seconds: for polishing each machine's front: half for the coarse turns between those of evolution, half for the last
            one.  Kernels that are compiled in them count.
        progress: called as it goes on, and first with nothing done in every stage.
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
    found: list[_Found] = []
    missing: list[str] = []
    # How long designs evolve, and from which seed, changes no value: a run may be made longer.
    with kept(store, asked.fingerprint([own.words for own in aims.all]), damaged) as memo:
        for place, name in enumerate(asked.names):
            problem = MachineProblem(asked, place, aims)
            own = Part(memo, f"{place}:".encode())
            start = np.clip(asked.described_of(place), problem.low, problem.high)[None]
            try:
                aims.require(asked.machines[place])
                tell = partial(_told, progress, name)
                found.append(_Found(problem, own, searched(problem, evolution, Polishing(points, seconds), own, start, tell)))
            except NoResultError as error:
                missing.append(f"{name}: {error}")
        if not found:
            raise NoResultError("; ".join(missing))
        return _together(asked, aims, found, tuple(missing), progress)


def _told(progress: Progress, name: str, step: Step) -> None:
    progress(name, step.stage, step.done, step.of, len(step.archive.best[0]))


class _Found(NamedTuple):
    """The front of one of the machines, and what is known of its designs."""

    problem: MachineProblem
    memo: MutableMapping[bytes, Array]
    front: Front


def _together(study: Study, aims: Aims, found: list[_Found], missing: tuple[str, ...], progress: Progress) -> Optimisation:
    members = [one for own in found for one in _members(own, progress)]
    beside = [one for own in found for one in _alternatives(own, progress)]
    whole = Optimisation(study, aims, tuple(members), tuple(beside), missing)
    best = is_best(whole.objectives(whole.members))
    kept_members = [one for one, is_on in zip(members, best, strict=True) if is_on]
    others = [one for one, is_on in zip(members, best, strict=True) if not is_on]
    again = [one for own in found for one in _again(own, [m for m in kept_members if m.place == own.problem.place], progress)]
    order = np.argsort(whole.objectives(tuple(again))[:, 0], kind="stable")
    return Optimisation(study, aims, tuple(again[k] for k in order), (*others, *beside), missing)


def _members(found: _Found, progress: Progress) -> list[Member]:
    problem, front = found.problem, found.front
    progress(problem.study.names[problem.place], "all quantities", 0, len(front.designs), len(front.designs))
    greatest = remembered(found.memo, b"rows", front.designs, partial(_greatest, problem))
    bounds = [_ends(problem.study, problem.place, own) for own in front.bounds]
    parts = zip(front.designs, _values(found, front.designs), front.is_polished.tolist(), greatest, bounds, strict=True)
    none = np.zeros(0)
    return [
        Member(problem.place, design, values, is_polished, _active(problem, rows), ends, none, np.nan)
        for design, values, is_polished, rows, ends in parts
    ]


def _ends(study: Study, place: int, bounds: tuple[Bound, ...]) -> tuple[str, ...]:
    """In words; those of variables that a machine has no number of hold nothing."""
    has = {variable.name for variable in study.variables if variable.acts_on(place)}
    return tuple(f"{one.variable} at its {'greatest' if one.is_high else 'least'}" for one in bounds if one.variable in has)


def _greatest(problem: MachineProblem, designs: Array) -> Array:
    """(n, m + k) objectives and limits by the model, which knows how near a check point is to being out of reach."""
    found = np.full((len(designs), len(problem.aims.all)), -np.inf)
    for own, design in zip(found, designs, strict=True):
        model = problem.model(design)
        np.maximum.at(own, model.owner, model.rows(design))
    return found


def _active(problem: MachineProblem, greatest: Array) -> tuple[str, ...]:
    """Limits that hold a design."""
    own = greatest[len(problem.aims.goals) :]
    return tuple(limit.words for limit, row in zip(problem.aims.limits, own, strict=True) if row >= -HELD)


def _alternatives(found: _Found, progress: Progress) -> list[Member]:
    problem, designs = found.problem, found.front.alternatives
    if not len(designs):
        return []
    progress(problem.study.names[problem.place], "all quantities", 0, len(designs), len(found.front.designs))
    rows = zip(designs, _values(found, designs), strict=True)
    return [Member(problem.place, *row, False, (), (), np.zeros(0), np.nan) for row in rows]


def _values(found: _Found, designs: Array) -> Array:
    problem = found.problem
    return remembered(found.memo, b"values", designs, lambda new: Evaluation(problem.single)(new).values)


def _again(found: _Found, members: list[Member], progress: Progress) -> list[Member]:
    """Members of one of the machines, with what other ways say of them."""
    if not members:
        return []
    problem = found.problem
    name = problem.study.names[problem.place]

    def work_out(designs: Array) -> Array:
        count = len(designs)
        looked = checked(problem.study, problem.place, designs, lambda done: progress(name, "check", done, count, len(members)))
        return np.column_stack([looked.values, looked.structural])

    rows = remembered(found.memo, b"again", np.array([one.design for one in members]), work_out)
    return [one._replace(again=row[:-1], structural=float(row[-1])) for one, row in zip(members, rows, strict=True)]
