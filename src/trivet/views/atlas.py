"""Frequency responses over many poses."""

from __future__ import annotations

from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.study.atlas import Atlas
from trivet.study.response_summary import unit_of_least
from trivet.views.layout import table
from trivet.views.si import finite


def tables(result: Atlas) -> list[Any]:
    """Least dynamic stiffnesses over the poses, and the worst pose of each."""
    used = result.used
    where = "platform centre" if result.point == "platform" else "tool tip"
    low, high = result.frequency[[0, -1]]
    spread = table("least over frequency of 1/|H|, over the poses that are reached", "", "least", "median", "greatest", "unit")
    worst = table(
        f"worst poses, {_sought(result)}", "", "stiffness", "unit", "Hz", "x mm", "y mm", "z mm", "azimuth °", "tilt °",
        "roll °", "least at a point",
    )  # fmt: skip
    for k, (entry, one) in enumerate(zip(result.entries, result.worst, strict=True)):
        unit = unit_of_least(entry)
        own = result.stiffness[used, k] * unit.factor
        spread.add_row(entry, *(_number(value) for value in (own.min(), np.median(own), own.max())), unit.written)
        if not np.isfinite(one.stiffness):
            worst.add_row(entry, "unbounded", unit.written)
            continue
        place = [f"{1e3 * c:.4f}" for c in one.position]
        angles = [f"{np.degrees(a):.3f}" for a in (one.azimuth, one.tilt, one.roll)]
        stiffness, on_grid = (f"{value * unit.factor:.4g}" for value in (one.stiffness, one.on_grid))
        worst.add_row(entry, stiffness, unit.written, f"{one.frequency:.2f}", *place, *angles, on_grid)
    ends = [one.entry for one in result.worst if one.is_at_end]
    notes = (
        [f"{', '.join(ends)}: least at an end of the range of frequencies; there may be less beyond it, as near a singularity"]
        if ends
        else []
    )
    none = [entry for k, entry in enumerate(result.entries) if np.any(np.isinf(result.stiffness[:, k]))]
    if none:
        notes.append(f"{', '.join(none)}: unbounded where the motion has nothing to do with the load, as symmetry makes it")
    return [
        f"{result.machine.name}, {mode_words(result.mode)}, {result.family.name}, roll {result.policy}: {int(used.sum())} of "
        f"{len(result.family)} points reached; {where}, {low:g} to {high:g} Hz, loss factor {result.loss_factor:g}",
        spread,
        worst,
        *notes,
    ]


def _number(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "unbounded"


def _sought(result: Atlas) -> str:
    return "sought between the points" if result.sought else "of the points alone"


def as_json(result: Atlas) -> dict[str, Any]:
    """An atlas, point by point; of the responses their least and greatest over the poses."""
    units = {entry: unit_of_least(entry).si for entry in result.entries}
    places = result.places
    return {
        "machine": result.machine.name,
        "mode": result.mode,
        "family": result.family.name,
        "roll_policy": result.policy,
        "point": result.point,
        "entries": list(result.entries),
        "loss_factor": result.loss_factor,
        "points": len(result.family),
        "used": int(result.used.sum()),
        "position_m": finite(places.position),
        "azimuth_rad": finite(places.azimuth),
        "tilt_rad": finite(places.tilt),
        "roll_rad": finite(places.roll),
        "least_stiffness_SI": {e: finite(result.stiffness[:, k]) for k, e in enumerate(result.entries)},
        "at_frequency_Hz": {e: finite(result.at_frequency[:, k]) for k, e in enumerate(result.entries)},
        "units_of_stiffness": units,
        "worst_is_sought_between_points": result.sought,
        "worst": {
            one.entry: {
                "stiffness_SI": finite(one.stiffness),
                "frequency_Hz": finite(one.frequency),
                "position_m": finite(np.array(one.position)),
                "azimuth_rad": finite(one.azimuth),
                "tilt_rad": finite(one.tilt),
                "roll_rad": finite(one.roll),
                "least_at_a_point_SI": finite(one.on_grid),
                "is_at_end_of_range": one.is_at_end,
            }
            for one in result.worst
        },
        "frequency_Hz": finite(result.frequency),
        "least_receptance_SI": {e: finite(result.least[k]) for k, e in enumerate(result.entries)},
        "greatest_receptance_SI": {e: finite(result.greatest[k]) for k, e in enumerate(result.entries)},
    }
