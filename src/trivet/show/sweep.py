"""Sweeps: all designs as lines over their variables and quantities, and on a page every quantity over every variable."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.design.sweep import Sweep
from trivet.files import replacing
from trivet.show import titles
from trivet.show.maps import check_suffix
from trivet.show.names import broken
from trivet.show.palette import VALUES
from trivet.show.parallel import Axis, brushed, draw_lines, names, of_quantity, of_variable, width_of
from trivet.show.titles import HIGH, WIDE

MOST, MOST_AXES = 2000, 40
"""Designs and axes that are drawn."""
LEGIBLE = 7
"""Variables, or quantities, that are still drawn over each other one by one."""
ROW, BETWEEN, EDGE = 230, 30, 20
"""Pixels of a row of dots on a page, from row to row, and more from the lines to the dots."""


class Seen(NamedTuple):
    """What is drawn of a sweep."""

    variables: list[Axis]
    quantities: list[Axis]
    """The first of them gives the colours."""
    notes: list[str]
    """What is left out, and why."""

    @property
    def axes(self) -> list[Axis]:
        """All of them, side by side."""
        return [*self.variables, *self.quantities]

    @property
    def size(self) -> int:
        """How many designs."""
        return len(self.axes[0].values)


def draw_sweep(result: Sweep, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a sweep (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(result, seen(result), temporary)


def seen(result: Sweep) -> Seen:
    """What is drawn of a sweep: designs with all numbers, at most 2,000 of them, evenly picked."""
    designs, values = result.some(MOST)
    picked, notes = len(designs), []
    has_value = np.isfinite(values)
    empty = [k for k in range(values.shape[1]) if picked and not has_value[:, k].any()]
    if empty:
        notes.append(f"no design has {', '.join(result.quantities[k] for k in empty)}")
    columns = [k for k in range(values.shape[1]) if k not in empty]
    quantities = columns[: max(MOST_AXES - len(result.variables), MOST_AXES // 2)]
    variables = range(len(result.variables))[: MOST_AXES - len(quantities)]
    for own, every, what in ((variables, result.variables, "variables"), (quantities, columns, "quantities")):
        if len(own) < len(every):
            notes.append(f"of {len(every)} {what} the first {len(own)} are drawn")
    whole = has_value[:, quantities].all(axis=1)
    if not whole.all():
        notes.append(f"{int((~whole).sum()):,} of {picked:,} designs lack a number and are left out")
    study = result.study
    return Seen(
        [of_variable(study.variables[k], designs[whole, k]) for k in variables],
        [of_quantity(study.columns[k].name, study.columns[k].asked.kind, values[whole, k]) for k in quantities],
        notes,
    )


def title(result: Sweep, found: Seen) -> list[str]:
    """The machines and what their designs have come to; what is drawn; what is not."""
    statuses = "; ".join(f"{count:,} {word}" for word, count in result.statuses.items())
    drawn = f"{designs(found.size)} drawn, coloured by {found.quantities[0].name}" if is_drawn(found) else "nothing to be drawn"
    return [f"{', '.join(result.study.names)}: {designs(result.count)}, {statuses}", "; ".join([drawn, *found.notes])]


def designs(count: int) -> str:
    """So many designs."""
    return f"{count:,} design{'s' if count != 1 else ''}"


def is_drawn(found: Seen) -> bool:
    """Whether there is a design to be drawn."""
    return found.size > 0 and bool(found.quantities)


@titles.literal()
def _picture(result: Sweep, found: Seen, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, right = 60, 190
    wide = max(WIDE, width_of(found.axes) + left + right)
    canvas = Figure(figsize=(wide / 100, HIGH / 100), dpi=100)
    FigureCanvasAgg(canvas)
    lines = title(result, found)
    titles.write(canvas, lines)
    if is_drawn(found):
        spacing = (wide - left - right) / len(found.axes)
        top = titles.height(lines) + 20 + names(found.axes, spacing).height
        box = (left / wide, 40 / HIGH, (wide - left - right) / wide, (HIGH - top - 40) / HIGH)
        draw_lines(canvas, box, found.axes, found.quantities[0])
    canvas.savefig(path, format="png")


def _page(result: Sweep, found: Seen, path: Path) -> None:
    rows = len(found.quantities) if is_drawn(found) and max(len(found.variables), len(found.quantities)) <= LEGIBLE else 0
    page = _panels(found, rows)
    page.update_layout(**titles.on_page(title(result, found), rows * ROW))
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True)


def _panels(found: Seen, rows: int) -> Any:
    """The lines, and below them so many rows of every quantity over every variable, as a figure of plotly."""
    from plotly.subplots import make_subplots

    columns, whole = len(found.variables) if rows else 1, HIGH - 140 + rows * ROW
    lines = [[{"type": "domain", "colspan": columns}, *([None] * (columns - 1))]]
    heights = [HIGH - 140, *([ROW] * rows)]
    page = make_subplots(
        1 + rows, columns, specs=lines + [[{}] * columns for _ in range(rows)], row_heights=heights, shared_xaxes=True,
        shared_yaxes=True, vertical_spacing=BETWEEN / whole, horizontal_spacing=0.02,
    )  # fmt: skip
    if not is_drawn(found):
        return page
    spacing = (WIDE - 240) / len(found.axes)
    foot = 1 - (1 - rows * BETWEEN / whole) * (HIGH - 140) / whole + (EDGE if rows else 0) / whole
    page.add_trace(brushed(found.axes, found.quantities[0], spacing, (foot, 1 - names(found.axes, spacing).height / whole)))
    for row, quantity in enumerate(found.quantities[:rows], 2):
        for column, variable in enumerate(found.variables, 1):
            page.add_trace(_dots(found, quantity, variable), row=row, col=column)
            places, words = variable.ticks
            page.update_xaxes(tickvals=places, ticktext=words, range=_range(variable), row=row, col=column)
            page.update_yaxes(range=_range(quantity), row=row, col=column)
            if row == 1 + rows:
                name = html.escape(broken(variable.title, (WIDE - 200) // (8 * columns))).replace("\n", "<br>")
                page.update_xaxes(title_text=name, row=row, col=column)
        name = html.escape(broken(quantity.title, ROW // 9)).replace("\n", "<br>")
        page.update_yaxes(title_text=name, row=row, col=1)
    return page


def _range(own: Axis) -> list[float]:
    """Of dots, clear of the edge."""
    low, high = own.ends
    room = 0.5 if own.choices else 0.04 * (high - low)
    return [low - room, high + room]


def _dots(found: Seen, quantity: Axis, variable: Axis) -> Any:
    """Every design as a dot, a quantity over a variable."""
    import plotly.graph_objects as go

    colour = found.quantities[0]
    return go.Scattergl(
        x=variable.places, y=quantity.values, text=variable.words, mode="markers", showlegend=False,
        marker={"color": colour.values, "colorscale": VALUES, "size": 4, "opacity": 0.6},
        hovertemplate=f"{html.escape(variable.name)} %{{text}}<br>{html.escape(quantity.name)} %{{y:.5g}} {quantity.unit}"
        f"<br>{html.escape(colour.name)} %{{marker.color:.5g}} {colour.unit}<extra></extra>",
    )  # fmt: skip
