"""What files of measured responses hold, file by file and together, with what the user should know of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from trivet.measure.functions import Channel, Functions, Motion

LISTED = 6
"""Names in a message, at most."""


class Measured(NamedTuple):
    """A function of a file."""

    title: str
    """Where it stands: "a.unv: dataset 3 (type 58, line 41)"."""
    frequency: np.ndarray
    """(n,) Hz"""
    values: np.ndarray
    """(n,) complex, SI"""
    motion: Motion
    response: Channel
    reference: Channel
    unit: str
    """As the file has it: "g per N"."""
    coherence: np.ndarray | None = None
    """(n,)"""


@dataclass(frozen=True)
class MeasuredMode:
    """A mode that another program identified."""

    pole: complex
    """rad/s, with a positive imaginary part where it oscillates."""
    points: tuple[str, ...]
    """(p,)"""
    shape: np.ndarray
    """(p, 3) complex: translations in the axes of the measurement, of any size; (p, 6) with rotations."""
    title: str = ""

    @property
    def frequency(self) -> float:
        """Hz, |pole| / 2 pi."""
        return abs(self.pole) / (2 * math.pi)

    @property
    def damping(self) -> float:
        """Ratio, -Re pole / |pole|; zero at rest."""
        return -self.pole.real / abs(self.pole) if self.pole else 0.0


class Unused(NamedTuple):
    """A dataset that was passed over."""

    path: str
    number: int
    """In its file, from 1."""
    kind: int
    """Type of the dataset."""
    what: str


@dataclass(frozen=True)
class Content:
    """What one file holds."""

    path: str
    functions: Sequence[Measured]
    points: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    """m, in the axes of the measurement."""
    source: str = ""
    modes: tuple[MeasuredMode, ...] = ()
    unused: tuple[Unused, ...] = ()

    @classmethod
    def of(cls, path: str, functions: Functions, units: Sequence[str]) -> Content:
        """Of a file that has one set of functions."""
        coherence = [None] * len(functions) if functions.coherence is None else functions.coherence
        ends = functions.motions, functions.responses, functions.references
        rows = enumerate(zip(functions.values, *ends, units, coherence, strict=True), 1)
        measured = [Measured(f"{path}: function {k}", functions.frequency, *row) for k, row in rows]
        return cls(path, measured, functions.points, functions.source)


@dataclass(frozen=True)
class Imported:
    """What files of measured responses hold together."""

    functions: Functions
    """Every function once."""
    units: tuple[str, ...] = ()
    """(q,) of each function as its file has it: "g per N"."""
    modes: tuple[MeasuredMode, ...] = ()
    remarks: tuple[str, ...] = ()
    """What was done to the functions."""
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
        """What the user should know."""
        return (*self.remarks, *self._without_coherence(), *self._without_position(), *self._in_doubt())

    def _without_coherence(self) -> list[str]:
        coherence = self.functions.coherence
        if coherence is None:
            return []
        labels = np.array(self.functions.labels)[np.isnan(coherence).all(axis=1)].tolist()
        return [f"no coherence is given of {few(labels, 'function', 'functions')}"] if labels else []

    def _without_position(self) -> list[str]:
        used = dict.fromkeys(end.point for end in (*self.functions.responses, *self.functions.references))
        nowhere = [point for point in used if point not in self.functions.points]
        return [f"no position is given of {few(nowhere, 'point', 'points')}"] if nowhere else []

    def _in_doubt(self) -> list[str]:
        counts = self.doubtful.sum(axis=1)
        if not counts.any():
            return []
        worst = sorted(np.flatnonzero(counts).tolist(), key=lambda k: -counts[k])
        listed = few([f"{self.functions.labels[k]} ({counts[k]})" for k in worst], "function", "functions")
        lines = f"coherence is below {self.least_coherence:g} at {counts.sum()} lines of {listed}"
        return [f"{lines}; these lines are in doubt"]


def few(names: Sequence[str], one: str, many: str) -> str:
    """The first of some names, and how many there are."""
    listed = ", ".join(names[:LISTED]) + (", …" if len(names) > LISTED else "")
    return f"{one} {listed}" if len(names) == 1 else f"{len(names)} {many}: {listed}"
