"""A prototype's responses measured, computed and corrected: the method of the paper's section 5 and Fig 12.

The measurement is a stand-in: the same kind of beams, with other joints, and noise.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field

from trivet.model.section import STRICT
from trivet.reproduce.found import AS_DESCRIBED, Asked, Chart, Found, Ours, Progress, Series, rounded

if TYPE_CHECKING:
    from trivet.measure.functions import Functions
    from trivet.measure.machine.setup import Setup
    from trivet.model import Machine
    from trivet.study.correlate import Correlation
    from trivet.study.update import Update

CENTRE = "centre"
WAYS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
SHOWN = ("x", "z")
"""Axes of Fig 12."""


@dataclass(frozen=True)
class Standing:
    """How a prototype is taken to be."""

    __pydantic_config__ = STRICT

    spherical: str
    """Its ball joints."""
    loss_factor: Annotated[float, Field(gt=0, lt=1)]
    shear: bool = False
    """Whether its beams shear."""
    changes: dict[str, str] | None = None
    """What else differs from the machine file."""

    def machine(self, name: str) -> Machine:
        """The machine."""
        from trivet.study.machines import choose, switched

        return switched(choose(name, self.changes or {}), spherical=self.spherical, shear=self.shear)


@dataclass(frozen=True)
class Prototype:
    """A measurement of one prototype, the model beside it, and the model corrected."""

    __pydantic_config__ = STRICT

    kind: Literal["prototype"]
    model: Standing
    """What the model takes it to be."""
    truth: Standing
    """What it is: where the measurement comes from."""
    free: dict[str, float]
    """Numbers that the measurement corrects, and within which part of themselves they are known."""
    low: Annotated[float, Field(gt=0)] = 40.0
    high: Annotated[float, Field(gt=0)] = 1000.0
    """Frequencies that are measured, Hz."""
    lines: Annotated[int, Field(ge=10, le=10_000)] = 481
    noise: Annotated[float, Field(ge=0, le=1)] = 0.03
    """Root mean square of the noise, relative to the response at each frequency."""
    seed: int = 2014

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """Resonances and likeness, measured, as modelled and corrected; responses along x and z."""
        from trivet.measure.machine.parameters import Free
        from trivet.measure.machine.setup import Setup
        from trivet.study.correlate import correlate
        from trivet.study.update import update

        (name,) = machines
        setup, model = Setup(others="platform"), self.model.machine(name)
        measured = self._measured(self.truth.machine(name), setup)
        progress(1, 4)
        before = correlate(model, setup, measured, loss_factor=self.model.loss_factor)
        progress(2, 4)
        free = [Free(path, spread) for path, spread in self.free.items()]
        found = update(model, setup, measured, free, loss_factor=self.model.loss_factor)
        progress(3, 4)
        after = correlate(found.machine, setup, measured, loss_factor=found.loss_factor)
        progress(4, 4)
        cases = {"measured (stand-in)": measured, "model": before.computed, "model, corrected": after.computed}
        likeness = [*_likeness("model", before), *_likeness("model, corrected", after)]
        rows = [row for case, functions in cases.items() for row in _resonances(case, functions)]
        return Found((*rows, *likeness), tuple(_charts(cases)), self._numbers(name, found))

    def _measured(self, truth: Machine, setup: Setup) -> Functions:
        """What the prototype answers at the platform centre, with noise."""
        from trivet.measure.functions import Channel, Functions
        from trivet.measure.machine.predicted import predicted
        from trivet.measure.machine.setup import placed

        x, y, z = (float(c) for c in truth.home.position)
        frequency = np.linspace(self.low, self.high, self.lines)
        channels = tuple(Channel(CENTRE, way) for way in WAYS.values())
        none = np.zeros((len(WAYS), self.lines), dtype=complex)
        asked = Functions(
            frequency, none, ("displacement", "displacement", "displacement"), channels, channels, {CENTRE: (x, y, z)}
        )
        clean = predicted(placed(truth, setup, asked), asked, self.truth.loss_factor)
        error = np.random.default_rng(self.seed).normal(size=(2, *none.shape))
        noise = self.noise * (error[0] + 1j * error[1]) / np.sqrt(2)
        return dataclasses.replace(clean, values=clean.values * (1 + noise), source="a stand-in")

    def _numbers(self, name: str, found: Update) -> tuple[str, ...]:
        """What the correction makes of every number."""
        from trivet.measure.machine.parameters import look_up

        truth, told = self.truth.machine(name), []
        numbers = zip(found.paths, found.problem.free.kinds, found.before, found.after, found.deviation, strict=True)
        for path, kind, before, after, deviation in numbers:
            true = look_up(truth, path, self.truth.loss_factor).value
            corrected = f"{kind.number(after, 4)} ± {kind.number(deviation, 2)}"
            values = f"{kind.number(before, 4)} before, {corrected} after, {kind.number(true, 4)}"
            label = ", ".join(part for part in (path.rpartition("elements.")[2], kind.symbol) if part)
            told.append(f"{label}: {values} in the stand-in.")
        return tuple(told)


def _resonances(case: str, functions: Functions) -> list[Ours]:
    """Where the responses are greatest, and how great."""
    rows = []
    for axis, values in zip(WAYS, np.abs(functions.receptance), strict=True):
        if axis in SHOWN:
            at = int(np.argmax(values))
            rows.append(Ours(f"resonance along {axis}", case, AS_DESCRIBED, float(functions.frequency[at]), "Hz"))
            rows.append(Ours(f"peak along {axis}", case, AS_DESCRIBED, float(values[at]), "um/N"))
    return rows


def _likeness(case: str, result: Correlation) -> list[Ours]:
    """FRAC and FAAC against the measurement."""
    return [
        Ours(f"{criterion} along {axis}", case, AS_DESCRIBED, float(values[k]), "")
        for criterion, values in (("FRAC", result.frac), ("FAAC", result.faac))
        for k, axis in enumerate(WAYS)
        if axis in SHOWN
    ]


def _charts(cases: dict[str, Functions]) -> list[Chart]:
    charts = []
    for k, axis in enumerate(WAYS):
        if axis in SHOWN:
            series = [
                Series(case, rounded(own.frequency), rounded(1e6 * np.abs(own.receptance[k])), "points" if not n else "line")
                for n, (case, own) in enumerate(cases.items())
            ]
            charts.append(Chart("home", f"along {axis}", "frequency, Hz", "|H|, µm/N", series, "y"))
    return charts
