"""A study: what a study file says, looked up in its machines."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from trivet.design.looked import Load, Points
from trivet.design.quantities import Asked, quantity, require
from trivet.design.store.layout import NOT_YET
from trivet.design.study_file import MOST_MACHINES, StudyFile, read_study_file
from trivet.design.variables import Action, Variable, machine_of, variables_of
from trivet.errors import InputError
from trivet.kinematics.mode import closed_form_signs, mode_text
from trivet.model import Machine, parse, to_text
from trivet.model.toml import parse_toml
from trivet.reach.scene import Scene, scene_of
from trivet.statics.objective import objective
from trivet.study.architecture import pairs
from trivet.study.machines import choose
from trivet.study.stiffness_map import roll_symmetry, workpiece_of

Array = NDArray[Any]

WORKED_OUT, PARTLY, NO_RESULT, NOT_REACHED, CONTRADICTION = 1, 2, 3, 4, 5
"""What a design can come to; of several machines the one that comes off worst, the greatest, decides."""
STATUSES = (
    NOT_YET,
    "worked out",
    "worked out but for check points out of reach",
    "with a machine of which no study has a result",
    "with a machine that reaches no check point",
    "with numbers that contradict each other",
)


class Subject(NamedTuple):
    """One of the machines, and how it is looked at."""

    machine: Machine
    signs: Any
    """(n_chains, 2) working mode."""
    scene: Scene
    points: Points


class Column(NamedTuple):
    """A quantity of one of the machines."""

    name: str
    """As results call it: with the machine where there are several."""
    place: int
    """Which of the machines."""
    asked: Asked


@dataclass(frozen=True)
class Study:
    """Machines, what varies of them, and what is asked of every design."""

    given: StudyFile
    subjects: tuple[Subject, ...]
    variables: tuple[Variable, ...]
    load: Load
    quantities: tuple[Asked, ...]

    @property
    def machines(self) -> list[Machine]:
        """As they are described."""
        return [subject.machine for subject in self.subjects]

    @property
    def names(self) -> list[str]:
        """Of the machines."""
        return [machine.name for machine in self.machines]

    @property
    def columns(self) -> list[Column]:
        """Every quantity of every machine."""
        single = len(self.subjects) == 1
        return [
            Column(asked.name if single else f"{asked.name} of {machine.name}", place, asked)
            for asked in self.quantities
            for place, machine in enumerate(self.machines)
        ]

    def asking(self, names: Sequence[str]) -> Study:
        """The study with other quantities.

        Raises:
            InputError: for a quantity that is not known, or that no machine has.
        """
        asked = tuple(quantity(name) for name in dict.fromkeys(" ".join(name.split()) for name in names))
        for own in asked:
            require(own, self.machines)
        points = any(own.is_over_points for own in asked)
        for subject in self.subjects if points else ():
            workpiece_of(subject.machine, subject.points.radius, subject.points.height)
        made = dataclasses.replace(self, quantities=asked)
        taken = {own.name for own in (*asked, *made.columns)}
        for variable in self.variables:
            if variable.name in taken:
                raise InputError(f"variables: '{variable.name}' is the name of a quantity; give the variable another name")
        return made

    def require_quantities(self) -> None:
        """Raise InputError where nothing is asked of designs."""
        if not self.quantities:
            raise InputError('quantities: none; say what is asked of every design, as in quantities = ["mean K_xx", "mass"]')

    def of(self, place: int) -> Study:
        """The study of one of its machines alone; variables that it has no number of do nothing."""
        variables = tuple(dataclasses.replace(one, actions=(one.actions[place],)) for one in self.variables)
        return dataclasses.replace(self, subjects=(self.subjects[place],), variables=variables)

    def climbing(self) -> Study:
        """The study with best rolls that are sought beyond the grid's, so that values have slopes."""
        subjects = tuple(one._replace(points=one.points._replace(climbs=True)) for one in self.subjects)
        return dataclasses.replace(self, subjects=subjects)

    def machine(self, place: int, design: Sequence[float] | Array) -> Machine:
        """The machine that a design is, with plain numbers."""
        import jax

        made = machine_of(self.subjects[place].machine, place, self.variables, [float(value) for value in design])
        return jax.tree.map(float, made)

    def described_of(self, place: int) -> Array:
        """(d,) the design which a machine is as described, also outside of ranges.

        The middle where it has no such number, or where it is none of the choices.
        """
        own = self._described_values(place)
        return np.array(
            [variable.law.middle if value is None else value for variable, value in zip(self.variables, own, strict=True)]
        )

    def replaced(self, place: int) -> list[Variable]:
        """Variables none of whose choices is a machine's own: `described_of` has another one in its place."""
        own = zip(self.variables, self._described_values(place), strict=True)
        return [variable for variable, value in own if value is None and variable.acts_on(place)]

    def _described_values(self, place: int) -> list[float | None]:
        """The value of each variable in a machine; None where it has no such number, or none of the choices."""
        import jax

        numbers = jax.tree.leaves(self.subjects[place].machine)
        return [_value_in(variable, variable.actions[place], numbers) for variable in self.variables]

    @cached_property
    def packed(self) -> str:
        """All of it as text, for a worker on another machine."""
        document = TypeAdapter(StudyFile).dump_python(self.given, mode="json")
        machines = [{"name": m.name, "file": to_text(m.renamed(f"machine-{k + 1}"))} for k, m in enumerate(self.machines)]
        asked = [own.name for own in self.quantities]
        return json.dumps({"study": document, "machines": machines, "quantities": asked}, sort_keys=True)

    def fingerprint(self, *more: Any) -> str:
        """SHA-256 (hex) of what decides results: machines, variables, poses, load, quantities, and what else is given."""
        packed = json.loads(self.packed)
        study = {key: packed["study"][key] for key in ("variables", "poses", "load")}
        text = json.dumps([study, packed["machines"], packed["quantities"], more], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _value_in(variable: Variable, action: Action | None, numbers: Sequence[float]) -> float | None:
    """The value of a variable in a machine with these numbers."""
    if action is None:
        return None
    own = [1.0 if action.is_factor else float(numbers[leaf]) for leaf in action.leaves]
    if not variable.is_discrete:
        return own[0]
    same = (float(k) for k, choice in enumerate(variable.choices) if np.allclose(choice, own, rtol=1e-9, atol=0))
    return next(same, None)


def read_study(path: str | os.PathLike[str], needing: Callable[[Study], Any] = lambda study: None) -> Study:
    """Read a study file and look up what it names.

    Args:
        path: the file.
        needing: called with the study; what it raises as an InputError is told of the file.

    Raises:
        InputError: with the file, the key, the value and what was expected.
    """
    name = os.fspath(path)
    given = read_study_file(name)
    folder = os.path.dirname(name)
    try:
        machines, guides = ([choose(_beside(folder, name)) for name in names] for names in (given.machines, given.guides))
        study = study_of(given, pairs(machines, guides) if guides else machines)
        needing(study)
        return study
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(f"{name}: ") else f"{name}: {text}") from None


def _beside(folder: str, machine: str) -> str:
    """A file is looked for beside the study file."""
    name, sign, settings = machine.partition("@")
    return os.path.join(folder, name) + sign + settings if name.endswith(".toml") or os.sep in name else machine


def study_of(given: StudyFile, machines: Sequence[Machine]) -> Study:
    """A study of machines; errors as for `read_study`."""
    names = [machine.name for machine in machines]
    if len(names) > MOST_MACHINES:
        raise InputError(f"machines: {len(names)} with all pairs of legs and guides; at most {MOST_MACHINES}")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"machines: {name} is given twice; give each file its own name under [about]")
    poses = given.poses
    points = Points(poses.steps, poses.radius, poses.height, objective(poses.objective), poses.rolls)
    subjects = tuple(_subject(machine, poses.mode, points) for machine in machines)
    load = Load(given.load.force, given.load.moment, given.load.gravity)
    made = Study(given, subjects, variables_of(given.variables, machines), load, ())
    return made.asking(given.quantities)


def _subject(machine: Machine, mode: str | None, points: Points) -> Subject:
    signs = closed_form_signs(machine, mode)
    symmetry = roll_symmetry(machine, mode_text(machine, signs))
    return Subject(machine, signs, scene_of(machine, with_workpiece=False), points._replace(symmetry=symmetry))


def unpacked(text: str) -> Study:
    """A study from the text which `Study.packed` is."""
    document = json.loads(text)
    machines = [
        parse(parse_toml(own["name"], own["file"].encode(), "a machine file")).renamed(own["name"])
        for own in document["machines"]
    ]
    given = TypeAdapter(StudyFile).validate_python(document["study"])
    return study_of(given, machines).asking(document["quantities"])
