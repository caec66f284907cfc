"""Atlases of frequency responses as labelled datasets."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from trivet.files import check_room, replacing
from trivet.results.netcdf import COMPONENTS, OVERHEAD, labelled
from trivet.study.atlas import Atlas
from trivet.study.response_summary import unit_of_least

if TYPE_CHECKING:
    import xarray as xr

_RECEPTANCE = "m/N, m/(N m), rad/N or rad/(N m), as the entry says"
_STIFFNESS = "N/m, N, N/rad or N m/rad, as unit_of_stiffness says"


def atlas_dataset(result: Atlas) -> xr.Dataset:
    """Poses, least dynamic stiffnesses, the band of the responses, and the worst poses."""
    places, worst = result.places, result.worst
    least = "least between the points too" if result.sought else "least at the points alone"
    return labelled(
        result.machine,
        {
            "position": (("point", "axis"), places.position, "m", "platform centre in {O}"),
            "azimuth": (("point",), places.azimuth, "rad", "direction of the tilt"),
            "tilt": (("point",), places.tilt, "rad", "angle of the platform normal from z"),
            "roll": (("point",), places.roll, "rad", "about the platform normal"),
            "unit_of_stiffness": (("entry",), [unit_of_least(e).si for e in result.entries], "1", "unit of 1/|H|"),
            "least_stiffness": (
                ("point", "entry"),
                result.stiffness,
                _STIFFNESS,
                "least over frequency of 1/|H|; inf: unbounded",
            ),
            "at_frequency": (("point", "entry"), result.at_frequency, "Hz", "where it is"),
            "least_receptance": (("entry", "frequency"), result.least, _RECEPTANCE, "least |H| over the poses"),
            "greatest_receptance": (("entry", "frequency"), result.greatest, _RECEPTANCE, "greatest |H| over the poses"),
            "worst_stiffness": (("entry",), [w.stiffness for w in worst], _STIFFNESS, least),
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
        worst_sought_between_points=int(result.sought),
    )


def size_of_responses(points: int, entries: int, frequencies: int) -> float:
    """Bytes of the file that `save_responses` writes."""
    return OVERHEAD + 16.0 * points * entries * frequencies


def save_responses(
    result: Atlas,
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Write an atlas as NetCDF with the responses at every pose, a few poses at a time; the file appears whole or not at all.

    Args:
        result: the atlas.
        path: file to write.
        overwrite: whether the file may be replaced.
        progress: called with the poses that are written, and their number.

    Raises:
        InputError: when the file exists unasked or cannot be written, or the disk has no room for it.
    """
    import h5netcdf

    shape = (len(result.family), len(result.entries), len(result.frequency), 2)
    check_room(path, size_of_responses(*shape[:3]))
    with replacing(path, overwrite=overwrite) as temporary:
        atlas_dataset(result).assign_coords(part=["real", "imag"]).to_netcdf(temporary, engine="h5netcdf")
        with h5netcdf.File(temporary, "a") as file:
            variable = file.create_variable(
                "receptance", ("point", "entry", "frequency", "part"), float, chunks=(1, 1, *shape[2:]), fillvalue=np.nan
            )
            variable.attrs.update(units=_RECEPTANCE, long_name="H, exp(+i omega t); NaN where the pose is not reached")
            for rows, values in result.receptances():
                variable[rows] = np.stack([values.real, values.imag], axis=-1)
                progress(rows.stop, shape[0])
