"""MJCF: machines as MuJoCo models, closed loops included.

Every chain is walked from the ground.  A joint that moves begins a body, whose frame is that beyond the joint; what follows up
to the next such joint is rigid with it.  The platform floats, and equality constraints tie the ends of the chains to it: a
chain that ends with a ball by the ball's centre alone, any other by the whole frame beyond its last joint.
"""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from trivet.dynamics.batch import Case, drive_motion
from trivet.dynamics.bodies import Bodies, require_masses
from trivet.dynamics.equations import State
from trivet.errors import NoResultError, TrivetError
from trivet.files import replacing
from trivet.interop.rod_mesh import rod_mesh
from trivet.interop.xml import comment, numbers, unknown_joint
from trivet.kinematics.jacobian import actuator_names
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.singularity import singularity
from trivet.kinematics.standing import Standing, home_pose, stand
from trivet.kinematics.walk import Coordinate
from trivet.model import Machine
from trivet.model.elements import Curvilinear, Drivable, Element, Joint, Prismatic, Revolute, Spherical, Stock, Universal
from trivet.model.elements.beam import beam_axes
from trivet.model.mass import STANDARD_GRAVITY, RigidMass, Rod, platform_mass, together
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.screw import Twist
from trivet.space.vector import ZERO
from trivet.study.machines import MachineLike, choose

_OPTION = {
    "gravity": f"0 0 -{STANDARD_GRAVITY}",
    "timestep": "0.0001",
    "integrator": "implicitfast",
    "iterations": "100",
    "tolerance": "1e-14",
}
_LOOPS = {"solref": "0.0002 1", "solimp": "0.9999 0.9999 0.001 0.5 2"}
"""Loops as stiff as the time step allows: a machine that falls freely keeps them closed to well below 1 um."""

_GRAVITY = (0.0, 0.0, -STANDARD_GRAVITY)
"""Acceleration of free fall in the model, m/s^2."""

_MOTE, _MOTE_INERTIA = 1e-12, 1e-13
"""Mass (kg) and moment of inertia (kg m^2) for a body that has none; MuJoCo wants more than 1e-15 and 1e-14."""

_NOTES = (
    "SI units and radians. The model stands in the pose of its keyframe. qpos of a slide or a hinge is the coordinate that "
    "trivet gives the joint; qpos of a ball is its turn from this pose. Joints have trivet's names, chain.joint.",
    "Equality constraints close the loops. Drives, joints and beams are rigid, nothing collides, and the rod of a slide "
    "is as long as its travel asks for.",
    "ctrl of the keyframe is what the motors must give (N, N m) to hold the machine there against its weight.",
)
_NO_HOLD = "No holding forces: "
_BALL_FRICTION = "friction and damping of this ball are not in the model: here it is no joint but a constraint"
_NO_RANGE = "its travel limits the elevation of the next body, not its coordinate: no range here"
_NO_INERTIA = f"{_MOTE:g} kg and {_MOTE_INERTIA:g} kg m^2 more than in trivet: MuJoCo moves nothing without mass and inertia"


@dataclass
class _Body:
    """A body of the model while it is put together."""

    xml: ET.Element
    moves: bool = True
    frame: Frame = IDENTITY
    """Where the walk stands, in the axes of the body."""
    parts: list[RigidMass] = field(default_factory=list)

    @classmethod
    def within(cls, parent: ET.Element, name: str, frame: Frame, *, moves: bool = True) -> _Body:
        """A body that stands in a frame of its parent."""
        return cls(ET.SubElement(parent, "body", {"name": name, **_placed(frame)}), moves)

    def site(self, name: str, frame: Frame) -> None:
        """Mark a frame of the body."""
        ET.SubElement(self.xml, "site", {"name": name, **_placed(frame)})

    def weigh(self) -> None:
        """Write what all parts weigh together."""
        whole, notes = together(self.parts), []
        mass, centre, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
        if whole.mass > 0:
            mass, centre = float(whole.mass), np.array(whole.centre, dtype=float)
            inertia = np.array(whole.about_centre.matrix(), dtype=float)
        if self.moves and (mass < _MOTE or np.linalg.eigvalsh(inertia)[0] < _MOTE_INERTIA):
            mass, inertia = mass + _MOTE, inertia + _MOTE_INERTIA * np.eye(3)
            notes = [comment(_NO_INERTIA)]
        if mass > 0:
            moments = numbers([*inertia.diagonal(), inertia[0, 1], inertia[0, 2], inertia[1, 2]])
            self.xml[:0] = [*notes, ET.Element("inertial", pos=numbers(centre), mass=numbers([mass]), fullinertia=moments)]


@dataclass
class _Model:
    """The model while chains are added to it."""

    stock: Stock
    world: ET.Element
    ties: ET.Element
    assets: ET.Element
    platform: _Body
    share: RigidMass
    """What the platform weighs, divided among it and the bodies welded to it: a body without mass would hold nothing."""
    qpos: list[float]
    meshes: dict[tuple[str, float, float], str] = field(default_factory=dict)
    """Rods that are drawn, by section, near and far end (m): equal ones share a mesh."""


def to_mjcf(machine: MachineLike, pose: Frame | None = None, mode: str | None = None) -> str:
    """A machine as MJCF, standing at a pose, in SI and the axes of {O}.

    Bodies are named after the joint that moves them, "platform", or "ground/leg-1" for what stands on the ground; motors (N or
    N m) after their joints, in the order of Q.  The two hinges of a universal joint are "leg-1.cross.1" and "leg-1.cross.2".
    A last ball is no joint but the constraint "leg-1.ball"; any other last joint is both.  A locked joint is rigid.  Mass and
    inertia are those of beams, joints, offsets and platform, armature is the reflected inertia of a drive; kinematics do not
    mind a chain whose last body has no mass, MuJoCo's dynamics do.  Rods are drawn as meshes of their sections.

    Args:
        machine: machine, name or file.
        pose: platform frame {E} in {O}, of floats (m); home when not given.  The keyframe is named "home", or "pose".
        mode: working mode, as `parse_mode` reads it; the machine's own when not given.

    Raises:
        InputError: when the mode does not fit the machine, or a rod has no length since its slide has no travel.
        NoResultError: when a chain does not reach the pose (travel limits are not looked at).
    """
    machine = choose(machine)
    require_masses(machine)
    frame = home_pose(machine) if pose is None else pose
    signs = parse_mode(machine, mode)
    stands = stand(machine, frame, signs)
    root = ET.Element("mujoco", model=machine.name)
    root.extend(comment(note) for note in _NOTES)
    ET.SubElement(root, "compiler", angle="radian")
    ET.SubElement(root, "option", _OPTION)
    defaults = ET.SubElement(root, "default")
    ET.SubElement(defaults, "geom", contype="0", conaffinity="0", rgba="0.6 0.65 0.7 1")
    ET.SubElement(defaults, "equality", _LOOPS)
    assets = ET.SubElement(root, "asset")
    world, ties = ET.SubElement(root, "worldbody"), ET.SubElement(root, "equality")
    platform = _Body.within(world, "platform", frame)
    ET.SubElement(platform.xml, "freejoint", name="platform")
    x, y, z, w = Rotation.from_matrix(np.array(frame.matrix(), dtype=float)).as_quat()
    welds = sum(not isinstance(one.leg.chain.elements[-1], Spherical) for one in stands)
    share = platform_mass(machine.platform, machine.stock).times(1 / (1 + welds))
    model = _Model(machine.stock, world, ties, assets, platform, share, [*frame.origin, w, x, y, z])
    for one in stands:
        _add_leg(model, one)
    platform.parts.append(share)
    platform.weigh()
    if machine.platform.disc is not None:
        size = numbers([machine.platform.disc.radius, machine.platform.disc.thickness / 2])
        centre = numbers(machine.platform.centre_of_mass or (0, 0, 0))
        ET.SubElement(platform.xml, "geom", type="cylinder", size=size, pos=centre)
    motors = ET.SubElement(root, "actuator")
    for name in actuator_names(machine):
        ET.SubElement(motors, "motor", name=name, joint=name)
    frames = ET.SubElement(root, "keyframe")
    key = ET.SubElement(frames, "key", name="home" if pose is None else "pose", qpos=numbers(model.qpos))
    try:
        key.set("ctrl", numbers(_holding_forces(machine, frame, signs)))
    except TrivetError as error:
        frames.insert(0, comment(f"{_NO_HOLD}{error}"))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _holding_forces(machine: Machine, pose: Frame, signs: Any) -> Iterable[float]:
    """What the drives give at rest against the machine's weight.

    Raises:
        InputError: unless six drives move the platform's six freedoms.
        NoResultError: at a singular pose.
    """
    Bodies.of(machine)  # refuses what has not six drives
    if singularity(machine, pose, mode_text(machine, signs) or None).type:
        raise NoResultError("the pose is singular")
    still = Twist(ZERO, ZERO)
    return [float(force) for force in drive_motion(Case(machine, signs, _GRAVITY), State(pose, still), still).force[0]]


def write_mjcf(machine: MachineLike, path: str | os.PathLike[str], *, mode: str | None = None, overwrite: bool = False) -> None:
    """Write a machine at home as MJCF.

    Args:
        machine, mode: as for `to_mjcf`.
        path: file to write; it appears whole or not at all.
        overwrite: whether the file may be replaced.

    Raises:
        InputError, NoResultError: as `to_mjcf`; InputError when the file exists unasked or cannot be written.
    """
    text = to_mjcf(machine, mode=mode)
    with replacing(path, overwrite=overwrite) as file:
        file.write_text(text, encoding="utf-8")


def _add_leg(model: _Model, one: Standing) -> None:
    leg, last = one.leg, one.leg.chain.elements[-1]
    tie, on_platform, seat = f"{leg.name}.{last.name}", f"platform/{leg.name}", leg.platform_frame()
    by_centre = isinstance(last, Spherical)
    body = _Body.within(model.world, f"ground/{leg.name}", leg.base_frame(), moves=False)
    coordinates = jax.tree.map(float, one.posture.coordinates)
    for element, coordinate in zip(leg.chain.elements[: -1 if by_centre else None], coordinates, strict=False):
        body.frame = element.advance(body.frame, coordinate)
        if element.unknowns:
            body.weigh()
            name = f"{leg.name}.{element.name}"
            body = _Body.within(body.xml, name, body.frame)
            model.qpos += _add_joints(body, name, element, coordinate)
        body.parts.append(element.weigh(model.stock).out_of(body.frame))
        if element.rod is not None:
            _draw_rod(model, body, f"{leg.name}.{element.name}", element.rod)
    if by_centre:
        model.platform.parts.append(last.weigh(model.stock).out_of(seat))
    else:
        # Beyond the last joint the body's frame is that of the platform joint.
        body.parts.append(model.share.into(seat).out_of(body.frame))
    body.weigh()
    if by_centre and isinstance(last, Spherical) and (last.friction is not None or last.damping is not None):
        model.ties.append(comment(_BALL_FRICTION))
    body.site(tie, body.frame)
    model.platform.site(on_platform, seat)
    ET.SubElement(model.ties, "connect" if by_centre else "weld", name=tie, site1=tie, site2=on_platform)


def _add_joints(body: _Body, name: str, joint: Element, coordinate: Coordinate) -> list[float]:
    """Give a body the joint that moves it; returns what qpos holds of the joint."""
    match joint:
        case Spherical():
            ET.SubElement(body.xml, "joint", {"name": name, "type": "ball", **_resistance(joint)})
            return [1.0, 0.0, 0.0, 0.0]
        case Universal():
            first, second = joint.axes
            # The frame of the body lies beyond both hinges: the second has turned it away from the first.
            seen = IDENTITY.turn(second, Angle(coordinate[1].cos, -coordinate[1].sin)).direction(first)
            angles = [_radians(angle) for angle in coordinate]
            for number, axis, angle in zip((1, 2), (seen, second), angles, strict=True):
                own = {"name": f"{name}.{number}", "type": "hinge", "axis": numbers(axis), "ref": numbers([angle])}
                ET.SubElement(body.xml, "joint", own | _resistance(joint))
            return angles
        case Prismatic():
            _add_drivable(body, joint, coordinate, joint.travel, name=name, type="slide", axis=numbers(joint.axis))
            return [coordinate]
        case Revolute():
            limits = None if joint.measure == "elevation" else joint.travel
            value = _radians(coordinate, sum(limits) / 2 if limits else 0.0)
            _add_drivable(body, joint, value, limits, name=name, type="hinge", axis=numbers(joint.axis))
            return [value]
        case Curvilinear():
            value = _radians(coordinate, sum(joint.travel) / 2 if joint.travel else 0.0)
            middle = numbers([-joint.radius, 0, 0])  # the body's frame is on the circle, the axis in its middle
            _add_drivable(body, joint, value, joint.travel, name=name, type="hinge", axis="0 0 1", pos=middle)
            return [value]
        case _:
            raise unknown_joint(name, joint, "MJCF")


def _add_drivable(body: _Body, joint: Drivable, value: float, limits: tuple[float, float] | None, **attributes: str) -> None:
    """Give a body a joint of one freedom that stands at a value (m, rad)."""
    attributes["ref"] = numbers([value])
    if limits:
        attributes["range"] = numbers(limits)
    elif joint.travel:
        body.xml.append(comment(_NO_RANGE))
    ET.SubElement(body.xml, "joint", attributes | _resistance(joint))


def _resistance(joint: Joint) -> dict[str, str]:
    """Friction and reflected inertia of a joint, along its coordinate."""
    lever = float(joint.lever)
    found = {}
    if joint.damping is not None:
        found["damping"] = numbers([joint.damping * lever**2])
    if joint.friction is not None:
        found["frictionloss"] = numbers([joint.friction * lever])
    if isinstance(joint, Drivable) and joint.reflected_inertia is not None:
        found["armature"] = numbers([joint.reflected_inertia * lever**2])
    return found


def _draw_rod(model: _Model, body: _Body, name: str, rod: Rod) -> None:
    shape = (rod.profile.section, float(rod.low), float(rod.high))
    if shape not in model.meshes:
        model.meshes[shape] = name
        mesh = rod_mesh(model.stock.sections[rod.profile.section], *shape[1:])
        faces = " ".join(map(str, mesh.faces.ravel()))
        ET.SubElement(model.assets, "mesh", name=name, vertex=numbers(mesh.vertices.ravel()), face=faces)
    place = Frame(body.frame.origin, *beam_axes(body.frame, rod.axis))
    ET.SubElement(body.xml, "geom", {"type": "mesh", "mesh": model.meshes[shape], **_placed(place)})


def _radians(angle: Angle, near: float = 0.0) -> float:
    """An angle in the turn around `near`."""
    return near + math.remainder(math.atan2(angle.sin, angle.cos) - near, 2 * math.pi)


def _placed(frame: Frame) -> dict[str, str]:
    """Attributes that place something in a frame of its parent; none where it stands as the parent does."""
    place = {"pos": numbers(frame.origin), "xyaxes": numbers([*frame.x, *frame.y])}
    as_parent = {"pos": "0 0 0", "xyaxes": "1 0 0 0 1 0"}
    return {key: value for key, value in place.items() if value != as_parent[key]}
