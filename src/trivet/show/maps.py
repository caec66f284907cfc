"""A quantity over a surface of check points, seen from above."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from trivet.errors import InputError
from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.show.palette import GREY, VALUES
from trivet.statics.objective import objective
from trivet.study.stiffness_map import StiffnessMap

SUFFIXES = (".png", ".html")
NOT_REACHED = "not reached"

BETWEEN = 0.09
"""From panel to panel of a page, with room for the colours of the one and the numbers of the other; a part of its width."""


def check_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of a figure's name; raises InputError for one that cannot be drawn."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: a figure ends in {' or '.join(SUFFIXES)}")
    return suffix


def scaled(result: StiffnessMap, quantity: str) -> tuple[Any, str]:
    """Values (n,) in the unit of the figures, and that unit."""
    rotational = objective(quantity).is_rotational
    return result.diagonal(quantity) / (1.0 if rotational else 1e6), "N m/rad" if rotational else "N/µm"


def draw_map(
    result: StiffnessMap,
    path: str | os.PathLike[str],
    quantities: tuple[str, ...] = ("K_xx", "K_yy", "K_zz"),
    *,
    columns: int | None = None,
    overwrite: bool = False,
) -> None:
    """Draw quantities over the check points, and the best roll (PNG or self-contained HTML).

    Args:
        result: the map.
        path: file to write.
        quantities: of its stiffness, a panel each.
        columns: panels of a picture beside each other; all of them when not given.
        overwrite: whether the file may be replaced.
    """
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            _picture(result, quantities, columns or len(quantities) + 1, temporary)
        else:
            _page(result, quantities, temporary)


def _title(result: StiffnessMap) -> str:
    reached = f"{int(result.used.sum())} of {len(result.surface)} points reached"
    return f"{result.machine.name}, {result.surface.name}, {mode_words(result.mode)}: {reached}"


def _panels(result: StiffnessMap, quantities: tuple[str, ...]) -> list[tuple[str, Any, str]]:
    panels = [(q, *scaled(result, q)) for q in quantities]
    # Machines of rotational symmetry repeat every 120 degrees; as an angle from -180 to 180 the roll reads alike either way.
    return [*panels, (f"best roll for {result.objective.name}", np.degrees(result.best.roll), "deg")]


def _picture(result: StiffnessMap, quantities: tuple[str, ...], columns: int, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    panels = _panels(result, quantities)
    rows = -(-len(panels) // columns)
    canvas = Figure(figsize=(4.2 * columns, 0.9 + 3.7 * rows), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.suptitle(_title(result))
    for axes, (name, values, unit) in zip(np.ravel(canvas.subplots(rows, columns)), panels, strict=False):
        dots = scatter_map(axes, result, values)
        canvas.colorbar(dots, ax=axes, shrink=0.75, label=f"{name}, {unit}")
        axes.set_title(name)
    canvas.savefig(path, format="png", dpi=120)


def scatter_map(axes: Any, result: StiffnessMap, values: Any, limits: tuple[float, float] | None = None) -> Any:
    """One coloured map of values (n,) on matplotlib axes; points that are not reached are crosses.  Gives the dots."""
    x, y = result.surface.position[:, 0] * 1e3, result.surface.position[:, 1] * 1e3
    used = np.isfinite(values)
    size = 9000 / max(len(values), 100)
    low, high = limits if limits is not None else (None, None)
    dots = axes.scatter(x[used], y[used], c=values[used], s=size, cmap=VALUES, vmin=low, vmax=high, linewidths=0)
    cross_out(axes, x[~used], y[~used], size)
    axes.set_aspect("equal")
    axes.set_xlabel("x, mm")
    axes.set_ylabel("y, mm")
    return dots


def cross_out(axes: Any, x: Any, y: Any, size: float) -> None:
    """Points without a value on matplotlib axes, beside dots of a size, and what they mean."""
    if len(x):
        axes.scatter(x, y, c=GREY, s=size / 2, marker="x", label=NOT_REACHED)
        axes.legend(loc="upper right", fontsize=8, handletextpad=0.2, borderpad=0.3)


def crosses(x: Any, y: Any, *, listed: bool = True) -> Any:
    """Points without a value as a trace of plotly, in its legend where `listed`."""
    import plotly.graph_objects as go

    marker = {"symbol": "x-thin", "size": 7, "line": {"width": 1.5, "color": GREY}}
    look = {"mode": "markers", "marker": marker, "name": NOT_REACHED, "legendgroup": NOT_REACHED}
    return go.Scatter(x=x, y=y, showlegend=listed and len(x) > 0, hovertemplate=f"{NOT_REACHED}<extra></extra>", **look)


def _page(result: StiffnessMap, quantities: tuple[str, ...], path: Path) -> None:
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    panels = _panels(result, quantities)
    page = make_subplots(
        rows=1, cols=len(panels), subplot_titles=[f"{n}, {u}" for n, _, u in panels], horizontal_spacing=BETWEEN
    )
    x, y = result.surface.position[:, 0] * 1e3, result.surface.position[:, 1] * 1e3
    wide = (1 - BETWEEN * (len(panels) - 1)) / len(panels)
    for k, (name, values, unit) in enumerate(panels, 1):
        bar = {"x": k * wide + (k - 1) * BETWEEN, "len": 0.9, "thickness": 10}
        missed = ~np.isfinite(values)
        page.add_trace(crosses(x[missed], y[missed], listed=k == 1), row=1, col=k)
        page.add_trace(
            go.Scatter(
                x=x[~missed], y=y[~missed], mode="markers", showlegend=False,
                marker={"color": values[~missed], "colorscale": VALUES, "colorbar": bar, "size": 9},
                customdata=np.degrees(np.stack([result.surface.tilt, result.best.roll], axis=1))[~missed],
                hovertemplate="x %{x:.3g} mm, y %{y:.3g} mm<br>tilt %{customdata[0]:.4g}°, roll %{customdata[1]:.4g}°<br>"
                f"{name} %{{marker.color:.5g}} {unit}<extra></extra>",
            ),
            row=1, col=k,
        )  # fmt: skip
        page.update_yaxes(scaleanchor=f"x{k if k > 1 else ''}", row=1, col=k)
        page.update_xaxes(title_text="x, mm", row=1, col=k)
    page.update_yaxes(title_text="y, mm", row=1, col=1)
    page.update_layout(title=_title(result), template="simple_white", height=480, width=420 * len(panels))
    page.update_layout(legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 1.12, "yanchor": "bottom"})
    page.write_html(path, include_plotlyjs=True, full_html=True)
