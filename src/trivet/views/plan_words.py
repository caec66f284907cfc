"""What ways and cones have in common, in words and in JSON: what is kept to, what is met, what is proven."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from trivet.reach.certificate import Demand, Proof
from trivet.reach.touch import Touch
from trivet.study.closest import Closest, aims_at, governing
from trivet.study.roll_grid import Aim, Along, Rules, met
from trivet.views.si import diagonal_key, finite
from trivet.views.tilt import free_cones


def value_words(rules: Rules, samples: Along, sample: int) -> str:
    """What the aims come to at the worst sample; of several which one governs."""
    values = aims_at(rules, samples, sample)
    if len(values) == 1:
        ((aim, value),) = values.items()
        return f"least {aim.name} {in_unit(aim, value)}"
    parts = (f"{aim.name} {in_unit(aim, v)}, {v / aim.unit:.4g} of {in_unit(aim, aim.unit)}" for aim, v in values.items())
    return f"least value {samples.value[sample]:.4g} ({'; '.join(parts)}: {governing(values).name} governs)"


def in_unit(aim: Aim, value: float) -> str:
    """A value of an aim with its unit."""
    if aim.scalar is None:
        return f"{value:.4g}"
    return f"{value:.4g} N m/rad" if aim.scalar.is_rotational else f"{value * 1e-6:.4g} N/µm"


def travel_words(travel: float, joint: str, where: str) -> str:
    """The least travel left, and of which joint."""
    if not joint:
        return "no joint has limits"
    return f"{travel_number(travel)} % of half the travel left ({joint} at {where})"


def clearance_words(gap: float, bodies: tuple[str, str], where: str) -> str:
    """The least clearance, and of which bodies."""
    return f"clearance {gap_number(gap)} mm ({bodies[0]} and {bodies[1]} at {where})" if math.isfinite(gap) else ""


def travel_number(travel: float) -> str:
    """Of half a joint's travel, in percent; a dash where no joint is limited, which is a whole half to rounding."""
    return f"{travel * 100:.1f}" if math.isfinite(travel) and travel != 1 else "–"


def gap_number(gap: float) -> str:
    """A distance in mm."""
    return f"{gap * 1e3:.2f}" if math.isfinite(gap) else "–"


def proof_words(rules: Rules, proof: Proof | None) -> str:
    """What is proven; or what is open, and what is met in the middle of it."""
    if proof is None:
        return "not proven: no proof was asked for"
    told = _demand(proof.demand)
    if proof.is_proven:
        return f"PROVEN between these poses too: {told}; in fact {_bounds(proof)} at least ({proof.patches} pieces looked at)"
    there, size = _middle(proof), math.degrees(float(proof.open.size[proof.smallest]))
    found = _met(rules, there)
    values = [f"sigma_min {found.sigma_min[0]:.4g}", f"{travel_number(found.travel[0])} % of half the travel left"]
    values += [f"clearance {gap_number(found.clearance[0])} mm"] if rules.scene is not None else []
    where = f"tilt {math.degrees(there.tilt[0]):.4f}°, roll {math.degrees(there.roll[0]):.4f}°, {size:.2g}° wide"
    return (
        f"{'REFUTED' if proof.is_refuted else 'NOT proven'} between these poses: {told} ({proof.patches} pieces looked at)\n"
        f"open is {proof.reason} about {where}; at its middle {', '.join(values)}"
    )


def _bounds(proof: Proof) -> str:
    """What has come out as proven, more than was asked for."""
    parts = [f"sigma_min {proof.least.sigma_min:.4g}"]
    if math.isfinite(proof.demand.travel) and travel_number(proof.least.travel) != "–":
        parts.append(f"{travel_number(proof.least.travel)} % of half the travel left")
    if proof.least.clearance is not None and math.isfinite(proof.least.clearance):
        parts.append(f"clearance {gap_number(proof.least.clearance)} mm")
    return ", ".join(parts)


def _middle(proof: Proof) -> Touch:
    """The middle (1,) of the smallest open piece."""
    return Touch(*proof.open.middle[:, [proof.smallest]])


def _met(rules: Rules, there: Touch) -> Along:
    return met(rules, there, np.zeros(1))


def _demand(demand: Demand) -> str:
    parts = [f"sigma_min above {demand.sigma_min:.4g}"]
    if math.isfinite(demand.travel):
        parts.append("all joints inside their travel")
    if demand.clearance is not None:
        parts.append(f"bodies at least {demand.clearance * 1e3:g} mm apart")
    return ", ".join(parts)


def rules_words(rules: Rules) -> str:
    """What the value is, and what is kept to."""
    aims = rules.aims[0].name
    if len(rules.aims) > 1:
        aims = f"of {' and '.join(f'{aim.name} over {in_unit(aim, aim.unit)}' for aim in rules.aims)}"
    limits = [
        *(["joints inside their travel"] if rules.limits else []),
        *(["bodies apart"] if rules.scene is not None else []),
        "one side of every Type 2 singularity",
    ]
    lines = [f"value: the least {aims} at samples, which is made as great as it can be; kept to: {', '.join(limits)}"]
    names = free_cones(rules.machine)
    if names and rules.limits:
        lines.append(f"NOT checked: the cone of {', '.join(names)}, for no neutral axis is given (--neutral)")
    if rules.radius > 0 and not any(part.source == ("workpiece",) for part in (rules.scene.parts if rules.scene else ())):
        lines.append("the sphere is where the platform goes, and nothing to run into (--solid makes it so)")
    return "\n".join(lines)


def met_json(rules: Rules, samples: Along | None, worst: int, found: Closest | None) -> dict[str, Any]:
    """What is met at samples at the worst, and where that is; nothing but null where there are none."""
    if samples is None or found is None:
        names = (
            "value",
            "governs",
            "at_worst",
            "sigma_min",
            "travel_margin",
            "clearance_m",
            "tightest_joint",
            "nearest_bodies",
        )
        return dict.fromkeys(names)
    values = aims_at(rules, samples, worst)
    return {
        "value": finite(float(samples.value[worst])),
        "governs": governing(values).name,
        "at_worst": {
            aim.name if aim.scalar is None else diagonal_key(aim.name): finite(value) for aim, value in values.items()
        },
        "sigma_min": finite(float(samples.sigma_min.min())),
        "travel_margin": finite(float(samples.travel.min())),
        "clearance_m": finite(float(samples.clearance.min())),
        "tightest_joint": {"name": found.joint, **_at(samples, found.joint_at)} if found.joint else None,
        "nearest_bodies": {"names": list(found.bodies), **_at(samples, found.bodies_at)} if found.bodies[0] else None,
    }


def _at(samples: Along, sample: int) -> dict[str, Any]:
    return touch_json(Touch(*(float(c[sample]) for c in samples.touch)))


def touch_json(touch: Touch) -> dict[str, Any]:
    """Poses by their coordinates."""
    names = ("x_m", "y_m", "z_m", "azimuth_rad", "tilt_rad", "roll_rad")
    return {name: finite(c) for name, c in zip(names, touch, strict=True)}


def proof_json(rules: Rules, proof: Proof | None) -> dict[str, Any] | None:
    """What is proven; or what is open, and what is met in the middle of it."""
    if proof is None:
        return None
    told: dict[str, Any] = {
        "proven": proof.is_proven,
        "refuted": proof.is_refuted,
        "pieces": proof.patches,
        "sigma_min": proof.demand.sigma_min,
        "travel_margin": finite(proof.demand.travel),
        "clearance_m": finite(proof.demand.clearance),
    }
    if not proof.is_proven:
        there = _middle(proof)
        found = _met(rules, there)
        told |= {
            "open": proof.reason,
            "open_at": touch_json(Touch(*(float(c[0]) for c in there))),
            "open_size_rad": float(proof.open.size[proof.smallest]),
            "met_there": {
                "sigma_min": finite(found.sigma_min[0]),
                "travel_margin": finite(found.travel[0]),
                "clearance_m": finite(found.clearance[0]),
            },
        }
    return told
