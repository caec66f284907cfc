"""Stability lobes: depth over spindle speed with the chatter frequency under it; along a path a map of poses and speeds."""

from __future__ import annotations

import html
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from trivet.files import replacing
from trivet.show.drawing import title_lines
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GRID, ORANGE, SKY
from trivet.study.lobes import LOWEST, RPM, Lobes, LobesAlong

TOP = 10.0
"""Depth, against the least that is shown, up to which the axis goes: peaks between lobes are much higher."""
STABLE = "#DCEBF5"
SPEED = "spindle speed, rpm"


def draw_lobes(result: Lobes | LobesAlong, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw stability lobes (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            _picture(result, temporary)
        else:
            _page(result, temporary)


def title(result: Lobes | LobesAlong) -> list[str]:
    """The machine, how it stands, the cut."""
    first = result.poses[0] if isinstance(result, LobesAlong) else result
    machine, stand = title_lines(first.at.machine, first.at.frame, first.at.mode)
    cut = first.cut
    place = "tool tip" if first.point.place == "tool" else "platform centre"
    return [
        machine,
        f"{len(result.poses)} poses" if isinstance(result, LobesAlong) else stand,
        f"{cut.teeth} teeth, immersion {math.degrees(cut.entry):.4g}° to {math.degrees(cut.exit):.4g}°, "
        f"K_t {cut.tangential / 1e6:.4g} N/mm², K_r {cut.radial_ratio:.3g}; feed at {math.degrees(first.feed):g}°, at the "
        f"{place}, loss factor {first.loss_factor:g}",
    ]


def ceiling(depth: np.ndarray) -> float:
    """Upper end (mm) of an axis of depths (m): the greatest, or `TOP` times the least where that is much more."""
    finite = depth[np.isfinite(depth)] * 1e3
    if not len(finite):
        return 1.0
    return float(min(1.06 * finite.max(), TOP * finite.min()))


def bounded(depth: np.ndarray) -> np.ndarray:
    """Depths in mm; NaN where none is unstable."""
    return np.where(np.isfinite(depth), depth * 1e3, np.nan)


def _figure(result: Lobes | LobesAlong) -> tuple[Any, Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(12, 9), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(result), (17, 13, 12), strict=True)):
        figure.text(0.02, 0.955 - 0.035 * line, text, fontsize=size)
    grid = figure.add_gridspec(2, 2, height_ratios=[5, 2], width_ratios=[50, 1], left=0.08, right=0.925, top=0.82, bottom=0.07,
                               hspace=0.07, wspace=0.03)  # fmt: skip
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    for axes in (upper, lower):
        axes.set_axisbelow(True)
        axes.grid(color=GRID, linewidth=0.8)
        axes.spines[["top", "right"]].set_visible(False)
    upper.tick_params(labelbottom=False)
    upper.set_xlim(result.speeds[0] / RPM, result.speeds[-1] / RPM)
    lower.set_xlabel(SPEED, fontsize=12)
    return figure, (upper, lower), grid


def _picture(result: Lobes | LobesAlong, path: Path) -> None:
    figure, (upper, lower), grid = _figure(result)
    if isinstance(result, LobesAlong):
        _plot_along(result, upper, lower, figure, grid)
    else:
        _plot(result, upper, lower)
    figure.savefig(path, format="png")


def _plot(one: Lobes, upper: Any, lower: Any) -> None:
    rpm, top = one.speeds / RPM, ceiling(one.depth)
    shown = np.minimum(np.where(np.isfinite(one.depth), one.depth * 1e3, np.inf), 2 * top)
    upper.fill_between(rpm, 0, shown, color=STABLE, label="stable")
    upper.plot(rpm, shown, color=BLUE, linewidth=1.8, label="limit")
    upper.set_ylim(0, top)
    upper.set_ylabel("depth of cut, mm", fontsize=12)
    if math.isfinite(one.lowest_depth):
        words = f"stable at every speed: {one.lowest_depth * 1e3:.3g} mm"
        upper.axhline(one.lowest_depth * 1e3, color=ORANGE, linewidth=1.4, linestyle=(0, (4, 3)), label=words)
    upper.legend(loc="lower right", bbox_to_anchor=(1.01, 1.005), ncols=3, fontsize=11, frameon=False)
    for frequency in one.natural:
        lower.axhline(frequency, color="#B8B8B8", linewidth=0.8, linestyle=":")
    lower.plot(rpm, one.limits.frequency, ".", color=BLUE, markersize=3)
    heard = one.limits.frequency[np.isfinite(one.limits.frequency)]
    if len(heard):
        wide = 0.1 * (heard.max() - heard.min()) + 0.02 * heard.max()
        lower.set_ylim(heard.min() - wide, heard.max() + wide)
    lower.set_ylabel("chatter, Hz", fontsize=12)


def _plot_along(result: LobesAlong, upper: Any, lower: Any, figure: Any, grid: Any) -> None:
    from matplotlib.colors import LogNorm

    rpm, poses, depth = result.speeds / RPM, np.arange(1, len(result.poses) + 1), bounded(result.depth)
    least, most = colour_range(result)
    mesh = upper.pcolormesh(
        rpm, poses, np.clip(depth, least, most), cmap="cividis", norm=LogNorm(least, most), shading="nearest"
    )
    upper.set_facecolor("white")
    upper.grid(False)
    upper.set_ylim(0.5, len(poses) + 0.5)
    upper.yaxis.get_major_locator().set_params(integer=True)
    upper.set_ylabel("pose", fontsize=12)
    bar = figure.colorbar(mesh, cax=figure.add_subplot(grid[0, 1]), extend="max" if np.nanmax(depth) > most else "neither")
    bar.set_label("stable depth of cut, mm", fontsize=12)
    ticks = colour_ticks(least, most)
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.minorticks_off()
    lower.fill_between(
        rpm, 0, np.minimum(np.nan_to_num(result.least * 1e3, posinf=1e9), 2 * ceiling(result.least)), color=STABLE
    )
    lower.plot(rpm, bounded(result.least), color=BLUE, linewidth=1.8)
    lower.set_ylim(0, ceiling(result.least))
    lower.set_ylabel("at all poses, mm", fontsize=12)


def colour_range(result: LobesAlong) -> tuple[float, float]:
    """Ends (mm) of the scale of colours: `TOP` times the least, or the greatest."""
    depth = bounded(result.depth)
    if not np.any(np.isfinite(depth)):
        return 0.1, 1.0
    least = float(np.nanmin(depth))
    return least, max(ceiling(result.depth), 1.01 * least)


def colour_ticks(least: float, most: float) -> list[float]:
    """Round depths (mm) within a range, for a scale of logarithms."""
    powers = range(math.floor(math.log10(least)), math.ceil(math.log10(most)) + 1)
    found = [digit * 10.0**power for power in powers for digit in (1, 2, 3, 5, 7)]
    return [float(f"{tick:.3g}") for tick in found if least <= tick <= most] or [float(f"{least:.3g}")]


def _page(result: Lobes | LobesAlong, path: Path) -> None:
    from plotly.subplots import make_subplots

    page = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.7, 0.3], vertical_spacing=0.04)
    if isinstance(result, LobesAlong):
        _traces_along(result, page)
    else:
        _traces(result, page)
    first, *rest = (html.escape(line) for line in title(result))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_xaxes(showgrid=True, gridcolor=GRID, range=[result.speeds[0] / RPM, result.speeds[-1] / RPM])
    page.update_xaxes(title_text=SPEED, row=2, col=1)
    page.update_yaxes(showgrid=True, gridcolor=GRID)
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 0.97, "yanchor": "top"},
        template="simple_white",
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        margin={"t": 140, "b": 60},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")


def _lists(values: np.ndarray) -> list[float | None]:
    """Numbers with gaps as plotly takes them."""
    return [float(value) if math.isfinite(value) else None for value in values]


def _traces(one: Lobes, page: Any) -> None:
    rpm, upper, lower = one.speeds / RPM, {"row": 1, "col": 1}, {"row": 2, "col": 1}
    page.add_scatter(
        x=rpm.round(6), y=_lists(one.depth * 1e3), mode="lines", line={"color": BLUE, "width": 2}, name="limit", fill="tozeroy",
        fillcolor=STABLE, hovertemplate="%{x:.0f} rpm: stable up to %{y:.4g} mm<extra></extra>", **upper,
    )  # fmt: skip
    if math.isfinite(one.lowest_depth):
        page.add_scatter(
            x=[rpm[0], rpm[-1]], y=[one.lowest_depth * 1e3] * 2, mode="lines",
            line={"color": ORANGE, "width": 1.5, "dash": "dash"},
            name=f"stable at every speed: {one.lowest_depth * 1e3:.4g} mm", hoverinfo="skip", **upper,
        )  # fmt: skip
    page.add_scatter(
        x=rpm.round(6), y=_lists(one.limits.frequency), mode="markers", marker={"color": SKY, "size": 4}, showlegend=False,
        name="chatter", hovertemplate="%{x:.0f} rpm: chatters at %{y:.1f} Hz<extra></extra>", **lower,
    )  # fmt: skip
    page.update_yaxes(title_text="depth of cut, mm", range=[0, ceiling(one.depth)], **upper)
    page.update_yaxes(title_text=f"chatter, Hz (from {LOWEST:g} to {one.highest:g})", **lower)


def _traces_along(result: LobesAlong, page: Any) -> None:
    rpm, upper, lower = result.speeds / RPM, {"row": 1, "col": 1}, {"row": 2, "col": 1}
    least, most = colour_range(result)
    depth = bounded(result.depth)
    ticks = colour_ticks(least, most)
    page.add_heatmap(
        x=rpm.round(6), y=list(range(1, len(result.poses) + 1)), z=[_lists(row) for row in np.log10(depth)],
        colorscale="Cividis", zmin=math.log10(least), zmax=math.log10(most), customdata=[_lists(row) for row in depth],
        colorbar={
            "title": "stable depth, mm", "tickvals": [math.log10(tick) for tick in ticks],
            "ticktext": [f"{tick:g}" for tick in ticks], "thickness": 12, "len": 0.7, "y": 0.65,
        },
        hovertemplate="pose %{y}, %{x:.0f} rpm: stable up to %{customdata:.4g} mm<extra></extra>", **upper,
    )  # fmt: skip
    page.add_scatter(
        x=rpm.round(6), y=_lists(result.least * 1e3), mode="lines", line={"color": BLUE, "width": 2}, showlegend=False,
        fill="tozeroy", fillcolor=STABLE, name="at all poses",
        hovertemplate="%{x:.0f} rpm: stable at all poses up to %{y:.4g} mm<extra></extra>", **lower,
    )  # fmt: skip
    page.update_yaxes(title_text="pose", dtick=max(1, len(result.poses) // 10), **upper)
    page.update_yaxes(title_text="at all poses, mm", range=[0, ceiling(result.least)], **lower)
