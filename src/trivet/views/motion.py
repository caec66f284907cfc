"""A motion along a path: actuator sizing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.study.motion import DriveSizing, MotionReport, Peak
from trivet.views.dynamics import loaded, unweighed
from trivet.views.layout import beside, fixed, table
from trivet.views.si import finite, pose_keys


def tables(report: MotionReport) -> Iterator[Any]:
    """What every drive must be able to do, and every joint bear."""
    duration = report.trajectory.duration
    yield (
        f"{report.machine.name}, {mode_words(report.mode)}, a motion of {duration:.4g} s looked at {len(report.time)} times\n"
        f"{_fastest(report)}\n"
        f"{loaded(report.loading)}; sigma_min {report.sigma_min.min():.3g} at least"
    )
    moves = table("how the drives move", "drive", "least", "greatest", "peak speed", "at s", "peak acceleration", "at s")
    columns = ("peak force", "at s", "RMS force", "power given", "at s", "taken back", "at s", "mean given")
    needs = table("what they must give, at most and on the average", "drive", *columns)
    power = max(max(drive.power_given.value, -drive.power_taken.value) for drive in report.drive_sizing)
    force: dict[str, float] = {}
    for drive in report.drive_sizing:
        force[drive.unit] = max(force.get(drive.unit, 0.0), abs(drive.force.value))
    for drive, unit in zip(report.drive_sizing, report.units, strict=True):
        scale, shown = (1e3, "mm") if drive.unit == "m" else (math.degrees(1), "°")
        moves.add_row(
            drive.name, f"{fixed(drive.low * scale, 4)} {shown}", f"{fixed(drive.high * scale, 4)} {shown}",
            *_peak(drive.speed, f"{shown}/s", scale), *_peak(drive.acceleration, f"{shown}/s²", scale),
        )  # fmt: skip
        needs.add_row(
            drive.name, *_peak(drive.force, unit, greatest=force[drive.unit]),
            f"{beside(drive.rms_force, force[drive.unit], 4)} {unit}", *_peak(drive.power_given, "W", greatest=power),
            *_peak(drive.power_taken, "W", greatest=power), f"{beside(drive.mean_power, power, 4)} W",
        )  # fmt: skip
    yield moves
    yield needs
    yield unweighed(report.machine)
    yield _where(report)
    bears = table("what the joints must bear", "joint", "peak force", "at s", "peak moment", "at s")
    force_most, moment_most = (max(getattr(j, kind).value for j in report.joint_sizing) for kind in ("force", "moment"))
    for joint in report.joint_sizing:
        cells = *_peak(joint.force, "N", greatest=force_most), *_peak(joint.moment, "N m", greatest=moment_most)
        bears.add_row(joint.name, *cells)
    yield bears


def _fastest(report: MotionReport) -> str:
    """How fast the platform moves."""
    moving = report.moving
    sizes = [float(np.linalg.norm(part, axis=0).max()) for twist in (moving.twist, moving.acceleration) for part in twist]
    speed, spin, rise, swing = (f"{size:.4g}" for size in sizes)
    return f"platform at most {speed} m/s, {spin} rad/s, {rise} m/s², {swing} rad/s²"


def _peak(peak: Peak, unit: str, scale: float = 1.0, greatest: float = 1.0) -> tuple[str, str]:
    """A peak and its time; none where it is rounding beside the greatest of its kind."""
    if not abs(peak.value) > 1e-12 * greatest:
        return f"0 {unit}", ""
    return f"{peak.value * scale:.4g} {unit}", f"{peak.time:.4f}"


def _where(report: MotionReport) -> Any:
    """Poses of the peaks of force."""
    found = table(
        "where on the path the forces are greatest", "drive", "at s", "x mm", "y mm", "z mm", "alpha °", "beta °", "gamma °"
    )
    for drive in report.drive_sizing:
        place, angles = report.pose_at(drive.force.time)
        cells = [*(fixed(1e3 * v, 4) for v in place), *(fixed(math.degrees(v), 4) for v in angles)]
        found.add_row(drive.name, f"{drive.force.time:.4f}", *cells)
    return found


def as_json(report: MotionReport) -> dict[str, Any]:
    """Sizing of drives and joints, and the motion itself."""
    kinetic, potential = report.energies
    return {
        "machine": report.machine.name,
        "mode": report.mode,
        "duration_s": report.trajectory.duration,
        **report.loading.stated(report.machine),
        "least_sigma_min": finite(float(report.sigma_min.min())),
        "drives": [_drive(report, drive, unit) for drive, unit in zip(report.drive_sizing, report.units, strict=True)],
        "joints": [
            {"name": joint.name, "peak_force": _peak_json(joint.force, "N"), "peak_moment": _peak_json(joint.moment, "N_m")}
            for joint in report.joint_sizing
        ],
        "time_s": finite(report.time),
        "position_m": finite([list(c) for c in zip(*report.moving.pose.origin, strict=True)]),
        "drive_coordinates_m_or_rad": finite(report.coordinates),
        "drive_speeds_m_or_rad_per_s": finite(report.drives.speed),
        "drive_accelerations_m_or_rad_per_s2": finite(report.drives.acceleration),
        "drive_forces_N_or_N_m": finite(report.drives.force),
        "drive_powers_W": finite(report.powers),
        "kinetic_energy_J": finite(kinetic),
        "potential_energy_J": finite(potential),
    }


def _drive(report: MotionReport, drive: DriveSizing, unit: str) -> dict[str, Any]:
    way, force = drive.unit, unit.replace(" ", "_")
    place, angles = report.pose_at(drive.force.time)
    return {
        "name": drive.name,
        f"low_{way}": finite(drive.low),
        f"high_{way}": finite(drive.high),
        "peak_speed": _peak_json(drive.speed, f"{way}_per_s"),
        "peak_acceleration": _peak_json(drive.acceleration, f"{way}_per_s2"),
        "peak_force": _peak_json(drive.force, force) | pose_keys(place, angles),
        f"rms_force_{force}": finite(drive.rms_force),
        "peak_power_given": _peak_json(drive.power_given, "W"),
        "peak_power_taken": _peak_json(drive.power_taken, "W"),
        "mean_power_given_W": finite(drive.mean_power),
    }


def _peak_json(peak: Peak, unit: str) -> dict[str, Any]:
    return {f"value_{unit}": finite(peak.value), "time_s": finite(peak.time)}
