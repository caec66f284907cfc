"""Measured frequency responses in SI, with the points and directions at which they were measured.

Axes are those of the measurement until `measure.machine.setup` says where they lie in {O}.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np

from trivet.errors import InputError

Motion = Literal["displacement", "velocity", "acceleration"]
MOTIONS: tuple[Motion, ...] = ("displacement", "velocity", "acceleration")
"""What a sensor gives; the number of derivatives of displacement is the place in this list."""


class Channel(NamedTuple):
    """A sensor or an exciter: a point, and a direction there."""

    point: str
    """Name or number of the point."""
    direction: tuple[float, float, float]
    """Unit vector in the axes of the measurement."""
    is_rotation: bool = False
    """Whether it turns about the direction, or is a moment, rather than moves along it."""

    def __str__(self) -> str:
        """As people write it: "12:+z", "3:-rx"; oblique directions by their components."""
        size = [abs(c) for c in self.direction]
        axis = size.index(max(size))
        turn = "r" if self.is_rotation else ""
        if size[axis] > 1 - 1e-9:
            return f"{self.point}:{'+' if self.direction[axis] > 0 else '-'}{turn}{'xyz'[axis]}"
        return f"{self.point}:{turn}({', '.join(f'{c:.4g}' for c in self.direction)})"


@dataclass(frozen=True)
class Functions:
    """q frequency response functions over one set of n frequencies, exp(+i omega t)."""

    frequency: np.ndarray
    """(n,) Hz, rising, 0 or more."""
    values: np.ndarray
    """(q, n) complex: the motion as measured per load, SI (m, m/s or m/s^2 per N; rad for m, N m for N where rotations are)."""
    motions: tuple[Motion, ...]
    """(q,) what the response of each is."""
    responses: tuple[Channel, ...]
    """(q,)"""
    references: tuple[Channel, ...]
    """(q,) where the load is."""
    points: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    """Positions of the points that have one, m, in the axes of the measurement."""
    coherence: np.ndarray | None = None
    """(q, n), NaN where there is none."""
    source: str = ""
    """Where it all comes from: file names, title, date."""

    def __len__(self) -> int:
        return len(self.values)

    @property
    def omega(self) -> np.ndarray:
        """(n,) rad/s."""
        return 2 * math.pi * self.frequency

    @property
    def orders(self) -> np.ndarray:
        """(q,) derivatives of displacement: 0, 1 or 2."""
        return np.array([MOTIONS.index(motion) for motion in self.motions], dtype=int)

    @property
    def receptance(self) -> np.ndarray:
        """(q, n) displacement per load; NaN at zero frequency where something else was measured."""
        with np.errstate(divide="ignore", invalid="ignore"):
            found: np.ndarray = self.values / (1j * self.omega) ** self.orders[:, None]
        return np.where(np.isfinite(found), found, np.nan)

    @property
    def labels(self) -> list[str]:
        """(q,) response / reference, as in "12:+z / 3:-x"."""
        return [f"{a} / {b}" for a, b in zip(self.responses, self.references, strict=True)]

    def only(self, which: Iterable[int]) -> Functions:
        """Some of the functions, by number."""
        kept = list(which)
        return replace(
            self,
            values=self.values[kept],
            motions=tuple(self.motions[k] for k in kept),
            responses=tuple(self.responses[k] for k in kept),
            references=tuple(self.references[k] for k in kept),
            coherence=None if self.coherence is None else self.coherence[kept],
        )

    def between(self, low: float, high: float) -> Functions:
        """At the frequencies of a range (Hz), ends included.

        Raises:
            InputError: for a range that ends before it begins.
        """
        if not low <= high:
            raise InputError(f"frequencies from {low:g} Hz to {high:g} Hz: the range ends before it begins")
        inside = (self.frequency >= low) & (self.frequency <= high)
        return replace(
            self,
            frequency=self.frequency[inside],
            values=self.values[:, inside],
            coherence=None if self.coherence is None else self.coherence[:, inside],
        )

    @property
    def alike(self) -> list[list[int]]:
        """Numbers of the functions of one response, reference and motion each, in the order of their first appearance."""
        found: dict[tuple[Channel, Channel, Motion], list[int]] = {}
        for k, key in enumerate(zip(self.responses, self.references, self.motions, strict=True)):
            found.setdefault(key, []).append(k)
        return list(found.values())

    def averaged(self) -> Functions:
        """Every function once: of those that were measured several times the mean, as if all had been one measurement.

        With loads of one spectrum the H1 estimate over all is the mean of the single ones, H = mean H_k, and its coherence
        |H|^2 / mean(|H_k|^2 / coherence_k), which is low where they differ; unknown where one of them has none.
        """
        groups = self.alike
        if len(groups) == len(self):
            return self
        mean = np.array([self.values[own].mean(axis=0) for own in groups])
        first = self.only(own[0] for own in groups)
        if self.coherence is None:
            return replace(first, values=mean)
        coherence = np.array(first.coherence)
        for row, value, own in zip(coherence, mean, groups, strict=True):
            if len(own) > 1:
                with np.errstate(divide="ignore", invalid="ignore"):
                    row[:] = np.abs(value) ** 2 / np.mean(np.abs(self.values[own]) ** 2 / self.coherence[own], axis=0)
        return replace(first, values=mean, coherence=coherence)

    def matrix(self) -> tuple[np.ndarray, tuple[Channel, ...], tuple[Channel, ...]]:
        """(o, i, n) as measured, of o responses to i references, in the order of their first appearance; NaN where none was.

        Of functions that were measured several times it holds the mean.

        Raises:
            InputError: for a pair that was measured as several motions, of which one is to be left out.
        """
        once = self.averaged()
        outputs, inputs = tuple(dict.fromkeys(once.responses)), tuple(dict.fromkeys(once.references))
        whole = np.full((len(outputs), len(inputs), len(once.frequency)), np.nan, dtype=complex)
        for k, (response, reference) in enumerate(zip(once.responses, once.references, strict=True)):
            place = outputs.index(response), inputs.index(reference)
            if not np.isnan(whole[place]).all():
                raise InputError(
                    f"{once.labels[k]} was measured as several motions, {once.motions[k]} among them; leave out all but one"
                )
            whole[place] = once.values[k]
        return whole, outputs, inputs
