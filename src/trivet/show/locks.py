"""Advice on locks as points, and all drives along a path as curves."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.model.elements import Drivable
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, GRID, ORANGE, PURPLE, SKY, VERMILLION
from trivet.study.lock_advice import LocksAdvised
from trivet.study.lock_measures import Measure
from trivet.study.redundant import RedundantPath

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)
DASHES = {"solid": "-", "dash": "--", "dot": ":"}
MOST_SETS = 30


class Points(NamedTuple):
    """Lock sets that reach the task, the best first; values as shown."""

    names: list[str]
    least: list[float]
    most: list[float]
    """The greatest over the task."""
    as_is: float
    """With the locks of the machine's file; NaN where there is none."""
    words: list[str]
    """What is gained over that, or over the best where there is none, and the greatest rate of a drive."""


class Curve(NamedTuple):
    """A curve over the path."""

    name: str
    at: np.ndarray
    values: np.ndarray
    """As shown."""
    colour: str
    dash: str


def draw_locks(result: LocksAdvised | RedundantPath, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw advice or drives (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if isinstance(result, RedundantPath):
            (_path_picture if suffix == ".png" else _path_page)(result, temporary)
        else:
            (_set_picture if suffix == ".png" else _set_page)(result, temporary)


def title(result: LocksAdvised | RedundantPath) -> list[str]:
    """The machine, and the task."""
    fixed = result.fixed if isinstance(result, RedundantPath) else result
    about = fixed.machine.about.title
    first = f"{fixed.machine.name}: {about}" if about else fixed.machine.name
    words = "all drives at work" if isinstance(result, RedundantPath) else "which drives to lock"
    return [first, f"{fixed.task.name}, roll {fixed.task.roll}: {words} for the greatest {fixed.measure.name}"]


def scale(asked: Measure) -> tuple[float, str]:
    """Factor and label of an axis of a measure."""
    if asked.unit == "N/m":
        return 1e-6, f"least {asked.name}, N/µm"
    return 1.0, f"least {asked.name}" + (f", {asked.unit}" if asked.unit else "")


def points(result: LocksAdvised) -> Points:
    """What is drawn of advice."""
    factor, _ = scale(result.measure)
    shown = result.reached[:MOST_SETS]
    most = [factor * float(a.holding.least.max()) for a in shown if a.holding is not None]
    beside, word = (result.best.value, "the best") if np.isnan(result.as_is) else (result.as_is, "the file")
    words = [f"{100 * (a.value / beside - 1):+.2f} % over {word}, drive rate {a.rate:.3g}" for a in shown]
    return Points([a.locks.name for a in shown], [factor * a.value for a in shown], most, factor * result.as_is, words)


def value_curves(result: RedundantPath) -> list[Curve]:
    """The measure over the path: all drives at work, the best locks, every pose by itself."""
    factor, _ = scale(result.fixed.measure)
    known = np.isfinite(result.alone)
    return [
        Curve("every pose by itself", result.along[known], factor * result.alone[known], ORANGE, "dot"),
        Curve("all drives at work", result.along, factor * result.value, BLUE, "solid"),
        Curve("best locks", result.along, factor * result.on_locks, VERMILLION, "dash"),
    ]


def drive_curves(result: RedundantPath) -> list[Curve]:
    """The drives over the path as parts of their travel; in m or rad from their start where they have none."""
    joints = {f"{leg.name}.{e.name}": e for leg in result.machine.legs for e in leg.chain.elements if isinstance(e, Drivable)}
    chains = list(dict.fromkeys(name.partition(".")[0] for name in result.drives))
    found = []
    for k, name in enumerate(result.drives):
        travel, own = joints[name].travel, result.coordinates[:, k]
        low, width = (own[0], 1.0) if travel is None else (float(travel[0]), float(travel[1]) - float(travel[0]))
        chain = name.partition(".")[0]
        colour = SERIES[chains.index(chain) % len(SERIES)]
        rank = sum(n.partition(".")[0] == chain for n in result.drives[:k])
        found.append(Curve(name, result.along, (own - low) / width, colour, [*DASHES][rank % len(DASHES)]))
    return found


def _figure(result: LocksAdvised | RedundantPath) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(12, 9), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(result), (17, 13), strict=True)):
        figure.text(0.02, 0.955 - 0.035 * line, text, fontsize=size)
    return figure


def _style(axes: Any) -> None:
    axes.set_axisbelow(True)
    axes.grid(color=GRID, linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)


def _set_picture(result: LocksAdvised, path: Path) -> None:
    figure = _figure(result)
    axes = figure.add_axes((0.36, 0.08, 0.44, 0.78))
    shown = points(result)
    at = np.arange(len(shown.names))
    axes.plot(shown.least, at, "o", color=BLUE, markersize=9, label="least over the task")
    for k, words in enumerate(shown.words):
        axes.annotate(words, (1.01, k), xycoords=("axes fraction", "data"), va="center", fontsize=9)
    axes.plot(shown.most, at, "|", color=ORANGE, markersize=14, markeredgewidth=2, label="greatest over the task")
    if np.isfinite(shown.as_is):
        axes.axvline(shown.as_is, color=VERMILLION, linestyle="--", linewidth=1.4, label="as the file locks")
    axes.set_yticks(at, labels=shown.names, fontsize=10)
    axes.invert_yaxis()
    axes.margins(x=0.1)
    axes.ticklabel_format(axis="x", useOffset=False)
    axes.set_xlabel(scale(result.measure)[1], fontsize=12)
    _style(axes)
    axes.legend(loc="lower right", bbox_to_anchor=(1.4, 1.005), ncols=3, fontsize=11, frameon=False)
    figure.savefig(path, format="png")


def _path_picture(result: RedundantPath, path: Path) -> None:
    figure = _figure(result)
    upper, lower = figure.add_axes((0.09, 0.53, 0.72, 0.33)), figure.add_axes((0.09, 0.075, 0.72, 0.38))
    for axes, curves in ((upper, value_curves(result)), (lower, drive_curves(result))):
        for curve in curves:
            axes.plot(curve.at, curve.values, color=curve.colour, linestyle=DASHES[curve.dash], linewidth=1.8, label=curve.name)
        _style(axes)
        axes.margins(x=0)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), fontsize=10, frameon=False)
    upper.set_ylabel(scale(result.fixed.measure)[1].removeprefix("least "), fontsize=12)
    lower.set_ylabel("drive, parts of its travel", fontsize=12)
    lower.set_xlabel("pose of the path", fontsize=12)
    figure.savefig(path, format="png")


def _set_page(result: LocksAdvised, path: Path) -> None:
    import plotly.graph_objects as go

    shown = points(result)
    page = go.Figure()
    page.add_scatter(
        x=shown.least, y=shown.names, mode="markers", marker={"size": 10, "color": BLUE}, name="least over the task",
        customdata=shown.words, hovertemplate="%{y}: %{x:.5g}, %{customdata}",
    )  # fmt: skip
    marker = {"symbol": "line-ns", "size": 14, "line": {"width": 2, "color": ORANGE}}
    page.add_scatter(x=shown.most, y=shown.names, mode="markers", marker=marker, name="greatest over the task")
    if np.isfinite(shown.as_is):
        page.add_vline(x=shown.as_is, line={"color": VERMILLION, "dash": "dash"}, annotation_text="as the file locks")
    page.update_yaxes(autorange="reversed")
    page.update_xaxes(title_text=scale(result.measure)[1], showgrid=True, gridcolor=GRID)
    _written(page, result, path)


def _path_page(result: RedundantPath, path: Path) -> None:
    from plotly.subplots import make_subplots

    page = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08)
    for row, curves in ((1, value_curves(result)), (2, drive_curves(result))):
        for curve in curves:
            page.add_scatter(
                x=curve.at.tolist(), y=curve.values.tolist(), mode="lines", name=curve.name, row=row, col=1,
                line={"color": curve.colour, "dash": curve.dash, "width": 2},
            )  # fmt: skip
    page.update_yaxes(
        title_text=scale(result.fixed.measure)[1].removeprefix("least "), row=1, col=1, gridcolor=GRID, showgrid=True
    )
    page.update_yaxes(title_text="drive, parts of its travel", row=2, col=1, gridcolor=GRID, showgrid=True)
    page.update_xaxes(title_text="pose of the path", row=2, col=1)
    _written(page, result, path)


def _written(page: Any, result: LocksAdvised | RedundantPath, path: Path) -> None:
    first, *rest = (html.escape(line) for line in title(result))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 0.97, "yanchor": "top"},
        template="simple_white", margin={"t": 110, "b": 60},
    )  # fmt: skip
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")
