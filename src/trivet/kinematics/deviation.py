"""How far the platform is off, to first order, when its chains are not as described and the drives stand at their coordinates.

A chain carries the platform along the wrenches that it transmits with its passive joints free, and these do no work on the
passive joints.  So if its end is displaced by a screw eps, because a length is not what it should be or a joint not where it
should be, the platform's twist V follows it along these wrenches alone, w V = w eps.  For all chains together

    J_x V = (w eps, row by row),   V = sum over chains of P eps,   P = J_x^-1 (columns of the chain) J_x (its rows).

The P are projectors that add up to one: chains that are all displaced alike carry the platform with them.  Everything inexact
is a screw with a deviation, as everything compliant is a screw with a compliance.  A dimension's screw is the slope of the walk
down the chain at fixed coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp

from trivet.kinematics.jacobian import arm_of, chain_rows, matrix, per_chain, require_six_each
from trivet.kinematics.walk import Coordinate, Posture, walk_from
from trivet.model import Leg, Machine, dimensions
from trivet.model.elements import Curvilinear, Drivable, Prismatic
from trivet.model.machine import Chain
from trivet.space.elimination import solved
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist, rotation, translation
from trivet.space.vector import Vec

PLACING = ("length", "locked", "radius", "vector")
"""Keys of elements that say where what is beyond them stands."""
ENDS = ("base", "platform_joint")
"""Tables of a chain of which every number does."""

Way = Literal["dimension", "along", "about", "drive", "growth"]


class Deviation(NamedTuple):
    """One way in which one chain can be other than described."""

    leg: int
    """Which chain, counted from 0."""
    way: Way
    """A dimension (m or rad more); along or about an axis of an element's own frame (m, rad); a drive's coordinate (m, rad);
    the growth of what extends with a slide, as a part of its coordinate."""
    of: str
    """Key path of the dimension in the chain, "elements.link.length"; else the name of the element."""
    axis: int = 0
    """0, 1, 2 for x, y, z."""


def deviations(machine: Machine) -> tuple[Deviation, ...]:
    """All ways in which the chains of a machine can deviate, in the order of `platform_errors`."""
    return tuple(Deviation(k, *own) for k, leg in enumerate(machine.legs) for own in _ways(leg.chain))


def _ways(chain: Chain) -> Iterator[tuple[Way, str, int]]:
    for path in dimensions(chain):
        if places(path):
            yield "dimension", path, 0
    for element in chain.elements:
        yield from (("along", element.name, axis) for axis in range(3))
        yield from (("about", element.name, axis) for axis in range(3))
        if isinstance(element, Drivable):
            yield "drive", element.name, 0
        if isinstance(element, Prismatic):
            yield "growth", element.name, 0


def places(path: str) -> bool:
    """Whether a number of a chain, by its key path there, has a part in where the platform is at given coordinates."""
    table, *rest = path.split(".")
    return table in ENDS or (table == "elements" and rest[1] in PLACING)


def platform_errors(machine: Machine, pose: Frame, signs: Scalar) -> Scalar:
    """What the platform does per unit of each deviation, the drives held: (d, 6), in the order of `deviations`.

    Args:
        machine: a machine with six drives that hold six freedoms.
        pose: platform frame in {O}, scalar components.
        signs: (n_chains, 2) working mode, or None as for `standing.postures`.

    Returns:
        Displacements of the platform centre and small rotations in {O}: m and rad per m or rad; per 1 for growths.  NaN at a
        Type 2 singularity.

    Raises:
        InputError: for any other machine.
    """
    require_six_each(machine)
    scale = machine.characteristic_length

    def work(leg: Leg, posture: Posture) -> tuple[Scalar, Scalar]:
        moved = [w.carried(posture.heading, arm_of(leg, pose)) for w in chain_rows(leg, posture, scale).wrenches]
        return matrix([[*w.force, *w.moment] for w in moved], 6), _screws(leg, posture, pose)

    rows, screws = zip(*per_chain(machine, pose, signs, work), strict=True)
    undone, first = solved(jnp.concatenate(rows), jnp.eye(6)), 0
    found = []
    for own, deviating in zip(rows, screws, strict=True):
        follows = undone[:, first : first + len(own)] @ own
        found.append(deviating @ follows.T)
        first += len(own)
    return jnp.concatenate(found)


def _screws(leg: Leg, posture: Posture, pose: Frame) -> Scalar:
    """(d, 6): displacement of the chain's end per unit of each of `_ways`, reduced at the platform centre, in {O}."""
    centre, found = pose.origin, list[Twist]()
    for element, frame, coordinate in walk_from(leg.base_frame(), leg.chain.elements, posture.coordinates):
        # Of a carriage the frame on its circle, as for its bearing.
        own = element.advance(frame, coordinate) if isinstance(element, Curvilinear) else frame
        found += [translation(axis) for axis in own[1:]]
        found += [rotation(axis, own.origin, centre) for axis in own[1:]]
        if isinstance(element, Drivable):
            found.append(element.motion(frame, centre))
        if isinstance(element, Prismatic):
            found.append(translation(frame.direction(element.axis) * coordinate))
    joints = matrix([[*twist.linear, *twist.angular] for twist in found], 6)
    return jnp.concatenate([_dimension_screws(leg, posture.coordinates, pose), joints])


def _dimension_screws(leg: Leg, coordinates: tuple[Coordinate, ...], pose: Frame) -> Scalar:
    """(d, 6): the same per unit of each dimension: the end of the chain goes with it, and its seat on the platform against."""
    numbers, structure = jax.tree.flatten(leg.chain)
    chosen = [k for k, path in enumerate(dimensions(leg.chain)) if places(path)]

    def ends(values: Scalar) -> Scalar:
        own = list(numbers)
        for k, value in zip(chosen, values, strict=True):
            own[k] = value
        there = Leg.standing(jax.tree.unflatten(structure, own), leg.rotation)
        return jnp.stack([_numbers(_end(there, coordinates)), _numbers(pose.place(there.platform_frame()))])

    values = jnp.stack([jnp.asarray(numbers[k], dtype=float) for k in chosen])
    at, slope = ends(values), jnp.moveaxis(jax.jacfwd(ends)(values), -1, 0)
    turned = jnp.cross(at[:, 1:], slope[:, :, 1:]).sum(axis=2) / 2
    moved = slope[:, :, 0] + jnp.cross(turned, jnp.stack(_plain(pose.origin)) - at[:, 0])
    both = jnp.concatenate([moved, turned], axis=-1)
    return both[:, 0] - both[:, 1]


def _end(leg: Leg, coordinates: tuple[Coordinate, ...]) -> Frame:
    """The frame at the end of the chain in {O}; in front of a last joint whose coordinate nobody asked for."""
    elements = leg.chain.elements
    held = tuple(
        e.coordinate(e.locked) if isinstance(e, Drivable) and e.locked is not None else c
        for e, c in zip(elements, coordinates, strict=True)
    )
    last, frame, coordinate = walk_from(leg.base_frame(), elements, held)[-1]
    return frame if coordinate is None else last.advance(frame, coordinate)


def _numbers(frame: Frame) -> Scalar:
    """(4, 3): origin and axes."""
    return jnp.stack([jnp.stack(_plain(v)) for v in frame])


def _plain(v: Vec) -> list[Scalar]:
    return [jnp.asarray(c, dtype=float) for c in v]
