"""Ways to a tilt, and the working modes that have one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from trivet.cli.views.layout import table
from trivet.cli.views.si import finite
from trivet.cli.views.tilt import free_cones
from trivet.kinematics.inverse import branches
from trivet.kinematics.mode import mode_words, parse_mode
from trivet.reach.certificate import Demand, Proof
from trivet.reach.touch import Touch
from trivet.study.advice import Change
from trivet.study.plan import Plan, PlanStudy
from trivet.study.roll_grid import Rules

ALIKE = 1e-6
"""Ways whose values differ by less, in parts, are told in one row: modes that only name the chains differently."""
SHOWN = 40
"""Rows of a table, at most."""


def tables(study: PlanStudy, advice: tuple[Change, ...] | None = None) -> Iterator[Any]:
    """One way in full, with advice where it was asked for, or a row for each."""
    if len(study.plans) == 1:
        yield from _one(study.plans[0])
        if advice is not None and not study.plans[0].is_possible:
            yield _advice(advice)
        return
    groups = _grouped(study.plans)
    found = table(
        f"{len(study.plans)} cases, the best first", "machine", "mode", "alike", "z0 mm", "least value", "sigma_min",
        "travel %", "clearance mm", "worst at", "free all along", "stopped", left=2,
    )  # fmt: skip
    for group in groups[:SHOWN]:
        found.add_row(*_row(group[0], len(group)))
    yield found
    if len(groups) > SHOWN:
        yield f"and {len(groups) - SHOWN} more rows; all of them with --json"
    yield rules_words(study.plans[0].rules)


def _advice(changes: tuple[Change, ...]) -> Any:
    if not changes:
        return "advice: it is not joints' travel alone that stops it; no change of a dimension was tried"
    found = table("one change each, the smallest first", "dimension", "now", "needed", "change", "a way then")
    for change in changes:
        part = f"{100 * change.part:.1f} %" if math.isfinite(change.part) else "–"
        found.add_row(change.dimension, *change.written, part, "yes" if change.passes else "not with that alone")
    return found


def _grouped(plans: tuple[Plan, ...]) -> list[list[Plan]]:
    groups: list[list[Plan]] = []
    for plan in plans:
        same = next((group for group in groups if _is_alike(group[0], plan)), None)
        if same is None:
            groups.append([plan])
        else:
            same.append(plan)
    return groups


def _is_alike(one: Plan, two: Plan) -> bool:
    if one.machine.name != two.machine.name or one.grid.path.z[0] != two.grid.path.z[0]:
        return False
    if one.is_possible and two.is_possible:
        return math.isclose(one.bottleneck, two.bottleneck, rel_tol=ALIKE)
    return one.is_possible == two.is_possible and one.stopped_by == two.stopped_by


def _row(plan: Plan, count: int) -> tuple[str, ...]:
    height = f"{plan.grid.path.z[0] * 1e3:g}"
    first = (plan.machine.name, plan.mode, str(count), height)
    if plan.along is None:
        return (*first, "–", "–", "–", "–", "–", "–", plan.stopped_by)
    return (
        *first, _value(plan), f"{plan.sigma_min:.4f}", _travel(plan), _gap(plan.clearance),
        plan.grid.mark(plan.along.rows[plan.worst]), _verdict(plan), "",
    )  # fmt: skip


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
    if plan.along is None or plan.knots is None:
        yield f"NO way: {plan.stopped_by}"
        yield rules_words(plan.rules)
        return
    assert plan.places is not None
    found = table("the way", "at", "azimuth °", "tilt °", "roll °")
    for place, *angles in list(zip(plan.places, *plan.knots[3:], strict=True))[:SHOWN]:
        found.add_row(plan.grid.mark(place), *(f"{math.degrees(angle):.3f}" for angle in angles))
    if len(plan.places) > SHOWN:
        found.add_row(f"and {len(plan.places) - SHOWN} more with --json")
    if plan.proof is not None and not plan.is_safe:
        yield proof_words(plan.proof)
    yield found
    worst = plan.along.touch
    yield "\n".join([
        f"least value {_value(plan)} at {plan.grid.mark(plan.along.rows[plan.worst])}, roll "
        f"{math.degrees(worst.roll[plan.worst]):.2f}°; on the first grid {plan.bottleneck:.6g}",
        f"along the way sigma_min is at least {plan.sigma_min:.4f}, travel left {_travel(plan)} %, clearance "
        f"{_gap(plan.clearance)} mm" + ("" if plan.is_steady else "; the way goes back along the path on the first grid"),
        proof_words(plan.proof),
    ])  # fmt: skip
    yield rules_words(plan.rules)


def proof_words(proof: Proof | None) -> str:
    """What is proven, or what is open."""
    if proof is None:
        return "not proven: no proof was asked for"
    told = _demand(proof.demand)
    if proof.is_proven:
        return f"PROVEN between these poses too: {told} ({proof.patches} pieces looked at)"
    there = Touch(*(float(c[proof.smallest]) for c in proof.open.middle))
    size = math.degrees(float(proof.open.size[proof.smallest]))
    where = f"tilt {math.degrees(there.tilt):.4f}°, roll {math.degrees(there.roll):.4f}°, {size:.2g}° wide"
    verdict = "REFUTED" if proof.is_refuted else "NOT proven"
    return f"{verdict}: {told}; open is {proof.reason} about {where} ({proof.patches} pieces looked at)"


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


def _demand(demand: Demand) -> str:
    parts = [f"sigma_min above {demand.sigma_min:.4g}"]
    if math.isfinite(demand.travel):
        parts.append("all joints inside their travel")
    if demand.clearance is not None:
        parts.append(f"bodies at least {demand.clearance * 1e3:g} mm apart")
    return ", ".join(parts)


def rules_words(rules: Rules) -> str:
    """What the value is, and what is kept to."""
    aims = " and ".join(aim.name if aim.unit == 1 else f"{aim.name} over {aim.unit:g}" for aim in rules.aims)
    limits = [
        *(["joints inside their travel"] if rules.limits else []),
        *(["bodies apart"] if rules.scene is not None else []),
        "one side of every Type 2 singularity",
    ]
    lines = [f"value: the least {aims} along the way, which is made as great as it can be; kept to: {', '.join(limits)}"]
    names = free_cones(rules.machine)
    if names and rules.limits:
        lines.append(f"NOT checked: the cone of {', '.join(names)}, for no neutral axis is given (--neutral)")
    if rules.radius > 0 and not any(part.source == ("workpiece",) for part in (rules.scene.parts if rules.scene else ())):
        lines.append("the sphere is where the platform goes, and nothing to run into (--solid makes it so)")
    return "\n".join(lines)


def _verdict(plan: Plan) -> str:
    if plan.proof is None:
        return "not asked"
    return "proven" if plan.proof.is_proven else ("refuted" if plan.proof.is_refuted else "not proven")


def _value(plan: Plan) -> str:
    return f"{plan.value:.4g}"


def _travel(plan: Plan) -> str:
    return f"{plan.travel * 100:.1f}" if math.isfinite(plan.travel) else "–"


def _gap(gap: float) -> str:
    return f"{gap * 1e3:.2f}" if math.isfinite(gap) else "–"


def as_json(study: PlanStudy, advice: tuple[Change, ...] | None = None) -> dict[str, Any]:
    """Every plan, and advice where it was asked for."""
    found: dict[str, Any] = {"plans": [_plan(plan) for plan in study.plans]}
    if advice is not None:
        found["advice"] = [
            {"dimension": c.dimension, "now_SI": c.now, "needed_SI": c.needed, "passes": c.passes} for c in advice
        ]
    return found


def _plan(plan: Plan) -> dict[str, Any]:
    path = plan.grid.path
    return {
        "machine": plan.machine.name,
        "mode": plan.mode,
        "assembly": assembly_words(plan),
        "neutral": plan.neutral,
        "radius_m": plan.rules.radius,
        "centre_m": [float(c[0]) for c in path[:3]],
        "azimuth_rad": float(path.azimuth[-1]),
        "to_rad": float(path.tilt[-1]),
        "aims": [{"name": aim.name, "one": aim.unit} for aim in plan.rules.aims],
        "limits": plan.rules.limits,
        "cones_not_checked": free_cones(plan.machine),
        "bodies_apart": plan.rules.scene is not None,
        "possible": plan.is_possible,
        "safe": plan.is_safe,
        "stopped_by": plan.stopped_by or None,
        "highest_rad": None if plan.highest < 0 else float(path.tilt[plan.highest]),
        "poses": None if plan.grid.poses is None else float(plan.grid.poses[-1]),
        "value": finite(plan.value),
        "grid_bottleneck": finite(plan.bottleneck),
        "sigma_min": finite(plan.sigma_min),
        "travel_margin": finite(plan.travel),
        "clearance_m": finite(plan.clearance),
        "knots": None if plan.knots is None else touch_json(plan.knots),
        "proof": None if plan.proof is None else proof_json(plan.proof),
    }


def touch_json(touch: Touch) -> dict[str, Any]:
    """Poses by their coordinates."""
    names = ("x_m", "y_m", "z_m", "azimuth_rad", "tilt_rad", "roll_rad")
    return {name: finite(c) for name, c in zip(names, touch, strict=True)}


def proof_json(proof: Proof) -> dict[str, Any]:
    """What is proven, or what is open."""
    found: dict[str, Any] = {
        "proven": proof.is_proven,
        "refuted": proof.is_refuted,
        "pieces": proof.patches,
        "sigma_min": proof.demand.sigma_min,
        "travel_margin": finite(proof.demand.travel),
        "clearance_m": finite(proof.demand.clearance),
    }
    if not proof.is_proven:
        middle = Touch(*(float(c[proof.smallest]) for c in proof.open.middle))
        found |= {"open": proof.reason, "open_at": touch_json(middle), "open_size_rad": float(proof.open.size[proof.smallest])}
    return found
