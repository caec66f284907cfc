"""Draw the figures of docs/vibration.md.

python docs/make_vibration_figures.py
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import trivet
from trivet.model import Machine
from trivet.show.palette import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY
from trivet.study.dynamic_comparison import AS_DESCRIBED, TRANSLATIONS, DynamicComparison
from trivet.study.frf import FrequencyResponse
from trivet.study.pathfile import PathFile, PathPose

FIGURES = Path(__file__).parent / "figures"
MACHINES = ("azulay", "eclipse", "alizade", "glozman")
LINKS = ("azulay-196", "azulay", "azulay-236")
COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
LOW, HIGH = 20.0, 6000.0

STIFF = "drives rigid, balls 300 N m/rad"
PREMISE = "drives rigid, balls free"
SETTINGS: dict[str, Callable[[Machine], Machine]] = {
    "as described: drives of 3 N/µm, balls clamped": lambda machine: machine,
    "drives rigid, balls of 300 N m/rad": lambda machine: machine.with_rigid_drives().with_spherical(300.0),
}


def canvas(rows: int, columns: int, width: float, height: float, **shared: Any) -> tuple[Any, Any]:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **shared)


def responses(machine: Machine) -> FrequencyResponse:
    return trivet.frf(machine, low=LOW, high=HIGH, points=4000)


def draw_curves(axes: Any, found: FrequencyResponse, entry: str, colour: str, label: str) -> None:
    axes.loglog(found.frequency, 1e6 * np.abs(found.entry(entry)), color=colour, linewidth=1.4, label=label)
    (least,) = (m for m in found.minima if m.direction == entry[0])
    axes.plot(least.frequency, 1e6 / least.stiffness, "v", color=colour, markersize=7, markeredgecolor="white")


def draw_published(axes: Any, values: dict[str, Sequence[float]], axis: int, columns: str) -> None:
    """Published minima as peaks, beyond the right end: one mark per direction."""
    for name, colour in zip(MACHINES, COLOURS, strict=True):
        for k, direction in enumerate(columns):
            stiffness = values[name][axis + k]
            axes.plot(
                HIGH * (1.25 + 0.3 * k),
                1e6 / stiffness,
                marker="D" if k == 0 else "s",
                color=colour,
                markersize=5,
                clip_on=False,
            )
            assert direction in TRANSLATIONS


def frames(axes: Any, bottom: float, top: float) -> None:
    axes.set_xlim(LOW, HIGH)
    axes.set_ylim(bottom, top)
    axes.grid(True, which="major", color="#DDDDDD", linewidth=0.6)
    ticks = [20, 50, 100, 200, 500, 1000, 2000, 5000]
    axes.set_xticks(ticks, [str(t) for t in ticks])
    axes.minorticks_off()


def machines_figure() -> None:
    figure, axes = canvas(2, 2, 11.5, 8.6, sharex=True, sharey=True)
    table = {n: [p.minimum for p in trivet.load(n).about.published_dynamic] for n in MACHINES}
    for row, (title, change) in enumerate(SETTINGS.items()):
        found = {n: responses(change(trivet.load(n))) for n in MACHINES}
        for column, (entry, words) in enumerate((("xx", "x, and y exactly the same"), ("zz", "z"))):
            own = axes[row, column]
            for (name, response), colour in zip(found.items(), COLOURS, strict=True):
                draw_curves(own, response, entry, colour, name)
            draw_published(own, table, 2 * column, "xy" if column == 0 else "z")
            frames(own, 1e-3, 1e3)
            own.set_title(f"{words}\n{title}", fontsize=10)
            if column == 0:
                own.set_ylabel("|H|, µm/N")
            if row == 1:
                own.set_xlabel("frequency, Hz")
    axes[0, 0].plot([], [], "v", color="#666666", label="minimum dynamic stiffness")
    axes[0, 0].plot([], [], "D", color="#666666", markersize=5, label="paper, Table 5: x (left), z (right)")
    axes[0, 0].plot([], [], "s", color="#666666", markersize=5, label="paper, Table 5: y")
    axes[0, 0].legend(fontsize=8, loc="upper left", ncols=2)
    figure.suptitle("Receptance of the platform centre at home, loss factor 0.02", fontsize=12)
    figure.savefig(FIGURES / "frf-machines.png", dpi=100)


def links_figure() -> None:
    figure, axes = canvas(2, 2, 11.5, 8.6, sharex=True, sharey=True)
    for row, (title, change) in enumerate(SETTINGS.items()):
        found = {n: responses(change(trivet.load(n))) for n in LINKS}
        for column, (entry, words) in enumerate((("xx", "x, and y exactly the same"), ("zz", "z"))):
            own = axes[row, column]
            for (name, response), colour in zip(found.items(), (SKY, BLUE, BLACK), strict=True):
                length = {"azulay-196": 196, "azulay": 216, "azulay-236": 236}[name]
                draw_curves(own, response, entry, colour, f"link of {length} mm")
            frames(own, 1e-3, 3e1)
            own.set_title(f"{words}\n{title}", fontsize=10)
            if column == 0:
                own.set_ylabel("|H|, µm/N")
            if row == 1:
                own.set_xlabel("frequency, Hz")
    axes[0, 0].legend(fontsize=9, loc="upper left")
    figure.suptitle(
        "azulay with three link lengths at home, loss factor 0.02; triangles: minimum dynamic stiffness", fontsize=12
    )
    figure.savefig(FIGURES / "frf-links.png", dpi=100)


def ranges_figure(found: DynamicComparison) -> None:
    figure, axes = canvas(1, 2, 12.5, 4.6, sharey=True)
    rows = np.arange(len(MACHINES))[::-1]
    for own, shown, words in zip(axes[0], ("xy", "z"), ("x, and y exactly the same", "z"), strict=True):
        axis = shown[0]
        for row, name, colour in zip(rows, MACHINES, COLOURS, strict=True):
            values = [m.stiffness / 1e6 for v in found.variant_names if (m := found.of(name, v).along(axis))]
            own.barh(row, max(values) - min(values), left=min(values), height=0.34, color=colour, alpha=0.25)
            own.plot(values, np.full(len(values), row), "|", color=colour, markersize=15)
            for variant, marker in ((AS_DESCRIBED, "o"), (STIFF, "^"), (PREMISE, "v")):
                least = found.of(name, variant).along(axis)
                assert least is not None
                own.plot(least.stiffness / 1e6, row, marker, color=colour, markersize=9, markeredgecolor="black")
            for direction, marker in zip(shown, "Ds" if shown == "xy" else "D", strict=True):
                published = found.published(name, direction)
                assert published is not None
                own.plot(published / 1e6, row + 0.36, marker, color=BLACK, markersize=7)
        own.set_xscale("log")
        least, greatest = own.get_xlim()
        own.set_xlim(least / 1.2, greatest * 1.2)
        own.set_xlabel("minimum dynamic stiffness, N/µm")
        own.set_title(words, fontsize=11)
        own.set_yticks(rows, MACHINES)
        own.set_ylim(-0.6, len(MACHINES) - 0.3)
        own.grid(True, axis="x", color="#DDDDDD", linewidth=0.6)
        own.set_axisbelow(True)
    grey = {"color": "#BBBBBB", "markeredgecolor": "black", "linestyle": "none"}
    marks = [
        axes[0, 0].plot([], [], "D", color=BLACK, label="paper, x (left), z (right)")[0],
        axes[0, 0].plot([], [], "s", color=BLACK, label="paper, y")[0],
        axes[0, 0].plot([], [], marker="o", label="as described", **grey)[0],
        axes[0, 0].plot([], [], marker="^", label="drives rigid, balls 300 N m/rad", **grey)[0],
        axes[0, 0].plot([], [], marker="v", label="drives rigid, balls free", **grey)[0],
        axes[0, 0].plot([], [], marker="|", color="#666666", linestyle="none", markersize=12, label="every other variant")[0],
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=6, fontsize=9)
    figure.savefig(FIGURES / "dynamic-ranges.png", dpi=100)


def path_figure() -> None:
    x, y, z = trivet.load("gough-stewart").home.position
    start = PathPose((x - 0.012, y + 0.004, z - 0.002), radians(40), radians(5), -radians(40))
    end = PathPose((x + 0.012, y + 0.010, z - 0.004), radians(40), radians(5), -radians(30))
    found = trivet.modes_along("gough-stewart", PathFile([start, end]), steps=24)
    trivet.figure(found, FIGURES / "modes-along.png", overwrite=True)


def atlas_figure() -> None:
    found = trivet.atlas("azulay", trivet.over_hemisphere(0.121, 0.004, 4), low=20, high=1500)
    trivet.figure(found, FIGURES / "atlas.png", overwrite=True)


if __name__ == "__main__":
    atlas_figure()
    path_figure()
    machines_figure()
    links_figure()
    ranges_figure(trivet.compare_dynamics(*MACHINES))
