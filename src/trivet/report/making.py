"""A report of machines: which sections it has, and how they become a document."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial

from trivet.errors import InputError, nearest
from trivet.files import check_writable
from trivet.kinematics.mode import parse_mode
from trivet.report.document import Document, Section, Words, all_sections, check_suffix, write_document
from trivet.report.glance import glance
from trivet.report.provenance import provenance
from trivet.report.sections import (
    COMPARISON,
    MEASURED,
    OWN,
    SECTIONS,
    comparison,
    dynamics,
    file,
    home,
    machine,
    measured,
    reach,
    singularities,
    stiffness,
    vibration,
)
from trivet.report.sections.measured import Measurement
from trivet.report.subject import CheckPoints, Subject
from trivet.space.surface import hemisphere
from trivet.study.machines import MachineLike, choose

TELL: dict[str, Callable[[Subject], Section]] = {
    "machine": machine.section,
    "home": home.section,
    "reach": reach.section,
    "singularities": singularities.section,
    "stiffness": stiffness.section,
    "vibration": vibration.section,
    "dynamics": dynamics.section,
    "file": file.section,
}
"""What tells the sections of every machine."""

PYTHON = "trivet.write_report, in Python"

Progress = Callable[[str, int, int], None]
Tell = Callable[[str], None]


def write_report(
    machines: Sequence[MachineLike] | MachineLike,
    path: str | os.PathLike[str],
    *,
    sections: Iterable[str] | None = None,
    mode: str | None = None,
    steps: int = 10,
    radius: float | None = None,
    height: float | None = None,
    measured: str | os.PathLike[str] | None = None,
    setup: str | os.PathLike[str] | None = None,
    fit: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: Progress = lambda name, done, total: None,
) -> None:
    """Write a report of one or several machines into one file that needs neither Python nor a network.

    What cannot be told of a machine (a map without a hemisphere, say) is left out, with a sentence that says why.

    Args:
        machines: machines, names or files.
        path: .html is a page, .pdf the same printed by a browser of this computer.
        sections: some of `trivet.report.sections.SECTIONS`; all that there is to say when not given.
        mode: working mode of all machines; each machine's own when not given.
        steps: lattice steps of the check points from pole to rim.
        radius, height: of their hemisphere (m); each machine's own workpiece when not given.
        measured: file of measured responses to be set beside those of the machines.
        setup: file of the test set-up, with `measured`.
        fit: file of modes fitted to them, with `measured`.
        overwrite: whether the file may be replaced.
        progress: called with the machine, sections done, and of how many.

    Raises:
        InputError: for a machine, section, mode or file that cannot be used, before any long work.
        NoResultError: when there is no browser to print with.
    """
    listed = [machines] if isinstance(machines, (str, os.PathLike)) or not isinstance(machines, Sequence) else list(machines)
    points = CheckPoints(steps, radius, height)
    subjects = [subject_of(machine, mode=mode, points=points) for machine in listed]
    check_target(path, overwrite=overwrite)
    found = report_of(subjects, sections, measurement_of(measured, setup, fit), PYTHON, progress)
    write_document(found, path, overwrite=overwrite)


def subject_of(machine: MachineLike, *, mode: str | None = None, points: CheckPoints) -> Subject:
    """A machine, as commands would name it."""
    chosen = choose(machine)
    word = os.fspath(machine) if isinstance(machine, (str, os.PathLike)) else f"{chosen.name}.toml"
    return Subject(word, chosen, chosen, (), mode, points)


def measurement_of(
    measured: str | os.PathLike[str] | None, setup: str | os.PathLike[str] | None, fit: str | os.PathLike[str] | None
) -> Measurement | None:
    """What was measured; None where nothing was."""
    if measured is None:
        for name, value in (("setup", setup), ("fit", fit)):
            if value is not None:
                raise InputError(f"{name}: goes with measured responses, and none are given as measured")
        return None
    if setup is None:
        raise InputError("measured: where its points lie on the machine is said by a set-up; give a setup as well")
    return Measurement.read(measured, setup, fit)


def check_target(path: str | os.PathLike[str], *, overwrite: bool) -> None:
    """Refuse, before the work, a file that cannot be written: by its suffix or its place, or without a browser for a PDF."""
    from trivet.report.printing import find_browser

    if check_suffix(path) == ".pdf":
        find_browser()
    check_writable(path, overwrite=overwrite)


def report_of(
    subjects: Sequence[Subject],
    sections: Iterable[str] | None = None,
    measurement: Measurement | None = None,
    command: str = PYTHON,
    progress: Progress = lambda name, done, total: None,
    tell: Tell = lambda words: None,
) -> Document:
    """The document of a report; see `write_report`. `tell` is called with a line for every section that is done."""
    chosen = _chosen(sections, subjects, measurement)
    _check(subjects, measurement if MEASURED in chosen else None)
    own = [_of_one(subject, chosen, measurement, progress, tell) for subject in subjects]
    parts = [glance(subjects, chosen)]
    if COMPARISON in chosen:
        parts.append(_timed(COMPARISON, lambda: comparison.section(subjects), tell))
    if len(subjects) == 1:
        parts += own[0]
    else:
        parts += [Section(subject.name, (), tuple(found)) for subject, found in zip(subjects, own, strict=True)]
    names = _listed([subject.name for subject in subjects])
    files = measurement.files if measurement is not None and MEASURED in chosen else ()
    return Document(f"Report on {names}", _lead(subjects), tuple(parts), provenance(subjects, files, command))


def _chosen(sections: Iterable[str] | None, subjects: Sequence[Subject], measurement: Measurement | None) -> tuple[str, ...]:
    """Sections in their order."""
    if sections is not None:
        wanted = tuple(sections)
        if not wanted:
            raise InputError(
                f"sections: none is named; choose from {', '.join(SECTIONS)}, or leave sections out to be told all"
            )
        for name in wanted:
            if name not in SECTIONS:
                raise InputError(f"section '{name}' is not known{nearest(name, SECTIONS)}")
        if MEASURED in wanted and measurement is None:
            raise InputError("section 'measured': is about measured responses; give them as measured, and their setup")
        return tuple(name for name in SECTIONS if name in wanted)
    beside = len(subjects) > 1 or any(map(comparison.is_published, subjects))
    idle = {COMPARISON: not beside, MEASURED: measurement is None}
    return tuple(name for name in SECTIONS if not idle.get(name))


def _check(subjects: Sequence[Subject], measurement: Measurement | None) -> None:
    """Refuse what would be found wrong only after minutes."""
    names = [subject.name for subject in subjects]
    if not names:
        raise InputError("machines: none is given; a report is about one or several")
    for subject in subjects:
        points = subject.points
        hemisphere(points.height or 0.0, 1.0 if points.radius is None else points.radius, points.steps)
        if names.count(subject.name) > 1:
            raise InputError(f"{subject.name}: given twice; give each file its own name under [about]")
        parse_mode(subject.machine, subject.mode)
        if measurement is not None:
            measurement.check(subject)


def empty_sections(document: Document) -> list[str]:
    """A line for every reason why something is not told, with the headings of the sections in which it stands."""
    found: dict[str, list[str]] = {}
    for section in all_sections(document.sections):
        for block in section.blocks:
            if isinstance(block, Words) and block.says_why:
                found.setdefault(block.text, []).append(section.heading)
    return [f"{', '.join(headings)}: {reason}" for reason, headings in found.items()]


def _timed(name: str, make: Callable[[], Section], tell: Tell) -> Section:
    """A section; a line tells when it is done."""
    start = time.monotonic()
    found = make()
    tell(f"{name} ({time.monotonic() - start:.0f} s)")
    return found


def _of_one(
    subject: Subject, chosen: Sequence[str], measurement: Measurement | None, progress: Progress, tell: Tell
) -> list[Section]:
    """The sections of one machine."""
    make = {name: partial(own, subject) for name, own in TELL.items()}
    if measurement is not None:
        make[MEASURED] = partial(measured.section, subject, measurement)
    names = [name for name in (*OWN[:-1], MEASURED, OWN[-1]) if name in chosen]
    found = []
    for done, name in enumerate(names):
        progress(subject.name, done, len(names))
        found.append(_timed(f"{subject.name}: {name}", make[name], tell))
    progress(subject.name, len(names), len(names))
    return found


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _lead(subjects: Sequence[Subject]) -> str:
    titles = "; ".join(subject.machine.about.title for subject in subjects if subject.machine.about.title)
    described = f"{titles}. " if titles else ""
    what = "This machine, worked out by trivet from its machine file"
    if len(subjects) > 1:
        what = "These machines, worked out by trivet from their machine files, side by side and one by one"
    return f"{described}{what}, with what every number rests on and the command that repeats it."
