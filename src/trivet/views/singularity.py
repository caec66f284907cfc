"""Singularity and transmission at one pose."""

from __future__ import annotations

import math
from typing import Any

from trivet.kinematics.singularity import motion_words
from trivet.study.singularity import DIRECTIONS, SHIFTS, SingularityReport
from trivet.views.layout import table, where
from trivet.views.si import finite, pose_keys


def tables(report: SingularityReport) -> list[Any]:
    """Singularity and transmission at one pose."""
    found = report.singularity
    stands = where(found.machine.name, found.mode, found.frame.origin, report.angles)
    verdict = "\n".join(found.meaning) or f"regular; the drives control least how the platform {motion_words(found.motion)}"
    numbers = table("how near", "", "value", left=1)
    det, far = found.determinants, found.distance
    rows = (
        ("smallest singular value of J_x (moments over the characteristic length)", f"{found.sigma_min:.6g}"),
        ("moving the centre, to a Type 2 singularity to first order", first_order(1e3 * far.length, "mm", 1e3)),
        ("tilting about the centre, to a Type 2 singularity to first order", first_order(math.degrees(far.angle), "°", 180)),
        ("tilting about the centre until there is a Type 2 singularity", _tilt_margin(report)),
        ("moving the centre until there is a Type 2 singularity", _shift_margin(report)),
        ("det J_x; its sign changes across Type 2 singularities", f"{det.j_x:.6g} m^3"),
        ("det J_q", f"{det.j_q:.6g} (SI)"),
        ("1 / det J⁻¹, geometric", f"{1 / det.inverse if det.inverse else math.inf:.6g} (SI)"),
    )
    for words, value in rows:
        numbers.add_row(words, value)
    drives = table("drives", "drive", "lever of its force", "ITI", "OTI", "")
    moved = report.transmission
    for k, drive in enumerate(found.drives):
        lever = f"{1e3 * drive.lever:.4g} mm" if drive.is_angular else f"cos {drive.lever:.4g}"
        idle = "SINGULAR" if drive.is_singular else ""
        drives.add_row(drive.name, lever, f"{float(moved.input[k]):.4f}", f"{float(moved.output[k]):.4f}", idle)
    return [stands, verdict, numbers, drives, f"local transmission index LTI {float(moved.local):.4f}, the least of all"]


def first_order(value: float, unit: str, most: float) -> str:
    """A distance to first order, or why there is none: how near a singularity is, that does not tell."""
    if math.isnan(value):
        return "no estimate: det J_x has no slope here"
    return f"{value:.4g} {unit}" if value < most else "no estimate: the slope of det J_x is about zero"


def _tilt_margin(report: SingularityReport) -> str:
    margin = report.tilt_margin
    if not math.isfinite(margin.angle):
        return f"none met in {DIRECTIONS} directions, up to 90° or as far as the chains reach"
    return f"{math.degrees(margin.angle):.4f}° towards {math.degrees(margin.azimuth):g}° from x of {{E}}"


def _shift_margin(report: SingularityReport) -> str:
    margin = report.shift_margin
    if not math.isfinite(margin.length):
        return f"none met in {len(SHIFTS)} directions, as far as the chains reach"
    return f"{1e3 * margin.length:.4g} mm along ({', '.join(f'{part:.3g}' for part in margin.direction)}) in {{O}}"


def as_json(report: SingularityReport) -> dict[str, Any]:
    """Singularity and transmission at one pose."""
    found, moved = report.singularity, report.transmission
    motion, far, det = found.motion, found.distance, found.determinants
    return {
        "machine": found.machine.name,
        "mode": found.mode,
        **pose_keys(found.frame.origin, report.angles),
        "type": found.type,
        "meaning": found.meaning,
        "sigma_min": finite(found.sigma_min),
        "aspect_sign": found.aspect_sign,
        "det_J_x_m3": finite(det.j_x),
        "det_J_q_SI": finite(det.j_q),
        "det_J_G_inverse_SI": finite(det.inverse),
        "det_J_inverse_SI": finite(det.inverse_analytical),
        "least_controlled_motion": {
            "linear": finite(motion.linear),
            "angular": finite(motion.angular),
            "direction": finite(motion.direction),
            "point_m": None if motion.point is None else finite(motion.point),
            "pitch_m_per_rad": finite(motion.pitch),
        },
        "distance_m": finite(far.length) if far.length < 1 else None,
        "shift_to_singularity_m": finite(far.shift) if far.length < 1 else None,
        "distance_rad": finite(far.angle) if far.angle < math.pi else None,
        "tilt_to_singularity_rad": finite(far.tilt) if far.angle < math.pi else None,
        "tilt_margin_rad": finite(report.tilt_margin.angle),
        "tilt_margin_azimuth_rad": finite(report.tilt_margin.azimuth),
        "shift_margin_m": finite(report.shift_margin.length),
        "shift_margin_direction": finite(report.shift_margin.direction),
        "drives": [
            {
                "name": drive.name,
                "lever_m" if drive.is_angular else "lever": finite(drive.lever),
                "singular": drive.is_singular,
                "ITI": finite(float(moved.input[k])),
                "OTI": finite(float(moved.output[k])),
            }
            for k, drive in enumerate(found.drives)
        ],
        "LTI": finite(float(moved.local)),
    }
