"""Reach as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.tilt import TiltReport, TiltStudy
from trivet.study.workspace import OrientationReport, WorkspaceReport, WorkspaceStudy

if TYPE_CHECKING:
    import xarray as xr


def tilt_datasets(study: TiltStudy) -> dict[str, xr.Dataset]:
    """One case each, by a name that says which."""
    return {f"{k + 1}-{report.machine.name}": _tilt(report) for k, report in enumerate(study.reports)}


def _tilt(report: TiltReport) -> xr.Dataset:
    return labelled(
        report.machine,
        {
            "unbroken": (("azimuth",), report.unbroken, "rad", "tilt up to which every tilt is reached with some roll"),
            "connected": (("azimuth",), report.connected, "rad", "greatest tilt to which the machine comes from home"),
            "largest": (("azimuth",), report.largest, "rad", "greatest tilt which some roll reaches"),
            "roll": (("azimuth", "tilt"), report.rolls, "rad", "roll with the greatest margin of travel; NaN for none"),
            "stopped_by": (("azimuth",), np.array(report.stops, dtype=object), "1", "what stops it beyond the unbroken tilt"),
            "radius": ((), report.grid.radius, "m", "radius of the sphere"),
            "centre": (("axis",), list(report.grid.centre), "m", "centre of the sphere in {O}"),
        },
        {"azimuth": report.grid.azimuths, "tilt": report.grid.tilts, "axis": COMPONENTS[:3]},
        working_mode=report.mode,
        neutral=report.neutral,
        bodies_apart=int(report.with_bodies),
        sphere_is_solid=int(report.is_solid),
    )


def workspace_datasets(study: WorkspaceStudy) -> dict[str, xr.Dataset]:
    """One machine each, by its name."""
    return {f"{k + 1}-{report.machine.name}": _workspace(report) for k, report in enumerate(study.reports)}


def _workspace(report: WorkspaceReport) -> xr.Dataset:
    columns = report.columns
    return labelled(
        report.machine,
        {
            "length": (("x", "y"), columns.lengths, "m", "how much of each column along z belongs to the workspace"),
            "boundary": (("point", "axis"), report.boundary, "m", "where columns enter and leave the workspace"),
            "volume": ((), report.volume, "m^3", "volume of the workspace"),
            "volume_error": ((), report.error, "m^3", "estimate of its error"),
        },
        {"x": columns.x, "y": columns.y, "axis": COMPONENTS[:3]},
        working_mode=report.mode,
        kind=report.kind,
        bodies_apart=int(report.with_bodies),
    )


def orientation_dataset(report: OrientationReport) -> xr.Dataset:
    """Directions at one place."""
    return labelled(
        report.machine,
        {
            "share": (("azimuth", "cosine"), report.share, "1", "part of all rolls that are reached with this normal"),
            "solid_angle": ((), report.solid_angle, "sr", "of the directions that some roll reaches"),
            "position": (("axis",), list(report.position), "m", "platform centre in {O}"),
        },
        {"azimuth": report.azimuth, "cosine": report.cosine, "axis": COMPONENTS[:3]},
        working_mode=report.mode,
    )
