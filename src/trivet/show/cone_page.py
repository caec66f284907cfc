"""A cone of directions as a page that needs no network."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import numpy as np

from trivet.show.cone import ROOM, Disc, compass, title
from trivet.show.palette import BLACK
from trivet.show.plan import WAY, value_label
from trivet.study.cone import ConePlan


def write_page(plan: ConePlan, disc: Disc, path: Path) -> None:
    """Write the cone seen from above."""
    import plotly.graph_objects as go

    page = go.Figure()
    page.add_heatmap(
        x=disc.across, y=disc.across, z=np.where(disc.inside, disc.value, np.nan).astype(np.float32), colorscale="Cividis",
        zmin=0, zmax=float(disc.value[disc.inside].max()), name="value",
        colorbar={"title": html.escape(value_label(plan.rules)), "thickness": 14, "len": 0.8},
        hovertemplate="tilt towards x %{x:.3g}°, towards y %{y:.3g}°: %{z:.4g}<extra></extra>",
    )  # fmt: skip
    _arrows(disc, page)
    around = np.linspace(0, 2 * np.pi, 181)
    page.add_scatter(
        x=disc.edge * np.cos(around), y=disc.edge * np.sin(around), mode="lines", line={"color": BLACK, "width": 4},
        name="edge of the cone", hoverinfo="skip",
    )  # fmt: skip
    for name, symbol, (x, y) in (("level", "cross-thin", (0.0, 0.0)), (f"worst, {disc.least:.3g}", "diamond", disc.worst)):
        marker = {"symbol": symbol, "size": 12, "color": WAY, "line": {"color": BLACK, "width": 2}}
        page.add_scatter(x=[x], y=[y], mode="markers", marker=marker, name=name)
    for name, x, y, side, height in compass(disc):
        up = "middle" if height == "center" else height
        page.add_annotation(x=x, y=y, text=name, showarrow=False, xanchor=side, yanchor=up)
    axis: dict[str, Any] = {"range": [-ROOM * disc.edge, ROOM * disc.edge], "constrain": "domain"}
    page.update_layout(
        title={"text": html.escape(title(plan, disc)), "x": 0.02, "font": {"size": 17}}, template="simple_white",
        legend={"orientation": "h", "x": 0, "y": 1.01, "yanchor": "bottom"}, margin={"t": 110},
        xaxis={"title": "tilt towards x, °", **axis}, yaxis={"title": "tilt towards y, °", "scaleanchor": "x", **axis},
    )  # fmt: skip
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="94vh")


def _arrows(disc: Disc, page: Any) -> None:
    name = "x axis of the platform, seen from above"
    gap = np.full((len(disc.arrows), 1), np.nan)
    x, y = (np.concatenate([disc.arrows[..., k], gap], axis=1).ravel() for k in (0, 1))
    tips = {"symbol": "arrow", "size": np.tile((0, 9, 0), len(disc.arrows)), "angleref": "previous", "color": WAY, "opacity": 1}
    line = {"color": WAY, "width": 1.5}
    page.add_scatter(x=x, y=y, mode="lines+markers", line=line, marker=tips, hoverinfo="skip", showlegend=False, name=name)
    sample = {"symbol": "triangle-right", "size": 10, "color": "grey"}
    page.add_scatter(x=[None], y=[None], mode="lines+markers", marker=sample, name=name)
