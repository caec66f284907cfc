"""The structure of a machine at a pose: nodes, beam elements, joints and lumped masses, all in {O} axes.

Every chain is walked in the world.  A joint adds a node that is tied to the one before but for the joint's screws; a beam adds
its far node; a rigid body adds a node tied in all six directions.  The last joint ties its chain to the platform's node.
Nothing here knows a machine: the structure follows from the elements of the chains alone.
"""

from __future__ import annotations

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
from trivet.model.elements import Prismatic, Stock
from trivet.model.elements.beam import beam_axes
from trivet.model.mass import RigidMass, platform_mass
from trivet.space.frame import Frame
from trivet.space.screw import Twist
from trivet.space.tensor import diagonal
from trivet.space.vector import ZERO, Vec
from trivet.statics.beam_element import BeamElement, uniform
from trivet.statics.parts import Arm, Bar, Tie, parts

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
    loss_factor: float | None
    """Structural damping of its springs, k (1 + i eta); that of the analysis when None."""
    viscosity: np.ndarray
    """(k,): viscous damping along every screw, N s/m or N m s/rad."""
    drive: np.ndarray | None = None
    """(..., 6): screw along which its actuator works, when it has one."""


@dataclass(frozen=True)
class NodeMass:
    """A rigid mass that moves with a node."""

    name: str
    """Chain and element to which it belongs, or "platform"."""
    node: int
    at: np.ndarray
    """(..., 3): its centre, in {O}, m."""
    mass: float
    """kg."""
    inertia: np.ndarray
    """(..., 3, 3): about its centre, in {O}, kg m^2."""


@dataclass(frozen=True)
class Sheathed:
    """What of a rod its guide hides: it weighs and does not bend, and its inertia is left out of vibrations."""

    name: str
    """Chain and slide to which it belongs."""
    node: int
    """The root of the rod's extended part."""
    at: np.ndarray
    """(..., 3): its centre, in {O}, m."""
    mass: np.ndarray
    """(...), kg."""


@dataclass(frozen=True)
class Structure:
    """A machine at a pose (or at a batch of poses of one shape) as nodes and what lies between them."""

    nodes: np.ndarray
    """(..., n, 3): positions in {O}, m.  Every node has six dofs: displacement (m) and rotation (rad), in {O}."""
    beams: tuple[BeamElement, ...]
    """In the order of the walks: the first node of a beam is never the second of a later one."""
    connections: tuple[Connection, ...]
    masses: tuple[NodeMass, ...]
    scale: float
    """Length (m) by which displacements and rotations are made comparable."""
    sheathed: tuple[Sheathed, ...] = ()


@dataclass
class _Builder:
    """Collects the parts of a structure while its chains are walked."""

    shape: tuple[int, ...]
    stock: Stock
    nodes: list[np.ndarray] = field(default_factory=list)
    beams: list[BeamElement] = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    masses: list[NodeMass] = field(default_factory=list)
    sheathed: list[Sheathed] = field(default_factory=list)

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
        none = np.zeros((*self.shape, 6, 0))
        self.connections.append(Connection(name, first, second, at, none, np.zeros(0), None, np.zeros(0)))


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
        _add_leg(build, leg, pose.place(leg.platform_frame()), jax.tree.map(lambda c: np.asarray(c, dtype=float), own))
    build.masses.append(_in_world(build, "platform", PLATFORM, pose, platform_mass(machine.platform, machine.stock)))
    nodes = np.stack(build.nodes, axis=-2)
    scale = float(machine.characteristic_length) or float(np.abs(nodes).max())
    return Structure(nodes, tuple(build.beams), tuple(build.connections), tuple(build.masses), scale, tuple(build.sheathed))


def _add_leg(build: _Builder, leg: Leg, seat: Frame, coordinates: tuple[Coordinate, ...]) -> None:
    steps = walk_from(leg.base_frame(), leg.chain.elements, coordinates)
    found = list(parts(steps, seat, build.stock))
    last_joint = max(k for k, part in enumerate(found) if isinstance(part, Tie))
    ends_there = not any(isinstance(part, (Bar, Arm)) for part in found[last_joint:])
    node = GROUND
    for k, part in enumerate(found):
        name = f"{leg.name}.{part.element.name}"
        if isinstance(part, Tie):
            beyond = PLATFORM if k == last_joint and ends_there else build.node(part.at)
            build.connections.append(_connection(build, name, part, (node, beyond)))
            node = beyond
        elif isinstance(part, Bar):
            _hide(build, name, node, part)
            node = _add_beam(build, name, node, part)
        elif isinstance(part, Arm):
            beyond = build.node(part.end)
            build.tie(name, node, beyond, build.array(part.end))
            node = beyond
        else:
            own = RigidMass.centred(part.mass, ZERO, diagonal(*part.moments))
            build.masses.append(_in_world(build, name, node, part.frame, own))
    if node != PLATFORM:
        last = leg.chain.elements[-1]
        build.tie(f"{leg.name}.{last.name}", node, PLATFORM, build.nodes[node])


def _connection(build: _Builder, name: str, tie: Tie, nodes: tuple[int, int]) -> Connection:
    """The connection which a joint makes: slack along its slack freedoms, sprung where it has a stiffness, else rigid."""
    joint = tie.element
    yielding = [build.screw(twist) for twist in (*tie.slack, *(f.twist for f in tie.sprung))]
    screws = np.stack(yielding, axis=-1) if yielding else np.zeros((*build.shape, 6, 0))
    rates = np.array([0.0] * len(tie.slack) + [1 / float(f.compliance) for f in tie.sprung])
    moved = [True] * len(tie.slack) + [f.part in ("drive", "joint") for f in tie.sprung]
    viscosity = np.where(moved, float(joint.viscosity or 0), 0.0)
    drive = None
    if is_driven(joint):
        own = [f.twist for f in tie.sprung if f.part == "drive"]
        drive = build.screw(own[0] if own else tie.motion[0])
    loss = None if joint.loss_factor is None else float(joint.loss_factor)
    return Connection(name, *nodes, build.array(tie.at), screws, rates, loss, viscosity, drive)


def _add_beam(build: _Builder, name: str, first: int, bar: Bar) -> int:
    """Add a beam and its far node; a negative length runs the other way, a zero one is rigid."""
    far = bar.end
    second = build.node(far)
    span = np.broadcast_to(np.abs(np.asarray(bar.length, dtype=float)), build.shape)
    if np.all(span == 0):
        build.tie(name, first, second, build.array(far))
        return second
    if np.any(span == 0):
        raise InputError(f"{name}: zero length at some poses of the batch and not at others; assemble them apart")
    x, y, _ = (build.array(v) for v in beam_axes(bar.start, bar.axis))
    x = x * np.sign(bar.length)[..., None]
    axes = np.stack([x, y, np.cross(x, y)], axis=-1)
    build.beams.append(BeamElement(name, first, second, axes, span, uniform(bar.profile, build.stock).numbers()))
    return second


def _hide(build: _Builder, name: str, node: int, bar: Bar) -> None:
    """Add what of a slide's rod is behind its root, and ahead of its end where the travel goes both ways."""
    rod = bar.element.rod
    if rod is None or not isinstance(bar.element, Prismatic):
        return
    out = np.asarray(bar.length, dtype=float)
    behind, ahead = np.maximum(-rod.low - np.maximum(out, 0), 0), np.maximum(rod.high - np.maximum(-out, 0), 0)
    span = behind + ahead
    moment = behind * (np.minimum(out, 0) - behind / 2) + ahead * (np.maximum(out, 0) + ahead / 2)
    middle = moment / np.where(span > 0, span, 1)
    at = build.array(bar.start.origin) + build.array(bar.start.direction(bar.axis)) * middle[..., None]
    build.sheathed.append(Sheathed(name, node, at, np.asarray(rod.line_density(build.stock) * span)))


def _in_world(build: _Builder, name: str, node: int, frame: Frame, own: RigidMass) -> NodeMass:
    """A mass, given in the axes of a frame, as it moves with a node."""
    axes = np.stack([build.array(v) for v in (frame.x, frame.y, frame.z)], axis=-1)
    if own.mass == 0:
        return NodeMass(name, node, build.array(frame.origin), 0.0, np.zeros((*build.shape, 3, 3)))
    at = build.array(frame.origin) + axes @ np.array(own.centre, dtype=float)
    inertia = np.array(own.about_centre.matrix(), dtype=float)
    return NodeMass(name, node, at, float(own.mass), axes @ inertia @ np.swapaxes(axes, -1, -2))
