"""Ways to a tilt, and the working modes that have one."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator
from typing import Any

from trivet.kinematics.inverse import branches
from trivet.kinematics.mode import mode_words, parse_mode
from trivet.study.advice import Change
from trivet.study.closest import Drives
from trivet.study.plan import Plan, PlanStudy
from trivet.views.layout import table
from trivet.views.plan_cases import cases
from trivet.views.plan_words import (
    clearance_words,
    met_json,
    proof_json,
    proof_words,
    rules_words,
    touch_json,
    travel_words,
    value_words,
)
from trivet.views.si import finite
from trivet.views.tilt import free_cones

SHOWN = 40
"""Rows of a table, at most."""


def tables(study: PlanStudy, advice: tuple[Change, ...] | None = None) -> Iterator[Any]:
    """One way in full, with advice where it was asked for, or a row for each."""
    if len(study.plans) > 1:
        yield from cases(study)
        return
    yield from _one(study.plans[0])
    if advice is not None and not study.plans[0].is_possible:
        yield _advice(advice)


def _advice(changes: tuple[Change, ...]) -> Any:
    if not changes:
        return (
            "advice: no change of one dimension is in sight that mends it: its margins alone do not stop it, or lack too much"
        )
    found = table(
        "one change each, the smallest first", "dimension", "now", "needed", "change", "mends", "a way then", "option", left=1
    )
    for change in changes:
        part = f"{100 * change.part:.1f} %"
        then = "yes" if change.passes else "not with that alone"
        found.add_row(change.dimension, *change.written, part, change.mends, then, shlex.join(change.option))
    found.columns[-1].justify = "left"
    return found


def _one(plan: Plan) -> Iterator[Any]:
    path, heading = plan.grid.path, f"{plan.machine.name}, {mode_words(plan.mode)}: "
    if plan.grid.poses is None:
        heading += (
            f"to {math.degrees(path.tilt[-1]):g}° at azimuth {math.degrees(path.azimuth[-1]):g}° on the sphere of "
            f"{plan.rules.radius * 1e3:g} mm about z0 = {path.z[0] * 1e3:g} mm"
        )
    else:
        heading += f"through {plan.grid.poses[-1]:g} poses"
    yield heading
    yield assembly_words(plan)
    if plan.along is None or plan.knots is None or plan.places is None:
        yield f"NO way: {plan.stopped_by}"
        yield rules_words(plan.rules)
        return
    yield f"{_met(plan)}\n{proof_words(plan.rules, plan.proof)}"
    is_path = plan.grid.poses is not None
    found = table("the way", "at", *(["x mm", "y mm", "z mm"] * is_path), "azimuth °", "tilt °", "roll °")
    for place, *knot in list(zip(plan.places, *plan.knots, strict=True))[:SHOWN]:
        where = [f"{c * 1e3:.3f}" for c in knot[:3]] * is_path
        found.add_row(plan.grid.mark(place), *where, *(f"{math.degrees(angle):.3f}" for angle in knot[3:]))
    if len(plan.places) > SHOWN:
        found.add_row(f"and {len(plan.places) - SHOWN} more with --json")
    yield found
    yield rules_words(plan.rules)


def _met(plan: Plan) -> str:
    """What is met at samples of a way."""
    samples, close = plan.along, plan.closest
    assert samples is not None
    assert close is not None
    assert plan.drives is not None
    roll = math.degrees(samples.touch.roll[plan.worst])
    left = [
        f"sigma_min {plan.sigma_min:.4f}",
        travel_words(plan.travel, close.joint, plan.grid.mark(samples.rows[close.joint_at])),
        clearance_words(plan.clearance, close.bodies, plan.grid.mark(samples.rows[close.bodies_at])),
    ]
    return "\n".join([
        f"{value_words(plan.rules, samples, plan.worst)} at {plan.grid.mark(samples.rows[plan.worst])}, roll {roll:.2f}°",
        f"least at samples: {', '.join(part for part in left if part)}"
        + ("" if plan.is_steady else "; the way goes back along the path on the first grid"),
        _drives(plan, plan.drives),
    ])  # fmt: skip


def _drives(plan: Plan, drives: Drives) -> str:
    """The drive that moves fastest."""
    where, drive = drives.fastest
    rate = abs(drives.rates[where, drive])
    shown = f"{rate:.3g}°" if drives.is_angular[drive] else f"{rate * 1e3 * math.radians(1):.3g} mm"
    moves = "" if plan.grid.poses is None else f", or per {drives.size * 1e3 * math.radians(1):.3g} mm that it moves"
    return (
        f"fastest of the drives is {drives.names[drive]}: {shown} per degree that the platform turns{moves}, at "
        f"{plan.grid.mark(drives.rows[where])}; the nearer a Type 1 singularity, the faster"
    )


def assembly_words(plan: Plan) -> str:
    """How a machine stands in a mode that is not its own."""
    machine, own = plan.machine, parse_mode(plan.machine)
    parts = []
    for leg, there, here in zip(machine.legs, plan.rules.signs, own, strict=True):
        chosen = [WORDS[branch][0 if there[branch] > 0 else 1] for branch in branches(leg) if there[branch] != here[branch]]
        parts += [f"{leg.name} with {' and '.join(chosen)}"] if chosen else []
    return "assembled as described" if not parts else f"to be assembled anew: {'; '.join(parts)}"


WORDS = (
    ("its carriage on the side of its platform joint", "its carriage on the far side of the guide's axis"),
    ("its elbow as described (+)", "its elbow the other way (-)"),
)
"""Of the side and of the elbow: plus, minus."""


def as_json(study: PlanStudy, advice: tuple[Change, ...] | None = None) -> dict[str, Any]:
    """Every plan, and advice where it was asked for."""
    found: dict[str, Any] = {"plans": [_plan(plan) for plan in study.plans]}
    if advice is not None:
        found["advice"] = [
            {
                "dimension": change.dimension,
                "now_SI": change.now,
                "needed_SI": change.needed,
                "mends": change.mends,
                "passes": change.passes,
                "option": list(change.option),
            }
            for change in advice
        ]
    return found


def _plan(plan: Plan) -> dict[str, Any]:
    path, is_tilt = plan.grid.path, plan.grid.poses is None
    highest = None if plan.highest < 0 else float(plan.grid.marks[plan.highest])
    return {
        "machine": plan.machine.name,
        "mode": plan.mode,
        "assembly": assembly_words(plan),
        "neutral": plan.neutral,
        "radius_m": plan.rules.radius if is_tilt else None,
        "centre_m": [float(c[0]) for c in path[:3]] if is_tilt else None,
        "azimuth_rad": float(path.azimuth[-1]) if is_tilt else None,
        "to_rad": float(path.tilt[-1]) if is_tilt else None,
        "aims": [{"name": aim.name, "one_SI": aim.unit} for aim in plan.rules.aims],
        "limits": plan.rules.limits,
        "cones_not_checked": free_cones(plan.machine),
        "bodies_apart": plan.rules.scene is not None,
        "possible": plan.is_possible,
        "safe": plan.is_safe,
        "stopped_by": plan.stopped_by or None,
        "highest_rad": math.radians(highest) if is_tilt and highest is not None else None,
        "highest_pose": None if is_tilt else highest,
        "poses": None if plan.grid.poses is None else int(plan.grid.poses[-1]),
        "grid_bottleneck": finite(plan.bottleneck),
        **met_json(plan.rules, plan.along, plan.worst, plan.closest),
        "knots": None if plan.knots is None else touch_json(plan.knots),
        "drives": None if plan.drives is None else _drives_json(plan, plan.drives),
        "proof": proof_json(plan.rules, plan.proof),
    }


def _drives_json(plan: Plan, drives: Drives) -> dict[str, Any]:
    """Coordinates at the knots, and the greatest rate."""
    where, drive = drives.fastest
    unit = ["rad" if is_angular else "m" for is_angular in drives.is_angular]
    return {
        "at_knots": [
            {"name": name, f"coordinate_{own}": finite(column)}
            for name, own, column in zip(drives.names, unit, drives.knots.T, strict=True)
        ],
        "fastest": {
            "name": drives.names[drive],
            f"rate_{unit[drive]}_per_rad": float(abs(drives.rates[where, drive])),
            "at": plan.grid.mark(drives.rows[where]),
        },
    }
