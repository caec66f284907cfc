"""Tilts: of one machine over the azimuth, of several over the radius of the sphere (the paper's Fig 3)."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, GRID, ORANGE, PURPLE, SKY, VERMILLION
from trivet.study.tilt import TiltReport, TiltStudy

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)


class Line(NamedTuple):
    """One line of a figure."""

    name: str
    x: Any
    y: Any
    colour: str
    is_dashed: bool


def draw_tilts(study: TiltStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw tilts (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(study, temporary)


def _lines(study: TiltStudy) -> tuple[str, list[Line]]:
    """What the horizontal axis is, and the lines."""
    if len(study.reports) == 1:
        (report,) = study.reports
        azimuths = np.degrees(np.append(report.grid.azimuths, 2 * np.pi))
        kinds = (("pose by pose", report.unbroken, BLUE, False), ("from home", report.connected, ORANGE, True))
        return "azimuth, °", [Line(n, azimuths, np.degrees(np.append(v, v[0])), c, d) for n, v, c, d in kinds]
    groups: dict[tuple[str, ...], list[TiltReport]] = {}
    for report in study.reports:
        key: tuple[str, ...] = (report.machine.name, report.neutral, f"z0 = {report.grid.centre[2] * 1e3:g} mm")
        groups.setdefault(key, []).append(report)
    differing = [k for k in range(3) if len({key[k] for key in groups}) > 1] or [0]
    found = []
    for number, (key, reports) in enumerate(groups.items()):
        own = sorted(reports, key=lambda report: report.grid.radius)
        radii, colour = [1e3 * r.grid.radius for r in own], SERIES[number % len(SERIES)]
        name = ", ".join(key[k] for k in differing)
        found.append(Line(name, radii, np.degrees([r.tilt for r in own]), colour, False))
        found.append(Line(f"{name}, from home", radii, np.degrees([r.connected_tilt for r in own]), colour, True))
    return "radius of the sphere, mm", found


def _title(study: TiltStudy) -> str:
    names = ", ".join(dict.fromkeys(report.machine.name for report in study.reports))
    neutral = ", ".join(dict.fromkeys(report.neutral for report in study.reports))
    return f"{names}: tilt with the best roll, neutral axis {neutral}"


def _picture(study: TiltStudy, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    label, lines = _lines(study)
    canvas = Figure(figsize=(9, 5.6), layout="constrained")
    FigureCanvasAgg(canvas)
    axes = canvas.subplots()
    axes.grid(color=GRID)
    axes.spines[["top", "right"]].set_visible(False)
    for line in lines:
        style: dict[str, Any] = {
            "linestyle": (0, (4, 3)) if line.is_dashed else "-",
            "marker": "o" if len(line.x) < 30 else None,
        }
        axes.plot(line.x, line.y, color=line.colour, label=line.name, markersize=4, **style)
    axes.set_xlabel(label)
    axes.set_ylabel("tilt, °")
    axes.set_ylim(0, 1.08 * max((float(np.nanmax(line.y)) for line in lines if np.any(np.isfinite(line.y))), default=1.0))
    axes.set_title(_title(study), loc="left", fontsize=11, wrap=True)
    axes.legend(frameon=False, fontsize=9)
    canvas.savefig(path, format="png", dpi=120)


def _page(study: TiltStudy, path: Path) -> None:
    import plotly.graph_objects as go

    label, lines = _lines(study)
    page = go.Figure()
    for line in lines:
        style = {"color": line.colour, "width": 2, "dash": "dash" if line.is_dashed else "solid"}
        page.add_trace(go.Scatter(x=line.x, y=line.y, name=html.escape(line.name), line=style, mode="lines+markers"))
    page.update_layout(
        title=html.escape(_title(study)), template="simple_white", xaxis_title=label, yaxis_title="tilt, °",
        yaxis={"rangemode": "tozero", "showgrid": True, "gridcolor": GRID}, xaxis={"showgrid": True, "gridcolor": GRID},
    )  # fmt: skip
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")
