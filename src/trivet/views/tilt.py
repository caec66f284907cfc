"""How far machines can tilt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import groupby
from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.model import Machine
from trivet.reach.neutral import REFERENCES
from trivet.study.tilt import TiltReport, TiltStudy
from trivet.views.layout import table
from trivet.views.si import finite


def tables(study: TiltStudy) -> Iterator[Any]:
    """A row per case; of a single case the azimuths too."""
    found = table(
        "tilt that is reached at every azimuth, with the best roll",
        "machine", "neutral axis", "radius mm", "z0 mm", "pose by pose °", "stopped by", "from home °", "stopped by",
    )  # fmt: skip
    for report in study.reports:
        found.add_row(
            report.machine.name, report.neutral, f"{report.grid.radius * 1e3:g}", f"{report.grid.centre[2] * 1e3:g}",
            _degrees(report.tilt), report.stops[_worst(report.unbroken)] + _unchecked(report),
            _degrees(report.connected_tilt), _connected_stop(report, _worst(report.connected)),
        )  # fmt: skip
    for machine, neutral, radius, height, reason in study.missing:
        found.add_row(machine, neutral, f"{radius * 1e3:g}", f"{height * 1e3:g}", "–", reason, "–", "")
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
        names = ", ".join(free_cones(report.machine))
        if names:
            lines.append(f"{report.machine.name}: the cone of {names} is not checked, for no neutral axis is given (--neutral)")
    lines.append(
        "pose by pose: every smaller tilt is reached, each with its own roll; from home: along poses of the grid, without "
        "crossing a Type 2 singularity"
    )
    return "\n".join(dict.fromkeys(lines))


def _connected_stop(report: TiltReport, azimuth: int) -> str:
    """What stops the machine on its way from home; the notes say why there is no such way."""
    return "see below" if report.apart else report.connected_stops[azimuth]


def _unchecked(report: TiltReport) -> str:
    return "; cones are not checked" if free_cones(report.machine) else ""


def free_cones(machine: Machine) -> list[str]:
    """Sockets of a machine whose cone is recorded and not checked."""
    balls = [e for chain in machine.chains.values() for e in chain.elements if getattr(e, "cone", None) is not None]
    return list(dict.fromkeys(e.name for e in balls if not getattr(e, "is_limited", True)))


def _azimuths(report: TiltReport) -> Any:
    """A row per azimuth, and one for all neighbours that are alike."""
    heading = f"{report.machine.name}, {mode_words(report.mode)}"
    found = table(heading, "azimuth °", "pose by pose °", "stopped by", "from home °", "stopped by", "greatest of all °")
    rows = [
        (
            _degrees(report.unbroken[k]), report.stops[k], _degrees(report.connected[k]), _connected_stop(report, k),
            _degrees(report.largest[k]),
        )
        for k in range(len(report.grid.azimuths))
    ]  # fmt: skip
    degrees = [f"{math.degrees(azimuth):g}" for azimuth in report.grid.azimuths]
    for _, run in groupby(range(len(rows)), key=lambda k: rows[k][::2]):
        places = list(run)
        name = degrees[places[0]] if len(places) == 1 else f"{degrees[places[0]]} to {degrees[places[-1]]}"
        found.add_row(name, *rows[places[0]])
    return found


def _worst(tilts: Any) -> int:
    return int(np.argmin(np.where(np.isfinite(tilts), tilts, -1.0)))


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
        "connected_stops": report.connected_stops,
        "largest_rad": finite(report.largest),
        "stops": report.stops,
    }
