"""What is drawn beside a machine: how softly it stands, and the motion that its drives control least."""

from __future__ import annotations

import numpy as np
import viser

from trivet.errors import NoResultError
from trivet.kinematics.singularity import Motion
from trivet.show import shapes
from trivet.show.mode_shapes import joined
from trivet.show.palette import COLOURS, GREEN
from trivet.show.scene import arrow
from trivet.space.frame import Frame
from trivet.study.pose import PoseReport
from trivet.viewer.stage import quaternion, rgb

LARGEST = 0.3
"""Longest half axis of an ellipsoid, and length of an arrow, as a share of the machine's size."""
FLATTEST = 0.02
"""Of an ellipsoid against its longest half axis, so that it can be seen."""
OPACITY = 0.45


class Marks:
    """Beside one machine."""

    def __init__(self, server: viser.ViserServer, root: str) -> None:
        self._server, self._root = server, root
        vertices, faces = shapes.ball("ellipsoid", "motion", np.zeros(3), 1.0).mesh()
        self._ellipsoid = server.scene.add_mesh_simple(
            f"{root}/ellipsoid", vertices, faces, color=rgb(GREEN), opacity=OPACITY, cast_shadow=False, receive_shadow=False,
            visible=False,
        )  # fmt: skip
        self._arrow: viser.MeshHandle | None = None

    def soften(self, report: PoseReport | None, size: float) -> str:
        """Draw how far the platform centre goes under forces of unit size; gives its half axes in words, empty for none."""
        try:
            compliance = None if report is None else report.compliance[:3, :3]
        except NoResultError as error:
            self._ellipsoid.visible = False
            return str(error)
        self._ellipsoid.visible = compliance is not None
        if report is None or compliance is None:
            return ""
        axes, lengths, _ = np.linalg.svd(compliance)  # displacements that unit forces reach
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        self._ellipsoid.scale = tuple((LARGEST * size * np.maximum(lengths / lengths[0], FLATTEST)).tolist())
        self._ellipsoid.wxyz = quaternion(axes)
        self._ellipsoid.position = np.array(report.frame.origin, dtype=float)
        return "ellipsoid, µm/N: " + " × ".join(f"{1e6 * length:.3g}" for length in lengths)

    def point(self, motion: Motion | None, pose: Frame, size: float) -> None:
        """Draw the motion that the drives control least: an arrow with one head for a translation, two for a turn."""
        if motion is None:
            if self._arrow is not None:
                self._arrow.visible = False
            return
        vertices, faces = joined(list(arrow(motion, pose, LARGEST * size)))
        if self._arrow is not None:
            self._arrow.remove()
        self._arrow = self._server.scene.add_mesh_simple(
            f"{self._root}/twist", vertices, faces, color=rgb(COLOURS["motion"]), flat_shading=True, cast_shadow=False,
            receive_shadow=False, side="front",
        )  # fmt: skip
