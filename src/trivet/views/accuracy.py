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
    """Errors over the poses, at the least accurate of them, and what they come from; or those of one pose."""
    if result.is_one_pose:
        return _of_one(result)
    least = result.least_accurate
    return [
        f"{result.machine.name}, {mode_words(result.mode)}, {result.family.name}, roll {result.policy}: "
        f"{int(result.used.sum())} of {len(result.family)} points reached; {point_words(result)}, drives held",
        _sizes(result, "over the points", {"least": np.min, "median": np.median, "greatest": np.max}),
        f"least accurate point: {_where(result, least)}",
        _components(result, least, "errors there, in {O}"),
        _budget(result, least),
        *_notes(result),
    ]


def _of_one(result: Accuracy) -> list[Any]:
    """Errors at one pose, and what they come from."""
    return [
        f"{result.machine.name}, {mode_words(result.mode)}, {_where(result, 0)}; {point_words(result)}, drives held",
        _sizes(result, "errors", {"": np.min}),
        _components(result, 0, "in {O}"),
        _shares_of_one(result),
        *_notes(result),
    ]


def point_words(result: Accuracy) -> str:
    """Of what errors are told."""
    return "platform centre" if result.point == "platform" else "tool tip"


def _where(result: Accuracy, point: int) -> str:
    """A pose."""
    places = result.places
    assert places.roll is not None
    x, y, z = (f"{1e3 * v + 0.0:.4g}" for v in places.position[point])
    angles = (f"{np.degrees(values[point]) + 0.0:.4g}°" for values in (places.azimuth, places.tilt, places.roll))
    return "centre ({}, {}, {}) mm, azimuth {}, tilt {}, roll {}".format(x, y, z, *angles)


def _notes(result: Accuracy) -> list[str]:
    """Where first order is no measure."""
    count = int(result.beyond.sum())
    words = (
        f"the platform may turn by more than {np.degrees(SMALL):.2g}°, as near a singularity; first order is no measure there"
    )
    if not count:
        return []
    if count == result.used.sum():
        return [words if result.is_one_pose else f"all points: {words}"]
    return [f"{count} points: {words}, and what is told above is told of the other points"]


def _sizes(result: Accuracy, title: str, columns: dict[str, Any]) -> Any:
    """Distances and angles over the poses, a column per function of them."""
    spread = table(title, "", *columns, "unit")
    longest = result.ellipsoids[..., 2]
    for half, unit in enumerate(("µm", "µrad")):
        what = ("position", "rotation")[half]
        rows = (("root mean square", result.size), ("3 sigma, longest half axis", longest), ("at worst", result.farthest))
        for name, values in rows:
            own = 1e6 * values[result.told, half]
            spread.add_row(f"{what}, {name}", *(f"{of(own):.4g}" for of in columns.values()), unit)
    return spread


def _components(result: Accuracy, point: int, title: str) -> Any:
    """Errors at one point, component by component."""
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


def _shares_of_one(result: Accuracy) -> Any:
    """Sources with their shares at one pose."""
    columns = ("of", "size", "amounts", "position %", "rotation %", "shift µm")
    made = table("shares in the variance of position and rotation", "", *columns, left=3)
    shares = [100 * result.shares(what)[0] for what in ("position", "rotation")]
    shifts = 1e6 * np.linalg.norm(result.shifts[0, :, :3], axis=1)
    for k, source in enumerate(result.sources):
        row = (source.kind, source.name, source.size, str(source.amounts), *(_share(own[k]) for own in shares))
        made.add_row(*row, f"{shifts[k]:.4g}")
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
