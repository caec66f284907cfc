"""Rolls over a cone of directions, seen from above: tilt outwards, the value in colour, the platform's x axis as arrows."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np

from trivet.errors import NoResultError
from trivet.files import replacing
from trivet.kinematics.mode import mode_words
from trivet.reach.touch import Touch
from trivet.show.maps import check_suffix
from trivet.study.cone import ConePlan
from trivet.study.roll_grid import met

PIXELS = 161
"""Across the cone."""
ARROWS = 9
"""Across the cone."""
ROOM = 1.22
"""Of the radius of the cone, around it."""


class Disc(NamedTuple):
    """A cone seen from above: directions as tilt (degrees) towards x and y."""

    edge: float
    """Tilt of the cone, degrees."""
    across: Any
    """(n,) tilts of the pixels, the same towards x and y, degrees."""
    value: Any
    """(n, n) towards y and x; outside the cone as at its edge."""
    inside: Any
    """(n, n) whether a pixel is in the cone."""
    arrows: Any
    """(m, 2, 2) tilts (x, y) of starts and tips of the platform's x axis, degrees."""
    worst: tuple[float, float]
    """Tilts (x, y) of the direction of least value, degrees."""
    least: float


def draw_cone(plan: ConePlan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw the rolls over a cone (PNG or self-contained HTML).

    Raises:
        NoResultError: when there are none.
    """
    suffix = check_suffix(path)
    if plan.sheet is None:
        raise NoResultError(f"{plan.machine.name}: no roll is continuous all over the cone, so there is nothing to draw")
    from trivet.show.cone_page import write_page
    from trivet.show.cone_picture import write_picture

    with replacing(path, overwrite=overwrite) as temporary:
        (write_picture if suffix == ".png" else write_page)(plan, disc_of(plan), temporary)


def disc_of(plan: ConePlan) -> Disc:
    """A cone seen from above, worked out at every pixel."""
    assert plan.samples is not None
    edge = float(np.degrees(plan.knots.tilt.max()))
    across = edge * np.linspace(-1.0, 1.0, PIXELS)
    x, y = np.meshgrid(across, across)
    value = met(plan.rules, _surface(plan, x.ravel(), y.ravel()), np.zeros(x.size)).value.reshape(x.shape)
    apart = 2 * edge / ARROWS
    places = np.stack(np.meshgrid(*(2 * [apart * (np.arange(ARROWS) - ARROWS // 2)])), axis=-1).reshape(-1, 2)
    places = places[np.hypot(*places.T) < edge - apart / 3]
    touch = _surface(plan, *places.T)
    half = 0.3 * apart * np.stack([np.cos(touch.azimuth + touch.roll), np.sin(touch.azimuth + touch.roll)], axis=-1)
    k = int(plan.samples.value.argmin())
    tilt, azimuth = np.degrees(plan.samples.touch.tilt[k]), plan.samples.touch.azimuth[k]
    worst = float(tilt * np.cos(azimuth)), float(tilt * np.sin(azimuth))
    arrows = np.stack([places - half, places + half], axis=1)
    return Disc(edge, across, value, np.hypot(x, y) <= edge, arrows, worst, float(plan.samples.value[k]))


def _surface(plan: ConePlan, x: Any, y: Any) -> Touch:
    """Poses (k,) of the surface between its knots, in directions given as tilts towards x and y (degrees)."""
    azimuths, tilts = plan.knots.azimuth[:, 0], plan.knots.tilt[0]
    u = np.interp(np.arctan2(y, x) % (2 * np.pi), azimuths, np.arange(len(azimuths)))
    v = np.interp(np.radians(np.hypot(x, y)), tilts, np.arange(len(tilts)))
    i, j = np.minimum(u.astype(int), len(azimuths) - 2), np.minimum(v.astype(int), len(tilts) - 2)
    u, v = u - i, v - j
    corners = ((0, 0, (1 - u) * (1 - v)), (1, 0, u * (1 - v)), (0, 1, (1 - u) * v), (1, 1, u * v))
    return Touch(*(sum(part * c[i + a, j + b] for a, b, part in corners) for c in plan.knots))


def title(plan: ConePlan, disc: Disc) -> str:
    """A line above the figure."""
    where = f"every direction up to {disc.edge:.4g}°, z0 = {plan.knots.z[0, 0] * 1e3:g} mm"
    mode = mode_words(plan.mode).replace("-", "−")
    return f"{plan.machine.name}, {mode}, {where}: {plan.verdict}"


def compass(disc: Disc) -> list[tuple[str, float, float, str, str]]:
    """Azimuths around the cone: their names, where these stand, and which side of them is there, across and up."""
    far = 1.03 * disc.edge
    sides = (("left", "center"), ("center", "bottom"), ("right", "center"), ("center", "top"))
    places = (("azimuth 0°", far, 0.0), ("90°", 0.0, far), ("180°", -far, 0.0), ("270°", 0.0, -far))
    return [(*place, *side) for place, side in zip(places, sides, strict=True)]
