"""Workspaces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.study.workspace import KINDS, OrientationReport, WorkspaceReport, WorkspaceStudy
from trivet.views.layout import table
from trivet.views.si import finite

CM3 = 1e6


def tables(result: WorkspaceStudy | OrientationReport) -> Iterator[Any]:
    """A row per machine; or how one can lean."""
    if isinstance(result, OrientationReport):
        yield from _leaning(result)
        return
    found = table(
        "workspace of the platform centre",
        "machine",
        "volume cm³",
        "error",
        "of the first",
        "from home cm³",
        "x mm",
        "y mm",
        "z mm",
    )
    for report in result.reports:
        low, high = report.extent
        spans = (f"{a * 1e3:.1f} to {b * 1e3:.1f}" for a, b in zip(low, high, strict=True))
        share = report.volume / result.reports[0].volume
        found.add_row(
            report.machine.name,
            f"{report.volume * CM3:.5g}",
            f"± {report.error * CM3:.1g}",
            f"{100 * share:.4g} %",
            f"{report.volume_from_home * CM3:.4g}" if math.isfinite(report.part_from_home) else "–",
            *spans,
        )
    for machine, reason in result.missing:
        found.add_row(machine, "–", "", "", "", reason, "", "")
    yield found
    if result.reports:
        yield _words(result.reports[0])


def _words(report: WorkspaceReport) -> str:
    words = f"{KINDS[report.kind]}: "
    own = report.orientations
    if report.kind == "constant":
        angles = (own.azimuth[0], own.tilt[0], own.rolls[0, 0])
        words += ", ".join(f"{n} {math.degrees(v):g}°" for n, v in zip(("alpha", "beta", "gamma"), angles, strict=True))
    else:
        words += (
            f"{len(own.azimuth)} directions up to a tilt of {math.degrees(own.tilt.max()):g}°, {own.rolls.shape[1]} rolls each"
        )
    size = len(report.columns.x)
    bodies = "bodies apart" if report.with_bodies else "bodies not looked at"
    return f"{words}; {bodies}; {size} × {size} columns"


def _leaning(report: OrientationReport) -> Iterator[Any]:
    x, y, z = (f"{1e3 * v:g}" for v in report.position)
    yield f"{report.machine.name}, {mode_words(report.mode)}, platform centre at ({x}, {y}, {z}) mm"
    found = table("how the platform can lean there", "", "")
    found.add_row("directions reached with some roll", f"{report.solid_angle:.4f} ± {report.solid_angle_error:.1g} sr")
    found.add_row("of all directions", f"{100 * report.solid_angle / (4 * math.pi):.3g} %")
    found.add_row("of all orientations", f"{100 * report.part_of_all:.3g} %")
    yield found


def as_json(result: WorkspaceStudy | OrientationReport) -> dict[str, Any]:
    """Volumes and boundaries."""
    if isinstance(result, OrientationReport):
        return {
            "machine": result.machine.name,
            "mode": result.mode,
            "position_m": list(result.position),
            "solid_angle_sr": result.solid_angle,
            "solid_angle_error_sr": result.solid_angle_error,
            "part_of_all_orientations": result.part_of_all,
            "azimuth_rad": finite(result.azimuth),
            "cosine_of_tilt": finite(result.cosine),
            "share_of_rolls": finite(result.share),
        }
    return {
        "machines": [
            {
                "machine": report.machine.name,
                "mode": report.mode,
                "kind": report.kind,
                "bodies_apart": report.with_bodies,
                "volume_m3": report.volume,
                "volume_from_home_m3": finite(report.volume_from_home),
                "error_m3": report.error,
                "extent_m": finite(np.stack(report.extent)),
                "boundary_m": finite(report.boundary),
            }
            for report in result.reports
        ],
        "missing": [{"machine": machine, "reason": reason} for machine, reason in result.missing],
    }
