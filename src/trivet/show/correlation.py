"""Measured responses over those of a machine (paper Fig 12), how alike all are over frequency, and which modes are which."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.kinematics.mode import mode_text
from trivet.measure.channels import unit_of
from trivet.measure.correlation import mean
from trivet.show.drawing import title_lines
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, GRID, ORANGE, PURPLE
from trivet.study.correlate import Correlation, ModesBeside, ShownCorrelation

MOST = 6
"""Functions in a figure when none are named: those that respond most."""
FLOOR = 1e-7
"""Of the greatest magnitude, what is not drawn: computed noughts by symmetry are rounding."""
COLUMNS = 2
MEASURED, COMPUTED = BLUE, ORANGE
SHAPE, SIZE = GREEN, PURPLE
QUANTITIES = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}


class Panel(NamedTuple):
    """One function, measured and computed."""

    title: str
    axis: str
    """What the magnitude is, with its unit."""
    magnitude: tuple[np.ndarray, np.ndarray]
    """Measured and computed, (n,); NaN below the floor."""
    phase: tuple[np.ndarray, np.ndarray]
    """deg; NaN where it jumps from one end of the scale to the other."""


def draw_correlation(shown: ShownCorrelation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a correlation (PNG or self-contained HTML)."""
    suffix, result = check_suffix(path), shown.whole
    chosen = result.greatest(MOST) if shown.functions is None else shown.functions
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(result, [panel(result, k) for k in chosen], temporary)


def title(result: Correlation) -> list[str]:
    """The machine, how it stands, what is compared."""
    at = result.placed
    source = f"{result.measured.source}; " if result.measured.source else ""
    return [
        *title_lines(at.machine, at.frame, mode_text(at.machine, at.signs)),
        f"{source}{len(result.measured)} functions; FRAC {mean(result.frac):.3f} in the mean, FAAC {mean(result.faac):.3f}; "
        f"computed with loss factor {result.loss_factor:g}",
    ]


def panel(result: Correlation, number: int) -> Panel:
    """One function as it is drawn."""
    measured = result.measured
    motion, response, reference = measured.motions[number], measured.responses[number], measured.references[number]
    both = measured.values[number], result.computed.values[number]
    least = FLOOR * max(float(np.nanmax(np.abs(values))) for values in both)
    magnitudes, phases = [], []
    for values in both:
        size, phase = np.abs(values), np.degrees(np.angle(values))
        phase[1:][np.abs(np.diff(phase)) > 180] = np.nan
        magnitudes.append(np.where(size > least, size, np.nan))
        phases.append(np.where(size > least, phase, np.nan))
    words = f"{measured.labels[number]}:  FRAC {result.frac[number]:.3f}, FAAC {result.faac[number]:.3f}"
    axis = f"{QUANTITIES[motion]}, {unit_of(motion, response, reference)}"
    return Panel(words, axis, (magnitudes[0], magnitudes[1]), (phases[0], phases[1]))


def _picture(result: Correlation, panels: list[Panel], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(COLUMNS, max(len(panels), 1))
    rows = -(-len(panels) // columns)
    height = 1.4 + 3.6 * rows + 3.2
    figure: Any = Figure(figsize=(max(12, 7 * columns), height), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(result), (17, 13, 12), strict=True)):
        figure.text(0.02, 1 - (0.42 + 0.31 * line) / height, text, fontsize=size)
    top, bottom = 1 - 1.55 / height, 0.62 / height
    split = bottom + 2.35 / height
    grid = figure.add_gridspec(
        rows, columns, left=0.075, right=0.975, top=top, bottom=split + 0.95 / height, hspace=0.32, wspace=0.2
    )
    for k, one in enumerate(panels):
        own = grid[k // columns, k % columns].subgridspec(2, 1, height_ratios=[3, 1], hspace=0.08)
        upper = figure.add_subplot(own[0])
        _plot(result.measured.frequency, one, upper, figure.add_subplot(own[1], sharex=upper))
        if k == 0:
            figure.legend(*upper.get_legend_handles_labels(), loc="upper right", ncols=2, fontsize=12, frameon=False)
    below = figure.add_gridspec(1, 2, left=0.075, right=0.975, top=split, bottom=bottom, width_ratios=[1.6, 1], wspace=0.2)
    _plot_signatures(result, figure.add_subplot(below[0] if result.modes is not None else below[:]))
    if result.modes is not None:
        _plot_mac(result.modes, figure.add_subplot(below[1]), figure)
    figure.savefig(path, format="png")


def _bare(axes: Any) -> None:
    axes.set_axisbelow(True)
    axes.grid(color=GRID, linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)


def _plot(frequency: np.ndarray, one: Panel, upper: Any, lower: Any) -> None:
    for axes, curves in ((upper, one.magnitude), (lower, one.phase)):
        _bare(axes)
        axes.plot(frequency, curves[0], color=MEASURED, linewidth=1.3, label="measured")
        axes.plot(frequency, curves[1], color=COMPUTED, linewidth=1.5, linestyle=(0, (5, 2)), label="computed")
    upper.set_yscale("log")
    upper.set_xlim(frequency[0], max(frequency[-1], frequency[0] + 1e-9))
    upper.set_title(one.title, loc="left", fontsize=12)
    upper.set_ylabel(one.axis, fontsize=11)
    upper.tick_params(labelbottom=False)
    lower.set_ylim(-190, 190)
    lower.set_yticks([-180, 0, 180])
    lower.set_ylabel("phase, °", fontsize=11)


def _plot_signatures(result: Correlation, axes: Any) -> None:
    _bare(axes)
    frequency = result.measured.frequency
    axes.plot(frequency, result.csac, color=SHAPE, linewidth=1.5, label="CSAC, of the shape")
    axes.plot(frequency, result.csf, color=SIZE, linewidth=1.5, linestyle=(0, (5, 2)), label="CSF, with the size")
    axes.set_xlim(frequency[0], max(frequency[-1], frequency[0] + 1e-9))
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("frequency, Hz", fontsize=12)
    axes.set_title("all functions together", loc="left", fontsize=12)
    axes.legend(loc="lower right", bbox_to_anchor=(1.01, 0.99), ncols=2, fontsize=11, frameon=False)


def _plot_mac(modes: ModesBeside, axes: Any, figure: Any) -> None:
    seen = axes.imshow(modes.mac, cmap="cividis", vmin=0, vmax=1, aspect="auto")
    axes.set_yticks(range(len(modes.measured.frequency)), [f"{f:.1f}" for f in modes.measured.frequency])
    axes.set_xticks(
        range(len(modes.computed.frequency)), [f"{f:.1f}" for f in modes.computed.frequency], rotation=45, ha="right"
    )
    axes.plot([p.computed for p in modes.pairs], [p.measured for p in modes.pairs], "s", color="none", markeredgecolor=ORANGE,
              markersize=9, markeredgewidth=1.8)  # fmt: skip
    axes.set_ylabel("measured, Hz", fontsize=11)
    axes.set_title("MAC against computed modes, Hz; pairs framed", loc="left", fontsize=12)
    axes.tick_params(labelsize=9)
    figure.colorbar(seen, ax=axes, pad=0.02)


def _lists(values: np.ndarray) -> list[float | None]:
    """Numbers with gaps as plotly takes them."""
    return [float(value) if np.isfinite(value) else None for value in values]


def _page(result: Correlation, panels: list[Panel], path: Path) -> None:
    from plotly.subplots import make_subplots

    count = 2 * len(panels) + 1 + (result.modes is not None)
    tall = [3.0, 1.0] * len(panels) + [2.0] + ([3.0] if result.modes is not None else [])
    names = [text for one in panels for text in (html.escape(one.title), "")] + ["all functions together over frequency, Hz"]
    names += ["MAC of measured and computed modes; pairs framed"] if result.modes is not None else []
    page = make_subplots(rows=count, cols=1, row_heights=tall, vertical_spacing=0.25 / count, subplot_titles=names)
    page.update_annotations(x=0, xanchor="left", font={"size": 14})
    frequency = result.measured.frequency.round(9)
    for k, one in enumerate(panels):
        for row, unit, curves in ((2 * k + 1, one.axis.split(", ")[1], one.magnitude), (2 * k + 2, "°", one.phase)):
            for name, values, colour, dash in (
                ("measured", curves[0], MEASURED, "solid"),
                ("computed", curves[1], COMPUTED, "dash"),
            ):
                page.add_scatter(
                    x=frequency, y=_lists(values), mode="lines", name=name, legendgroup=name, showlegend=row == 1,
                    line={"color": colour, "width": 2, "dash": dash, "simplify": False},
                    hovertemplate=f"{name} %{{y:.4g}} {html.escape(unit)} at %{{x:.2f}} Hz<extra></extra>", row=row, col=1,
                )  # fmt: skip
        page.update_yaxes(type="log", title_text=one.axis, exponentformat="power", row=2 * k + 1, col=1)
        page.update_yaxes(title_text="phase, °", range=[-190, 190], tickvals=[-180, 0, 180], row=2 * k + 2, col=1)
        page.update_xaxes(matches="x", row=2 * k + 1, col=1)
        page.update_xaxes(matches="x", row=2 * k + 2, col=1)
    _signatures(result, page, 2 * len(panels) + 1)
    if result.modes is not None:
        _mac(result.modes, page, count)
    first, *rest = (html.escape(line) for line in title(result))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_xaxes(showgrid=True, gridcolor=GRID)
    page.update_yaxes(showgrid=True, gridcolor=GRID)
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 1 - 20 / (200 + 190 * count), "yanchor": "top"},
        template="simple_white", legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 1, "yanchor": "bottom"},
        margin={"t": 150, "b": 60}, height=200 + 190 * count,
    )  # fmt: skip
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True)


def _signatures(result: Correlation, page: Any, row: int) -> None:
    for name, values, colour, dash in (("CSAC", result.csac, SHAPE, "solid"), ("CSF", result.csf, SIZE, "dash")):
        page.add_scatter(
            x=result.measured.frequency.round(9), y=_lists(values), mode="lines", name=name,
            line={"color": colour, "width": 2, "dash": dash},
            hovertemplate=f"{name} %{{y:.4f}} at %{{x:.2f}} Hz<extra></extra>", row=row, col=1,
        )  # fmt: skip
    page.update_yaxes(range=[0, 1.02], row=row, col=1)
    page.update_xaxes(matches="x", row=row, col=1)


def _mac(modes: ModesBeside, page: Any, row: int) -> None:
    names = [[f"{k + 1}: {f:.2f} Hz" for k, f in enumerate(own.frequency)] for own in (modes.computed, modes.measured)]
    page.add_heatmap(
        x=names[0], y=names[1], z=[_lists(line) for line in modes.mac], zmin=0, zmax=1, colorscale="Cividis", showscale=False,
        hovertemplate="measured %{y}, computed %{x}: MAC %{z:.4f}<extra></extra>", row=row, col=1,
    )  # fmt: skip
    page.add_scatter(
        x=[names[0][p.computed] for p in modes.pairs], y=[names[1][p.measured] for p in modes.pairs], mode="markers",
        marker={"symbol": "square-open", "size": 16, "color": ORANGE, "line": {"width": 2}}, name="pairs", showlegend=False,
        hoverinfo="skip", row=row, col=1,
    )  # fmt: skip
    page.update_yaxes(autorange="reversed", title_text="measured", type="category", row=row, col=1)
    page.update_xaxes(title_text="computed", type="category", row=row, col=1)
