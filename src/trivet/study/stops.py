"""Why a machine does not get to the end of a path: the joint, the bodies or the singularity in the way."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.report import joint_states, shortfall
from trivet.reach.certificate import Patches
from trivet.reach.margins import control, nearest_bodies, travel_margin
from trivet.reach.touch import Touch
from trivet.space.batches import in_batches
from trivet.study.aims import SIGMA
from trivet.study.closest import tightest
from trivet.study.requirements import BUDGET, demand_of, prover_of
from trivet.study.roll_grid import (
    RESERVE_GAP,
    RESERVE_TRAVEL,
    Field,
    RollGrid,
    Rules,
    best_way,
    degrees_of,
    field_of,
    frames_of,
    some,
)

Array = NDArray[Any]

PIECES, NOT_ZERO = 24, 1e-3
"""Of a whole turn of the roll, and sigma_min, with which it is proven that no pose of an end is singular."""
HALVINGS = 8
"""Of a step of the grid within which det J_x changes sign."""


def stop(rules: Rules, grid: RollGrid, start: Array, field: Field, highest: int) -> str:
    """What keeps a machine from the end of a path, in words.

    Args:
        rules: what is kept to.
        grid: the path, and rolls.
        start: (rows, columns) where a way may begin.
        field: over the grid.
        highest: the last row to which a way leads; -1 for none.
    """
    if highest < 0:
        return f"at the start {_fault(rules, grid, 0, np.flatnonzero(start[0]))}"
    closed = np.flatnonzero(~np.isfinite(field.value).any(axis=1))
    if len(closed):
        return f"beyond {grid.mark(closed[0] - 1)} {_fault(rules, grid, int(closed[0]), np.arange(grid.columns))}"
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
    side = field_of(free, grid).side
    first, last = (np.unique(row[row != 0]) for row in side[[0, -1]])
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
    return (
        f"start and end lie on different sides of a Type 2 singularity at {rolls}, whatever limits and bodies"
        f"{_ring(free, grid, side)}"
    )


def _ring(free: Rules, grid: RollGrid, side: Array) -> str:
    """Where along the path det J_x changes sign, over all rolls of the grid."""
    rows, columns = np.nonzero(side[:-1] * side[1:] < 0)
    if not len(rows):
        return ""
    low, high, before = rows.astype(float), rows + 1.0, side[rows, columns]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        found = control(free.machine, frames_of(grid.at(middle, columns), free.radius), free.signs).side
        low, high = np.where(found == before, middle, low), np.where(found == before, high, middle)
    ends = [float(np.interp(row, np.arange(grid.shape[0]), grid.marks)) for row in (low.min(), high.max())]
    what, unit = ("tilts", " deg") if grid.poses is None else ("poses", "")
    return f"; det J_x changes sign at {what} from {ends[0]:.3g} to {ends[1]:.3g}{unit}"


def _fault(rules: Rules, grid: RollGrid, row: int, columns: Array) -> str:
    """What is wrong with some columns of a row, at the roll that comes nearest."""
    touch = grid.at(np.full(len(columns), float(row)), columns)
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
            gap = (
                f"overlap by {-gaps[nearest] * 1e3:.3g} mm" if gaps[nearest] < 0 else f"are {gaps[nearest] * 1e3:.3g} mm apart"
            )
            return f"{pair} {gap} ({degrees_of(touch, nearest)})"
    if rules.limits and travel[k] <= RESERVE_TRAVEL:
        joint, left = tightest(rules, Touch(*(c[[k]] for c in touch)))
        return (
            f"{joint} has {1e2 * left:.2g} % of half its travel left, and a plan keeps {1e2 * RESERVE_TRAVEL:g} % in hand "
            f"({degrees_of(touch, k)})"
        )
    sigma = control(rules.machine, poses, rules.signs).sigma_min
    k = int(sigma.argmin())
    if not sigma[k] < rules.least_sigma:
        return f"det J_x vanishes: a Type 2 singularity ({degrees_of(touch, k)})"
    return f"sigma_min is {sigma[k]:.3g}, {rules.least_sigma:g} is demanded ({degrees_of(touch, k)})"
