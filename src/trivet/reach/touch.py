"""Poses by where the platform touches a sphere: the coordinates of plans."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp

from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled
from trivet.space.vector import Vec


class Touch(NamedTuple):
    """Coordinates of poses, (n,) each: the platform touches a sphere about a centre, at an azimuth and tilt, with a roll."""

    x: Any
    y: Any
    z: Any
    """Centre of the sphere in {O}, m."""
    azimuth: Any
    tilt: Any
    roll: Any
    """rad."""

    def frame(self, radius: float) -> Frame:
        """Platform frames on spheres of a radius (m; 0 makes the centre the place of the platform); traced or of numbers."""
        (ca, sa), (cb, sb), (cr, sr) = ((jnp.cos(a), jnp.sin(a)) for a in self[3:])
        normal = Vec(ca * sb, sa * sb, cb)
        centre = Vec(self.x, self.y, self.z) + normal * radius
        return rolled(Frame(centre, Vec(ca * cb, sa * cb, -sb), Vec(-sa, ca, 0.0 * ca), normal), Angle(cr, sr))
