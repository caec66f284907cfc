"""Motions along a path and simulations as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.dynamics.batch import joint_list
from trivet.results.netcdf import COMPONENTS, labelled
from trivet.space.frame import Frame
from trivet.study.motion import MotionReport
from trivet.study.simulation import Simulation

if TYPE_CHECKING:
    import xarray as xr

_LENGTH, _FORCE = "m or rad", "N or N m"


def motion_dataset(report: MotionReport) -> xr.Dataset:
    """A motion along a path, over its times."""
    kinetic, potential = report.energies
    drives, moving = report.drives, report.moving
    twist, rise = (np.stack([*t.linear, *t.angular], axis=-1) for t in (moving.twist, moving.acceleration))
    per_drive = ("time", "drive")
    return labelled(
        report.machine,
        _poses(moving.pose)
        | {
            "twist": (("time", "component"), twist, "m/s along x, y, z; rad/s about", "of the platform centre in {O}"),
            "acceleration": (("time", "component"), rise, "m/s^2 along x, y, z; rad/s^2 about", "derivative of the twist"),
            "drive_coordinate": (per_drive, report.coordinates, _LENGTH, "coordinates of the drives"),
            "drive_speed": (per_drive, drives.speed, "m/s or rad/s", "speeds of the drives"),
            "drive_acceleration": (per_drive, drives.acceleration, "m/s^2 or rad/s^2", "accelerations of the drives"),
            "drive_force": (per_drive, drives.force, _FORCE, "what the drives give"),
            "drive_power": (per_drive, report.powers, "W", "power that the drives give"),
            "joint_wrench": (
                ("time", "joint", "component"), report.reactions, "N along x, y, z; N m about",
                "on the body beyond the joint, at the joint, in its axes",
            ),
            "kinetic_energy": (("time",), kinetic, "J", "kinetic energy"),
            "potential_energy": (("time",), potential, "J", "energy of the weight, from the origin of {O}"),
            "sigma_min": (("time",), report.sigma_min, "1", "how well the drives control the platform"),
        },
        {"time": report.time, "drive": report.actuators, "joint": joint_list(report.machine)} | _axes(),
        working_mode=report.mode,
        **report.loading.stated(report.machine),
    )  # fmt: skip


def simulation_dataset(result: Simulation) -> xr.Dataset:
    """A simulation, over its times."""
    twist = np.stack([*result.state.twist.linear, *result.state.twist.angular], axis=-1)
    energies = {
        f"{name}_energy": (("time",), np.asarray(part), "J", f"energy: {name.replace('_', ' ')}")
        for name, part in result.balance._asdict().items()
    }
    return labelled(
        result.machine,
        _poses(result.state.pose)
        | {
            "twist": (("time", "component"), twist, "m/s along x, y, z; rad/s about", "of the platform centre in {O}"),
            "drive_coordinate": (("time", "drive"), result.coordinates, _LENGTH, "coordinates of the drives"),
            "drive_force": (("time", "drive"), result.forces, _FORCE, "what the drives give"),
            "energy_drift": (("time",), result.drift, "1", "error of the energy balance, relative to what moved"),
        }
        | energies,
        {"time": result.time, "drive": result.actuators} | _axes(),
        working_mode=result.mode,
        drives=result.law,
        ended=result.ended or "",
        **result.loading.stated(result.machine),
    )


def _poses(pose: Frame) -> dict[str, tuple[Any, ...]]:
    axes = np.stack([np.stack(list(v), axis=-1) for v in pose[1:]], axis=-1)
    return {
        "position": (("time", "axis"), np.stack(list(pose.origin), axis=-1), "m", "platform centre in {O}"),
        "rotation": (("time", "axis", "platform_axis"), axes, "1", "columns are the platform's axes in {O}"),
    }


def _axes() -> dict[str, Any]:
    return {"axis": COMPONENTS[:3], "platform_axis": COMPONENTS[:3], "component": COMPONENTS}
