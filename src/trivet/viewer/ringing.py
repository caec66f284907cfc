"""A machine that rings: its shapes swinging in a natural mode."""

from __future__ import annotations

import math

import numpy as np
import viser

from trivet.show.mode_shapes import MovingScene, joined
from trivet.show.palette import COLOURS, SEE_THROUGH
from trivet.show.shapes import Role, Shape
from trivet.viewer.stage import MATERIAL, rgb

PERIOD = 1.2
"""Of what is seen, s; what it is in the machine stands beside it."""
FRAMES = 24
"""Per period."""


class Ringing:
    """The swinging shapes of one machine, one mesh for every role."""

    def __init__(self, server: viser.ViserServer, root: str) -> None:
        self._server, self._root = server, root
        self._meshes: dict[Role, viser.MeshHandle] = {}
        self._seen: MovingScene | None = None
        self._mode = 0

    def show(self, seen: MovingScene | None, mode: int = 0) -> None:
        """Show a mode (from 0) of a scene; None for none."""
        for handle in self._meshes.values():
            handle.remove()
        self._meshes, self._seen, self._mode = {}, seen, mode
        if seen is None:
            return
        for role, shapes in self._displaced(seen, 0.0).items():
            vertices, faces = joined(shapes)
            self._meshes[role] = self._server.scene.add_mesh_simple(
                f"{self._root}/ringing-{len(self._meshes)}", vertices, faces, color=rgb(COLOURS[role]), flat_shading=True,
                opacity=SEE_THROUGH.get(role), material=MATERIAL, side="front", cast_shadow=False, receive_shadow=False,
            )  # fmt: skip

    @property
    def is_shown(self) -> bool:
        """Whether something rings."""
        return self._seen is not None

    def swing(self, phase: float) -> None:
        """Move the shapes to a phase of the period (rad)."""
        seen = self._seen
        if seen is None:
            return
        for role, shapes in self._displaced(seen, math.sin(phase)).items():
            if role in self._meshes:
                self._meshes[role].vertices = joined(shapes)[0].astype(np.float32)

    def _displaced(self, seen: MovingScene, factor: float) -> dict[Role, list[Shape]]:
        found: dict[Role, list[Shape]] = {}
        for body in seen.bodies:
            found.setdefault(body.shape.role, []).append(body.at(self._mode, factor))
        return found
