"""What makes quantities uncertain, a bar per quantity and variable, and how often one machine has more than another."""

from __future__ import annotations

import html
import os
import textwrap
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trivet.design.uncertainty import Uncertainty
from trivet.files import replacing
from trivet.show import titles
from trivet.show.maps import check_suffix
from trivet.show.names import broken
from trivet.show.palette import BLACK, BLUE, GREY, ORANGE, SKY
from trivet.show.shapes import Array
from trivet.show.titles import WIDE

MOST = 8
"""Variables that are drawn: those with the greatest indices."""
ROW, GAP, FOOT = 22, 84, 56
"""Pixels of a row, from one part to the next, and below the last."""
LETTER = 7.2
"""Pixels of a letter of a row's name."""
LETTERS = 90
"""Of the title above a column, over all columns."""
MARKS = [0.0, 0.5, 1.0]


class Block(NamedTuple):
    """Columns of bars over the same rows."""

    rows: list[str]
    columns: list[str]
    light: Array
    """(rows, columns) 0 to 1."""
    dark: Array
    """The same, drawn over it; NaN where there is none."""
    low: Array
    """Ends of the intervals about what is light."""
    high: Array
    words: str
    """What is drawn."""
    colours: tuple[str, str]

    @property
    def height(self) -> int:
        """Pixels."""
        return ROW * len(self.rows)


def draw_uncertainty(result: Uncertainty, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw indices, and shares of orderings where there are several machines (PNG or self-contained HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        (_picture if suffix == ".png" else _page)(_title(result), blocks(result), temporary)


def blocks(result: Uncertainty) -> list[Block]:
    """What is drawn: Sobol indices, then shares of orderings."""
    return [_indices(result), *([_shares(result)] if result.pairs else [])]


def _title(result: Uncertainty) -> list[str]:
    first = f"{', '.join(result.short_names)}: {result.samples:,} samples of {len(result.study.variables)} unknowns"
    more = [block.words for block in blocks(result)]
    names = [one.name for one in result.study.variables]
    if len(names) > MOST:
        more.append(f"of {len(names)} unknowns the {MOST} with the greatest indices are drawn")
    left_out = max(one.left_out for one in result.indices)
    if left_out:
        more.append(f"up to {left_out:,} of {result.sampling.base:,} base samples lack a quantity and are left out of its bars")
    return [first, *more]


def _indices(result: Uncertainty) -> Block:
    total, margin, first = (
        np.array([getattr(one, key) for one in result.indices]) for key in ("total", "total_margin", "first")
    )
    greatest = np.where(np.isfinite(total), total, -1.0).max(axis=0)
    picked = np.sort(np.argsort(-greatest, kind="stable")[:MOST])
    names = [result.study.variables[k].name for k in picked]
    total, margin, first = total[:, picked], margin[:, picked], first[:, picked]
    words = "Sobol indices: dark of the variable alone, light with all that it does together with others (95 %)"
    return Block(result.column_names, names, total, first, total - margin, total + margin, words, (SKY, BLUE))


def _shares(result: Uncertainty) -> Block:
    names = result.short_names
    rows = [f"{names[pair.first]} > {names[pair.second]}" for pair in result.pairs[0]]
    found = np.array([[(pair.greater.value, *pair.greater.interval) for pair in own] for own in result.pairs])
    share, low, high = np.moveaxis(found.transpose(1, 0, 2), -1, 0)
    columns = [own.name for own in result.study.quantities]
    words = "below, in which share of the samples one machine has more than another (95 % of independent samples)"
    return Block(rows, columns, share, np.full(share.shape, np.nan), low, high, words, (ORANGE, ORANGE))


def _head(block: Block, column: int) -> str:
    """The name above a column in three lines at most, broken between words where they are short enough."""
    name, letters = block.columns[column], max(LETTERS // len(block.columns), 8)
    lines = textwrap.wrap(name, letters, break_long_words=False)
    fits = len(lines) <= 3 and max(map(len, lines)) <= letters
    return "\n".join(lines) if fits else broken(name, letters, 3)


@titles.literal()
def _picture(title: list[str], found: list[Block], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    top = titles.height(title) + GAP - 24
    high = top + sum(block.height for block in found) + GAP * (len(found) - 1) + FOOT
    left = 30 + LETTER * max(len(name) for block in found for name in block.rows)
    canvas = Figure(figsize=(WIDE / 100, high / 100), dpi=100)
    FigureCanvasAgg(canvas)
    titles.write(canvas, title)
    for block in found:
        wide = (WIDE - left - 30) / len(block.columns)
        for k in range(len(block.columns)):
            foot = 1 - (top + block.height) / high
            panel = canvas.add_axes(((left + k * wide) / WIDE, foot, (wide - 24) / WIDE, block.height / high))
            _draw(panel, block, k)
        top += block.height + GAP
    canvas.savefig(path, format="png")


def _draw(panel: Any, block: Block, column: int) -> None:
    rows = np.arange(len(block.rows))
    light, dark = block.light[:, column], block.dark[:, column]
    for values, colour in ((light, block.colours[0]), (dark, block.colours[1])):
        panel.barh(rows, np.clip(np.nan_to_num(values), 0, None), 0.7, color=colour)
    panel.hlines(rows, block.low[:, column], block.high[:, column], color=BLACK, linewidth=1)
    for row in np.flatnonzero(~np.isfinite(light)):
        panel.text(0.02, row, "none", va="center", fontsize=8, color=GREY)
    panel.set(xlim=(0, 1.1), ylim=(len(rows) - 0.5, -0.5), xticks=MARKS, yticks=rows)
    panel.set_yticklabels(block.rows if not column else [])
    panel.tick_params(labelsize=9, length=0)
    panel.set_title(_head(block, column), fontsize=10)
    panel.grid(axis="x", linewidth=0.5)
    panel.set_axisbelow(True)
    for side in ("top", "right", "bottom"):
        panel.spines[side].set_visible(False)


def _page(title: list[str], found: list[Block], path: Path) -> None:
    from plotly.subplots import make_subplots

    columns = max(len(block.columns) for block in found)
    heights = [block.height for block in found]
    whole = sum(heights) + GAP * len(found)
    specs: list[list[Any]] = [[{}] * len(block.columns) + [None] * (columns - len(block.columns)) for block in found]
    heads = [html.escape(_head(block, k)).replace("\n", "<br>") for block in found for k in range(len(block.columns))]
    page = make_subplots(
        len(found), columns, specs=specs, row_heights=heights, shared_yaxes=True, horizontal_spacing=0.02,
        vertical_spacing=GAP / whole, subplot_titles=heads,
    )  # fmt: skip
    for row, block in enumerate(found, 1):
        for k in range(len(block.columns)):
            for trace in _bars(block, k):
                page.add_trace(trace, row=row, col=k + 1)
            page.update_xaxes(range=[0, 1.1], tickvals=MARKS, row=row, col=k + 1)
            page.update_yaxes(autorange="reversed", row=row, col=k + 1)
    layout = titles.on_page(title)
    page.update_layout(**layout | {"height": titles.height(title) + whole + FOOT, "barmode": "overlay", "showlegend": False})
    page.update_layout(margin={"t": titles.height(title) + 40})
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True)


def _bars(block: Block, column: int) -> list[Any]:
    import plotly.graph_objects as go

    light, low, high = (values[:, column] for values in (block.light, block.low, block.high))
    margins = {"type": "data", "symmetric": False, "array": high - light, "arrayminus": light - low, "thickness": 1, "width": 0}
    rows, name = [html.escape(row) for row in block.rows], html.escape(block.columns[column])
    found = [
        go.Bar(
            y=rows, x=light, orientation="h", marker_color=block.colours[0], error_x=margins,
            customdata=np.stack([low, high], axis=-1),
            hovertemplate=f"%{{y}}<br>{name} %{{x:.3f}} (%{{customdata[0]:.3f}} to %{{customdata[1]:.3f}})<extra></extra>",
        )
    ]  # fmt: skip
    if np.isfinite(block.dark[:, column]).any():
        hover = f"%{{y}}<br>{name} alone %{{x:.3f}}<extra></extra>"
        dark = block.dark[:, column]
        found.append(go.Bar(y=rows, x=dark, orientation="h", marker_color=block.colours[1], hovertemplate=hover))
    return found
