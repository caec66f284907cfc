"""The machine moving along a way, on a page: bodies, a dot where it is on the map and on the margins, a slider, a button."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np

from trivet.show import shapes
from trivet.show.mode_shapes import COARSER, joined
from trivet.show.palette import BLACK, COLOURS, LEGEND, SEE_THROUGH, VERMILLION
from trivet.show.plan import headings, marks, panels
from trivet.show.scene import scene
from trivet.show.shapes import Role, Shape
from trivet.study.plan import Plan
from trivet.study.roll_grid import degrees_of, frames_of, some

MOST_FRAMES = 60
BODIES: tuple[Role, ...] = ("ground", "guide", "link", "actuated joint", "locked joint", "passive joint", "platform", "tool")
_PACE = 60
"""Time that a frame is shown, ms."""
_LEFT, _WIDTH, _UP = 0.64, 0.36, 0.12
"""Where the machine is, above the slider, shares of the page."""
_ZOOM = 0.95
"""Largest side of the box around the machine, in plotly's unit."""
_CAMERA = {"eye": {"x": 1.0, "y": -1.5, "z": 0.8}, "center": {"x": 0, "y": 0, "z": -0.05}}
_LIGHT = {"ambient": 0.7, "diffuse": 0.5, "specular": 0.05}
_NO_TICKS = {"ticklen": 0, "minorticklen": 0, "font": {"color": "rgba(0,0,0,0)"}}
"""Of a slider: its steps are told above it, one at a time."""


def samples_of(plan: Plan) -> list[int]:
    """Samples of a way at which the machine is seen."""
    assert plan.along is not None
    found: list[int] = np.unique(np.linspace(0, len(plan.along.rows) - 1, MOST_FRAMES).round().astype(int)).tolist()
    return found


def standing(plan: Plan, samples: list[int]) -> dict[str, tuple[Shape, ...]]:
    """Every body at samples of a way, coarse where it is round; those that do not move once only."""
    assert plan.along is not None
    poses = frames_of(plan.along.touch, plan.rules.radius)
    found: list[dict[str, Shape]] = []
    for k in samples:
        seen = scene(plan.machine, jax.tree.map(float, some(poses, k)), plan.mode)
        own: dict[str, Shape] = {}
        for shape in (shape for shape in seen.shapes if shape.role in BODIES):
            number = sum(key.startswith(f"{shape.name}/") for key in own)
            coarse = COARSER if shape.rings.shape[1] > 12 else 1
            own[f"{shape.name}/{number}"] = shape._replace(rings=shape.rings[:, ::coarse])
        found.append(own)
    common = [key for key in found[0] if all(key in own for own in found)]
    bodies = {key: tuple(own[key] for own in found) for key in common}
    return {key: own if _moves(own) else own[:1] for key, own in bodies.items()}


def _moves(own: tuple[Shape, ...]) -> bool:
    return any(not np.allclose(shape.rings, own[0].rings, rtol=0, atol=1e-9) for shape in own)


def add_motion(plan: Plan, page: Any) -> None:
    """Put the machine into the second column of a page, and dots on the map and the margins in its first."""
    import plotly.graph_objects as go

    samples = samples_of(plan)
    bodies = list(standing(plan, samples).values())
    still = [own[0] for own in bodies if len(own) == 1]
    for role in BODIES:
        if alike := [shape for shape in still if shape.role == role]:
            page.add_trace(_mesh(alike, role, in_legend=role in LEGEND), row=1, col=2)
    if plan.rules.radius > 0:
        centre = np.array([float(c[0]) for c in plan.grid.path[:3]])
        page.add_trace(_mesh([shapes.ball("sphere", "workpiece", centre, plan.rules.radius)], "sphere"), row=1, col=2)
    moving = [(role, own) for role in BODIES if (own := [own for own in bodies if len(own) > 1 and own[0].role == role])]
    first = len(page.data)
    for role, own in moving:
        is_new = role in LEGEND and not any(shape.role == role for shape in still)
        page.add_trace(_mesh([body[0] for body in own], role, in_legend=is_new), row=1, col=2)
    dots = _dots(plan, samples)
    for row, (x, y) in enumerate(dots, start=1):
        marker = {"size": 12, "color": VERMILLION, "line": {"color": "white", "width": 2}}
        page.add_scatter(
            x=x[:1],
            y=y[:1],
            mode="markers",
            marker=marker,
            showlegend=False,
            hoverinfo="skip",
            cliponaxis=False,
            row=row,
            col=1,
        )
    numbers = list(range(first, len(page.data)))
    page.frames = [
        go.Frame(
            name=str(k), traces=numbers,
            data=[go.Mesh3d(**_corners([body[k] for body in own])) for _, own in moving]
            + [go.Scatter(x=x[k : k + 1], y=y[k : k + 1]) for x, y in dots],
        )
        for k in range(len(samples))
    ]  # fmt: skip
    page.update_layout(scene=_space([shape for own in bodies for shape in own]), **_controls(plan, samples))


def _dots(plan: Plan, samples: list[int]) -> list[tuple[Any, Any]]:
    """Where the machine is at samples: on the map, and on every margin."""
    across = marks(plan)[samples]
    return [(across, own[samples]) for own in (headings(plan), *(panel.values for panel in panels(plan)))]


def _corners(found: list[Shape]) -> dict[str, Any]:
    """Of the skins of shapes, mm."""
    vertices, _ = joined(found)
    return dict(zip("xyz", (1e3 * vertices).astype(np.float32).T, strict=True))


def _mesh(found: list[Shape], name: str, in_legend: bool = True) -> Any:
    import plotly.graph_objects as go

    role = found[0].role
    _, faces = joined(found)
    return go.Mesh3d(
        **_corners(found), **dict(zip("ijk", faces.astype(np.int32).T, strict=True)), color=COLOURS[role], name=name,
        opacity=SEE_THROUGH.get(role, 1.0), flatshading=True, lighting=_LIGHT, hoverinfo="name", showlegend=in_legend,
        legend="legend2",
    )  # fmt: skip


def _space(found: list[Shape]) -> dict[str, Any]:
    """Axes that hold the machine at all samples, equal in scale."""
    corners = 1e3 * np.concatenate([shape.rings.reshape(-1, 3) for shape in found])
    low, high = corners.min(axis=0), corners.max(axis=0)
    look: dict[str, Any] = {
        "backgroundcolor": "#F7F7F7",
        "gridcolor": "#D9D9D9",
        "showspikes": False,
        "showgrid": True,
        "showbackground": True,
    }
    axes: dict[str, Any] = {
        f"{letter}axis": {"range": [float(low[k]), float(high[k])], "title": {"text": f"{letter}, mm"}, **look}
        for k, letter in enumerate("xyz")
    }
    ratio = _ZOOM * (high - low) / (high - low).max()
    ratios = dict(zip("xyz", ratio.tolist(), strict=True))
    look = {"aspectmode": "manual", "aspectratio": ratios, "camera": _CAMERA, "uirevision": "kept"}
    return {**axes, **look, "domain": {"x": [_LEFT, _LEFT + _WIDTH], "y": [_UP, 1.0]}}


def _controls(plan: Plan, samples: list[int]) -> dict[str, Any]:
    """A slider, buttons, and the legend of the bodies."""
    assert plan.along is not None
    now = {"frame": {"duration": 0, "redraw": True}, "mode": "immediate", "transition": {"duration": 0}}
    play = {"frame": {"duration": _PACE, "redraw": True}, "fromcurrent": True, "transition": {"duration": 0}}
    steps = []
    for k, sample in enumerate(samples):
        where = "" if plan.grid.poses is None else f"{plan.grid.mark(plan.along.rows[sample])}: "
        steps.append({"method": "animate", "label": where + degrees_of(plan.along.touch, sample), "args": [[str(k)], now]})
    pressed = (("play", [None, play]), ("stop", [[None], now]))
    buttons = [{"label": label, "method": "animate", "args": args} for label, args in pressed]
    told = {"font": {"color": BLACK, "size": 13}}
    row = {
        "type": "buttons",
        "direction": "left",
        "x": _LEFT,
        "xanchor": "left",
        "y": 0.03,
        "yanchor": "top",
        "showactive": False,
    }
    return {
        "sliders": [{"steps": steps, "x": _LEFT + 0.1, "len": _WIDTH - 0.1, "y": 0.06, "currentvalue": told, **_NO_TICKS}],
        "updatemenus": [{"buttons": buttons, **row}],
        "legend2": {"orientation": "h", "x": 1, "xanchor": "right", "y": 1.015, "yanchor": "bottom", "itemsizing": "constant"},
    }
