"""Lock sets, advice for a task, and all drives at work along a path."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import singledispatch
from typing import Any

import numpy as np

from trivet.kinematics.drive_rates import MOST_RATE
from trivet.kinematics.mode import mode_words
from trivet.model import Machine
from trivet.model.elements import Drivable
from trivet.study.lock_advice import EQUAL, LocksAdvised
from trivet.study.lock_best import Binding, LockAdvice, WorstPose
from trivet.study.lock_measures import Measure
from trivet.study.locks import LockSet, LockSets
from trivet.study.redundant import RedundantPath
from trivet.views.layout import fixed, more, plain_number, table
from trivet.views.si import finite, pose_keys

SHOWN, FEW = 12, 8
"""Rows of a table of places along a path, and of lock sets."""
WIDEST = 40
"""Letters of a line of reasons."""
NEARLY = 0.99
"""Part of the greatest rate of a drive that is said to be it."""


@singledispatch
def tables(result: Any) -> Iterator[Any]:
    """What people read."""
    raise TypeError(type(result).__name__)


@singledispatch
def as_json(result: Any) -> dict[str, Any]:
    """What programs read."""
    raise TypeError(type(result).__name__)


def number(value: float, asked: Measure) -> str:
    """A value of a measure, with its unit."""
    if math.isnan(value):
        return ""
    if asked.unit == "N/m":
        return f"{value / 1e6:.5g} N/µm"
    return f"{value:.5g} {asked.unit}".rstrip()


def unit_key(name: str, asked: Measure) -> str:
    """A key with the unit of a measure."""
    unit = asked.unit.replace("/", "_per_").replace(" ", "_")
    return f"{name}_{unit}" if unit else name


def joints(machine: Machine) -> dict[str, Drivable]:
    """The drives by their names."""
    return {f"{leg.name}.{e.name}": e for leg in machine.legs for e in leg.chain.elements if isinstance(e, Drivable)}


def where_locked(machine: Machine, coordinates: Mapping[str, float]) -> str:
    """Locked drives as the option --lock takes them."""
    known = joints(machine)
    return ", ".join(f"{name}={_plain(known[name], value)}" for name, value in coordinates.items())


def _plain(joint: Drivable, value: float) -> str:
    return f"{plain_number(math.degrees(value))} deg" if joint.is_angular else f"{plain_number(1e3 * value)} mm"


def _at(pose: WorstPose) -> str:
    x, y, z = (plain_number(1e3 * c) for c in pose.position)
    return f"({x}, {y}, {z}) mm, " + ", ".join(
        f"{word} {plain_number(math.degrees(c))}°" for word, c in zip(("alpha", "beta", "gamma"), pose.angles, strict=True)
    )


def drives_in_short(names: Iterable[str]) -> str:
    """Drives with the name of each chain once: "leg-1 guide tangential, leg-2 radial"."""
    chains: dict[str, list[str]] = {}
    for name in names:
        chain, _, joint = name.partition(".")
        chains.setdefault(chain, []).append(joint)
    return ", ".join(" ".join([chain, *own]) for chain, own in chains.items())


def places_in_short(machine: Machine, coordinates: Mapping[str, float]) -> str:
    """Where drives are locked, mm or deg, chain by chain: "guide 5 / - / radial 44.2", or "guide 5 / 0 / 1"."""
    known, parts = joints(machine), []
    for leg in machine.legs:
        own = [(n.partition(".")[2], v, known[n]) for n, v in coordinates.items() if n.partition(".")[0] == leg.name]
        parts.append([(joint, plain_number((180 / math.pi if e.is_angular else 1e3) * v)) for joint, v, e in own])
    if len({tuple(joint for joint, _ in part) for part in parts}) == 1 and len(parts[0]) == 1:
        return f"{parts[0][0][0]} " + " / ".join(part[0][1] for part in parts)
    return " / ".join(" ".join(f"{joint} {value}" for joint, value in part) or "-" for part in parts)


@tables.register
def _(result: LockSets) -> Iterator[Any]:
    whole = result.whole
    groups = {one.group for one in whole}
    alike = f", {len(groups)} of them different by the machine's turns about z" if len(groups) < len(whole) else ""
    lost = sum(one.at_home is not None and one.at_home < 6 for one in whole)
    singular = (
        f"\n{lost} of these are singular at the machine's home, with its drives where the file locks them" if lost else ""
    )
    yield (
        f"{result.machine.name}: {len(result.drives)} drives, {result.spare} to spare\n"
        f"{len(result.sets)} sets of {result.spare} to lock; {len(whole)} leave six freedoms{alike}{singular}"
    )
    for title, chosen in (("six freedoms are left", True), ("less is left", False)):
        found = table(title, "locked", "alike", "at home", *([] if chosen else ["what is left of the platform, and why"]))
        for own in result.groups.values():
            first = own[0]
            if first.is_whole is chosen:
                why = [] if chosen else [f"{first.platform}: {first.verdict}"]
                found.add_row(drives_in_short(first.drives), str(len(own)), _left_at_home(first), *why)
        for column in found.columns:
            column.justify = "left"
        found.columns[-1].max_width = WIDEST
        if found.row_count:
            yield found
    yield _explained(result.symmetry)


def _explained(symmetry: int) -> str:
    home = "at home: freedoms of the platform there; fewer than six where home is singular for a set"
    if symmetry < 2:
        return home
    turn = f"when the machine turns about z by {360 / symmetry:g}°"
    return f"alike: sets that become each other {turn}; the first is named\n{home}"


def _left_at_home(one: LockSet) -> str:
    return "" if one.at_home is None else str(one.at_home)


@as_json.register
def _(result: LockSets) -> dict[str, Any]:
    return {
        "machine": result.machine.name,
        "drives": list(result.drives),
        "spare_drives": result.spare,
        "symmetry": result.symmetry,
        "lock_sets": [_set(one) for one in result.sets],
    }


def _set(one: LockSet) -> dict[str, Any]:
    return {
        "drives": list(one.drives),
        "leaves_six_freedoms": one.is_whole,
        "platform_freedoms": one.platform,
        "platform_freedoms_at_home": one.at_home,
        "loose_chains": dict(one.loose),
        "verdict": one.verdict,
        "group": one.group,
    }


def _task(result: LocksAdvised) -> str:
    task = result.task
    if task.family is None:
        return task.name
    return f"{task.name}, at {len(task.places.tilt)} poses and checked at {len(task.between.tilt)} between"


@tables.register
def _(result: LocksAdvised) -> Iterator[Any]:
    best, asked = result.best, result.measure
    assert best.worst is not None
    modes = "all working modes" if result.signs is None else "the machine's own working mode"
    yield "\n".join(
        [
            f"{result.machine.name}: {_task(result)}, roll {result.task.roll}, {modes}",
            f"greatest {asked.name}, the least over the task: {number(best.value, asked)}",
            f"lock {where_locked(result.machine, best.coordinates)}",
            f"{mode_words(best.mode)}; worst at {_at(best.worst)}",
            *_cautions(best, *result.stiffness),
            *_equals(result),
        ]
    )
    yield _beside(result)
    yield _by_set(result)
    missed = [advice for advice in result.advices if advice.holding is None]
    if missed:
        lost = table("lock sets that do not reach the task", "locked", "why", "at", left=1)
        for advice in missed[:FEW]:
            at = "" if advice.missed is None else _at(advice.missed)
            lost.add_row(drives_in_short(advice.locks.drives), advice.reason, at)
        for column in lost.columns[1:]:
            column.justify = "left"
            column.max_width = WIDEST // 2 + 6
        more(lost, len(missed), FEW)
        yield lost


def _cautions(best: LockAdvice, ours: Mapping[str, float], theirs: Mapping[str, float]) -> list[str]:
    """What stands at a limit, and what is less than with the locks of the file."""
    ends = list(dict.fromkeys(one.joint for one in best.binding))
    said = [f"at an end of its travel: {', '.join(ends)}"] if ends else []
    if best.rate > NEARLY * MOST_RATE:
        said.append(f"a drive goes {best.rate:.3g} times as fast as the platform, at most {MOST_RATE:g}: a singularity is near")
    less = [name for name, value in theirs.items() if ours[name] < value * (1 - EQUAL)]
    if less:
        said.append(f"less than as the file locks: {', '.join(less)}")
    return said


def _equals(result: LocksAdvised) -> list[str]:
    """Whether the choice matters."""
    said, count, part = [], len(result.equal), f"{100 * EQUAL:g} %"
    if count > 1:
        said.append(f"{count} sets are equal within {part}: which of them does not matter for {result.measure.name}")
    greatest = max(advice.value for advice in result.equal)
    if result.own is not None and result.own.value >= greatest - EQUAL * abs(greatest):
        said.append(f"the locks of the machine's file are equal within {part}: there is no need for others")
    return said


def _beside(result: LocksAdvised) -> Any:
    """The best set beside the locks of the file."""
    asked, own = result.measure, result.own
    heads = ["", "best", "as the file locks"]
    found = table("least over the task, N/µm", *heads)
    ours, theirs = result.stiffness
    for name, value in ours.items():
        found.add_row(name, f"{value / 1e6:.5g}", f"{theirs[name] / 1e6:.5g}" if theirs else "")
    if asked.name not in ours:
        found.add_row(asked.name, number(result.best.value, asked), number(result.as_is, asked))
    for name, one in (("drive rate", "rate"), ("travel left", "margin")):
        known = [result.best, *([own] if own is not None and own.holding is not None else [])]
        found.add_row(name, *(f"{getattr(a, one) + 0.0:.3g}" for a in known), *([] if len(known) > 1 else [""]))
    if own is not None and own.holding is None:
        found.caption, found.caption_justify = f"the locks of the file do not reach the task: {own.reason}", "left"
    return found


def _by_set(result: LocksAdvised) -> Any:
    asked, short = result.measure, "N/µm" if result.measure.unit == "N/m" else result.measure.unit
    value = f"{asked.name}\n{short}".rstrip()
    chains = " / ".join(leg.name for leg in result.machine.legs)
    found = table(
        f"least {asked.name} by lock set", f"locked, mm or deg\n{chains}", "mode", value, "drive\nrate", "travel\nleft", left=2
    )
    for advice in result.reached[:FEW]:
        locked = places_in_short(result.machine, advice.coordinates)
        shown = number(advice.value, asked).removesuffix(short).rstrip()
        found.add_row(locked, advice.mode, shown, f"{advice.rate:.3g}", fixed(advice.margin, 2))
    more(found, len(result.reached), FEW)
    found.caption_justify = "left"
    length = 1e3 * float(result.machine.characteristic_length)
    found.caption = (
        f"drive rate: greatest speed of a drive per speed of the platform, mm/s per mm/s; turns count at {length:.4g} mm\n"
        "travel left: least margin of a joint, 1 in the middle of its travel, 0 at an end"
    )
    return found


@as_json.register
def _(result: LocksAdvised) -> dict[str, Any]:
    asked = result.measure
    return {
        "machine": result.machine.name,
        "task": result.task.name,
        "roll": result.task.roll,
        "modes": "all" if result.signs is None else "own",
        "objective": asked.name,
        unit_key("as_the_file_locks", asked): finite(result.as_is),
        "sets_equal": len(result.equal),
        "stiffness_N_per_m": result.stiffness[0],
        "stiffness_as_the_file_locks_N_per_m": result.stiffness[1] or None,
        "greatest_drive_rate_allowed": MOST_RATE,
        "advice": [_advice(advice, result) for advice in result.advices],
    }


def _advice(advice: LockAdvice, result: LocksAdvised) -> dict[str, Any]:
    known = joints(result.machine)
    return {
        "drives": list(advice.locks.drives),
        "group": advice.locks.group,
        "reached": advice.holding is not None,
        "reason": advice.reason or None,
        "missed_pose": _pose(advice.missed),
        "mode": advice.mode,
        "locks": [{"joint": n, f"coordinate_{known[n].unit}": value} for n, value in advice.coordinates.items()],
        unit_key("least", result.measure): finite(advice.value),
        "worst_pose": _pose(advice.worst),
        "drive_rate": finite(advice.rate),
        "travel_margin": finite(advice.margin),
        "binding": [_binding(one) for one in advice.binding],
    }


def _binding(one: Binding) -> dict[str, Any]:
    return {"joint": one.joint, "travel_margin": one.margin, **pose_keys(one.pose.position, one.pose.angles)}


def _pose(pose: WorstPose | None) -> dict[str, Any] | None:
    return None if pose is None else pose_keys(pose.position, pose.angles)


@tables.register
def _(result: RedundantPath) -> Iterator[Any]:
    asked, best = result.fixed.measure, result.fixed.best
    yield (
        f"{result.machine.name}: {result.fixed.task.name}, all {len(result.drives)} drives at work, each spare one at most "
        f"{result.rate:g} travels of its own along the path"
    )
    rows = table(f"least {asked.name} along the path", "", asked.name, "")
    rows.add_row("best locks", number(result.locked_least, asked), places_in_short(result.machine, best.coordinates))
    rows.add_row("all drives at work", number(result.least, asked), f"in terms of {drives_in_short(result.spare)}")
    rows.add_row("every pose by itself", number(result.bound, asked), "no choice of the drives is above it")
    if not math.isnan(result.fixed.as_is):
        rows.add_row("as the file locks", number(result.fixed.as_is, asked), "")
    rows.columns[-1].justify = "left"
    yield rows
    known = joints(result.machine)
    units = ["°" if known[name].is_angular else "mm" for name in result.drives]
    heads = [f"{name}\n{unit}".replace(".", "\n", 1) for name, unit in zip(result.drives, units, strict=True)]
    short = "N/µm" if asked.unit == "N/m" else asked.unit
    found = table("along the path", "pose", f"{asked.name}\n{short}".rstrip(), *heads, left=0)
    for k in np.unique(np.linspace(0, len(result.along) - 1, SHOWN).round().astype(int)).tolist():
        own = [math.degrees(v) if u == "°" else 1e3 * v for v, u in zip(result.coordinates[k], units, strict=True)]
        value = number(float(result.value[k]), asked).removesuffix(short).rstrip()
        found.add_row(f"{result.along[k]:.3f}", value, *(fixed(v, 2) for v in own))
    yield found


@as_json.register
def _(result: RedundantPath) -> dict[str, Any]:
    asked, known = result.fixed.measure, joints(result.machine)
    return {
        "locks": as_json(result.fixed),
        "rate_travels_per_path": result.rate,
        "spare_drives": list(result.spare),
        "mode": result.mode,
        unit_key("least", asked): finite(result.least),
        unit_key("least_with_best_locks", asked): finite(result.locked_least),
        unit_key("least_of_single_poses", asked): finite(result.bound),
        "path_coordinate": finite(result.along),
        unit_key("value", asked): finite(result.value),
        unit_key("with_best_locks", asked): finite(result.on_locks),
        unit_key("pose_by_itself", asked): finite(result.alone),
        "drives": [
            {"joint": name, f"coordinate_{known[name].unit}": finite(result.coordinates[:, k])}
            for k, name in enumerate(result.drives)
        ],
    }
