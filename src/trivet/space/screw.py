"""Twists and wrenches, reduced at one point."""

from __future__ import annotations

from typing import NamedTuple

from trivet.space.frame import Angle, about_z
from trivet.space.scalar import Scalar, add
from trivet.space.vector import ZERO, Vec


class Twist(NamedTuple):
    """A small motion: velocity of the reduction point (m/s) and angular velocity (rad/s)."""

    linear: Vec
    angular: Vec

    def plus(self, other: Twist, factor: Scalar = 1) -> Twist:
        """This twist plus a multiple of another."""
        return Twist(self.linear + other.linear * factor, self.angular + other.angular * factor)

    def times(self, factor: Scalar) -> Twist:
        """A multiple of this twist."""
        return Twist(self.linear * factor, self.angular * factor)

    def cross(self, other: Twist) -> Twist:
        """Rate at which a twist changes that is carried along by this one; both reduced at one point fixed in space."""
        return Twist(self.angular.cross(other.linear) + self.linear.cross(other.angular), self.angular.cross(other.angular))

    def cross_wrench(self, wrench: Wrench) -> Wrench:
        """Rate at which a wrench, or a momentum, changes that is carried along by this twist."""
        moment = self.angular.cross(wrench.moment) + self.linear.cross(wrench.force)
        return Wrench(self.angular.cross(wrench.force), moment)


class Wrench(NamedTuple):
    """A force (N) and the moment about the reduction point (N m)."""

    force: Vec
    moment: Vec

    def __matmul__(self, twist: Twist) -> Scalar:
        """Power of the wrench on a twist (W)."""
        return add(self.force @ twist.linear, self.moment @ twist.angular)

    def plus(self, other: Wrench, factor: Scalar = 1) -> Wrench:
        """This wrench plus a multiple of another."""
        return Wrench(self.force + other.force * factor, self.moment + other.moment * factor)

    def times(self, factor: Scalar) -> Wrench:
        """A multiple of this wrench."""
        return Wrench(self.force * factor, self.moment * factor)

    def carried(self, heading: Angle, arm: Vec) -> Wrench:
        """The wrench turned about z, then reduced at another point; arm (in the outer axes) leads from there to here."""
        force, moment = about_z(heading, self.force), about_z(heading, self.moment)
        return Wrench(force, moment + arm.cross(force))


def translation(direction: Vec) -> Twist:
    """Unit translation along a direction."""
    return Twist(direction, ZERO)


def rotation(axis: Vec, through: Vec, at: Vec) -> Twist:
    """Unit rotation about an axis through a point, reduced at the point `at`."""
    return Twist(ZERO if at is through else axis.cross(at - through), axis)
