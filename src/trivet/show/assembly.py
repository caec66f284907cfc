"""The assembly modes of a machine side by side (PNG), or one after the other by a slider (HTML)."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.files import replacing
from trivet.kinematics.forward import AssemblyMode, Forward
from trivet.kinematics.mode import parse_mode
from trivet.show.maps import check_suffix
from trivet.show.sticks import sticks

COLOURS = {"connected": "#1B7F3B", "unknown": "#B58900", "apart": "#4A5A6A"}
OUTSIDE = "#B03A2E"


def draw_assembly(result: Forward, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw every pose as a figure of lines: chains from their feet to the platform, and the platform.

    Args:
        result: what `forward` gave.
        path: file to write; .png is a picture, .html a page that needs no network.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: for another suffix, a file that exists unasked or that cannot be written.
    """
    check_suffix(str(path))
    figures = [sticks(result.machine, mode.frame, parse_mode(result.machine, mode.mode)) for mode in result.modes]
    with replacing(path, overwrite=overwrite) as temporary:
        if Path(path).suffix.lower() == ".png":
            _write_picture(result, figures, temporary)
        else:
            _write_page(result, figures, temporary)


def _caption(number: int, mode: AssemblyMode) -> str:
    state = "outside travel" if mode.miss is not None else {"connected": "connected to home"}.get(mode.home, mode.home)
    tilt = math.degrees(mode.angles[1])
    written = f"{mode.mode.replace('-', '−')}, " if mode.mode else ""
    return f"{number}: {written}tilt {tilt:.1f}°, {state}"


def _colour(mode: AssemblyMode) -> str:
    return OUTSIDE if mode.miss is not None else COLOURS[mode.home]


def _title(result: Forward) -> str:
    count = f"{len(result.modes)} pose{'s' if len(result.modes) > 1 else ''}"
    return f"{result.machine.name}: {count} with the same drive coordinates"


def _bounds(figures: list[list[NDArray[Any]]]) -> tuple[NDArray[Any], NDArray[Any]]:
    points = np.concatenate([line for lines in figures for line in lines])
    return points.min(axis=0), points.max(axis=0)


def _write_picture(result: Forward, figures: list[list[NDArray[Any]]], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(4, len(figures))
    rows = -(-len(figures) // columns)
    figure = Figure(figsize=(3.2 * max(columns, 2), 3.0 * rows + 0.6), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(_title(result), fontsize=13)
    low, high = _bounds(figures)
    for k, (lines, mode) in enumerate(zip(figures, result.modes, strict=True)):
        axes: Any = figure.add_subplot(rows, columns, k + 1, projection="3d")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(np.maximum(high - low, 1e-3))
        axes.tick_params(labelsize=6, pad=-2)
        for line in lines[:-1]:
            axes.plot(*line.T, color=_colour(mode), linewidth=1.6, marker="o", markersize=2.5)
        axes.plot(*lines[-1].T, color="black", linewidth=2.2)
        axes.set_title(_caption(k + 1, mode), fontsize=8, color=_colour(mode))
    figure.supxlabel("x, y and z in mm", fontsize=9)
    figure.savefig(path, format="png")


def _write_page(result: Forward, figures: list[list[NDArray[Any]]], path: Path) -> None:
    import plotly.graph_objects as go

    low, high = _bounds(figures)
    page = go.Figure()
    for k, (lines, mode) in enumerate(zip(figures, result.modes, strict=True)):
        for line in lines:
            colour = "black" if line is lines[-1] else _colour(mode)
            x, y, z = line.round(4).T
            page.add_scatter3d(
                x=x, y=y, z=z, mode="lines+markers", line={"color": colour, "width": 6}, marker={"size": 3, "color": colour},
                visible=k == 0, showlegend=False, hoverinfo="x+y+z",
            )  # fmt: skip
    count, each = len(figures), len(figures[0])
    steps = [
        {
            "method": "update",
            "label": str(k + 1),
            "args": [
                {"visible": [row // each == k for row in range(count * each)]},
                {"title.text": f"{_title(result)}<br>{_caption(k + 1, mode)}"},
            ],
        }
        for k, mode in enumerate(result.modes)
    ]
    ranges = {f"{a}axis": {"range": [low[i], high[i]], "title": {"text": f"{a}, mm"}} for i, a in enumerate("xyz")}
    page.update_layout(
        title={"text": f"{_title(result)}<br>{_caption(1, result.modes[0])}"},
        scene={**ranges, "aspectmode": "data"},
        sliders=[{"steps": steps, "currentvalue": {"prefix": "pose "}}],
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False)
