"""Stability lobes, at a pose and along a path."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.chatter.cut import Cut
from trivet.kinematics.mode import mode_words
from trivet.study.lobes import LOWEST, RPM, Checked, Lobes, LobesAlong
from trivet.views.layout import reached, table, where
from trivet.views.si import finite, pose_keys

SHOWN = 10
"""Rows of a table over speeds."""
LITTLE = 0.5
"""Teeth in the material, in the mean, below which the zero-order approach is told not to be enough."""
_LITTLE = "less than half a tooth is in the material, in the mean: the lobes leave out such as double the period"
POSES = 40
"""Rows of a table of poses, at most."""


def tables(result: Lobes | LobesAlong, checked: list[Checked] | None = None) -> Iterator[Any]:
    """What is stable at every speed, the speeds between lobes, some speeds all over the range; along a path pose by pose."""
    if isinstance(result, LobesAlong):
        yield from _along(result)
        return
    at = result.at
    yield f"{where(at.machine.name, at.mode, at.position, at.angles)}\n{reached(at.miss)}\n{_setting(result)}"
    yield _lowest(result)
    if result.cut.engaged < LITTLE:
        yield f"{_LITTLE}; {'the check below counts them' if checked is not None else 'try --check'}"
    if not result.is_limited:
        yield _no_lobe(result)
    else:
        if len(result.pockets):
            yield _speeds("between lobes, the deepest first", result, result.pockets[:SHOWN])
        yield _speeds("over the range", result, np.linspace(0, len(result.speeds) - 1, SHOWN).round().astype(int))
    if checked is not None:
        yield _checks(checked)


def _setting(one: Lobes) -> str:
    """The cut, where it is, and what is computed."""
    place = "the tool tip" if one.point.place == "tool" else "the platform centre (no platform.tool_tip is given)"
    way = "along" if one.point.side > 0 else "against"
    return (
        f"cut: {cut_words(one.cut)}\n"
        f"at {place}, tool {way} z_E, feed {math.degrees(one.feed):g}° from the direction of growing tilt\n"
        f"exact receptance, loss factor {one.loss_factor:g}, chatter from {LOWEST:g} to {one.highest:g} Hz"
    )


def cut_words(cut: Cut) -> str:
    """A cut in words."""
    immersion = f"{math.degrees(cut.entry):.4g}° to {math.degrees(cut.exit):.4g}°"
    kind = (
        "slot"
        if cut.is_slot
        else "up milling"
        if cut.entry == 0
        else "down milling"
        if cut.exit >= math.pi - 1e-9
        else "inside"
    )
    teeth = f"{cut.teeth} teeth" if cut.teeth > 1 else "1 tooth"
    return (
        f"{teeth}, {cut.diameter * 1e3:g} mm, {kind} from {immersion}, K_t {cut.tangential / 1e6:.5g} N/mm², "
        f"K_r {cut.radial_ratio:.4g}"
    )


def _lowest(one: Lobes) -> str:
    if not math.isfinite(one.lowest_depth):
        return f"no chatter frequency up to {one.highest:g} Hz limits the depth at any spindle speed"
    end = "; that is the end of the range, beyond may be less" if one.is_at_end else ""
    return (
        f"stable at every spindle speed: up to {one.lowest_depth * 1e3:.4f} mm; deeper cuts chatter at "
        f"{one.lowest_frequency:.1f} Hz at the worst speeds{end}"
    )


def _no_lobe(result: Lobes | LobesAlong) -> str:
    low, high = result.speeds[[0, -1]] / RPM
    return f"no lobe from {low:g} to {high:g} rpm: no depth is unstable there"


def depth_words(depth: float) -> str:
    """A depth (m) in mm."""
    return f"{depth * 1e3:.4f}" if math.isfinite(depth) else "any"


def _speeds(title: str, one: Lobes, places: np.ndarray) -> Any:
    found = table(title, "rpm", "stable up to mm", "chatters at Hz", "teeth pass at Hz", "whole waves", left=0)
    for place in dict.fromkeys(places.tolist()):
        speed, frequency = float(one.speeds[place]), float(one.limits.frequency[place])
        has = math.isfinite(frequency)
        found.add_row(
            f"{speed / RPM:.1f}",
            depth_words(float(one.depth[place])),
            f"{frequency:.1f}" if has else "",
            f"{one.cut.teeth * speed / (2 * math.pi):.1f}",
            str(int(one.limits.waves[place])) if has else "",
        )
    return found


def _checks(checked: list[Checked]) -> Any:
    found = table("lobes beside semi-discretisation", "rpm", "lobes mm", "semi-discretisation mm", "lobes by %", left=0)
    for row in checked:
        both = math.isfinite(row.zero_order) and 0 < row.semi_discretisation < math.inf
        apart = f"{100 * (row.zero_order / row.semi_discretisation - 1):+.1f}" if both else ""
        found.add_row(f"{row.speed / RPM:.1f}", depth_words(row.zero_order), depth_words(row.semi_discretisation), apart)
    return found


def _along(result: LobesAlong) -> Iterator[Any]:
    first = result.poses[0]
    yield f"{first.at.machine.name}, {mode_words(first.at.mode)}, {len(result.poses)} poses\n{_setting(first)}"
    worst = result.poses[result.worst]
    yield f"pose {result.worst + 1} is the worst; there {_lowest(worst)}"
    if first.cut.engaged < LITTLE:
        yield f"{_LITTLE}; try --check at single poses"
    found = table(
        "pose by pose", "", "x mm", "y mm", "z mm", "azimuth °", "tilt °", "roll °", "at every speed mm", "best rpm", "mm"
    )
    for k, one in enumerate(result.poses[:POSES]):
        place = [f"{c * 1e3:.3f}" for c in one.at.position] + [f"{math.degrees(c):.3f}" for c in one.at.angles]
        best = int(np.argmax(one.depth))
        at_best = [f"{one.speeds[best] / RPM:.1f}", depth_words(float(one.depth[best]))]
        found.add_row(str(k + 1), *place, depth_words(one.lowest_depth), *at_best)
    if len(result.poses) > POSES:
        found.add_row(f"and {len(result.poses) - POSES} more with --json")
    yield found
    if not result.is_limited:
        yield _no_lobe(result)
        return
    at_all = table(
        "between lobes at all poses together, the deepest first", "rpm", "stable up to mm", "limited by pose", left=0
    )
    for place in result.pockets[:SHOWN].tolist():
        pose = str(int(np.argmin(result.depth[:, place])) + 1)
        at_all.add_row(f"{result.speeds[place] / RPM:.1f}", depth_words(float(result.least[place])), pose)
    yield at_all if len(result.pockets) else "no speed of the range is between lobes at all poses together"


def as_json(result: Lobes | LobesAlong, checked: list[Checked] | None = None) -> dict[str, Any]:
    """All depths."""
    first = result.poses[0] if isinstance(result, LobesAlong) else result
    common = {
        "machine": first.at.machine.name,
        "mode": first.at.mode,
        "cut": {
            "diameter_m": first.cut.diameter,
            "teeth": first.cut.teeth,
            "entry_rad": first.cut.entry,
            "exit_rad": first.cut.exit,
            "tangential_Pa": first.cut.tangential,
            "radial_ratio": first.cut.radial_ratio,
        },
        "feed_rad": first.feed,
        "place": first.point.place,
        "tool_side": first.point.side,
        "loss_factor": first.loss_factor,
        "highest_frequency_Hz": first.highest,
        "spindle_speed_rad_per_s": finite(result.speeds),
    }
    if isinstance(result, LobesAlong):
        return {
            **common,
            "poses": [_pose(one) for one in result.poses],
            "worst_pose": result.worst + 1,
            "least_depth_m": finite(result.least),
            "pockets": _pockets(result, result.least),
        }
    return {**common, **_pose(result), "pockets": _pockets(result, result.depth), "check": _checked(checked)}


def _pose(one: Lobes) -> dict[str, Any]:
    return {
        **pose_keys(one.at.position, one.at.angles),
        "reached": one.at.miss is None,
        "lowest_depth_m": finite(one.lowest_depth),
        "lowest_depth_frequency_Hz": finite(one.lowest_frequency),
        "depth_m": finite(one.depth),
        "chatter_frequency_Hz": finite(one.limits.frequency),
        "whole_waves": [int(k) if k >= 0 else None for k in one.limits.waves],
    }


def _pockets(result: Lobes | LobesAlong, depth: np.ndarray) -> list[dict[str, Any]]:
    return [
        {"spindle_speed_rad_per_s": float(result.speeds[k]), "depth_m": finite(float(depth[k]))}
        for k in result.pockets.tolist()
    ]


def _checked(checked: list[Checked] | None) -> list[dict[str, Any]] | None:
    if checked is None:
        return None
    return [
        {
            "spindle_speed_rad_per_s": row.speed,
            "depth_m": finite(row.zero_order),
            "semi_discretisation_depth_m": finite(row.semi_discretisation),
        }
        for row in checked
    ]
