"""Getting there: rolls along a path, and working modes, that keep off singularities, ends of travel and collisions."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.mode import all_modes, mode_text, mode_words
from trivet.model import Machine
from trivet.reach.certificate import Patches, Proof
from trivet.reach.margins import control
from trivet.reach.neutral import Reference, with_neutral
from trivet.reach.touch import Touch
from trivet.space.pose import steady_angles
from trivet.study.closest import Closest, Drives, closest, drives_along
from trivet.study.machines import MachineLike, choose
from trivet.study.pathfile import PathFile, read_path
from trivet.study.requirements import Requirements, Settings, on_sphere, verdict
from trivet.study.roll_grid import LARGEST_GRID, Along, Field, RollGrid, Rules, along, best_way, field_of, refined, simplified
from trivet.study.stops import stop

Array = NDArray[Any]
Progress = Callable[[int, int], None]

TO, STEP, ROLLS = math.radians(90.0), math.radians(1.0), 180
TRIES = 4
"""Further ways that are tried where one cannot be proven."""


@dataclass(frozen=True, repr=False)
class Plan:
    """The best way along a path in one working mode, or why there is none."""

    rules: Rules
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
    proof: Proof | None
    """That limits, clearance and control hold all along; None where there is no way, or no proof was asked for."""

    @property
    def machine(self) -> Machine:
        """The machine, its neutral axes as they were taken."""
        return self.rules.machine

    @property
    def mode(self) -> str:
        """The working mode."""
        return mode_text(self.machine, self.rules.signs)

    @property
    def is_possible(self) -> bool:
        """Whether a way leads to the end."""
        return self.knots is not None

    @property
    def is_safe(self) -> bool:
        """Whether it is proven that the way is free."""
        return self.proof is not None and self.proof.is_proven

    @property
    def is_refuted(self) -> bool:
        """Whether it is known that the way is not free."""
        return self.proof is not None and self.proof.is_refuted

    @property
    def verdict(self) -> str:
        """What became of it, in a word or two."""
        return verdict(self.proof) if self.is_possible else "no way"

    @cached_property
    def stopped_by(self) -> str:
        """What keeps it from the end; empty where nothing does."""
        return "" if self.is_possible else stop(self.rules, self.grid, self.start, self.field, self.highest)

    @cached_property
    def along(self) -> Along | None:
        """What is met along the way, at samples."""
        if self.knots is None or self.places is None:
            return None
        return along(self.rules, self.knots, self.places, self.grid.step)

    @cached_property
    def closest(self) -> Closest | None:
        """What the way comes closest to."""
        return None if self.along is None else closest(self.rules, self.along)

    @cached_property
    def drives(self) -> Drives | None:
        """How the drives move along the way."""
        if self.knots is None or self.places is None:
            return None
        return drives_along(self.rules, self.knots, self.places, self.grid.step)

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
    def signed_sigma(self) -> Array:
        """(rows, columns) sigma_min with the sign of det J_x, whatever limits and bodies; NaN where a chain does not close."""
        rows, columns = np.indices(self.grid.shape).reshape(2, -1)
        found = control(self.machine, self.grid.frames(rows, columns, self.rules.radius), self.rules.signs)
        return (found.sigma_min * found.side).reshape(self.grid.shape)

    def __repr__(self) -> str:
        end = self.grid.mark(self.grid.shape[0] - 1)
        value = f", least value {self.value:.4g}" if self.is_possible else ""
        return f"<Plan: {self.machine.name}, {mode_words(self.mode)}, to {end}: {self.verdict}{value}>"


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
    solid: bool = False,
    step: float | None = None,
    rolls: int = ROLLS,
    progress: Progress = lambda looked, left: None,
    **settings: Unpack[Settings],
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
        solid: whether bodies must stay clear of the sphere as well.
        step: of the tilt on the first grid, rad; `STEP`, or the tilt where that is less, when not given.
        rolls: of the first grid, evenly all round.
        progress: called with the numbers of patches of the proof that have been looked at and that are left.
        settings: mode, neutral, aims, limits, bodies, proof, sigma: `trivet.study.requirements.Requirements`.

    Raises:
        InputError: for an impossible grid, or a machine of which this cannot be asked.
    """
    step = min(STEP, to) if step is None else step
    _check(to, step, rolls)
    wanted = Requirements(**settings)
    rules, height = on_sphere(wanted.rules(machine), radius, height, solid)
    tilts = np.linspace(0.0, to, max(2, round(to / step) + 1))
    still = (np.full(len(tilts), value) for value in (0.0, 0.0, height, azimuth, (start_roll or 0.0) - azimuth))
    x, y, z, alpha, gamma = still
    grid = RollGrid(Touch(x, y, z, alpha, tilts, gamma), 2 * math.pi / rolls, rolls)
    return _planned(rules, grid, wanted, start_roll is None, progress)


def plan_along(
    machine: MachineLike,
    path: PathFile | str | os.PathLike[str],
    *,
    start_roll: float | None = None,
    step: float = STEP,
    rolls: int = ROLLS,
    progress: Progress = lambda looked, left: None,
    **settings: Unpack[Settings],
) -> Plan:
    """The rolls with which a machine goes through poses in their order, their own rolls left aside.

    Between the poses the platform centre goes straight, and azimuth and tilt change evenly; where the platform is level the
    azimuth is that of the pose before it, or after it.

    Args:
        machine, rolls, progress, settings: as for `plan`.
        path: the poses, or their file; how fast it is run through does not matter here.
        start_roll: alpha + gamma at the first pose, rad; any when not given.
        step: greatest turn from row to row of the first grid, rad; and greatest move, in parts of the machine's size.

    Raises:
        InputError: for an impossible grid, or a machine of which this cannot be asked.
    """
    _check(math.pi, step, rolls)
    wanted = Requirements(**settings)
    rules = wanted.rules(machine)
    poses = path if isinstance(path, PathFile) else read_path(path)
    grid = _grid_along(poses, start_roll or 0.0, step, rolls, float(rules.machine.characteristic_length))
    return _planned(rules, grid, wanted, start_roll is None, progress)


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
    asked = {name: value for name, value in settings.items() if name in Settings.__annotations__}
    for machine, _, mode in cases:
        Requirements(**asked | {"mode": mode}).rules(machine)  # what is wrong is told before any work
    found = []
    for k, (machine, height, mode) in enumerate(cases):
        if path is None:
            found.append(plan(machine, height=height, mode=mode, **settings))
        else:
            found.append(plan_along(machine, path, mode=mode, **settings))
        _ = found[-1].stopped_by  # worked out when it is first asked for; here while it is told how far things are
        progress("ways", k + 1, len(cases))
    found.sort(key=lambda plan: (plan.is_possible, plan.value if plan.is_possible else plan.highest), reverse=True)
    return PlanStudy(tuple(found))


def replanned(plan: Plan, *, machine: Machine | None = None, height: float | None = None) -> Plan:
    """A plan once more, without a proof: with a changed machine, or with the sphere, solid or not, at another height (m).

    Neutral axes that were laid down for the plan are laid down anew.
    """
    rules, grid = plan.rules, plan.grid
    if machine is not None:
        rules = rules._replace(machine=with_neutral(machine, plan.neutral, plan.mode))
    if height is not None:
        ball = rules.workpiece
        rules = rules._replace(workpiece=ball and ball._replace(centre=ball.centre._replace(z=height)))
        grid = grid._replace(path=grid.path._replace(z=np.full(len(grid.path.z), height)))
    wanted = Requirements(neutral=plan.neutral, proof=False)
    return _attempt(rules, grid, wanted, plan.start, field_of(rules, grid), [], lambda looked, left: None)


def _check(to: float, step: float, rolls: int) -> None:
    if rolls > LARGEST_GRID:
        raise InputError(f"too many rolls; no more than {LARGEST_GRID:.0e} poses")
    if not (0 < to <= math.pi * (1 + 1e-12) and 0 < step <= to and rolls >= 8 and to / step * rolls <= LARGEST_GRID):
        raise InputError(
            f"a tilt to {math.degrees(to):g} deg in steps of {math.degrees(step):g} deg with {rolls} rolls; expected a tilt "
            f"above zero, up to 180 deg, no step above it, at least 8 rolls, and no more than {LARGEST_GRID:.0e} poses"
        )


def _grid_along(path: PathFile, start_roll: float, step: float, rolls: int, length: float) -> RollGrid:
    """The grid of a path through poses; `length` (m) is what a step of 1 rad counts as where the platform moves."""
    azimuth, tilt, _ = steady_angles(*np.array([(pose.azimuth, pose.tilt, pose.roll) for pose in path.poses], dtype=float).T)
    place = np.array([pose.position for pose in path.poses], dtype=float).T
    corners = np.stack([*place, azimuth, tilt, start_roll - azimuth])
    moved = np.linalg.norm(np.diff(place), axis=0) / length
    counts = np.ceil(np.maximum(np.abs(np.diff(corners[3:5])).max(axis=0), moved) / step).astype(int)
    if counts.sum() * rolls > LARGEST_GRID:
        raise InputError(
            f"a path of {counts.sum():,} rows and {rolls} rolls; at most {LARGEST_GRID:.0e} poses, take a wider step"
        )
    where = np.concatenate([[0.0], *(k + np.arange(1, max(n, 1) + 1) / max(n, 1) for k, n in enumerate(counts))])
    rows = Touch(*(np.interp(where, np.arange(len(tilt)), c) for c in corners))
    return RollGrid(rows, 2 * math.pi / rolls, rolls, where + 1)


def _planned(rules: Rules, grid: RollGrid, wanted: Requirements, any_start: bool, progress: Progress) -> Plan:
    start = np.zeros(grid.shape, dtype=bool)
    start[0, :] = any_start
    start[0, 0] = True
    field = field_of(rules, grid)
    found = tried = _attempt(rules, grid, wanted, start, field, [], progress)
    blocked: list[tuple[float, float]] = []
    while tried.proof is not None and not tried.is_safe and len(blocked) < TRIES:
        # Between the poses of the grid lies something that the grid does not see: around it.
        blocked.append(grid.place_of(Touch(*tried.proof.open.middle[:, tried.proof.smallest])))
        tried = _attempt(rules, grid, wanted, start, field, blocked, progress)
        if tried.is_safe:
            return tried
    return found


def _attempt(
    rules: Rules,
    grid: RollGrid,
    wanted: Requirements,
    start: Array,
    field: Field,
    blocked: list[tuple[float, float]],
    progress: Progress,
) -> Plan:
    """A plan that keeps off some places (row and column) of the grid."""
    open_field = field._replace(value=np.where(grid.is_near(blocked), -np.inf, field.value))
    way, highest, side = best_way(open_field, start, all_round=True)
    if way is None:
        return Plan(rules, wanted.neutral, grid, start, field, None, None, math.nan, True, highest, None)
    knots, places = simplified(rules, grid, *refined(rules, grid, way, side, start, blocked))
    samples = along(rules, knots, places, grid.step)
    proof = wanted.prove(rules, Patches.along(np.stack(knots)), samples, progress)
    return Plan(rules, wanted.neutral, grid, start, field, knots, places, way.value, way.is_steady, highest, proof)
