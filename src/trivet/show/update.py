"""A machine corrected by measurements: functions as measured, before and after; numbers with what is sure of them."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.measure.channels import unit_of
from trivet.show.correlation import FLOOR, QUANTITIES
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREY, GRID, ORANGE, VERMILLION
from trivet.study.update import Compared, Update

MOST = 4
"""Functions in a figure: those that respond most, held back ones first."""
CURVES = (("measured", BLUE, "solid"), ("before", ORANGE, "dot"), ("after", VERMILLION, "dash"))
STYLES = {"solid": "-", "dot": ":", "dash": (0, (5, 2))}


class Panel(NamedTuple):
    """One function."""

    title: str
    axis: str
    """What the magnitude is, with its unit."""
    magnitudes: tuple[np.ndarray, ...]
    """Of `CURVES`, (n,); NaN where there is next to nothing."""


def draw_update(result: Update, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a correction (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(result, panels(result), temporary)


def panels(result: Update) -> list[Panel]:
    """The functions that respond most: of those which the fit did not see, if there are any."""
    compared = result.fitted if result.held is None else result.held
    words = "fitted" if result.held is None else "held back"
    size = np.abs(compared.measured.receptance).max(axis=1)
    return [_panel(compared, int(k), words) for k in np.argsort(-size)[:MOST]]


def _panel(compared: Compared, number: int, words: str) -> Panel:
    measured = compared.measured
    before, after = (float(values[number]) for values in compared.frac)
    title = f"{measured.labels[number]}, {words}: FRAC {before:.3f} before, {after:.3f} after"
    motion, response, reference = measured.motions[number], measured.responses[number], measured.references[number]
    sizes = [np.abs(one.values[number]) for one in (measured, compared.before, compared.after)]
    least = FLOOR * max(float(size.max()) for size in sizes)
    axis = f"{QUANTITIES[motion]}, {unit_of(motion, response, reference)}"
    return Panel(title, axis, tuple(np.where(size > least, size, np.nan) for size in sizes))


def heading(result: Update) -> list[str]:
    """The machine, and what corrected it."""
    seen = result.fitted.measured
    return [
        f"{result.problem.machine.name} corrected by {seen.source or 'measured responses'}",
        f"{len(seen)} functions from {seen.frequency[0]:g} to {seen.frequency[-1]:g} Hz; "
        f"residuals of ln|H| scatter by {result.found.spread:.3f}",
    ]


def factors(result: Update) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(p,) change of theta, its standard deviations afterwards and beforehand, all over that beforehand."""
    free = result.problem.free
    change = (result.found.theta - free.theta(free.start)) / free.spread
    return change, result.told.deviation / free.spread, np.ones(len(free))


def _picture(result: Update, shown: list[Panel], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows, count = -(-len(shown) // 2), len(result.paths)
    lower = 1.6 + 0.45 * count
    height = 1.3 + 3.3 * rows + lower
    figure: Any = Figure(figsize=(14, height), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(heading(result), (17, 13), strict=True)):
        figure.text(0.02, 1 - (0.42 + 0.31 * line) / height, text, fontsize=size)
    upper = figure.add_gridspec(
        rows, 2, left=0.07, right=0.98, top=1 - 1.25 / height, bottom=lower / height, hspace=0.4, wspace=0.18
    )
    for k, one in enumerate(shown):
        axes = figure.add_subplot(upper[k // 2, k % 2])
        for (name, colour, dash), values in zip(CURVES, one.magnitudes, strict=True):
            axes.plot(result.fitted.measured.frequency, values, color=colour, linestyle=STYLES[dash], linewidth=1.5, label=name)
        axes.set_yscale("log")
        axes.set_title(one.title, loc="left", fontsize=12)
        axes.set_ylabel(one.axis, fontsize=11)
        axes.set_xlabel("frequency, Hz", fontsize=11)
        axes.grid(color=GRID, linewidth=0.8)
        axes.spines[["top", "right"]].set_visible(False)
        if k == 0:
            figure.legend(*axes.get_legend_handles_labels(), loc="upper right", ncols=3, fontsize=12, frameon=False)
    below = figure.add_gridspec(
        1, 2, left=0.24, right=0.95, top=(lower - 0.95) / height, bottom=0.55 / height, width_ratios=[1.8, 1], wspace=0.25
    )
    _plot_numbers(result, figure.add_subplot(below[0]))
    seen = figure.add_subplot(below[1])
    image = seen.imshow(result.told.correlation, cmap="PuOr", vmin=-1, vmax=1, aspect="auto")
    seen.set_xticks(range(count), [str(k + 1) for k in range(count)])
    seen.set_yticks(range(count), [str(k + 1) for k in range(count)])
    seen.set_title("correlation afterwards", loc="left", fontsize=12)
    figure.colorbar(image, ax=seen, pad=0.03)
    figure.savefig(path, format="png")


def _plot_numbers(result: Update, axes: Any) -> None:
    change, after, before = factors(result)
    place = np.arange(len(change))
    axes.barh(place, 2 * before, left=-before, height=0.6, color=GRID, label="known before, ± one standard deviation")
    axes.errorbar(change, place, xerr=after, fmt="o", color=VERMILLION, capsize=4, label="after")
    axes.set_yticks(
        place, [f"{k + 1}  {path.replace('chains.', '').replace('elements.', '')}" for k, path in enumerate(result.paths)]
    )
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("change, in standard deviations beforehand", fontsize=11)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=10, frameon=False)


def _page(result: Update, shown: list[Panel], path: Path) -> None:
    from plotly.subplots import make_subplots

    rows = len(shown) + 2
    names = [html.escape(one.title) for one in shown] + ["numbers", "correlation afterwards"]
    page = make_subplots(rows=rows, cols=1, vertical_spacing=0.3 / rows, subplot_titles=names)
    page.update_annotations(x=0, xanchor="left", font={"size": 14})
    frequency = result.fitted.measured.frequency.round(9)
    for row, one in enumerate(shown, 1):
        for (name, colour, dash), size in zip(CURVES, one.magnitudes, strict=True):
            page.add_scatter(
                x=frequency, y=[float(v) if np.isfinite(v) else None for v in size], mode="lines", name=name,
                legendgroup=name, showlegend=row == 1, line={"color": colour, "width": 2, "dash": dash},
                hovertemplate=f"{name} %{{y:.4g}} at %{{x:.2f}} Hz<extra></extra>", row=row, col=1,
            )  # fmt: skip
        page.update_yaxes(type="log", title_text=one.axis, exponentformat="power", row=row, col=1)
        page.update_xaxes(matches="x", row=row, col=1)
    change, after, before = factors(result)
    paths = list(result.paths)
    page.add_scatter(
        x=np.zeros(len(paths)), y=paths, mode="markers", name="known before", marker={"color": GREY},
        error_x={"array": before, "color": GREY, "thickness": 8}, row=rows - 1, col=1,
    )  # fmt: skip
    page.add_scatter(
        x=change, y=paths, mode="markers", name="after", showlegend=False, marker={"color": VERMILLION, "size": 10},
        error_x={"array": after, "color": VERMILLION}, row=rows - 1, col=1,
    )  # fmt: skip
    page.update_xaxes(title_text="change, in standard deviations beforehand", row=rows - 1, col=1)
    page.add_heatmap(
        x=paths, y=paths, z=result.told.correlation, zmin=-1, zmax=1, colorscale="PuOr", row=rows, col=1,
        hovertemplate="%{x}, %{y}: %{z:.3f}<extra></extra>", showscale=False,
    )  # fmt: skip
    first, *rest = (html.escape(line) for line in heading(result))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02}, template="simple_white",
        legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 1, "yanchor": "bottom"}, margin={"t": 120, "b": 60},
        height=160 + 300 * rows,
    )  # fmt: skip
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True)
