"""The structure of a machine at a pose: nodes, beam elements, joints and lumped masses, all in {O} axes.

Every chain is walked in the world.  A joint adds a node that is tied to the one before but for the joint's screws; a beam adds
its far node; a rigid body adds a node tied in all six directions.  The last joint ties its chain to the platform's node.
Nothing here knows a machine: the structure follows from the elements of the chains alone.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np

from trivet.errors import InputError
from trivet.kinematics.jacobian import is_driven
from trivet.kinematics.standing import stand
from trivet.kinematics.walk import Coordinate, walk_from
from trivet.model import Leg, Machine
from trivet.model.elements import Beam, Joint, Offset, Prismatic, Profile, Stock
from trivet.model.elements.base import Direction
from trivet.model.elements.beam import beam_axes
from trivet.space.frame import Frame
from trivet.space.screw import Twist
from trivet.space.vector import Vec
from trivet.statics.beam_element import BeamElement, local_stiffness

GROUND, PLATFORM = 0, 1
"""Numbers of the node fixed to the ground, at the origin of {O}, and of the platform's, at the platform centre."""


@dataclass(frozen=True)
class Connection:
    """A tie between two bodies: u_second - u_first - sum s_k eta_k = 0, both carried to one point (the rows of A_K, Eq 37)."""

    name: str
    """Chain and element to which it belongs: "leg-1.guide"."""
    first: int
    """Number of the node nearer to the ground."""
    second: int
    """Number of the node nearer to the platform."""
    at: np.ndarray
    """(..., 3): the point at which the twists are compared, in {O}, m."""
    screws: np.ndarray
    """(..., 6, k): columns s_k, along which it yields, reduced at that point; none when it is rigid."""
    rates: np.ndarray
    """(k,): spring rate along every screw (N/m or N m/rad), zero where it is slack."""
    drive: np.ndarray | None = None
    """(..., 6): screw along which its actuator works, when it has one."""


@dataclass(frozen=True)
class Lump:
    """A point mass that moves with a node."""

    name: str
    node: int
    at: np.ndarray
    """(..., 3): where it is, in {O}, m."""
    mass: float
    """kg."""


@dataclass(frozen=True)
class Structure:
    """A machine at a pose (or at a batch of poses of one shape) as nodes and what lies between them."""

    nodes: np.ndarray
    """(..., n, 3): positions in {O}, m.  Every node has six dofs: displacement (m) and rotation (rad), in {O}."""
    beams: tuple[BeamElement, ...]
    """In the order of the walks: the first node of a beam is never the second of a later one."""
    connections: tuple[Connection, ...]
    lumps: tuple[Lump, ...]
    scale: float
    """Length (m) by which displacements and rotations are made comparable."""


@dataclass
class _Builder:
    """Collects the parts of a structure while its chains are walked."""

    shape: tuple[int, ...]
    stock: Stock
    nodes: list[np.ndarray] = field(default_factory=list)
    beams: list[BeamElement] = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    lumps: list[Lump] = field(default_factory=list)

    def node(self, at: Vec) -> int:
        self.nodes.append(self.array(at))
        return len(self.nodes) - 1

    def array(self, components: Sequence[Any]) -> np.ndarray:
        """Components of a vector or a twist as the last axis of an array of the batch shape."""
        return np.stack([np.broadcast_to(np.asarray(c, dtype=float), self.shape) for c in components], axis=-1)

    def screw(self, twist: Twist) -> np.ndarray:
        return self.array((*twist.linear, *twist.angular))

    def tie(self, name: str, first: int, second: int, at: np.ndarray) -> None:
        """A rigid connection."""
        self.connections.append(Connection(name, first, second, at, np.zeros((*self.shape, 6, 0)), np.zeros(0)))

    def lump(self, name: str, node: int, at: np.ndarray, mass: Any) -> None:
        if mass is not None:
            self.lumps.append(Lump(name, node, at, float(mass)))


def assemble(machine: Machine, pose: Frame, signs: Any) -> Structure:
    """The structure of a machine at a pose.

    Args:
        machine: the machine, its actuators at rest.
        pose: platform frame {E} in {O}, m; components are numbers, or arrays of one batch shape.
        signs: (n_chains, 2) working mode, see `kinematics.mode.parse_mode`, or (n_chains, 2, ...) one per pose; None for a
            machine without working modes, at one pose.

    Raises:
        NoResultError: a chain does not reach the pose (travel limits are not looked at).
        InputError: a batch in which a beam has zero length at some poses and not at others.
    """
    return assemble_standing(machine, pose, [one.posture.coordinates for one in stand(machine, pose, signs)])


def assemble_standing(machine: Machine, pose: Frame, coordinates: Sequence[tuple[Coordinate, ...]]) -> Structure:
    """The structure of a machine whose joint coordinates are known.

    Args:
        machine, pose: as for `assemble`.
        coordinates: per chain, one per element, as `Element.advance` takes them from `Leg.base_frame` on.
    """
    build = _Builder(np.broadcast_shapes(*(np.shape(c) for v in pose for c in v)), machine.stock)
    build.node(Vec(0.0, 0.0, 0.0))
    build.node(pose.origin)
    for leg, own in zip(machine.legs, coordinates, strict=True):
        _add_leg(build, leg, jax.tree.map(lambda c: np.asarray(c, dtype=float), own))
    _add_platform_mass(build, machine, pose)
    nodes = np.stack(build.nodes, axis=-2)
    scale = float(machine.characteristic_length) or float(np.abs(nodes).max())
    return Structure(nodes, tuple(build.beams), tuple(build.connections), tuple(build.lumps), scale)


def _add_leg(build: _Builder, leg: Leg, coordinates: tuple[Coordinate, ...]) -> None:
    steps = walk_from(leg.base_frame(), leg.chain.elements, coordinates)
    last, frame, coordinate = steps[-1]
    # Where the last joint leads is not asked when nobody knows: a ball does not move its own point.
    ends = [start for _, start, _ in steps[1:]] + [frame if coordinate is None else last.advance(frame, coordinate)]
    node = GROUND
    for (element, start, coordinate), end in zip(steps, ends, strict=True):
        name = f"{leg.name}.{element.name}"
        if isinstance(element, Offset):
            node = _add_offset(build, name, node, element, (start.origin, end.origin))
        elif isinstance(element, Beam):
            node = _add_beam(build, name, node, start, (element.axis, element.length), element.profile)
        else:
            assert isinstance(element, Joint)
            body = element.beam if isinstance(element, Prismatic) else None
            here = end.origin if body is None else start.origin
            beyond = PLATFORM if element is last and body is None else build.node(here)
            build.connections.append(_joint(build, name, element, start, coordinate, (node, beyond), here))
            node = beyond
            if body is not None:
                assert isinstance(element, Prismatic)
                node = _add_beam(build, name, node, start, (element.axis, coordinate), body)
            build.lump(name, node, build.array(end.origin), element.mass)
    if node != PLATFORM:
        build.tie(f"{leg.name}.{last.name}", node, PLATFORM, build.array(ends[-1].origin))


def _add_offset(build: _Builder, name: str, first: int, offset: Offset, ends: tuple[Vec, Vec]) -> int:
    """Add a rigid body and its far node; half of its mass at either end."""
    second = build.node(ends[1])
    build.tie(name, first, second, build.array(ends[1]))
    if offset.mass is not None:
        for node, end in zip((first, second), ends, strict=True):
            build.lump(name, node, build.array(end), offset.mass / 2)
    return second


def _joint(
    build: _Builder, name: str, joint: Joint, frame: Frame, coordinate: Coordinate, nodes: tuple[int, int], at: Vec
) -> Connection:
    """The connection which a joint makes: slack along its slack freedoms, sprung where it has a stiffness, else rigid."""
    # A beam on a slide is an element of its own here; only the drive yields in the joint.
    bare = dataclasses.replace(joint, beam=None) if isinstance(joint, Prismatic) else joint
    slack = bare.slack(frame, coordinate, at)
    sprung = bare.flexibilities(frame, coordinate, at, build.stock)
    yielding = [build.screw(twist) for twist in (*slack, *(f.twist for f in sprung))]
    drive = None
    if is_driven(joint):
        twist = sprung[0].twist if sprung else joint.freedoms(frame, coordinate, at)[0]
        drive = build.screw(twist)
    screws = np.stack(yielding, axis=-1) if yielding else np.zeros((*build.shape, 6, 0))
    rates = np.array([0.0] * len(slack) + [1 / float(f.compliance) for f in sprung])
    return Connection(name, *nodes, build.array(at), screws, rates, drive)


def _add_beam(build: _Builder, name: str, first: int, frame: Frame, reach: tuple[Direction, Any], profile: Profile) -> int:
    """Add a beam that starts in a frame, and its far node.

    It reaches along an axis of the frame for a length (m); a negative length runs the other way, a zero one is rigid.
    """
    axis, length = reach
    far = frame.origin + frame.direction(axis) * length
    second = build.node(far)
    span = np.broadcast_to(np.abs(np.asarray(length, dtype=float)), build.shape)
    if np.all(span == 0):
        build.tie(name, first, second, build.array(far))
        return second
    if np.any(span == 0):
        raise InputError(f"{name}: zero length at some poses of the batch and not at others; assemble them apart")
    x, y, _ = (build.array(v) for v in beam_axes(frame, axis))
    x = x * np.sign(length)[..., None]
    axes = np.stack([x, y, np.cross(x, y)], axis=-1)
    stiffness = local_stiffness(span, profile, build.stock)
    material = build.stock.materials[profile.material]
    area = build.stock.sections[profile.section].properties(material.poisson_ratio).area
    build.beams.append(BeamElement(name, first, second, axes, span, stiffness, float(material.density * area)))
    return second


def _add_platform_mass(build: _Builder, machine: Machine, pose: Frame) -> None:
    platform = machine.platform
    mass = platform.mass
    if platform.disc is not None:
        disc = platform.disc
        mass = np.pi * disc.radius**2 * disc.thickness * machine.materials[disc.material].density
    centre = pose.shift(platform.centre_of_mass or (0, 0, 0)).origin
    build.lump("platform", PLATFORM, build.array(centre), mass)
