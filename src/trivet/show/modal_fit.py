"""A modal fit: poles of all orders over the sum of magnitudes, and measured beside synthesised functions."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.measure.channels import unit_of
from trivet.measure.modal.model import ModalFit, driving_points
from trivet.show.maps import check_suffix
from trivet.show.palette import BLUE, GREEN, GREY, GRID, ORANGE, VERMILLION

CURVE = "#B8B8B8"
SHOWN = 4
"""Functions that are drawn."""


class Shown(NamedTuple):
    """One function."""

    name: str
    unit: str
    frac: float
    measured: np.ndarray
    """(n,)"""
    synthesised: np.ndarray


def draw_modal_fit(result: ModalFit, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a modal fit (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            _picture(result, temporary)
        else:
            _page(result, temporary)


def title(result: ModalFit) -> list[str]:
    """What was measured, and what was found."""
    count, outside = len(result), len(result.whole) - len(result)
    beyond = f" and {outside} outside the band" if outside else ""
    return [
        result.functions.source or "measured responses",
        f"responses: {len(result.responses)}, references: {len(result.references)}; modes: {count}{beyond}, "
        f"FRAC {result.mean_frac:.4f} in the mean",
    ]


def shown(result: ModalFit) -> list[Shown]:
    """Driving points first, then the functions that are told least; those that are mostly noise where there are no others."""
    known = result.clear if np.any(result.clear) else result.band.known
    places = [(o, i) for o, i, _ in driving_points(result.responses, result.references) if known[o, i]][: SHOWN - 1]
    worst = np.argwhere(known)[np.argsort(result.frac[known], kind="stable")]
    chosen = dict.fromkeys([*places, *((int(o), int(i)) for o, i in worst)])
    measured, synthesised = result.measured, result.synthesis()
    return [
        Shown(
            f"{result.responses[o]} / {result.references[i]}",
            unit_of(result.motions[o, i], result.responses[o], result.references[i]),
            float(result.frac[o, i]),
            measured[o, i],
            synthesised[o, i],
        )
        for o, i in list(chosen)[:SHOWN]
    ]


def total(result: ModalFit) -> np.ndarray:
    """(n,) sum of the magnitudes, each against its root mean square."""
    size = np.abs(result.measured)
    found: np.ndarray = np.nansum(size / np.sqrt(np.nanmean(size**2, axis=-1, keepdims=True)), axis=(0, 1))
    return found


def kinds(result: ModalFit) -> list[tuple[str, np.ndarray, str, str]]:
    """Poles of the diagram by what is stable: words, which, colour, marker of matplotlib."""
    diagram = result.diagram
    partly = diagram.in_frequency & ~diagram.stable
    return [
        ("not stable", ~diagram.in_frequency, CURVE, "x"),
        ("stable in frequency", partly, ORANGE, "o"),
        ("stable in damping and participation too", diagram.stable, BLUE, "o"),
    ]


def _picture(result: ModalFit, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(12, 12), dpi=100)
    FigureCanvasAgg(figure)
    for line, (text, size) in enumerate(zip(title(result), (17, 13), strict=True)):
        figure.text(0.02, 0.967 - 0.026 * line, text, fontsize=size)
    grid = figure.add_gridspec(
        3, 2, height_ratios=[5, 3, 3], left=0.075, right=0.935, top=0.89, bottom=0.05, hspace=0.3, wspace=0.22
    )
    _diagram(result, figure.add_subplot(grid[0, :]))
    drawn = shown(result)
    for k, one in enumerate(drawn):
        axes = figure.add_subplot(grid[1 + k // 2, k % 2])
        axes.semilogy(result.functions.frequency, np.abs(one.measured), ".", color=GREY, markersize=2.5, label="measured")
        axes.semilogy(result.functions.frequency, np.abs(one.synthesised), color=VERMILLION, linewidth=1.3, label="synthesised")
        axes.set_title(f"{one.name}, FRAC {one.frac:.4f}", fontsize=11, loc="left")
        axes.set_ylabel(one.unit, fontsize=10)
        if k + 2 >= len(drawn):
            axes.set_xlabel("frequency, Hz", fontsize=11)
        _plain(axes, result)
        if k == 0:
            axes.legend(loc="lower right", fontsize=9, frameon=False, ncols=2, bbox_to_anchor=(1.02, 0.98))
    figure.savefig(path, format="png")


def _plain(axes: Any, result: ModalFit) -> None:
    axes.set_axisbelow(True)
    axes.grid(color=GRID, linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlim(result.functions.frequency[0], result.functions.frequency[-1])


def _diagram(result: ModalFit, axes: Any) -> None:
    _plain(axes, result)
    axes.semilogy(result.functions.frequency, total(result), color=CURVE, linewidth=1.2)
    axes.set_ylabel("sum of magnitudes, each against its root mean square", fontsize=10)
    axes.set_xlabel("frequency, Hz", fontsize=11)
    right = axes.twinx()
    right.spines[["top", "left"]].set_visible(False)
    right.set_ylabel("order", fontsize=11)
    for k, frequency in enumerate(result.frequency):
        right.axvline(frequency, color=GREEN, linewidth=1.0, linestyle=(0, (4, 3)), label=None if k else "modes")
    for words, which, colour, marker in kinds(result):
        size = 9 if marker == "x" else 16
        right.scatter(
            result.diagram.frequency[which],
            result.diagram.order[which],
            s=size,
            color=colour,
            marker=marker,
            linewidths=0.8,
            label=words,
        )
    right.set_ylim(0, result.diagram.order.max() + 1)
    right.legend(loc="lower right", bbox_to_anchor=(1.01, 1.0), ncols=4, fontsize=10, frameon=False, columnspacing=1.2)


def _page(result: ModalFit, path: Path) -> None:
    from plotly.subplots import make_subplots

    drawn = shown(result)
    names = [f"{one.name}, FRAC {one.frac:.4f}" for one in drawn]
    page = make_subplots(
        rows=3, cols=2, row_heights=[0.45, 0.275, 0.275], vertical_spacing=0.1, horizontal_spacing=0.1,
        specs=[[{"colspan": 2, "secondary_y": True}, None], [{}, {}], [{}, {}]], subplot_titles=["", *names],
    )  # fmt: skip
    _diagram_traces(result, page)
    frequency = result.functions.frequency.round(6)
    for k, one in enumerate(drawn):
        at = {"row": 2 + k // 2, "col": 1 + k % 2}
        for name, values, style in (
            ("measured", one.measured, {"mode": "markers", "marker": {"color": GREY, "size": 3}}),
            ("synthesised", one.synthesised, {"mode": "lines", "line": {"color": VERMILLION, "width": 1.5}}),
        ):
            page.add_scatter(
                x=frequency, y=np.abs(values).tolist(), name=name, legendgroup=name, showlegend=k == 0,
                hovertemplate=f"%{{x:.2f}} Hz: %{{y:.4g}} {one.unit}<extra>{name}</extra>", **style, **at,
            )  # fmt: skip
        page.update_yaxes(type="log", title_text=one.unit, exponentformat="power", **at)
        page.update_xaxes(title_text="frequency, Hz" if k + 2 >= len(drawn) else None, **at)
    first, *rest = (html.escape(line) for line in title(result))
    small = "".join(f'<br><span style="font-size:13px">{line}</span>' for line in rest)
    page.update_xaxes(showgrid=True, gridcolor=GRID, range=[float(frequency[0]), float(frequency[-1])])
    page.update_layout(
        title={"text": first + small, "font": {"size": 17}, "x": 0.02, "y": 0.98, "yanchor": "top"},
        template="simple_white",
        legend={"orientation": "h", "x": 0, "y": 1.01, "yanchor": "bottom"},
        margin={"t": 120, "b": 50},
    )
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True, default_height="1100px")


def _diagram_traces(result: ModalFit, page: Any) -> None:
    diagram, at = result.diagram, {"row": 1, "col": 1}
    page.add_scatter(
        x=result.functions.frequency.round(6), y=total(result).tolist(), mode="lines", line={"color": CURVE, "width": 1.5},
        name="sum of magnitudes", hoverinfo="skip", **at,
    )  # fmt: skip
    for words, which, colour, marker in kinds(result):
        page.add_scatter(
            x=diagram.frequency[which].round(6), y=diagram.order[which], mode="markers", name=words, secondary_y=True,
            marker={"color": colour, "size": 5 if marker == "x" else 6, "symbol": "x-thin-open" if marker == "x" else "circle"},
            customdata=100 * diagram.damping[which],
            hovertemplate="order %{y}: %{x:.3f} Hz, %{customdata:.4g} %<extra></extra>", **at,
        )  # fmt: skip
    for k in range(len(result)):
        page.add_scatter(
            x=[result.frequency[k]] * 2, y=[0, int(diagram.order.max()) + 1], mode="lines", name="modes", legendgroup="modes",
            line={"color": GREEN, "width": 1.2, "dash": "dash"}, showlegend=k == 0, secondary_y=True,
            hovertemplate=f"mode {k + 1}: {result.frequency[k]:.4f} Hz, {100 * result.damping[k]:.4g} %<extra></extra>", **at,
        )  # fmt: skip
    page.update_yaxes(type="log", title_text="sum of magnitudes", secondary_y=False, **at)
    page.update_yaxes(title_text="order", secondary_y=True, showgrid=False, **at)
    page.update_xaxes(title_text="frequency, Hz", **at)
