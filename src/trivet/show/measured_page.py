"""Measured responses as a self-contained page."""

from __future__ import annotations

import html
import math
from pathlib import Path
from typing import Any

import numpy as np

from trivet.measure.imported import Imported
from trivet.show.measured import DEEP, FEW, Seen, below_peak, mean_square, title, unit
from trivet.show.measured_picture import SERIES
from trivet.show.palette import BLUE, GRID, VERMILLION


def write_page(found: Imported, seen: Seen, path: Path) -> None:
    """Write HTML."""
    page = (_curves if len(seen.labels) <= FEW else _maps)(found, seen)
    first, second = (html.escape(line) for line in title(found))
    page.update_xaxes(showgrid=True, gridcolor=GRID)
    page.update_yaxes(showgrid=True, gridcolor=GRID)
    page.update_layout(
        title={
            "text": f'{first}<br><span style="font-size:13px">{second}</span>',
            "font": {"size": 17},
            "x": 0.02,
            "y": 0.97,
            "yanchor": "top",
        },
        template="simple_white",
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        margin={"t": 120, "b": 60},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")


def _lists(values: np.ndarray, digits: int = 5) -> list[Any]:
    """Numbers with gaps, in few digits, as plotly takes them."""
    if values.ndim > 1:
        return [_lists(row, digits) for row in values]
    return [float(f"{value:.{digits}g}") if math.isfinite(value) else None for value in values.tolist()]


def _curves(found: Imported, seen: Seen) -> Any:
    from plotly.subplots import make_subplots

    has = seen.coherence is not None
    heights = [0.6, 0.22, 0.18] if has else [0.72, 0.28]
    page = make_subplots(rows=len(heights), cols=1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.03)
    x = seen.frequency.round(6).tolist()
    for k, label in enumerate(seen.labels):
        style = {"mode": "lines", "line": {"color": SERIES[k], "width": 1.5}, "name": label, "legendgroup": label, "x": x}
        page.add_scatter(y=_lists(np.where(seen.magnitude[k] > 0, seen.magnitude[k], np.nan)), row=1, col=1, **style)
        page.add_scatter(y=_lists(seen.phase[k]), row=2, col=1, showlegend=False, **style)
        if seen.coherence is not None:
            page.add_scatter(y=_lists(seen.coherence[k]), row=3, col=1, showlegend=False, **style)
        low = seen.doubtful[k]
        if low.any():
            page.add_scatter(
                x=seen.frequency[low].round(6).tolist(), y=_lists(seen.magnitude[k][low]), mode="markers", row=1, col=1,
                marker={"color": VERMILLION, "size": 4}, name="in doubt", legendgroup=label, showlegend=False,
            )  # fmt: skip
    page.update_yaxes(type="log", exponentformat="power", title_text=unit(found), row=1, col=1)
    page.update_yaxes(range=[-190, 190], tickvals=[-180, -90, 0, 90, 180], title_text="phase, °", row=2, col=1)
    if has:
        page.update_yaxes(range=[0, 1.05], title_text="coherence", row=3, col=1)
    page.update_xaxes(title_text="frequency, Hz", row=len(heights), col=1)
    return page


def _maps(found: Imported, seen: Seen) -> Any:
    from plotly.subplots import make_subplots

    has = seen.coherence is not None
    heights = [0.2, 0.3, 0.3, 0.2] if has else [0.24, 0.38, 0.38]
    page = make_subplots(rows=len(heights), cols=1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.03)
    x = seen.frequency.round(6).tolist()
    page.add_scatter(
        x=x, y=_lists(mean_square(seen.magnitude)), mode="lines", line={"color": BLUE}, showlegend=False, row=1, col=1
    )
    least = found.least_coherence
    bounds = [[0, VERMILLION], [least, VERMILLION], [least, "#606060"], [1, "#FFFFFF"]] if least else "Greys_r"
    kinds: list[tuple[str, np.ndarray, Any, float, float]] = [
        ("dB", below_peak(seen.magnitude), "Viridis", DEEP, 0.0),
        ("phase, °", seen.phase, "Twilight", -180.0, 180.0),
    ]
    if seen.coherence is not None:
        kinds.append(("coherence", seen.coherence, bounds, 0.0, 1.0))
    tops = np.cumsum([0.0, *heights])
    for row, (words, values, colours, low, high) in enumerate(kinds, 2):
        bar = {"title": words, "thickness": 12, "len": heights[row - 1], "y": 1 - tops[row - 1] - heights[row - 1] / 2}
        page.add_heatmap(
            x=x, y=list(range(1, len(seen.labels) + 1)), z=_lists(values, 4), zmin=low, zmax=high, colorscale=colours,
            colorbar=bar, text=seen.labels, row=row, col=1,
            hovertemplate=f"function %{{y}}, %{{x:.6g}} Hz: %{{z:.4g}} {html.escape(words)}<extra></extra>",
        )  # fmt: skip
        page.update_yaxes(title_text="function", autorange="reversed", row=row, col=1)
    page.update_yaxes(title_text="mean, dB", row=1, col=1)
    page.update_xaxes(title_text="frequency, Hz", row=len(heights), col=1)
    return page
