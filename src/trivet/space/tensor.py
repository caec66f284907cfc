"""Symmetric tensors of named components: moments of inertia, and what else turns like them."""

from __future__ import annotations

from typing import NamedTuple

from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, add, mul
from trivet.space.vector import Vec


class Tensor(NamedTuple):
    """A symmetric 3 x 3 tensor; components are scalars or arrays of one batch shape, in the unit that the owner says."""

    xx: Scalar
    yy: Scalar
    zz: Scalar
    xy: Scalar
    xz: Scalar
    yz: Scalar

    def __matmul__(self, v: Vec) -> Vec:
        """The tensor applied to a vector."""
        rows = (Vec(self.xx, self.xy, self.xz), Vec(self.xy, self.yy, self.yz), Vec(self.xz, self.yz, self.zz))
        return Vec(*(row @ v for row in rows))

    def plus(self, other: Tensor) -> Tensor:
        """The sum of two tensors."""
        return Tensor(*(add(a, b) for a, b in zip(self, other, strict=True)))

    def times(self, factor: Scalar) -> Tensor:
        """A multiple of the tensor."""
        return Tensor(*(mul(component, factor) for component in self))

    def out_of(self, frame: Frame) -> Tensor:
        """The tensor, given in the axes of a frame, in the axes in which the frame is written: sum of I_jk a_j a_k^T."""
        x, y, z = frame[1:]
        total = dyad(x, x).times(self.xx).plus(dyad(y, y).times(self.yy)).plus(dyad(z, z).times(self.zz))
        for a, b, component in ((x, y, self.xy), (x, z, self.xz), (y, z, self.yz)):
            total = total.plus(dyad(a, b).times(mul(2, component)))
        return total

    def into(self, frame: Frame) -> Tensor:
        """The tensor in the axes of a frame, which is written in the present axes."""
        turned = [self @ axis for axis in frame[1:]]
        x, y, z = frame[1:]
        return Tensor(x @ turned[0], y @ turned[1], z @ turned[2], x @ turned[1], x @ turned[2], y @ turned[2])

    def matrix(self) -> tuple[tuple[Scalar, ...], ...]:
        """All entries by rows."""
        return ((self.xx, self.xy, self.xz), (self.xy, self.yy, self.yz), (self.xz, self.yz, self.zz))


def dyad(a: Vec, b: Vec) -> Tensor:
    """The symmetric part of a b^T."""

    def mixed(i: int, j: int) -> Scalar:
        if a is b:
            return mul(a[i], a[j])
        return mul(add(mul(a[i], b[j]), mul(a[j], b[i])), 0.5)

    return Tensor(mul(a.x, b.x), mul(a.y, b.y), mul(a.z, b.z), mixed(0, 1), mixed(0, 2), mixed(1, 2))


def spread(a: Vec, b: Vec) -> Tensor:
    """(a . b) 1 minus the symmetric part of a b^T: what a mass adds to moments of inertia by standing off (Steiner)."""
    dot, across = a @ b, dyad(a, b).times(-1)
    return Tensor(dot, dot, dot, 0, 0, 0).plus(across)


def diagonal(x: Scalar, y: Scalar, z: Scalar) -> Tensor:
    """A tensor whose axes are those in which it is written."""
    return Tensor(x, y, z, 0, 0, 0)
