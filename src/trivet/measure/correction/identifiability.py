"""What measurements tell of the numbers that were free: how well each is known, which are one, and what to measure next."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from trivet.measure.correction.terms import FLOOR, Problem, log_slopes
from trivet.measure.correction.updating import Updated
from trivet.measure.functions import Channel, Functions, Motion
from trivet.measure.machine.parameters import Parameters
from trivet.measure.machine.predicted import Receptances
from trivet.measure.machine.setup import ON_PLATFORM, Placed, Site
from trivet.model.elements import Beam, Drivable
from trivet.statics.assembly import assemble
from trivet.vibration.places import place_of

TOLD = 1.0
"""Information of the measurements, against that beforehand, below which they say nothing that was not known."""
APART = 0.95
"""Correlation beyond which two numbers cannot be told apart."""
LINES = 60
"""Frequencies at which a place that was not measured is looked at: as many say nearly as much as all."""
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Direction(NamedTuple):
    """A combination of numbers, on the scale of what was known beforehand, that is told independently of the others."""

    shares: np.ndarray
    """(p,) of norm 1, of theta over its spread."""
    information: float
    """Of the measurements, against that beforehand; the standard deviation shrinks by 1 / sqrt(1 + information)."""

    @property
    def is_told(self) -> bool:
        """Whether the measurements say more of it than was known."""
        return self.information >= TOLD


class Told(NamedTuple):
    """What measurements tell of p numbers."""

    deviation: np.ndarray
    """(p,) standard deviations of theta afterwards."""
    correlation: np.ndarray
    """(p, p) afterwards."""
    directions: tuple[Direction, ...]
    """p of them, the best told first."""
    inseparable: tuple[tuple[int, int, float], ...]
    """Pairs of numbers whose correlation is beyond `APART`, with it."""


class NextPoint(NamedTuple):
    """A place that was not measured, and what it would tell."""

    site: Site
    axis: str
    """x, y or z of {O}."""
    gain: float
    """Expected information, bits: half the logarithm of the volume by which the numbers' uncertainty shrinks."""
    deviation: np.ndarray
    """(p,) standard deviations of theta with it."""


def told(free: Parameters, information: np.ndarray, covariance: np.ndarray) -> Told:
    """What measurements tell, from their information and the covariance of theta (p, p)."""
    deviation = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(deviation, deviation)
    values, vectors = np.linalg.eigh(free.spread[:, None] * information * free.spread)
    directions = tuple(Direction(vectors[:, k], max(0.0, float(values[k]))) for k in np.argsort(-values))
    pairs = ((a, b, float(correlation[a, b])) for a in range(len(free)) for b in range(a + 1, len(free)))
    return Told(deviation, correlation, directions, tuple(pair for pair in pairs if abs(pair[2]) > APART))


def next_points(problem: Problem, found: Updated) -> list[NextPoint]:
    """Places and directions that were not measured, by what a sensor there would tell with the loads that there are, the most
    telling first.

    Looked at are the platform centre, the tool, the platform's joints, every slide and the middle of every beam, each along
    x, y and z, over the same frequencies, with the same scatter of ln|H|.
    """
    covariance = found.covariance(problem.free)
    sites, (functions, lines) = list(_candidates(problem.placed)), _thinned(problem.functions)
    weight = lines / (found.spread**2 * found.alike)
    before, gains = np.linalg.inv(covariance), []
    for (site, axis), slopes in zip(itertools.product(sites, AXES), _seen(problem, found, sites, functions), strict=True):
        whole = np.linalg.inv(before + weight * slopes.T @ slopes)
        gain = (np.linalg.slogdet(covariance)[1] - np.linalg.slogdet(whole)[1]) / (2 * math.log(2))
        gains.append(NextPoint(site, axis, float(gain), np.sqrt(np.diag(whole))))
    return sorted(gains, key=lambda one: -one.gain)


def _thinned(functions: Functions) -> tuple[Functions, float]:
    """Some of the frequencies, and for how many lines each stands."""
    count = len(functions.frequency)
    kept = np.unique(np.linspace(0, count - 1, min(count, LINES)).round().astype(int))
    frequency, values = functions.frequency[kept], functions.values[:, kept]
    return dataclasses.replace(functions, frequency=frequency, values=values, coherence=None), count / len(kept)


def _seen(problem: Problem, found: Updated, sites: list[Site], functions: Functions) -> np.ndarray:
    """(3 sites, loads n, p): slopes of ln|H| along every axis of every site, from the loads that there are."""
    references = tuple(dict.fromkeys(functions.references))
    back = problem.placed.turn.T
    ways = [(float(a), float(b), float(c)) for a, b, c in (back @ np.array(axis) for axis in AXES.values())]
    pairs = [(Channel(s.point, way), r) for s in sites for way in ways for r in references]
    motion: Motion = "displacement"
    shape = len(sites), len(ways), len(references), len(functions.frequency)
    asked = dataclasses.replace(
        functions,
        values=np.ones((len(pairs), shape[-1]), dtype=complex),
        motions=(motion,) * len(pairs),
        responses=tuple(a for a, _ in pairs),
        references=tuple(b for _, b in pairs),
    )
    placed = dataclasses.replace(problem.placed, sites={**problem.placed.sites, **{s.point: s for s in sites}})
    slopes = Receptances.of(placed, asked).slopes(problem.machine, problem.loss_factor, problem.free, found.theta)
    # A floor as for what was measured, of the greatest response of all sites.
    size = np.abs(slopes.values).reshape(shape)
    under = FLOOR * np.broadcast_to(size.max(axis=(0, 1, 2), keepdims=True), shape)
    own = log_slopes(slopes, under.reshape(len(pairs), -1))
    return own.reshape(len(sites) * len(ways), -1, len(found.theta))


def _candidates(placed: Placed) -> Iterable[Site]:
    """Places where a sensor could be, and is not."""
    machine, taken = placed.machine, [site.at for site in placed.sites.values()]
    structure = assemble(machine, placed.frame, placed.signs)
    on_platform: dict[str, Any] = {"platform": (0.0, 0.0, 0.0)}
    if machine.platform.tool_tip is not None:
        on_platform["tool"] = machine.platform.tool_tip
    for leg in machine.legs:
        on_platform[f"{leg.name} on the platform"] = leg.platform_frame().origin
    names: list[tuple[str, str, np.ndarray]] = [
        (name, ON_PLATFORM, np.array([float(c) for c in placed.frame.shift(at).origin])) for name, at in on_platform.items()
    ]
    for leg in machine.legs:
        for element in leg.chain.elements:
            name = f"{leg.name}.{element.name}"
            place = f"{name}@0.5" if isinstance(element, Beam) else name if isinstance(element, Drivable) else None
            if place is not None:
                names.append((place, place, place_of(machine, placed.frame, structure, place).at))
    for name, on, at in names:
        if all(np.linalg.norm(at - other) > 1e-9 for other in taken):
            yield Site(name, on, at, None, 0.0)
