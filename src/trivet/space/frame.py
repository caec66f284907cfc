"""Frames and turns."""

from __future__ import annotations

from typing import NamedTuple

from trivet.space.scalar import Scalar, add, mul, sub
from trivet.space.vector import ZERO, Vec, X, Y, Z


class Angle(NamedTuple):
    """An angle as the pair that kernels need."""

    cos: Scalar
    sin: Scalar


class Turn(NamedTuple):
    """A rotation: three orthonormal axes, written in the axes that it turns."""

    x: Vec
    y: Vec
    z: Vec


class Frame(NamedTuple):
    """An origin (m) and three orthonormal axes, all written in the axes of an outer frame."""

    origin: Vec
    x: Vec
    y: Vec
    z: Vec

    def direction(self, local: tuple[Scalar, Scalar, Scalar]) -> Vec:
        """A direction given in this frame's axes, written in the outer axes."""
        return self.x * local[0] + self.y * local[1] + self.z * local[2]

    def shift(self, local: tuple[Scalar, Scalar, Scalar]) -> Frame:
        """The frame moved by a vector (m) given in its own axes."""
        return self._replace(origin=self.origin + self.direction(local))

    def turn(self, axis: tuple[float, float, float], angle: Angle) -> Frame:
        """The frame turned about a unit vector given in its own axes (Rodrigues)."""
        a = Vec(*axis)
        versine = sub(1, angle.cos)

        def turned(v: Vec) -> Vec:
            across = a.cross(v)
            if not any(across):  # not v @ a == 1, which rounding grants to axes that are nearly along v
                return v
            return v * angle.cos + across * angle.sin + a * mul(v @ a, versine)

        return Frame(self.origin, *(self.direction(turned(v)) for v in (X, Y, Z)))

    def turned_by(self, turn: Turn) -> Frame:
        """The frame turned by a rotation given in its own axes."""
        return Frame(self.origin, *(self.direction(v) for v in turn))

    def place(self, inner: Frame) -> Frame:
        """The frame `inner`, given in this frame's axes, written in the outer axes."""
        return self.shift(inner.origin).turned_by(Turn(inner.x, inner.y, inner.z))

    def matrix(self) -> tuple[tuple[Scalar, ...], ...]:
        """Rotation matrix by rows: columns are the axes."""
        return tuple(zip(self.x, self.y, self.z, strict=True))


IDENTITY = Frame(ZERO, X, Y, Z)


def about_z(angle: Angle, v: Vec) -> Vec:
    """A vector turned about the z axis."""
    return Vec(
        sub(mul(angle.cos, v.x), mul(angle.sin, v.y)),
        add(mul(angle.sin, v.x), mul(angle.cos, v.y)),
        v.z,
    )
