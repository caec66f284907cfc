"""Natural modes as an HTML page in which they move, one at a time; it can be turned with the mouse and needs no network."""

from __future__ import annotations

import html
import json
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from trivet.show.mode_shapes import MovingScene, captions, joined
from trivet.show.palette import COLOURS
from trivet.show.shapes import Array, Shape

_CAMERA = {"eye": {"x": 0.95, "y": -1.5, "z": 0.8}, "center": {"x": 0, "y": 0, "z": -0.1}}
_LOOK = {"ambient": 0.7, "diffuse": 0.5, "specular": 0.05}
_LIGHT = {"x": 1000, "y": -2000, "z": 4000}
_GHOST, _GHOST_OPACITY = "#9AA5B1", 0.25
ZOOM = 1.25
"""Largest side of the box around the machine, in plotly's unit."""
ROOM = 0.15
"""Of the machine's size, left free around it for its motion."""


def write_page(seen: MovingScene, path: Path) -> None:
    """Write a page with all modes and all that it needs to show them, in one file."""
    from plotly.colors import get_colorscale
    from plotly.offline import get_plotlyjs

    bodies = [body.shape for body in seen.bodies]
    traces = [_trace([shape], f"{shape.name} ({shape.role})", color=COLOURS[shape.role]) for shape in seen.rest]
    shadow = _trace(bodies, "at rest", color=_GHOST, opacity=_GHOST_OPACITY)
    scale = {"title": {"text": "displacement,<br>of the largest<br>in the mode"}, "len": 0.6, "thickness": 14}
    ways = _ways(seen)
    moving = _trace(
        bodies,
        "displaced",
        intensity=ways[0]["size"],
        cmin=0,
        cmax=1,
        colorscale=get_colorscale("Plasma"),
        colorbar=scale,
        flatshading=False,
    )
    data = [*traces, shadow, moving]
    heading, *lines = (html.escape(line) for line in seen.title)
    options = (f"<option>{html.escape(first)}</option>" for first, _ in captions(seen))
    page = Template(resources.files("trivet.show").joinpath("mode_page.html").read_text(encoding="utf-8")).substitute(
        heading=heading,
        lines="\n".join(f"<p>{line}</p>" for line in lines),
        options="".join(options),
        plotly=get_plotlyjs(),
        figure=_script({"data": data, "layout": _layout(seen)}),
        modes=_script(ways),
        moving=len(data) - 1,
        shadow=len(data) - 2,
    )
    path.write_text(page, encoding="utf-8")


def _script(value: Any) -> str:
    """JSON within a script, where no text may look like its end."""
    return json.dumps(value, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")


def _trace(shapes: list[Shape], name: str, **look: Any) -> dict[str, Any]:
    vertices, faces = joined(shapes)
    corners = dict(zip("xyz", _columns(1e3 * vertices), strict=True))
    sides = dict(zip("ijk", faces.T.tolist(), strict=True))
    common = {"type": "mesh3d", "hoverinfo": "skip", "flatshading": True, "lighting": _LOOK, "lightposition": _LIGHT}
    return {**common, **corners, **sides, "name": name, **look}


def _columns(points: Array, digits: int = 3) -> list[list[float]]:
    rounded: Array = np.round(points, digits) + 0.0
    columns: list[list[float]] = rounded.T.tolist()
    return columns


def _ways(seen: MovingScene) -> list[dict[str, Any]]:
    """Per mode: ways of all corners of the moving bodies (mm), their sizes against the largest, and what yields."""
    start, _ = joined([body.shape for body in seen.bodies])
    found = []
    for mode, (_, parts) in enumerate(captions(seen)):
        end, _ = joined([body.at(mode, 1.0) for body in seen.bodies])
        way = 1e3 * (end - start)
        size = np.linalg.norm(way, axis=1)
        own: dict[str, Any] = dict(zip("xyz", _columns(way), strict=True))
        found.append(own | {"size": (size / max(float(size.max()), 1e-12)).round(3).tolist(), "parts": parts})
    return found


def _layout(seen: MovingScene) -> dict[str, Any]:
    shapes = [*seen.rest, *(body.shape for body in seen.bodies)]
    corners = 1e3 * np.concatenate([shape.rings.reshape(-1, 3) for shape in shapes])
    room = 1e3 * ROOM * seen.size
    low, high = (corners.min(axis=0) - room).tolist(), (corners.max(axis=0) + room).tolist()
    look = {
        "backgroundcolor": "#F7F7F7",
        "gridcolor": "#D9D9D9",
        "showspikes": False,
        "zerolinecolor": "#D9D9D9",
        "showbackground": True,
    }
    axes = {
        f"{letter}axis": {"title": {"text": f"{letter}, mm"}, "range": [low[k], high[k]], "autorange": False, **look}
        for k, letter in enumerate("xyz")
    }
    spread = [b - a for a, b in zip(low, high, strict=True)]
    ratio = {letter: ZOOM * side / max(spread) for letter, side in zip("xyz", spread, strict=True)}
    space = {**axes, "aspectmode": "manual", "aspectratio": ratio, "camera": _CAMERA, "uirevision": "kept"}
    margin = {"l": 0, "r": 0, "t": 0, "b": 0}
    return {"scene": space, "margin": margin, "showlegend": False, "uirevision": "kept", "font": {"color": "black"}}
