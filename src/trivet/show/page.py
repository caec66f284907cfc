"""A scene as an HTML page that can be turned with the mouse and needs no network."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

from trivet.show.palette import LEGEND, MARKED, Painted
from trivet.show.scene import Label, Scene

_CAMERA = {"eye": {"x": 0.95, "y": -1.5, "z": 0.8}, "center": {"x": 0, "y": 0, "z": -0.12}}
_LIGHT = {"x": 1000, "y": -2000, "z": 4000}


def write_page(painted: list[Painted], seen: Scene, heading: list[str], path: Path) -> None:
    """Write a page with the drawing and all that it needs to be turned, in one file."""
    figure = page(painted, seen)
    figure.update_layout(title={"text": "<br>".join(_lines(heading)), "font": {"size": 17}, "x": 0.02}, margin={"t": 100})
    whole = {"include_plotlyjs": True, "include_mathjax": False, "full_html": False}
    body = figure.to_html(**whole, div_id="machine", default_height="96vh")
    head = f'<head><meta charset="utf-8"><title>{html.escape(heading[0])}</title></head>'
    path.write_text(f'<!DOCTYPE html>\n<html lang="en">\n{head}\n<body>{body}</body>\n</html>\n', encoding="utf-8")


def page(painted: list[Painted], seen: Scene) -> Any:
    """A scene as a figure of plotly, without a title."""
    import plotly.graph_objects as go

    figure = go.Figure(_meshes(painted))
    look = {"backgroundcolor": "#F7F7F7", "gridcolor": "#D9D9D9", "showspikes": False}
    space: dict[str, Any] = {f"{letter}axis": {"title": {"text": f"{letter}, mm"}, **look} for letter in "xyz"}
    marked = {p.shape.name for p in painted if p.is_marked}
    space |= {
        "aspectmode": "data",
        "camera": _CAMERA,
        "annotations": _words(seen.frames) + _names(seen.labelled(marked), marked),
    }
    return figure.update_layout(
        scene=space,
        legend={"orientation": "h", "x": 0.5, "xanchor": "center", "y": 0.0, "itemsizing": "constant"},
        margin={"l": 10, "r": 10, "t": 10, "b": 40},
        font={"color": "black"},
    )


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
        (x, y, z), (i, j, k) = (1e3 * vertices).round(4).T, faces.T
        mesh = go.Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, color=item.colour, opacity=item.opacity, name=group)
        mesh.update(flatshading=True, lighting={"ambient": 0.7, "diffuse": 0.5, "specular": 0.05}, lightposition=_LIGHT)
        mesh.update(hovertext=f"{item.shape.name} ({item.shape.role})", hoverinfo="text")
        found.append(mesh.update(legendgroup=group, showlegend=in_legend))
    return found


def _words(labels: tuple[Label, ...]) -> list[dict[str, Any]]:
    """Names of frames, axes and chains where they are; annotations, since words in the scene vanish behind bodies."""
    look = {"showarrow": False, "font": {"size": 13}, "bgcolor": "rgba(255,255,255,0.5)"}
    clear = {"xshift": -16, "yshift": -14}  # of the arrows
    return [{**_place(label), "text": label.text, **look, **(clear if label.text.startswith("{") else {})} for label in labels]


def _place(label: Label) -> dict[str, float]:
    return dict(zip("xyz", (1e3 * label.point).round(4).tolist(), strict=True))


def _names(labels: tuple[Label, ...], marked: set[str]) -> list[dict[str, Any]]:
    """Names of joints beside them, with lines; one above the other where joints coincide."""
    found = []
    for row, label in enumerate(labels):
        colour = MARKED if label.text in marked else "black"
        found.append({
            **_place(label), "text": label.text, "ax": 90, "ay": 40 - 26 * (row % 5), "xanchor": "left",
            "showarrow": True, "arrowhead": 0, "arrowwidth": 0.8, "arrowcolor": colour, "font": {"size": 12, "color": colour},
        })  # fmt: skip
    return found
