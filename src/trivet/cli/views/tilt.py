"""How far machines can tilt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.cli.views.layout import table
from trivet.cli.views.si import finite
from trivet.kinematics.mode import mode_words
from trivet.reach.neutral import REFERENCES
from trivet.study.tilt import TiltReport, TiltStudy


def tables(study: TiltStudy) -> Iterator[Any]:
    """A row per case; of a single case the azimuths too."""
    found = table(
        "tilt that is reached at every azimuth, with the best roll",
        "machine", "neutral axis", "radius mm", "z0 mm", "pose by pose °", "from home °", "at the best azimuth °", "stopped by",
    )  # fmt: skip
    for report in study.reports:
        found.add_row(
            report.machine.name, report.neutral, f"{report.grid.radius * 1e3:g}", f"{report.grid.centre[2] * 1e3:g}",
            _degrees(report.tilt), _degrees(report.connected_tilt), _degrees(_greatest(report.unbroken)),
            report.stops[_worst(report)],
        )  # fmt: skip
    for machine, neutral, radius, height, reason in study.missing:
        found.add_row(machine, neutral, f"{radius * 1e3:g}", f"{height * 1e3:g}", "–", "–", "–", reason)
    yield found
    if len(study.reports) == 1:
        yield _azimuths(study.reports[0])
    used = dict.fromkeys(report.neutral for report in study.reports)
    yield "\n".join(f"neutral axis {name}: {REFERENCES[name]}" for name in used)
    yield _notes(study)


def _notes(study: TiltStudy) -> str:
    lines = []
    for report in study.reports:
        if report.apart:
            lines.append(f"{report.machine.name}: no straight way from home to the pole was found, {report.apart}")
    for report in study.reports:
        balls = [
            e.name
            for chain in report.machine.chains.values()
            for e in chain.elements
            if getattr(e, "cone", None) is not None and not getattr(e, "is_limited", True)
        ]
        if balls:
            names = ", ".join(dict.fromkeys(balls))
            lines.append(f"{report.machine.name}: the cone of {names} is not checked, for no neutral axis is given (--neutral)")
    lines.append(
        "pose by pose: every smaller tilt is reached, each with its own roll; from home: along poses of the grid, without "
        "crossing a Type 2 singularity"
    )
    return "\n".join(dict.fromkeys(lines))


def _azimuths(report: TiltReport) -> Any:
    heading = f"{report.machine.name}, {mode_words(report.mode)}"
    found = table(heading, "azimuth °", "pose by pose °", "from home °", "greatest of all °", "stopped by")
    for k, azimuth in enumerate(report.grid.azimuths):
        found.add_row(
            f"{math.degrees(azimuth):g}", _degrees(report.unbroken[k]), _degrees(report.connected[k]),
            _degrees(report.largest[k]), report.stops[k],
        )  # fmt: skip
    return found


def _worst(report: TiltReport) -> int:
    return int(np.argmin(np.where(np.isfinite(report.unbroken), report.unbroken, -1.0)))


def _greatest(values: Any) -> float:
    own = values[np.isfinite(values)]
    return float(own.max()) if len(own) else math.nan


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.2f}" if math.isfinite(angle) else "–"


def as_json(study: TiltStudy) -> dict[str, Any]:
    """All cases."""
    return {
        "cases": [_case(report) for report in study.reports],
        "missing": [
            {"machine": machine, "neutral": neutral, "radius_m": radius, "height_m": height, "reason": reason}
            for machine, neutral, radius, height, reason in study.missing
        ],
    }


def _case(report: TiltReport) -> dict[str, Any]:
    return {
        "machine": report.machine.name,
        "mode": report.mode,
        "neutral": report.neutral,
        "bodies_apart": report.with_bodies,
        "sphere_is_solid": report.is_solid,
        "radius_m": report.grid.radius,
        "centre_m": list(report.grid.centre),
        "poses": report.poses,
        "tilt_rad": finite(report.tilt),
        "connected_tilt_rad": finite(report.connected_tilt),
        "not_connected_because": report.apart or None,
        "azimuth_rad": finite(report.grid.azimuths),
        "unbroken_rad": finite(report.unbroken),
        "connected_rad": finite(report.connected),
        "largest_rad": finite(report.largest),
        "stops": report.stops,
    }
