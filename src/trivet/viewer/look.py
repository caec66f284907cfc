"""Light, floor and where one looks from."""

from __future__ import annotations

import numpy as np
import viser

ASIDE, BELOW = 0.2, 0.35
"""How far aside of the machines, or below them, one looks where the panel stands beside them, or below; in their sizes."""
EYE = np.array((0.45, -1.15, 0.55))
"""From what one looks at to where one stands, in sizes of a machine."""
RIGHT = np.array((0.93, 0.37, 0.0))
"""To the right of who looks so."""


class Look:
    """How machines side by side are looked at."""

    def __init__(self, server: viser.ViserServer, size: float, count: int) -> None:
        """Light them, lay a floor under them, and look at them.

        Args:
            server: where they are shown.
            size: of the largest, m.
            count: of machines.
        """
        self._size, self._wide = size, size if count == 1 else 1.6 * size
        scene = server.scene
        scene.set_up_direction("+z")
        scene.world_axes.visible = False
        scene.configure_environment_map(None)
        # The lights of viser throw shadows, which cost more than all the rest where there is no graphics card.
        scene.configure_default_lights(enabled=False)
        scene.add_light_hemisphere("/sky", intensity=2.0)
        scene.add_light_directional("/lamp", intensity=1.5, cast_shadow=False, position=(1.0, -2.0, 4.0))
        cell = 10 ** np.floor(np.log10(size))
        scene.add_grid("/floor", width=2 * size, height=2 * size, cell_size=cell, section_size=10 * cell, plane="xy")
        camera = server.initial_camera
        camera.position, camera.look_at = self._view(1.0, ASIDE * self._wide * RIGHT)
        camera.up, camera.near, camera.far = (0.0, 0.0, 1.0), 0.01 * size, 100 * size

    def show(self, client: viser.ClientHandle) -> None:
        """Have somebody see all; whose window is narrow stands further away, and looks above the panel, not beside it."""
        aspect = client.camera.aspect
        if 0 < aspect < 1:
            eye, centre = self._view(aspect**-0.7, np.array((0.0, 0.0, -BELOW * self._size)))
        else:
            eye, centre = self._view(1.0, ASIDE * self._wide * RIGHT)
        client.camera.position, client.camera.look_at = eye, centre

    def _view(self, distance: float, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where one stands and what one looks at."""
        centre = np.array((0.0, 0.0, 0.2 * self._size)) + moved
        return centre + distance * self._wide * EYE, centre
