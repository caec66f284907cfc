"""A machine on the page: its shapes as meshes that move with its bodies, the joints that a status names in another colour."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import Bodies, bodies, starts
from trivet.model import Machine
from trivet.show.palette import BLACK, COLOURS, MARKED, SEE_THROUGH
from trivet.show.rig import Rig, rig
from trivet.show.scene import scene
from trivet.show.shapes import Array, Shape
from trivet.space.frame import Frame

MATERIAL: Final = "toon5"
"""The quickest of viser's that shows where a body is round."""
GHOST = 0.25
"""Opacity of a platform where it is wanted but not reached."""
TITLE = 0.15
"""How far above the machine its name is, in its sizes."""
LIGHT = "#E8E8E8"
"""What is black by day, by night."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Channels, 0 to 255, of a colour written #RRGGBB."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def quaternion(axes: Array) -> Array:
    """(…, 4) w, x, y, z of axes (…, 3, 3) in columns."""
    found: Array = np.roll(Rotation.from_matrix(axes).as_quat(), 1, axis=-1)
    return found


class Stage:
    """Where a machine is drawn."""

    def __init__(self, server: viser.ViserServer, root: str) -> None:
        self._server, self._root = server, root
        self._foot = server.scene.add_frame(root, show_axes=False)
        self._parts: list[viser.MeshHandle] = []
        self._names: list[viser.LabelHandle] = []
        self._title: viser.LabelHandle | None = None
        self._ghost: viser.MeshHandle | None = None
        self._rig: Rig | None = None
        self._starts: tuple[int, ...] = ()
        self._marked: frozenset[str] = frozenset()
        self._is_dark, self._is_hidden = False, False
        self.size, self.top = 0.0, 0.0
        """Largest extent of the machine and height of its highest point, m."""

    def set_aside(self, offset: Array) -> None:
        """Where {O} is on the page, m."""
        self._foot.position = offset

    def entitle(self, name: str) -> None:
        """Write the name of the machine above it."""
        height = self.top + TITLE * self.size
        self._title = self._server.scene.add_label(f"{self._root}/title", name, position=(0.0, 0.0, height))

    def draw(self, machine: Machine, pose: Frame, mode: str) -> None:
        """Draw a machine at a pose that its chains reach; what was drawn before goes.

        Raises:
            NoResultError: when a chain does not reach the pose.
        """
        seen = scene(machine, pose, mode or None)
        kept = tuple(shape for shape in seen.shapes if not shape.name.startswith("{E}"))
        self._rig = rig(kept, bodies(machine, pose, parse_mode(machine, mode or None)))
        self._starts = starts(machine)
        corners = np.concatenate([s.rings.reshape(-1, 3) for s in kept if not s.name.startswith("{")])
        self.size, self.top = float(np.ptp(corners, axis=0).max()), float(corners[:, 2].max())
        with self._server.atomic():
            self._set_meshes(self._rig.shapes)
            self._set_names([*(leg.name for leg in machine.legs), "{O}"])
            self._set_ghost(next((s for s in self._rig.shapes if s.name == "platform"), None))

    def _set_meshes(self, shapes: tuple[Shape, ...]) -> None:
        if len(shapes) != len(self._parts):
            for handle in self._parts:
                handle.remove()
            self._parts = [self._mesh(f"{self._root}/part-{k}", shape) for k, shape in enumerate(shapes)]
            return
        for handle, shape in zip(self._parts, shapes, strict=True):
            vertices, faces = (a.astype(t) for a, t in zip(shape.mesh(), (np.float32, np.uint32), strict=True))
            if not np.array_equal(handle.vertices, vertices):
                handle.vertices = vertices
            if not np.array_equal(handle.faces, faces):
                handle.faces = faces
            handle.color = self._colour(shape)
            opacity = SEE_THROUGH.get(shape.role)
            if handle.opacity != opacity:
                handle.opacity = opacity

    def _mesh(self, name: str, shape: Shape) -> viser.MeshHandle:
        vertices, faces = shape.mesh()
        return self._server.scene.add_mesh_simple(
            name, vertices.astype(np.float32), faces.astype(np.uint32), color=self._colour(shape), flat_shading=True,
            opacity=SEE_THROUGH.get(shape.role), material=MATERIAL,
            side="front", cast_shadow=False, receive_shadow=False, visible=not self._is_hidden,
        )  # fmt: skip

    def _colour(self, shape: Shape) -> tuple[int, int, int]:
        own = COLOURS[shape.role]
        if shape.name in self._marked and (shape.role.endswith("joint") or shape.role in ("link", "platform", "tool")):
            own = MARKED
        return rgb(LIGHT if own in (BLACK, COLOURS["tool"]) and self._is_dark else own)

    def _set_names(self, names: Iterable[str]) -> None:
        for handle in self._names:
            handle.remove()
        self._names = [self._server.scene.add_label(f"{self._root}/name-{k}", name) for k, name in enumerate(names)]

    def _set_ghost(self, platform: Shape | None) -> None:
        if self._ghost is not None:
            self._ghost.remove()
        self._ghost = None
        if platform is not None:
            self._ghost = self._mesh(f"{self._root}/wanted", platform)
            self._ghost.color, self._ghost.opacity, self._ghost.visible = rgb(MARKED), GHOST, False

    def place(self, there: Bodies) -> None:
        """Move all to where the bodies are."""
        if self._rig is None:
            return
        placed = self._rig.placed(there)
        turns = quaternion(placed.axes)
        drawn_out = self._rig.length > 0
        for handle, origin, turn, stretch, is_out in zip(
            self._parts, placed.origin, turns, placed.stretch, drawn_out, strict=True
        ):
            handle.position, handle.wxyz = origin, turn
            if is_out:
                handle.scale = (1.0, 1.0, float(stretch))
        feet = [there.frames[start + 1, 0] for start in self._starts]
        for label, foot in zip(self._names, feet, strict=False):
            outwards = foot[:2] / max(float(np.hypot(*foot[:2])), 1e-9)
            label.position = foot + 0.06 * self.size * np.array((*outwards, 0.0))

    def want(self, pose: Frame | None) -> None:
        """Show the platform where it is wanted and not reached; None where it is reached."""
        if self._ghost is None:
            return
        self._ghost.visible = pose is not None
        if pose is not None:
            axes = np.array([[float(c) for c in row] for row in pose.matrix()])
            self._ghost.position, self._ghost.wxyz = np.array(pose.origin, dtype=float), quaternion(axes)

    def mark(self, named: frozenset[str]) -> None:
        """Give the joints and bodies of these names the colour of what bites."""
        if named != self._marked:
            self._marked = named
            self._paint()

    def light(self, is_dark: bool) -> None:
        """Colours for the theme of the page."""
        if is_dark != self._is_dark:
            self._is_dark = is_dark
            self._paint()

    def _paint(self) -> None:
        if self._rig is not None:
            for handle, shape in zip(self._parts, self._rig.shapes, strict=True):
                colour: Any = self._colour(shape)
                if tuple(handle.color) != colour:
                    handle.color = colour

    def show_names(self, is_shown: bool) -> None:
        """Whether the names of the machine, of its chains and of frames are seen."""
        for handle in (*self._names, *((self._title,) if self._title else ())):
            handle.visible = is_shown

    def hide(self, is_hidden: bool) -> None:
        """Whether the machine itself is not seen."""
        self._is_hidden = is_hidden
        for handle in self._parts:
            handle.visible = not is_hidden
