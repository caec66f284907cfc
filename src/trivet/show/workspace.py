"""Workspaces: from above, from the side and in space; and the directions in which a platform can lean."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any

import numpy as np

from trivet.files import replacing
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from trivet.study.workspace import KINDS, OrientationReport, WorkspaceReport, WorkspaceStudy

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)


def draw_workspaces(study: WorkspaceStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw workspaces beside each other (PNG), or their boundaries in space (self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(study, temporary)


def _title(report: WorkspaceReport) -> str:
    return f"{report.machine.name}: {report.volume * 1e6:.4g} cm³"


def _picture(study: WorkspaceStudy, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(study.reports)
    canvas = Figure(figsize=(max(4.4 * count, 7.5), 8.2), layout="compressed")  # the title wants room
    FigureCanvasAgg(canvas)
    canvas.suptitle(f"workspace {KINDS[study.reports[0].kind]}: height of the columns, and the section at y = 0")
    low, high = (f([r.extent[k] for r in study.reports], axis=0) * 1e3 for k, f in ((0, np.min), (1, np.max)))
    tall = np.maximum(high[1:] - low[1:], 0.1 * np.max(high - low))  # millimetres are as long in both rows
    grid: Any = np.reshape(canvas.subplots(2, count, sharex=True, height_ratios=tall), (2, count))
    most = max(float(r.columns.lengths.max()) for r in study.reports) * 1e3
    for k, report in enumerate(study.reports):
        own = report.columns
        lengths = np.ma.masked_equal(own.lengths.T * 1e3, 0.0)
        image = grid[0, k].pcolormesh(own.x * 1e3, own.y * 1e3, lengths, cmap="cividis", vmin=0, vmax=most, shading="nearest")
        grid[0, k].set_title(_title(report), fontsize=11)
        middle = int(np.argmin(np.abs(own.y)))
        for i, x in enumerate(own.x):
            for start, end in zip(*own.spans[i * len(own.y) + middle], strict=True):
                grid[1, k].plot([x * 1e3, x * 1e3], [start * 1e3, end * 1e3], color=BLUE, linewidth=2, solid_capstyle="butt")
        grid[1, k].set_xlabel("x, mm")
        for axes, (bottom, top) in zip(grid[:, k], ((low[1], high[1]), (low[2], high[2])), strict=True):
            room = 0.04 * (top - bottom)
            axes.set_xlim(low[0] - room, high[0] + room)
            axes.set_ylim(bottom - room, top + room)
            axes.set_aspect("equal")
    grid[0, 0].set_ylabel("y, mm")
    grid[1, 0].set_ylabel("z, mm")
    canvas.colorbar(image, ax=grid.ravel().tolist(), shrink=0.8, label="height of the column, mm")
    canvas.savefig(path, format="png", dpi=110, bbox_inches="tight")


def _page(study: WorkspaceStudy, path: Path) -> None:
    import plotly.graph_objects as go

    page = go.Figure()
    for k, report in enumerate(study.reports):
        x, y, z = report.boundary.T * 1e3
        marker = {"size": 2, "color": SERIES[k % len(SERIES)], "opacity": 0.6}
        page.add_trace(go.Scatter3d(x=x, y=y, z=z, mode="markers", marker=marker, name=html.escape(_title(report))))
    page.update_layout(
        title=html.escape(f"boundary of the workspace {KINDS[study.reports[0].kind]}"),
        scene={"xaxis_title": "x, mm", "yaxis_title": "y, mm", "zaxis_title": "z, mm", "aspectmode": "data"},
        legend={"itemsizing": "constant"},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")


def draw_orientations(report: OrientationReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw which part of all rolls is reached with every direction of the normal (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_map if suffix == ".png" else _map_page)(report, temporary)


def _heading(report: OrientationReport) -> str:
    x, y, z = (f"{1e3 * v:g}" for v in report.position)
    return f"{report.machine.name} at ({x}, {y}, {z}) mm: part of all rolls reached, by the direction of the normal"


def _map(report: OrientationReport, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(8, 5), layout="constrained")
    FigureCanvasAgg(canvas)
    axes = canvas.subplots()
    tilts = np.degrees(np.arccos(report.cosine))
    share = np.ma.masked_equal(report.share.T, 0.0)
    image = axes.pcolormesh(np.degrees(report.azimuth), tilts, share, cmap="cividis", vmin=0, vmax=1, shading="nearest")
    axes.set_xlabel("azimuth, °")
    axes.set_ylabel("tilt, °")
    axes.set_title(_heading(report), fontsize=10, loc="left")
    canvas.colorbar(image, ax=axes, label="part of all rolls")
    canvas.savefig(path, format="png", dpi=110)


def _map_page(report: OrientationReport, path: Path) -> None:
    import plotly.graph_objects as go

    share = np.where(report.share > 0, report.share, np.nan).T
    image = go.Heatmap(
        x=np.degrees(report.azimuth), y=np.degrees(np.arccos(report.cosine)), z=share, colorscale="Cividis", zmin=0, zmax=1
    )
    page = go.Figure(image)
    page.update_layout(title=html.escape(_heading(report)), xaxis_title="azimuth, °", yaxis_title="tilt, °")
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")
