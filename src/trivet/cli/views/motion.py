"""A motion along a path: actuator sizing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from trivet.cli.views.dynamics import loaded
from trivet.cli.views.layout import beside, fixed, table
from trivet.cli.views.si import finite, pose_keys
from trivet.kinematics.mode import mode_words
from trivet.study.motion import DriveSizing, MotionReport, Peak


def tables(report: MotionReport) -> Iterator[Any]:
    """What every drive must be able to do, and every joint bear."""
    duration = report.trajectory.duration
    yield (
        f"{report.machine.name}, {mode_words(report.mode)}, a motion of {duration:.4g} s looked at {len(report.time)} times\n"
        f"{loaded(report.loading)}; sigma_min {report.sigma_min.min():.3g} at least"
    )
    moves = table("how the drives move", "drive", "from", "to", "peak speed", "at s", "peak acceleration", "at s")
    needs = table("what they must give", "drive", "peak force", "at s", "RMS force", "peak power", "at s", "mean power given")
    power = max(abs(drive.power.value) for drive in report.drive_sizing)
    for drive, unit in zip(report.drive_sizing, report.units, strict=True):
        scale, shown = (1e3, "mm") if drive.unit == "m" else (math.degrees(1), "°")
        moves.add_row(
            drive.name, f"{fixed(drive.low * scale, 4)} {shown}", f"{fixed(drive.high * scale, 4)} {shown}",
            *_peak(drive.speed, f"{shown}/s", scale), *_peak(drive.acceleration, f"{drive.unit}/s²"),
        )  # fmt: skip
        needs.add_row(
            drive.name, *_peak(drive.force, unit), f"{drive.rms_force:.4g} {unit}", *_peak(drive.power, "W"),
            f"{beside(drive.mean_power, power, 4)} W",
        )  # fmt: skip
    yield moves
    yield needs
    yield _where(report)
    bears = table("what the joints must bear", "joint", "peak force", "at s", "peak moment", "at s")
    for joint in report.joint_sizing:
        bears.add_row(joint.name, *_peak(joint.force, "N"), *_peak(joint.moment, "N m"))
    yield bears


def _peak(peak: Peak, unit: str, scale: float = 1.0) -> tuple[str, str]:
    value = peak.value * scale
    return f"{value if abs(value) > 1e-12 else 0.0:.4g} {unit}", f"{peak.time:.4f}"


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
        "peak_power": _peak_json(drive.power, "W"),
        "mean_power_given_W": finite(drive.mean_power),
    }


def _peak_json(peak: Peak, unit: str) -> dict[str, Any]:
    return {f"value_{unit}": finite(peak.value), "time_s": finite(peak.time)}
