"""Measured responses beside those of a machine: how alike they are, function by function, over frequency, and mode by mode."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError, nearest
from trivet.measure import correlation as alike
from trivet.measure.correlation import ModeSet, Pair
from trivet.measure.functions import Channel, Functions
from trivet.measure.machine.modes import modes_of
from trivet.measure.machine.predicted import predicted
from trivet.measure.machine.setup import Placed, Setup, placed
from trivet.measure.modal.fitted import FittedModes
from trivet.study.machines import MachineLike, choose
from trivet.vibration.damping import check_loss_factor


@dataclass(frozen=True)
class ModesBeside:
    """Modes of a measurement and of a machine at the same channels."""

    channels: tuple[Channel, ...]
    """(o,)"""
    measured: ModeSet
    """Channels that turn count with the machine's characteristic length, m."""
    computed: ModeSet
    """Likewise."""

    @cached_property
    def pairs(self) -> list[Pair]:
        """Which are the same."""
        return alike.pairs(self.measured, self.computed)

    @cached_property
    def mac(self) -> np.ndarray:
        """(m, k) measured against computed, of modes that coincide that of the spaces which they span."""
        return alike.mac_of_spaces(self.measured, self.computed)

    @cached_property
    def comac(self) -> np.ndarray:
        """(o,) over the pairs."""
        return alike.comac(*alike.matched(self.measured, self.computed, self.pairs))


@dataclass(frozen=True)
class Correlation:
    """q measured functions beside computed ones at n frequencies; in SI."""

    placed: Placed
    """The machine as it stood, with the measured points on it."""
    measured: Functions
    computed: Functions
    """At the same channels and frequencies, in the same motions."""
    loss_factor: float
    """Of all parts of the machine that have none of their own."""
    modes: ModesBeside | None
    """None where no fitted modes were given."""

    @cached_property
    def frac(self) -> np.ndarray:
        """(q,) likeness of the shape over frequency, in the motion that was measured."""
        return alike.frac(self.measured.values, self.computed.values)

    @cached_property
    def faac(self) -> np.ndarray:
        """(q,) the same with the size."""
        return alike.faac(self.measured.values, self.computed.values)

    @cached_property
    def csac(self) -> np.ndarray:
        """(n,) likeness of all displacements per load at a frequency; NaN where there is none, as of accelerations at 0 Hz."""
        return alike.csac(*self._displacements)

    @cached_property
    def csf(self) -> np.ndarray:
        """(n,) the same with the size."""
        return alike.csf(*self._displacements)

    @cached_property
    def _displacements(self) -> tuple[np.ndarray, np.ndarray]:
        """Receptances (q, n) of one unit, m/N: angles times the machine's characteristic length, moments over it."""
        length = float(self.placed.machine.characteristic_length)
        turns = [(a.is_rotation, b.is_rotation) for a, b in zip(self.measured.responses, self.measured.references, strict=True)]
        factor = np.array([length ** (int(a) + int(b)) for a, b in turns])[:, None]
        return factor * self.measured.receptance, factor * self.computed.receptance

    def greatest(self, count: int) -> list[int]:
        """Numbers of the functions with the greatest measured displacements per load, in their order."""
        sizes = np.nansum(np.abs(self._displacements[0]) ** 2, axis=1)
        return sorted(np.argsort(-sizes, kind="stable")[:count].tolist())

    def numbers(self, labels: Sequence[str]) -> list[int]:
        """Numbers of functions by their labels, as in "12:+z / 3:-x"; blanks do not matter.

        Raises:
            InputError: for a label that is none of them.
        """
        known = {label.replace(" ", ""): k for k, label in enumerate(self.measured.labels)}
        found = []
        for label in labels:
            if label.replace(" ", "") not in known:
                raise InputError(f"function {label}: was not measured{nearest(label, self.measured.labels)}")
            found.append(known[label.replace(" ", "")])
        return found


class ShownCorrelation(NamedTuple):
    """A correlation and what is to be drawn of it."""

    whole: Correlation
    functions: tuple[int, ...] | None = None
    """Their numbers; those that respond most when not given."""


class MappedPoints(NamedTuple):
    """Measured points on their machine, to be drawn."""

    placed: Placed
    functions: Functions
    """Along which they were measured."""


def correlate(
    machine: MachineLike,
    setup: Setup,
    functions: Functions,
    fit: FittedModes | None = None,
    *,
    loss_factor: float = 0.02,
) -> Correlation:
    """Compare measured responses, and modes fitted to them, with what a machine would answer.

    Args:
        machine: its name in the catalogue, its file, or itself.
        setup: where the measured points lie on it, and how it stood.
        functions: as measured; cut them to the frequencies that count (`Functions.between`).
        fit: modes fitted to them.
        loss_factor: structural damping eta of all that has none of its own.

    Raises:
        InputError: for a point that the set-up does not place, no frequency above zero, or a fit at other channels.
        NoResultError: the pose of the set-up is not reached, or the machine moves there without resistance.
    """
    check_loss_factor(loss_factor)
    check_measured(functions)
    functions = functions.averaged()
    at = placed(choose(machine), setup, functions)
    beside = None if fit is None else _modes(at, functions, fit, loss_factor)
    return Correlation(at, functions, predicted(at, functions, loss_factor), loss_factor, beside)


def check_measured(functions: Functions) -> None:
    """Refuse functions of which none was measured where a machine moves."""
    if not len(functions) or not len(functions.frequency) or functions.frequency[-1] <= 0:
        raise InputError("measured functions: there are none at frequencies above zero; widen the range of frequencies")


def _modes(at: Placed, functions: Functions, fit: FittedModes, loss_factor: float) -> ModesBeside:
    """Fitted modes and those of the machine at the channels which fit and functions have in common."""
    own = fit.among(functions, float(at.machine.characteristic_length))
    found = modes_of(at, at.machine, loss_factor, float(own.modes.frequency.max()), own.channels)
    return ModesBeside(own.channels, own.modes, found.as_set)


class Distances(NamedTuple):
    """How far points were measured from where they lie on the machine, m."""

    greatest: float
    """NaN where no point has a position."""
    point: str
    """Which one it is."""
    unknown: int
    """Points without a position."""


def distances(at: Placed) -> Distances:
    """Over all measured points."""
    known = {site.point: site.distance for site in at.sites.values() if not math.isnan(site.distance)}
    farthest = max(known, key=lambda point: known[point], default="")
    return Distances(known.get(farthest, math.nan), farthest, len(at.sites) - len(known))
