"""Lock sets, advice for a task, and all drives at work along a path."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import singledispatch
from typing import Any

import numpy as np

from trivet.cli.views.layout import plain_number, table
from trivet.cli.views.si import finite, pose_keys
from trivet.kinematics.mode import mode_words
from trivet.model import Machine
from trivet.model.elements import Drivable
from trivet.study.lock_advice import Binding, LockAdvice, LocksAdvised, WorstPose
from trivet.study.lock_measures import Measure
from trivet.study.locks import LockSet, LockSets
from trivet.study.redundant import RedundantPath

SHOWN = 12
"""Rows of a table of places along a path."""


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


@tables.register
def _(result: LockSets) -> Iterator[Any]:
    whole = result.whole
    groups = {one.group for one in whole}
    alike = f", {len(groups)} of them different by the machine's turns about z" if len(groups) < len(whole) else ""
    yield (
        f"{result.machine.name}: {len(result.drives)} drives, {result.spare} to spare\n"
        f"{len(result.sets)} sets of {result.spare} to lock; {len(whole)} leave six freedoms{alike}"
    )
    for title, chosen in (("six freedoms are left", True), ("less is left", False)):
        found = table(title, "locked", "alike", *([] if chosen else ["what is left of the platform, and why"]))
        for own in result.groups.values():
            first = own[0]
            if first.is_whole is chosen:
                found.add_row(first.name, str(len(own)), *([] if chosen else [f"{first.platform}: {first.verdict}"]))
        for column in found.columns:
            column.justify = "left"
        if found.row_count:
            yield found


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
    yield (
        f"{result.machine.name}: {_task(result)}, roll {result.task.roll}, {modes}\n"
        f"greatest {asked.name}, the least over the task: {number(best.value, asked)}\n"
        f"lock {where_locked(result.machine, best.coordinates)}; {mode_words(best.mode)}\n"
        f"worst at {_at(best.worst)}"
    )
    if not math.isnan(result.as_is):
        yield f"with the locks of the machine's file: {number(result.as_is, asked)}"
    found = table(f"least {asked.name} by lock set", "locked at", "mode", asked.name, "group", "ends of travel met by", left=2)
    for advice in result.reached:
        met = ", ".join(dict.fromkeys(b.joint for b in advice.binding))
        locked = where_locked(result.machine, advice.coordinates)
        found.add_row(locked, advice.mode, number(advice.value, asked), str(advice.locks.group), met)
    yield found
    missed = [advice for advice in result.advices if advice.holding is None]
    if missed:
        lost = table("lock sets that do not reach the task", "locked", "why", "at", left=2)
        for advice in missed:
            lost.add_row(advice.locks.name, advice.reason, "" if advice.missed is None else _at(advice.missed))
        yield lost


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
    rows.add_row("best locks", number(result.locked_least, asked), where_locked(result.machine, best.coordinates))
    rows.add_row("all drives at work", number(result.least, asked), f"in terms of {', '.join(result.spare)}")
    rows.add_row("every pose by itself", number(result.bound, asked), "no choice of the drives is above it")
    if not math.isnan(result.fixed.as_is):
        rows.add_row("as the file locks", number(result.fixed.as_is, asked), "")
    yield rows
    known = joints(result.machine)
    units = ["°" if known[name].is_angular else "mm" for name in result.drives]
    heads = [f"{name}, {unit}".replace(".", "\n", 1) for name, unit in zip(result.drives, units, strict=True)]
    found = table("along the path", "pose", asked.name, *heads, left=0)
    for k in np.unique(np.linspace(0, len(result.along) - 1, SHOWN).round().astype(int)).tolist():
        own = [math.degrees(v) if u == "°" else 1e3 * v for v, u in zip(result.coordinates[k], units, strict=True)]
        found.add_row(f"{result.along[k]:.3f}", number(float(result.value[k]), asked), *(f"{v + 0.0:.3f}" for v in own))
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
