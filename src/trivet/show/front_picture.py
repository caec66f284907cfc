"""Fronts as pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trivet.design.optimisation import Optimisation
from trivet.show import front as seen
from trivet.show import titles
from trivet.show.names import broken
from trivet.show.palette import GREY, GRID
from trivet.show.parallel import CLOSEST, draw_lines, names
from trivet.show.titles import HIGH, WIDE

LEGEND_COLUMNS = 3


def write_picture(result: Optimisation, path: Path) -> None:
    """Write a picture of 1280 x 800 pixels: the front, and machines beside or below it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(WIDE / 100, HIGH / 100), dpi=100)
    FigureCanvasAgg(canvas)
    own = seen.plan(result, int(titles.height(seen.title(result, 1.0))))
    chosen = seen.picked(result, own.most)
    machines = seen.panel(result, chosen, own)
    titles.write(canvas, seen.title(result, machines.drawn.bar))
    if len(result.aims.goals) == 2:
        _draw_front(canvas, result, own, chosen)
    elif len(result.aims.goals) > 2:
        _draw_coordinates(canvas, result, own, chosen)
    _draw_machines(canvas, machines)
    canvas.savefig(path, format="png")


def _draw_machines(canvas: Any, machines: seen.Panel) -> None:
    for cell, picture in zip(machines.cells, machines.drawn.pictures, strict=True):
        if picture is None:
            _write(canvas, cell, cell.height // 2, "home is not reached", GREY)
        else:
            canvas.figimage(picture, cell.left, HIGH - cell.top - cell.height, origin="upper")
        for k, line in enumerate(cell.caption):
            _write(canvas, cell, cell.height + 16 * k, line, "black", weight="normal" if k else "bold")


def _write(canvas: Any, cell: seen.Cell, down: int, words: str, colour: str, weight: str = "normal") -> None:
    place = ((cell.left + 10) / WIDE, 1 - (cell.top + down) / HIGH)
    canvas.text(*place, words, fontsize=9, va="top", color=colour, fontweight=weight)


def _draw_front(canvas: Any, result: Optimisation, own: seen.Plan, chosen: list[seen.Picked]) -> None:
    found = seen.series(result)
    left, _, wide, high = own.front
    listed = [broken(one.name, 30, 2) for one in found]
    rows = -(-(len(found) + bool(result.alternatives)) // LEGEND_COLUMNS)
    below = 60 + 20 * rows + 14 * min(rows, sum("\n" in name for name in listed))
    box = ((left + 80) / WIDE, below / HIGH, (wide - 90) / WIDE, (high - below - 14) / HIGH)
    axes = canvas.add_axes(box)
    axes.set_axisbelow(True)
    axes.grid(color=GRID, linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_ylabel(seen.goal_axis(result.aims.goals[0]), fontsize=11)
    axes.set_xlabel(seen.goal_axis(result.aims.goals[1]), fontsize=11)
    front = [seen.goal_values(result, result.members, k) for k in (1, 0)]
    beside = [seen.goal_values(result, result.alternatives, k) for k in (1, 0)]
    order = np.argsort(front[0], kind="stable")
    where = "post" if result.aims.goals[1].sign > 0 else "pre"
    axes.step(front[0][order], front[1][order], where=where, color=GREY, linewidth=1.0, zorder=2)
    for name, one in zip(listed, found, strict=True):
        look = {"color": one.colour, "marker": one.marker[0], "linestyle": "none", "zorder": 3}
        axes.plot(beside[0][one.alternatives], beside[1][one.alternatives], markersize=5, alpha=0.3, **look)
        axes.plot(front[0][one.members], front[1][one.members], markersize=7, label=name, **look)
    if result.alternatives:
        axes.plot([], [], "o", color=GREY, alpha=0.5, markersize=5, label="faint: dominated")
    place = {"loc": "upper left", "bbox_to_anchor": (-0.02, -46 / (high - below - 14)), "ncols": LEGEND_COLUMNS}
    axes.legend(frameon=False, fontsize=9, handletextpad=0.2, borderaxespad=0.0, **place)
    _draw_letters(axes, result, chosen)


def _draw_letters(axes: Any, result: Optimisation, chosen: list[seen.Picked]) -> None:
    from matplotlib.patheffects import withStroke

    across, up = seen.outwards(result)
    for letter, member in chosen:
        x, y = (float(seen.goal_values(result, (member,), k)[0]) for k in (1, 0))
        word = axes.annotate(letter, (x, y), (9 * across, 9 * up), textcoords="offset points", fontsize=11, zorder=5)
        word.set(ha="center", va="center", fontweight="bold")
        word.set_path_effects([withStroke(linewidth=3, foreground="white")])


def _draw_coordinates(canvas: Any, result: Optimisation, own: seen.Plan, chosen: list[seen.Picked]) -> None:
    left, top, wide, high = own.front
    across = wide - left - 240
    found = seen.coordinates(result, across // CLOSEST)
    above = 12 + names(found, across / len(found)).height
    box = ((left + 50) / WIDE, (HIGH - top - high + 24) / HIGH, across / WIDE, (high - above - 24) / HIGH)
    axes = draw_lines(canvas, box, found, found[0])
    for letter, height in seen.lettered(result, chosen, found[0]):
        look = {"textcoords": "offset points", "fontsize": 10, "fontweight": "bold", "ha": "right", "va": "center"}
        axes.annotate(letter, (0, height), (-8, 0), **look)
