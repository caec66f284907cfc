"""Plans as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trivet.show.palette import GRID
from trivet.show.plan import (
    CURVE,
    NOT_ALLOWED,
    PLACES,
    WAY,
    Panel,
    best_of,
    headings,
    map_of,
    marks,
    panels,
    places,
    rows_label,
    title,
    value_label,
)
from trivet.study.plan import Plan, PlanStudy

DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1.5, 2)), (0, (1, 1)), (0, (9, 3)))
_LEGEND = {
    "loc": "lower left",
    "bbox_to_anchor": (-0.01, 1.0),
    "frameon": False,
    "fontsize": 9,
    "handlelength": 1.8,
    "columnspacing": 1.2,
}


def write_picture(study: PlanStudy, path: Path) -> None:
    """Write one plan as its map and margins, or the values along several."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = list(panels(study.plans[0])) if len(study.plans) == 1 else []
    canvas = Figure(figsize=(9, 5.4 + 1.35 * len(rows)), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle(title(study), x=0.02, ha="left", fontsize=12)
    axes: Any = canvas.subplots(1 + len(rows), 1, sharex=True, squeeze=False, height_ratios=[4.0] + [1.1] * len(rows))[:, 0]
    if len(study.plans) > 1:
        _lines(study, axes[0])
    else:
        (plan,) = study.plans
        mesh = _map(plan, axes[0])
        canvas.colorbar(mesh, ax=axes[0], label=value_label(plan.rules), pad=0.01)
        for panel, own in zip(rows, axes[1:], strict=True):
            _margin(panel, marks(plan), plan.worst, own)
    axes[-1].set_xlabel(rows_label(study))
    if study.plans[0].grid.poses is not None:
        axes[-1].xaxis.get_major_locator().set_params(integer=True)
    canvas.savefig(path, format="png", dpi=120)


def _margin(panel: Panel, across: Any, worst: int, axes: Any) -> None:
    from matplotlib.patheffects import withStroke

    _plain(axes)
    axes.axvline(across[worst], color="black", linewidth=0.8, linestyle=":")
    axes.plot(across, panel.values, color=panel.colour, linewidth=1.8, clip_on=False)
    if np.isfinite(panel.bound):
        axes.axhline(panel.bound, color="black", linewidth=0.8, linestyle="--", clip_on=False)
        word = axes.annotate(
            panel.said, (across[-1], panel.bound), (-4, 3), textcoords="offset points", ha="right", fontsize=8, zorder=6
        )
        word.set_path_effects([withStroke(linewidth=3, foreground="white")])
    k = int(np.argmin(panel.values))
    least = float(panel.values[k])
    axes.plot(across[k], least, "D", color=panel.colour, markersize=6, markerfacecolor="white", clip_on=False, zorder=5)
    # Beside the axes, where the scale of the map leaves room.
    axes.text(1.015, 0.5, f"least\n{least:.3g}", transform=axes.transAxes, va="center", fontsize=9, in_layout=False)
    axes.set_ylabel(panel.label, fontsize=9)
    axes.set_ylim(min(0.0, least), 1.12 * float(np.nanmax([*panel.values, panel.bound])))


def _plain(axes: Any) -> None:
    axes.grid(color=GRID)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _map(plan: Plan, axes: Any) -> Any:
    from matplotlib.patches import Patch
    from matplotlib.patheffects import withStroke

    seen = map_of(plan)
    axes.set_facecolor(NOT_ALLOWED)
    mesh = axes.pcolormesh(seen.marks, seen.rolls, seen.values, cmap="cividis", shading="nearest", vmin=0)
    listed: list[Any] = [Patch(facecolor=NOT_ALLOWED, edgecolor="grey", linewidth=0.6, label="not allowed")]
    if np.nanmin(seen.sigma, initial=1.0) < 0 < np.nanmax(seen.sigma, initial=-1.0):
        curve = axes.contour(seen.marks, seen.rolls, seen.sigma, levels=[0.0], colors=CURVE, linewidths=2)
        curve.set_path_effects([withStroke(linewidth=3.6, foreground="white")])
        listed += axes.plot([], [], color=CURVE, linewidth=2, label="Type 2 singularity (det J_x = 0)")
    if plan.along is not None:
        across, up = marks(plan), headings(plan)
        look = [withStroke(linewidth=4, foreground="black")]
        listed += axes.plot(across, up, color=WAY, linewidth=2, path_effects=look, label="way")
        for name, k in places(plan).items():
            place = PLACES[name]
            listed += axes.plot(
                across[k], up[k], place.marker, color="black", markerfacecolor=place.colour, markersize=0.8 * place.size,
                label=name, linestyle="", clip_on=False, zorder=5,
            )  # fmt: skip
    axes.set_xlim(seen.marks[0], seen.marks[-1])
    axes.set_ylim(seen.rolls[0], seen.rolls[-1])
    axes.set_ylabel("azimuth + roll, °")
    axes.legend(handles=listed, ncols=len(listed), **_LEGEND)
    return mesh


def _lines(study: PlanStudy, axes: Any) -> None:
    _plain(axes)
    for (name, plan, colour), dashes in zip(best_of(study), DASHES, strict=False):
        assert plan.along is not None
        axes.plot(marks(plan), plan.along.value, color=colour, linestyle=dashes, linewidth=1.8, label=name)
        axes.plot(marks(plan)[plan.worst], plan.along.value[plan.worst], "D", color=colour, markerfacecolor="white")
    axes.set_ylabel(value_label(study.plans[0].rules, " along the way"))
    axes.set_ylim(bottom=0)
    if axes.lines:
        axes.plot([], [], "D", color="grey", markerfacecolor="white", label="worst")
        axes.legend(ncols=3, **_LEGEND)
