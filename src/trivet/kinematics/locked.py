"""A machine of three chains with its drives locked: on which circle each of its balls moves (paper Eqs 5-6).

What is left to a chain then is a hinge and a ball.  Where the hinge comes first the ball moves on a circle fixed in {O}, and
the balls keep the distances of the platform joints.  Where the ball comes first (Tahmasebi) it stands still in {O} and moves on
a circle fixed in {E}: the same problem seen from the platform.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import InputError
from trivet.kinematics.circles import Circles
from trivet.kinematics.jacobian import actuator_names
from trivet.kinematics.walk import walk_from
from trivet.model import Leg, Machine
from trivet.model.elements import Drivable, Element, Revolute, Spherical
from trivet.space.frame import IDENTITY, Angle, Frame, Turn
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec


def balls_first(machine: Machine) -> bool:
    """Whether the circles are fixed in {E} rather than in {O}.

    Raises:
        InputError: when the locked machine does not hold three balls on circles of one kind.
    """
    orders = {_order(leg) for leg in machine.legs}
    if len(machine.legs) != 3 or len(orders) != 1 or None in orders:
        raise InputError(
            f"{machine.name}: all assembly modes are found for three chains which keep a hinge and a ball when the drives are "
            "locked; this machine is solved from a starting pose"
        )
    return orders == {"ball first"}


def holds_circles(machine: Machine) -> bool:
    """Whether the locked machine holds three balls on circles of one kind."""
    try:
        balls_first(machine)
    except InputError:
        return False
    return True


def _order(leg: Leg) -> str | None:
    joints = [e for e in leg.chain.elements if e.unknowns and not (isinstance(e, Drivable) and e.is_driven)]
    kinds = [type(e) for e in joints]
    if kinds == [Revolute, Spherical]:
        # A drive beyond the ball would carry the platform joint away from it.
        return "hinge first" if leg.chain.elements[-1] is joints[-1] else None
    beyond = leg.chain.elements[leg.chain.elements.index(joints[0]) + 1 :] if joints else ()
    still = not any(isinstance(e, Drivable) and e.is_driven for e in beyond)
    return "ball first" if kinds == [Spherical, Revolute] and still else None


def ball_point(leg: Leg, values: dict[str, Scalar], angle: Angle) -> Vec:
    """Where the ball of a chain is on its circle in {O} (paper Eq 6), or in {E} where balls come first, m.

    Args:
        leg: the chain.
        values: coordinates of its drives by element, m or rad.
        angle: of its passive hinge.
    """
    elements = leg.chain.elements
    coordinates = [_coordinate(e, values, angle) for e in elements]
    if _order(leg) == "hinge first":
        return walk_from(leg.base_frame(), elements, tuple(coordinates))[-1][1].origin
    # Seen from the ball the walk leads to the platform joint; turned round, from there to the ball.
    ball = next(k for k, e in enumerate(elements) if isinstance(e, Spherical))
    last, frame, coordinate = walk_from(IDENTITY, elements[ball + 1 :], tuple(coordinates[ball + 1 :]))[-1]
    end, joint = last.advance(frame, coordinate), leg.platform_frame()
    back = -end.origin
    return joint.origin + joint.direction((back @ end.x, back @ end.y, back @ end.z))


def circle_of(leg: Leg, values: dict[str, Scalar]) -> tuple[Vec, Vec, Vec]:
    """Centre (Eq 5b), and vectors to the points at 0 and at 90 degrees, of the circle on which the ball of a chain moves, m."""
    at, opposite, aside = (ball_point(leg, values, Angle(c, s)) for c, s in ((1, 0), (-1, 0), (0, 1)))
    centre = (at + opposite) * 0.5
    return centre, (at - opposite) * 0.5, aside - centre


def foot_point(leg: Leg, values: dict[str, Scalar]) -> Vec:
    """Where the ball of a chain stands still in {O}, m, when it comes before the hinge."""
    elements = leg.chain.elements
    ball = next(k for k, e in enumerate(elements) if isinstance(e, Spherical))
    coordinates = tuple(_coordinate(e, values, Angle(1, 0)) for e in elements[: ball + 1])
    return walk_from(leg.base_frame(), elements[: ball + 1], coordinates)[-1][1].origin


def _is_passive_hinge(element: Element) -> bool:
    return isinstance(element, Revolute) and element.locked is None and not element.actuated


def _coordinate(element: Element, values: dict[str, Scalar], angle: Angle) -> Any:
    if isinstance(element, Drivable):
        value = element.locked if element.locked is not None else values.get(element.name)
        if value is None:
            return angle
        return element.coordinate(value)
    return Turn(*IDENTITY[1:]) if isinstance(element, Spherical) else None


def by_leg(machine: Machine, values: Any) -> list[dict[str, Scalar]]:
    """Actuator values (n_actuators, ...) in the order of Q, per chain by element."""
    found: list[dict[str, Scalar]] = [{} for _ in machine.legs]
    places = {leg.name: k for k, leg in enumerate(machine.legs)}
    for k, name in enumerate(actuator_names(machine)):
        leg, element = name.rsplit(".", 1)
        found[places[leg]][element] = values[k]
    return found


def triangle(machine: Machine, values: Any) -> tuple[Vec, Vec, Vec]:
    """Three points whose distances the balls keep (Eq 7), m: platform joints in {E}, or feet in {O} where balls come first."""
    if not balls_first(machine):
        first, second, third = (leg.platform_frame().origin for leg in machine.legs)
    else:
        own = by_leg(machine, values)
        first, second, third = (foot_point(leg, v) for leg, v in zip(machine.legs, own, strict=True))
    return first, second, third


def placed(machine: Machine, fixed: Sequence[Vec], balls: Sequence[Vec]) -> Frame:
    """The platform frame {E} in {O} from the triangle and the balls on their circles (paper Eqs 10-13)."""
    own, other = (balls, fixed) if balls_first(machine) else (fixed, balls)
    here, there = _triad(own), _triad(other)
    # R takes the triad seen from {E} to the triad seen from {O}.
    axes = [there.x * _part(here.x, k) + there.y * _part(here.y, k) + there.z * _part(here.z, k) for k in range(3)]
    turned = axes[0] * here.origin.x + axes[1] * here.origin.y + axes[2] * here.origin.z
    return Frame(there.origin - turned, *axes)


def _part(v: Vec, index: int) -> Scalar:
    return v[index]


def _triad(points: Sequence[Vec]) -> Frame:
    """A frame in the middle of three points, z across their plane, x along the first side."""
    first, second, third = points
    along = second - first
    across = along.cross(third - first)
    x, z = along / jnp.sqrt(along @ along), across / jnp.sqrt(across @ across)
    return Frame((first + second + third) * (1 / 3), x, z.cross(x), z)


def _circle(machine: Machine, values: Any) -> tuple[Any, ...]:
    """Centre, cosine and sine vectors (3, 3) and distances (3,) for one set of actuator values."""
    circles = [circle_of(leg, own) for leg, own in zip(machine.legs, by_leg(machine, values), strict=True)]
    centres, cosines, sines = ([circle[k] for circle in circles] for k in range(3))
    corners = triangle(machine, values)
    sides = [corners[j] - corners[i] for i, j in ((0, 1), (1, 2), (2, 0))]
    return _rows(centres), _rows(cosines), _rows(sines), jnp.stack([jnp.asarray(jnp.sqrt(side @ side)) for side in sides])


def _rows(vectors: list[Vec]) -> Any:
    return jnp.stack([jnp.stack([jnp.asarray(c, dtype=float) for c in v]) for v in vectors])


_circles = jax.jit(jax.vmap(_circle, in_axes=(None, 0)))


def circles_of(machine: Machine, values: Any) -> Circles:
    """The circles on which the balls move.

    Args:
        machine: the machine.
        values: (n, n_actuators) actuator coordinates in the order of Q, m and rad.

    Raises:
        InputError: as `balls_first`.
    """
    balls_first(machine)
    return Circles(*(np.asarray(a) for a in _circles(jax.tree.map(jnp.asarray, machine), np.asarray(values, dtype=float))))


def _frame_of(machine: Machine, values: Any, angles: Any) -> Frame:
    own = by_leg(machine, values)
    turns = [Angle(jnp.cos(a), jnp.sin(a)) for a in angles]
    balls = tuple(ball_point(leg, v, turn) for leg, v, turn in zip(machine.legs, own, turns, strict=True))
    return placed(machine, triangle(machine, values), balls)


_frames = jax.jit(jax.vmap(jax.vmap(_frame_of, in_axes=(None, None, 0)), in_axes=(None, 0, 0)))


def frames_at(machine: Machine, values: Any, angles: Any) -> Frame:
    """Platform frames from actuator values (n, n_actuators) and hinge angles (n, m, 3); components (n, m)."""
    found = _frames(jax.tree.map(jnp.asarray, machine), np.asarray(values, dtype=float), np.asarray(angles, dtype=float))
    return jax.tree.map(np.asarray, found)


def hinge_place(leg: Leg) -> int:
    """Place of the passive hinge among the elements of a chain."""
    return next(k for k, e in enumerate(leg.chain.elements) if _is_passive_hinge(e))


MIRROR = 1e-9
"""Sine, and distance relative to the machine, within which axes count as lying in one plane."""


def mirror_plane(circles: Circles) -> tuple[Any, Any] | None:
    """Normal (3,) and a point (3,) of the plane in which all three axes of one problem lie; None when there is none.

    Solutions then come in pairs which are mirror images in that plane.
    """
    axes = np.cross(circles.cosine[0], circles.sine[0])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    centres = circles.centre[0]
    spans = np.concatenate([axes, (centres[1:] - centres[0]) / max(float(np.ptp(centres, axis=0).max()), 1e-300)])
    _, values, rows = np.linalg.svd(spans)
    return (rows[2], centres[0]) if values[2] < MIRROR * max(float(values[0]), math.sqrt(3)) else None
