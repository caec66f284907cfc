"""Modes along a path."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_words
from trivet.study.mode_paths import ModePaths
from trivet.study.mode_summary import motion_words
from trivet.views.layout import table
from trivet.views.si import finite, pose_keys

WORDS = {"cross": "cross", "touch": "touch", "veer": "veer, exchange shapes"}
SHOWN = 40
"""Rows of a table, at most."""


def tables(report: ModePaths) -> Iterator[Any]:
    """Every branch, where branches meet, and what is not certain."""
    yield _head(report)
    yield _branches(report)
    if report.encounters:
        yield _encounters(report)
    else:
        yield "No branches cross, touch or veer."
    yield _certainty(report)


def _head(report: ModePaths) -> str:
    scale, corners = report.scale, report.corners
    poses = []
    for pose in corners[[0, -1]]:
        x, y, z = (f"{round(1e3 * v, 6) + 0.0:g}" for v in pose[:3])
        alpha, beta, gamma = (f"{round(math.degrees(v), 6) + 0.0:g}" for v in pose[3:])
        poses.append(f"centre ({x}, {y}, {z}) mm, alpha {alpha}°, beta {beta}°, gamma {gamma}°")
    through = f", through {len(corners) - 2} more" if len(corners) > 2 else ""
    told = f"Places are told by the {scale.name}, {scale.unit}" if scale.unit else f"Places are poses, 1 to {len(corners)}"
    return f"{report.machine.name}, {mode_words(report.mode)}, from {poses[0]}\nto {poses[1]}{through}\n{told}"


def _branches(report: ModePaths) -> Any:
    columns = (
        "",
        "Hz at the start",
        "at the end",
        "least",
        "at",
        "greatest",
        "at",
        "least MAC",
        "moves at the start",
        "at the end",
    )
    found = table("modes along the path", *columns)
    found.columns[8].justify = found.columns[9].justify = "left"
    for k in range(report.frequency.shape[1]):
        own = report.frequency[:, k]
        there = np.flatnonzero(np.isfinite(own))
        ends = [_hertz(own[0]), _hertz(own[-1])]
        extremes = [text for at in (np.nanargmin(own), np.nanargmax(own)) for text in (_hertz(own[at]), _place(report, at))]
        mac = report.branches.mac[:, k]
        found.add_row(
            str(k + 1),
            *ends,
            *extremes,
            f"{np.nanmin(mac):.3f}" if np.isfinite(mac).any() else "–",
            _motion(report, there[0], k),
            _motion(report, there[-1], k),
        )
    return found


def _encounters(report: ModePaths) -> Any:
    found = table("where branches meet", "", "branches", "at", "Hz", "gap, Hz", "shapes turn by", left=2)
    for one in report.encounters[:SHOWN]:
        veers = one.kind == "veer"
        found.add_row(
            WORDS[one.kind],
            f"{one.first + 1} and {one.second + 1}",
            f"{float(report.scale.at(one.place)):.4g}",
            _hertz(one.frequency),
            f"{one.gap:.3g}" if veers else "",
            f"{math.degrees(one.exchange):.0f}°" if veers else "",
        )
    if len(report.encounters) > SHOWN:
        found.add_row(f"… and {len(report.encounters) - SHOWN} more: --json has all", "", "", "", "", "")
    return found


def _certainty(report: ModePaths) -> str:
    doubts, steps = report.branches.doubts, int(report.branches.steps.sum())
    looked = f"{len(report.place)} poses, {steps} steps between them"
    if not doubts:
        return f"{looked}; every mode is known again after each, by a MAC of {np.nanmin(report.branches.mac):.3f} or more."
    worst = min(doubts, key=lambda one: one.mac)
    at = f"{float(report.scale.at(worst.start)):.5g}"
    return (
        f"{looked}; NOT CERTAIN in {len(doubts)} of them, at worst branch {worst.branch + 1} at {at} (MAC {worst.mac:.2f}): "
        "beyond it the branch may be another mode's."
    )


def _hertz(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "–"


def _place(report: ModePaths, at: Any) -> str:
    return f"{float(report.scale.at(report.place[at])):.4g}"


def _motion(report: ModePaths, at: Any, branch: int) -> str:
    """What the platform does, rotations made comparable by the mean radius of the platform joints."""
    moved = report.platform[at, :, branch] * np.repeat([1.0, report.length], 3)
    return motion_words(moved, float(report.largest[at, branch]))


def as_json(report: ModePaths) -> dict[str, Any]:
    """Branches over all poses."""
    branches = report.branches
    return {
        "machine": report.machine.name,
        "mode": report.mode,
        "count": report.count,
        "poses": [
            {"place": float(place), **pose_keys(pose[:3], [float(angle) for angle in pose[3:]])}
            for place, pose in zip(report.place, report.poses, strict=True)
        ],
        "branches": [
            {
                "number": k + 1,
                "frequency_Hz": finite(report.frequency[:, k]),
                "mode_number": [int(n) + 1 if n >= 0 else None for n in branches.number[:, k]],
                "platform_twist_1_or_rad_per_m_per_sqrt_kg": finite(report.platform[:, :, k]),
                "MAC": finite(branches.mac[:, k]),
            }
            for k in range(report.frequency.shape[1])
        ],
        "steps": branches.steps.tolist(),
        "encounters": [
            {
                "kind": one.kind,
                "place": finite(one.place),
                "branches": [one.first + 1, one.second + 1],
                "frequency_Hz": finite(one.frequency),
                "gap_Hz": finite(one.gap),
                "exchange_rad": finite(one.exchange),
            }
            for one in report.encounters
        ],
        "doubts": [
            {"branch": one.branch + 1, "start": finite(one.start), "end": finite(one.end), "MAC": finite(one.mac)}
            for one in branches.doubts
        ],
    }
