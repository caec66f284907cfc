"""Things over time, in panels: motions along a path, simulations."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.show.drawing import title_lines
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, GRID, ORANGE, PURPLE, SKY, VERMILLION
from trivet.space.frame import Frame
from trivet.study.dynamics import force_units
from trivet.study.motion import MotionReport
from trivet.study.simulation import LAW_WORDS, Simulation

SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)
COLUMNS = 2


class Panel(NamedTuple):
    """Series over time."""

    label: str
    """What, and its unit."""
    series: Mapping[str, Any]
    """(n,) by name."""
    has_peaks: bool = False
    """Whether the greatest size of each series is marked."""


def draw_motion(report: MotionReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw what the drives do and give along a path (PNG or self-contained HTML)."""
    heading = [
        f"{report.machine.name}: what a motion asks of the drives",
        f"{mode_words(report.mode)}, {report.trajectory.duration:.4g} s, sigma_min at least {report.sigma_min.min():.3g}",
    ]
    _draw(heading, report.time, list(_of_motion(report)), path, overwrite)


def draw_simulation(result: Simulation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw how a machine moved, and its energies (PNG or self-contained HTML)."""
    title, stand = title_lines(result.machine, result.at.frame, result.mode)
    drives = LAW_WORDS[result.law]
    ended = f"; ended {result.ended}" if result.ended else ""
    drift = f"energy drift {np.abs(result.drift).max():.1e}"
    heading = [title, f"{stand}; {drives}; {drift}{ended}"]
    _draw(heading, result.time, list(_of_simulation(result)), path, overwrite)


def _of_motion(report: MotionReport) -> Iterator[Panel]:
    yield _displacement(report.moving.pose)
    yield Panel("power of the drives, W", dict(zip(report.actuators, report.powers.T, strict=True)), True)
    for unit, way, scale, shown in (("N", "m", 1e3, "mm/s"), ("N m", "rad", np.degrees(1), "°/s")):
        own = [k for k, name in enumerate(report.units) if name == unit]
        if own:
            names = [report.actuators[k] for k in own]
            kind = "force" if way == "m" else "torque"
            speeds = dict(zip(names, report.drives.speed[:, own].T * scale, strict=True))
            yield Panel(f"speed of the drives, {shown}", speeds, True)
            yield Panel(f"{kind} of the drives, {unit}", dict(zip(names, report.drives.force[:, own].T, strict=True)), True)


def _of_simulation(result: Simulation) -> Iterator[Panel]:
    yield _displacement(result.state.pose)
    balance = result.balance
    parts = {"kinetic": balance.kinetic, "weight": np.asarray(balance.potential) - float(balance.potential[0])}
    parts |= {"springs": balance.springs, "friction took": balance.dissipated, "forces put in": balance.put_in}
    energies = {name: np.asarray(values) for name, values in parts.items() if np.any(np.asarray(values) != 0)}
    yield Panel("energy, J", energies or {"kinetic": np.asarray(balance.kinetic)})
    units = force_units(result.machine)
    for unit, kind in (("N", "force"), ("N m", "torque")):
        own = [k for k, name in enumerate(units) if name == unit]
        if own:
            series = {result.actuators[k]: result.forces[:, k] for k in own}
            yield Panel(f"{kind} of the drives, {unit}", series)
    yield Panel("energy drift, relative", {"drift": result.drift})


def _displacement(pose: Frame) -> Panel:
    moved = {axis: 1e3 * (np.asarray(c) - float(c[0])) for axis, c in zip("xyz", pose.origin, strict=True)}
    return Panel("displacement, mm", moved)


def _draw(heading: list[str], time: Any, panels: list[Panel], path: str | os.PathLike[str], overwrite: bool) -> None:
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(heading, time, panels, temporary)


def _picture(heading: list[str], time: Any, panels: list[Panel], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(panels) // COLUMNS)
    height = 1.2 + 2.9 * rows
    figure: Any = Figure(figsize=(15, height), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(heading, (17, 13), strict=True)):
        figure.text(0.02, 1 - (0.4 + 0.35 * line) / height, text, fontsize=size)
    grid = figure.add_gridspec(
        rows, COLUMNS, left=0.06, right=0.985, top=1 - 1.15 / height, bottom=0.6 / height, hspace=0.28, wspace=0.14
    )
    for k, panel in enumerate(panels):
        axes = figure.add_subplot(grid[k // COLUMNS, k % COLUMNS])
        axes.set_axisbelow(True)
        axes.grid(color=GRID, linewidth=0.8)
        axes.spines[["top", "right"]].set_visible(False)
        for (name, values), (colour, is_hidden) in zip(panel.series.items(), _looks(panel), strict=True):
            axes.plot(time, values, color=colour, linewidth=1.6, linestyle=(0, (4, 3)) if is_hidden else "-", label=name)
            if panel.has_peaks:
                peak = int(np.argmax(np.abs(values)))
                axes.plot(time[peak], values[peak], "o", color=colour, markersize=6, markerfacecolor="white", clip_on=False)
        axes.set_xlim(time[0], time[-1])
        axes.set_ylabel(panel.label, fontsize=11)
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(-0.01, 1.0),
            ncols=6,
            fontsize=9,
            frameon=False,
            columnspacing=1.0,
            handlelength=1.4,
        )
        if k + COLUMNS >= len(panels):
            axes.set_xlabel("time, s", fontsize=11)
    figure.savefig(path, format="png")


def _page(heading: list[str], time: Any, panels: list[Panel], path: Path) -> None:
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    rows = -(-len(panels) // COLUMNS)
    page = make_subplots(rows=rows, cols=COLUMNS, shared_xaxes=True, vertical_spacing=0.06, horizontal_spacing=0.08)
    named: set[str] = set()
    for k, panel in enumerate(panels):
        place = {"row": k // COLUMNS + 1, "col": k % COLUMNS + 1}
        for (name, values), (colour, is_hidden) in zip(panel.series.items(), _looks(panel), strict=True):
            line = {"color": colour, "width": 2, "dash": "dash" if is_hidden else "solid"}
            page.add_trace(
                go.Scatter(
                    x=np.asarray(time), y=np.asarray(values), mode="lines", line=line, name=name, legendgroup=name,
                    showlegend=name not in named, hovertemplate=f"{html.escape(name)} %{{y:.5g}}<extra></extra>",
                ),
                **place,
            )  # fmt: skip
            named.add(name)
        page.update_yaxes(title_text=panel.label, showgrid=True, gridcolor=GRID, **place)
        page.update_xaxes(showgrid=True, gridcolor=GRID, **place)
        if k + COLUMNS >= len(panels):
            page.update_xaxes(title_text="time, s", showticklabels=True, **place)
    first, *rest = (html.escape(line) for line in heading)
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 0.98, "yanchor": "top"},
        template="simple_white",
        hovermode="x unified",
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        margin={"t": 130, "b": 60},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="96vh")


def _looks(panel: Panel) -> list[tuple[str, bool]]:
    """Per series its colour, and whether it lies on one drawn before, so that it is to be dashed."""
    drawn: list[Any] = []
    found = []
    for k, values in enumerate(panel.series.values()):
        size = float(np.max(np.abs(values)))
        hidden = any(np.allclose(values, other, rtol=0, atol=0.005 * size) for other in drawn) if size > 0 else bool(drawn)
        found.append((SERIES[k % len(SERIES)], hidden))
        drawn.append(values)
    return found
