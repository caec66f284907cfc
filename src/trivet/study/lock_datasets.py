"""Advice on locks, and all drives along a path, as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.space.family import Places
from trivet.study.lock_advice import LocksAdvised
from trivet.study.locks import drives_of
from trivet.study.redundant import RedundantPath

if TYPE_CHECKING:
    import xarray as xr

Variables = dict[str, tuple[Any, ...]]


def advice_dataset(result: LocksAdvised) -> xr.Dataset:
    """Advice over lock sets, and what each gives at every pose of the task; NaN where a set does not reach."""
    drives, asked, count = drives_of(result.machine), result.measure, len(result.task.places.tilt)
    locked = np.full((len(result.advices), len(drives)), np.nan)
    value = np.full((len(result.advices), count), np.nan)
    rolls = np.full((len(result.advices), count), np.nan)
    for k, advice in enumerate(result.advices):
        for name, coordinate in advice.coordinates.items():
            locked[k, drives.index(name)] = coordinate
        if advice.holding is not None:
            value[k], rolls[k] = advice.holding.least[:count], advice.holding.rolls[:count]
    words = [[advice.mode, advice.reason] for advice in result.advices]
    unit = asked.unit or "1"
    variables: Variables = {
        "locked_coordinate": (("lock_set", "drive"), locked, "m or rad", "where drives are locked; NaN where they are free"),
        "least": (("lock_set",), [a.value for a in result.advices], unit, f"least {asked.name} over the task"),
        "value": (("lock_set", "pose"), value, unit, f"{asked.name} at the poses of the task"),
        "chosen_roll": (("lock_set", "pose"), rolls, "rad", "gamma at which it is so"),
        "drive_rate": (
            ("lock_set",),
            [a.rate for a in result.advices],
            "1",
            "greatest speed of a drive per speed of the platform",
        ),
        "travel_margin": (
            ("lock_set",),
            [a.margin for a in result.advices],
            "1",
            "least of any joint: 1 in the middle, 0 at an end",
        ),
        "group": (("lock_set",), [a.locks.group for a in result.advices], "1", "alike by the machine's turns about z"),
        "working_mode": (("lock_set",), np.array([w[0] for w in words], dtype=object), "1", "signs per chain"),
        "reason": (("lock_set",), np.array([w[1] for w in words], dtype=object), "1", "why a lock set does not serve"),
    }
    coordinates = {"axis": COMPONENTS[:3], "drive": drives, "lock_set": [a.locks.name for a in result.advices]}
    return labelled(result.machine, variables | _poses(result.task.places), coordinates, **_attributes(result))


def redundant_dataset(result: RedundantPath) -> xr.Dataset:
    """All drives over a path."""
    asked = result.fixed.measure
    unit = asked.unit or "1"
    variables: Variables = {
        "path_coordinate": (("pose",), result.along, "1", "1 at the first pose of the path, 2 at the second"),
        "joint_coordinate": (("pose", "drive"), result.coordinates, "m or rad", "all drives at work"),
        "value": (("pose",), result.value, unit, f"{asked.name}, all drives at work"),
        "with_best_locks": (("pose",), result.on_locks, unit, f"{asked.name} with the best lock set"),
        "pose_by_itself": (("pose",), result.alone, unit, f"greatest {asked.name} of the pose alone; NaN where not sought"),
    }
    coordinates = {"axis": COMPONENTS[:3], "drive": list(result.drives)}
    more = {"spare_drives": " ".join(result.spare), "rate_travels_per_path": result.rate, "working_mode": result.mode}
    return labelled(result.machine, variables | _poses(result.places), coordinates, **_attributes(result.fixed), **more)


def _poses(places: Places) -> Variables:
    found: Variables = {
        "position": (("pose", "axis"), places.position, "m", "platform centre in {O}"),
        "azimuth": (("pose",), places.azimuth, "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
        "tilt": (("pose",), places.tilt, "rad", "beta"),
    }
    return found if places.roll is None else found | {"roll": (("pose",), places.roll, "rad", "gamma")}


def _attributes(result: LocksAdvised) -> dict[str, Any]:
    return {"objective_name": result.measure.name, "task": result.task.name, "roll_policy": result.task.roll}
