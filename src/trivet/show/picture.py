"""A scene as a PNG picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from trivet.show.palette import COLOURS, LEGEND, MARKED, Painted
from trivet.show.raster import Facets, render
from trivet.show.scene import Label, Scene
from trivet.show.shapes import Array

WIDTH, HEIGHT = 1200, 900
"""Pixels."""

_PATCH = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none"}
"""What words stand on."""

_LIGHT = np.array((0.35, -0.45, 0.82)) / np.linalg.norm((0.35, -0.45, 0.82))
VIEW = {"elev": 24, "azim": -58}
_ROOM = (0.70, 0.74)
"""Share of the page, across and up, that the box around the machine may fill."""


def write_picture(painted: list[Painted], seen: Scene, heading: list[str], path: Path) -> None:
    """Write a picture of 1200 x 900 pixels; axes in mm, equal in scale."""
    # Not pyplot: that chooses a window system and keeps figures alive.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH / 100, HEIGHT / 100), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((-0.06, 0.05, 1.0, 0.83), projection="3d")
    _set_view(figure, axes, painted)
    picture = render([_facets(axes, item) for item in painted], WIDTH, HEIGHT)
    figure.figimage(picture, origin="upper", zorder=5)
    _name_frames(figure, axes, seen.frames)
    marked = {p.shape.name for p in painted if p.is_marked}
    _name_joints(figure, axes, seen.labelled(marked), marked)
    _add_legend(figure, painted)
    for line, (text, size) in enumerate(zip(heading, (17, 13, 13), strict=False)):
        figure.text(0.02, 0.955 - 0.035 * line, text, fontsize=size, color=MARKED if line == 2 else "black")
    figure.savefig(path, format="png")


def _set_view(figure: Any, axes: Any, painted: list[Painted]) -> None:
    corners = 1e3 * np.concatenate([p.shape.rings.reshape(-1, 3) for p in painted])
    low, high = corners.min(axis=0), corners.max(axis=0)
    spread, middle = np.maximum(high - low, 0.25 * (high - low).max()), (low + high) / 2
    low, high = middle - spread / 2, middle + spread / 2
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.grid(color="#D9D9D9", linewidth=0.6)
    axes.set_proj_type("persp", focal_length=1.6)
    axes.view_init(**VIEW)
    axes.set_xlabel("x, mm", labelpad=8)
    axes.set_ylabel("y, mm", labelpad=8)
    axes.set_zlabel("z, mm", labelpad=8)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
        axis.set_tick_params(color="#808080", labelcolor="#404040", labelsize=9)
    axes.set_box_aspect(spread)
    figure.canvas.draw()  # fixes the projection
    box = np.stack(np.meshgrid(*np.stack([low, high], axis=1)), axis=-1).reshape(-1, 3) / 1e3
    span = np.ptp(_on_page(axes, box)[:, :2], axis=0) / (WIDTH, HEIGHT)
    axes.set_box_aspect(spread, zoom=float(min(_ROOM / span)))
    figure.canvas.draw()


def _on_page(axes: Any, points: Array) -> Array:
    """Points (n, 3) in m on the page: x and y in pixels from the lower left corner, depth away from the eye."""
    seen = np.column_stack([1e3 * points, np.ones(len(points))]) @ axes.get_proj().T
    seen = seen[:, :3] / seen[:, 3:]
    return np.column_stack([axes.transData.transform(seen[:, :2]), seen[:, 2]])


def _facets(axes: Any, item: Painted) -> Facets:
    vertices, faces, colours = lit(item)
    return Facets(_on_page(axes, vertices)[faces], colours, item.opacity)


def lit(item: Painted) -> tuple[Array, Array, Array]:
    """Vertices (n, 3) in m, triangles (m, 3) and colours of the triangles (m, 3) of a shape that is lit from the upper left."""
    from matplotlib.colors import to_rgb

    vertices, faces = item.shape.mesh()
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    bright = np.clip(normals @ _LIGHT / np.where(sizes > 0, sizes, 1), 0, 1)
    return vertices, faces, np.array(to_rgb(item.colour)) * (0.62 + 0.38 * bright)[:, None]


def _name_frames(figure: Any, axes: Any, labels: tuple[Label, ...]) -> None:
    for label in labels:
        x, y, _ = _on_page(axes, label.point[None])[0]
        is_frame = label.text.startswith("{")
        down, left = (13, 16) if is_frame else (0, 0)  # clear of the arrows
        weight = "bold" if is_frame else "normal"
        word = figure.text((x - left) / WIDTH, (y - down) / HEIGHT, label.text, fontsize=11, fontweight=weight, zorder=6)
        word.set(ha="center", va="center", bbox=_PATCH | {"alpha": 0.6})


def _name_joints(figure: Any, axes: Any, labels: tuple[Label, ...], marked: set[str]) -> None:
    """Names of joints in a column on the right, as high as the joints where there is room, with lines to them."""
    places = {label.text: _on_page(axes, label.point[None])[0, :2] for label in labels}
    names = sorted(places, key=lambda name: -places[name][1])
    lowest, y = 0.14 * HEIGHT, 0.84 * HEIGHT
    step = min(34.0, (y - lowest) / len(names))
    for row, name in enumerate(names):
        y = max(min(y - step, places[name][1] + 60), lowest + (len(names) - 1 - row) * step)
        colour = MARKED if name in marked else "black"
        weight = "bold" if name in marked else "normal"
        word = figure.text(0.985, y / HEIGHT, name, fontsize=12, fontweight=weight, color=colour, zorder=8)
        word.set(ha="right", va="center", bbox=_PATCH)
        _draw_leader(figure, (WIDTH - 130, y), places[name], colour)


def _draw_leader(figure: Any, start: tuple[float, float], end: Array, colour: str) -> None:
    from matplotlib.lines import Line2D

    x, y = (start[0] / WIDTH, end[0] / WIDTH), (start[1] / HEIGHT, end[1] / HEIGHT)
    figure.add_artist(Line2D(x, y, color=colour, linewidth=0.8, zorder=7, marker="o", markevery=[1], markersize=3))


def _add_legend(figure: Any, painted: list[Painted]) -> None:
    from matplotlib.patches import Patch

    roles = {p.shape.role for p in painted}
    handles = [Patch(color=COLOURS[role], label=role) for role in LEGEND if role in roles]
    if any(p.is_marked for p in painted):
        handles.append(Patch(color=MARKED, label="named above"))
    figure.legend(handles=handles, loc="lower center", ncols=len(handles), frameon=False, fontsize=12)
