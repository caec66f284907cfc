"""Rolls over a cone of directions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.study.cone import ConePlan
from trivet.study.roll_grid import Along
from trivet.views.layout import table
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

SHOWN = 13
"""Azimuths of the table, about."""


def tables(plan: ConePlan) -> Iterator[Any]:
    """The rolls, what is met, and whether it is proven."""
    end = math.degrees(plan.knots.tilt.max())
    yield (
        f"{plan.machine.name}, {mode_words(plan.mode)}: every direction up to {end:g}° on the sphere of "
        f"{plan.rules.radius * 1e3:g} mm about z0 = {plan.knots.z[0, 0] * 1e3:g} mm"
    )
    if plan.samples is None:
        most = f"; up to {math.degrees(plan.largest):.4g}° there is one" if math.isfinite(plan.largest) else ""
        yield f"NO roll that is continuous all over this cone is allowed{most}"
        yield rules_words(plan.rules)
        return
    yield f"{_met(plan, plan.samples)}\n{proof_words(plan.rules, plan.proof)}"
    tilts = np.unique(np.linspace(0, plan.knots.tilt.shape[1] - 1, 6).astype(int))
    found = table(
        "azimuth + roll, °", "azimuth °", *(f"tilt {math.degrees(plan.knots.tilt[0, k]):.4g}°" for k in tilts), left=0
    )
    for row in range(0, len(plan.knots.azimuth) - 1, max(1, (len(plan.knots.azimuth) - 1) // SHOWN)):
        azimuth = plan.knots.azimuth[row, 0]
        found.add_row(f"{math.degrees(azimuth):g}", *(f"{math.degrees(azimuth + plan.knots.roll[row, k]):.4g}" for k in tilts))
    yield found
    yield rules_words(plan.rules)


def _met(plan: ConePlan, samples: Along) -> str:
    """What is met at samples of a cone."""
    close = plan.closest
    assert close is not None

    def where(sample: int) -> str:
        azimuth, tilt = (math.degrees(c[sample]) for c in (samples.touch.azimuth, samples.touch.tilt))
        return f"azimuth {azimuth:.4g}°, tilt {tilt:.4g}°"

    left = [
        f"sigma_min is at least {samples.sigma_min.min():.4f}",
        travel_words(float(samples.travel.min()), close.joint, where(close.joint_at)),
        clearance_words(float(samples.clearance.min()), close.bodies, where(close.bodies_at)),
    ]
    return (
        f"{value_words(plan.rules, samples, plan.worst)} at {where(plan.worst)}\n"
        f"all over the cone {', '.join(part for part in left if part)}"
    )


def as_json(plan: ConePlan) -> dict[str, Any]:
    """All of it."""
    return {
        "machine": plan.machine.name,
        "mode": plan.mode,
        "neutral": plan.neutral,
        "radius_m": plan.rules.radius,
        "centre_m": [float(c[0, 0]) for c in plan.knots[:3]],
        "cone_rad": float(plan.knots.tilt.max()),
        "possible": plan.is_possible,
        "safe": plan.is_safe,
        "widest_possible_rad": finite(plan.largest),
        **met_json(plan.rules, plan.samples, plan.worst, plan.closest),
        "knots": touch_json(plan.knots) if plan.is_possible else None,
        "proof": proof_json(plan.rules, plan.proof),
    }
