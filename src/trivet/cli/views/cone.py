"""Rolls over a cone of directions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.cli.views.layout import table
from trivet.cli.views.plan import proof_json, proof_words, rules_words, touch_json
from trivet.cli.views.si import finite
from trivet.kinematics.mode import mode_words
from trivet.study.cone import ConePlan

SHOWN = 13
"""Azimuths of the table, about."""


def tables(plan: ConePlan) -> Iterator[Any]:
    """The rolls, what is met, and whether it is proven."""
    end = math.degrees(plan.knots.tilt.max())
    yield (
        f"{plan.machine.name}, {mode_words(plan.mode)}: every direction up to {end:g}° on the sphere of "
        f"{plan.rules.radius * 1e3:g} mm about z0 = {plan.knots.z[0, 0] * 1e3:g} mm"
    )
    if plan.sheet is None or plan.samples is None:
        most = f"; up to {math.degrees(plan.largest):.4g}° there is one" if math.isfinite(plan.largest) else ""
        yield f"NO roll that is continuous all over this cone is allowed{most}"
        yield rules_words(plan.rules)
        return
    tilts = np.unique(np.linspace(0, plan.knots.tilt.shape[1] - 1, 6).astype(int))
    found = table("alpha + roll, °", "azimuth °", *(f"tilt {math.degrees(plan.knots.tilt[0, k]):.4g}°" for k in tilts), left=0)
    for row in range(0, len(plan.knots.azimuth) - 1, max(1, (len(plan.knots.azimuth) - 1) // SHOWN)):
        azimuth = plan.knots.azimuth[row, 0]
        found.add_row(f"{math.degrees(azimuth):g}", *(f"{math.degrees(azimuth + plan.knots.roll[row, k]):.4g}" for k in tilts))
    yield found
    worst = int(plan.samples.value.argmin())
    there = plan.samples.touch
    gap = plan.samples.clearance.min()
    yield "\n".join([
        f"least value {plan.samples.value[worst]:.4g} at azimuth {math.degrees(there.azimuth[worst]):.4g}°, tilt "
        f"{math.degrees(there.tilt[worst]):.4g}°; travel left {100 * plan.samples.travel.min():.1f} %"
        + (f", clearance {gap * 1e3:.2f} mm" if math.isfinite(gap) else ""),
        proof_words(plan.proof),
    ])  # fmt: skip
    yield rules_words(plan.rules)


def as_json(plan: ConePlan) -> dict[str, Any]:
    """All of it."""
    samples = plan.samples
    return {
        "machine": plan.machine.name,
        "mode": plan.mode,
        "neutral": plan.neutral,
        "radius_m": plan.rules.radius,
        "centre_m": [float(c[0, 0]) for c in plan.knots[:3]],
        "cone_rad": float(plan.knots.tilt.max()),
        "possible": plan.sheet is not None,
        "safe": plan.is_safe,
        "widest_possible_rad": finite(plan.largest),
        "value": None if samples is None else finite(float(samples.value.min())),
        "sigma_min": None if samples is None else finite(float(samples.sigma_min.min())),
        "travel_margin": None if samples is None else finite(float(samples.travel.min())),
        "clearance_m": None if samples is None else finite(float(samples.clearance.min())),
        "knots": None if plan.sheet is None else touch_json(plan.knots),
        "proof": None if plan.proof is None else proof_json(plan.proof),
    }
