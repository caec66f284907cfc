"""Ways to a tilt: the grid of tilts and rolls with the way through it, and what is left along the way."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.show.maps import EXCLUDED, check_suffix
from trivet.show.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from trivet.study.plan import Plan, PlanStudy

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)
CURVE, WAY, GRID = "#C8102E", "#FFFFFF", "#EBEBEB"
MOST_LINES = 6


class Line(NamedTuple):
    """A line of the lower picture: what is left along a way."""

    name: str
    tilt: Any
    value: Any
    colour: str


def draw_plans(study: PlanStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw the map and the margins of one plan, or the values along the best of several (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(study, temporary)


def _title(study: PlanStudy) -> str:
    plan = study.plans[0]
    if len(study.plans) > 1:
        return f"{sum(p.is_possible for p in study.plans)} of {len(study.plans)} cases have a way"
    words = "proven" if plan.is_safe else ("not proven" if plan.is_possible else "no way")
    where = f"z0 = {plan.grid.path.z[0] * 1e3:g} mm" if plan.grid.poses is None else f"{plan.grid.poses[-1]:g} poses"
    return f"{plan.machine.name}, {mode_words(plan.mode)}, {where}: {words}"


def _axis(study: PlanStudy) -> str:
    return "tilt, °" if study.plans[0].grid.poses is None else "pose"


def _marks(plan: Plan) -> Any:
    """Where the samples along a way are, as the horizontal axis tells it."""
    assert plan.along is not None
    return np.interp(plan.along.rows, np.arange(plan.grid.shape[0]), plan.grid.marks)


def _map(plan: Plan) -> tuple[Any, Any, Any, Any]:
    """Marks of the rows, azimuth + roll in degrees, values and sides; the rolls go on so that a way stays in one piece."""
    low, high, first = 0, plan.grid.columns, plan.grid.path.azimuth[0] + plan.grid.path.roll[0]
    if plan.knots is not None:
        own = (plan.knots.azimuth + plan.knots.roll - first) / plan.grid.step
        low = min(low, int(np.floor(own.min())))
        high = max(high, int(np.ceil(own.max())) + 1)
    columns = np.arange(low, high)
    rolls = np.degrees(first + columns * plan.grid.step)
    values = np.where(np.isfinite(plan.field.value), plan.field.value, np.nan)
    return (
        plan.grid.marks,
        rolls,
        values[:, columns % plan.grid.columns],
        plan.sides[:, columns % plan.grid.columns],
    )


def _lines(study: PlanStudy) -> tuple[str, list[Line]]:
    """What the vertical axis is, and the lines."""
    if len(study.plans) == 1:
        (plan,) = study.plans
        if plan.along is None:
            return "", []
        tilt, found = _marks(plan), [Line("sigma_min", None, plan.along.sigma_min, BLUE)]
        if plan.rules.limits:
            found.append(Line("travel left, of half a joint's travel", None, plan.along.travel, ORANGE))
        if plan.rules.scene is not None and np.isfinite(plan.along.clearance).all():
            found.append(Line("clearance, cm", None, plan.along.clearance * 1e2, GREEN))
        return "left along the way", [line._replace(tilt=tilt) for line in found]
    lines = []
    for plan, colour in zip([p for p in study.plans if p.is_possible], SERIES, strict=False):
        assert plan.along is not None
        name = f"{plan.machine.name} {plan.mode}, z0 = {plan.grid.path.z[0] * 1e3:g} mm"
        lines.append(Line(name, _marks(plan), plan.along.value, colour))
    return "value along the way", lines


def _picture(study: PlanStudy, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

    label, lines = _lines(study)
    is_one = len(study.plans) == 1
    canvas = Figure(figsize=(9, 8.4 if is_one and lines else 5.6), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle(_title(study), x=0.02, ha="left", fontsize=11)
    panels = canvas.subplots(
        1 + (is_one and bool(lines)), 1, squeeze=False, height_ratios=[3, 2][: 1 + (is_one and bool(lines))]
    )
    if is_one:
        (plan,), axes = study.plans, panels[0, 0]
        tilt, roll, values, sides = _map(plan)
        axes.pcolormesh(tilt, roll, np.ones_like(values.T), cmap=ListedColormap([EXCLUDED]), shading="nearest", alpha=0.35)
        mesh = axes.pcolormesh(tilt, roll, values.T, cmap="cividis", shading="nearest", vmin=0)
        if np.nanmin(sides, initial=1.0) < 0 < np.nanmax(sides, initial=-1.0):
            axes.contour(tilt, roll, np.nan_to_num(sides).T, levels=[0.0], colors=CURVE, linewidths=1.5)
            axes.plot([], [], color=CURVE, label="det J_x changes sign")
        if plan.along is not None:
            own = np.degrees(plan.along.touch.azimuth + plan.along.touch.roll)
            axes.plot(_marks(plan), own, color="black", linewidth=4)
            axes.plot(_marks(plan), own, color=WAY, linewidth=2, label="the way")
        axes.set_ylabel("azimuth + roll, °")
        axes.set_xlabel(_axis(study))
        axes.plot([], [], color=EXCLUDED, linewidth=6, alpha=0.35, label="not allowed")
        axes.legend(fontsize=9, loc="upper right", facecolor="#D0D0D0")
        canvas.colorbar(mesh, ax=axes, label=" and ".join(aim.name for aim in plan.rules.aims))
    if lines or not is_one:
        axes = panels[-1, 0]
        axes.grid(color=GRID)
        axes.spines[["top", "right"]].set_visible(False)
        for line in lines:
            axes.plot(line.tilt, line.value, color=line.colour, label=line.name)
        axes.set_xlabel(_axis(study))
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0)
        axes.legend(frameon=False, fontsize=9)
    canvas.savefig(path, format="png", dpi=120)


def _page(study: PlanStudy, path: Path) -> None:
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    label, lines = _lines(study)
    is_one = len(study.plans) == 1
    page = make_subplots(rows=1 + is_one, cols=1, vertical_spacing=0.12)
    if is_one:
        (plan,) = study.plans
        tilt, roll, values, sides = _map(plan)
        name = " and ".join(aim.name for aim in plan.rules.aims)
        page.add_trace(
            go.Heatmap(
                x=tilt, y=roll, z=values.T, colorscale="Cividis", zmin=0, colorbar={"title": name, "len": 0.5, "y": 0.78},
                hovertemplate="%{x:.4g}, azimuth + roll %{y:.4g}°: %{z:.4g}<extra></extra>",
            ), row=1, col=1,
        )  # fmt: skip
        page.add_trace(
            go.Contour(
                x=tilt, y=roll, z=np.nan_to_num(sides).T, contours={"start": 0, "end": 0, "size": 1, "coloring": "lines"},
                colorscale=[[0, CURVE], [1, CURVE]], showscale=False, name="det J_x changes sign", hoverinfo="skip",
            ), row=1, col=1,
        )  # fmt: skip
        if plan.along is not None:
            own = np.degrees(plan.along.touch.azimuth + plan.along.touch.roll)
            style = {"color": WAY, "width": 4}
            page.add_trace(
                go.Scatter(x=_marks(plan), y=own, line=style, mode="lines", name="the way"),
                row=1,
                col=1,
            )
        page.update_yaxes(title_text="azimuth + roll, °", row=1, col=1)
    for line in lines:
        style = {"color": line.colour, "width": 2}
        page.add_trace(
            go.Scatter(x=line.tilt, y=line.value, name=html.escape(line.name), line=style, mode="lines"), row=1 + is_one, col=1
        )
    page.update_yaxes(title_text=label, rangemode="tozero", row=1 + is_one, col=1)
    page.update_xaxes(title_text=_axis(study))
    page.update_layout(title=html.escape(_title(study)), template="simple_white")
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")
