"""Stability lobes as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.lobes import Lobes, LobesAlong

if TYPE_CHECKING:
    import xarray as xr

Variables = dict[str, tuple[Any, ...]]
_NONE = "where no chatter frequency limits it"


def lobes_dataset(result: Lobes) -> xr.Dataset:
    """Lobes at a pose, with the receptance of the tool point; real and imaginary part are its last axis."""
    receptance = np.stack([result.receptance.real, result.receptance.imag], axis=-1)
    variables = _over_poses([result], result) | {
        "receptance": (
            ("frequency", "motion", "load", "part"), receptance, "m/N", "of the tool point, exp(+i omega t), feed and y",
        ),
        "frequency": (("frequency",), result.frequency, "Hz", "at which it is worked out"),
        "plane": (("motion", "axis"), result.point.axes, "1", "directions of feed and y in {O}"),
    }  # fmt: skip
    alone = {
        name: (
            dimensions[1:] if dimensions[:1] == ("pose",) else dimensions,
            values[0] if dimensions[:1] == ("pose",) else values,
            *rest,
        )
        for name, (dimensions, values, *rest) in variables.items()
    }
    coordinates = {"axis": COMPONENTS[:3], "motion": ("feed", "y"), "load": ("feed", "y"), "part": ("real", "imag")}
    return labelled(result.at.machine, alone, coordinates, **_attributes(result))


def lobes_along_dataset(result: LobesAlong) -> xr.Dataset:
    """Lobes over poses and spindle speeds."""
    first = result.poses[0]
    coordinates = {"axis": COMPONENTS[:3], "pose": range(1, len(result.poses) + 1)}
    return labelled(first.at.machine, _over_poses(result.poses, first), coordinates, **_attributes(first))


def _over_poses(poses: Any, first: Lobes) -> Variables:
    angles = np.array([one.at.angles for one in poses])
    over = ("pose", "speed")
    return {
        "spindle_speed": (("speed",), first.speeds, "rad/s", "spindle speed"),
        "depth": (over, np.array([one.depth for one in poses]), "m", f"stable depth of cut; infinite {_NONE}"),
        "chatter_frequency": (over, np.array([one.limits.frequency for one in poses]), "Hz", f"above it; NaN {_NONE}"),
        "whole_waves": (over, np.array([one.limits.waves for one in poses]), "1", f"between teeth; -1 {_NONE}"),
        "lowest_depth": (("pose",), np.array([one.lowest_depth for one in poses]), "m", "stable at every spindle speed"),
        "lowest_depth_frequency": (
            ("pose",), np.array([one.lowest_frequency for one in poses]), "Hz", "at which deeper cuts chatter",
        ),
        "position": (("pose", "axis"), np.array([one.at.position for one in poses]), "m", "platform centre in {O}"),
        "azimuth": (("pose",), angles[:, 0], "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
        "tilt": (("pose",), angles[:, 1], "rad", "beta"),
        "roll": (("pose",), angles[:, 2], "rad", "gamma"),
    }  # fmt: skip


def _attributes(one: Lobes) -> dict[str, Any]:
    cut = one.cut
    return {
        "working_mode": one.at.mode,
        "place": one.point.place,
        "tool_side": one.point.side,
        "feed_rad": one.feed,
        "cutter_diameter_m": cut.diameter,
        "teeth": cut.teeth,
        "entry_rad": cut.entry,
        "exit_rad": cut.exit,
        "tangential_Pa": cut.tangential,
        "radial_ratio": cut.radial_ratio,
        "highest_frequency_Hz": one.highest,
        "loss_factor": one.loss_factor,
    }
