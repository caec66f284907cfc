"""Fronts as pages: what is told of a design appears under the mouse; many objectives are marked on their axes."""

from __future__ import annotations

import base64
import html
import io
from pathlib import Path
from typing import Any

import numpy as np

from trivet.design.optimisation import Member, Optimisation
from trivet.show import front as seen
from trivet.show import titles
from trivet.show.names import broken
from trivet.show.palette import GREY, GRID
from trivet.show.parallel import CLOSEST, brushed, names
from trivet.show.shapes import Array
from trivet.show.titles import HIGH, WIDE


def write_page(result: Optimisation, path: Path) -> None:
    """Write a page that needs no network, of the size of the picture."""
    import plotly.graph_objects as go

    own = seen.plan(result, int(titles.height(seen.title(result, 1.0))))
    chosen = seen.picked(result, own.most)
    machines = seen.panel(result, chosen, own)
    page = go.Figure()
    page.update_layout(**titles.on_page(seen.title(result, machines.drawn.bar)))
    page.update_layout(width=WIDE, height=HIGH, margin={"l": 0, "r": 0, "t": 0, "b": 0, "autoexpand": False})
    page.update_xaxes(visible=False)
    page.update_yaxes(visible=False)
    if len(result.aims.goals) == 2:
        _add_front(page, result, own, chosen)
    elif len(result.aims.goals) > 2:
        _add_coordinates(page, result, own, chosen)
    _add_machines(page, machines)
    page.write_html(path, include_plotlyjs=True, include_mathjax=False, full_html=True)


def _add_machines(page: Any, machines: seen.Panel) -> None:
    words = {"xref": "paper", "yref": "paper", "showarrow": False, "xanchor": "left", "yanchor": "top", "align": "left"}
    for cell, picture in zip(machines.cells, machines.drawn.pictures, strict=True):
        left = cell.left / WIDE
        if picture is None:
            page.add_annotation(
                text="home is not reached", x=left + 10 / WIDE, y=1 - (cell.top + cell.height / 2) / HIGH, **words
            )
        else:
            page.add_layout_image(
                source=_source(picture), xref="paper", yref="paper", x=left, y=1 - cell.top / HIGH, xanchor="left",
                yanchor="top", sizex=cell.width / WIDE, sizey=cell.height / HIGH, sizing="contain",
            )  # fmt: skip
        first, *rest = (html.escape(line) for line in cell.caption)
        text = "<br>".join([f"<b>{first}</b>", *rest])
        place = {"x": left + 10 / WIDE, "y": 1 - (cell.top + cell.height) / HIGH}
        page.add_annotation(text=text, font={"size": 12}, **place, **words)


def _source(picture: Array) -> str:
    """A picture as an address that holds it."""
    from matplotlib.image import imsave

    file = io.BytesIO()
    imsave(file, picture, format="png")
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def _add_front(page: Any, result: Optimisation, own: seen.Plan, chosen: list[seen.Picked]) -> None:
    _, top, wide, _ = own.front
    front = [seen.goal_values(result, result.members, k) for k in (1, 0)]
    order = np.argsort(front[0], kind="stable")
    shape = "hv" if result.aims.goals[1].sign > 0 else "vh"
    page.add_scatter(
        x=front[0][order], y=front[1][order], mode="lines", line={"color": GREY, "width": 1, "shape": shape},
        hoverinfo="skip", showlegend=False,
    )  # fmt: skip
    for one in seen.series(result):
        name = html.escape(broken(one.name, 30, 2)).replace("\n", "<br>")
        for members, numbers, look, what in (
            (result.alternatives, one.alternatives, {"size": 7, "opacity": 0.3}, f"{name}, dominated"),
            (result.members, one.members, {"size": 9}, name),
        ):
            if numbers:
                marker = {"color": one.colour, "symbol": one.marker[1], **look}
                _add_dots(page, result, tuple(members[k] for k in numbers), marker, what)
    across, up = seen.outwards(result)
    for letter, member in chosen:
        x, y = (float(seen.goal_values(result, (member,), k)[0]) for k in (1, 0))
        place = {"x": x, "y": y, "xshift": 12 * across, "yshift": 12 * up}
        page.add_annotation(text=f"<b>{letter}</b>", showarrow=False, font={"size": 14}, **place)
    wide_part, high_part = [80 / WIDE, (wide - 10) / WIDE], [130 / HIGH, 1 - (top + 14) / HIGH]
    name_up, name_across = (html.escape(seen.goal_axis(goal)) for goal in result.aims.goals)
    grid: dict[str, Any] = {"visible": True, "showgrid": True, "gridcolor": GRID}
    page.update_xaxes(title_text=name_across, domain=wide_part, **grid)
    page.update_yaxes(title_text=name_up, domain=high_part, **grid)
    page.update_layout(legend={"x": 70 / WIDE, "y": 70 / HIGH, "yanchor": "top", "orientation": "h"})


def _add_dots(page: Any, result: Optimisation, members: tuple[Member, ...], marker: dict[str, Any], name: str) -> None:
    words = [
        "<br>".join(html.escape(line) for line in (result.study.names[one.place], *seen.facts(result, one))) for one in members
    ]
    x, y = (seen.goal_values(result, members, k) for k in (1, 0))
    page.add_scatter(
        x=x, y=y, mode="markers", marker=marker, name=name, text=words, hovertemplate="%{text}<extra></extra>",
    )  # fmt: skip


def _add_coordinates(page: Any, result: Optimisation, own: seen.Plan, chosen: list[seen.Picked]) -> None:
    left, top, wide, high = own.front
    across = wide - left - 240
    found = seen.coordinates(result, across // CLOSEST)
    spacing = across / len(found)
    foot, head = 1 - (top + high - 20) / HIGH, 1 - (top + 12 + names(found, spacing).height) / HIGH
    page.add_trace(brushed(found, found[0], spacing, (foot, head)))
    for letter, height in seen.lettered(result, chosen, found[0]):
        place = {"x": 22 / WIDE, "y": foot + height * (head - foot), "xref": "paper", "yref": "paper", "yanchor": "middle"}
        page.add_annotation(text=f"<b>{letter}</b>", showarrow=False, font={"size": 14}, **place)
    page.update_traces(domain={"x": [70 / WIDE, 1 - 130 / WIDE]}, line={"colorbar": {"x": 1 - 100 / WIDE}})
