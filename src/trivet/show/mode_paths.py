"""Modes along a path: frequencies over the path, branch by branch, with the places where they cross, touch or veer."""

from __future__ import annotations

import html
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from trivet.study.mode_paths import ModePaths

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)
DASHES = ("solid", "dash", "dot", "dashdot")
"""Of branches beyond the colours, by the names that plotly and Matplotlib share or stand for each other."""
_MATPLOTLIB = {"solid": "-", "dash": "--", "dot": ":", "dashdot": "-."}
MARKS = {"cross": ("x", "x"), "touch": ("D", "diamond-open"), "veer": ("o", "circle-open")}
"""Signs of encounters, in a picture and on a page."""
DOUBT = "not certain"
GREY = "#606060"


class Curve(NamedTuple):
    """One branch as it is drawn."""

    name: str
    colour: str
    dash: str
    at: np.ndarray
    """(f,) along the axis."""
    frequency: np.ndarray
    """(f,) Hz; NaN where it is not followed."""


class Mark(NamedTuple):
    """One encounter."""

    kind: str
    at: float
    frequency: float
    text: str


def draw_mode_paths(report: ModePaths, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw modes along a path (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(report, temporary)


def title(report: ModePaths) -> list[str]:
    """The machine, and the path."""
    about = report.machine.about.title
    signs = f"mode {report.mode}   ".replace("-", "−") if report.mode else ""
    start, end = (_pose(pose) for pose in report.corners[[0, -1]])
    through = f" through {len(report.corners) - 2} more poses" if len(report.corners) > 2 else ""
    return [f"{report.machine.name}: {about}" if about else report.machine.name, f"{signs}from {start}{through} to {end}"]


def _pose(pose: np.ndarray) -> str:
    x, y, z, *angles = (f"{round(v, 6) + 0.0:.4g}".replace("-", "−") for v in (*(1e3 * pose[:3]), *np.degrees(pose[3:])))
    return f"({x}, {y}, {z}) mm, " + ", ".join(f"{name} {value}°" for name, value in zip("αβγ", angles, strict=True))


def axis_label(report: ModePaths) -> str:
    """What the path is measured by."""
    scale = report.scale
    return f"{scale.name}, {scale.unit}" if scale.unit else "pose of the path"


def curves(report: ModePaths) -> list[Curve]:
    """Every branch, at all places that were looked at."""
    at = np.asarray(report.scale.at(report.branches.fine_place))
    return [
        Curve(f"{k + 1}", SERIES[k % len(SERIES)], DASHES[k // len(SERIES) % len(DASHES)], at, report.fine_frequency[:, k])
        for k in range(report.frequency.shape[1])
    ]


def marks(report: ModePaths) -> list[Mark]:
    """Every encounter."""
    found = []
    for one in report.encounters:
        words = f"{one.first + 1} and {one.second + 1} {one.kind}, {one.frequency:.2f} Hz"
        more = f", {one.gap:.3g} Hz apart, shapes turn by {math.degrees(one.exchange):.0f}°" if one.kind == "veer" else ""
        found.append(Mark(one.kind, float(report.scale.at(one.place)), one.frequency, words + more))
    return found


def doubts(report: ModePaths) -> tuple[np.ndarray, np.ndarray]:
    """Where along the axis, and at which frequency, it is not certain how a branch goes on."""
    places = np.array([(one.start + one.end) / 2 for one in report.branches.doubts])
    fine = report.branches.fine_place
    own = [
        float(np.interp(place, fine, report.fine_frequency[:, one.branch]))
        for place, one in zip(places, report.branches.doubts, strict=True)
    ]
    return np.asarray(report.scale.at(places)), np.array(own)


def _picture(report: ModePaths, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(12, 9), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(report), (17, 13), strict=True)):
        figure.text(0.02, 0.955 - 0.035 * line, text, fontsize=size)
    axes = figure.add_axes((0.075, 0.075, 0.8, 0.775))
    for curve in curves(report):
        axes.plot(curve.at, curve.frequency, color=curve.colour, linestyle=_MATPLOTLIB[curve.dash], linewidth=1.8)
    _name(axes, report)
    found = marks(report)
    for kind in dict.fromkeys(mark.kind for mark in found):
        own = [mark for mark in found if mark.kind == kind]
        axes.plot(
            [mark.at for mark in own], [mark.frequency for mark in own], MARKS[kind][0], color=GREY, markersize=9,
            markerfacecolor="none", markeredgewidth=1.6, label=kind, zorder=5, linestyle="none",
        )  # fmt: skip
    if report.branches.doubts:
        axes.plot(*doubts(report), "s", color=VERMILLION, markersize=11, markerfacecolor="none", label=DOUBT, linestyle="none")
    axes.set_axisbelow(True)
    axes.grid(color="#EBEBEB", linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0)
    if not report.scale.unit:
        axes.set_xticks(report.scale.values)
    axes.set_xlabel(axis_label(report), fontsize=12)
    axes.set_ylabel("natural frequency, Hz", fontsize=12)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.01, 1.005), ncols=4, fontsize=11, frameon=False)
    figure.savefig(path, format="png")


def _name(axes: Any, report: ModePaths) -> None:
    """Numbers of branches beside their ends, one above the other where the ends are close."""
    found = [(float(own[-1]), curve) for curve in curves(report) for own in [curve.frequency[np.isfinite(curve.frequency)]]]
    low, high = axes.get_ylim()
    least = 0.024 * (high - low)
    floor = -math.inf
    for height, curve in sorted(found, key=lambda pair: pair[0]):
        floor = max(height, floor + least)
        axes.annotate(
            curve.name, xy=(1.0, height), xycoords=("axes fraction", "data"), xytext=(1.025, floor),
            textcoords=("axes fraction", "data"), color=curve.colour, fontsize=11, va="center", annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": curve.colour, "linewidth": 0.8},
        )  # fmt: skip


def _page(report: ModePaths, path: Path) -> None:
    import plotly.graph_objects as go

    page = go.Figure()
    for curve in curves(report):
        # Lists: gaps in them are null, but NaN in what plotly packs.
        page.add_scatter(
            x=curve.at.tolist(), y=curve.frequency.tolist(), mode="lines", name=curve.name,
            line={"color": curve.colour, "width": 2, "dash": curve.dash, "simplify": False},
            hovertemplate=f"{curve.name}: %{{y:.2f}} Hz<extra></extra>",
        )  # fmt: skip
    found = marks(report)
    for kind in dict.fromkeys(mark.kind for mark in found):
        own = [mark for mark in found if mark.kind == kind]
        page.add_scatter(
            x=[mark.at for mark in own], y=[mark.frequency for mark in own], mode="markers", name=kind,
            marker={"symbol": MARKS[kind][1], "size": 10, "color": GREY, "line": {"width": 2}},
            text=[mark.text for mark in own], hovertemplate="%{text}<extra></extra>",
        )  # fmt: skip
    if report.branches.doubts:
        at, frequency = doubts(report)
        marker = {"symbol": "square-open", "size": 13, "color": VERMILLION, "line": {"width": 2}}
        page.add_scatter(x=at.tolist(), y=frequency.tolist(), mode="markers", name=DOUBT, marker=marker)
    first, *rest = (html.escape(line) for line in title(report))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_xaxes(title_text=axis_label(report), showgrid=True, gridcolor="#EBEBEB")
    if not report.scale.unit:
        page.update_xaxes(tickvals=report.scale.values.tolist())
    page.update_yaxes(title_text="natural frequency, Hz", showgrid=True, gridcolor="#EBEBEB")
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 0.97, "yanchor": "top"},
        template="simple_white",
        hovermode="closest",
        legend={"title": {"text": "branches"}},
        margin={"t": 110, "b": 60},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")
