"""Minimum dynamic stiffness of machines, and what their descriptions leave open; alone or below the static half."""

from __future__ import annotations

import os
from typing import Any

from trivet.files import replacing
from trivet.show import comparison as static
from trivet.show.comparison import LETTER, SERIES
from trivet.show.maps import check_suffix
from trivet.show.names import broken
from trivet.show.palette import VERMILLION
from trivet.study.dynamic_comparison import TRANSLATIONS, DynamicComparison
from trivet.study.whole_comparison import WholeComparison

FEW_LABELS = 30.0
"""Upper end of an axis against its lower one up to which there is room for labels between the decades."""
BAND = 0.36
"""Height of a machine's band, rows being 1 apart."""


def draw_dynamics(result: DynamicComparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a dynamic comparison (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            figure = _figure(11.8, height(result))
            plot(figure, result)
            figure.savefig(temporary, format="png", dpi=100)
        else:
            page(result).write_html(temporary, include_plotlyjs=True, full_html=True)


def draw_whole(result: WholeComparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw both halves of a comparison into one file, the dynamic one below (PNG or self-contained HTML)."""
    if result.dynamic is None:
        static.draw_comparison(result.static, path, overwrite=overwrite)
        return
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            width, above = static.size(result.static)
            below = height(result.dynamic)
            figure = _figure(width, above + below)
            upper, lower = figure.subfigures(2, 1, height_ratios=(above, below))
            static.plot(upper, result.static)
            plot(lower, result.dynamic)
            figure.savefig(temporary, format="png", dpi=100)
        else:
            first = static.page(result.static).to_html(include_plotlyjs=True, full_html=False)
            second = page(result.dynamic).to_html(include_plotlyjs=False, full_html=False)
            head = '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Comparison of machines</title></head>'
            temporary.write_text(f"{head}\n<body>{first}\n{second}</body></html>\n", encoding="utf-8")


def _figure(width: float, tall: float) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, tall))
    FigureCanvasAgg(figure)
    return figure


def height(result: DynamicComparison) -> float:
    """Height of a picture, inches."""
    return 1.9 + 0.55 * len(result.names)


def title(result: DynamicComparison) -> str:
    """What is shown."""
    count = len(result.variant_names) - 1
    variants = f", as described and in {count} variants of what descriptions leave open" if count else ""
    return f"Minimum dynamic stiffness at home, loss factor {result.loss_factor:g}{variants}"


def values(result: DynamicComparison, name: str, axis: str) -> dict[str, float]:
    """N/µm by variant, those with a result."""
    found = {variant: result.of(name, variant).along(axis) for variant in result.variant_names}
    return {variant: own.stiffness / 1e6 for variant, own in found.items() if own is not None}


def plot(canvas: Any, result: DynamicComparison) -> None:
    """Draw a dynamic comparison on a figure of matplotlib, or on a part of one: a row per machine, a panel per axis."""
    from matplotlib.ticker import LogLocator, NullFormatter

    tall = height(result)
    canvas.suptitle(title(result), y=1 - 0.12 / tall)
    names = [broken(name, 24, 3) for name in result.names]
    wide = LETTER * max(len(line) for name in names for line in name.split("\n"))
    grid = canvas.add_gridspec(
        1,
        3,
        left=(0.25 + wide) / canvas.bbox.width * canvas.dpi,
        right=0.98,
        top=1 - 0.65 / tall,
        bottom=0.95 / tall,
        wspace=0.08,
    )
    for k, axis in enumerate(TRANSLATIONS):
        axes = canvas.add_subplot(grid[k], sharex=canvas.axes[-1] if k else None)
        axes.use_sticky_edges = False
        for row, name in enumerate(result.names):
            _plot_row(axes, result, name, axis, row)
        axes.set_xscale("log")
        axes.set_ylim(len(result.names) - 0.4, -0.7)
        axes.set_yticks(range(len(result.names)), names if k == 0 else [""] * len(names), fontsize=9)
        axes.grid(axis="x", color="#E5E5E5", linewidth=0.8)
        axes.set_axisbelow(True)
        axes.set_title(f"along {axis}", fontsize=11)
        axes.set_xlabel("minimum dynamic stiffness, N/µm")
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < FEW_LABELS * low else (1.0,), numticks=20))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    canvas.legend(once.values(), once.keys(), loc="lower center", ncols=3, fontsize=9, frameon=False)


def _plot_row(axes: Any, result: DynamicComparison, name: str, axis: str, row: int) -> None:
    colour, found = SERIES[row % len(SERIES)], values(result, name, axis)
    low, high = min(found.values()), max(found.values())
    if high > low:
        axes.barh(row, high - low, left=low, height=BAND, color=colour, alpha=0.25, linewidth=0)
        ends = [row - BAND / 2] * len(found), [row + BAND / 2] * len(found)
        axes.vlines(list(found.values()), *ends, color=colour, linewidth=1.2, label="variants")
    own = next(iter(found.values()))
    axes.plot(own, row, "o", color=colour, markeredgecolor="black", markersize=8, label="as described", linestyle="none")
    published = result.published(name, axis)
    if published is not None:
        axes.plot(
            published / 1e6, row - 0.38, "D", markerfacecolor="none", markeredgecolor=VERMILLION, markersize=6,
            markeredgewidth=1.6, label="published", linestyle="none",
        )  # fmt: skip


def page(result: DynamicComparison) -> Any:
    """A dynamic comparison as a figure of plotly."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    names = {name: broken(name, 24, 3).replace("\n", "<br>") for name in result.names}
    figure = make_subplots(rows=1, cols=3, shared_yaxes=True, subplot_titles=[f"along {axis}" for axis in TRANSLATIONS])
    for column, axis in enumerate(TRANSLATIONS, 1):
        for row, name in enumerate(result.names):
            found = values(result, name, axis)
            marker = {"symbol": "line-ns-open", "size": 16, "color": SERIES[row % len(SERIES)], "line": {"width": 2}}
            figure.add_trace(
                go.Scatter(x=list(found.values()), y=[names[name]] * len(found), mode="lines+markers", marker=marker, name=name,
                           text=list(found), showlegend=False, line={"width": 1},
                           hovertemplate="%{text}: %{x:.4g} N/µm<extra></extra>"),
                row=1, col=column,
            )  # fmt: skip
        described = [next(iter(values(result, name, axis).values())) for name in result.names]
        known = [(name, p / 1e6) for name in result.names if (p := result.published(name, axis)) is not None]
        colours = [SERIES[k % len(SERIES)] for k in range(len(result.names))]
        figure.add_trace(
            go.Scatter(x=described, y=list(names.values()), mode="markers", name="as described", legendgroup="own",
                       showlegend=column == 1,
                       marker={"size": 11, "color": colours, "line": {"width": 1, "color": "black"}},
                       hovertemplate="as described: %{x:.4g} N/µm<extra></extra>"),
            row=1, col=column,
        )  # fmt: skip
        figure.add_trace(
            go.Scatter(x=[p for _, p in known], y=[names[name] for name, _ in known], mode="markers", name="published",
                       legendgroup="published", showlegend=column == 1 and bool(known),
                       marker={"symbol": "diamond-open", "size": 11, "color": VERMILLION, "line": {"width": 2}},
                       hovertemplate="published: %{x:.4g} N/µm<extra></extra>"),
            row=1, col=column,
        )  # fmt: skip
    figure.update_xaxes(type="log", title_text="minimum dynamic stiffness, N/µm")
    figure.update_yaxes(autorange="reversed")
    figure.update_layout(title=title(result), template="simple_white", height=220 + 60 * len(result.names))
    return figure
