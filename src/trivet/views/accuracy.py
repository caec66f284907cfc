"""How far the platform is from where it is commanded."""

from __future__ import annotations

from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.results.netcdf import COMPONENTS
from trivet.study.accuracy import SMALL, Accuracy
from trivet.views.layout import table
from trivet.views.si import finite

FAINT = 1e-6
"""Part of the greatest component of the same unit that is rounding."""


def tables(result: Accuracy) -> list[Any]:
    """Errors over the poses, at the least accurate of them, and what they come from."""
    used, least = result.used, result.least_accurate
    where = "platform centre" if result.point == "platform" else "tool tip"
    notes = []
    if result.beyond.any():
        notes.append(
            f"{int(result.beyond.sum())} points: the platform may turn by more than {np.degrees(SMALL):.2g}°, as near a "
            "singularity; first order is no measure there, and what is told above is told of the other points"
        )
    return [
        f"{result.machine.name}, {mode_words(result.mode)}, {result.family.name}, roll {result.policy}: {int(used.sum())} of "
        f"{len(result.family)} points reached; {where}, drives held",
        _sizes(result),
        _at(result, least),
        _budget(result, least),
        *notes,
    ]


def _sizes(result: Accuracy) -> Any:
    """Distances and angles over the poses."""
    spread = table("over the points", "", "least", "median", "greatest", "unit")
    longest = result.ellipsoids[..., 2]
    for half, unit in enumerate(("µm", "µrad")):
        what = ("position", "rotation")[half]
        rows = (("root mean square", result.size), ("3 sigma, longest half axis", longest), ("at worst", result.farthest))
        for name, values in rows:
            own = 1e6 * values[result.told, half]
            spread.add_row(f"{what}, {name}", *(f"{v:.4g}" for v in (own.min(), np.median(own), own.max())), unit)
    return spread


def _at(result: Accuracy, point: int) -> Any:
    """Components at one point."""
    places = result.places
    assert places.roll is not None
    x, y, z = 1e3 * places.position[point]
    azimuth, tilt, roll = (float(np.degrees(a[point])) for a in (places.azimuth, places.tilt, places.roll))
    title = f"least accurate point, ({x:.4g}, {y:.4g}, {z:.4g}) mm, azimuth {azimuth:.4g}°, tilt {tilt:.4g}°, roll {roll:.4g}°"
    made = table(title, "", *COMPONENTS)
    made.add_row("unit", *("µm",) * 3, *("µrad",) * 3)
    rows = (("for sure", result.shift), ("standard deviation", result.deviation), ("at worst", result.worst))
    for name, values in rows:
        own = 1e6 * values[point]
        beside = np.repeat(np.abs(own).reshape(2, 3).max(axis=1), 3)
        made.add_row(name, *(f"{v if abs(v) > FAINT * most else 0.0:.4g}" for v, most in zip(own, beside, strict=True)))
    return made


def _budget(result: Accuracy, point: int) -> Any:
    """Sources with their shares."""
    made = table(
        "shares in the variance of position and rotation: mean over the points, and at the least accurate one", "", "of",
        "size", "amounts", "position %", "rotation %", "position % there", "rotation % there", "shift µm there", left=3,
    )  # fmt: skip
    shares = [100 * result.shares(what) for what in ("position", "rotation")]
    shifts = 1e6 * np.linalg.norm(result.shifts[point, :, :3], axis=1)
    for k, source in enumerate(result.sources):
        mean = [_share(own[result.told, k].mean()) for own in shares]
        there = [_share(own[point, k]) for own in shares]
        made.add_row(source.kind, source.name, source.size, str(source.amounts), *mean, *there, f"{shifts[k]:.4g}")
    return made


def _share(value: float) -> str:
    return f"{value:.1f}" if np.isfinite(value) else "–"


def as_json(result: Accuracy) -> dict[str, Any]:
    """Errors, point by point; components are x, y, z and rx, ry, rz in {O}."""
    places = result.places
    return {
        "machine": result.machine.name,
        "mode": result.mode,
        "family": result.family.name,
        "roll_policy": result.policy,
        "point": result.point,
        "points": len(result.family),
        "used": int(result.used.sum()),
        "near_singular": int(result.beyond.sum()),
        "least_accurate_point": result.least_accurate,
        "sources": [{"kind": s.kind, "of": s.name, "size": s.size, "amounts": s.amounts} for s in result.sources],
        "position_m": finite(places.position),
        "azimuth_rad": finite(places.azimuth),
        "tilt_rad": finite(places.tilt),
        "roll_rad": finite(places.roll),
        "components": list(COMPONENTS),
        "shift_m_rad": finite(result.shift),
        "standard_deviation_m_rad": finite(result.deviation),
        "worst_m_rad": finite(result.worst),
        "rms_distance_m": finite(result.size[:, 0]),
        "rms_angle_rad": finite(result.size[:, 1]),
        "worst_distance_m": finite(result.farthest[:, 0]),
        "worst_angle_rad": finite(result.farthest[:, 1]),
        "ellipsoid_of_3_sigma_position_m": finite(result.ellipsoids[:, 0]),
        "ellipsoid_of_3_sigma_rotation_rad": finite(result.ellipsoids[:, 1]),
        "share_in_position_variance": finite(result.shares("position")),
        "share_in_rotation_variance": finite(result.shares("rotation")),
    }
