"""Random plans of four machines, checked at fifty times finer steps by plain NumPy; and what a plan, a cone and a proof must
not get wrong, one fault planted in them at a time."""

from __future__ import annotations

import math
import os
from collections import Counter
from types import SimpleNamespace
from typing import Any, NamedTuple

import jax
import numpy as np
import plain_machines as plain
import pytest

from trivet.kinematics.mode import all_modes, parse_mode
from trivet.model import load
from trivet.reach.certificate import PATCHES, Bounds, Demand, Patches, Prover
from trivet.reach.sheets import Sheet, highest_sheet
from trivet.reach.touch import Touch
from trivet.reach.ways import bottleneck, widest
from trivet.space.enclosure import Ball, Enclosure
from trivet.study import roll_grid, stops
from trivet.study.cone import cone
from trivet.study.pathfile import PathFile, PathPose
from trivet.study.plan import TRIES, Plan, plan, plan_along
from trivet.study.roll_grid import Field, RollGrid, along, refined

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
    start: float | None = None
    sigma: float | None = None


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
        "sigma": float(rng.uniform(0.05, 0.4)) if rng.random() < 0.2 else None,
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
    return Scenario(found, plain.read(name, changes), solid, settings["start_roll"], settings["sigma"])


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
    assert demand.sigma_min == pytest.approx(0.8 * found.sigma_min if case.sigma is None else case.sigma)
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


def tried(case: Scenario, own: Counter[str]) -> str:
    """Check what is told of a plan and count it; what is wrong, in words, or nothing."""
    found = case.found
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
        return str(error) or "failed"
    return ""


def test_random_plans_at_fifty_times_finer_steps() -> None:
    """No plan is told safe whose finer check fails, and nothing is told proven or refuted that is not."""
    tally: dict[str, Counter[str]] = {name: Counter() for name in KNOWN}
    failed = {}
    for seed in range(SCENARIOS):
        case = scenario(seed)
        failed[seed] = tried(case, tally[case.machine.name])
    for name, own in tally.items():
        print(name, *(f"{what} {own[what]}" for what in WHAT))
    assert not {seed: wrong for seed, wrong in failed.items() if wrong}
    assert all(own["proven"] for own in tally.values())
    assert sum(own["proven"] for own in tally.values()) > SCENARIOS / 4


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


# One fault at a time was planted in ways, grids, cones and proofs; what other tests let pass these do not.

COARSE: dict[str, Any] = {"step": math.radians(4), "rolls": 45}


@pytest.mark.parametrize(("name", "height", "mode"), [
    ("azulay", 0.11, "++ ++ -+"), ("eclipse", 0.17, "++ ++ -+"), ("alizade", 0.157, "+ + -"), ("glozman", 0.168, "++ ++ -+"),
])  # fmt: skip
def test_ways_to_the_horizon(name: str, height: float, mode: str) -> None:
    """The ways that docs/plan.md tells of, by plain NumPy; refining makes them no worse."""
    found = plan(name, 0.004, height, mode=mode, **COARSE)
    assert found.is_safe
    assert found.value > 0.97 * found.bottleneck
    checked(Scenario(found, plain.read(name), False))


def test_a_gap_that_the_machine_file_asks_for_is_kept() -> None:
    """2.12 mm is what there is: 2 mm are kept, 3 mm cannot be, and nothing else is in the way."""
    for gap in (2, 3):
        changes = {"interference.clearance": f"{gap} mm"}
        found = plan(load("azulay", changes), 0.004, 0.11, mode="++ ++ -+", **COARSE)
        assert found.is_possible == (gap == 2)
        if gap == 2:
            checked(Scenario(found, plain.read("azulay", changes), False))
        else:
            assert "mm apart" in found.stopped_by


@pytest.mark.parametrize("tilt", [25.0, 20.0])
def test_cones_of_other_machines_by_plain_numpy(tilt: float) -> None:
    """At random places between the nodes of the sheet, everything that its proof says."""
    name, height = ("eclipse", 0.2) if tilt == 25 else ("alizade", 0.157)
    found, machine = (
        cone(name, math.radians(tilt), 0.004, height, step=math.radians(5), rolls=48, azimuths=18),
        plain.read(name),
    )
    assert found.is_safe
    assert found.proof is not None
    assert found.samples is not None
    knots = np.stack(found.knots)
    rng = np.random.default_rng(11)
    u, v = (rng.uniform(0, n - 1, 20_000) for n in knots.shape[1:])
    i, j = np.minimum(u.astype(int), knots.shape[1] - 2), np.minimum(v.astype(int), knots.shape[2] - 2)
    p, q = u - i, v - j
    way = (1 - p) * (1 - q) * knots[:, i, j] + p * (1 - q) * knots[:, i + 1, j]
    way += (1 - p) * q * knots[:, i, j + 1] + p * q * knots[:, i + 1, j + 1]
    turn = plain.rotation(*way[3:])
    there = plain.met(machine, way[:3].T + 0.004 * turn[:, :, 2], turn, found.mode)
    least = found.proof.least
    assert least.clearance is not None
    assert there.closes.all()
    assert there.travel.min() >= least.travel >= 0
    assert there.clearance.min() >= least.clearance >= 0
    assert there.sigma.min() >= least.sigma_min >= found.proof.demand.sigma_min
    assert found.proof.demand.sigma_min == pytest.approx(0.8 * found.samples.sigma_min.min())
    assert len(set(np.sign(there.determinant))) == 1
    # The directions are those of the cone, all round, and its roll is one function of them.
    np.testing.assert_allclose(knots[3, [0, -1]].T, [[0, 2 * np.pi]] * knots.shape[2], atol=1e-12)
    np.testing.assert_allclose(knots[4, 0, [0, -1]], [0, math.radians(tilt)], atol=1e-12)
    np.testing.assert_allclose((knots[3] + knots[5])[:, 0], (knots[3] + knots[5])[0, 0], atol=1e-12)
    turned = (knots[3] + knots[5])[[0, -1]]
    np.testing.assert_allclose(turned[0], turned[1], atol=1e-12)
    assert np.abs(np.diff(knots[3] + knots[5], axis=0)).max() < 3.1 * 2 * np.pi / 48
    assert np.abs(np.diff(knots[3] + knots[5], axis=1)).max() < 3.1 * 2 * np.pi / 48


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, Demand]]:
    """What is given to provers."""
    given: list[tuple[Any, Demand]] = []
    prove = Prover.prove

    def seen(self: Prover, patches: Any, demand: Demand, *rest: Any, **more: Any) -> Any:
        given.append((patches, demand))
        return prove(self, patches, demand, *rest, **more)

    monkeypatch.setattr(Prover, "prove", seen)
    return given


def test_all_of_a_way_and_all_of_a_cone_are_proven(asked: list[tuple[Any, Demand]]) -> None:
    """The pieces that are looked at are the whole of what is told safe, and the demand is what was asked for."""
    found = plan("azulay", 0.004, 0.11, mode="++ ++ -+", sigma=0.3, **COARSE)
    assert found.knots is not None
    patches, demand = asked[-1]
    np.testing.assert_allclose(patches.middle - patches.first, np.stack(found.knots)[:, :-1], atol=1e-12)
    np.testing.assert_allclose(patches.middle + patches.first, np.stack(found.knots)[:, 1:], atol=1e-12)
    assert demand == Demand(0.0, 0.0, 0.3)
    covered = cone("azulay", math.radians(20), azimuths=12, sigma=0.2, **COARSE)
    patches, demand = asked[-1]
    knots = np.stack(covered.knots)
    corners = [knots[:, :-1, :-1], knots[:, 1:, :-1], knots[:, :-1, 1:], knots[:, 1:, 1:]]
    for (u, v), own in zip(((-1, -1), (1, -1), (-1, 1), (1, 1)), corners, strict=True):
        at = patches.middle + u * patches.first + v * patches.second + u * v * patches.twist
        np.testing.assert_allclose(at, own.reshape(6, -1), atol=1e-12)
    assert demand == Demand(0.0, 0.0, 0.2)


def test_both_ends_are_proven_to_lie_on_different_sides(asked: list[tuple[Any, Demand]]) -> None:
    found = plan("azulay", 0.004, 0.121, **COARSE)
    assert "which is proven" in found.stopped_by
    tilts = []
    for patches, demand in asked:
        ends = patches.middle[:, [0, -1]] + np.array([-1, 1]) * patches.first[:, [0, -1]]
        assert ends[5, 1] - ends[5, 0] == pytest.approx(2 * np.pi)
        assert patches.many > 1
        np.testing.assert_allclose(np.diff(patches.middle[5]), 2 * patches.first[5, 0], atol=1e-12)
        assert demand == Demand(-math.inf, None, stops.NOT_ZERO)
        tilts.append(float(patches.middle[4, 0]))
    assert tilts == pytest.approx([0.0, math.pi / 2])
    on_two_sides(Scenario(found, plain.read("azulay"), False))


def test_what_is_met_across_a_singularity_has_no_value() -> None:
    """Samples tell it at once: beyond the ring det J_x has the other sign."""
    found = plan("azulay", 0.004, 0.121, limits=False, bodies=False, **COARSE)
    still = np.zeros(2)
    knots = Touch(still, still, still + 0.121, still, np.radians([25.0, 40.0]), still)
    values = along(found.rules, knots, np.array([0.0, 1.0]), math.radians(2)).value
    assert np.isfinite(values[0])
    assert values[-1] == -np.inf


class Ridge:
    """A landscape instead of a machine: a narrow ridge that winds, on one side; what is refined must keep to its top."""

    def __init__(self, rows: int) -> None:
        self.grid = RollGrid(Touch(*np.insert(np.zeros((5, rows)), 4, np.linspace(0, 1, rows), axis=0)), 0.1, 40)

    def top(self, tilt: np.ndarray) -> np.ndarray:
        """The roll at which the ridge lies."""
        return np.asarray(0.35 + 0.6 * np.sin(3 * tilt))

    def field(self, rules: Any, grid: RollGrid, mask: np.ndarray | None = None) -> Field:
        rows, columns = np.indices(grid.shape)
        touch = grid.at(rows.ravel(), columns.ravel())
        off = np.abs(np.remainder(touch.roll - self.top(touch.tilt) + 2, 4) - 2)  # the grid's 40 rolls are all round
        value = np.where(off < 0.3, 1 - off, -np.inf).reshape(grid.shape)
        if mask is not None:
            value = np.where(mask, value, -np.inf)
        return Field(value, np.where(np.isfinite(value), 1.0, 0.0))


def test_a_refined_way_keeps_to_the_top_of_a_ridge(monkeypatch: pytest.MonkeyPatch) -> None:
    ridge = Ridge(21)
    monkeypatch.setattr(roll_grid, "field_of", ridge.field)
    start = np.zeros(ridge.grid.shape, dtype=bool)
    start[0] = True
    way, _, side = roll_grid.best_way(ridge.field(None, ridge.grid), start, all_round=True)
    assert side == 1
    assert way is not None
    assert way.value < 0.96
    rules: Any = None
    rows, columns = refined(rules, ridge.grid, way, side, start, [])
    assert (rows[0], rows[-1]) == (0, 20)
    assert np.abs(np.diff(rows)).max() == pytest.approx(1 / roll_grid.FINER**roll_grid.LEVELS)
    touch = ridge.grid.at(rows, columns)
    off = np.abs(touch.roll - ridge.top(touch.tilt))
    # Half a step of the finest grid aside, and as much for the step to the next row, at a slope of two steps a row.
    assert off.max() < 0.013
    # On the other side there is nothing, and the way stays as it was.
    rows, columns = refined(rules, ridge.grid, way, -side, start, [])
    np.testing.assert_array_equal((rows, columns), (way.rows, way.columns))


def test_a_refined_way_starts_where_it_may_and_keeps_off_blocked_places(monkeypatch: pytest.MonkeyPatch) -> None:
    ridge = Ridge(21)
    monkeypatch.setattr(roll_grid, "field_of", ridge.field)
    start = np.zeros(ridge.grid.shape, dtype=bool)
    start[0, 5] = True
    way, _, side = roll_grid.best_way(ridge.field(None, ridge.grid), start, all_round=True)
    assert way is not None
    rules: Any = None
    rows, columns = refined(rules, ridge.grid, way, side, start, [])
    assert columns[0] == 5
    start[0] = True  # or it is the start that decides what the way is worth, and it need not go near the place
    place = (10.0, float(ridge.top(np.array(0.5))) / 0.1 + 1.6)
    blocked = ridge.field(None, ridge.grid)
    blocked = blocked._replace(value=np.where(ridge.grid.is_near([place]), -np.inf, blocked.value))
    around, _, _ = roll_grid.best_way(blocked, start, all_round=True)
    assert around is not None
    rows, columns = refined(rules, ridge.grid, around, side, start, [place])
    assert np.hypot(rows - place[0], columns - place[1]).min() >= roll_grid.AROUND
    assert np.hypot(around.rows - place[0], around.columns - place[1]).min() >= roll_grid.AROUND


def test_places_near_the_seam() -> None:
    """Column 0 is beside the last one, and of refined grids whatever lies a whole turn on."""
    grid = Ridge(9).grid
    near = grid.is_near([(4.0, 0.2)])
    assert near[4, [0, 1, 39]].all()
    assert not near[4, [3, 20, 37]].any()
    assert not near[[1, 7]].any()
    assert grid.is_near([(4.0, 0.2)], np.array([4.0]), np.array([-39.5, 40.5, 80.0, 60.0])).tolist() == [
        [True, True, True, False]
    ]
    row, column = grid.place_of(Touch(0.0, 0.0, 0.0, 0.0, 0.5, 0.73))
    assert row == pytest.approx(4, abs=0.1)
    assert column == pytest.approx(7.3)


def test_azimuths_along_a_path_go_the_short_way_and_a_start_is_kept() -> None:
    turns = [PathPose((0.0, 0.0, 0.114), math.radians(azimuth), 0.2) for azimuth in (170, -170, -90)]
    found = plan_along("azulay", PathFile(turns), start_roll=0.3, mode="++ ++ -+", proof=False, bodies=False, **COARSE)
    azimuth, marks = np.degrees(found.grid.path.azimuth), found.grid.marks
    assert [float(np.interp(pose, marks, azimuth)) for pose in (1, 2, 3)] == pytest.approx([170, 190, 270])
    assert found.knots is not None
    assert math.remainder(found.knots.azimuth[0] + found.knots.roll[0] - 0.3, 2 * math.pi) == pytest.approx(0, abs=1e-9)
    assert any(math.isclose(a, math.radians(190), abs_tol=1e-9) for a in found.knots.azimuth)


def test_corners_are_cut_only_where_that_is_cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    """The chord of a winding ridge leaves its top; as many corners stay as that takes."""
    ridge = Ridge(21)

    def worth(rules: Any, samples: Touch, rows: np.ndarray) -> Any:
        off = np.abs(samples.roll - ridge.top(samples.tilt))
        return roll_grid.Along(samples, rows, 1 - off, off, off, off)

    monkeypatch.setattr(roll_grid, "met", worth)
    rows = np.linspace(0, 20, 161)
    columns = ridge.top(rows / 20) / ridge.grid.step
    rules: Any = SimpleNamespace(machine=load("azulay"))
    knots, places = roll_grid.simplified(rules, ridge.grid, rows, columns)
    assert 3 < len(places) < 40
    assert (places[0], places[-1]) == (0, 20)
    fine = np.linspace(0, 20, 2001)
    roll = np.interp(fine, places, knots.roll)
    assert np.abs(roll - ridge.top(fine / 20)).max() < 0.03


def nodes(shape: tuple[int, int], *places: tuple[int, int]) -> Any:
    found = np.zeros(shape, dtype=bool)
    found[tuple(np.transpose(places))] = True
    return found


def test_a_way_goes_round_low_values_where_that_is_longer() -> None:
    values = np.ones((9, 7))
    values[0] = values[2:7, 3] = 0.5
    way = widest(values, nodes(values.shape, (0, 3)), nodes(values.shape, (8, 3)), all_round=False)
    assert way is not None
    assert way.value == 0.5
    assert np.sum(values[way.rows, way.columns] < 1) == 1
    assert len(way.rows) == 11


def test_a_long_way_over_the_seam_that_never_goes_back_comes_before_a_short_one_that_does() -> None:
    values = np.full((4, 30), -np.inf)
    values[1] = values[0, 10] = values[2, 10:13] = values[2:, 14] = 1.0
    values[1, 11] = -np.inf
    way = widest(values, nodes(values.shape, (0, 10)), nodes(values.shape, (3, 14)), all_round=True)
    assert way is not None
    assert way.is_steady
    assert way.columns[-1] - way.columns[0] == 14 - 30 - 10
    back = widest(values, nodes(values.shape, (0, 10)), nodes(values.shape, (3, 14)), all_round=False)
    assert back is not None
    assert not back.is_steady


def test_rows_that_a_way_need_not_meet_do_not_count() -> None:
    values = np.ones((6, 5))
    values[[0, 5]] = 0.1
    for start, end in (((2, 1), (4, 3)), ((4, 3), (2, 1))):
        assert bottleneck(values, nodes(values.shape, start), nodes(values.shape, end), all_round=False) == 1
    values[3] = 0.2
    assert bottleneck(values, nodes(values.shape, (2, 1)), nodes(values.shape, (4, 3)), all_round=False) == 0.2


def test_all_rays_of_a_cone_share_their_pole() -> None:
    """Each ray has a pole of its own, and neighbours agree; but no roll suits all of them."""
    values = np.full((6, 2, 12), -np.inf)
    values[:, 0, [5, 6]] = 1.0
    for ray, column in enumerate((4, 5, 6, 7, 6, 5)):
        values[ray, 1, column] = 1.0
    assert highest_sheet(values, 1) is None
    sheet = highest_sheet(values, 2)
    assert sheet is not None
    assert len(set(sheet.columns[:, 0])) == 1


def test_a_joint_whose_slope_has_no_bound_may_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where J_x has one, and where the chain may not close, every joint by itself: the piece is no smooth one."""
    machine = load("azulay")
    prover = Prover(machine, parse_mode(machine), None, 0.004)
    middle = np.zeros((6, PATCHES))
    middle[2] = 0.121
    still = np.zeros((6, PATCHES))
    patches = Patches(middle, still + 1e-3, still, still)
    assert prover.bounds(patches)[0].all()
    enclosed = Enclosure.__call__
    counted = [0, 0]
    for part in (0, 1):  # how far chains are from not closing, and joints
        for number in range(100):

            def unbounded(self: Enclosure, *values: Any, part: int = part, number: int = number) -> Any:
                found = list(enclosed(self, *values))
                balls, tree = jax.tree.flatten(found[part], is_leaf=lambda c: isinstance(c, Ball))
                if number < len(balls):
                    wide = np.array(np.broadcast_to(balls[number].radius, np.shape(balls[number].middle)))
                    wide[..., 7] = np.inf
                    balls[number] = balls[number]._replace(radius=wide)
                found[part] = jax.tree.unflatten(tree, balls)
                return found

            monkeypatch.setattr(Enclosure, "__call__", unbounded)
            is_smooth = prover.bounds(patches)[0]
            if is_smooth.all():
                break
            counted[part] += 1
            assert np.flatnonzero(~is_smooth).tolist() == [7]
    assert counted[0] == 1
    assert counted[1] >= 3  # azimuth, slide and hinge


def test_pieces_of_a_surface_meet_its_knots() -> None:
    """And those of a line: of random ones, which are twisted as no cone needs to be."""
    rng = np.random.default_rng(4)
    knots = rng.normal(size=(6, 5, 4))
    pieces = Patches.over(knots)
    corners = [knots[:, :-1, :-1], knots[:, 1:, :-1], knots[:, :-1, 1:], knots[:, 1:, 1:]]
    for (u, v), own in zip(((-1, -1), (1, -1), (-1, 1), (1, 1)), corners, strict=True):
        at = pieces.middle + u * pieces.first + v * pieces.second + u * v * pieces.twist
        np.testing.assert_allclose(at, own.reshape(6, -1), atol=1e-14)
    line = Patches.along(knots[:, 0])
    np.testing.assert_allclose(line.middle - line.first, knots[:, 0, :-1], atol=1e-14)
    np.testing.assert_allclose(line.middle + line.first, knots[:, 0, 1:], atol=1e-14)
    assert not np.any(line.second)


def test_what_is_not_known_is_not_as_demanded() -> None:
    nothing, good = np.array([np.nan, -np.inf]), np.array([1.0, 1.0])
    demand = Demand(0.0, 0.0, 0.1)
    for lacking in range(3):
        values = [nothing if k == lacking else good for k in range(3)]
        for found in (Bounds(*values).lacking(demand), Bounds(*values).lacking(demand, 0.5)):
            assert found.all(axis=0).tolist() == [k == lacking for k in range(3)]
            assert found.any(axis=1).all()
    assert not Bounds(good, -100 * good, good).lacking(demand._replace(clearance=None)).any()


@pytest.mark.parametrize(("mode", "height", "keeps"), [("++ ++ ++", 0.03, "limits"), ("-- -- --", 0.11, "bodies")])
def test_samples_beyond_limits_or_within_bodies_have_no_value(mode: str, height: float, keeps: str) -> None:
    for kept in (True, False):
        settings: Any = {"limits": False, "bodies": False} | {keeps: kept}
        found = plan("azulay", 0.004, height, to=0.2, step=0.1, rolls=8, mode=mode, proof=False, **settings)
        still = np.zeros(2)
        knots = Touch(still, still, still + height, still, np.array([0.0, 0.1]), still)
        values = along(found.rules, knots, np.array([0.0, 1.0]), 0.1).value
        assert np.all((values == -np.inf) if kept else (values > 0.01))


@pytest.mark.parametrize("failing", [2, 100])
def test_ways_are_tried_until_one_is_proven_else_the_first_is_told(failing: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Proofs that fail, each at the middle of the way it is asked for."""
    prove, given = Prover.prove, []

    def fails(self: Prover, patches: Patches, demand: Demand, *rest: Any, **more: Any) -> Any:
        given.append(patches)
        proof = prove(self, patches, demand, *rest, **more)
        there = patches.some([patches.many // 2])
        return proof._replace(is_proven=False, open=there, smallest=0) if len(given) <= failing else proof

    monkeypatch.setattr(Prover, "prove", fails)
    found = plan("azulay", 0.004, 0.121, to=0.3, bodies=False, **COARSE)
    assert found.is_possible
    assert found.knots is not None
    told = given[2 if failing == 2 else 0]
    np.testing.assert_allclose(told.middle - told.first, np.stack(found.knots)[:, :-1], atol=1e-12)
    assert found.is_safe == (failing == 2)
    assert len(given) == (3 if failing == 2 else 1 + TRIES)


def test_two_rings_between_start_and_end_are_not_told_as_different_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both ends lie on one side, and all between on the other: no way of the grid, but nothing is proven."""

    def rings(rules: Any, grid: RollGrid, mask: np.ndarray | None = None) -> Field:
        side = np.full(grid.shape, -1.0)
        side[[0, -1]] = 1.0
        return Field(np.ones(grid.shape), side)

    monkeypatch.setattr("trivet.study.plan.field_of", rings)
    monkeypatch.setattr(stops, "field_of", rings)
    found = plan("azulay", 0.004, 0.121, limits=False, bodies=False, **COARSE)
    assert not found.is_possible
    assert found.stopped_by.startswith("no way of this grid leads around the Type 2 singularities")
    assert "proven" not in found.stopped_by


def test_the_last_ray_of_a_cone_is_the_first_whatever_the_rolls(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a sheet whose rolls change from ray to ray, as those of the machines here do not."""
    columns = np.array([[0, 0, 0], [0, 1, 1], [0, 2, 3], [0, 1, 1], [0, 1, 2], [0, 1, 1]])
    monkeypatch.setattr("trivet.study.cone.highest_sheet", lambda values, stride, told: Sheet(0.3, columns, 2))
    found = cone("azulay", 0.2, 0.004, 0.121, step=0.1, rolls=24, azimuths=6, bodies=False, proof=False)
    heading = found.knots.azimuth + found.knots.roll
    np.testing.assert_allclose(heading[:-1], columns * 2 * np.pi / 24, atol=1e-12)
    np.testing.assert_allclose(heading[-1], heading[0], atol=1e-12)
    np.testing.assert_allclose(found.knots.azimuth[-1], 2 * np.pi, atol=1e-12)
