"""Designs looked at again by other ways: more check points and rolls, and the structural path."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trivet.design.evaluation import Array, Evaluation
from trivet.design.study import Study
from trivet.errors import NoResultError
from trivet.kinematics.mode import closed_form_signs
from trivet.space.surface import Surface
from trivet.statics.structure import structural_stiffness
from trivet.study.stiffness_map import stiffness_map

FINER = 2
"""By which the lattice and the grid of rolls are refined."""
POINTS = 6
"""Check points at which the structural path is gone."""


class Checked(NamedTuple):
    """What other ways say of n designs."""

    values: Array
    """(n, q) the quantities over a lattice and a grid of rolls that are finer, SI."""
    structural: Array
    """(n,) greatest difference of the stiffness matrix from matrix structural analysis, against its greatest entry (forces and
    moments made comparable by the characteristic length), over some check points; NaN where none is reached."""


def checked(study: Study, place: int, designs: Array, tell: Callable[[int], None] = lambda done: None) -> Checked:
    """Look again at designs (n, d) of one of a study's machines; tells how many are done."""
    tell(0)
    single = study.of(place).climbing()
    points = single.subjects[0].points
    finer = points._replace(steps=FINER * points.steps, rolls=FINER * points.rolls)
    again = dataclasses.replace(single, subjects=(single.subjects[0]._replace(points=finer),))
    values = Evaluation(again)(designs).values
    structural = np.zeros(len(designs))
    for k, design in enumerate(designs):
        structural[k] = _structural(single, design)
        tell(k + 1)
    return Checked(values, structural)


def _structural(study: Study, design: Array) -> float:
    machine, subject = study.machine(0, design), study.subjects[0]
    frames = subject.points.surface(machine)
    some = np.unique(np.linspace(0, len(frames) - 1, POINTS).astype(int))
    surface = Surface(frames.name, frames.position[some], frames.azimuth[some], frames.tilt[some])
    try:
        found = stiffness_map(machine, surface, objective=subject.points.objective.name, mode=study.given.poses.mode)
    except NoResultError:
        return np.nan
    signs = closed_form_signs(machine, study.given.poses.mode)
    scale = np.r_[np.ones(3), np.full(3, 1 / float(machine.characteristic_length or 1.0))]
    worst = 0.0
    for k in np.flatnonzero(found.used):
        pose = type(found.poses)(*(type(v)(*(float(np.asarray(c)[k]) for c in v)) for v in found.poses))
        ours, theirs = (m * np.outer(scale, scale) for m in (found.matrix[k], structural_stiffness(machine, pose, signs)))
        worst = max(worst, float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
    return worst
