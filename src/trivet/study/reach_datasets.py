"""Reach as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.tilt import TiltReport, TiltStudy

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
    )
