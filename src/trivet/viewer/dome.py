"""The map on the page: the workpiece hemisphere enlarged above the machine, coloured; a click on it is a pose to go to."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import viser

from trivet.show.palette import MARKED, VERMILLION
from trivet.show.shapes import Array
from trivet.viewer.mapping import Mapped
from trivet.viewer.stage import rgb
from trivet.viewer.words import scale, swatches

COLOURS, SIGNED_COLOURS = "viridis", "RdBu_r"
EXCLUDED, UNBOUNDED = (140, 140, 140), (0, 0, 0)
"""Channels of points that are not reached, and of those where the quantity is infinite; no colour of a value is grey."""
RADIUS, ABOVE = 0.22, 0.45
"""Of the dome, and of its centre above the highest point of the machine, as shares of the machine's size."""
LEGEND = 9
"""Colours of the legend."""


class Dome:
    """The map of one machine."""

    def __init__(self, server: viser.ViserServer, root: str, go: Callable[[int], None]) -> None:
        """`go` is called with the number of the check point that was clicked."""
        self._server, self._root, self._go = server, root, go
        self._handles: list[Any] = []
        self._spot: viser.IcosphereHandle | None = None
        self._centre, self._radius = np.zeros(3), 1.0
        self.shown: Mapped | None = None

    def show(self, found: Mapped | None, size: float, top: float) -> str:
        """Draw a map above a machine of a size, whose highest point is there (m); gives its legend, empty for none."""
        for handle in self._handles:
            handle.remove()
        self._handles, self._spot, self.shown = [], None, found
        if found is None:
            return ""
        self._centre, self._radius = np.array((0.0, 0.0, top + ABOVE * size - RADIUS * size)), RADIUS * size
        name = f"{self._root}/map"
        skin = self._server.scene.add_mesh_trimesh(name, self._skin(found), position=self._centre, cast_shadow=False)
        skin.on_click(self._clicked)
        self._spot = self._server.scene.add_icosphere(f"{name}/here", 0.05 * self._radius, color=rgb(VERMILLION))
        self._handles = [skin, self._spot]
        for number, points in enumerate(found.curves):
            way = self._radius * 1.01 * self._unit(found, points)
            lines = np.stack([way[:-1], way[1:]], axis=1)
            curve = self._server.scene.add_line_segments(
                f"{name}/curve-{number}", lines, rgb(MARKED), thickness=4.0, thickness_units="screen"
            )
            self._handles.append(curve)
        low, high = found.limits
        ramp = self._colours(found, np.linspace(low, high, LEGEND))
        enlarged = self._radius / self._size(found)
        words = f"{found.label}; the hemisphere is drawn {enlarged:.0f} times as large"
        return scale(words, low, high, [_css(colour) for colour in ramp.tolist()]) + swatches(_told(found))

    def here(self, azimuth: float, tilt: float) -> None:
        """Show where the platform normal points."""
        if self._spot is not None:
            sine = math.sin(tilt)
            self._spot.position = self._radius * np.array((sine * math.cos(azimuth), sine * math.sin(azimuth), math.cos(tilt)))

    @staticmethod
    def _size(found: Mapped) -> float:
        return float(np.hypot(*found.surface.position[:, :2].T).max())

    def _unit(self, found: Mapped, points: Array) -> Array:
        """Points of the surface on a sphere of radius one about its own centre."""
        flat = points[:, :2] / self._size(found)
        up = np.sqrt(np.maximum(1 - (flat**2).sum(axis=1), 0.0))
        return np.column_stack([flat, up])

    def _skin(self, found: Mapped) -> Any:
        import trimesh
        from scipy.spatial import Delaunay

        points = self._unit(found, found.surface.position)
        faces = Delaunay(points[:, :2]).simplices
        colours = self._colours(found, found.values)
        return trimesh.Trimesh(self._radius * points, faces, vertex_colors=colours, process=False)

    @staticmethod
    def _colours(found: Mapped, values: Array) -> Array:
        """(n, 3) channels from 0 to 255."""
        from matplotlib import colormaps

        low, high = found.limits
        share = np.clip((np.nan_to_num(values, nan=low) - low) / (high - low), 0.0, 1.0)
        colours = colormaps[SIGNED_COLOURS if found.is_signed else COLOURS](share, bytes=True)[:, :3]
        colours = np.where(np.isinf(values)[:, None], np.array(UNBOUNDED, dtype=np.uint8), colours)
        return np.where(np.isnan(values)[:, None], np.array(EXCLUDED, dtype=np.uint8), colours)

    async def _clicked(self, event: Any) -> None:
        """Go to the check point that is nearest to where a ray meets the dome."""
        if self.shown is None:
            return
        foot = np.asarray(self._server.scene.get_handle_by_name(self._root).position)  # type: ignore[union-attr]
        origin = np.array(event.ray_origin, dtype=float) - self._centre - foot
        way = np.array(event.ray_direction, dtype=float)
        number = hit(self._unit(self.shown, self.shown.surface.position), origin / self._radius, way)
        if number is not None:
            self._go(number)


def _css(colour: Sequence[int]) -> str:
    return f"rgb({colour[0]},{colour[1]},{colour[2]})"


def _told(found: Mapped) -> list[tuple[str, str]]:
    """What a scale does not say of a map: a colour (empty for none) and words."""
    values, told = found.values, []
    finite, (low, high) = values[np.isfinite(values)], found.limits
    if len(finite) and (finite.min() < low or finite.max() > high):
        told.append(("", f"colours end at {low:.4g} and {high:.4g}; values go from {finite.min():.4g} to {finite.max():.4g}"))
    missed, unbounded = int(np.isnan(values).sum()), int(np.isinf(values).sum())
    told.append((_css(EXCLUDED) if missed else "", f"{len(values) - missed} of {len(values)} points reached"))
    if unbounded:
        why = "; at zero tilt the angles of the pose fail, not the machine" if found.is_angular else ""
        told.append((_css(UNBOUNDED), f"infinite at {unbounded}{why}"))
    return told


def hit(points: Array, origin: Array, way: Array) -> int | None:
    """Which of the points (n, 3) of a unit sphere is nearest to where a ray enters it; None where it does not."""
    length = float(np.linalg.norm(way))
    if not (math.isfinite(length) and length > 0 and np.isfinite(origin).all()):
        return None
    way = way / length
    along = float(origin @ way)
    inside = along**2 - float(origin @ origin) + 1.0
    if inside < 0:
        return None
    met = origin + (-along - math.sqrt(inside)) * way
    return int(np.argmin(((points - met) ** 2).sum(axis=1)))
