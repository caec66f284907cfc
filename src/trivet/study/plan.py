"""Getting there: rolls along a path, and working modes, that keep off singularities, ends of travel and collisions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.jacobian import require_six_each
from trivet.kinematics.mode import all_modes, closed_form_signs, mode_text
from trivet.kinematics.report import joint_states, shortfall
from trivet.model import Machine, dimensions
from trivet.model.check import check
from trivet.reach.certificate import Demand, Patches, Proof, Prover
from trivet.reach.margins import control, nearest_bodies, travel_margin
from trivet.reach.neutral import Reference, with_neutral
from trivet.reach.scene import scene_of
from trivet.reach.touch import Touch
from trivet.space.batches import in_batches
from trivet.study.machines import MachineLike, choose
from trivet.study.pathfile import PathFile
from trivet.study.roll_grid import (
    RESERVE_GAP,
    RESERVE_TRAVEL,
    Aim,
    Along,
    Field,
    RollGrid,
    Rules,
    along,
    best_way,
    degrees_of,
    field_of,
    frames_of,
    refined,
    simplified,
    some,
)
from trivet.study.tilt import ball_of, sphere_of

Array = NDArray[Any]

TO, STEP, ROLLS = math.radians(90.0), math.radians(1.0), 180
LARGEST_GRID = 5_000_000
"""Poses, at most."""
SHARE = 0.8
"""Of the least sigma_min along a plan, which is to be proven when nothing else is asked for."""
TRIES = 4
"""Further ways that are tried where one cannot be proven."""
BUDGET = 200_000
"""Patches of a proof, at most."""
PIECES, NOT_ZERO = 24, 1e-3
"""Of a whole turn of the roll, and sigma_min, with which it is proven that no pose of an end is singular."""
SIGMA = Aim("sigma_min", None, 1.0)


@dataclass(frozen=True)
class Plan:
    """The best way along a path in one working mode, or why there is none."""

    rules: Rules
    mode: str
    neutral: Reference
    grid: RollGrid
    start: Array
    """(rows, columns) where the way may begin."""
    field: Field
    """Over the grid."""
    knots: Touch | None
    """(k,) corners of the way, straight between them in these coordinates; None where there is none."""
    places: Array | None
    """(k,) where they are along the rows of the grid."""
    bottleneck: float
    """The least value on the widest way over the grid; NaN for none."""
    is_steady: bool
    """Whether the way never goes back along the path."""
    highest: int
    """The last row of the grid to which a way leads from the start; -1 for none."""
    stopped_by: str
    """What keeps it from the end; empty where nothing does."""
    proof: Proof | None
    """That limits, clearance and control hold all along; None where there is no way, or no proof was asked for."""

    @property
    def machine(self) -> Machine:
        """The machine, its neutral axes as they were taken."""
        return self.rules.machine

    @property
    def is_possible(self) -> bool:
        """Whether a way leads to the end."""
        return self.knots is not None

    @property
    def is_safe(self) -> bool:
        """Whether it is proven that the way is free."""
        return self.proof is not None and self.proof.is_proven

    @cached_property
    def along(self) -> Along | None:
        """What is met along the way, at samples."""
        if self.knots is None or self.places is None:
            return None
        return along(self.rules, self.knots, self.places, self.grid.step)

    @property
    def value(self) -> float:
        """The least value along the way; NaN for none."""
        return math.nan if self.along is None else float(self.along.value.min())

    @property
    def sigma_min(self) -> float:
        """The least along the way; NaN for none."""
        return math.nan if self.along is None else float(self.along.sigma_min.min())

    @property
    def travel(self) -> float:
        """The least margin of travel along the way; NaN for none."""
        return math.nan if self.along is None else float(self.along.travel.min())

    @property
    def clearance(self) -> float:
        """The least distance of bodies along the way (m), infinite where none is looked at; NaN for none."""
        return math.nan if self.along is None else float(self.along.clearance.min())

    @property
    def worst(self) -> int:
        """Which sample of `along` has the least value."""
        return -1 if self.along is None else int(self.along.value.argmin())

    @cached_property
    def sides(self) -> Array:
        """(rows, columns) sign of det J_x whatever limits and bodies; NaN where a chain does not close."""
        rows, columns = np.indices(self.grid.shape)
        poses = frames_of(self.grid.at(rows.ravel(), columns.ravel()), self.rules.radius)
        return control(self.machine, poses, self.rules.signs).side.reshape(self.grid.shape)


@dataclass(frozen=True)
class PlanStudy:
    """Plans of machines on spheres in working modes, the best first."""

    plans: tuple[Plan, ...]


def plan(
    machine: MachineLike,
    radius: float | None = None,
    height: float | None = None,
    *,
    to: float = TO,
    azimuth: float = 0.0,
    start_roll: float | None = None,
    mode: str | None = None,
    neutral: Reference = "as-described",
    aims: Sequence[Aim] = (SIGMA,),
    limits: bool = True,
    bodies: bool = True,
    solid: bool = False,
    step: float = STEP,
    rolls: int = ROLLS,
    proof: bool = True,
    sigma: float | None = None,
    progress: Callable[[int, int], None] = lambda looked, left: None,
) -> Plan:
    """How a machine tilts on a sphere without meeting a singularity, the end of a joint's travel or a collision.

    Of all ways over a grid of tilts and rolls the one whose least value is greatest is taken, sought again on finer grids about
    it, and proven between its poses (`trivet.reach.certificate`).

    Args:
        machine: machine, name or file; six drives, chains with closed form.
        radius: of the sphere, m; that of the workpiece when not given.
        height: of its centre above {O}, on the z axis, m; that of the workpiece when not given.
        to: the tilt to get to, from zero, rad.
        azimuth: its direction, rad.
        start_roll: alpha + gamma at zero tilt, rad; any when not given.
        mode: working mode; the machine's own when not given.
        neutral: from what the stems of the platform's sockets deviate, see `trivet.reach.neutral`.
        aims: what is to be great at the worst place of the way; of several the least over its unit.
        limits: whether joints must stay inside their travel.
        bodies: whether bodies must stay apart.
        solid: whether they must stay clear of the sphere as well.
        step: of the tilt on the first grid, rad.
        rolls: of the first grid, evenly all round.
        proof: whether to try to prove that the way is free.
        sigma: sigma_min that is to be proven; `SHARE` of the least on the way when not given.
        progress: called with the numbers of patches of the proof that have been looked at and that are left.

    Raises:
        InputError: for an impossible grid, or a machine of which this cannot be asked.
    """
    _check(to, step, rolls, sigma)
    rules, height = rules_for(machine, radius, height, mode, neutral, aims, limits, bodies, solid)
    rules = rules._replace(least_sigma=sigma or 0.0)
    tilts = np.linspace(0.0, to, max(2, round(to / step) + 1))
    still = (np.full(len(tilts), value) for value in (0.0, 0.0, height, azimuth, (start_roll or 0.0) - azimuth))
    x, y, z, alpha, gamma = still
    grid = RollGrid(Touch(x, y, z, alpha, tilts, gamma), 2 * math.pi / rolls, rolls)
    return _planned(rules, grid, neutral, start_roll is None, _Wish(proof, sigma), progress)


def replanned(plan: Plan, dimension: str | None, value: float) -> Plan:
    """A plan once more, without a proof, with one dimension of the machine changed, or with the height of the sphere (None)."""
    rules, grid = plan.rules, plan.grid
    if dimension is None:
        grid = grid._replace(path=grid.path._replace(z=np.full(len(grid.path.z), value)))
    else:
        rules = rules._replace(machine=with_dimension(plan.machine, dimension, value))
        check(rules.machine)
    field = field_of(rules, grid)
    return _attempt(rules, grid, plan.neutral, field, plan.start, [], _Wish(False, None), lambda looked, left: None)


def with_dimension(machine: Machine, dimension: str, value: float) -> Machine:
    """A machine with one of its `dimensions` changed (SI), as yet unchecked."""
    leaves, structure = jax.tree.flatten(machine)
    leaves[list(dimensions(machine)).index(dimension)] = value
    changed: Machine = jax.tree.unflatten(structure, leaves)
    return changed


def rules_for(
    machine: MachineLike,
    radius: float | None,
    height: float | None,
    mode: str | None,
    neutral: Reference,
    aims: Sequence[Aim],
    limits: bool,
    bodies: bool,
    solid: bool,
) -> tuple[Rules, float]:
    """The rules of a plan on a sphere, and the height of the sphere (m); arguments as for `plan`."""
    radius, height = sphere_of(choose(machine), radius, height)
    if solid and not bodies:
        raise InputError("a solid sphere is something that bodies stay clear of; look at bodies as well")
    rules = _rules(machine, mode, neutral, aims, limits, bodies)
    if solid:
        rules = rules._replace(scene=scene_of(rules.machine, with_workpiece=True))
    return rules._replace(radius=radius, workpiece=ball_of((0.0, 0.0, height), radius)), height


def _rules(
    machine: MachineLike, mode: str | None, neutral: Reference, aims: Sequence[Aim], limits: bool, bodies: bool
) -> Rules:
    chosen = with_neutral(choose(machine), neutral, mode)
    signs = closed_form_signs(chosen, mode)
    require_six_each(chosen)
    scene = scene_of(chosen, with_workpiece=False) if bodies else None
    return Rules(chosen, signs, scene, None, 0.0, limits, tuple(aims))


def prover_of(rules: Rules) -> Prover:
    """What proves that rules are kept."""
    return Prover(rules.machine, rules.signs, rules.scene, rules.radius, rules.workpiece)


def demand_of(rules: Rules, sigma: float) -> Demand:
    """What is to be proven: what the rules ask for, and a sigma_min."""
    return Demand(0.0 if rules.limits else -math.inf, None if rules.scene is None else rules.gap, sigma)


def plan_along(
    machine: MachineLike,
    path: PathFile,
    *,
    start_roll: float | None = None,
    mode: str | None = None,
    neutral: Reference = "as-described",
    aims: Sequence[Aim] = (SIGMA,),
    limits: bool = True,
    bodies: bool = True,
    step: float = STEP,
    rolls: int = ROLLS,
    proof: bool = True,
    sigma: float | None = None,
    progress: Callable[[int, int], None] = lambda looked, left: None,
) -> Plan:
    """The rolls with which a machine goes through poses in their order, their own rolls left aside.

    Between the poses the platform centre goes straight, and azimuth and tilt change evenly; where the platform is level the
    azimuth is that of the pose before it, or after it.

    Args:
        machine, mode, neutral, aims, limits, bodies, proof, sigma, progress: as for `plan`.
        path: the poses; how fast it is run through does not matter here.
        start_roll: alpha + gamma at the first pose, rad; any when not given.
        step: greatest turn from row to row of the first grid, rad; and greatest move, in parts of the machine's size.
        rolls: of the first grid, evenly all round.

    Raises:
        InputError: for an impossible grid, or a machine of which this cannot be asked.
    """
    _check(math.pi, step, rolls, sigma)
    rules = _rules(machine, mode, neutral, aims, limits, bodies)._replace(least_sigma=sigma or 0.0)
    azimuth, tilt = (np.array([getattr(pose, name) for pose in path.poses], dtype=float) for name in ("azimuth", "tilt"))
    leaning = np.flatnonzero(np.abs(np.sin(tilt)) > 1e-9)
    if len(leaning):
        before = np.maximum(np.searchsorted(leaning, np.arange(len(tilt)), side="right") - 1, 0)
        azimuth = np.unwrap(azimuth[leaning[before]])
    place = np.array([pose.position for pose in path.poses], dtype=float).T
    corners = np.stack([*place, azimuth, tilt, (start_roll or 0.0) - azimuth])
    moved = np.linalg.norm(np.diff(place), axis=0) / float(rules.machine.characteristic_length)
    counts = np.ceil(np.maximum(np.abs(np.diff(corners[3:5])).max(axis=0), moved) / step).astype(int)
    if counts.sum() * rolls > LARGEST_GRID:
        raise InputError(
            f"a path of {counts.sum():,} rows and {rolls} rolls; at most {LARGEST_GRID:.0e} poses, take a wider step"
        )
    where = np.concatenate([[0.0], *(k + np.arange(1, max(n, 1) + 1) / max(n, 1) for k, n in enumerate(counts))])
    rows = Touch(*(np.interp(where, np.arange(len(tilt)), c) for c in corners))
    grid = RollGrid(rows, 2 * math.pi / rolls, rolls, where + 1)
    return _planned(rules, grid, neutral, start_roll is None, _Wish(proof, sigma), progress)


def plans(
    machines: Sequence[MachineLike],
    heights: Sequence[float | None] = (None,),
    modes: Sequence[str | None] = (None,),
    *,
    path: PathFile | None = None,
    progress: Callable[[str, int, int], None] = lambda name, done, total: None,
    **settings: Any,
) -> PlanStudy:
    """`plan` of every machine on spheres at every height in every working mode, or `plan_along` a path.

    Args:
        machines: machines, names or files.
        heights: of the centres of the spheres, m.
        modes: working modes; `("all",)` for every one that each machine has.
        progress: called with what is being done, and how many of how many are.
        path: a path instead of a sphere.
        settings: as for `plan`, or `plan_along`.
    """
    chosen = [choose(machine) for machine in machines]
    cases = [
        (machine, height, mode)
        for machine in chosen
        for height in heights
        for mode in (all_modes(machine) if tuple(modes) == ("all",) else modes)
    ]
    found = []
    for k, (machine, height, mode) in enumerate(cases):
        if path is None:
            found.append(plan(machine, height=height, mode=mode, **settings))
        else:
            found.append(plan_along(machine, path, mode=mode, **settings))
        progress("ways", k + 1, len(cases))
    found.sort(key=lambda plan: (plan.is_possible, plan.value if plan.is_possible else plan.highest), reverse=True)
    return PlanStudy(tuple(found))


def _check(to: float, step: float, rolls: int, sigma: float | None) -> None:
    if rolls > LARGEST_GRID:
        raise InputError(f"too many rolls; no more than {LARGEST_GRID:.0e} poses")
    if not (0 < to <= math.pi * (1 + 1e-12) and 0 < step <= to and rolls >= 8 and to / step * rolls <= LARGEST_GRID):
        raise InputError(
            f"a tilt to {math.degrees(to):g} deg in steps of {math.degrees(step):g} deg with {rolls} rolls; expected a tilt "
            f"above zero, up to 180 deg, no step above it, at least 8 rolls, and no more than {LARGEST_GRID:.0e} poses"
        )
    if sigma is not None and not 0 < sigma < math.inf:
        raise InputError(f"sigma_min to be proven: {sigma:g}; it must be above zero")


@dataclass(frozen=True)
class _Wish:
    """What is to be proven."""

    proof: bool
    sigma: float | None


def _planned(
    rules: Rules, grid: RollGrid, neutral: Reference, any_start: bool, wish: _Wish, progress: Callable[[int, int], None]
) -> Plan:
    start = np.zeros(grid.shape, dtype=bool)
    start[0, :] = any_start
    start[0, 0] = True
    field = field_of(rules, grid)
    found = _attempt(rules, grid, neutral, field, start, [], wish, progress)
    blocked: list[tuple[float, float]] = []
    tried = found
    while tried.proof is not None and not tried.proof.is_proven and len(blocked) < TRIES:
        # Between the poses of the grid lies something that the grid does not see: around it.
        blocked.append(grid.place_of(Touch(*tried.proof.open.middle[:, tried.proof.smallest])))
        tried = _attempt(rules, grid, neutral, field, start, blocked, wish, progress)
        if tried.is_safe:
            return tried
    return found


def _attempt(
    rules: Rules,
    grid: RollGrid,
    neutral: Reference,
    field: Field,
    start: Array,
    blocked: list[tuple[float, float]],
    wish: _Wish,
    progress: Callable[[int, int], None],
) -> Plan:
    """A plan that keeps off some places (row and column) of the grid."""
    open_field = field._replace(value=np.where(grid.is_near(blocked), -np.inf, field.value))
    way, highest, side = best_way(open_field, start, all_round=True)
    mode = mode_text(rules.machine, rules.signs)
    if way is None:
        stop = _stop(rules, grid, start, field, highest)
        return Plan(rules, mode, neutral, grid, start, field, None, None, math.nan, True, highest, stop, None)
    knots, places = simplified(rules, grid, *refined(rules, grid, way, side, start, blocked))
    proof = _proof(rules, grid, knots, places, wish.sigma, progress) if wish.proof else None
    return Plan(rules, mode, neutral, grid, start, field, knots, places, way.value, way.is_steady, highest, "", proof)


def _proof(
    rules: Rules, grid: RollGrid, knots: Touch, places: Array, sigma: float | None, progress: Callable[[int, int], None]
) -> Proof:
    least = SHARE * float(along(rules, knots, places, grid.step).sigma_min.min()) if sigma is None else sigma
    return prover_of(rules).prove(Patches.along(np.stack(knots)), demand_of(rules, least), BUDGET, progress)


def _stop(rules: Rules, grid: RollGrid, start: Array, field: Field, highest: int) -> str:
    """What keeps a machine from the end of a path."""
    if highest < 0:
        return f"at the start {_fault(rules, grid, 0)}"
    closed = np.flatnonzero(~np.isfinite(field.value).any(axis=1))
    if len(closed):
        return f"beyond {grid.mark(closed[0] - 1)} {_fault(rules, grid, int(closed[0]))}"
    for words, freer in (
        (f"with a sigma_min below {rules.least_sigma:g}", rules._replace(least_sigma=0.0)),
        ("through other bodies", rules._replace(scene=None)),
        ("beyond limits", rules._replace(limits=False)),
        ("beyond limits and through other bodies", rules._replace(scene=None, limits=False)),
    ):
        if freer == rules:
            continue
        way, _, _ = best_way(field_of(freer, grid), start, all_round=True)
        if way is not None:
            return f"a way leads {words} only: {_worst(rules, grid.at(way.rows, way.columns))}"
    return _apart(rules._replace(scene=None, limits=False, least_sigma=0.0, aims=(SIGMA,)), grid, highest)


def _apart(free: Rules, grid: RollGrid, highest: int) -> str:
    """Why there is no way although neither limits nor bodies are looked at."""
    first, last = (np.unique(row[row != 0]) for row in field_of(free, grid).side[[0, -1]])
    if not (len(first) == len(last) == 1 and first[0] != last[0]):
        return (
            f"no way of this grid leads around the Type 2 singularities beyond {grid.mark(highest)}, whatever limits and bodies"
        )
    # det J_x is continuous in a mode: where all of the start has one sign and all of the end the other, every way passes zero.
    around = np.linspace(0.0, grid.columns, PIECES + 1)
    ends = (np.stack(grid.at(np.full(len(around), float(row)), around)) for row in (0, grid.shape[0] - 1))
    demand = demand_of(free, NOT_ZERO)
    is_proven = all(prover_of(free).prove(Patches.along(end), demand, BUDGET // 10).is_proven for end in ends)
    rolls = "every roll, which is proven" if is_proven else f"each of {grid.columns} rolls"
    return f"start and end lie on different sides of a Type 2 singularity at {rolls}, whatever limits and bodies"


def _fault(rules: Rules, grid: RollGrid, row: int) -> str:
    """What is wrong with a row, at the roll that comes nearest."""
    touch = grid.at(np.full(grid.columns, float(row)), np.arange(grid.columns))
    poses = frames_of(touch, rules.radius)
    travel = travel_margin(rules.machine, poses, rules.signs)
    nearest = int(travel.argmax())
    if rules.scene is not None and (travel[nearest] > RESERVE_TRAVEL or not rules.limits):
        _, gaps = nearest_bodies(rules.machine, rules.scene, poses, rules.signs, rules.workpiece)
        is_inside = travel > RESERVE_TRAVEL if rules.limits else travel > -np.inf
        nearest = int(np.where(is_inside, gaps, -np.inf).argmax())
    return _worst(rules, Touch(*(c[nearest : nearest + 1] for c in touch)))


def _worst(rules: Rules, touch: Touch) -> str:
    """What is wrong at the worst of poses."""
    poses = frames_of(touch, rules.radius)
    travel = travel_margin(rules.machine, poses, rules.signs)
    k = int(travel.argmin())
    state = in_batches(lambda part: joint_states(rules.machine, part, rules.signs), some(poses, [k]))
    miss = shortfall(rules.machine, state)
    if miss is not None and (rules.limits or not np.isfinite(travel[k])):
        return f"{miss.reason} ({degrees_of(touch, k)})"
    if rules.scene is not None:
        names, gaps = nearest_bodies(rules.machine, rules.scene, poses, rules.signs, rules.workpiece)
        nearest = int(gaps.argmin())
        if gaps[nearest] <= rules.gap + RESERVE_GAP and not (rules.limits and travel[k] <= RESERVE_TRAVEL):
            pair = f"{names[nearest][0]} and {names[nearest][1]}"
            return f"{pair} are {gaps[nearest] * 1e3:.3g} mm apart ({degrees_of(touch, nearest)})"
    if rules.limits and travel[k] <= RESERVE_TRAVEL:
        return f"less is left of a joint's travel than a plan keeps in hand ({degrees_of(touch, k)})"
    sigma = control(rules.machine, poses, rules.signs).sigma_min
    k = int(sigma.argmin())
    return f"sigma_min is {sigma[k]:.3g}, {rules.least_sigma:g} is demanded ({degrees_of(touch, k)})"
