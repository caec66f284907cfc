"""Functions of universal files put together: on one axis, with coherence, positions and what the user should know."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError
from trivet.measure.checking import check_functions
from trivet.measure.functions import Channel, Functions
from trivet.measure.universal.axis import first_difference
from trivet.measure.universal.modes import MeasuredMode
from trivet.measure.universal.scan import Block
from trivet.measure.universal.units import Unit

RESPONSE, COHERENCE = 4, 6
"""Types of functions that are read."""


class Unused(NamedTuple):
    """A dataset that was passed over."""

    path: str
    number: int
    """In its file, from 1."""
    kind: int
    """Type of the dataset."""
    what: str


@dataclass(frozen=True)
class Imported:
    """What universal files hold."""

    functions: Functions
    units: tuple[str, ...] = ()
    """(q,) of each function as its file has it: "g per N"."""
    modes: tuple[MeasuredMode, ...] = ()
    remarks: tuple[str, ...] = ()
    """What the user should know of the files."""
    unused: tuple[Unused, ...] = ()
    least_coherence: float | None = None
    """Below which a line is in doubt."""

    @property
    def doubtful(self) -> np.ndarray:
        """(q, n) whether the coherence of a line is below the least one; False where there is none."""
        if self.least_coherence is None or self.functions.coherence is None:
            return np.zeros(self.functions.values.shape, dtype=bool)
        with np.errstate(invalid="ignore"):
            found: np.ndarray = self.functions.coherence < self.least_coherence
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know: remarks, and where coherence is low."""
        counts = self.doubtful.sum(axis=1)
        if not counts.any():
            return self.remarks
        worst = sorted(np.flatnonzero(counts).tolist(), key=lambda k: -counts[k])
        listed = few([f"{self.functions.labels[k]} ({counts[k]})" for k in worst], "function", "functions")
        lines = f"coherence is below {self.least_coherence:g} at {counts.sum()} lines of {listed}; these lines are in doubt"
        return (*self.remarks, lines)


class Measured(NamedTuple):
    """A function of a file."""

    block: Block
    frequency: np.ndarray
    """(n,) Hz"""
    values: np.ndarray
    """(n,) SI"""
    unit: Unit
    response: Channel
    reference: Channel
    codes: tuple[object, ...]
    """Names, numbers and directions of both ends as they stand in the file."""


class Coherence(NamedTuple):
    """A coherence of a file."""

    block: Block
    frequency: np.ndarray
    values: np.ndarray
    codes: tuple[object, ...]


@dataclass
class Found:
    """What is collected over files."""

    functions: list[Measured] = field(default_factory=list)
    coherences: list[Coherence] = field(default_factory=list)
    modes: list[MeasuredMode] = field(default_factory=list)
    unused: list[Unused] = field(default_factory=list)
    points: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    sources: list[str] = field(default_factory=list)


def joined(found: Found, least: float | None) -> Imported:
    """All functions on one axis."""
    first = found.functions[0]
    kept: list[Measured | Coherence] = [*found.functions, *found.coherences]
    for one in kept[1:]:
        apart = first_difference(first.frequency, one.frequency)
        if apart is not None:
            raise InputError(
                f"{first.block.title} and {one.block.title} are on different frequencies: {apart}; give them apart"
            )
    notes = _repeated(found.functions)
    coherence = _coherence(found, notes)
    used = dict.fromkeys(end.point for one in found.functions for end in (one.response, one.reference))
    nowhere = [point for point in used if point not in found.points]
    if nowhere:
        notes.append(f"no position is given of {few(nowhere, 'point', 'points')}")
    functions = Functions(
        first.frequency,
        np.array([one.values for one in found.functions]),
        tuple(one.unit.motion for one in found.functions),
        tuple(one.response for one in found.functions),
        tuple(one.reference for one in found.functions),
        found.points,
        coherence,
        "; ".join(found.sources),
    )
    check_functions(functions, ", ".join(dict.fromkeys(one.block.path for one in found.functions)))
    units = tuple(one.unit.words for one in found.functions)
    return Imported(functions, units, tuple(found.modes), tuple(notes), tuple(found.unused), least)


def few(names: list[str], one: str, many: str) -> str:
    """The first of some names, and how many there are."""
    listed = ", ".join(names[:6]) + (", …" if len(names) > 6 else "")
    return f"{one} {listed}" if len(names) == 1 else f"{len(names)} {many}: {listed}"


def _repeated(functions: list[Measured]) -> list[str]:
    """What is said of pairs that were measured more than once."""
    seen: dict[tuple[object, ...], Block] = {}
    notes = []
    for one in functions:
        before = seen.setdefault((one.response, one.reference, one.unit.motion), one.block)
        if before is not one.block:
            pair = f"{one.response} / {one.reference}"
            notes.append(f"{pair} is measured twice: {before.title} and {one.block.title}; both are kept")
    return notes


def _coherence(found: Found, notes: list[str]) -> np.ndarray | None:
    """(q, n) coherence of the functions: the first of a pair of degrees of freedom goes with its first function, and so on."""
    waiting: dict[tuple[object, ...], list[Coherence]] = {}
    for one in found.coherences:
        waiting.setdefault(one.codes, []).append(one)
    if not waiting:
        return None
    rows = np.full((len(found.functions), len(found.functions[0].frequency)), np.nan)
    for row, function_ in zip(rows, found.functions, strict=True):
        own = waiting.get(function_.codes)
        if own:
            row[:] = own.pop(0).values
    for left in waiting.values():
        for one in left:
            found.unused.append(Unused(one.block.path, one.block.number, 58, "coherence of no function"))
    without = [
        f"{one.response} / {one.reference}" for one, row in zip(found.functions, rows, strict=True) if np.isnan(row).all()
    ]
    if without:
        notes.append(f"no coherence is given of {few(without, 'function', 'functions')}")
    return rows
