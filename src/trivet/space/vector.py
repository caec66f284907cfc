"""Vectors of three named components."""

from __future__ import annotations

from typing import NamedTuple

from trivet.space.scalar import Scalar, add, mul, sub


class Vec(NamedTuple):
    """A vector; components are scalars or arrays of one batch shape, in m, N, rad or whatever the owner says."""

    x: Scalar
    y: Scalar
    z: Scalar

    def __add__(self, other: Vec) -> Vec:  # type: ignore[override]
        return Vec(add(self.x, other.x), add(self.y, other.y), add(self.z, other.z))

    def __sub__(self, other: Vec) -> Vec:
        return Vec(sub(self.x, other.x), sub(self.y, other.y), sub(self.z, other.z))

    def __neg__(self) -> Vec:
        return Vec(-self.x, -self.y, -self.z)

    def __mul__(self, factor: Scalar) -> Vec:
        return Vec(mul(self.x, factor), mul(self.y, factor), mul(self.z, factor))

    def __truediv__(self, divisor: Scalar) -> Vec:
        return self * (1 / divisor)

    def __matmul__(self, other: Vec) -> Scalar:
        """Dot product."""
        return add(add(mul(self.x, other.x), mul(self.y, other.y)), mul(self.z, other.z))

    def cross(self, other: Vec) -> Vec:
        """Vector product."""
        return Vec(
            sub(mul(self.y, other.z), mul(self.z, other.y)),
            sub(mul(self.z, other.x), mul(self.x, other.z)),
            sub(mul(self.x, other.y), mul(self.y, other.x)),
        )


ZERO, X, Y, Z = Vec(0, 0, 0), Vec(1, 0, 0), Vec(0, 1, 0), Vec(0, 0, 1)
