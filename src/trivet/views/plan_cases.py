"""Many plans in one table: cases that are alike in one row, columns that are alike in its title."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

from trivet.study.plan import Plan, PlanStudy
from trivet.views.layout import table
from trivet.views.plan_words import gap_number, in_unit, rules_words, travel_number

ALIKE = 1e-6
"""Ways whose values differ by less, in parts, are equal: in modes that only name the chains differently."""
SHOWN = 40
"""Rows, at most."""
WIDTH = 34
"""Of the names of modes, about."""
TITLE = ("machine", "z0 mm", "free all along")
"""Columns that go to the title where all rows have the same in them."""


def cases(study: PlanStudy) -> Iterator[Any]:
    """A row for all cases that are alike, the best first."""
    groups = _grouped(study.plans)
    columns = {name: cells for name, cells in _columns(groups).items() if set(cells) - {"", "–"}}
    common = {name: columns.pop(name)[0] for name in TITLE if name in columns and len(set(columns[name])) == 1}
    told = (f"{name.removesuffix(' mm')} {cell}{' mm' * name.endswith(' mm')}" for name, cell in common.items())
    found = table("; ".join([f"{len(study.plans)} cases", *told, "the best first"]), *columns, left=1 + ("machine" in columns))
    if "stopped" in columns:
        found.columns[-1].justify = "left"
    for row in list(zip(*columns.values(), strict=True))[:SHOWN]:
        found.add_row(*row)
    yield found
    if len(groups) > SHOWN:
        yield f"and {len(groups) - SHOWN} more rows; all of them with --json"
    yield rules_words(study.plans[0].rules)


def _columns(groups: list[list[Plan]]) -> dict[str, list[str]]:
    first = [group[0] for group in groups]
    rules = first[0].rules
    value = "least value" if len(rules.aims) > 1 else f"least {rules.aims[0].name}"
    columns = {
        "machine": [plan.machine.name for plan in first],
        "mode": [_modes(group) for group in groups],
        "z0 mm": [f"{plan.grid.path.z[0] * 1e3:g}" if plan.grid.poses is None else "–" for plan in first],
        "gets to": [_end(plan) for plan in first],
        value: [_value(plan) for plan in first],
        "sigma_min": [f"{plan.sigma_min:.4f}" if plan.is_possible else "–" for plan in first],
        "travel left, % of half": [_from_to([travel_number(plan.travel) for plan in group]) for group in groups],
        "clearance mm": [_from_to([gap_number(plan.clearance) for plan in group]) for group in groups],
        "worst at": ["–" if p.along is None else p.grid.mark(p.along.rows[p.worst]) for p in first],
        "free all along": [plan.verdict if plan.is_possible else "–" for plan in first],
        "stopped": [plan.stopped_by for plan in first],
    }
    if value == "least sigma_min":
        del columns["sigma_min"]
    return columns


def _modes(group: list[Plan]) -> str:
    """The modes of a row by name, as many as there is room for."""
    modes = [plan.mode for plan in group]
    shown = max(1, next((n for n in range(len(modes), 0, -1) if len(", ".join(modes[:n])) <= WIDTH), 1))
    return ", ".join(modes[:shown]) + (f" and {len(modes) - shown} more" if shown < len(modes) else "")


def _from_to(numbers: list[str]) -> str:
    """What cases that are alike have of something that may differ: equal ways are told apart by it."""
    told = sorted({number for number in numbers if number != "–"}, key=float)
    return "–" if not told else told[0] if len(told) == 1 else f"{told[0]} to {told[-1]}"


def _end(plan: Plan) -> str:
    if plan.highest < 0:
        return "–"
    mark = plan.grid.marks[plan.highest]
    return f"{mark:.4g}°" if plan.grid.poses is None else f"pose {mark:.4g}"


def _value(plan: Plan) -> str:
    if plan.along is None:
        return "–"
    if len(plan.rules.aims) > 1:
        return f"{plan.value:.4g}"
    (aim,) = plan.rules.aims
    return f"{plan.value:.4f}" if aim.scalar is None else in_unit(aim, plan.value * aim.unit)


def _grouped(plans: tuple[Plan, ...]) -> list[list[Plan]]:
    groups: list[list[Plan]] = []
    for plan in plans:
        same = next((group for group in groups if _is_alike(group[0], plan)), None)
        if same is None:
            groups.append([plan])
        else:
            same.append(plan)
    return [sorted(group, key=lambda plan: plan.mode) for group in groups]


def _is_alike(one: Plan, two: Plan) -> bool:
    """Whether two cases only name the chains differently: the same choices, in another order, with the same result."""
    if one.machine.name != two.machine.name or one.grid.path.z[0] != two.grid.path.z[0]:
        return False
    if sorted(one.mode.split()) != sorted(two.mode.split()) or one.verdict != two.verdict:
        return False
    if one.is_possible:
        return math.isclose(one.bottleneck, two.bottleneck, rel_tol=ALIKE)
    return one.highest == two.highest and _reason(one) == _reason(two)


def _reason(plan: Plan) -> str:
    """Why it ends, whichever chain it is and at whatever roll."""
    words = re.sub(r"roll [-+.e\d]+", "roll", plan.stopped_by)
    for leg in plan.machine.legs:
        words = words.replace(leg.name, "chain")
    return words
