"""Tracking: the pose that follows a known one when the drives have moved a little, for control loops.

The unknowns are the three hinge angles of the locked machine; two or three Newton steps on the distances of the balls do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import InputError
from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import actuator_names
from trivet.kinematics.locked import balls_first, by_leg, circle_of, hinge_place, placed, triangle
from trivet.model import Machine
from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

STEPS = 3


class Tracked(NamedTuple):
    """Where the platform is now; arrays over the batch."""

    angles: Scalar
    """(n, 3) hinge angles, with which to go on, rad."""
    frame: Frame
    """Platform frames {E} in {O}; components (n,), m."""
    residual: Scalar
    """(n,) greatest deviation of a distance between two balls, m; what is not small has lost its way."""


def hinge_angles(machine: Machine, pose: Frame, signs: Any) -> Any:
    """The hinge angles (3,) or (n, 3) with which to begin, at a pose or at n poses in a working mode (n_chains, 2), rad."""
    balls_first(machine)
    found = []
    for index, leg in enumerate(machine.legs):
        angle = inverse(leg, pose, signs[index]).coordinates[hinge_place(leg)]
        found.append(np.arctan2(np.asarray(angle.sin), np.asarray(angle.cos)))
    return np.stack(found, axis=-1)


class _Circle(NamedTuple):
    """A point at centre + cos(phi) cosine + sin(phi) sine, m."""

    centre: Vec
    cosine: Vec
    sine: Vec

    def at(self, angle: Angle) -> tuple[Vec, Vec]:
        """The point, and its derivative with respect to the angle."""
        along = self.cosine * angle.cos + self.sine * angle.sin
        return self.centre + along, self.sine * angle.cos - self.cosine * angle.sin


def track_one(machine: Machine, values: Scalar, angles: Scalar) -> tuple[Scalar, Frame, Scalar]:
    """One step of tracking: drive coordinates (n_actuators,), hinge angles (3,) before; angles, frame and residual after."""
    circles = [_Circle(*circle_of(leg, own)) for leg, own in zip(machine.legs, by_leg(machine, values), strict=True)]
    corners = triangle(machine, values)
    squares = [side @ side for side in _sides(corners)]

    # A loop, not the same lines written out: XLA would compute the circles again in every one of them.
    def newton(_: Scalar, angles: tuple[Scalar, ...]) -> tuple[Scalar, ...]:
        balls, velocities = zip(*_at(circles, angles), strict=True)
        sides = _sides(balls)
        off = [side @ side - square for side, square in zip(sides, squares, strict=True)]
        return tuple(a - step for a, step in zip(angles, _step(sides, velocities, off), strict=True))

    found = jax.lax.fori_loop(0, STEPS, newton, (angles[0], angles[1], angles[2]))
    balls = tuple(ball for ball, _ in _at(circles, found))
    lengths = [jnp.sqrt(square) for square in squares]
    off = [jnp.abs(jnp.sqrt(side @ side) - length) for side, length in zip(_sides(balls), lengths, strict=True)]
    return jnp.stack(found), placed(machine, corners, balls), jnp.max(jnp.stack(off))


def _at(circles: Sequence[_Circle], angles: Sequence[Scalar]) -> list[tuple[Vec, Vec]]:
    return [circle.at(Angle(jnp.cos(a), jnp.sin(a))) for circle, a in zip(circles, angles, strict=True)]


def _sides(points: Sequence[Vec]) -> list[Vec]:
    """From the first to the second, from the second to the third, from the third to the first."""
    return [points[(k + 1) % 3] - points[k] for k in range(3)]


def _step(sides: Sequence[Vec], velocities: Sequence[Vec], off: Sequence[Scalar]) -> tuple[Scalar, Scalar, Scalar]:
    """Solution of the three equations, each of which knows two of the angles: off_k = a_k step_k + b_k step_(k+1)."""
    a = [-2 * (side @ velocities[k]) for k, side in enumerate(sides)]
    b = [2 * (side @ velocities[(k + 1) % 3]) for k, side in enumerate(sides)]
    # Cramer's rule; the determinant is S of the singularity condition but for a factor.
    by = 1 / (a[0] * a[1] * a[2] + b[0] * b[1] * b[2])
    first = (off[0] * a[1] * a[2] - b[0] * off[1] * a[2] + b[0] * b[1] * off[2]) * by
    second = (off[1] * a[2] * a[0] - b[1] * off[2] * a[0] + b[1] * b[2] * off[0]) * by
    third = (off[2] * a[0] * a[1] - b[2] * off[0] * a[1] + b[2] * b[0] * off[1]) * by
    return first, second, third


_track = jax.jit(jax.vmap(track_one, in_axes=(None, 0, 0)))


def track(machine: Machine, values: Any, angles: Any) -> Tracked:
    """Follow n machines, or n moments, one step each.

    Args:
        machine: three chains that keep a hinge and a ball each when the drives are locked.
        values: (n, n_actuators) drive coordinates now, in the order of Q, m and rad.
        angles: (n, 3) hinge angles a moment ago (`hinge_angles`, or those of the last step), rad.

    Raises:
        InputError: when the machine is not of this kind, or the shapes do not fit.
    """
    balls_first(machine)
    values, angles = jnp.asarray(values), jnp.asarray(angles)
    drives = len(actuator_names(machine))
    if values.ndim != 2 or values.shape[1] != drives or angles.shape != (values.shape[0], 3):
        raise InputError(f"values {values.shape} and angles {angles.shape}: expected (n, {drives}) and (n, 3)")
    return Tracked(*_track(jax.tree.map(jnp.asarray, machine), values, angles))
