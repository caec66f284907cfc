"""NetCDF files of results: labelled arrays with units, the machine file inside."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.files import check_room, replacing
from trivet.model import Machine, to_text

if TYPE_CHECKING:
    import xarray as xr

OVERHEAD = 200_000
"""Bytes that names, units and the machine file may take beside the numbers."""
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


def labelled(
    machine: Machine, variables: Mapping[str, tuple[Any, ...]], coordinates: Mapping[str, Any], **attributes: Any
) -> xr.Dataset:
    """A dataset from variables given as (dimensions, values, unit, meaning), with the machine file inside."""
    return described(variables, coordinates, machine=machine.name, machine_file=to_text(machine), **attributes)


def described(variables: Mapping[str, tuple[Any, ...]], coordinates: Mapping[str, Any], **attributes: Any) -> xr.Dataset:
    """The same of what no machine has part in."""
    from importlib.metadata import version

    import xarray as xr

    return xr.Dataset(
        {
            name: xr.Variable(dimensions, np.asarray(values), {"units": unit, "long_name": meaning})
            for name, (dimensions, values, unit, meaning) in variables.items()
        },
        coords={name: list(values) for name, values in coordinates.items()},
        attrs={"trivet_version": version("trivet"), "Conventions": "CF-1.11"} | attributes,
    )


def write_netcdf(dataset: xr.Dataset, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a dataset as NetCDF; the file appears whole or not at all."""
    check_room(path, OVERHEAD + dataset.nbytes)
    with replacing(path, overwrite=overwrite) as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")


def write_groups(datasets: Mapping[str, xr.Dataset], path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write several datasets as groups of one NetCDF file."""
    check_room(path, sum(OVERHEAD + dataset.nbytes for dataset in datasets.values()))
    with replacing(path, overwrite=overwrite) as temporary:
        for k, (name, dataset) in enumerate(datasets.items()):
            dataset.to_netcdf(temporary, mode="a" if k else "w", group=name.replace("/", "_"), engine="h5netcdf")
