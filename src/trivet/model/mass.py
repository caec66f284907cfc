"""What bodies weigh: mass, first moment and moments of inertia, which add and move by polynomials alone."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from trivet.space.frame import IDENTITY, Frame
from trivet.space.scalar import Scalar, add, is_zero, mul
from trivet.space.screw import Twist, Wrench
from trivet.space.tensor import Tensor, diagonal, spread
from trivet.space.vector import ZERO, Vec

if TYPE_CHECKING:
    from trivet.model.elements.base import Direction, Profile, Stock
    from trivet.model.machine import Platform


STANDARD_GRAVITY = 9.80665
"""Acceleration of free fall, m/s^2."""


class RigidMass(NamedTuple):
    """A rigid body about some point: mass (kg), mass times centre (kg m), moments of inertia about the point (kg m^2)."""

    mass: Scalar
    moment: Vec
    inertia: Tensor

    @classmethod
    def centred(cls, mass: Scalar, centre: Vec, inertia: Tensor) -> RigidMass:
        """A body from its centre of mass (m) and its moments of inertia about that."""
        return cls(mass, ZERO, inertia).shifted(centre)

    @classmethod
    def none(cls) -> RigidMass:
        """No body."""
        return cls(0, ZERO, diagonal(0, 0, 0))

    @property
    def is_none(self) -> bool:
        """Whether there is no body, and that is known while tracing."""
        return is_zero(self.mass)

    @property
    def centre(self) -> Vec:
        """Centre of mass (m); NaN or a division by zero where there is no mass."""
        return self.moment / self.mass

    @property
    def about_centre(self) -> Tensor:
        """Moments of inertia about the centre of mass."""
        return self.inertia.plus(spread(self.moment, self.centre).times(-1))

    def plus(self, other: RigidMass) -> RigidMass:
        """Both bodies as one."""
        return RigidMass(add(self.mass, other.mass), self.moment + other.moment, self.inertia.plus(other.inertia))

    def times(self, factor: Scalar) -> RigidMass:
        """The same shape, heavier by a factor."""
        return RigidMass(mul(self.mass, factor), self.moment * factor, self.inertia.times(factor))

    def shifted(self, by: Vec) -> RigidMass:
        """The body moved by a vector (m)."""
        moved = self.inertia.plus(spread(self.moment, by).times(2)).plus(spread(by, by).times(self.mass))
        return RigidMass(self.mass, self.moment + by * self.mass, moved)

    def out_of(self, frame: Frame) -> RigidMass:
        """The body, given in a frame, in the axes and about the origin in which the frame is written."""
        return RigidMass(self.mass, frame.direction(self.moment), self.inertia.out_of(frame)).shifted(frame.origin)

    def into(self, frame: Frame) -> RigidMass:
        """The body seen from a frame, which is written in the present axes."""
        moved = self.shifted(-frame.origin)
        return RigidMass(self.mass, Vec(*(axis @ moved.moment for axis in frame[1:])), moved.inertia.into(frame))

    def momentum(self, twist: Twist) -> Wrench:
        """Momentum (N s) and moment of momentum about the point (N m s), of a twist reduced there."""
        v, omega = twist
        return Wrench(v * self.mass + omega.cross(self.moment), self.inertia @ omega + self.moment.cross(v))


def together(parts: Iterable[RigidMass]) -> RigidMass:
    """Bodies as one."""
    total = RigidMass.none()
    for part in parts:
        total = total.plus(part)
    return total


def point_mass(mass: Scalar, at: Vec) -> RigidMass:
    """A mass without size."""
    return RigidMass.centred(mass, at, diagonal(0, 0, 0))


class Rod(NamedTuple):
    """A straight uniform body along an axis of the frame beyond its element, from `low` to `high` (m) along it."""

    axis: Direction
    low: Scalar
    high: Scalar
    profile: Profile

    @property
    def length(self) -> Scalar:
        """Length, m."""
        return self.high - self.low

    def line_density(self, stock: Stock) -> Scalar:
        """Mass per length, kg/m."""
        material = stock.materials[self.profile.material]
        return material.density * stock.sections[self.profile.section].properties(material.poisson_ratio).area

    def weigh(self, stock: Stock) -> RigidMass:
        """What it weighs, in the frame beyond its element; with what its cross-section adds to the inertia of a thin rod."""
        from trivet.model.elements.beam import beam_axes

        material = stock.materials[self.profile.material]
        section = stock.sections[self.profile.section].properties(material.poisson_ratio)
        per_area = material.density * self.length
        mass = per_area * section.area
        y, z, thin = per_area * section.inertia_y, per_area * section.inertia_z, mass * self.length * self.length / 12
        own = Frame(Vec(*self.axis) * ((self.low + self.high) / 2), *beam_axes(IDENTITY, self.axis))
        return RigidMass(mass, ZERO, diagonal(y + z, thin + y, thin + z)).out_of(own)


def platform_mass(platform: Platform, stock: Stock) -> RigidMass:
    """The platform in {E}: nothing when it gives no mass, a point when it gives no inertia."""
    centre = Vec(*(platform.centre_of_mass or (0, 0, 0)))
    if platform.disc is not None:
        radius, thickness = platform.disc.radius, platform.disc.thickness
        mass = math.pi * radius * radius * thickness * stock.materials[platform.disc.material].density
        across = mass * (3 * radius * radius + thickness * thickness) / 12
        return RigidMass.centred(mass, centre, diagonal(across, across, mass * radius * radius / 2))
    if platform.mass is None:
        return RigidMass.none()
    moments = Tensor(*(platform.inertia or (0, 0, 0)), *(platform.products_of_inertia or (0, 0, 0)))
    return RigidMass.centred(platform.mass, centre, moments)
