"""Rolls over a cone of directions, seen from above: tilt outwards, the value in colour, the platform's x axis as strokes."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any

import numpy as np

from trivet.errors import NoResultError
from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.show.maps import check_suffix
from trivet.show.plan import value_label
from trivet.study.cone import ConePlan
from trivet.study.roll_grid import met

STROKES = 12
"""Across the cone."""


def draw_cone(plan: ConePlan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw the rolls over a cone (PNG or self-contained HTML).

    Raises:
        NoResultError: when there are none.
    """
    suffix = check_suffix(path)
    if plan.sheet is None:
        raise NoResultError(f"{plan.machine.name}: no roll is continuous all over the cone, so there is nothing to draw")
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(plan, temporary)


def _title(plan: ConePlan) -> str:
    edge = f"{np.degrees(plan.knots.tilt.max()):.4g}°"
    where = f"every direction up to {edge}, z0 = {plan.knots.z[0, 0] * 1e3:g} mm"
    return f"{plan.machine.name}, {mode_words(plan.mode)}, {where}: {plan.verdict}"


def _nodes(plan: ConePlan) -> tuple[Any, Any, Any, Any]:
    """Azimuth, tilt, value and alpha + roll at the nodes, rad."""
    flat = type(plan.knots)(*(np.ravel(c) for c in plan.knots))
    value = met(plan.rules, flat, np.zeros(len(flat.roll))).value.reshape(plan.knots.roll.shape)
    return plan.knots.azimuth, plan.knots.tilt, value, plan.knots.azimuth + plan.knots.roll


def _picture(plan: ConePlan, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    azimuth, tilt, value, heading = _nodes(plan)
    canvas = Figure(figsize=(7.4, 6.8), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle(_title(plan), x=0.02, ha="left", fontsize=11)
    axes = canvas.subplots()
    x, y = np.degrees(tilt) * np.cos(azimuth), np.degrees(tilt) * np.sin(azimuth)
    mesh = axes.pcolormesh(x, y, value, shading="gouraud", cmap="cividis", vmin=0)
    rays = slice(None, -1, max(1, (len(azimuth) - 1) // STROKES))
    rows = slice(None, None, max(1, tilt.shape[1] // (STROKES // 2)))
    spread = np.degrees(tilt.max()) / STROKES
    own = heading[rays, rows]
    axes.quiver(
        x[rays, rows], y[rays, rows], np.cos(own), np.sin(own), color="white", angles="xy", scale_units="xy", scale=1 / spread,
        width=0.004,
    )  # fmt: skip
    axes.plot(x[:, -1], y[:, -1], color="black", linewidth=1.5, label="edge of the cone")
    k = np.unravel_index(int(value.argmin()), value.shape)
    axes.plot(
        x[k], y[k], "D", color="black", markerfacecolor="white", markersize=8, linestyle="", label=f"worst, {value[k]:.3g}"
    )
    axes.plot([], [], color="grey", marker=">", label="x axis of the platform, seen from above")
    canvas.legend(loc="outside lower left", frameon=False, fontsize=9, ncols=3)
    canvas.colorbar(mesh, ax=axes, shrink=0.8, label=value_label(plan.rules))
    axes.set_aspect("equal")
    axes.set_xlabel("tilt towards x (azimuth 0°), °")
    axes.set_ylabel("tilt towards y (azimuth 90°), °")
    canvas.savefig(path, format="png", dpi=120)


def _page(plan: ConePlan, path: Path) -> None:
    import plotly.graph_objects as go

    azimuth, tilt, value, heading = (np.degrees(a).ravel() if k != 2 else a.ravel() for k, a in enumerate(_nodes(plan)))
    name = html.escape(value_label(plan.rules))
    page = go.Figure(
        go.Scatterpolar(
            r=tilt, theta=azimuth, mode="markers", customdata=np.stack([heading % 360, value], axis=1),
            marker={
                "color": value, "colorscale": "Cividis", "cmin": 0, "cmax": value.max(), "size": 9, "colorbar": {"title": name},
            },
            hovertemplate="azimuth %{theta:.4g}°, tilt %{r:.4g}°<br>azimuth + roll %{customdata[0]:.4g}°<br>"
            "%{customdata[1]:.4g}<extra></extra>",
        )
    )  # fmt: skip
    edge, line = np.linspace(0, 360, 181), {"color": "black", "width": 1.5}
    page.add_scatterpolar(r=np.full(len(edge), tilt.max()), theta=edge, mode="lines", line=line, name="edge of the cone")
    k = int(value.argmin())
    marker = {"symbol": "diamond", "size": 12, "color": "white", "line": line}
    page.add_scatterpolar(r=[tilt[k]], theta=[azimuth[k]], mode="markers", marker=marker, name=f"worst, {value[k]:.3g}")
    page.update_traces(showlegend=False, selector=0)
    page.update_layout(
        title=html.escape(_title(plan)), template="simple_white", height=720, width=820, legend={"orientation": "h", "y": 1.05},
        polar={"radialaxis": {"title": "tilt, °"}},
    )  # fmt: skip
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True)
