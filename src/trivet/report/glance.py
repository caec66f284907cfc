"""The numbers by which machines are known, side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

import numpy as np

from trivet.errors import TrivetError
from trivet.report.document import Section, Table, Words
from trivet.report.subject import Subject
from trivet.study.comparison import HELD
from trivet.study.statistics import moments

_NONE = "–"


class Fact(NamedTuple):
    """A number of every machine."""

    name: str
    """Where {sphere} stands for the sphere of the tilts."""
    section: str
    """Which tells it; without that section the number is not worked out."""
    of: Callable[[Subject], str]


def _chains(subject: Subject) -> str:
    from trivet.views.machine import topology

    return ", ".join(f"{chain.copies} × {topology(chain)}" for _, chain in sorted(subject.machine.chains.items()))


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else _NONE


def _stiffness(quantity: str) -> Callable[[Subject], str]:
    def mean(subject: Subject) -> str:
        (found,) = subject.comparison.maps
        return _number(moments(found.diagonal(quantity)[found.used] / 1e6).mean)

    return mean


def _least(axis: str) -> Callable[[Subject], str]:
    def least(subject: Subject) -> str:
        minima = {minimum.direction: minimum for minimum in subject.response.minima}
        return _number(minima[axis].stiffness / 1e6) if axis in minima else _NONE

    return least


FACTS = (
    Fact("chains, drives in brackets", "machine", _chains),
    Fact("mass of what moves, kg", "home", lambda s: _number(sum(s.home.masses.values()))),
    Fact(
        "tilt reached at every azimuth on {sphere}, pose by pose, best roll "
        "(cones of ball joints without a neutral axis not looked at), °",
        "reach",
        lambda s: _number(math.degrees(s.tilt.tilt)),
    ),
    Fact("tilt reached from home on {sphere}, best roll, °", "reach", lambda s: _number(math.degrees(s.tilt.connected_tilt))),
    Fact("workspace, pose by pose, cm³", "reach", lambda s: _number(s.workspace.volume * 1e6)),
    Fact("workspace reached from home, cm³", "reach", lambda s: _number(s.workspace.volume_from_home * 1e6)),
    Fact(
        "tilt about the home centre to a singularity, °",
        "singularities",
        lambda s: _number(math.degrees(s.singularity.tilt_margin.angle)),
    ),
    *(Fact(f"{quantity}, mean over the check points, N/µm", "stiffness", _stiffness(quantity)) for quantity in HELD),
    Fact("lowest natural frequency, Hz", "vibration", lambda s: _number(float(np.min(s.modes.frequency)))),
    *(Fact(f"least dynamic stiffness along {axis}, 5 Hz to 3 kHz, N/µm", "vibration", _least(axis)) for axis in "xyz"),
)

_WORDS = "Every number is explained in the section that it comes from. Where there is a dash, the section says why."


def glance(subjects: Sequence[Subject], sections: Collection[str]) -> Section:
    """All facts that the chosen sections have worked out."""
    sphere = _sphere(subjects)
    rows = [
        (fact.name.format(sphere=sphere), *(_told(fact, subject) for subject in subjects))
        for fact in FACTS
        if fact.section in sections
    ]
    titles = ("what it is", *(subject.machine.about.title for subject in subjects))
    table = Table("", ("", *(subject.name for subject in subjects)), (titles, *rows))
    return Section("At a glance", (table, Words(_WORDS)))


def _sphere(subjects: Sequence[Subject]) -> str:
    """On which tilts are told."""
    radii = {subject.radius for subject in subjects}
    if len(radii) == 1 and (radius := radii.pop()) is not None:
        return f"the sphere of {1e3 * radius:g} mm"
    return "the sphere of each workpiece"


def _told(fact: Fact, subject: Subject) -> str:
    try:
        return fact.of(subject)
    except TrivetError:
        return _NONE
