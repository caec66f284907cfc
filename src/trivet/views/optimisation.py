"""The front of an optimisation as tables and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.design.optimisation import Member, Optimisation
from trivet.views.fitted import Fitted
from trivet.views.layout import rest, table, wrapping
from trivet.views.si import finite, key
from trivet.views.sweep import design_json, design_words

SHOWN, BESIDE = 20, 8
"""Members and alternatives of the tables."""


def tables(result: Optimisation) -> Iterator[Any]:
    """The aims, the front with what holds its designs, alternatives, and what other ways say."""
    yield _aims(result)
    yield _front(result, result.members, "designs that no other dominates", "their variables", SHOWN)
    yield _holding(result)
    if result.alternatives:
        yield _front(result, result.alternatives, "dominated designs beside them", "the variables of these", BESIDE)
    yield _again(result)
    yield from _missed(result)
    yield from (f"without a design: {reason}" for reason in result.missing)


def _aims(result: Optimisation) -> str:
    goals = ", ".join(goal.words for goal in result.aims.goals)
    limits = "; ".join(limit.words for limit in result.aims.limits)
    return f"{goals}" + (f"; with {limits}" if limits else "")


def _front(result: Optimisation, members: tuple[Member, ...], title: str, variables: str, most: int) -> Any:
    """A row per design; where that is too wide, a table of quantities, and one of variables that is turned."""
    kinds = [own.kind for own in result.study.quantities]
    heads = [f"{name}\n{kind.symbol}".rstrip() for name, kind in zip(result.columns, kinds, strict=True)]
    names = [variable.name for variable in result.study.variables]
    rows = table(title, "", "machine", *heads, *names, left=2)
    for k in _picked(len(members), most):
        member = members[k]
        values = [kind.number(value) for kind, value in zip(kinds, member.values, strict=True)]
        design = design_words(result.study, member.place, member.design)
        rows.add_row(str(k + 1), result.study.names[member.place], *values, *design)
    return Fitted(rows, names=2, first=len(heads), rest=variables, note=rest(len(members), most))


def _picked(count: int, most: int) -> list[int]:
    """Evenly, both ends among them."""
    return [int(k) for k in np.unique(np.linspace(0, count - 1, min(count, most)).round())] if count else []


def _holding(result: Optimisation) -> Any:
    rows = table("what holds them", "", "machine", "limits and ends of ranges", left=3)
    for k in _picked(len(result.members), SHOWN):
        member = result.members[k]
        held = "; ".join((*member.active, *member.bounds)) or ("nothing: it is at a top" if member.is_polished else "-")
        rows.add_row(str(k + 1), result.study.names[member.place], held)
    return wrapping(rows)


def _again(result: Optimisation) -> str:
    finer = [
        f"{own.name} {100 * worst:.3g} %"
        for k, own in enumerate(result.study.quantities)
        if np.isfinite(worst := _greatest_change(result, k))
    ]
    structural = max((m.structural for m in result.members if np.isfinite(m.structural)), default=np.nan)
    return (
        f"worked out again over twice the lattice and twice the rolls: {', '.join(finer) or 'nothing'} is the greatest change; "
        f"by matrix structural analysis the stiffness differs by {structural:.1e} at most"
    )


def _missed(result: Optimisation) -> Iterator[str]:
    """Limits that do not hold between the check points at which they were asked for."""
    missed = [result.missed(member) for member in result.members]
    for limit in result.aims.limits:
        by = [own[limit] for own in missed if limit in own]
        if by:
            worst = f"{limit.missed(max(by))} at the worst" if np.isfinite(by).all() else f"'{limit.words}'"
            remedy = "take a finer lattice (poses.steps), or ask for more than you need"
            yield f"there {len(by)} of {len(missed)} designs miss {worst}; {remedy}"


def _greatest_change(result: Optimisation, k: int) -> float:
    changes = [abs(m.again[k] / m.values[k] - 1) for m in result.members if m.values[k]]
    return float(np.nanmax(changes)) if np.isfinite(changes).any() else np.nan


def as_json(result: Optimisation) -> dict[str, Any]:
    """The same for programs, in SI."""
    return {
        "maximise": [goal.asked.name for goal in result.aims.goals if goal.sign < 0],
        "minimise": [goal.asked.name for goal in result.aims.goals if goal.sign > 0],
        "limits": [limit.words for limit in result.aims.limits],
        "machines": result.study.names,
        "front": [_member(result, one) for one in result.members],
        "alternatives": [_member(result, one) for one in result.alternatives],
        "missing": list(result.missing),
    }


def _member(result: Optimisation, member: Member) -> dict[str, Any]:
    kinds = [own.kind for own in result.study.quantities]
    keys = [key(name, kind) for name, kind in zip(result.columns, kinds, strict=True)]
    again = member.again if len(member.again) else np.full(len(keys), np.nan)
    return {
        "machine": result.study.names[member.place],
        "design": design_json(result.study, member.place, member.design),
        "quantities": {name: finite(value) for name, value in zip(keys, member.values, strict=True)},
        "finer": {name: finite(value) for name, value in zip(keys, again, strict=True)},
        "missed_over_finer": [limit.words for limit in result.missed(member)] if len(member.again) else [],
        "is_polished": member.is_polished,
        "held_by": [*member.active, *member.bounds],
        "difference_from_structural_analysis": finite(member.structural),
    }
