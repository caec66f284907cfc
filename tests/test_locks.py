"""Lock sets, where to lock for a task, all drives at work: against loops closed here, brute force, differences and laws."""

from __future__ import annotations

import dataclasses
import math
import re
from functools import cache
from itertools import combinations
from typing import Any

import jax
import numpy as np
import pytest
from scipy.optimize import least_squares

import trivet as t
from trivet.errors import InputError, NoResultError
from trivet.kinematics.freedoms import ChainScrews, Sampled
from trivet.kinematics.held import Held, ways
from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import homogenised_inverse
from trivet.kinematics.singularity import condition
from trivet.kinematics.travel import margin
from trivet.model.elements import Drivable
from trivet.space.family import Family
from trivet.space.pose import zyz_frame
from trivet.statics.assembly import PLATFORM, assemble
from trivet.statics.objective import objective
from trivet.statics.structure import structural_stiffness
from trivet.study import lock_search
from trivet.study.epigraph import Epigraph
from trivet.study.lock_advice import LocksAdvised, advise_locks
from trivet.study.lock_best import Search
from trivet.study.lock_grid import Table, starts, table
from trivet.study.lock_measures import Goal, Stiffness, measure
from trivet.study.lock_search import polished, with_best_rolls
from trivet.study.lock_task import task_of
from trivet.study.lock_values import Holding, Poses, looked, over_poses, slopes_at, span, turned
from trivet.study.locks import LockSet, LockSets, lock_sets, with_drives_locked
from trivet.study.pathfile import PathFile, PathPose
from trivet.study.redundant import RedundantPath, redundant_path
from trivet.study.spare_ways import Stretch, way_over_grid
from trivet.vibration.exact import ExactStructure, exact_mesh
from trivet.vibration.response import exact_receptance
from trivet.views import locks as view

AS_IS = {"leg-1.guide": 0.12}
POSES = np.array([[0.0, 0.0, 0.125, 0.3, 0.1, -0.2], [0.003, 0.002, 0.124, 0.5, 0.15, -0.4]])


@cache
def free() -> t.Machine:
    return t.load("rmmt").with_free_drives()


@cache
def sets() -> LockSets:
    return lock_sets("rmmt")


def fewer(*chains: str) -> t.Machine:
    """The prototype with guides that no drive moves, held aside, in all chains but these."""
    machine = t.load("rmmt").with_locks({"leg-1.guide": 0.0, "leg-2.guide": 0.02, "leg-3.guide": -0.03})
    changed = {}
    for name, chain in machine.chains.items():
        guide, *rest = chain.elements
        assert isinstance(guide, Drivable)
        own = dataclasses.replace(guide, locked=None) if name in chains else dataclasses.replace(guide, actuated=False)
        changed[name] = dataclasses.replace(chain, elements=(own, *rest))
    return dataclasses.replace(machine, chains=changed).renamed("fewer")


def path() -> Family:
    poses = [
        PathPose((0.002, 0.001, 0.124), 0.0, math.radians(3), math.radians(8)),
        PathPose((0.004, 0.003, 0.125), math.radians(40), math.radians(6), math.radians(-35)),
        PathPose((-0.002, 0.004, 0.124), math.radians(70), math.radians(4), math.radians(-75)),
    ]
    return t.along_path("rmmt", PathFile(poses), 4)


@cache
def advised(name: str) -> LocksAdvised:
    return advise_locks(fewer("leg-1").with_locks(AS_IS | {"leg-2.guide": 0.02, "leg-3.guide": -0.03}), path(), name)


def to_and_fro() -> Family:
    """From one side of the first chain to the other: its spare drive is wanted at opposite ends."""
    there, back = PathPose((0.0, 0.004, 0.125), 0.0, 0.0, 0.3), PathPose((0.0, -0.004, 0.125), 0.0, 0.0, -0.3)
    return t.along_path("rmmt", PathFile([there, back]), 4)


@cache
def redundant() -> RedundantPath:
    return redundant_path(fewer("leg-1"), to_and_fro(), "K_zz")


# Closure of the prototype's loops, written down once more: circle, cross slide, radial slide, hinge, link, ball.


def turn(axis: int, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    made = np.eye(3)
    made[i, i], made[j, j], made[i, j], made[j, i] = c, c, -s, s
    return made


def end_of(leg: int, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the chain ends and how its link stands there after the ball's three turns."""
    guide, cross, slide, hinge, *ball = q
    frame = turn(2, 2 * math.pi * leg / 3 + guide)
    along = np.array([0.15 + slide, cross, 0.0]) + turn(1, hinge) @ np.array([-0.216, 0.0, 0.0])
    return frame @ along, frame @ turn(1, hinge) @ turn(0, ball[0]) @ turn(1, ball[1]) @ turn(2, ball[2])


def gap(leg: int, q: np.ndarray, place: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Twelve numbers, zero where the chain meets its joint on the platform."""
    end, stands = end_of(leg, q)
    seat = place + axes @ turn(2, 2 * math.pi * leg / 3) @ np.array([0.018, 0.0, 0.0])
    return np.concatenate([(end - seat) / 0.018, (stands - axes).ravel()])


@cache
def loops() -> np.ndarray:
    """(36, 27) slopes of all gaps by the 21 joint coordinates and the platform's six, at a closed place picked at random."""
    random = np.random.default_rng(5)
    place, axes = np.array([0.003, -0.002, 0.124]), turn(2, 0.4) @ turn(1, 0.2) @ turn(2, -0.3)
    start = [0.0, 0.0, 0.044, 0.6, 0.0, -0.6, 0.0]
    slopes = np.zeros((36, 27))
    for leg in range(3):
        first = np.array(start) + random.uniform(-1, 1, 7) * np.array([0.2, 0.01, 0.002, 0.05, 0.1, 0.1, 0.1])
        found = least_squares(lambda q, leg=leg: gap(leg, q, place, axes), first, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert np.abs(found.fun).max() < 1e-9
        assert abs(found.x[1]) > 1e-4  # no singular place of the cross slide
        for j in range(7):
            step = np.zeros(7)
            step[j] = 1e-6
            ahead, behind = (gap(leg, found.x + s * step, place, axes) for s in (1, -1))
            slopes[12 * leg : 12 * leg + 12, 7 * leg + j] = (ahead - behind) / 2e-6
        for j in range(6):
            sides = []
            for s in (1e-6, -1e-6):
                moved, turned_axes = place.copy(), axes
                if j < 3:
                    moved[j] += 0.018 * s
                else:
                    turned_axes = turn(j - 3, s) @ axes
                sides.append(gap(leg, found.x, moved, turned_axes))
            slopes[12 * leg : 12 * leg + 12, 21 + j] = (sides[0] - sides[1]) / 2e-6
    return slopes


def rank(matrix: np.ndarray) -> int:
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(values > 1e-6 * max(values.max(initial=0.0), 1e-300)))


def null_space(matrix: np.ndarray) -> np.ndarray:
    _, values, rows = np.linalg.svd(matrix)
    return rows[int(np.sum(values > 1e-7 * values[0])) :].T


def test_all_lock_sets_of_the_prototype_by_its_closed_loops() -> None:
    found = sets()
    assert (len(found.sets), found.spare, found.symmetry, len(found.whole)) == (84, 3, 3, 27)
    assert len({one.group for one in found.whole}) == 11
    slopes = loops()
    names = {
        f"leg-{leg + 1}.{joint}": 7 * leg + j for leg in range(3) for j, joint in enumerate(("guide", "tangential", "radial"))
    }
    assert list(names) == list(found.drives)
    for one, chosen in zip(found.sets, combinations(names, 3), strict=True):
        assert one.drives == chosen
        kept = [k for k in range(27) if k not in [names[n] for n in chosen]]
        motions = np.zeros((27, 0)) if not kept else np.zeros((27, null_space(slopes[:, kept]).shape[1]))
        motions[kept] = null_space(slopes[:, kept])
        platform = rank(motions[21:])
        assert one.platform == platform, one
        alone = motions.shape[1] - platform
        assert sum(one.loose.values()) == alone, one
        stopped = [k for k in kept if k not in names.values()]
        assert one.is_whole == (platform == 6 and motions.shape[1] == 6 and null_space(slopes[:, stopped]).shape[1] == 0)


def test_a_set_says_what_it_takes() -> None:
    told = {one.drives: one for one in sets().sets}
    two = told["leg-1.guide", "leg-1.tangential", "leg-2.guide"]
    assert two.verdict == "leg-1 stops motion along (0.00, 1.00, 0.00) through (18.0, 0.0, 125.0) mm; leg-3 moves by itself"
    three = told["leg-1.guide", "leg-1.tangential", "leg-1.radial"]
    assert three.verdict == "leg-1 takes 2 freedoms of the platform; leg-2 moves by itself; leg-3 moves by itself"
    assert three.platform == 4


def test_groups_are_turns_of_the_machine() -> None:
    for own in sets().groups.values():
        shifted = {
            tuple(sorted(f"leg-{(int(n[4]) - 1 + k) % 3 + 1}{n[5:]}" for n in own[0].drives)) for k in range(3)
        }  # fmt: skip
        assert {tuple(sorted(one.drives)) for one in own} == shifted


def test_a_singular_pose_does_not_decide() -> None:
    """Two chains of six joints, of which two coincide at one of two poses."""
    whole = np.eye(6)
    flat = whole[:, [0, 1, 2, 3, 4, 4]]
    chains = [(ChainScrews(tuple("abcdef"), (), columns),) * 2 for columns in (flat, whole)]
    pose = zyz_frame((0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
    for order in (chains, chains[::-1]):
        sampled = Sampled(free(), (pose, pose), tuple(order))
        assert sampled.freedoms([(), ()]) == (6, (0, 0))
        assert sampled.screws[sampled.generic(0, ())] is chains[1]
        alone = sampled.freedoms([(), ()], first_alone=True)
        assert alone == ((6, (0, 0)) if order[0] is chains[1] else (5, (1, 1)))


@pytest.mark.parametrize("chains", [("leg-1",), ("leg-1", "leg-2")])
def test_machines_with_seven_and_eight_drives(chains: tuple[str, ...]) -> None:
    found = lock_sets(fewer(*chains))
    spare = len(chains)
    assert (len(found.drives), found.spare, found.symmetry) == (6 + spare, spare, 1)
    assert len(found.whole) == 3**spare
    assert all({name.partition(".")[0] for name in one.drives} == set(chains) for one in found.whole)
    held = with_drives_locked(found.machine, {found.whole[0].drives[0]: 0.01})
    guides = {leg.name: leg.chain.elements[0] for leg in held.legs}
    assert all(isinstance(guide, Drivable) for guide in guides.values())
    asides = {name: guide.locked for name, guide in guides.items() if isinstance(guide, Drivable)}
    assert asides["leg-1"] == 0.01
    assert asides["leg-3"] == pytest.approx(-0.03)  # a guide without a drive stays held
    beside = with_drives_locked(found.machine, {"leg-3.radial": 0.04}).chains["leg-3"].elements[0]
    assert isinstance(beside, Drivable)
    assert beside.locked == pytest.approx(-0.03)  # in a chain that is named too


def test_drives_that_are_redundant_in_force_cannot_be_locked() -> None:
    """A driven hinge beside guide and slide: seven drives, yet every chain has the platform's six freedoms only."""
    machine = t.load("azulay")
    (name, chain), = machine.chains.items()  # fmt: skip
    driven: Any = tuple(e if e.name != "hinge" else dataclasses.replace(e, actuated=True) for e in chain.elements)  # type: ignore[arg-type]
    machine = dataclasses.replace(machine, chains={name: dataclasses.replace(chain, elements=driven)})
    found = lock_sets(machine)
    assert (found.spare, found.whole) == (3, ())
    with pytest.raises(NoResultError, match="no set of 3 locked drives leaves six freedoms"):
        advise_locks(machine, POSES)


def held_at(joints: tuple[str, ...], guides: tuple[float, ...]) -> tuple[tuple[Held, ...], np.ndarray]:
    """Every chain held by one drive, where that stands at the first pose with the guide at an angle."""
    machine, frames = free(), zyz_frame(POSES[:1, :3], POSES[:1, 3], POSES[:1, 4], np.zeros(1))
    chosen, values = [], []
    for leg, (joint, guide) in enumerate(zip(joints, guides, strict=True)):
        own = ways(machine, leg, ("guide",))[0].coordinates(np.array([[guide]]), frames, POSES[:1, 5])
        cross = float(own[f"leg-{leg + 1}.tangential"][0])
        signs = {"guide": (1.0, 1.0), "tangential": (1.0, 1.0), "radial": (math.copysign(1.0, cross), 1.0)}[joint]
        chosen.append(next(way for way in ways(machine, leg, (joint,)) if way.signs == signs))
        values.append(float(own[f"leg-{leg + 1}.{joint}"][0]))
    return tuple(chosen), np.array(values)


def task() -> Poses:
    return task_of(POSES).poses


MIXED = ("guide", "radial", "tangential"), (0.05, -0.12, 0.2)


@pytest.mark.parametrize("kind", [MIXED, (("radial",) * 3, (0.1, -0.2, 0.15))])
def test_the_locked_machine_stands_at_its_locks(kind: Any) -> None:
    chosen, values = held_at(*kind)
    x, y, z, azimuth, tilt, roll = POSES[0].tolist()
    for way, v in zip(chosen, values, strict=True):
        frames = zyz_frame(POSES[:1, :3], POSES[:1, 3], POSES[:1, 4], np.zeros(1))
        own = way.coordinates(np.array([[v]]), frames, POSES[:1, 5])
        assert own[way.drives[0]][0] == pytest.approx(v, abs=1e-12)
        seat = next(int(leg.name[4]) - 1 for leg in free().legs if leg.name == way.leg.name)
        q = np.array([float(own[f"{way.leg.name}.{n}"][0]) for n in ("guide", "tangential", "radial")])
        # With hinge from the height alone, the chain as written down above ends in its joint on the platform.
        axes = turn(2, azimuth) @ turn(1, tilt) @ turn(2, roll)
        point = np.array([x, y, z]) + axes @ turn(2, 2 * math.pi * seat / 3) @ np.array([0.018, 0.0, 0.0])
        hinge = math.asin(point[2] / 0.216)
        end, _ = end_of(seat, np.array([*q, hinge, 0.0, 0.0, 0.0]))
        assert end == pytest.approx(point, abs=1e-12)


def test_pieces_together_are_the_locked_machine() -> None:
    """Stiffness by the structure of the machine, which knows nothing of screws; the rest from the machine's own kernels."""
    chosen, values = held_at(*MIXED)
    names = [name for way in chosen for name in way.drives]
    locked = with_drives_locked(free(), dict(zip(names, values.tolist(), strict=True)))
    signs, poses = np.array([way.signs for way in chosen]), task().some(np.array([1]))
    assert poses.rolls is not None
    pose = jax.tree.map(lambda c: float(c[0]), turned(poses.frames, poses.rolls))
    margins = [float(margin(leg, inverse(leg, pose, signs[k]), pose)) for k, leg in enumerate(locked.legs)]
    near = condition(locked, pose, signs)
    assert np.linalg.cond(np.linalg.solve(near.rows.j_q, near.rows.j_x) * [1, 1, 1, *[1 / 0.018] * 3]) < 1e3  # full rank
    expected = {
        "K_zz": structural_stiffness(locked, pose, signs)[2, 2],
        "sigma_min": float(near.sigma_min),
        "travel": min(margins),
        "1/rate": 1 / np.linalg.norm(np.asarray(homogenised_inverse(locked, pose, signs)), axis=1).max(),
    }
    for name, wanted in expected.items():
        found, own = looked(measure(free(), Goal(name)), chosen, values[None], poses.frames, poses.rolls)
        assert found.min() == pytest.approx(wanted, rel=1e-6 if name == "K_zz" else 1e-9), name
        assert own[0] == pytest.approx(margins, rel=1e-9)


def test_a_drive_at_work_yields_as_one_that_is_locked() -> None:
    """Least dynamic stiffness of the free machine as it stands; of the locked one by its matrices between all nodes."""
    chosen, values = held_at(*MIXED)
    names = [name for way in chosen for name in way.drives]
    poses = task().some(np.array([0]))
    assert poses.rolls is not None
    low, high = 50.0, 300.0
    found, _ = looked(measure(free(), Goal("D_zz", low, high)), chosen, values[None], poses.frames, poses.rolls)
    locked = with_drives_locked(free(), dict(zip(names, values.tolist(), strict=True)))
    pose = jax.tree.map(lambda c: float(c[0]), turned(poses.frames, poses.rolls))
    mesh = exact_mesh(assemble(locked, pose, np.array([way.signs for way in chosen])), 2 * math.pi * high)
    row, whole = mesh.rows(PLATFORM)[2:3], ExactStructure(mesh)
    first = np.linspace(low, high, 301)
    top = first[np.argmax(np.abs(exact_receptance(whole, row, row, first, 0.02)).ravel())]
    size = np.abs(exact_receptance(whole, row, row, np.linspace(top - 1, top + 1, 201), 0.02)).ravel()
    assert 1 / size.max() == pytest.approx(found[0, 0], rel=1e-6)
    assert 1 / size.max() >= found[0, 0] * (1 - 1e-9)


@pytest.mark.parametrize("name", ["K_zz", "D_zz", "sigma_min", "travel", "1/rate"])
def test_slopes_by_differences(name: str) -> None:
    chosen, values = held_at(*MIXED)
    asked, poses = measure(free(), Goal(name, 50.0, 300.0)), task()
    assert poses.rolls is not None
    both, by_roll = np.tile(values, (2, 1)), not asked.is_costly  # of a dynamic stiffness rolls are known
    near = 1e-5 if by_roll else 1e-4  # a value that was sought over frequency is not as smooth
    by, margins = slopes_at(asked, chosen, both, poses.frames, poses.rolls, by_roll)
    for v in range(by.shape[-1]):
        step, aside = 1e-6 * np.eye(4)[v, :3], 1e-6 * (v == 3)
        ahead, behind = (looked(asked, chosen, both + s * step, poses.frames, poses.rolls + s * aside) for s in (1, -1))
        assert by[..., v] == pytest.approx((ahead[0] - behind[0]) / 2e-6, rel=near, abs=near / 10 * np.abs(by).max())
        assert margins[..., v] == pytest.approx((ahead[1] - behind[1]) / 2e-6, rel=1e-5, abs=1e-6 * np.abs(margins).max())


def least_of(found: LocksAdvised, chosen: tuple[Held, ...], coordinates: Any, rows: Any) -> np.ndarray:
    """(m,) the least over poses (p, 6), at coordinates (m, d) of the spare drives."""
    poses = task_of(rows).poses
    assert poses.rolls is not None
    return over_poses(found.measure, chosen, np.array(coordinates), poses.frames, poses.rolls).min(axis=1)


def test_slopes_of_what_is_met_by_differences() -> None:
    """Of two coefficients per spare drive, rolls that are free, and the least."""
    (chosen, values), frames = held_at(*MIXED), task().frames
    program = Epigraph(measure(free(), Goal("travel")), chosen, Poses(frames, None), np.array([[0.8, 0.2], [0.3, 0.7]]), 0.5)
    x = np.array([*np.tile(values / span(chosen), 2) * np.repeat([1, 0.9], 3), -0.2, -0.4, 0.3])
    slopes = program.slopes(x)
    assert slopes.shape == (12, len(x))
    for v, step in enumerate(1e-6 * np.eye(len(x))):
        assert slopes[:, v] == pytest.approx((program.spare(x + step) - program.spare(x - step)) / 2e-6, rel=1e-5, abs=1e-6)
    assert np.count_nonzero(np.abs(slopes[:, 6:8]).max(axis=0) > 1e-3) == 2


@pytest.mark.parametrize("name", ["K_zz", "travel"])
def test_brute_force_finds_nothing_better(name: str) -> None:
    found, family = advised(name), path()
    fine = _rows(family, np.linspace(1, 3, 33))
    for advice in found.reached:
        assert advice.holding is not None
        chosen, best = advice.holding.ways, -np.inf
        for way in ways(found.machine, 0, chosen[0].joints):
            grid = np.linspace(way.low, way.high, 401)
            best = max(best, float(least_of(found, (way, *chosen[1:]), grid, fine).max()))
        assert advice.value >= best * (1 - 1e-6), (name, advice.locks.name)
        # Between the poses that were looked at nothing is much worse.
        assert least_of(found, chosen, [advice.holding.values], fine) == pytest.approx([advice.value], rel=1e-3)
        assert advice.worst is not None
        worst = [[*advice.worst.position, *advice.worst.angles]]
        assert least_of(found, chosen, [advice.holding.values], worst) == pytest.approx([advice.value], rel=1e-9)
    greatest = max(advice.value for advice in found.reached)
    values = [advice.value for advice in found.reached[len(found.equal) :]]
    assert values == sorted(values, reverse=True)
    assert all(advice.value >= greatest * (1 - 1e-3) for advice in found.equal)
    assert all(value < greatest * (1 - 1e-3) for value in values)


@pytest.mark.parametrize("name", ["K_zz", "travel"])
def test_the_locks_of_the_file_stand_beside_the_best(name: str) -> None:
    found, at = advised(name), path().coordinates[:, 0]
    rows = _rows(path(), np.concatenate([at, (at[1:] + at[:-1]) / 2]))
    holding = next(advice.holding for advice in found.reached if advice.locks.drives == tuple(AS_IS))
    assert holding is not None
    assert least_of(found, holding.ways, [[*AS_IS.values()]], rows) == pytest.approx([found.as_is], rel=1e-9)
    assert found.best.value >= found.as_is


def _rows(family: Family, at: np.ndarray) -> list[list[float]]:
    places = family.places(at[:, None])
    assert places.roll is not None
    return np.column_stack([places.position, places.azimuth, places.tilt, places.roll]).tolist()


def test_copies_give_equal_values_where_the_task_is_alike() -> None:
    own = next(group for group in sets().groups.values() if group[0].is_whole and len(group) == 3)
    search = Search(free(), measure(free(), Goal("K_zz")), task_of([[0.0, 0.0, 0.125, 0.0, 0.0, 0.1]]), None)
    values = [search.advise(one).value for one in own]
    assert values == pytest.approx([values[0]] * 3, rel=1e-6)


class Costly(Stiffness):
    is_costly = True


def test_what_costs_much_is_not_looked_around(monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[bool] = []
    monkeypatch.setattr(lock_search, "_around", lambda asked, start, poses: looks.append(asked.is_costly) or start)
    chosen, values = held_at(("guide",) * 3, (0.05, -0.12, 0.2))
    for kind in (Stiffness, Costly):
        start = Holding(chosen, values, POSES[:1, 5], np.zeros(1))
        assert polished(kind(objective("K_zz")), [start], task().some(np.array([0]))).value > 0
    assert looks == [False]
    assert measure(free(), Goal("D_zz")).is_costly


def to_and_fro_between() -> tuple[Search, LockSet]:
    """There is the task, and back lies between its poses; for the guide of the first chain."""
    there, back = _rows(to_and_fro(), np.array([1.0, 2.0]))
    task = dataclasses.replace(task_of([there]), between=task_of([back]).places)
    machine = fewer("leg-1").with_free_drives()
    own = next(one for one in lock_sets(machine).whole if one.drives == ("leg-1.guide",))
    return Search(machine, measure(machine, Goal("K_zz")), task, None), own


def test_a_pose_between_that_is_worse_joins_the_search() -> None:
    search, own = to_and_fro_between()
    both = dataclasses.replace(search.task, places=task_of(_rows(to_and_fro(), np.array([1.0, 2.0]))).places)
    wanted = Search(search.machine, search.asked, both, None).advise(own)
    assert search.advise(own).value == pytest.approx(wanted.value, rel=1e-6)
    locked = search.machine.with_locks({"leg-1.guide": 0.2, "leg-2.guide": 0.02, "leg-3.guide": -0.03})
    alone = Search(search.machine, search.asked, task_of([_rows(to_and_fro(), np.array([1.0]))[0]]), None)
    sets = lock_sets(search.machine)
    both_ways, there = search.as_is(locked, sets), alone.as_is(locked, sets)
    assert both_ways is not None
    assert there is not None
    assert both_ways.value < there.value * (1 - 1e-6)


def test_the_search_begins_at_places_that_are_apart() -> None:
    search, own = to_and_fro_between()
    tables = [table for held in search.ways(own) if isinstance(table := search.table(held), Table)]
    begun = starts(search.asked, tables, search.task.poses)
    assert len(begun) == 3
    guides = np.array([holding.values[0] for holding in begun if holding.ways == begun[0].ways])
    gaps = np.abs(guides[:, None] - guides)[np.triu_indices(len(guides), 1)]
    assert len(gaps)
    assert gaps.min() > 0.1 * math.radians(40)


def test_rolls_that_are_free_are_best_at_every_pose() -> None:
    family = t.over_hemisphere(0.121, 0.004, 1)
    found = advise_locks(fewer("leg-1"), family, "K_zz")
    assert found.task.roll == "best"
    holding = found.best.holding
    assert holding is not None
    turns = np.linspace(0, 2 * math.pi, 360, endpoint=False)
    for pose in range(len(found.task.poses)):
        one = found.task.poses.some(np.full(360, pose))
        values = over_poses(found.measure, holding.ways, holding.values[None], one.frames, turns)[0]
        assert holding.least[pose] >= values.max() * (1 - 1e-9)
    level = with_best_rolls(found.measure, holding._replace(values=holding.values * 0.5), found.task.poses)
    assert level.value <= found.best.value * (1 + 1e-9)


def test_advice_names_the_pose_and_the_joint_that_is_not_reached() -> None:
    turned_far = [[0.0, 0.0, 0.125, 0.0, 0.0, 0.0], [0.0, 0.0, 0.125, 0.0, 0.0, 0.9]]
    found = advise_locks(fewer("leg-1"), turned_far, "travel")
    lost = {advice.locks.name: advice for advice in found.advices if advice.holding is None}
    for drive in ("leg-1.tangential", "leg-1.radial"):
        assert "leg-1.guide at" in lost[drive].reason or "cannot close" in lost[drive].reason
        missed = lost[drive].missed
        assert missed is not None
        assert missed.angles[2] in (0.0, 0.9)
    assert found.best.locks.name == "leg-1.guide"
    with pytest.raises(
        NoResultError, match=r"no lock set reaches all of the task \(2 poses\); with leg-1\.\w+: leg-\d\.\w+ at .* its limit of"
    ):
        advise_locks(fewer("leg-1"), [turned_far[0], [0.08, 0.0, 0.125, 0.0, 0.0, 0.0]], "travel")


def test_all_drives_at_work_are_between_the_best_locks_and_every_pose_by_itself() -> None:
    found = redundant()
    known = np.isfinite(found.alone)
    assert known.sum() == len(found.along) // 2 + 1
    assert found.least >= found.locked_least
    assert np.all(found.value[known] <= found.alone[known] * (1 + 1e-9))
    assert found.least <= found.bound * (1 + 1e-9)
    assert found.least > found.locked_least * 1.0005  # it is worth something here
    assert found.locked_least == pytest.approx(found.fixed.best.value, rel=1e-3)


def test_what_a_pose_allows_by_itself_by_brute_force() -> None:
    found = redundant()
    holding = found.fixed.best.holding
    assert holding is not None
    for k in (0, 6):
        row = _rows(to_and_fro(), found.along[[k]])
        best = -np.inf
        for way in (way for joint in ("guide", "tangential", "radial") for way in ways(found.machine, 0, (joint,))):
            grid = np.linspace(way.low, way.high, 201)
            best = max(best, float(least_of(found.fixed, (way, *holding.ways[1:]), grid, row).max()))
        assert best * (1 - 1e-9) <= found.alone[k] < best * (1 + 1e-3)
    assert found.alone[6] > found.value[6] * (1 + 1e-6)


def test_drives_along_a_path_stand_where_the_platform_is_and_keep_to_their_rate() -> None:
    found = redundant()
    columns = {name: found.coordinates[:, k] for k, name in enumerate(found.drives)}
    part = found.along - 1
    for name in found.spare:
        joint = next(e for leg in found.machine.legs for e in leg.chain.elements if f"{leg.name}.{e.name}" == name)
        assert isinstance(joint, Drivable)
        assert joint.travel is not None
        rates = np.abs(np.diff(columns[name]) / np.diff(part)) / (joint.travel[1] - joint.travel[0])
        assert rates.max() <= found.rate * (1 + 1e-6)
    assert found.places.roll is not None
    for k in (0, 5):
        angles = found.places.azimuth[k], found.places.tilt[k], found.places.roll[k]
        held = with_drives_locked(found.machine, {"leg-1.guide": float(columns["leg-1.guide"][k])})
        pose = jax.tree.map(float, zyz_frame(found.places.position[k], *angles))
        assert structural_stiffness(held, pose, np.ones((3, 2)))[2, 2] == pytest.approx(found.value[k], rel=1e-6)


def test_no_way_over_the_grid_is_above_the_best_one() -> None:
    found, rate = redundant().fixed, 0.5
    assert found.best.holding is not None
    chosen, part = found.best.holding.ways, np.linspace(0, 1, 9)
    stretch = Stretch(part, task_of(_rows(to_and_fro(), part + 1)).poses)
    way = way_over_grid(found.measure, chosen, stretch, rate)
    assert way is not None
    line = np.linspace(chosen[0].low, chosen[0].high, 15)
    heights = over_poses(found.measure, chosen, line, stretch.poses.frames, stretch.rolls)
    cells = np.abs(line - way[:, 0]).argmin(axis=0)
    assert line[cells] == pytest.approx(way)
    least, far = heights[cells, np.arange(9)].min(), int(rate * 14 / 8 + 1e-9) or 1
    assert np.abs(np.diff(cells)).max() <= far
    reached = np.ones(15, dtype=bool)  # where a way could be that is better all along
    for height in heights.T:
        reached = np.array([reached[max(k - far, 0) : k + far + 1].any() for k in range(15)]) & (height > least * (1 + 1e-12))
    assert not reached.any()
    assert least > heights.min(axis=1).max()  # which stands still


def test_a_slower_drive_gives_less() -> None:
    slow = redundant_path(fewer("leg-1"), to_and_fro(), "K_zz", rate=0.3)
    guide = slow.coordinates[:, slow.drives.index("leg-1.guide")]
    rates = np.abs(np.diff(guide) / np.diff(slow.along - 1)) / math.radians(40)
    assert rates.max() <= 0.3 * (1 + 1e-6)
    assert rates.max() > 0.2
    assert slow.locked_least < slow.least < redundant().least


def test_the_end_of_a_travel_that_binds_is_named() -> None:
    found = advise_locks(fewer("leg-1"), [[0.0, 0.004, 0.125, 0.0, 0.0, 0.3]], "K_zz")
    own = next(advice for advice in found.reached if advice.locks.name == "leg-1.guide")
    assert own.coordinates["leg-1.guide"] == pytest.approx(math.radians(20))
    assert [one.joint for one in own.binding] == ["leg-1.guide"]
    (told,) = next(one for one in view.as_json(found)["advice"] if one["drives"] == ["leg-1.guide"])["binding"]
    assert (told["joint"], told["travel_margin"]) == ("leg-1.guide", pytest.approx(0, abs=1e-9))
    assert (told["position_m"][1], told["roll_rad"]) == pytest.approx((0.004, 0.3))


TRAVELS = {"guide": (-20, 20), "tangential": (-32.5, 32.5), "radial": (0, 65), "hinge": (5, 70)}
"""Of the prototype's joints, deg or mm."""


def test_a_chain_says_which_limit_stops_it() -> None:
    """Wherever a chain is held: what is told is on the wrong side of a limit of the joint that is told."""
    told = set()
    low, middle, high = (-0.04, 0.0, 0.015), (0.0, 0.0, 0.125), (0.14, 0.0, 0.2155)
    for joint, place in (("guide", middle), ("tangential", middle), ("radial", middle), ("guide", low), ("guide", high)):
        frame = zyz_frame(place, 0.3, 0.0, -0.3)
        for way in ways(free(), 0, (joint,)):
            for part in np.linspace(-1, 2, 13):
                words = way.miss(way.low + part * (way.high - way.low), frame)
                match = re.fullmatch(r"leg-1\.(\w+) at (\S+) (?:mm|deg) is (below|above) its limit of (\S+) (?:mm|deg)", words)
                if match is None:
                    assert not words or re.match(r"leg-1 cannot close \(off by \S+ mm\)", words)
                    continue
                name, value, side, limit = match.groups()
                end = TRAVELS[name][side == "above"]
                assert float(limit) == pytest.approx(end, rel=1e-3, abs=1e-9), words
                assert (float(value) - end) * (1 if side == "above" else -1) > 0, words
                told.add((name, side))
    sides = {("guide", "below"), ("guide", "above"), ("radial", "below"), ("hinge", "below"), ("hinge", "above")}
    assert sides <= told


def test_one_working_mode_where_one_is_wanted() -> None:
    every = [way.signs for way in ways(free(), 0, ("radial",))]
    assert len(set(every)) == 4
    for signs in every:
        assert [way.signs for way in ways(free(), 0, ("radial",), np.array(signs))] == [signs]


def test_a_window_narrower_than_the_grid_is_found() -> None:
    """Two poses so far apart that the cross slide reaches both with the guide within 0.3 degrees of a half, about."""
    way = next(way for way in ways(free(), 0, ("guide",)) if way.signs == (1.0, 1.0))
    middle, aside = 0.018 * math.sin(math.radians(0.5)), 0.0325 - 0.018 * math.sin(math.radians(0.3))
    far = task_of([[0.0, middle + s * aside, 0.125, 0.0, 0.0, 0.0] for s in (1, -1)]).poses
    found = table(measure(free(), Goal("travel")), [way], far)
    assert isinstance(found, Table)
    degrees = np.degrees(found.values)
    assert np.all((degrees > 0.1) & (degrees < 0.9))


def test_a_task_and_what_lies_between() -> None:
    own, at = task_of(path()), path().coordinates[:, 0]
    halfway = _rows(path(), (at[1:] + at[:-1]) / 2)
    places = own.between
    assert places.roll is not None
    assert np.column_stack([places.position, places.azimuth, places.tilt, places.roll]) == pytest.approx(np.array(halfway))
    against = task_of(t.over_hemisphere(0.121, 0.004, 2), "-alpha")
    for places in (against.places, against.between):
        assert places.roll == pytest.approx(-places.azimuth)
        assert len(set(np.round(places.azimuth, 6))) > 3
    assert [measure(free(), Goal(name)).unit for name in ("D_zz", "D_z_rz", "D_rz_rz")] == ["N/m", "N/rad or N", "N m/rad"]


def refused(match: str, call: Any) -> None:
    with pytest.raises((InputError, NoResultError), match=match) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_wrong_input_is_told() -> None:
    machine = fewer("leg-1")
    refused("azulay: has 6 drives, none to spare", lambda: lock_sets("azulay"))
    refused("objective 'K_xy' is not known; did you mean", lambda: advise_locks(machine, POSES, "K_xy"))
    refused("wants rolls that are known", lambda: advise_locks(machine, t.over_hemisphere(0.121, 0.004, 2), "D_xx"))
    refused("have rolls of their own", lambda: advise_locks(machine, POSES, roll="best"))
    refused("expected an angle", lambda: advise_locks(machine, t.over_hemisphere(0.121, 0.004, 2), roll="half"))
    refused("poses: a list of", lambda: advise_locks(machine, [[0.0, 0.0]]))
    refused("poses: a list of", lambda: advise_locks(machine, []))
    refused("modes 'some': expected all, or own", lambda: advise_locks(machine, POSES, modes="some"))  # type: ignore[arg-type]
    refused("this is none", lambda: redundant_path(machine, t.over_hemisphere(0.121, 0.004, 2)))
    refused("rate: 0 travels", lambda: redundant_path(machine, path(), rate=0.0))
    bare: Any = dataclasses.replace(machine.chains["leg-1"].elements[0], travel=None)  # type: ignore[arg-type]
    chain = dataclasses.replace(machine.chains["leg-1"], elements=(bare, *machine.chains["leg-1"].elements[1:]))
    untold = dataclasses.replace(machine, chains=machine.chains | {"leg-1": chain})
    refused("chains.leg-1.guide: has no travel", lambda: ways(untold.with_free_drives(), 0, ("guide",)))
