"""Random plans of four machines, checked at fifty times finer steps by plain NumPy; and what a plan, a cone and a proof must
not get wrong, one fault planted in them at a time."""

from __future__ import annotations

import math
import os
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
import plain_machines as plain
import pytest

from trivet.kinematics.mode import all_modes
from trivet.model import load
from trivet.study.pathfile import PathFile, PathPose
from trivet.study.plan import Plan, plan, plan_along

FINER = 50
SCENARIOS = int(os.environ.get("TRIVET_SCENARIOS", "24"))
"""Random ones, of all machines in turn; the closing benchmark runs more."""
ROUNDING = 1e-9
"""By how much values of two programs may differ: m, rad, and plain numbers."""
WHAT = ("scenarios", "ways found", "proven", "refuted", "ends on two sides", "failures")


class Known(NamedTuple):
    """Between what a machine's scenarios are drawn, and modes in which it gets far."""

    heights: tuple[float, float]
    lengths: dict[str, tuple[float, float]]
    modes: tuple[str, ...]


KNOWN = {
    "azulay": Known((0.07, 0.13), {"link.length": (190, 240)}, ("++ ++ ++", "++ ++ -+", "-+ ++ ++")),
    "eclipse": Known((0.155, 0.235), {"link.length": (190, 240)}, ("++ ++ ++", "++ ++ -+", "++ -+ ++")),
    "alizade": Known((0.12, 0.19), {"telescope.travel": (40, 90)}, ("+ + +", "+ + -", "- + +")),
    "glozman": Known(
        (0.13, 0.2), {"link-1.length": (122, 155), "link-2.length": (122, 155)},
        ("++ ++ ++", "++ -- +-", "+- +- --", "++ ++ -+", "++ +- +-", "++ ++ --"),
    ),
}  # fmt: skip


class Scenario(NamedTuple):
    found: Plan
    machine: plain.Machine
    solid: bool
    start: float | None


def scenario(seed: int) -> Scenario:
    """A random machine with random dimensions, on a random sphere or along random poses, in a random mode."""
    rng = np.random.default_rng([20, seed])
    name = list(KNOWN)[seed % len(KNOWN)]
    known = KNOWN[name]
    changes: dict[str, Any] = {}

    def mm(low: float, high: float) -> str:
        return f"{float(rng.uniform(low, high))!r} mm"

    for path, (low, high) in known.lengths.items():
        changes[path] = mm(low, high)
        if path == "telescope.travel":
            middle, half = float(rng.uniform(205, 225)), float(rng.uniform(low, high)) / 2
            changes[path] = [f"{middle - half!r} mm", f"{middle + half!r} mm"]
    if rng.random() < 0.5:
        changes |= {"guide.radius": mm(150, 175), "platform_joint.radius": mm(15, 24), "disc.radius": mm(12, 24)}
    if rng.random() < 0.5:
        changes |= {"tube.outer_diameter": mm(15, 21), "interference.clearance": mm(0, 3)}
    bodies, on_sphere = bool(rng.random() < 0.6), bool(rng.random() < 0.75)
    settings: dict[str, Any] = {
        "mode": str(rng.choice([*known.modes, str(rng.choice(all_modes(load(name))))])),
        "limits": bool(rng.random() < 0.6),
        "bodies": bodies,
        "start_roll": float(rng.uniform(-3, 3)) if rng.random() < 0.2 else None,
        "step": math.radians(2),
        "rolls": 90,
    }
    height, solid = float(rng.uniform(*known.heights)), False
    machine = load(name, changes)
    if on_sphere:
        solid = bodies and bool(rng.random() < 0.3)
        to, azimuth = float(rng.uniform(0.1, 1.6)), float(rng.uniform(-3, 3))
        found = plan(machine, float(rng.uniform(0.002, 0.012)), height, to=to, azimuth=azimuth, solid=solid, **settings)
    else:
        poses = [
            PathPose(
                position=(float(rng.uniform(-0.004, 0.004)), float(rng.uniform(-0.004, 0.004)), height),
                azimuth=float(rng.uniform(-2, 2)), tilt=float(rng.uniform(0, 0.6)), roll=0.0,
            )
            for _ in range(int(rng.integers(2, 5)))
        ]  # fmt: skip
        found = plan_along(machine, PathFile(poses), **settings)
    return Scenario(found, plain.read(name, changes), solid, settings["start_roll"])


def walked(knots: np.ndarray, turn: float, move: float) -> np.ndarray:
    """Coordinates (6, n) along knots (6, k), in steps of at most a turn (rad) and a move (m)."""
    parts = []
    for one, two in zip(knots.T[:-1], knots.T[1:], strict=True):
        off = np.abs(two - one)
        count = max(2, math.ceil(max(off[3:].max() / turn, off[:3].max() / move)))
        parts.append(one[:, None] + (two - one)[:, None] * np.arange(count) / count)
    return np.concatenate([*parts, knots[:, -1:]], axis=1)


def met(case: Scenario, way: np.ndarray, *, bodies: bool = True) -> plain.Met:
    """What plain NumPy meets at coordinates (6, n): the platform stands on its sphere."""
    rules = case.found.rules
    turn = plain.rotation(*way[3:])
    ball = plain.Ball(way[:3, 0], rules.radius) if case.solid else None
    place = way[:3].T + rules.radius * turn[:, :, 2]
    return plain.met(case.machine, place, turn, case.found.mode, bodies=bodies and rules.scene is not None, solid=ball)


def jumps(joints: np.ndarray) -> np.ndarray:
    """(n - 1) by how much joints (n, 9) change from place to place, at most: rad, or parts of 0.1 m."""
    off = np.diff(joints, axis=0)
    is_length = np.array([False, True, False] * 3)
    off = np.where(is_length, off / 0.1, off)
    return np.minimum(np.abs(off), np.where(is_length, np.inf, np.abs(np.abs(off) - 2 * np.pi))).max(axis=1)


def off_line(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Distances of points (d, n) from a line through corners (d, k)."""
    found = np.full(points.shape[1], np.inf)
    for one, two in zip(corners.T[:-1], corners.T[1:], strict=True):
        along = two - one
        part = np.clip((points.T - one) @ along / max(along @ along, 1e-300), 0, 1)
        found = np.minimum(found, np.linalg.norm(points.T - one - part[:, None] * along, axis=1))
    return found


def checked(case: Scenario) -> None:
    """A plan that is told safe, at fifty times finer steps than its grid: all that its proof says, and what it tells."""
    found, machine = case.found, case.machine
    assert found.knots is not None
    assert found.proof is not None
    demand, least = found.proof.demand, found.proof.least
    knots, steps = np.stack(found.knots), np.abs(np.diff(np.stack(found.grid.path))).max(axis=1)
    turn, move = min([found.grid.step, *steps[3:][steps[3:] > 0]]), min([machine.platform, *steps[:3][steps[:3] > 0]])
    way = walked(knots, turn / FINER, move / FINER)
    there = met(case, way)
    assert there.closes.all()
    # Its proof, as far as it goes.
    assert demand.sigma_min >= found.rules.least_sigma
    assert demand.sigma_min > 0
    assert least.sigma_min >= demand.sigma_min
    assert there.sigma.min() >= least.sigma_min - ROUNDING
    assert len(set(np.sign(there.determinant))) == 1
    if found.rules.limits:
        assert demand.travel == 0
        assert there.travel.min() >= least.travel - ROUNDING >= -ROUNDING
    if found.rules.scene is not None:
        assert demand.clearance == pytest.approx(machine.gap)
        assert least.clearance is not None
        assert there.clearance.min() >= least.clearance - ROUNDING >= machine.gap - 2 * ROUNDING
    # No joint jumps: where one moves fast it does not at finer steps yet.
    for k in np.flatnonzero(jumps(there.joints) > 0.1):
        finer = way[:, [k]] + (way[:, [k + 1]] - way[:, [k]]) * np.linspace(0, 1, 2000)
        assert jumps(met(case, finer, bodies=False).joints).max() < 0.1
    # What it tells of the way.
    assert there.sigma.min() == pytest.approx(found.sigma_min, rel=0.02)
    assert there.travel.min() == pytest.approx(found.travel, abs=0.02)
    if found.rules.scene is not None:
        assert there.clearance.min() == pytest.approx(found.clearance, abs=3e-4)
    # From the first pose to the last, on the path but for the roll.
    rows = np.stack(found.grid.path)[:5]
    if found.grid.poses is None:
        corners = rows[:, [0, -1]]
    else:
        corners = rows[:, np.abs(found.grid.poses - np.round(found.grid.poses)) < 1e-12]
    np.testing.assert_allclose(knots[:5, [0, -1]], corners[:, [0, -1]], rtol=0, atol=ROUNDING)
    assert off_line(way[:5], corners).max() < ROUNDING
    assert off_line(corners, knots[:5]).max() < ROUNDING
    if case.start is not None:
        assert math.remainder(knots[3, 0] + knots[5, 0] - case.start, 2 * math.pi) == pytest.approx(0, abs=ROUNDING)


def test_random_plans_at_fifty_times_finer_steps() -> None:
    """No plan is told safe whose finer check fails, and nothing is told proven or refuted that is not."""
    tally: dict[str, Counter[str]] = {name: Counter() for name in KNOWN}
    failed = []
    for seed in range(SCENARIOS):
        case = scenario(seed)
        found, own = case.found, tally[case.machine.name]
        own["scenarios"] += 1
        own["ways found"] += found.is_possible
        own["proven"] += found.is_safe
        own["ends on two sides"] += "which is proven" in found.stopped_by
        own["refuted"] += found.proof is not None and found.proof.is_refuted
        try:
            if found.is_safe:
                checked(case)
            elif found.proof is not None and found.proof.is_refuted:
                refuted(case)
            elif "which is proven" in found.stopped_by:
                on_two_sides(case)
        except AssertionError as error:
            own["failures"] += 1
            failed.append(f"{seed}: {error}")
    for name, own in tally.items():
        print(name, *(f"{what} {own[what]}" for what in WHAT))
    assert not failed
    assert all(own["proven"] > own["scenarios"] / 6 for own in tally.values())


def refuted(case: Scenario) -> None:
    """Where a proof says that it is known not to hold it does not."""
    proof = case.found.proof
    assert proof is not None
    there = met(case, proof.open.middle[:, [proof.smallest]])
    asked = proof.demand
    assert (
        not there.closes[0]
        or there.travel[0] < asked.travel
        or (asked.clearance is not None and there.clearance[0] < asked.clearance)
        or there.sigma[0] < asked.sigma_min
    )


def on_two_sides(case: Scenario) -> None:
    """det J_x has one sign at every roll of the start and the other at every roll of the end."""
    grid = case.found.grid
    ends = []
    for row in (0, grid.shape[0] - 1):
        way = np.stack([np.full(3601, c[row]) for c in grid.path])
        way[5] += np.linspace(0, 2 * np.pi, 3601)
        there = met(case, way, bodies=False)
        assert there.closes.all()
        assert len(set(np.sign(there.determinant))) == 1
        ends.append(np.sign(there.determinant[0]))
    assert ends[0] != ends[1]
