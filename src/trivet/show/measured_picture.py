"""Measured responses as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trivet.measure.imported import Imported
from trivet.show.measured import DEEP, FEW, Seen, below_peak, mean_square, title, unit
from trivet.show.palette import BLACK, BLUE, GREEN, GRID, ORANGE, PURPLE, SKY, VERMILLION

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)
NAMED = 30
"""Functions of a map that have their names beside them."""


def write_picture(found: Imported, seen: Seen, path: Path) -> None:
    """Write a PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(12, 9), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(found), (16, 12), strict=True)):
        figure.text(0.02, 0.955 - 0.035 * line, text, fontsize=size)
    (_curves if len(seen.labels) <= FEW else _maps)(found, seen, figure)
    figure.savefig(path, format="png")


def _panels(figure: Any, heights: list[float], left: float, right: float) -> list[Any]:
    grid = figure.add_gridspec(
        len(heights), 1, height_ratios=heights, left=left, right=right, top=0.85, bottom=0.07, hspace=0.08
    )
    panels: list[Any] = []
    for row in range(len(heights)):
        panels.append(figure.add_subplot(grid[row, 0], sharex=panels[0] if panels else None))
        panels[row].spines[["top", "right"]].set_visible(False)
        panels[row].tick_params(labelbottom=row == len(heights) - 1)
    panels[-1].set_xlabel("frequency, Hz", fontsize=12)
    return panels


def _curves(found: Imported, seen: Seen, figure: Any) -> None:
    has = seen.coherence is not None
    panels = _panels(figure, [5, 2, 1.5] if has else [5, 2], 0.09, 0.975)
    for k, label in enumerate(seen.labels):
        style = {"color": SERIES[k], "linewidth": 1.3}
        phase = seen.phase[k].copy()
        phase[1:][np.abs(np.diff(phase)) > 180] = np.nan
        panels[0].plot(seen.frequency, np.where(seen.magnitude[k] > 0, seen.magnitude[k], np.nan), label=label, **style)
        panels[1].plot(seen.frequency, phase, **style)
        if seen.coherence is not None:
            panels[2].plot(seen.frequency, seen.coherence[k], **style)
        low = seen.doubtful[k]
        for axes, values in zip(panels, (seen.magnitude[k], seen.phase[k]), strict=False):
            axes.plot(seen.frequency[low], values[low], ".", color=VERMILLION, markersize=3, zorder=5)
    for axes in panels:
        axes.set_axisbelow(True)
        axes.grid(color=GRID, linewidth=0.8)
    panels[0].set_yscale("log")
    panels[0].set_ylabel(unit(found), fontsize=12)
    panels[0].legend(loc="lower right", bbox_to_anchor=(1.01, 1.0), ncols=FEW, fontsize=10, frameon=False, columnspacing=1.2)
    panels[0].set_xlim(seen.frequency[0], seen.frequency[-1])
    panels[1].set_ylim(-190, 190)
    panels[1].set_yticks([-180, -90, 0, 90, 180])
    panels[1].set_ylabel("phase, °", fontsize=12)
    if has:
        panels[2].set_ylim(0, 1.05)
        panels[2].set_ylabel("coherence", fontsize=12)
        if found.least_coherence is not None:
            panels[2].axhline(found.least_coherence, color=VERMILLION, linewidth=1.0, linestyle=(0, (4, 3)))


def _maps(found: Imported, seen: Seen, figure: Any) -> None:
    named = len(seen.labels) <= NAMED
    panels = _panels(figure, [2, 3, 3, 2] if seen.coherence is not None else [2, 3, 3], 0.15 if named else 0.08, 0.9)
    panels[0].plot(seen.frequency, mean_square(seen.magnitude), color=BLUE, linewidth=1.3)
    panels[0].grid(color=GRID, linewidth=0.8)
    panels[0].set_ylabel("mean, dB", fontsize=12)
    panels[0].set_xlim(seen.frequency[0], seen.frequency[-1])
    kinds = [("magnitude, dB below\nthe greatest of each", below_peak(seen.magnitude), "viridis", DEEP, 0.0),
             ("phase, °", seen.phase, "twilight", -180.0, 180.0)]  # fmt: skip
    if seen.coherence is not None:
        kinds.append(("coherence", seen.coherence, "Greys_r", 0.0, 1.0))
    rows = np.arange(1, len(seen.labels) + 1)
    for axes, (words, values, colours, least, most) in zip(panels[1:], kinds, strict=True):
        style = {"cmap": colours, "vmin": least, "vmax": most, "shading": "nearest", "rasterized": True}
        mesh = axes.pcolormesh(seen.frequency, rows, values, **style)
        axes.set_ylim(len(rows) + 0.5, 0.5)
        axes.set_ylabel("" if named else "function", fontsize=12)
        axes.set_yticks(rows, labels=seen.labels, fontsize=7) if named else axes.yaxis.get_major_locator().set_params(
            integer=True
        )
        box = axes.get_position()
        figure.colorbar(mesh, cax=figure.add_axes((0.91, box.y0, 0.012, box.height))).set_label(words, fontsize=9)
    if seen.coherence is not None and seen.doubtful.any():
        _mark(seen, panels[-1], rows)


def _mark(seen: Seen, axes: Any, rows: np.ndarray) -> None:
    """Lines in doubt in a colour of their own."""
    from matplotlib.colors import ListedColormap

    marked = np.ma.masked_where(~seen.doubtful, np.ones(seen.doubtful.shape))
    axes.pcolormesh(seen.frequency, rows, marked, cmap=ListedColormap([VERMILLION]), shading="nearest", rasterized=True)
    axes.set_ylim(len(rows) + 0.5, 0.5)
