"""Least dynamic stiffness over a family of poses, and the band of the responses over frequency."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.show.maps import check_suffix, cross_out, crosses
from trivet.show.palette import VALUES
from trivet.study.atlas import Atlas
from trivet.study.response_summary import unit_of_least
from trivet.study.worst import Worst

BAND = "#4477AA"
MARK = "#C8102E"
DECADE = 10.0


def draw_atlas(result: Atlas, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw an atlas (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(result, temporary)


def _title(result: Atlas) -> list[str]:
    reached = f"{int(result.used.sum())} of {len(result.family)} points reached"
    where = "platform centre" if result.point == "platform" else "tool tip"
    low, high = result.frequency[[0, -1]]
    return [
        f"{result.machine.name}, {result.family.name}, {mode_words(result.mode)}: {reached}",
        f"roll {result.policy}, {where}, {low:g} to {high:g} Hz, loss factor {result.loss_factor:g}",
    ]


def _label(entry: str) -> str:
    return f"least 1/|H_{entry}|, {unit_of_least(entry).written}"


def _response(entry: str) -> str:
    return f"|H_{entry}|, 1/({unit_of_least(entry).written})"


def _words(one: Worst, sought: bool) -> str:
    unit = unit_of_least(one.entry)
    if not np.isfinite(one.stiffness):
        return "unbounded at all points"
    return f"worst {'pose' if sought else 'point'}: {one.stiffness * unit.factor:.4g} {unit.written} at {one.frequency:.1f} Hz"


@dataclass(frozen=True)
class _Panel:
    """An entry's values where its coordinates put them: of two coordinates as colours, of one as a curve.

    Of three coordinates the last is gone over: of points at the same place the lowest is shown.
    """

    x: Any
    y: Any
    """None of a curve."""
    values: Any
    points: Any
    """Which points of the atlas these are."""
    star: tuple[float, ...]
    """Where the worst pose is."""
    labels: tuple[str, ...]

    def where(self, mask: Any) -> _Panel:
        """The same of some of the points."""
        y = None if self.y is None else self.y[mask]
        return replace(self, x=self.x[mask], y=y, values=self.values[mask], points=self.points[mask])

    @classmethod
    def of(cls, result: Atlas, k: int) -> _Panel:
        axes, coordinates = result.family.axes[:2], result.family.coordinates[:, :2]
        values = result.stiffness[:, k] * unit_of_least(result.entries[k]).factor
        values[np.isinf(values)] = np.nan
        order = np.argsort(values)
        _, first = np.unique(np.round(coordinates[order] / result.family.spacing[:2], 6), axis=0, return_index=True)
        points = order[first]
        place = coordinates[points] * [axis.factor for axis in axes]
        labels = tuple(", ".join(filter(None, (axis.name, axis.unit))) for axis in axes)
        star = tuple(1e3 * result.worst[k].position["xyz".index(axis.name)] for axis in axes if axis.name in "xyz")
        return cls(place[:, 0], place[:, 1] if len(axes) > 1 else None, values[points], points, star, labels)


def _scale(values: Any) -> str:
    """That of an axis: ticks of a logarithmic one want a decade."""
    known = values[np.isfinite(values)]
    return "log" if len(known) and known.max() > DECADE * known.min() else "linear"


def _picture(result: Atlas, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(result.entries)
    canvas = Figure(figsize=(max(4.6 * count, 8), 8), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle("\n".join(_title(result)), fontsize=11)
    panels = canvas.subplots(2, count, squeeze=False)
    for k, (entry, one) in enumerate(zip(result.entries, result.worst, strict=True)):
        above, below, own = panels[0, k], panels[1, k], _Panel.of(result, k)
        x, y, values = own.x, own.y, own.values
        used = np.isfinite(values)
        if y is None:
            above.plot(x, values, ".-", color=BAND)
            for place in own.star:
                above.plot([place], [one.stiffness * unit_of_least(entry).factor], "*", color=MARK, markersize=12)
            above.set_yscale(_scale(values))
            above.set_ylabel(_label(entry))
        else:
            size = 9000 / max(len(values), 100)
            dots = above.scatter(x[used], y[used], c=values[used], s=size, cmap=VALUES, norm=_scale(values), linewidths=0)
            cross_out(above, x[~used], y[~used], size)
            above.plot(*own.star, "*", color=MARK, markersize=12)
            above.set_aspect("equal")
            above.set_ylabel(own.labels[1])
            canvas.colorbar(dots, ax=above, shrink=0.75, label=_label(entry))
        above.set_xlabel(own.labels[0])
        above.set_title(_words(one, result.sought), fontsize=10)
        per = 1 / unit_of_least(entry).factor
        band = result.least[k] * per, result.greatest[k] * per
        below.fill_between(result.frequency, *band, color=BAND, alpha=0.5, linewidth=0)
        for edge in band:
            below.plot(result.frequency, edge, color=BAND, linewidth=0.7)
        below.plot([one.frequency], [per / one.stiffness], "*", color=MARK, markersize=12)
        below.set_ylabel(_response(entry))
        below.set_yscale("log")
        below.set_xlabel("frequency, Hz")
        below.set_title("over all poses", fontsize=10)
    canvas.savefig(path, format="png", dpi=120)


def _page(result: Atlas, path: Path) -> None:
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    count = len(result.entries)
    titles = [f"{entry}: {_words(one, result.sought)}" for entry, one in zip(result.entries, result.worst, strict=True)]
    titles += ["over all poses"] * count
    page = make_subplots(rows=2, cols=count, subplot_titles=titles, horizontal_spacing=0.08)
    assert result.places.roll is not None
    angles = np.degrees(np.stack([result.places.tilt, result.places.roll], axis=1))
    for k, (entry, one) in enumerate(zip(result.entries, result.worst, strict=True)):
        unit, panel, own = unit_of_least(entry), _Panel.of(result, k), {"row": 1, "col": k + 1}
        if panel.y is not None:
            missed = ~np.isfinite(panel.values)
            page.add_trace(crosses(panel.x[missed], panel.y[missed], listed=k == 0), **own)
            panel = panel.where(~missed)
        x, y, values = panel.x, panel.y, panel.values
        data = np.column_stack([angles[panel.points], values, result.at_frequency[panel.points, k]])
        hover = "tilt %{customdata[0]:.4g}°, roll %{customdata[1]:.4g}°<br>%{customdata[2]:.4g} " + unit.written
        hover += " at %{customdata[3]:.5g} Hz<extra></extra>"
        marker = {"size": 9} if y is None else {"color": np.log10(values), "colorscale": VALUES, "size": 9}
        page.add_trace(
            go.Scatter(
                x=x, y=values if y is None else y, mode="lines+markers" if y is None else "markers", marker=marker,
                customdata=data, hovertemplate=hover, showlegend=False,
            ),
            **own,
        )  # fmt: skip
        if y is None:
            page.update_yaxes(type=_scale(values), title_text=_label(entry), **own)
        else:
            star = {"symbol": "star", "size": 14, "color": MARK}
            page.add_trace(
                go.Scatter(
                    x=panel.star[:1], y=panel.star[1:], marker=star, showlegend=False, hovertext=_words(one, result.sought)
                ),
                **own,
            )
            page.update_yaxes(scaleanchor=f"x{k + 1 if k else ''}", title_text=panel.labels[1], **own)
        page.update_xaxes(title_text=panel.labels[0], **own)
        own = {"row": 2, "col": k + 1}
        for edge, fill in ((result.least[k] / unit.factor, None), (result.greatest[k] / unit.factor, "tonexty")):
            line = {"color": BAND, "width": 1}
            page.add_trace(go.Scatter(x=result.frequency, y=edge, line=line, fill=fill, showlegend=False), **own)
        page.update_yaxes(type="log", title_text=_response(entry), **own)
        page.update_xaxes(title_text="frequency, Hz", **own)
    page.update_layout(title="<br>".join(_title(result)), template="simple_white", height=820, width=max(460 * count, 760))
    page.update_layout(legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 1.06, "yanchor": "bottom"})
    page.write_html(path, include_plotlyjs=True, full_html=True)
