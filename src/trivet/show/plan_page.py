"""Plans as a page that needs no network, with the machine moving along the way."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import numpy as np

from trivet.show.palette import BLACK, GRID
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
from trivet.show.plan_motion import add_motion
from trivet.study.plan import Plan, PlanStudy

DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
_BESIDE = {"len": 0.5, "x": 0.575, "y": 1.0, "yanchor": "top"}
"""Where the colour bar is where the machine is seen as well."""


def write_page(study: PlanStudy, path: Path) -> None:
    """Write one plan as its map, its margins and the moving machine, or the values along several."""
    page = _of_one(study) if len(study.plans) == 1 else _of_several(study)
    page.update_layout(
        title={"text": html.escape(title(study)), "font": {"size": 17}, "x": 0.02},
        template="simple_white",
        legend={"orientation": "h", "x": 0, "y": 1.015, "yanchor": "bottom"},
        margin={"t": 110, "b": 60, "l": 80, "r": 20},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="94vh", auto_play=False)


def _of_several(study: PlanStudy) -> Any:
    import plotly.graph_objects as go

    page = go.Figure()
    for (name, plan, colour), dash in zip(best_of(study), DASHES, strict=False):
        assert plan.along is not None
        line = {"color": colour, "width": 2, "dash": dash}
        page.add_scatter(x=marks(plan), y=plan.along.value, mode="lines", name=html.escape(name), line=line)
    for k, (name, plan, colour) in enumerate(best_of(study)):
        marker = {"symbol": "diamond", "size": 10, "color": WAY, "line": {"color": colour, "width": 2}}
        page.add_scatter(
            x=[marks(plan)[plan.worst]], y=[plan.value], mode="markers", marker=marker, cliponaxis=False, name="worst",
            legendgroup="worst", showlegend=k == 0, hovertext=html.escape(name),
        )  # fmt: skip
    page.update_xaxes(title_text=rows_label(study), gridcolor=GRID, showgrid=True)
    page.update_yaxes(title_text=html.escape(value_label(study.plans[0].rules, " along the way")), rangemode="tozero")
    page.update_yaxes(gridcolor=GRID, showgrid=True)
    return page


def _of_one(study: PlanStudy) -> Any:
    from plotly.subplots import make_subplots

    (plan,) = study.plans
    found = list(panels(plan))
    rows, is_moving = 1 + len(found), plan.along is not None
    specs: list[list[Any]] = [[{}] + [None] * is_moving for _ in range(rows)]
    if is_moving:
        specs[0][1] = {"type": "scene", "rowspan": rows}
    page = make_subplots(
        rows=rows, cols=1 + is_moving, specs=specs, shared_xaxes=True, vertical_spacing=0.035, horizontal_spacing=0.09,
        row_heights=[0.55] + [0.45 / len(found)] * len(found) if found else [1.0],
        column_widths=[0.56, 0.44] if is_moving else [1.0],
    )  # fmt: skip
    _map(plan, page)
    for row, panel in enumerate(found, start=2):
        _margin(plan, panel, page, row)
    page.update_xaxes(title_text=rows_label(study), row=rows, col=1)
    if is_moving:
        add_motion(plan, page)
    return page


def _margin(plan: Plan, panel: Panel, page: Any, row: int) -> None:
    across, k = marks(plan), int(np.argmin(panel.values))
    at = {"row": row, "col": 1}
    page.add_vline(x=across[plan.worst], opacity=1, line={"color": BLACK, "width": 1, "dash": "dot"}, **at)
    page.add_scatter(
        x=across, y=panel.values, mode="lines", line={"color": panel.colour, "width": 2}, showlegend=False,
        name=panel.label.replace("\n", " "), **at,
    )  # fmt: skip
    if np.isfinite(panel.bound):
        word = {"annotation_text": panel.said, "annotation_position": "top right", "annotation_font_size": 11}
        page.add_hline(y=panel.bound, opacity=1, line={"color": BLACK, "width": 1, "dash": "dash"}, **word, **at)
    marker = {"symbol": "diamond", "size": 9, "color": WAY, "line": {"color": panel.colour, "width": 2}}
    page.add_scatter(
        x=[across[k]], y=[panel.values[k]], mode="markers", marker=marker, showlegend=False, cliponaxis=False,
        name=f"least {panel.values[k]:.3g}", **at,
    )  # fmt: skip
    page.update_yaxes(title_text=panel.label.replace("\n", "<br>"), rangemode="tozero", gridcolor=GRID, showgrid=True, **at)


def _map(plan: Plan, page: Any) -> None:
    seen, at = map_of(plan), {"row": 1, "col": 1}
    page.add_shape(
        type="rect",
        x0=0,
        x1=1,
        y0=0,
        y1=1,
        xref="x domain",
        yref="y domain",
        layer="below",
        fillcolor=NOT_ALLOWED,
        opacity=1,
        line_width=0,
    )
    greatest = float(np.nanmax(seen.values, initial=0.0))
    page.add_heatmap(
        x=seen.marks, y=seen.rolls, z=seen.values.astype(np.float32), colorscale="Cividis", zmin=0, zmax=greatest or 1.0,
        colorbar={"title": html.escape(value_label(plan.rules)), "thickness": 12} | (_BESIDE if plan.along is not None else {}),
        hovertemplate="%{x:.4g}, azimuth + roll %{y:.4g}°: %{z:.4g}<extra></extra>", **at,
    )  # fmt: skip
    page.update_xaxes(range=[seen.marks[0], seen.marks[-1]])
    page.update_yaxes(title_text="azimuth + roll, °", range=[seen.rolls[0], seen.rolls[-1]], **at)
    square = {"symbol": "square", "size": 12, "color": NOT_ALLOWED, "line": {"color": "grey", "width": 1}}
    page.add_scatter(x=[None], y=[None], name="not allowed", mode="markers", marker=square, **at)
    if np.nanmin(seen.sigma, initial=1.0) < 0 < np.nanmax(seen.sigma, initial=-1.0):
        for colour, width in ((WAY, 4), (CURVE, 2.2)):
            page.add_contour(
                x=seen.marks, y=seen.rolls, z=seen.sigma.astype(np.float32), line={"color": colour, "width": width},
                contours={"start": 0, "end": 0, "size": 1, "coloring": "none"}, hoverinfo="skip", showlegend=False,
                showscale=False, **at,
            )  # fmt: skip
        line = {"color": CURVE, "width": 2.2}
        page.add_scatter(x=[None], y=[None], name="Type 2 singularity (det J_x = 0)", mode="lines", line=line, **at)
    if plan.along is None:
        return
    across, up = marks(plan), headings(plan)
    for colour, width in ((BLACK, 5), (WAY, 2.5)):
        line, look = {"color": colour, "width": width}, {"name": "way", "showlegend": colour == BLACK, "hoverinfo": "skip"}
        page.add_scatter(x=across, y=up, mode="lines", line=line, **look, **at)
    for name, k in places(plan).items():
        place = PLACES[name]
        marker = {"symbol": place.symbol, "size": place.size, "color": place.colour, "line": {"color": BLACK, "width": 1.5}}
        page.add_scatter(x=[across[k]], y=[up[k]], mode="markers", marker=marker, name=name, cliponaxis=False, **at)
