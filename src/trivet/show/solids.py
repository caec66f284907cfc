"""Receptances of a machine of beams and of the same with solids, in one picture."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any

import numpy as np

from trivet.files import replacing
from trivet.show.drawing import title_lines
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, ORANGE
from trivet.study.solid_check import SolidCheck

SERIES = {"x": BLUE, "y": ORANGE, "z": GREEN}
MICRO = 1e6
"""um/N per m/N."""


def draw_solids(check: SolidCheck, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw both receptances (PNG or self-contained HTML): beams thin and dashed, solids full."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(check, temporary)


def title(check: SolidCheck) -> list[str]:
    """The machine, how it stands, what is shown."""
    names = ", ".join(name for solid in check.parts for name in solid.names)
    names = names if len(names) < 90 else f"{sum(len(solid.names) for solid in check.parts)} parts"
    return [
        *title_lines(check.at.machine, check.at.frame, check.at.mode),
        f"receptance at the platform, loss factor {check.loss_factor:g}; solids: {names}",
    ]


def curves(check: SolidCheck) -> dict[tuple[str, str], np.ndarray]:
    """(n,) magnitudes in um/N by direction and side; directions that coincide are one."""
    found: dict[tuple[str, str], np.ndarray] = {}
    for axis, name in enumerate(SERIES):
        for side, own in (("beams", check.beams), ("solids", check.solids)):
            magnitude = MICRO * np.abs(own.receptance[:, axis, axis])
            alike = [key for key, other in found.items() if key[1] == side and np.allclose(other, magnitude, rtol=0.01, atol=0)]
            if alike:
                found[f"{alike[0][0]} and {name}", side] = found.pop(alike[0])
            else:
                found[name, side] = magnitude
    return found


def _picture(check: SolidCheck, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(12, 8), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(check), (17, 13, 13), strict=True)):
        figure.text(0.02, 0.95 - 0.038 * line, text, fontsize=size)
    axes = figure.add_axes((0.075, 0.08, 0.9, 0.71))
    for (name, side), magnitude in curves(check).items():
        style = {"linestyle": (0, (5, 3)), "linewidth": 1.3} if side == "beams" else {"linewidth": 2.0, "alpha": 0.65}
        axes.plot(check.frequency, magnitude, color=SERIES[name[0]], label=f"{name}, {side}", **style)
    axes.set_axisbelow(True)
    axes.grid(color="#EBEBEB", linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_yscale("log")
    axes.set_xlim(check.frequency[0], check.frequency[-1])
    axes.set_xlabel("frequency, Hz", fontsize=12)
    axes.set_ylabel("receptance, µm/N", fontsize=12)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.005), ncols=6, fontsize=11, frameon=False)
    figure.savefig(path, format="png")


def _page(check: SolidCheck, path: Path) -> None:
    import plotly.graph_objects as go

    page = go.Figure()
    for (name, side), magnitude in curves(check).items():
        dashed = side == "beams"
        line = {"color": SERIES[name[0]], "width": 1.5 if dashed else 2.5, "dash": "dash" if dashed else "solid"}
        page.add_trace(
            go.Scatter(
                x=check.frequency.round(6), y=magnitude, mode="lines", line=line, name=f"{name}, {side}",
                hovertemplate=f"{name}, {side} %{{y:.4g}} µm/N<extra></extra>",
            )
        )  # fmt: skip
    first, *rest = (html.escape(line) for line in title(check))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_xaxes(title_text="frequency, Hz", showgrid=True, gridcolor="#EBEBEB")
    page.update_yaxes(type="log", title_text="receptance, µm/N", exponentformat="power", showgrid=True, gridcolor="#EBEBEB")
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 0.97, "yanchor": "top"},
        template="simple_white",
        hovermode="x unified",
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        margin={"t": 140, "b": 60},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")
