"""Atlases of frequency responses as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.atlas import Atlas

if TYPE_CHECKING:
    import xarray as xr

_RECEPTANCE = "m/N, m/(N m), rad/N or rad/(N m), as the entry says"
_STIFFNESS = "N/m, N m/m, N/rad or N m/rad, as the entry says"


def atlas_dataset(result: Atlas) -> xr.Dataset:
    """Poses, least dynamic stiffnesses, the band of the responses, and the worst poses."""
    places, worst = result.places, result.worst
    return labelled(
        result.machine,
        {
            "position": (("point", "axis"), places.position, "m", "platform centre in {O}"),
            "azimuth": (("point",), places.azimuth, "rad", "direction of the tilt"),
            "tilt": (("point",), places.tilt, "rad", "angle of the platform normal from z"),
            "roll": (("point",), places.roll, "rad", "about the platform normal"),
            "least_stiffness": (("point", "entry"), result.stiffness, _STIFFNESS, "least over frequency of 1/|H|"),
            "at_frequency": (("point", "entry"), result.at_frequency, "Hz", "where it is"),
            "least_receptance": (("entry", "frequency"), result.least, _RECEPTANCE, "least |H| over the poses"),
            "greatest_receptance": (("entry", "frequency"), result.greatest, _RECEPTANCE, "greatest |H| over the poses"),
            "worst_stiffness": (("entry",), [w.stiffness for w in worst], _STIFFNESS, "least between the points too"),
            "worst_frequency": (("entry",), [w.frequency for w in worst], "Hz", "where it is"),
            "worst_position": (("entry", "axis"), np.array([w.position for w in worst]), "m", "worst pose"),
            "worst_azimuth": (("entry",), [w.azimuth for w in worst], "rad", "worst pose"),
            "worst_tilt": (("entry",), [w.tilt for w in worst], "rad", "worst pose"),
            "worst_roll": (("entry",), [w.roll for w in worst], "rad", "worst pose"),
        },
        {"axis": COMPONENTS[:3], "entry": result.entries, "frequency": result.frequency},
        working_mode=result.mode,
        family=result.family.name,
        roll_policy=result.policy,
        point=result.point,
        loss_factor=result.loss_factor,
    )
