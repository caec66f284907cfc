"""Error budgets as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.accuracy import Accuracy

if TYPE_CHECKING:
    import xarray as xr

_BOTH = "m or rad, as the component says"
_SQUARE = "m^2, m rad or rad^2, as the components say"


def accuracy_dataset(result: Accuracy) -> xr.Dataset:
    """Poses, errors and their sources."""
    places, sources = result.places, result.sources
    names = [f"{one.kind} {place}" for place, one in enumerate(sources, 1)]
    return labelled(
        result.machine,
        {
            "position": (("point", "axis"), places.position, "m", "platform centre in {O}"),
            "azimuth": (("point",), places.azimuth, "rad", "direction of the tilt"),
            "tilt": (("point",), places.tilt, "rad", "angle of the platform normal from z"),
            "roll": (("point",), places.roll, "rad", "about the platform normal"),
            "shift": (("point", "source", "component"), result.shifts, _BOTH, "error that is there for sure"),
            "variance": (("point", "source", "component"), result.variances, _SQUARE, "of the error"),
            "covariance": (("point", "component", "with"), result.covariance, _SQUARE, "of the error, all sources together"),
            "worst": (("point", "component"), result.worst, _BOTH, "greatest size of the error, all amounts at their worst"),
            "worst_distance": (("point",), result.farthest[:, 0], "m", "bound of the greatest distance"),
            "worst_angle": (("point",), result.farthest[:, 1], "rad", "bound of the greatest angle"),
            "of": (("source",), np.array([one.name for one in sources]), "1", "what is inexact"),
            "size": (("source",), np.array([one.size for one in sources]), "1", "by how much"),
            "amounts": (("source",), np.array([one.amounts for one in sources]), "1", "independent ones"),
        },
        {"axis": COMPONENTS[:3], "source": names, "component": COMPONENTS, "with": COMPONENTS},
        working_mode=result.mode,
        family=result.family.name,
        roll_policy=result.policy,
        point=result.point,
    )
