"""Singularities over a surface, seen from above: a field in colour, the Type 2 singularities as lines."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from trivet.files import replacing
from trivet.show.maps import check_suffix, cross_out, crosses
from trivet.show.palette import VALUES
from trivet.study.singularity_map import SingularityMap

CURVE = "#C8102E"
_SIGNED = ("det J_x", "1/det J_G^-1", "1/det J^-1")
"""Quantities whose sign matters: coloured about zero, and cut off where they run away."""


def draw_singularities(result: SingularityMap, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw the map's quantity over the check points, and the curves on which det J_x is zero (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(result, temporary)


def _title(result: SingularityMap) -> list[str]:
    reached = f"{int(result.used.sum())} of {len(result.surface)} points reached"
    mode = f"mode {result.mode}, " if result.mode else ""
    curves = f"{len(result.curves)} curve{'' if len(result.curves) == 1 else 's'} of Type 2 singularities"
    return [f"{result.machine.name}, {result.surface.name}", f"{mode}roll {result.policy}: {reached}, {curves}"]


def _values(result: SingularityMap) -> tuple[Any, str, tuple[float, float]]:
    """Values (n,) in the unit of the figures, their name with the unit, and the range of the colours."""
    values, unit = result.values, result.unit()
    if unit.startswith("m^"):
        values, unit = values * 1e3 ** int(unit[2:]), "m" + unit
    finite = values[np.isfinite(values)]
    if result.quantity in _SIGNED:
        # Next to a singularity the inverse outgrows every scale; what a tenth of the points exceed is cut off.
        most = float(np.quantile(np.abs(finite), 0.9)) if len(finite) else 1.0
        limits = (-most, most)
    else:
        limits = (0.0, float(finite.max()) if len(finite) else 1.0)
    # At zero tilt 1/det J^-1 is infinite; it takes the last colour of its side.
    values = np.clip(values, -1e300, 1e300)
    return values, f"{result.quantity}, {unit}" if unit else result.quantity, limits


def _picture(result: SingularityMap, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    values, label, (low, high) = _values(result)
    canvas = Figure(figsize=(7, 6.4), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle("\n".join(_title(result)), fontsize=11)
    axes = canvas.subplots()
    x, y, _ = 1e3 * result.surface.position.T
    shown = ~np.isnan(values)
    size = 22000 / max(len(values), 100)
    colours = "RdBu_r" if result.quantity in _SIGNED else VALUES
    dots = axes.scatter(x[shown], y[shown], c=values[shown], s=size, cmap=colours, vmin=low, vmax=high, linewidths=0)
    cross_out(axes, x[~shown], y[~shown], size)
    for k, curve in enumerate(result.curves):
        across, up, _ = 1e3 * curve.surface.position.T
        axes.plot(across, up, color=CURVE, linewidth=2, label=None if k else "det J_x = 0")
    canvas.colorbar(dots, ax=axes, shrink=0.75, label=label, extend="both" if result.quantity in _SIGNED else "neither")
    axes.set_aspect("equal")
    axes.set_xlabel("x, mm")
    axes.set_ylabel("y, mm")
    if result.curves:
        axes.legend(loc="upper right", fontsize=9)
    canvas.savefig(path, format="png", dpi=120)


def _page(result: SingularityMap, path: Path) -> None:
    import plotly.graph_objects as go

    values, label, (low, high) = _values(result)
    colours = "RdBu_r" if result.quantity in _SIGNED else VALUES
    x, y, _ = 1e3 * result.surface.position.T
    shown = ~np.isnan(values)
    marker = {
        "color": values[shown], "colorscale": colours, "cmin": low, "cmax": high, "size": 12,
        "colorbar": {"title": {"text": label, "side": "right"}, "thickness": 12},
    }  # fmt: skip
    hover = (
        f"x %{{x:.4g}} mm, y %{{y:.4g}} mm<br>tilt %{{customdata[0]:.4g}}°, roll %{{customdata[1]:.4g}}°<br>{result.quantity} "
    )
    page = go.Figure(
        go.Scatter(
            x=x[shown], y=y[shown], mode="markers", marker=marker, showlegend=False,
            customdata=np.degrees(np.stack([result.surface.tilt, result.roll], axis=1))[shown],
            hovertemplate=hover + "%{marker.color:.5g}<extra></extra>",
        )
    )  # fmt: skip
    page.add_trace(crosses(x[~shown], y[~shown]))
    for k, curve in enumerate(result.curves):
        across, up, _ = 1e3 * curve.surface.position.T
        data = np.degrees(np.stack([curve.surface.tilt, curve.roll], axis=1))
        line = go.Scatter(x=across, y=up, mode="lines", line={"color": CURVE, "width": 3}, name="det J_x = 0", customdata=data)
        page.add_trace(line.update(showlegend=k == 0, legendgroup="zero", hovertemplate=hover + "singular<extra></extra>"))
    page.update_yaxes(scaleanchor="x", title_text="y, mm")
    page.update_xaxes(title_text="x, mm")
    title = {"text": "<br>".join(_title(result)), "font": {"size": 15}}
    page.update_layout(title=title, template="simple_white", height=700, width=800, legend={"x": 0.02, "y": 0.98})
    page.write_html(path, include_plotlyjs=True, full_html=True)
