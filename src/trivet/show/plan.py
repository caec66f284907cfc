"""Ways to a tilt: the grid of tilts and rolls with the way through it, what is left along the way, and the machine on it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.reach.certificate import Demand
from trivet.show.maps import check_suffix
from trivet.show.palette import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION
from trivet.study.plan import Plan, PlanStudy
from trivet.study.roll_grid import Aim, Rules

SERIES = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION, BLACK)
"""Of several plans, the best first; the others are counted only."""
CURVE, WAY = VERMILLION, "#FFFFFF"
NOT_ALLOWED = "#E4E4E4"


class Map(NamedTuple):
    """A grid of poses; rolls go on beyond a turn so that a way stays in one piece."""

    marks: Any
    """(rows,) tilt in degrees, or the number of the pose."""
    rolls: Any
    """(columns,) azimuth + roll, degrees."""
    values: Any
    """(columns, rows); NaN where the pose is not allowed."""
    sigma: Any
    """(columns, rows) sigma_min with the sign of det J_x, whatever limits and bodies."""


class Panel(NamedTuple):
    """What is left along a way."""

    label: str
    """What, and its unit."""
    values: Any
    """(n,)"""
    bound: float
    """What it does not fall below, or must not; NaN where nothing is demanded."""
    said: str
    """Of the bound."""
    colour: str


class Place(NamedTuple):
    """How a place on a way is marked."""

    marker: str
    """Of Matplotlib."""
    symbol: str
    """Of plotly."""
    size: float
    """Points, or pixels: what may lie on another is the smaller one."""
    colour: str


PLACES = {
    "start": Place("o", "circle", 12, WAY),
    "end": Place("s", "square", 11, WAY),
    "worst": Place("D", "diamond", 6, BLACK),
}
"""What is marked on a way; the last on top."""


def draw_plans(study: PlanStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw one plan, as its map and the margins along it, or the values along the best of several.

    Args:
        study: plans.
        path: file to write; .png is a picture, .html a page that needs no network, in which the machine moves along the way.
        overwrite: whether the file may be replaced.
    """
    from trivet.show.plan_page import write_page
    from trivet.show.plan_picture import write_picture

    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (write_picture if suffix == ".png" else write_page)(study, temporary)


def title(study: PlanStudy) -> str:
    """A line above the figure."""
    plan = study.plans[0]
    if len(study.plans) > 1:
        possible = sum(p.is_possible for p in study.plans)
        return f"{possible} of {len(study.plans)} cases have a way" + (
            f"; the best {len(SERIES)}" if possible > len(SERIES) else ""
        )
    where = f"z0 = {plan.grid.path.z[0] * 1e3:g} mm" if plan.grid.poses is None else f"{plan.grid.poses[-1]:g} poses"
    mode = mode_words(plan.mode).replace("-", "−")
    return f"{plan.machine.name}, {mode}, {where}: {plan.verdict}"


def rows_label(study: PlanStudy) -> str:
    """What the horizontal axis is."""
    return "tilt, °" if study.plans[0].grid.poses is None else "pose"


def value_label(rules: Rules, where: str = "") -> str:
    """What a value is, where, and its unit."""
    if len(rules.aims) == 1 and rules.aims[0].unit == 1:
        (aim,) = rules.aims
        return f"{aim.name}{where}, {_unit(aim)}"
    return f"the least{where} of " + ", ".join(f"{aim.name} / {_one(aim)}" for aim in rules.aims)


def _unit(aim: Aim) -> str:
    return "–" if aim.scalar is None else "N m/rad" if aim.scalar.is_rotational else "N/m"


def _one(aim: Aim) -> str:
    """What counts as one."""
    if aim.scalar is None:
        return f"{aim.unit:g}"
    return f"({aim.unit:g} N m/rad)" if aim.scalar.is_rotational else f"({aim.unit / 1e6:g} N/µm)"


def marks(plan: Plan) -> Any:
    """Where the samples along a way are, as the horizontal axis tells it."""
    assert plan.along is not None
    return np.interp(plan.along.rows, np.arange(plan.grid.shape[0]), plan.grid.marks)


def headings(plan: Plan) -> Any:
    """Azimuth + roll (degrees) of the samples along a way."""
    assert plan.along is not None
    return np.degrees(plan.along.touch.azimuth + plan.along.touch.roll)


def places(plan: Plan) -> dict[str, int]:
    """Samples of a way that are marked: its ends, and where its value is least."""
    assert plan.along is not None
    return {"start": 0, "end": len(plan.along.value) - 1, "worst": plan.worst}


def map_of(plan: Plan) -> Map:
    """The grid of a plan."""
    low, high, first = 0, plan.grid.columns + 1, plan.grid.path.azimuth[0] + plan.grid.path.roll[0]
    if plan.along is not None:
        own = (np.radians(headings(plan)) - first) / plan.grid.step
        low = min(low, int(np.floor(own.min())))
        high = max(high, int(np.ceil(own.max())) + 1)
    columns = np.arange(low, high)
    around = columns % plan.grid.columns
    values = np.where(np.isfinite(plan.field.value), plan.field.value, np.nan)
    return Map(
        plan.grid.marks, np.degrees(first + columns * plan.grid.step), values[:, around].T, plan.signed_sigma[:, around].T
    )


def panels(plan: Plan) -> Iterator[Panel]:
    """What is left along a way, each in its own unit; nothing where there is no way."""
    if plan.along is None:
        return
    if [aim.name for aim in plan.rules.aims] != ["sigma_min"]:
        yield Panel("value, –", plan.along.value, np.nan, "", PURPLE)
    demand = Demand(sigma_min=plan.rules.least_sigma) if plan.proof is None else plan.proof.demand
    said = "proven" if plan.is_safe else "demanded"
    yield Panel("sigma_min, –", plan.along.sigma_min, demand.sigma_min or np.nan, said, BLUE)
    has_limits = plan.rules.limits and np.any(plan.along.travel != 1.0)  # of joints without limits all is left, everywhere
    if has_limits and np.isfinite(plan.along.travel).all():
        yield Panel("travel left,\n% of half", 1e2 * plan.along.travel, 0.0, "end of travel", ORANGE)
    if plan.rules.scene is not None and np.isfinite(plan.along.clearance).all():
        said = f"{said}, {1e3 * plan.rules.gap:g} mm" if plan.rules.gap else "touching"
        yield Panel("clearance,\nmm", 1e3 * plan.along.clearance, 1e3 * plan.rules.gap, said, GREEN)


def best_of(study: PlanStudy) -> list[tuple[str, Plan, str]]:
    """Names, plans and colours of the best of several that have a way."""
    possible = [plan for plan in study.plans if plan.is_possible]
    return [(_name(plan), plan, colour) for plan, colour in zip(possible, SERIES, strict=False)]


def _name(plan: Plan) -> str:
    where = f", z0 = {plan.grid.path.z[0] * 1e3:g} mm" if plan.grid.poses is None else ""
    return f"{plan.machine.name} {plan.mode}{where}".replace("-", "−")
