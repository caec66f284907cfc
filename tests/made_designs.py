"""Studies of designs, and sweeps and optimisations of them whose values are made up, so that no kernel is compiled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from trivet.design.aims import aims_of
from trivet.design.optimisation import Member, Optimisation
from trivet.design.store import Chunk, open_store, read
from trivet.design.study import WORKED_OUT, Study, study_of
from trivet.design.study_file import GivenAims, GivenPoses, GivenSweep, GivenVariable, StudyFile
from trivet.design.sweep import Sweep, drawn, layout_of, sampling_of
from trivet.model import Machine, load

LENGTH = GivenVariable(of="link.length", low="205 mm", high="225 mm")
OUTER = GivenVariable(of="sections.tube.outer_diameter", low="18 mm", high="25 mm")
TUBE = GivenVariable(
    of=["sections.tube.outer_diameter", "sections.tube.inner_diameter"], name="tube",
    choices=[["19 mm", "14 mm"], ["25 mm", "19 mm"], ["30 mm", "22 mm"]],
)  # fmt: skip
SIZE = GivenVariable(scale=["platform_joint.radius"], name="size of the platform", low=0.5, high=1.5, law="log-uniform")


def study(
    quantities: Sequence[str] = ("mean K_xx", "mass"),
    variables: Sequence[GivenVariable] = (LENGTH, TUBE, SIZE),
    machines: Sequence[Machine] | None = None,
    count: int = 50,
    **aims: Any,
) -> Study:
    own = [load("azulay")] if machines is None else list(machines)
    given = StudyFile(
        machines=[machine.name for machine in own], variables=list(variables), quantities=list(quantities),
        poses=GivenPoses(steps=2, rolls=24),
        sweep=GivenSweep(count=count), optimise=GivenAims(**aims),
    )  # fmt: skip
    return study_of(given, own)


def seeking(variables: Sequence[GivenVariable], aims: GivenAims, *machines: Machine) -> Study:
    """What an optimisation asks; of azulay where no machine is given."""
    own = machines or (load("azulay"),)
    names = [machine.name for machine in own]
    poses = GivenPoses(steps=2, rolls=36)
    return study_of(StudyFile(machines=names, variables=list(variables), poses=poses, optimise=aims), own)


def swept(asked: Study, folder: Path, values: Callable[[np.ndarray], np.ndarray], status: np.ndarray | None = None) -> Sweep:
    """A sweep with values (n, quantities) of its designs (n, variables)."""
    drawing = sampling_of(asked)
    layout = layout_of(asked, drawing, drawing.count)
    designs = drawn(asked, drawing, 0, drawing.count)
    found = np.full(drawing.count, WORKED_OUT) if status is None else status
    with open_store(folder, layout) as store:
        store.write(0, Chunk(np.concatenate([designs, values(designs)], axis=1).T, found))
    return Sweep(asked, read(folder))


def member(place: int, design: Sequence[float], values: Sequence[float], **more: Any) -> Member:
    own: dict[str, Any] = {"is_polished": True, "active": (), "bounds": (), "again": np.zeros(0), "structural": np.nan} | more
    return Member(place, np.asarray(design, float), np.asarray(values, float), **own)


def optimised(asked: Study, members: Sequence[Member], alternatives: Sequence[Member] = ()) -> Optimisation:
    own, aims = aims_of(asked)
    return Optimisation(own, aims, tuple(members), tuple(alternatives), ())
