"""Plans as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trivet.show.maps import EXCLUDED
from trivet.show.plan import (
    CURVE,
    GRID,
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
_LEGEND = {"loc": "lower left", "bbox_to_anchor": (-0.01, 1.0), "frameon": False, "fontsize": 9, "handlelength": 1.8}


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
            _margin(panel, marks(plan), own)
        if rows:
            axes[-1].set_title("dashed: what is demanded", loc="right", fontsize=8, pad=2)
    axes[-1].set_xlabel(rows_label(study))
    canvas.savefig(path, format="png", dpi=120)


def _margin(panel: Panel, across: Any, axes: Any) -> None:
    _plain(axes)
    axes.plot(across, panel.values, color=panel.colour)
    axes.axhline(panel.demanded, color="black", linewidth=0.8, linestyle="--")
    k = int(np.argmin(panel.values))
    least, is_late = float(panel.values[k]), across[k] > (across[0] + across[-1]) / 2
    axes.plot(across[k], least, "D", color=panel.colour, markersize=6, markerfacecolor="white")
    axes.annotate(
        f"{least:.3g}", (across[k], least), (-9 if is_late else 9, 5), textcoords="offset points",
        ha="right" if is_late else "left", fontsize=9,
    )  # fmt: skip
    axes.set_ylabel(panel.label, fontsize=9)
    axes.set_ylim(min(0.0, least), 1.08 * float(np.nanmax([*panel.values, panel.demanded])))


def _plain(axes: Any) -> None:
    axes.grid(color=GRID)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _map(plan: Plan, axes: Any) -> Any:
    from matplotlib.colors import ListedColormap

    seen = map_of(plan)
    grey = ListedColormap([EXCLUDED])
    axes.pcolormesh(seen.marks, seen.rolls, np.ones_like(seen.values), cmap=grey, shading="nearest", alpha=0.35)
    mesh = axes.pcolormesh(seen.marks, seen.rolls, seen.values, cmap="cividis", shading="nearest", vmin=0)
    if np.nanmin(seen.sigma, initial=1.0) < 0 < np.nanmax(seen.sigma, initial=-1.0):
        axes.contour(seen.marks, seen.rolls, seen.sigma, levels=[0.0], colors=CURVE, linewidths=1.8)
        axes.plot([], [], color=CURVE, label="Type 2 singularity (det J_x = 0)")
    if plan.along is not None:
        across, up = marks(plan), headings(plan)
        axes.plot(across, up, color="black", linewidth=4)
        axes.plot(across, up, color=WAY, linewidth=2)
        for name, k in places(plan).items():
            axes.plot(
                across[k], up[k], PLACES[name][0], color="black", markerfacecolor=WAY, markersize=8, label=name, linestyle=""
            )
    axes.plot([], [], color=EXCLUDED, linewidth=7, alpha=0.35, label="not allowed")
    axes.set_ylabel("azimuth + roll, °")
    axes.legend(ncols=5, **_LEGEND)
    return mesh


def _lines(study: PlanStudy, axes: Any) -> None:
    _plain(axes)
    for (name, plan, colour), dashes in zip(best_of(study), DASHES, strict=False):
        assert plan.along is not None
        axes.plot(marks(plan), plan.along.value, color=colour, linestyle=dashes, label=name)
        axes.plot(marks(plan)[plan.worst], plan.along.value[plan.worst], "D", color=colour, markerfacecolor="white")
    axes.set_ylabel(f"{value_label(study.plans[0].rules)} along the way")
    axes.set_ylim(bottom=0)
    if axes.lines:
        axes.legend(ncols=3, **_LEGEND)
