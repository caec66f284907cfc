"""Draw the sketch of docs/plan.md; its other figures are drawn by the commands told there.

python docs/make_plan_figures.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jax
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import trivet
from trivet.show import shapes
from trivet.show.mode_picture import _VIEW as ASLANT
from trivet.show.mode_shapes import joined
from trivet.show.palette import COLOURS
from trivet.show.raster import Facets, render
from trivet.show.scene import scene
from trivet.show.shapes import Shape
from trivet.study.roll_grid import frames_of, some

FIGURES = Path(__file__).parent / "figures"
RADIUS, HEIGHT, MODE = 0.004, 0.110, "++ ++ -+"
CENTRE = np.array((0.0, 0.0, HEIGHT))
WIDTH, TALL, TOP = 500, 360, 44
"""Pixels of a panel, and above them."""
LIGHT = np.array((0.35, -0.45, 0.82)) / np.linalg.norm((0.35, -0.45, 0.82))
SIDE = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)))
"""(3, 3): from {O} to right, up and away on the page, seen along y."""
CLOSE = 7000.0
"""Pixels per m."""
SEEN_THROUGH = 0.5
"""Opacity of the platform, which would hide the sphere when it is near."""


def facets(shape: Shape, project: Any, opacity: float = 1.0) -> Facets:
    """Triangles of a shape on the page, lit from the upper left."""
    vertices, faces = joined([shape])
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    bright = np.clip(normals @ LIGHT / np.where(sizes > 0, sizes, 1), 0, 1)
    return Facets(project(vertices)[faces], np.array(to_rgb(COLOURS[shape.role])) * (0.62 + 0.38 * bright)[:, None], opacity)


def bodies(pose: Any) -> list[Shape]:
    """The machine without its axes, on the sphere."""
    seen = scene(trivet.load("azulay"), pose, MODE)
    ball = shapes.ball("sphere", "workpiece", CENTRE, RADIUS)
    return [s for s in seen.shapes if not s.role.endswith("axis") and s.role != "workpiece"] + [ball]


def whole(figure: Any, found: list[Shape], left: float, low: float) -> None:
    """The machine seen aslant."""
    corners = np.concatenate([shape.rings.reshape(-1, 3) for shape in found]) @ ASLANT[:, :2]
    scale = float(min(np.array((WIDTH - 40, TALL - 40)) / np.ptp(corners, axis=0)))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2

    def project(points: Any) -> Any:
        return scale * (points @ ASLANT - (*middle, 0.0)) + (WIDTH / 2, TALL / 2, 0.0)

    figure.figimage(render([facets(shape, project) for shape in found], WIDTH, TALL), left, low, origin="upper", zorder=5)
    x, y, _ = project(CENTRE)
    total = figure.get_size_inches() * figure.dpi
    look = {"xycoords": "figure fraction", "textcoords": "offset points", "arrowprops": {"arrowstyle": "-"}}
    figure.axes[0].annotate("sphere", ((left + x) / total[0], (low + y) / total[1]), (42, 46), **look)


def close(figure: Any, found: list[Shape], pose: Any, left: float, low: float) -> None:
    """The platform and the sphere, seen along y, with the normal at the touching point."""
    shift = np.array((WIDTH / 2, TALL / 2, 0.0)) - CLOSE * CENTRE @ SIDE

    def project(points: Any) -> Any:
        return CLOSE * points @ SIDE + shift

    own = [facets(shape, project, SEEN_THROUGH) for shape in found if shape.role == "platform"] + [facets(found[-1], project)]
    figure.figimage(render(own, WIDTH, TALL), left, low, origin="upper", zorder=5)
    total = figure.get_size_inches() * figure.dpi
    touching, normal = np.array([float(c) for c in pose.origin]), np.array(pose.matrix(), dtype=float)[:, 2]

    def place(point: Any) -> Any:
        return (project(point)[:2] + np.array((left, low))) / total

    axes, tip = figure.axes[0], touching + 0.016 * normal
    page = {"xycoords": "figure fraction"}
    arrow = {"arrowstyle": "-|>,head_width=0.35,head_length=0.7", "color": "black", "linewidth": 2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", place(tip), place(touching), textcoords="figure fraction", arrowprops=arrow, **page)
    axes.plot(*place(touching), "o", color="black", markersize=6, transform=figure.transFigure, clip_on=False)
    line = {"arrowstyle": "-", "linewidth": 0.8, "shrinkB": 3}
    rim = touching + 0.015 * np.cross((0.0, 1.0, 0.0), normal)
    for text, point, beside, is_led in (
        ("normal n, the z axis of {E}", tip, (0, 14), False),
        ("touching point: {E}", touching, (95, 62) if normal[2] > 0.5 else (-105, 62), True),
        ("sphere, on the side of −n", CENTRE - 0.9 * RADIUS * normal, (-95, -68), True),
        ("platform", rim, (30, -62) if normal[2] > 0.5 else (72, 10), True),
    ):
        look = {"ha": "center", "va": "center", "fontsize": 11, "arrowprops": line if is_led else None}
        axes.annotate(text, place(point), beside, textcoords="offset points", **look, **page)


def sphere_figure() -> None:
    plan = trivet.plan("azulay", RADIUS, HEIGHT, mode=MODE, proof=False)
    assert plan.along is not None
    poses = frames_of(plan.along.touch, RADIUS)
    figure = Figure(figsize=(2 * WIDTH / 100, (2 * TALL + TOP) / 100), dpi=100)
    FigureCanvasAgg(figure)
    figure.add_axes((0, 0, 1, 1), zorder=10).set_axis_off()  # words, above the bodies
    for column, (name, k) in enumerate((("level", 0), ("at 90° of tilt, towards x", len(plan.along.rows) - 1))):
        pose = jax.tree.map(float, some(poses, k))
        found = bodies(pose)
        left = column * WIDTH
        whole(figure, found, left, TALL)
        close(figure, found, pose, left, 0)
        figure.text((left + 20) / (2 * WIDTH), 1 - 30 / (2 * TALL + TOP), name, fontsize=14)
    figure.text(0.02, 0.018, "below: sphere (radius 4 mm) and platform alone, seen along y", fontsize=10)
    figure.savefig(FIGURES / "plan-sphere.png", format="png")


if __name__ == "__main__":
    sphere_figure()
