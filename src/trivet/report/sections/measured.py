"""Measured responses beside computed ones."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass

from trivet.measure.files.by_suffix import read_functions
from trivet.measure.functions import Functions
from trivet.measure.machine.setup import Setup, placed, read_setup
from trivet.measure.modal.fitted import FittedModes, read_fitted
from trivet.report.document import Block, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, picture, repeat, told
from trivet.study.correlate import check_measured

_INTRODUCTION = (
    "Measured responses over those that the machine would give at the same points. FRAC and FAAC say how alike two curves are, "
    "in shape and in size too, MAC how alike two mode shapes are: 1 is the same, 0 nothing in common."
)


@dataclass(frozen=True)
class Measurement:
    """What was measured, and where on the machine."""

    file: str
    setup_file: str
    fit_file: str | None
    functions: Functions
    setup: Setup
    fit: FittedModes | None

    @classmethod
    def read(
        cls, measured: str | os.PathLike[str], setup: str | os.PathLike[str], fit: str | os.PathLike[str] | None
    ) -> Measurement:
        """From its files; raises InputError where they say nothing that can be used."""
        names = os.fspath(measured), os.fspath(setup), None if fit is None else os.fspath(fit)
        fitted = None if names[2] is None else read_fitted(names[2])
        return cls(*names, read_functions(names[0]), read_setup(names[1]), fitted)

    def check(self, subject: Subject) -> None:
        """Refuse, before the work, functions, a set-up or a fit that do not go with a machine."""
        check_measured(self.functions)
        placed(subject.machine, self.setup, self.functions)
        if self.fit is not None:
            self.fit.among(self.functions, float(subject.machine.characteristic_length))

    @property
    def files(self) -> tuple[str, ...]:
        """All of them."""
        return tuple(name for name in (self.file, self.setup_file, self.fit_file) if name is not None)


def section(subject: Subject, measurement: Measurement) -> Section:
    """How alike they are."""
    fit = () if measurement.fit_file is None else ("--fit", measurement.fit_file)
    options = ("--setup", measurement.setup_file, *fit, "--figure", "overlay.png", "--setup-figure", "points.png")
    command = subject.command("measure correlate", *options, before=measurement.file, model=True, mode=False)
    blocks = attempt(lambda: _blocks(subject, measurement))
    return Section("Measured and computed", (Words(_INTRODUCTION), *blocks, repeat(command)))


def _blocks(subject: Subject, measurement: Measurement) -> Iterator[Block]:
    from trivet.study.correlate import MappedPoints, ShownCorrelation, correlate
    from trivet.views import correlation as view

    found = correlate(subject.machine, measurement.setup, measurement.functions, measurement.fit)
    caption = "Measured and computed responses: those that respond most, and how alike all are over frequency."
    yield picture(found, caption, f"Measured responses over those computed for {subject.name}.")
    points = MappedPoints(found.placed, measurement.functions)
    yield picture(points, "Where it was measured, and along what.", f"The measured points on {subject.name}.")
    yield from told(view.tables(ShownCorrelation(found)))
