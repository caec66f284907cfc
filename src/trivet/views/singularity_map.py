"""Singularities over a surface."""

from __future__ import annotations

from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.study.singularity_map import SingularityMap
from trivet.views.layout import table
from trivet.views.si import finite


def tables(result: SingularityMap) -> list[Any]:
    """Ranges of all quantities, and the curves."""
    ranges = table("over the points that are reached", "quantity", "least", "median", "greatest", "unit")
    for name, values in result.fields.items():
        own = values[np.isfinite(values)]
        if len(own):
            ranges.add_row(name, f"{own.min():.4g}", f"{np.median(own):.4g}", f"{own.max():.4g}", result.unit(name))
    curves = table("curves of Type 2 singularities", "", "points", "length mm", "distance from the axis mm", "")
    for k, curve in enumerate(result.curves, 1):
        away = 1e3 * np.hypot(*curve.surface.position[:, :2].T)
        spread = f"{away.min():.3f} to {away.max():.3f}"
        closed = "closed" if curve.is_closed else "open"
        curves.add_row(str(k), str(len(curve.roll)), f"{1e3 * curve.length:.3f}", spread, closed)
    used = f"{int(result.used.sum())} of {len(result.surface)} points reached"
    height = 1e3 * float(result.surface.position[:, 2].min())
    return [
        f"{result.machine.name}, {mode_words(result.mode)}, {result.surface.name} at z0 = {height:g} mm, "
        f"roll {result.policy}: {used}",
        ranges,
        curves if result.curves else "no Type 2 singularity found between neighbouring points that are reached",
    ]


def as_json(result: SingularityMap) -> dict[str, Any]:
    """A map of singularities, point by point."""
    return {
        "machine": result.machine.name,
        "mode": result.mode,
        "surface": result.surface.name,
        "roll_policy": result.policy,
        "points": len(result.surface),
        "used": int(result.used.sum()),
        "position_m": finite(result.surface.position),
        "roll_rad": finite(result.roll),
        "fields_SI": {name: finite(values) for name, values in result.fields.items()},
        "units": {name: result.unit(name) for name in result.fields},
        "singular_curves": [
            {"position_m": finite(c.surface.position), "roll_rad": finite(c.roll), "closed": c.is_closed, "length_m": c.length}
            for c in result.curves
        ],
        "sign_changes_by_jumps": result.jumps,
    }
