"""The comparison of machines in one picture: distributions per axis with the published means, and maps."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.show.maps import check_suffix, scaled, scatter_map
from trivet.show.names import broken, line_count
from trivet.show.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from trivet.study.comparison import HELD, Comparison

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)


def draw_comparison(result: Comparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a comparison (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure

            figure = Figure(figsize=size(result))
            FigureCanvasAgg(figure)
            plot(figure, result)
            figure.savefig(temporary, format="png", dpi=100)
        else:
            page(result).write_html(temporary, include_plotlyjs=True, full_html=True)


class Layout(NamedTuple):
    """Where things are, inches; margins by hand, since the layout engines draw everything twice."""

    width: float
    names: list[str]
    """Of the machines, below the distributions."""
    titles: list[str]
    """Above the maps."""

    @property
    def height(self) -> float:
        return BOTTOM + MAP + self.between + SPREAD + TOP

    @property
    def between(self) -> float:
        """From the maps to the distributions: titles of the former, names of the latter."""
        return 0.45 + LINE * (max(map(line_count, self.titles)) + max(map(line_count, self.names)))

    def part(self, inches: float) -> float:
        """A height as a part of the whole."""
        return inches / self.height


TOP, SPREAD, MAP, BOTTOM, LINE = 0.8, 3.0, 2.8, 0.6, 0.16
"""Above the distributions, the distributions, the maps, below them, and a line of text: inches."""
LETTER = 0.085
"""Width of a letter of a name, inches."""


def layout(result: Comparison) -> Layout:
    """The layout of a picture."""
    count = max(3, len(result.maps))
    width = 3.7 * count + 0.8
    below = int(0.72 * width / 3 / len(result.maps) / LETTER)
    across = int(0.68 * (width - 1.6) / len(result.maps) / LETTER)
    names = [broken(m.machine.name, below) for m in result.maps]
    unlike = len(set(result.hemispheres)) > 1
    titles = []
    for own, hemisphere in zip(result.maps, result.hemispheres, strict=True):
        reached = f"{int(own.used.sum())} of {len(own.surface)} points reached"
        titles.append("\n".join((broken(own.machine.name, across), *((hemisphere,) if unlike else ()), reached)))
    return Layout(width, names, titles)


def size(result: Comparison) -> tuple[float, float]:
    """Width and height of a picture, inches."""
    found = layout(result)
    return found.width, found.height


def plot(canvas: Any, result: Comparison) -> None:
    """Draw a comparison on a figure of matplotlib, or on a part of one."""
    found, count = layout(result), len(result.maps)
    part, foot = found.part, BOTTOM + MAP
    canvas.suptitle("Stiffness over the check points, best roll for " + result.maps[0].objective.name, y=1 - part(0.15))
    upper = canvas.add_gridspec(1, 3, left=0.05, right=0.98, top=1 - part(TOP), bottom=part(foot + found.between), wspace=0.22)
    for axes, quantity in zip((canvas.add_subplot(cell) for cell in upper), HELD, strict=True):
        _distributions(axes, result, quantity, found.names)
    lower = canvas.add_gridspec(
        1, count + 1, width_ratios=[1] * count + [0.03 * count], left=0.05, right=0.94, top=part(foot), bottom=part(BOTTOM)
    )
    shared = _common_range(result, "K_xx")
    for k, (stiffness_map, title) in enumerate(zip(result.maps, found.titles, strict=True)):
        axes = canvas.add_subplot(lower[k])
        values, unit = scaled(stiffness_map, "K_xx")
        dots = scatter_map(axes, stiffness_map, values, shared)
        axes.set_title(title, fontsize=10)
        axes.set_ylabel("y, mm" if k == 0 else "")
    canvas.colorbar(dots, cax=canvas.add_subplot(lower[count]), label=f"K_xx, {unit}")


def _common_range(result: Comparison, quantity: str) -> tuple[float, float]:
    values = np.concatenate([scaled(m, quantity)[0] for m in result.maps])
    return float(np.nanmin(values)), float(np.nanmax(values))


def _distributions(axes: Any, result: Comparison, quantity: str, names: list[str]) -> None:
    """Violins of one quantity, a bar at the mean, a diamond at every published mean."""
    samples = [v[np.isfinite(v)] for v in (scaled(m, quantity)[0] for m in result.maps)]
    places = np.arange(1, len(samples) + 1)
    spread = [k for k, s in enumerate(samples) if np.ptp(s) > 0]
    if spread:
        parts = axes.violinplot([samples[k] for k in spread], positions=places[spread], widths=0.8, showextrema=False)
        for k, body in zip(spread, parts["bodies"], strict=True):
            body.set_facecolor(SERIES[k % len(SERIES)])
            body.set_alpha(0.6)
    axes.scatter(places, [s.mean() for s in samples], marker="_", s=900, color="black", label="mean")
    published = [
        (k, d.published / 1e6)
        for k, m in zip(places, result.maps, strict=True)
        for d in result.deviations
        if d.machine == m.machine.name and d.quantity == quantity
    ]
    if published:
        axes.scatter(
            *zip(*published, strict=True),
            marker="D",
            s=34,
            facecolor="none",
            edgecolor=VERMILLION,
            linewidth=1.6,
            label="published mean",
            zorder=3,
        )
    axes.set_xticks(places, names, fontsize=9)
    axes.set_ylabel(f"{quantity}, N/µm")
    axes.set_ylim(0, 1.06 * max([*(s.max() for s in samples), *(mean for _, mean in published)]))
    axes.set_title(quantity)
    if quantity == HELD[0]:
        axes.legend(loc="lower left", fontsize=8, markerscale=0.5)


def page(result: Comparison) -> Any:
    """A comparison as a figure of plotly."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    figure = make_subplots(rows=1, cols=3, subplot_titles=[f"{q}, N/µm" for q in HELD])
    names = {m.machine.name: broken(m.machine.name, 24).replace("\n", "<br>") for m in result.maps}
    for column, quantity in enumerate(HELD, 1):
        for k, stiffness_map in enumerate(result.maps):
            values, _ = scaled(stiffness_map, quantity)
            name = names[stiffness_map.machine.name]
            figure.add_trace(
                go.Violin(y=values[np.isfinite(values)], name=name, legendgroup=name, showlegend=column == 1,
                          line_color=SERIES[k % len(SERIES)], meanline_visible=True, points=False, spanmode="hard",
                          scalegroup=f"{quantity} {name}"),
                row=1, col=column,
            )  # fmt: skip
        rows = [d for d in result.deviations if d.quantity == quantity]
        figure.add_trace(
            go.Scatter(x=[names[d.machine] for d in rows], y=[d.published / 1e6 for d in rows], mode="markers",
                       name="published mean", legendgroup="published", showlegend=column == 1 and bool(rows),
                       text=[d.source for d in rows],
                       marker={"symbol": "diamond-open", "size": 10, "color": VERMILLION, "line": {"width": 2}}),
            row=1, col=column,
        )  # fmt: skip
    figure.update_yaxes(rangemode="tozero")
    figure.update_layout(
        title="Stiffness over the check points, best roll for " + result.maps[0].objective.name,
        template="simple_white",
        height=560,
    )
    return figure
