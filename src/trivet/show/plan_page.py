"""Plans as a page that needs no network, with the machine moving along the way."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import jax
import numpy as np

from trivet.show.maps import EXCLUDED
from trivet.show.palette import BLACK, BLUE, SKY
from trivet.show.plan import (
    CURVE,
    GRID,
    PLACES,
    WAY,
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
from trivet.show.sticks import sticks
from trivet.study.plan import Plan, PlanStudy
from trivet.study.roll_grid import degrees_of, frames_of, some

MOST_FRAMES = 60
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
_STEP = 60
"""Time that a frame is shown, ms."""
_BESIDE = {"len": 0.45, "y": 0.78, "x": 0.565}
"""Where the colour bar is beside the machine."""
_NO_TICKS = {"ticklen": 0, "minorticklen": 0, "font": {"color": "rgba(0,0,0,0)"}}
"""Of a slider: its steps are told above it, one at a time."""


def write_page(study: PlanStudy, path: Path) -> None:
    """Write one plan as its map, its margins and the moving machine, or the values along several."""
    page = _of_one(study) if len(study.plans) == 1 else _of_several(study)
    page.update_layout(
        title={"text": html.escape(title(study)), "font": {"size": 17}, "x": 0.02},
        template="simple_white",
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        margin={"t": 110, "b": 60, "l": 80, "r": 20},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh", auto_play=False)


def _of_several(study: PlanStudy) -> Any:
    import plotly.graph_objects as go

    page = go.Figure()
    for (name, plan, colour), dash in zip(best_of(study), DASHES, strict=False):
        assert plan.along is not None
        page.add_scatter(
            x=marks(plan),
            y=plan.along.value,
            mode="lines",
            name=html.escape(name),
            line={"color": colour, "width": 2, "dash": dash},
        )
    page.update_xaxes(title_text=rows_label(study))
    page.update_yaxes(title_text=f"{value_label(study.plans[0].rules)} along the way", rangemode="tozero")
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
        rows=rows, cols=1 + is_moving, specs=specs, shared_xaxes=True, vertical_spacing=0.04, horizontal_spacing=0.06,
        row_heights=[0.5] + [0.5 / len(found)] * len(found) if found else [1.0],
        column_widths=[0.58, 0.42] if is_moving else [1.0],
    )  # fmt: skip
    _map(plan, page)
    for row, panel in enumerate(found, start=2):
        page.add_scatter(
            x=marks(plan), y=panel.values, mode="lines", line={"color": panel.colour, "width": 2}, showlegend=False,
            name=panel.label.replace("\n", " "), row=row, col=1,
        )  # fmt: skip
        if np.isfinite(panel.demanded):
            page.add_hline(y=panel.demanded, line={"color": BLACK, "width": 1, "dash": "dash"}, row=row, col=1)
        page.update_yaxes(title_text=panel.label.replace("\n", "<br>"), rangemode="tozero", gridcolor=GRID, row=row, col=1)
    page.update_xaxes(title_text=rows_label(study), row=rows, col=1)
    if is_moving:
        _move(plan, page)
    return page


def _map(plan: Plan, page: Any) -> None:
    seen = map_of(plan)
    page.add_heatmap(
        x=seen.marks, y=seen.rolls, z=np.ones_like(seen.values), colorscale=[[0, EXCLUDED], [1, EXCLUDED]], opacity=0.35,
        showscale=False, hoverinfo="skip", row=1, col=1,
    )  # fmt: skip
    greatest = float(np.nanmax(seen.values, initial=0.0))
    page.add_heatmap(
        x=seen.marks, y=seen.rolls, z=seen.values, colorscale="Cividis", zmin=0, zmax=greatest or 1.0, row=1, col=1,
        colorbar={"title": html.escape(value_label(plan.rules)), "thickness": 12} | (_BESIDE if plan.along is not None else {}),
        hovertemplate="%{x:.4g}, azimuth + roll %{y:.4g}°: %{z:.4g}<extra></extra>",
    )  # fmt: skip
    page.update_xaxes(range=[seen.marks[0], seen.marks[-1]])
    page.update_yaxes(title_text="azimuth + roll, °", row=1, col=1)
    excluded = {"symbol": "square", "size": 12, "color": EXCLUDED, "opacity": 0.5}
    for name, look in (
        ("Type 2 singularity (det J_x = 0)", {"mode": "lines", "line": {"color": CURVE, "width": 2}}),
        ("not allowed", {"mode": "markers", "marker": excluded}),
    ):
        page.add_scatter(x=[None], y=[None], name=name, row=1, col=1, **look)
    page.add_contour(
        x=seen.marks, y=seen.rolls, z=seen.sigma, contours={"start": 0, "end": 0, "size": 1, "coloring": "none"},
        line={"color": CURVE, "width": 2}, hoverinfo="skip", showlegend=False, showscale=False, row=1, col=1,
    )  # fmt: skip
    if plan.along is None:
        return
    across, up = marks(plan), headings(plan)
    for colour, width in ((BLACK, 5), (WAY, 2.5)):
        page.add_scatter(
            x=across,
            y=up,
            mode="lines",
            line={"color": colour, "width": width},
            showlegend=False,
            hoverinfo="skip",
            row=1,
            col=1,
        )
    for name, k in places(plan).items():
        marker = {"symbol": PLACES[name][1], "size": 10, "color": WAY, "line": {"color": BLACK, "width": 1.5}}
        page.add_scatter(x=[across[k]], y=[up[k]], mode="markers", marker=marker, name=name, row=1, col=1)


def _move(plan: Plan, page: Any) -> None:
    """The machine as lines, a dot on the map, and a slider that moves both."""
    import plotly.graph_objects as go

    assert plan.along is not None
    touch, rules = plan.along.touch, plan.rules
    samples = np.unique(np.linspace(0, len(touch.roll) - 1, MOST_FRAMES).round().astype(int))
    poses = frames_of(touch, rules.radius)
    drawn = [sticks(plan.machine, jax.tree.map(float, some(poses, int(k))), rules.signs) for k in samples]
    across, up = marks(plan), headings(plan)
    if rules.radius > 0:
        page.add_trace(_ball(plan), row=1, col=2)
    first = len(page.data)
    page.add_trace(_line(drawn[0][:-1], BLUE, "chains"), row=1, col=2)
    page.add_trace(_line(drawn[0][-1:], SKY, "platform"), row=1, col=2)
    page.add_trace(_dot(across[0], up[0]), row=1, col=1)
    steps = []
    frames = []
    for k, lines in zip(samples.tolist(), drawn, strict=True):
        data = [_line(lines[:-1], BLUE, "chains"), _line(lines[-1:], SKY, "platform"), _dot(across[k], up[k])]
        frames.append(go.Frame(data=data, traces=[first, first + 1, first + 2], name=str(k)))
        now = {"frame": {"duration": 0, "redraw": True}, "mode": "immediate"}
        where = "" if plan.grid.poses is None else f"{plan.grid.mark(plan.along.rows[k])}: "
        steps.append({"method": "animate", "label": where + degrees_of(touch, k), "args": [[str(k)], now]})
    page.frames = frames
    corners = np.concatenate([line for lines in drawn for line in lines])
    low, high = corners.min(axis=0), corners.max(axis=0)
    look = {"backgroundcolor": "#F7F7F7", "gridcolor": "#D9D9D9", "showspikes": False}
    space: dict[str, Any] = {
        f"{letter}axis": {"range": [low[i], high[i]], "title": {"text": f"{letter}, mm"}, **look}
        for i, letter in enumerate("xyz")
    }
    play = {"frame": {"duration": _STEP, "redraw": True}, "fromcurrent": True, "transition": {"duration": 0}}
    stop = {"frame": {"duration": 0, "redraw": False}, "mode": "immediate"}
    page.update_layout(
        scene={**space, "aspectmode": "data", "camera": {"eye": {"x": 1.3, "y": -1.7, "z": 0.9}}},
        sliders=[{"steps": steps, "x": 0.62, "len": 0.38, "y": 0, "currentvalue": {"font": {"color": BLACK}}, **_NO_TICKS}],
        updatemenus=[
            {
                "type": "buttons", "direction": "left", "x": 0.62, "xanchor": "left", "y": 0.06, "showactive": False,
                "buttons": [
                    {"label": "play", "method": "animate", "args": [None, play]},
                    {"label": "stop", "method": "animate", "args": [[None], stop]},
                ],
            }
        ],
    )  # fmt: skip


def _line(lines: list[Any], colour: str, name: str) -> Any:
    """Polylines as one trace, with gaps between them."""
    import plotly.graph_objects as go

    gap = np.full((1, 3), np.nan)
    points = np.concatenate([part for line in lines for part in (line.round(3), gap)])
    x, y, z = points.T
    return go.Scatter3d(
        x=x, y=y, z=z, mode="lines+markers", line={"color": colour, "width": 7}, marker={"size": 3, "color": colour}, name=name,
        showlegend=False, hoverinfo="skip", connectgaps=False,
    )  # fmt: skip


def _dot(across: float, up: float) -> Any:
    import plotly.graph_objects as go

    marker = {"size": 13, "color": CURVE, "line": {"color": WAY, "width": 2}}
    return go.Scatter(x=[across], y=[up], mode="markers", marker=marker, showlegend=False, hoverinfo="skip")


def _ball(plan: Plan) -> Any:
    """The sphere on which the platform goes."""
    import plotly.graph_objects as go

    turn, lean = np.meshgrid(np.linspace(0, 2 * np.pi, 25), np.linspace(0, np.pi, 13))
    centre = [1e3 * float(c[0]) for c in plan.grid.path[:3]]
    radius = 1e3 * plan.rules.radius
    x, y, z = (
        middle + radius * unit
        for middle, unit in zip(centre, (np.cos(turn) * np.sin(lean), np.sin(turn) * np.sin(lean), np.cos(lean)), strict=True)
    )
    return go.Surface(x=x, y=y, z=z, colorscale=[[0, EXCLUDED], [1, EXCLUDED]], showscale=False, opacity=0.6, hoverinfo="skip")
