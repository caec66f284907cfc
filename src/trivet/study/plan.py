"""Getting there: rolls along a path, and working modes, that keep off singularities, limits and collisions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.jacobian import require_six_each
from trivet.kinematics.mode import closed_form_signs, mode_text
from trivet.kinematics.report import joint_states, shortfall
from trivet.model import Machine
from trivet.reach.certificate import Demand, Patches, Proof, Prover, Touch
from trivet.reach.margins import clearance, control, nearest_bodies, travel_margin
from trivet.reach.neutral import Reference, with_neutral
from trivet.reach.scene import FAR, Ball, Scene, scene_of
from trivet.reach.ways import Way, farthest, widest
from trivet.space.batches import in_batches
from trivet.space.frame import Frame
from trivet.statics.compliance import platform_stiffness
from trivet.statics.objective import Objective
from trivet.study.machines import MachineLike, choose
from trivet.study.tilt import ball_of, sphere_of

Array = NDArray[Any]

STEP, ROLLS = math.radians(1.0), 180
RESERVE_TRAVEL, RESERVE_GAP = 0.005, 5e-5
"""What a plan keeps in hand, of half a joint's travel and of the distance of bodies (m): on the edge nothing can be proven."""
SHARE = 0.8
"""Of the least sigma_min on a plan, which is then proven."""
FINER, LEVELS = 2, 3
"""How much finer the grid becomes about a way, and how often."""
BUDGET = 200_000
"""Patches of a proof, at most."""
LARGEST_GRID = 5_000_000
"""Poses, at most."""
KEPT = 0.98
"""Part of a way's least value which it keeps when corners are cut."""
SAMPLES = 5
"""Places of every straight piece of a plan at which its values are told."""


class Term(NamedTuple):
    """A value that is to be great."""

    name: str
    """"sigma_min", or an objective of the stiffness."""
    scalar: Objective | None
    """None for sigma_min."""
    unit: float
    """What counts as one, SI; of several terms the worst value over its unit decides."""


SIGMA = Term("sigma_min", None, 1.0)


class Rules(NamedTuple):
    """What a plan has to keep to."""

    machine: Machine
    signs: Any
    scene: Scene | None
    """Bodies that must stay apart; None when they need not."""
    workpiece: Ball | None
    limits: bool
    """Whether joints must stay inside their travel."""
    radius: float
    """Of the spheres that the poses touch, m."""
    aims: tuple[Term, ...]


class Field(NamedTuple):
    """Values over a grid of poses, (rows, columns)."""

    value: Array
    """What is to be great; minus infinity where the rules forbid the pose."""
    side: Array
    """Sign of det J_x where the pose is allowed, else 0."""
    sigma_min: Array
    """NaN where it was not looked at."""


@dataclass(frozen=True)
class Plan:
    """A way with its rolls, through one working mode."""

    machine: Machine
    mode: str
    aims: tuple[Term, ...]
    base: Touch
    """(rows,) the path: its poses at the rolls from which those of the grid count."""
    radius: float
    rolls: Array
    """(columns,) of the grid, rad."""
    field: Field
    """Over the grid."""
    is_possible: bool
    """Whether a way leads to the end."""
    highest: int
    """The last row of the grid to which a way leads; -1 for none."""
    knots: Touch | None
    """(k,) the way: straight pieces in these coordinates; None where there is none."""
    value: float
    """The least value on the way, at its samples; NaN for none."""
    bottleneck: float
    """The least value on the widest way over the grid; NaN for none."""
    travel: float
    clearance: float
    sigma_min: float
    """The least on the way, at its samples; NaN for none."""
    worst: Touch | None
    """Where the value is least: numbers."""
    is_steady: bool
    """Whether the way never goes back along the path."""
    stopped_by: str
    """What stops it; empty where a way leads to the end."""
    proof: Proof | None
    """None where there is no way, or none was asked for."""

    @property
    def is_safe(self) -> bool:
        """Whether limits, clearance and control are proven all along."""
        return self.proof is not None and self.proof.is_proven


@dataclass(frozen=True)
class PlanStudy:
    """Plans for machines and working modes."""

    plans: tuple[Plan, ...]
    """Best first."""
    missing: tuple[tuple[str, str, str], ...] = ()
    """Machine, mode, and why there is no plan."""


def field_of(rules: Rules, base: Touch, rolls: Array, mask: Array | None = None) -> Field:
    """Values over a grid: rows of a path, columns of rolls; only where a mask (rows, columns) is set, when there is one."""
    shape = (len(base.roll), len(rolls))
    rows, columns = np.nonzero(np.ones(shape, dtype=bool) if mask is None else mask)
    value, side, sigma = np.full(shape, -np.inf), np.zeros(shape), np.full(shape, np.nan)
    if not len(rows):
        return Field(value, side, sigma)
    poses = _frames(_at(base, rows, rolls[columns]), rules.radius)
    least = RESERVE_TRAVEL if rules.limits else -np.inf
    with np.errstate(invalid="ignore"):
        good = travel_margin(rules.machine, poses, rules.signs) > least
    rows, columns, poses = rows[good], columns[good], _some(poses, good)
    if rules.scene is not None and len(rows):
        gap = float(rules.machine.apart.clearance) + RESERVE_GAP
        good = clearance(rules.machine, rules.scene, poses, rules.signs, rules.workpiece) > gap
        rows, columns, poses = rows[good], columns[good], _some(poses, good)
    if len(rows):
        found = control(rules.machine, poses, rules.signs)
        value[rows, columns] = _worst_term(rules, poses, found.sigma_min)
        side[rows, columns], sigma[rows, columns] = np.nan_to_num(found.side), found.sigma_min
    value[side == 0] = -np.inf
    return Field(value, side, sigma)


def _worst_term(rules: Rules, poses: Frame, sigma: Array) -> Array:
    """The least of all terms, each over its unit."""
    least = np.full(len(sigma), np.inf)
    mechanism = jax.tree.map(jnp.asarray, rules.machine.mechanism)
    for term in rules.aims:
        own = sigma
        if term.scalar is not None:
            own = in_batches(partial(_stiffness, mechanism, signs=rules.signs, scalar=term.scalar), poses)
        least = np.minimum(least, np.where(np.isfinite(own), own, -np.inf) / term.unit)
    return least


@partial(jax.jit, static_argnames="scalar")
def _stiffness(mechanism: Any, poses: Frame, signs: Any, scalar: Objective) -> Any:
    return jax.vmap(lambda pose: scalar(platform_stiffness(mechanism, pose, signs)[0]))(poses)


def best_way(field: Field, start: Array, *, all_round: bool = True) -> tuple[Way | None, int, float]:
    """The widest way on one side of all singularities, from a start in the first row to the last row.

    Returns:
        The way, the last row to which any way leads, and the side.
    """
    end = np.zeros(field.value.shape, dtype=bool)
    end[-1] = True
    best: Way | None = None
    highest, chosen = -1, 1.0
    for side in (-1.0, 1.0):
        values = np.where(field.side == side, field.value, -np.inf)
        way = widest(values, start, end, all_round=all_round)
        reached = farthest(np.isfinite(values), start, all_round=all_round)
        if (way is not None and (best is None or way.value > best.value)) or (best is None and reached > highest):
            best, highest, chosen = way, reached, side
    return best, highest, chosen


def refined(rules: Rules, base: Touch, rolls: Array, way: Way, side: float, start: Array) -> tuple[Array, Array]:
    """A way on grids that become finer about it: places (k,) along the rows and the columns of the first grid."""
    from scipy.ndimage import binary_dilation

    rows, columns, count = way.rows, way.columns, len(base.roll)
    allowed = np.flatnonzero(start[0])
    for level in range(1, LEVELS + 1):
        fine, low = FINER**level, (columns.min() - 2) * FINER
        mask = np.zeros(((count - 1) * fine + 1, (columns.max() + 2) * FINER - low + 1), dtype=bool)
        mask[rows * FINER, columns * FINER - low] = True
        mask = binary_dilation(mask, np.ones((4 * FINER + 1, 4 * FINER + 1)))
        places = (low + np.arange(mask.shape[1])) / fine
        field = field_of(rules, _between(base, np.arange(mask.shape[0]) / fine), _rolls_at(rolls, places), mask)
        first = np.zeros(mask.shape, dtype=bool)
        # Any roll where any was allowed, else those of the coarse grid only.
        first[0] = True if len(allowed) == len(rolls) else np.isin(places % len(rolls), allowed)
        last = np.zeros(mask.shape, dtype=bool)
        last[-1] = True
        found = widest(np.where(field.side == side, field.value, -np.inf), first, last, all_round=False)
        if found is None:  # closed between the nodes of the coarser grid
            break
        rows, columns = found.rows, found.columns + low
        scale = fine
    else:
        return rows / scale, columns / scale
    return rows / FINER ** (level - 1), columns / FINER ** (level - 1)


def straightened(places: Array, columns: Array, allowance: float) -> Array:
    """Which of the nodes of a line to keep, so that none is off it by more than an allowance (Ramer, Douglas and Peucker)."""
    keep, todo = {0, len(places) - 1}, [(0, len(places) - 1)]
    line = np.stack([places, columns], axis=-1)
    while todo:
        low, high = todo.pop()
        if high - low < 2:
            continue
        along = line[high] - line[low]
        inner = line[low + 1 : high] - line[low]
        part = np.clip(inner @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        off = np.linalg.norm(inner - part[:, None] * along, axis=1)
        if off.max() > allowance:
            middle = low + 1 + int(off.argmax())
            keep.add(middle)
            todo += [(low, middle), (middle, high)]
    return np.array(sorted(keep))


def plan(
    machine: MachineLike,
    radius: float | None = None,
    height: float | None = None,
    *,
    to: float = math.pi / 2,
    azimuth: float = 0.0,
    start_roll: float | None = None,
    mode: str | None = None,
    neutral: Reference = "as-described",
    aims: Sequence[Term] = (SIGMA,),
    limits: bool = True,
    bodies: bool = True,
    solid: bool = False,
    step: float = STEP,
    rolls: int = ROLLS,
    prove: bool = True,
    sigma: float | None = None,
    progress: Callable[[int, int], None] = lambda looked, left: None,
) -> Plan:
    """How a machine tilts on a sphere without meeting a singularity, the end of a joint's travel or a collision.

    Args:
        machine: machine, name or file; six drives, chains with closed form.
        radius: of the sphere, m; that of the workpiece when not given.
        height: of its centre above {O}, on the z axis, m; that of the workpiece when not given.
        to: the tilt to get to, from zero, rad.
        azimuth: its direction, rad.
        start_roll: alpha + gamma at zero tilt, rad; any when not given.
        mode: working mode; the machine's own when not given.
        neutral: from what the stems of the platform's sockets deviate, see `trivet.reach.neutral`.
        aims: what is to be great at the worst place of the way.
        limits: whether joints must stay inside their travel.
        bodies: whether bodies must stay apart.
        solid: whether they must stay clear of the sphere as well.
        step: of the tilt on the first grid, rad.
        rolls: of the first grid, evenly all round.
        prove: whether to try to prove that the way is free.
        sigma: sigma_min that is to be proven; `SHARE` of the least on the way when not given.
        progress: called with patches of the proof that have been looked at and that are left.

    Raises:
        InputError: for an impossible grid, or a machine that this cannot be asked of.
    """
    chosen = with_neutral(choose(machine), neutral, mode)
    signs = closed_form_signs(chosen, mode)
    require_six_each(chosen)
    radius, height = sphere_of(chosen, radius, height)
    if not (0 < to <= math.pi and 0 < step <= to and 8 <= rolls <= 3600 and to / step * rolls <= LARGEST_GRID):
        raise InputError(
            f"a tilt to {math.degrees(to):g} deg in steps of {math.degrees(step):g} deg with {rolls} rolls; expected a tilt "
            f"above zero and at most 180 deg, no step above it, 8 to 3600 rolls, and at most {LARGEST_GRID:.0e} poses"
        )
    if sigma is not None and not 0 < sigma < 10:
        raise InputError(f"sigma_min to be proven: {sigma:g}; expected above 0, and below 10")
    scene = scene_of(chosen, with_workpiece=solid) if bodies else None
    centre = (0.0, 0.0, height)
    rules = Rules(chosen, signs, scene, ball_of(centre, radius), limits, radius, tuple(aims))
    tilts = np.linspace(0.0, to, max(2, round(to / step) + 1))
    x, y, z, alpha, gamma = (np.full(len(tilts), value) for value in (*centre, azimuth, (start_roll or 0.0) - azimuth))
    base = Touch(x, y, z, alpha, tilts, gamma)
    return _planned(rules, base, rolls, start_roll is not None, prove, sigma, progress)


def _planned(
    rules: Rules,
    base: Touch,
    count: int,
    is_start_given: bool,
    prove: bool,
    sigma: float | None,
    progress: Callable[[int, int], None],
) -> Plan:
    rolls = 2 * math.pi / count * np.arange(count)
    field = field_of(rules, base, rolls)
    start = np.zeros(field.value.shape, dtype=bool)
    start[0] = True
    start[0, 1:] &= not is_start_given
    way, highest, side = best_way(field, start)
    found = Plan(
        rules.machine, mode_text(rules.machine, rules.signs), rules.aims, base, rules.radius, rolls, field,
        is_possible=way is not None, highest=highest, knots=None, value=math.nan, bottleneck=math.nan, travel=math.nan,
        clearance=math.nan, sigma_min=math.nan, worst=None, is_steady=True, stopped_by="", proof=None,
    )  # fmt: skip
    if way is None:
        return replace(found, stopped_by=_stop(rules, base, rolls, start, field, highest))
    places, columns = refined(rules, base, rolls, way, side, start)
    knots, told = _simplified(rules, base, rolls, places, columns)
    value, travel, gap, sigmas, samples = told
    worst = int(np.argmin(value))
    proof = None
    if prove:
        least = SHARE * float(np.min(sigmas)) if sigma is None else sigma
        apart = None if rules.scene is None else float(rules.machine.apart.clearance)
        demand = Demand(0.0 if rules.limits else -np.inf, apart, least)
        prover = Prover(rules.machine, rules.signs, rules.scene, rules.radius, rules.workpiece)
        proof = prover.prove(Patches.along(np.stack(knots)), demand, BUDGET, progress)
    return replace(
        found, knots=knots, value=float(value[worst]), bottleneck=way.value, travel=float(np.min(travel)),
        clearance=float(np.min(gap)), sigma_min=float(np.min(sigmas)), worst=Touch(*(float(c[worst]) for c in samples)),
        is_steady=way.is_steady, proof=proof,
    )  # fmt: skip


def _simplified(rules: Rules, base: Touch, rolls: Array, places: Array, columns: Array) -> tuple[Touch, tuple[Any, ...]]:
    """The knots of a way with as few of its corners as keep its value, and what is told of it."""
    whole = _told(rules, _touch(base, rolls, places, columns))
    for allowance in (2.0, 1.0, 0.5, 0.25, 0.125):
        keep = straightened(places, columns, allowance)
        # The path itself may bend at its own poses.
        rows = np.setdiff1d(np.arange(len(base.roll)), places[keep])
        fewer = np.sort(np.concatenate([keep, np.searchsorted(places, rows)])) if _bends(base) else keep
        knots = _touch(base, rolls, places[fewer], columns[fewer])
        told = _told(rules, knots)
        if told[0].min() >= KEPT * whole[0].min():
            return knots, told
    return _touch(base, rolls, places, columns), whole


def _told(rules: Rules, knots: Touch) -> tuple[Any, ...]:
    """Values, margins of travel, clearances and sigma_min at samples (n,) of a line through knots, and the samples."""
    parts = np.arange((len(knots.roll) - 1) * SAMPLES + 1) / SAMPLES
    samples = Touch(*(np.interp(parts, np.arange(len(c)), c) for c in knots))
    poses = _frames(samples, rules.radius)
    travel = travel_margin(rules.machine, poses, rules.signs)
    gap = np.full(len(parts), FAR)
    if rules.scene is not None:
        gap = clearance(rules.machine, rules.scene, poses, rules.signs, rules.workpiece)
    sigma = control(rules.machine, poses, rules.signs).sigma_min
    value = _worst_term(rules, poses, sigma)
    if rules.limits:
        value = np.where(travel >= 0, value, -np.inf)
    if rules.scene is not None:
        value = np.where(gap >= float(rules.machine.apart.clearance), value, -np.inf)
    return value, travel, gap, sigma, samples


def _stop(rules: Rules, base: Touch, rolls: Array, start: Array, field: Field, highest: int) -> str:
    """What keeps a machine from the end of a path."""
    if not np.isfinite(field.value[0][start[0]]).any():
        return f"at the start {_fault(rules, base, rolls, 0)}"
    closed = np.flatnonzero(~np.isfinite(field.value).any(axis=1))
    if len(closed):
        return f"at {_place(base, closed[0])} {_fault(rules, base, rolls, int(closed[0]))}"
    for words, freer in (
        ("without bodies", rules._replace(scene=None)),
        ("without limits", rules._replace(limits=False)),
        ("without limits and bodies", rules._replace(scene=None, limits=False)),
    ):
        way, _, _ = best_way(field_of(freer, base, rolls), start)
        if way is not None:
            poses = _touch(base, rolls, way.rows.astype(float), way.columns.astype(float))
            return f"there is a way {words} only; on it {_worst_fault(rules, poses)}"
    return f"a Type 2 singularity lies across, or no chain closes, beyond {_place(base, highest)}, whatever limits and bodies"


def _fault(rules: Rules, base: Touch, rolls: Array, row: int) -> str:
    """What is wrong at a row, at the roll that comes nearest."""
    return _worst_fault(
        rules, _touch(base, rolls, np.full(len(rolls), float(row)), np.arange(len(rolls), dtype=float)), best=True
    )


def _worst_fault(rules: Rules, touched: Touch, *, best: bool = False) -> str:
    """What is wrong at the worst of some poses, or at the best of them."""
    poses = _frames(touched, rules.radius)
    travel = travel_margin(rules.machine, poses, rules.signs)
    if rules.limits or not np.isfinite(travel).all():
        k = int(travel.argmax() if best else travel.argmin())
        miss = shortfall(
            rules.machine, in_batches(lambda part: joint_states(rules.machine, part, rules.signs), _some(poses, [k]))
        )
        if miss is not None:
            return f"{miss.reason} ({_angles(touched, k)})"
    if rules.scene is not None:
        names, gaps = nearest_bodies(rules.machine, rules.scene, poses, rules.signs, rules.workpiece)
        gaps = np.where(travel > 0, gaps, -np.inf) if best and rules.limits else gaps
        k = int(gaps.argmax() if best else gaps.argmin())
        return f"{names[k][0]} and {names[k][1]} are {gaps[k] * 1e3:.3g} mm apart ({_angles(touched, k)})"
    return f"the margins are less than a plan keeps in hand ({_angles(touched, 0)})"


def _angles(touched: Touch, k: int) -> str:
    return f"tilt {math.degrees(touched.tilt[k]):.3g} deg, roll {math.degrees(touched.roll[k]) % 360:.4g} deg"


def _place(base: Touch, row: int) -> str:
    return f"tilt {math.degrees(base.tilt[row]):.3g} deg"


def _touch(base: Touch, rolls: Array, places: Array, columns: Array) -> Touch:
    """Poses (k,) at places along the rows and the columns of a grid."""
    there = _between(base, places)
    return there._replace(roll=there.roll + _rolls_at(rolls, columns))


def _between(base: Touch, places: Array) -> Touch:
    return Touch(*(np.interp(places, np.arange(len(c)), c) for c in base))


def _rolls_at(rolls: Array, columns: Array) -> Array:
    return columns * (2 * math.pi / len(rolls))


def _bends(base: Touch) -> bool:
    return any(np.abs(np.diff(c, 2)).max(initial=0.0) > 1e-12 for c in base)


def _at(base: Touch, rows: Array, rolls: Array) -> Touch:
    there = Touch(*(np.asarray(c)[rows] for c in base))
    return there._replace(roll=there.roll + rolls)


def _frames(touched: Touch, radius: float) -> Frame:
    return jax.tree.map(np.asarray, touched.frame(radius))


def _some(poses: Frame, which: Any) -> Frame:
    count = len(poses.origin.x)
    return jax.tree.map(lambda c: np.broadcast_to(c, count)[which], poses)
