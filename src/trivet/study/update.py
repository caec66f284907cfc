"""A machine corrected by measurements: its numbers before and after, how sure they are, and what still differs."""

from __future__ import annotations

import dataclasses
import datetime
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import jax
import numpy as np

from trivet.errors import InputError, nearest
from trivet.measure import correlation as alike
from trivet.measure.correction.identifiability import NextPoint, Told, next_points, told
from trivet.measure.correction.terms import Problem
from trivet.measure.correction.updating import Updated, updated
from trivet.measure.functions import Functions
from trivet.measure.machine.modes import ModelModes, modes_of
from trivet.measure.machine.parameters import Free, parameters
from trivet.measure.machine.predicted import Receptances, predicted
from trivet.measure.machine.setup import Placed, Setup, placed
from trivet.measure.modal.fitted import FittedModes
from trivet.model import Machine
from trivet.model.machine import Note
from trivet.model.paths import join, leaves
from trivet.model.quantity import Quantity
from trivet.model.writing import document_of
from trivet.study.correlate import check_measured
from trivet.study.machines import MachineLike, choose
from trivet.vibration.damping import check_loss_factor

DIGITS = 1e-2
"""Numbers are written to so much of their standard deviation."""
OCTAVE = 2.0
CORRECTED = "-corrected"
"""How the name of a corrected machine ends."""
UNEXPLAINED = 0.3
"""Scatter of ln|H| from which the model does not explain what was measured."""
SURPRISING = 3.0
"""Standard deviations of what was known beforehand beyond which a number surprises."""
LEAST_LINES = 10
"""Frequencies of a range at the least."""


@dataclass(frozen=True)
class Compared:
    """Some functions as measured, and as the machine gives them before and after."""

    measured: Functions
    before: Functions
    after: Functions

    @cached_property
    def frac(self) -> tuple[np.ndarray, np.ndarray]:
        """(q,) and (q,): likeness of the shape over frequency, in the motion that was measured, before and after."""
        return self._of(alike.frac)

    @cached_property
    def faac(self) -> tuple[np.ndarray, np.ndarray]:
        """(q,) and (q,): the same with the size."""
        return self._of(alike.faac)

    def _of(self, criterion: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        return criterion(self.measured.values, self.before.values), criterion(self.measured.values, self.after.values)


@dataclass(frozen=True)
class Update:
    """Numbers of a machine, corrected."""

    problem: Problem
    found: Updated
    fitted: Compared
    """The functions to which the numbers were fitted."""
    held: Compared | None
    """Those which the fit did not see."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Key paths of the numbers that were free."""
        return self.problem.free.paths

    @property
    def before(self) -> np.ndarray:
        """(p,) SI."""
        return self.problem.free.start

    @cached_property
    def after(self) -> np.ndarray:
        """(p,) SI."""
        return np.asarray(self.problem.free.values(self.found.theta))

    @cached_property
    def covariance(self) -> np.ndarray:
        """(p, p) of theta."""
        return self.found.covariance(self.problem.free)

    @cached_property
    def deviation(self) -> np.ndarray:
        """(p,) standard deviations, SI; to first order."""
        return self.told.deviation * self.problem.free.scale(self.after)

    @cached_property
    def told(self) -> Told:
        """What the measurements tell of the numbers."""
        return told(self.problem.free, self.found.information, self.covariance)

    @cached_property
    def next_points(self) -> list[NextPoint]:
        """What to measure next, the most telling place first."""
        return next_points(self.problem, self.found)

    @cached_property
    def machine(self) -> Machine:
        """The machine with the corrected numbers, its notes telling their history."""
        return _with_history(self)

    @property
    def loss_factor(self) -> float:
        """That of the analysis, corrected where it was free."""
        return self.problem.at(self.found.theta)[1]

    @property
    def is_explained(self) -> bool:
        """Whether the corrected model answers as was measured, but for a scatter that a model of beams has."""
        return self.found.spread <= UNEXPLAINED

    @cached_property
    def surprises(self) -> list[tuple[str, float]]:
        """Numbers that went farther than was thought possible beforehand: standard deviations, with their sign."""
        free = self.problem.free
        ways = (self.found.theta - free.theta(free.start)) / free.spread
        return [(path, float(way)) for path, way in zip(free.paths, ways, strict=True) if abs(way) > SURPRISING]

    @cached_property
    def modes(self) -> tuple[ModelModes, ModelModes] | None:
        """Those of the measured poles, before and after; None where no poles were given."""
        poles = self.problem.poles
        if poles is None:
            return None
        start = self.problem.free.theta(self.before)
        found = []
        for theta in (start, self.found.theta):
            modes = modes_of(self.problem.placed, *self.problem.at(theta), float(poles.modes.frequency.max()), poles.channels)
            order = alike.assigned(poles.modes, modes.as_set)[1]
            own = modes.frequency[order], modes.damping[order], modes.vectors[:, order], modes.shapes[:, order]
            found.append(ModelModes(modes.elements, *own))
        return found[0], found[1]


def update(
    machine: MachineLike,
    setup: Setup,
    functions: Functions,
    free: Sequence[Free],
    *,
    fit: FittedModes | None = None,
    low: float | None = None,
    high: float | None = None,
    hold: Sequence[str] = (),
    loss_factor: float = 0.02,
    progress: Callable[[int], None] = lambda count: None,
) -> Update:
    """Correct numbers of a machine by measured responses, and by measured poles.

    Args:
        machine: the machine, a name, or a file.
        setup: where the measured points lie on it.
        functions: what was measured.
        free: which numbers may change, and what is known of them beforehand.
        fit: modes fitted to the same functions; what is held back should have had no part in them.
        low, high: range of frequencies, Hz; all that were measured when not given.
        hold: points whose functions are compared only, not fitted.
        loss_factor: of all that has none of its own; where "loss_factor" is free, its value beforehand.
        progress: called with the number of steps of the search.

    Raises:
        InputError: for what the machine, the set-up or the measurement does not have.
        NoResultError: the machine does not stand where it was measured, or the search comes to no end.
    """
    check_loss_factor(loss_factor)
    check_measured(functions)
    chosen = choose(machine)
    inside = _inside(functions.averaged(), low, high)
    seen, held = _divided(inside, hold)
    where = placed(chosen, setup, inside)
    known = parameters(chosen, free, loss_factor)
    length = float(chosen.characteristic_length)
    poles = None if fit is None else fit.among(seen, length)
    problem = Problem(where, seen, known, poles, loss_factor, Receptances.of(where, seen))
    if poles is not None:
        _check_poles(problem, poles)
    found = updated(problem, progress)
    others = None if held is None else _compared(problem, found, where, held)
    return Update(problem, found, _compared(problem, found, where, seen), others)


def _check_poles(problem: Problem, poles: FittedModes) -> None:
    """Refuse poles that no mode of the machine is near: they are those of another test, or the numbers are far off."""
    found = modes_of(problem.placed, problem.machine, problem.loss_factor, float(poles.modes.frequency.max()), poles.channels)
    for measured, own in zip(poles.modes.frequency, found.frequency[alike.assigned(poles.modes, found.as_set)[1]], strict=True):
        if not 1 / OCTAVE < own / measured < OCTAVE:
            raise InputError(
                f"fit: the pole at {measured:.5g} Hz would be the machine's mode at {own:.5g} Hz, more than an octave away; "
                "give the fit of this measurement, or first set numbers of the machine (--set) nearer to the truth"
            )


def _inside(functions: Functions, low: float | None, high: float | None) -> Functions:
    """The functions within a range, without zero frequency: there nothing moves but displacement."""
    first = float(functions.frequency[functions.frequency > 0][0])
    ends = first if low is None else max(low, first), float(functions.frequency[-1]) if high is None else high
    inside = functions.between(*ends)
    if len(inside.frequency) < LEAST_LINES:
        raise InputError(
            f"frequencies: {len(inside.frequency)} lines from {ends[0]:g} to {ends[1]:g} Hz; measured were "
            f"{functions.frequency[0]:g} to {functions.frequency[-1]:g} Hz; expected {LEAST_LINES} lines at least"
        )
    return inside


def _divided(functions: Functions, hold: Sequence[str]) -> tuple[Functions, Functions | None]:
    """Functions of points that are seen by the fit, and of those that are held back."""
    known = {channel.point for channel in (*functions.responses, *functions.references)}
    for point in hold:
        if point not in known:
            raise InputError(f"hold: no function has the point {point}{nearest(point, known)}")
    ends = list(zip(functions.responses, functions.references, strict=True))
    kept = [k for k, (a, b) in enumerate(ends) if a.point not in hold and b.point not in hold]
    if not kept:
        raise InputError("hold: all functions are held back; leave some points to the fit")
    others = [k for k in range(len(functions)) if k not in kept]
    return functions.only(kept), functions.only(others) if others else None


def _compared(problem: Problem, found: Updated, where: Placed, functions: Functions) -> Compared:
    machine, loss = problem.at(found.theta)
    after = dataclasses.replace(where, machine=machine)
    return Compared(functions, predicted(where, functions, problem.loss_factor), predicted(after, functions, loss))


def _with_history(result: Update) -> Machine:
    """The corrected machine, its numbers as long as they are sure, with a note at each and a line in the description."""
    free, problem = result.problem.free, result.problem
    rounded = [_rounded(*one) for one in zip(free.kinds, result.after, result.deviation, strict=True)]
    machine, loss = free.applied(problem.machine, problem.loss_factor, free.theta(rounded))
    machine = _in_numbers(machine)
    today, source = datetime.date.today().isoformat(), result.fitted.measured.source or "measured responses"
    document = document_of(machine)
    places = {join(document, keys) for keys in leaves(document)}
    notes = {note.path: note for note in machine.about.notes}
    for path, leaf, kind, deviation, start in zip(
        free.paths, free.leaves, free.kinds, result.deviation, free.start, strict=True
    ):
        if leaf is None:
            continue
        words = f"{source}: ± {_in_unit(kind, deviation)}, was {kind.write(float(start))}; trivet measure update, {today}"
        own = path if path in places else path.rpartition(".")[0]
        notes[own] = Note(own, words, "fitted")
    told_loss = f"; loss factor of the analysis {float(loss):.4g}" if None in free.leaves else ""
    line = f"Corrected on {today} by {source}: {', '.join(free.paths)}{told_loss}."
    about = dataclasses.replace(
        machine.about,
        name=machine.name if machine.name.endswith(CORRECTED) else machine.name + CORRECTED,
        description=f"{machine.about.description} {line}".strip(),
        notes=tuple(sorted(notes.values(), key=lambda note: note.path)),
        published=(),
        published_dynamic=(),
    )
    return dataclasses.replace(machine, about=about)


def _rounded(kind: Quantity, value: float, deviation: float) -> float:
    """A number with so many digits in its unit as its standard deviation deserves."""
    unit = kind.parse(f"1 {kind.written}") if kind.si else 1.0
    digits = -math.floor(math.log10(DIGITS * deviation / unit))
    short = round(float(value) / unit, digits)
    return kind.parse(f"{short:.{max(digits, 0)}f} {kind.written}".strip())


def _in_numbers(machine: Machine) -> Machine:
    numbers: Machine = jax.tree.map(float, machine)
    return numbers


def _in_unit(kind: Quantity, value: float) -> str:
    return str(kind.write(float(f"{value:.2g}")))
