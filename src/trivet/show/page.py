"""A scene as an HTML page that can be turned with the mouse and needs no network."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

from trivet.show.palette import LEGEND, MARKED, Painted
from trivet.show.scene import Label, Scene

_EYE = {"x": 0.85, "y": -1.35, "z": 0.75}


def write_page(painted: list[Painted], seen: Scene, heading: list[str], path: Path) -> None:
    """Write a page with the drawing and all that it needs to be turned, in one file."""
    import plotly.graph_objects as go

    figure = go.Figure(_meshes(painted) + [_words(seen.frames, 13), _words(seen.joints, 12)])
    axis = {"backgroundcolor": "#F7F7F7", "gridcolor": "#D9D9D9", "showspikes": False}
    figure.update_layout(
        title={"text": "<br>".join(_lines(heading)), "font": {"size": 17}, "x": 0.02},
        scene={
            "aspectmode": "data",
            "camera": {"eye": _EYE},
            **{f"{letter}axis": {"title": {"text": f"{letter}, mm"}, **axis} for letter in "xyz"},
        },
        legend={"orientation": "h", "x": 0.5, "xanchor": "center", "y": 0.0, "itemsizing": "constant"},
        margin={"l": 10, "r": 10, "t": 100, "b": 40},
        font={"color": "black"},
    )
    body = figure.to_html(include_plotlyjs=True, include_mathjax=False, full_html=False, div_id="machine", default_height="96vh")
    title = html.escape(heading[0])
    page = f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{title}</title></head>\n<body>{body}</body>\n</html>\n'
    path.write_text(page, encoding="utf-8")


def _lines(heading: list[str]) -> list[str]:
    title, stand, *status = (html.escape(line) for line in heading)
    small = [f'<span style="font-size:13px">{stand}</span>']
    return [title, *small, *(f'<span style="font-size:13px;color:{MARKED}">{line}</span>' for line in status)]


def _meshes(painted: list[Painted]) -> list[Any]:
    import plotly.graph_objects as go

    listed: set[str] = set()
    found = []
    for item in painted:
        vertices, faces = item.shape.mesh()
        group = "named above" if item.is_marked else item.shape.role
        in_legend = group not in listed and (item.is_marked or item.shape.role in LEGEND)
        listed.add(group)
        x, y, z = (1e3 * vertices).round(4).T
        i, j, k = faces.T
        found.append(
            go.Mesh3d(
                x=x, y=y, z=z, i=i, j=j, k=k, color=item.colour, opacity=item.opacity, flatshading=True,
                lighting={"ambient": 0.65, "diffuse": 0.6, "specular": 0.1},
                name=group, legendgroup=group, showlegend=in_legend, hovertext=f"{item.shape.name} ({item.shape.role})", hoverinfo="text",
            )  # fmt: skip
        )
    return found


def _words(labels: tuple[Label, ...], size: int) -> Any:
    import plotly.graph_objects as go

    x, y, z = zip(*(1e3 * label.point for label in labels), strict=True)
    return go.Scatter3d(
        x=x, y=y, z=z, text=[label.text for label in labels], mode="text",
        textfont={"size": size, "color": "black"}, hoverinfo="skip", showlegend=False,
    )  # fmt: skip
