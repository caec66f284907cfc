"""Frequency responses: magnitude and phase over frequency, the minima of the dynamic stiffness marked."""

from __future__ import annotations

import html
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.show.drawing import title_lines
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from trivet.study.response_summary import ShownResponse, unit_of_stiffness

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)
NATURAL = "#B8B8B8"
UNBOUNDED = 1e-4
"""Distance from a natural frequency, against it, up to which an undamped response is left out."""
LEAST = "minimum dynamic stiffness"
HEADROOM = 3.0
"""How far above the greatest magnitude the axis goes, as a factor, for the words there."""


class Curve(NamedTuple):
    """One entry as it is drawn."""

    entry: str
    colour: str
    is_hidden: bool
    """Whether it lies on a curve drawn before, so that it is to be dashed."""
    magnitude: np.ndarray
    """(n,) in the unit of its panel; NaN where it has no bound."""
    phase: np.ndarray
    """(n,) deg; NaN where it jumps from one end of the scale to the other."""


class Mark(NamedTuple):
    """A minimum of the dynamic stiffness; entries of the same minimum share one."""

    text: str
    frequency: float
    """Hz."""
    magnitude: float
    colour: str


def draw_response(shown: ShownResponse, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a frequency response (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(shown, temporary)


def title(shown: ShownResponse) -> list[str]:
    """The machine, how it stands, what is shown."""
    whole = shown.whole
    places = (
        f"at {whole.response}" if whole.response == whole.excitation else f"of {whole.response}, loads at {whole.excitation}"
    )
    how = {"exact": "exact", "direct": "finite elements", "modal": "modes of finite elements"}[whole.method]
    own = " but for parts with their own" if whole.has_own_damping else ""
    damping = f"{whole.damping} damping, loss factor {whole.loss_factor:g}{own}"
    return [*title_lines(whole.at.machine, whole.at.frame, whole.at.mode), f"{shown.output} {places}; {damping}; {how}"]


def panels(shown: ShownResponse) -> dict[str, list[Curve]]:
    """Curves by their unit."""
    found: dict[str, list[Curve]] = {}
    for entry, colour in zip(shown.entries, SERIES * (1 + len(shown.entries) // len(SERIES)), strict=False):
        unit, values = shown.unit(entry), shown.values(entry)
        panel = found.setdefault(unit.written, [])
        magnitude = np.where(_unbounded(shown), np.nan, unit.factor * np.abs(values))
        hidden = any(np.allclose(magnitude, other.magnitude, rtol=0.01, atol=0, equal_nan=True) for other in panel)
        phase = np.degrees(np.angle(values))
        phase[1:][np.abs(np.diff(phase)) > 180] = np.nan
        panel.append(Curve(entry, colour, hidden, magnitude, phase))
    return found


def _unbounded(shown: ShownResponse) -> np.ndarray:
    """(n,): frequencies so near to a natural one that without damping there is nothing to draw."""
    frequency, natural = shown.whole.frequency, shown.whole.natural
    if shown.whole.is_bounded or not len(natural):
        return np.zeros(len(frequency), dtype=bool)
    near: np.ndarray = np.abs(frequency[:, None] / natural - 1).min(axis=1) < UNBOUNDED
    return near


def marks(shown: ShownResponse, curves: list[Curve]) -> list[Mark]:
    """Minima of the dynamic stiffness on the curves of a panel, by frequency."""
    found: dict[tuple[str, ...], list[tuple[Curve, float]]] = {}
    for curve in curves:
        if curve.entry in shown.marks:
            minimum = shown.marks[curve.entry]
            unit = unit_of_stiffness(minimum.direction)
            end = ", end of the range" if shown.is_at_end(minimum) else ""
            words = (f"{_digits(unit.factor * minimum.stiffness)} {unit.written}", f"{minimum.frequency:.1f} Hz{end}")
            found.setdefault(words, []).append((curve, minimum.frequency))
    rows = []
    for (stiffness, frequency), members in found.items():
        curve, at = members[0]
        names = ", ".join(one.entry for one, _ in members)
        height = float(np.interp(at, shown.whole.frequency, curve.magnitude))
        rows.append(Mark(f"{names}: {stiffness} at {frequency}", at, height, curve.colour))
    return sorted(rows, key=lambda mark: mark.frequency)


def _digits(value: float) -> str:
    """Four digits, or all before the point."""
    return f"{value:.{max(0, 3 - math.floor(math.log10(value)))}f}"


def _picture(shown: ShownResponse, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    found = panels(shown)
    figure: Any = Figure(figsize=(12 if len(found) == 1 else 9.5 * len(found), 9), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(shown), (17, 13, 13), strict=True)):
        figure.text(0.02, 0.955 - 0.035 * line, text, fontsize=size)
    left = 0.9 / figure.get_figwidth()
    grid = figure.add_gridspec(
        2, len(found), height_ratios=[5, 2], left=left, right=0.975, top=0.83, bottom=0.07, hspace=0.06, wspace=0.16
    )
    for column, (unit, curves) in enumerate(found.items()):
        upper = figure.add_subplot(grid[0, column])
        lower = figure.add_subplot(grid[1, column], sharex=upper)
        _plot(shown, curves, upper, lower)
        upper.set_ylabel(f"{shown.output}, {unit}", fontsize=12)
        for row, mark in enumerate(marks(shown, curves)):
            _label(upper, mark, row)
        upper.legend(loc="lower right", bbox_to_anchor=(1.01, 1.005), ncols=9, fontsize=11, frameon=False, columnspacing=1.4)
    figure.savefig(path, format="png")


def _plot(shown: ShownResponse, curves: list[Curve], upper: Any, lower: Any) -> None:
    """Magnitude and phase of the curves of a panel."""
    frequency, natural = shown.whole.frequency, shown.whole.natural
    for curve in curves:
        style = {"color": curve.colour, "linewidth": 1.8, "linestyle": (0, (4, 3)) if curve.is_hidden else "-"}
        upper.plot(frequency, curve.magnitude, label=curve.entry, **style)
        lower.plot(frequency, curve.phase, **style)
    for axes in (upper, lower):
        axes.set_axisbelow(True)
        axes.grid(color="#EBEBEB", linewidth=0.8)
        axes.spines[["top", "right"]].set_visible(False)
        for at in natural:
            axes.axvline(at, color=NATURAL, linewidth=0.8, linestyle=":", zorder=0.5)
    # Ticks on the upper edge, where no curve goes.
    upper.plot(
        natural, np.ones(len(natural)), "|", transform=upper.get_xaxis_transform(), color="#606060", markersize=12,
        markeredgewidth=1.4, clip_on=False, label="natural frequencies",
    )  # fmt: skip
    upper.set_yscale("log")
    upper.set_xlim(frequency[0], frequency[-1])
    low, high = upper.get_ylim()
    upper.set_ylim(low, high * HEADROOM)
    upper.tick_params(labelbottom=False)
    lower.set_ylim(-190, 190)
    lower.set_yticks([-180, -90, 0, 90, 180])
    lower.set_ylabel("phase, °", fontsize=12)
    lower.set_xlabel("frequency, Hz", fontsize=12)


def _label(axes: Any, mark: Mark, row: int) -> None:
    """A minimum with its words to the side where there is more room, one row under the other."""
    low, high = axes.get_xlim()
    to_the_right = mark.frequency < (low + high) / 2
    label = None if row else LEAST
    axes.plot(
        mark.frequency, mark.magnitude, "o", markersize=8, markerfacecolor="white", markeredgecolor=mark.colour, zorder=5,
        linestyle="none", clip_on=False, label=label,
    )  # fmt: skip
    axes.annotate(
        mark.text,
        xy=(mark.frequency, mark.magnitude),
        xytext=(0.6 if to_the_right else 0.03, 0.94 - 0.06 * row),
        textcoords="axes fraction",
        ha="left",
        va="center",
        fontsize=12,
        bbox={"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
        arrowprops={
            "arrowstyle": "-", "color": mark.colour, "linewidth": 1.0, "shrinkA": 2, "shrinkB": 5,
            "relpos": (0.0 if to_the_right else 1.0, 0.5),
        },
        zorder=6,
    )  # fmt: skip


def _page(shown: ShownResponse, path: Path) -> None:
    first, *rest = (html.escape(line) for line in title(shown))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    heading = {"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 0.97, "yanchor": "top"}
    figure = page(shown).update_layout(title=heading, margin={"t": 140})
    figure.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")


def page(shown: ShownResponse) -> Any:
    """Responses as a figure of plotly, without a title."""
    from plotly.subplots import make_subplots

    found = panels(shown)
    spacing = {"vertical_spacing": 0.04, "horizontal_spacing": 0.09}
    figure = make_subplots(rows=2, cols=len(found), shared_xaxes=True, row_heights=[0.7, 0.3], **spacing)
    for column, (unit, curves) in enumerate(found.items(), 1):
        for curve in curves:
            for row, trace in enumerate(_traces(shown, curve, unit), 1):
                figure.add_trace(trace, row=row, col=column)
        for trace in _natural(shown, curves, is_first=column == 1):
            figure.add_trace(trace, row=1, col=column)
        figure.update_yaxes(type="log", title_text=f"{shown.output}, {unit}", exponentformat="power", row=1, col=column)
        figure.update_yaxes(range=[-190, 190], tickvals=[-180, -90, 0, 90, 180], title_text="phase, °", row=2, col=column)
        figure.update_xaxes(title_text="frequency, Hz", row=2, col=column)
        own = marks(shown, curves)
        if own:
            figure.add_trace(_circles(own, is_first=column == 1), row=1, col=column)
        for row, mark in enumerate(own):
            figure.add_annotation(row=1, col=column, **_note(shown, mark, row))
    scales = [
        {"label": f"{name} frequency", "method": "relayout", "args": [{f"{axis}.type": name for axis in _axes(len(found))}]}
        for name in ("linear", "log")
    ]
    figure.update_xaxes(showgrid=True, gridcolor="#EBEBEB")
    figure.update_yaxes(showgrid=True, gridcolor="#EBEBEB")
    return figure.update_layout(
        template="simple_white",
        hovermode="x unified" if len(found) == 1 else "closest",
        legend={"orientation": "h", "x": 0, "y": -0.13, "yanchor": "top"},
        margin={"t": 60, "b": 100},
        updatemenus=[{"type": "buttons", "direction": "right", "buttons": scales, "x": 1, "y": 1.02, "yanchor": "bottom"}],
    )


def _axes(columns: int) -> list[str]:
    """Names of the frequency axes, those above and those below."""
    return [f"xaxis{k if k > 1 else ''}" for k in range(1, 2 * columns + 1)]


def _traces(shown: ShownResponse, curve: Curve, unit: str) -> tuple[Any, Any]:
    import plotly.graph_objects as go

    line = {"color": curve.colour, "width": 2, "dash": "dash" if curve.is_hidden else "solid", "simplify": False}
    common = {
        "x": shown.whole.frequency.round(6),
        "mode": "lines",
        "line": line,
        "name": curve.entry,
        "legendgroup": curve.entry,
    }
    name = f"{curve.entry} %{{y:.4g}}"
    # Lists: gaps in them are null, but NaN in what plotly packs.
    return (
        go.Scatter(y=curve.magnitude.tolist(), hovertemplate=f"{name} {unit}<extra></extra>", **common),
        go.Scatter(y=curve.phase.round(3).tolist(), hovertemplate=f"{name}°<extra></extra>", showlegend=False, **common),
    )


def _natural(shown: ShownResponse, curves: list[Curve], is_first: bool) -> list[Any]:
    """Ticks at the natural frequencies, below all curves."""
    import plotly.graph_objects as go

    natural = shown.whole.natural
    if not len(natural):
        return []
    below = np.full(len(natural), 0.5 * min(np.nanmin(curve.magnitude) for curve in curves))
    marker = {"symbol": "line-ns-open", "size": 14, "color": "#606060", "line": {"width": 1.5}}
    return [
        go.Scatter(
            x=natural.round(6), y=below, mode="markers", marker=marker, name="natural frequencies",
            legendgroup="natural", showlegend=is_first, text=[f"mode {k + 1}: {f:.2f} Hz" for k, f in enumerate(natural)],
            hovertemplate="%{text}<extra></extra>",
        )
    ]  # fmt: skip


def _circles(own: list[Mark], is_first: bool) -> Any:
    import plotly.graph_objects as go

    marker = {"symbol": "circle", "size": 9, "color": "white", "line": {"width": 1.5, "color": [mark.colour for mark in own]}}
    return go.Scatter(
        x=[mark.frequency for mark in own], y=[mark.magnitude for mark in own], mode="markers", marker=marker, name=LEAST,
        legendgroup="least", showlegend=is_first, text=[mark.text for mark in own],
        hovertemplate=f"{LEAST} %{{text}}<extra></extra>",
    )  # fmt: skip


def _note(shown: ShownResponse, mark: Mark, row: int) -> dict[str, Any]:
    """A minimum with its words beside it."""
    frequency = shown.whole.frequency
    to_the_right = mark.frequency < (frequency[0] + frequency[-1]) / 2
    return {
        "x": mark.frequency, "y": float(np.log10(mark.magnitude)), "text": mark.text, "ax": 70 if to_the_right else -70,
        "ay": 22 * row - 8, "xanchor": "left" if to_the_right else "right", "arrowcolor": mark.colour, "arrowwidth": 1.2,
        "arrowhead": 0, "standoff": 5, "bgcolor": "rgba(255,255,255,0.8)", "font": {"size": 12},
    }  # fmt: skip
