"""Where a plan comes closest to what would stop it: joints, bodies, aims, and drives that have to move fast."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.report import joint_names, joint_states
from trivet.kinematics.travel import gauges
from trivet.reach.margins import nearest_bodies
from trivet.reach.touch import Touch
from trivet.space.batches import in_batches
from trivet.study.roll_grid import Aim, Along, Rules, frames_of, knots_at, met, sampled

Array = NDArray[Any]

BESIDE = 1e-4
"""Of the distance of two samples, between which a rate is taken."""


class Closest(NamedTuple):
    """The joint that has least travel left, and the bodies that come nearest."""

    joint: str
    """"leg-1.slide"; empty where no joint is limited."""
    joint_at: int
    """At which sample."""
    bodies: tuple[str, str]
    """Empty names where none are looked at."""
    bodies_at: int


class Drives(NamedTuple):
    """How the drives move along a way."""

    names: tuple[str, ...]
    """In the order of Q."""
    is_angular: Array
    """(drives,)"""
    knots: Array
    """(k, drives) coordinates at the knots of the way, m or rad; angles go on without a jump from knot to knot."""
    rates: Array
    """(n, drives) between samples: m or rad per rad that the platform turns; along a path, where it moves farther than it
    turns, a move by the machine's size counts as 1 rad."""
    rows: Array
    """(n,) where that is, along the rows of the grid."""
    size: float
    """The machine's, m."""

    @property
    def fastest(self) -> tuple[int, int]:
        """Where (n) the greatest rate is, and of which drive; that of an angle is compared over the machine's size."""
        speeds = np.abs(self.rates) * np.where(self.is_angular, self.size, 1.0)
        where, drive = np.unravel_index(int(speeds.argmax()), speeds.shape)
        return int(where), int(drive)


def closest(rules: Rules, samples: Along) -> Closest:
    """What samples come closest to."""
    tight, near = int(samples.travel.argmin()), int(samples.clearance.argmin())
    joint, _ = tightest(rules, _one(samples, tight))
    bodies = ("", "")
    if rules.scene is not None:
        there = frames_of(_one(samples, near), rules.radius)
        (bodies,), _ = nearest_bodies(rules.machine, rules.scene, there, rules.signs, rules.workpiece)
    return Closest(joint, tight, bodies, near)


def tightest(rules: Rules, touch: Touch) -> tuple[str, float]:
    """The joint that has least travel left at a pose (1,), in parts of half its travel; no name and 1 where none is limited."""
    pose = frames_of(touch, rules.radius)
    margins = {
        f"{leg.name}.{gauge.joint.name}": float(np.asarray(gauge.margin).min())
        for leg, signs in zip(rules.machine.legs, rules.signs, strict=True)
        for gauge in gauges(leg, inverse(leg, pose, signs), pose)
    }
    return min(margins.items(), key=lambda item: item[1], default=("", 1.0))


def aims_at(rules: Rules, samples: Along, sample: int) -> dict[Aim, float]:
    """What every aim comes to at a sample, SI."""
    touch, free = _one(samples, sample), rules._replace(limits=False, scene=None)
    return {aim: float(met(free._replace(aims=(aim,)), touch, np.zeros(1)).value[0]) * aim.unit for aim in rules.aims}


def governing(values: dict[Aim, float]) -> Aim:
    """The aim that decides."""
    return min(values, key=lambda aim: values[aim] / aim.unit)


def drives_along(rules: Rules, knots: Touch, places: Array, step: float) -> Drives:
    """How the drives move straight on through knots (k,), at places (k,) along rows; `step` as for `roll_grid.along`."""
    parts, ends = sampled(rules, knots, step)
    beside = BESIDE * np.diff(parts) / 2
    middles = (parts[1:] + parts[:-1]) / 2
    driven = actuators(rules.machine)
    listed = joint_names(rules.machine)
    which = [listed.index(name) for name, _ in driven]
    is_angular: Array = np.array([joint.is_angular for _, joint in driven])

    def at(parts: Array) -> tuple[Array, Any]:
        poses = frames_of(knots_at(knots, parts), rules.radius)
        states = in_batches(lambda part: joint_states(rules.machine, part, rules.signs), poses)
        return states.coordinate[:, which], poses

    (before, first), (after, second) = at(middles - beside), at(middles + beside)
    change = after - before
    change[:, is_angular] = np.angle(np.exp(1j * change[:, is_angular]))
    size = float(rules.machine.characteristic_length)
    turned = np.linalg.norm([np.subtract(b, a) for a, b in zip(first[1:], second[1:], strict=True)], axis=(0, 1)) / math.sqrt(2)
    by = turned
    if not rules.radius:  # along a path the platform may move without turning
        by = np.maximum(by, np.linalg.norm(np.subtract(second.origin, first.origin), axis=0) / size)
    by = by[:, None]
    rates = np.divide(change, by, out=np.zeros_like(change), where=by > 1e-12)  # where nothing moves, no drive does
    coordinates, _ = at(parts)
    coordinates[:, is_angular] = np.unwrap(coordinates[:, is_angular], axis=0)
    rows = np.interp(middles, np.arange(len(ends)), places)
    return Drives(tuple(name for name, _ in driven), is_angular, coordinates[ends], rates, rows, size)


def _one(samples: Along, sample: int) -> Touch:
    return Touch(*(c[sample : sample + 1] for c in samples.touch))
