"""Errors of the platform over a family of poses, and what they come from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.results.netcdf import COMPONENTS
from trivet.show.maps import check_suffix, cross_out, crosses
from trivet.show.palette import BLUE, GREEN, GRID, ORANGE, SKY, VALUES, VERMILLION
from trivet.study.accuracy import Accuracy

DECADE = 10.0
"""From the least to the greatest value: beyond, colours are logarithmic."""
SINGULAR = "near a singularity"
"""Points of which first order says nothing."""
BETWEEN = 0.12
"""From panel to panel of a page, with room for colours and words; a part of its width."""
PANELS = ("root mean square error of position, µm", "greatest error of position, µm")
KINDS = (("position", BLUE), ("rotation", ORANGE))
HALVES = ("errors of position, µm", "errors of rotation, µrad")
"""Panels of one pose."""
SHARES, SHARES_OF_ONE = "share in the variance, mean over the points, %", "share in the variance, %"


def draw_accuracy(result: Accuracy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw errors over poses and shares of their sources (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(result, temporary)


def _title(result: Accuracy) -> list[str]:
    where = "platform centre" if result.point == "platform" else "tool tip"
    if result.is_one_pose:
        place = ", ".join(f"{1e3 * v + 0.0:.4g}" for v in result.places.position[0])
        assert result.places.roll is not None
        angles = (result.places.azimuth, result.places.tilt, result.places.roll)
        azimuth, tilt, roll = (float(np.degrees(values[0])) + 0.0 for values in angles)
        return [
            f"{result.machine.name}, {mode_words(result.mode)}: centre ({place}) mm",
            f"azimuth {azimuth:.4g}°, tilt {tilt:.4g}°, roll {roll:.4g}°; {where}, drives held, to first order",
        ]
    reached = f"{int(result.used.sum())} of {len(result.family)} points reached"
    return [
        f"{result.machine.name}, {result.family.name}, {mode_words(result.mode)}: {reached}",
        f"roll {result.policy}, {where}, drives held, to first order; the least accurate point is marked",
    ]


def _titles(result: Accuracy) -> tuple[str, ...]:
    """Of the panels: two of errors, one of shares."""
    return (*HALVES, SHARES_OF_ONE) if result.is_one_pose else (*PANELS, SHARES)


class _Panel(NamedTuple):
    """Values where the family's coordinates put them: of one coordinate as a curve, of two or three as colours.

    Of three coordinates the last is gone over: of points at the same place the greatest error is shown.
    """

    x: Any
    y: Any
    """None of a curve."""
    values: Any
    points: Any
    """Which points of the family these are."""
    labels: tuple[str, ...]
    star: tuple[float, ...]

    @classmethod
    def of(cls, result: Accuracy, column: int) -> _Panel:
        axes, coordinates = result.family.axes[:2], result.family.coordinates[:, :2]
        values = 1e6 * (result.size, result.farthest)[column][:, 0]
        order = np.argsort(-values)  # what is not reached comes last
        values = np.where(result.told, values, np.nan)
        _, first = np.unique(np.round(coordinates[order] / result.family.spacing[:2], 6), axis=0, return_index=True)
        points = order[first]
        place = coordinates * [axis.factor for axis in axes]
        labels = tuple(", ".join(filter(None, (axis.name, axis.unit))) for axis in axes)
        y = place[points, 1] if len(axes) > 1 else None
        return cls(place[points, 0], y, values[points], points, labels, tuple(place[result.least_accurate]))

    def singular(self, result: Accuracy) -> Any:
        """Which of them have no value since they are near a singularity."""
        return result.beyond[self.points] & ~np.isfinite(self.values)

    @property
    def is_log(self) -> bool:
        """Whether the values run over more than a decade."""
        known = self.values[np.isfinite(self.values)]
        return bool(len(known) and known.min() > 0 and known.max() > DECADE * known.min())


def _bars(result: Accuracy) -> tuple[list[str], list[Any]]:
    """Sources in words, and their mean shares (%) in position and rotation; those without a variance left out."""
    shares = [100 * result.shares(what)[result.told].mean(axis=0) for what, _ in KINDS]
    kept = [k for k, source in enumerate(result.sources) if source.amounts and np.isfinite(shares[0][k])]
    words = [f"{result.sources[k].name} {result.sources[k].size}" for k in kept]
    return words, [own[kept] for own in shares]


def _components(result: Accuracy, half: int) -> list[tuple[str, str, Any]]:
    """Of one pose: in words, a colour, and values (3,) of one half of the components, µm or µrad."""
    own = slice(3 * half, 3 * half + 3)
    rows = [
        ("standard deviation", GREEN, 1e6 * result.deviation[0, own]),
        ("at worst", VERMILLION, 1e6 * result.worst[0, own]),
    ]
    shift = 1e6 * result.shift[0, own]
    return [("for sure", SKY, shift), *rows] if shift.any() else rows


def _picture(result: Accuracy, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(15, 5.2), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle("\n".join(_title(result)), fontsize=11)
    *maps, bars = canvas.subplots(1, len(PANELS) + 1)
    for k, (axes, title) in enumerate(zip(maps, _titles(result), strict=False)):
        axes.set_title(title, fontsize=10)
        if result.is_one_pose:
            _draw_components(axes, result, k)
        else:
            _draw_panel(canvas, axes, result, _Panel.of(result, k))
    words, shares = _bars(result)
    for k, ((what, colour), values) in enumerate(zip(KINDS, shares, strict=True)):
        bars.barh(np.arange(len(words)) + 0.4 * k - 0.2, values, 0.38, color=colour, label=what)
    bars.set_yticks(range(len(words)), words, fontsize=8)
    bars.set_xlabel(_titles(result)[-1])
    bars.grid(axis="x", color=GRID)
    bars.set_axisbelow(True)
    bars.invert_yaxis()
    bars.legend(fontsize=8)
    canvas.savefig(path, format="png", dpi=120)


def _draw_components(axes: Any, result: Accuracy, half: int) -> None:
    rows = _components(result, half)
    width = 0.8 / len(rows)
    for k, (name, colour, values) in enumerate(rows):
        axes.bar(np.arange(3) + (k - (len(rows) - 1) / 2) * width, values, 0.95 * width, color=colour, label=name)
    axes.set_xticks(range(3), COMPONENTS[3 * half : 3 * half + 3])
    axes.grid(axis="y", color=GRID)
    axes.set_axisbelow(True)
    axes.legend(fontsize=8)


def _draw_panel(canvas: Any, axes: Any, result: Accuracy, own: _Panel) -> None:
    used, scale = np.isfinite(own.values), "log" if own.is_log else "linear"
    axes.set_xlabel(own.labels[0])
    if own.y is None:
        axes.plot(own.x, own.values, ".-", color=BLUE)
        axes.axvline(own.star[0], color=VERMILLION, linewidth=0.8)
        axes.set_yscale(scale)
        return
    size = 9000 / max(len(own.values), 100)
    dots = axes.scatter(own.x[used], own.y[used], c=own.values[used], s=size, cmap=VALUES, norm=scale, linewidths=0)
    singular = own.singular(result)
    missed = ~used & ~singular
    cross_out(axes, own.x[missed], own.y[missed], size)
    if singular.any():
        axes.scatter(own.x[singular], own.y[singular], s=size, facecolors="none", edgecolors=VERMILLION, label=SINGULAR)
        axes.legend(loc="upper right", fontsize=8, handletextpad=0.2, borderpad=0.3)
    axes.plot(*own.star, "*", color=VERMILLION, markersize=12)
    axes.set_aspect("equal")
    axes.set_ylabel(own.labels[1])
    canvas.colorbar(dots, ax=axes, shrink=0.75)


def _page(result: Accuracy, path: Path) -> None:
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    titles = _titles(result)
    page = make_subplots(rows=1, cols=len(titles), subplot_titles=titles, horizontal_spacing=BETWEEN)
    (_components_on_page if result.is_one_pose else _panels_on_page)(page, result)
    words, shares = _bars(result)
    for (what, colour), values in zip(KINDS, shares, strict=True):
        bar = go.Bar(x=values, y=words, orientation="h", name=what, marker={"color": colour})
        page.add_trace(bar, row=1, col=len(titles))
    page.update_yaxes(autorange="reversed", side="right", row=1, col=len(titles))
    page.update_layout(
        title="<br>".join(_title(result)), template="simple_white", height=540, width=1600, margin={"t": 120, "r": 260}
    )
    page.update_layout(legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 1.12, "yanchor": "bottom"})
    page.write_html(path, include_plotlyjs=True, full_html=True)


def _components_on_page(page: Any, result: Accuracy) -> None:
    import plotly.graph_objects as go

    for half in range(len(HALVES)):
        for name, colour, values in _components(result, half):
            look = {"name": name, "marker": {"color": colour}, "legendgroup": name, "showlegend": half == 0}
            page.add_trace(go.Bar(x=COMPONENTS[3 * half : 3 * half + 3], y=values, **look), row=1, col=half + 1)


def _panels_on_page(page: Any, result: Accuracy) -> None:
    import plotly.graph_objects as go

    wide = (1 - BETWEEN * len(PANELS)) / (len(PANELS) + 1)
    assert result.places.roll is not None
    angles = np.degrees(np.stack([result.places.tilt, result.places.roll], axis=1))
    for k in range(len(PANELS)):
        own, cell = _Panel.of(result, k), {"row": 1, "col": k + 1}
        page.update_xaxes(title_text=own.labels[0], **cell)
        hover = "tilt %{customdata[0]:.4g}°, roll %{customdata[1]:.4g}°<br>%{customdata[2]:.4g} µm<extra></extra>"
        used = np.isfinite(own.values)
        data = np.column_stack([angles[own.points], own.values])[used]
        look = {"customdata": data, "hovertemplate": hover, "showlegend": False}
        if own.y is None:
            page.add_trace(go.Scatter(x=own.x[used], y=own.values[used], mode="lines+markers", **look), **cell)
            page.update_yaxes(type="log" if own.is_log else "linear", **cell)
            continue
        singular = own.singular(result)
        missed = ~used & ~singular
        page.add_trace(crosses(own.x[missed], own.y[missed], listed=k == 0), **cell)
        ring = {"symbol": "circle-open", "size": 8, "color": VERMILLION}
        few = {"x": own.x[singular], "y": own.y[singular], "name": SINGULAR, "showlegend": k == 0 and bool(singular.any())}
        page.add_trace(go.Scatter(mode="markers", marker=ring, hoverinfo="skip", legendgroup=SINGULAR, **few), **cell)
        colours = np.log10(own.values[used]) if own.is_log else own.values[used]
        bar = {
            "x": (k + 1) * wide + (k + 0.05) * BETWEEN,
            "len": 0.9,
            "thickness": 10,
            "tickprefix": "10^" if own.is_log else "",
        }
        marker = {"color": colours, "colorscale": VALUES, "colorbar": bar, "size": 9}
        page.add_trace(go.Scatter(x=own.x[used], y=own.y[used], mode="markers", marker=marker, **look), **cell)
        star = {"symbol": "star", "size": 14, "color": VERMILLION}
        page.add_trace(go.Scatter(x=own.star[:1], y=own.star[1:], marker=star, showlegend=False, hoverinfo="skip"), **cell)
        page.update_yaxes(title_text=own.labels[1], scaleanchor=f"x{k + 1 if k else ''}", **cell)
