"""Least dynamic stiffness over a family of poses, and the band of the responses over frequency."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.show.maps import EXCLUDED, check_suffix
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
    return [
        f"{result.machine.name}, {result.family.name}, {mode_words(result.mode)}: {reached}",
        f"roll {result.policy}, {where}, loss factor {result.loss_factor:g}",
    ]


def _label(entry: str) -> str:
    return f"least 1/|H_{entry}|, {unit_of_least(entry).written}"


def _words(one: Worst) -> str:
    unit = unit_of_least(one.entry)
    return f"least {one.stiffness * unit.factor:.4g} {unit.written} at {one.frequency:.1f} Hz"


def _across(result: Atlas) -> tuple[Any, Any, str, str]:
    """Where the points are in a panel: their x and y (mm), or along a path its coordinate."""
    if result.family.coordinates.shape[1] == 1:
        return result.family.coordinates[:, 0], None, "along the path", ""
    x, y, _ = 1e3 * result.places.position.T
    return x, y, "x, mm", "y, mm"


def _scale(values: Any) -> str:
    """That of an axis: ticks of a logarithmic one want a decade."""
    return "log" if np.nanmax(values) > DECADE * np.nanmin(values) else "linear"


def _picture(result: Atlas, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(result.entries)
    canvas = Figure(figsize=(4.6 * count, 8), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle("\n".join(_title(result)), fontsize=11)
    panels = canvas.subplots(2, count, squeeze=False)
    x, y, across, up = _across(result)
    for k, (entry, one) in enumerate(zip(result.entries, result.worst, strict=True)):
        above, below = panels[0, k], panels[1, k]
        values = result.stiffness[:, k] * unit_of_least(entry).factor
        used = np.isfinite(values)
        if y is None:
            above.plot(x, values, ".-", color=BAND)
            above.set_yscale(_scale(values))
            above.set_ylabel(_label(entry))
        else:
            size = 9000 / max(len(values), 100)
            dots = above.scatter(x[used], y[used], c=values[used], s=size, cmap="cividis", norm="log", linewidths=0)
            above.scatter(x[~used], y[~used], c=EXCLUDED, s=size / 2, marker="x")
            above.plot(*(1e3 * c for c in one.position[:2]), "*", color=MARK, markersize=12)
            above.set_aspect("equal")
            above.set_ylabel(up)
            canvas.colorbar(dots, ax=above, shrink=0.75, label=_label(entry))
        above.set_xlabel(across)
        above.set_title(_words(one), fontsize=10)
        below.fill_between(result.frequency, result.least[k], result.greatest[k], color=BAND, alpha=0.5, linewidth=0)
        below.plot([one.frequency], [1 / one.stiffness], "*", color=MARK, markersize=12)
        below.set_yscale("log")
        below.set_xlabel("Hz")
        below.set_title(f"|H_{entry}| over all poses, SI", fontsize=10)
    canvas.savefig(path, format="png", dpi=120)


def _page(result: Atlas, path: Path) -> None:
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    count = len(result.entries)
    titles = [f"{entry}: {_words(one)}" for entry, one in zip(result.entries, result.worst, strict=True)]
    titles += [f"|H_{entry}| over all poses, SI" for entry in result.entries]
    page = make_subplots(rows=2, cols=count, subplot_titles=titles, horizontal_spacing=0.08)
    x, y, across, up = _across(result)
    assert result.places.roll is not None
    angles = np.degrees(np.stack([result.places.tilt, result.places.roll], axis=1))
    for k, (entry, one) in enumerate(zip(result.entries, result.worst, strict=True)):
        unit, own = unit_of_least(entry), {"row": 1, "col": k + 1}
        values = result.stiffness[:, k] * unit.factor
        data = np.column_stack([angles, values, result.at_frequency[:, k]])
        hover = "tilt %{customdata[0]:.4g}°, roll %{customdata[1]:.4g}°<br>%{customdata[2]:.4g} " + unit.written
        hover += " at %{customdata[3]:.5g} Hz<extra></extra>"
        marker = {"size": 9} if y is None else {"color": np.log10(values), "colorscale": "Cividis", "size": 9}
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
            place = [[1e3 * c] for c in one.position[:2]]
            star = {"symbol": "star", "size": 14, "color": MARK}
            page.add_trace(go.Scatter(x=place[0], y=place[1], marker=star, showlegend=False, hovertext=_words(one)), **own)
            page.update_yaxes(scaleanchor=f"x{k + 1 if k else ''}", title_text=up, **own)
        page.update_xaxes(title_text=across, **own)
        own = {"row": 2, "col": k + 1}
        for edge, fill in ((result.least[k], None), (result.greatest[k], "tonexty")):
            line = {"color": BAND, "width": 1}
            page.add_trace(go.Scatter(x=result.frequency, y=edge, line=line, fill=fill, showlegend=False), **own)
        page.update_yaxes(type="log", **own)
        page.update_xaxes(title_text="Hz", **own)
    page.update_layout(title="<br>".join(_title(result)), template="simple_white", height=820, width=460 * count)
    page.write_html(path, include_plotlyjs=True, full_html=True)
