"""Natural modes as a PNG picture: small drawings side by side, the machine at rest behind each."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import Any

import numpy as np

from trivet.show.mode_shapes import MovingScene, captions, joined
from trivet.show.palette import COLOURS
from trivet.show.raster import Facets, render
from trivet.show.shapes import Array, Shape

MOST, COLUMNS = 6, 3
PANEL, TOP, BOTTOM = (500, 440), 150, 90
"""Pixels."""
LONGEST = 60
"""Letters in a line of a panel."""
COLOUR_MAP = "plasma"
IN_FRONT = 1e6
GHOST, GHOST_OPACITY = "#9AA5B1", 0.35

_LIGHT = np.array((0.35, -0.45, 0.82)) / np.linalg.norm((0.35, -0.45, 0.82))
_ELEVATION, _AZIMUTH = math.radians(24), math.radians(-58)
_ACROSS = np.array((-math.sin(_AZIMUTH), math.cos(_AZIMUTH), 0.0))
_TOWARDS = np.array(
    (math.cos(_ELEVATION) * math.cos(_AZIMUTH), math.cos(_ELEVATION) * math.sin(_AZIMUTH), math.sin(_ELEVATION))
)
_VIEW = np.stack([_ACROSS, np.cross(_TOWARDS, _ACROSS), -_TOWARDS], axis=1)
"""(3, 3): from {O} to right, up and away on the page."""


def write_picture(seen: MovingScene, path: Path) -> None:
    """Write a picture of the first six modes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = min(MOST, len(seen.modes))
    columns, rows = min(COLUMNS, count), -(-count // COLUMNS)
    width, height = max(columns, 2) * PANEL[0], TOP + rows * PANEL[1] + BOTTOM
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    FigureCanvasAgg(figure)
    scale, middle = _fit(seen, count)
    bodies: list[Facets] = []
    for mode, words in zip(range(count), captions(seen), strict=False):
        left = (mode % COLUMNS) * PANEL[0]
        low = height - TOP - (mode // COLUMNS + 1) * PANEL[1]
        shift = np.array((left + PANEL[0] / 2, low + PANEL[1] / 2 - 22, 0.0)) - scale * np.array((*middle, 0.0))
        bodies += _bodies(seen, mode, lambda points, shift=shift: scale * (points @ _VIEW) + shift)
        for down, text, size in ((10, words[0], 13), (34, textwrap.fill(words[1], LONGEST), 10)):
            figure.text((left + 24) / width, (low + PANEL[1] - down) / height, text, fontsize=size, va="top")
        _name_axes(figure, seen, lambda points, shift=shift: (scale * (points @ _VIEW) + shift) / (width, height, 1.0))
    figure.figimage(render(bodies, width, height), origin="upper", zorder=5)
    for line, (text, size) in enumerate(zip(seen.title, (18, 13, 13), strict=True)):
        figure.text(24 / width, (height - 42 - 32 * line) / height, text, fontsize=size)
    _add_legend(figure, width, height)
    figure.savefig(path, format="png")


def _fit(seen: MovingScene, count: int) -> tuple[float, Array]:
    """Pixels per m at which every panel holds the machine in all modes, and the middle of it on the page (m)."""
    shapes = [*seen.rest, *(body.at(k, sign) for body in seen.bodies for k in range(count) for sign in (0.0, 1.0))]
    flat = np.concatenate([shape.rings.reshape(-1, 3) for shape in shapes]) @ _VIEW[:, :2]
    low, high = flat.min(axis=0), flat.max(axis=0)
    return float(min(np.array((PANEL[0] - 50, PANEL[1] - 80)) / (high - low))), (low + high) / 2


def _bodies(seen: MovingScene, mode: int, project: Any) -> list[Facets]:
    """One panel: what stands still, the displaced machine in colours of its displacement, the machine at rest as a shadow."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    found = [_facets([shape], project, np.array(to_rgb(COLOURS[shape.role]))) for shape in seen.rest]
    way = np.concatenate([np.linalg.norm(_way(body.shape, body.at(mode, 1.0)), axis=1) for body in seen.bodies])
    displaced = [body.at(mode, 1.0) for body in seen.bodies]
    _, faces = joined(displaced)
    shades = colormaps[COLOUR_MAP](way[faces].mean(axis=1) / max(float(way.max()), 1e-300))[:, :3]
    # In front of all else: under the shadow of the machine at rest its colours would not be those of the scale.
    found.append(_facets(displaced, lambda points: project(points) - (0.0, 0.0, IN_FRONT), shades))
    found.append(
        _facets([body.shape for body in seen.bodies], project, np.array(to_rgb(GHOST)))._replace(opacity=GHOST_OPACITY)
    )
    return found


def _way(start: Shape, end: Shape) -> Array:
    return end.mesh()[0] - start.mesh()[0]


def _facets(shapes: list[Shape], project: Any, colours: Array) -> Facets:
    """Triangles of shapes on the page, lit from the upper left; colours (3,) or (n, 3)."""
    vertices, faces = joined(shapes)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    bright = np.clip(normals @ _LIGHT / np.where(sizes > 0, sizes, 1), 0, 1)
    return Facets(project(vertices)[faces], colours * (0.62 + 0.38 * bright)[:, None], 1.0)


def _name_axes(figure: Any, seen: MovingScene, project: Any) -> None:
    """Letters at the tips of the axes of {O}."""
    for shape in seen.rest:
        if shape.name.startswith("{O}") and np.allclose(shape.rings[-1], shape.end):
            x, y, _ = project(1.12 * shape.end)
            figure.text(x, y, shape.name[-1], fontsize=10, ha="center", va="center", zorder=6)


def _add_legend(figure: Any, width: int, height: int) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.patches import Patch

    axes = figure.add_axes((0.42, 60 / height, 300 / width, 12 / height))
    bar = figure.colorbar(ScalarMappable(cmap=COLOUR_MAP), cax=axes, orientation="horizontal", ticks=[0, 0.5, 1])
    bar.set_label("displacement, of the largest in the mode", fontsize=11)
    patch = [Patch(color=GHOST, alpha=GHOST_OPACITY, label="at rest")]
    figure.legend(handles=patch, loc="lower left", bbox_to_anchor=(0.25, 42 / height), frameon=False, fontsize=12)
