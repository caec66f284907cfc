"""URDF: the tree that is left of a machine when its loops are opened.

URDF has no closed loops.  The platform hangs on the first chain; the last joint of every other chain is left out, and what is
lost is said in the file.  Joint values are trivet's coordinates; balls and universal joints become hinges in succession, with
links without mass between them.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from trivet.dynamics.bodies import carried_mass, require_masses
from trivet.errors import NoResultError
from trivet.files import replacing
from trivet.interop.xml import comment, numbers, unknown_joint
from trivet.kinematics.closure import coordinates_from
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import home_pose, stand
from trivet.model import Leg, Machine
from trivet.model.elements import Curvilinear, Drivable, Element, Joint, Prismatic, Revolute, Spherical, Universal
from trivet.model.elements.beam import beam_axes
from trivet.model.mass import RigidMass, Rod, together
from trivet.space.frame import IDENTITY, Frame
from trivet.study.machines import MachineLike, choose

_UNBOUNDED = "1e9"
"""Effort and speed of joints that have no stated limit; URDF wants a number."""

_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass
class _Link:
    """A link while it is put together."""

    xml: ET.Element
    name: str
    frame: Frame = IDENTITY
    """Where the walk stands, in the link's axes."""
    parts: list[RigidMass] = field(default_factory=list)


def open_loops(machine: MachineLike) -> list[str]:
    """The joints which the tree lacks: the last one of every chain but the first."""
    return [f"{leg.name}.{leg.chain.elements[-1].name}" for leg in choose(machine).legs[1:]]


def to_urdf(machine: MachineLike) -> str:
    """The tree of a machine as URDF, in SI; links are named after the joints that move them, "ground" and "platform".

    Args:
        machine: machine, name or file.

    Raises:
        InputError: when a rod has no length since its slide has no travel.
    """
    machine = choose(machine)
    require_masses(machine)
    root = ET.Element("robot", name=machine.name)
    lost = ", ".join(open_loops(machine)) or "none"
    root.append(comment(f"A tree: URDF cannot close loops. Joints that are missing: {lost}. Values of joints are trivet's."))
    if any(getattr(e, "reflected_inertia", None) for leg in machine.legs for e in leg.chain.elements):
        root.append(comment("Nor does it know the reflected inertia of drives, which is missing as well."))
    root.extend(comment(line) for line in _home_values(machine))
    ground = _link(root, "ground")
    for place, leg in enumerate(machine.legs):
        _add_leg(root, ground, machine, leg, is_first=place == 0)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def write_urdf(machine: MachineLike, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write the tree of a machine as URDF.

    Args:
        machine: as for `to_urdf`.
        path: file to write; it appears whole or not at all.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: as `to_urdf`, or when the file exists unasked or cannot be written.
    """
    text = to_urdf(machine)
    with replacing(path, overwrite=overwrite) as file:
        file.write_text(text, encoding="utf-8")


def _home_values(machine: Machine) -> list[str]:
    """Values of the joints at home, in sentences."""
    try:
        stands = stand(machine, home_pose(machine), parse_mode(machine))
    except NoResultError:
        return []
    found = []
    for one in stands:
        for element, coordinate in zip(one.leg.chain.elements, one.posture.coordinates, strict=True):
            if isinstance(element, Drivable) and element.locked is None:
                found.append(f"{one.leg.name}.{element.name} = {float(element.number(coordinate))!r}")
    return [f"At home: {', '.join(found)}"] if found else []


def _add_leg(root: ET.Element, ground: _Link, machine: Machine, leg: Leg, is_first: bool) -> None:
    ground.frame = leg.base_frame()
    link, stock = ground, machine.stock
    for element in leg.chain.elements if is_first else leg.chain.elements[:-1]:
        is_last = element is leg.chain.elements[-1]
        name = f"{leg.name}.{element.name}"
        if element.unknowns:
            link = _joined(root, link, name, element, is_last)
        else:
            link.frame = element.advance(link.frame, _locked(element))
        if is_last:
            _hang_platform(root, link, machine, leg)
            break
        link.parts.append(element.weigh(stock).out_of(link.frame))
        if element.rod is not None:
            _draw_rod(link, element.rod, machine)
        _weigh(link)


def _joined(root: ET.Element, link: _Link, name: str, joint: Element, is_last: bool) -> _Link:
    """The link beyond a joint; the walk stands in it where it would at a value of zero."""
    axes = _axes(name, joint)
    for number, axis in enumerate(axes, 1):
        own = name if len(axes) == 1 else f"{name}.{number}"
        is_end = number == len(axes)
        beyond = _link(root, "platform" if is_end and is_last else own)
        _joint(root, own, link, beyond, joint, axis)
        if not is_end:
            _weigh(beyond)
        link = beyond
    if isinstance(joint, Curvilinear):
        link.frame = link.frame.shift((joint.radius, 0, 0))
    return link


def _axes(name: str, joint: Element) -> tuple[Any, ...]:
    """Axes of the hinges, or of the slide, that a joint becomes."""
    match joint:
        case Spherical():
            return _AXES
        case Universal():
            return joint.axes
        case Curvilinear():
            return ((0.0, 0.0, 1.0),)
        case Prismatic() | Revolute():
            return (joint.axis,)
        case _:
            raise unknown_joint(name, joint, "URDF")


def _joint(root: ET.Element, name: str, link: _Link, beyond: _Link, joint: Element, axis: tuple[float, float, float]) -> None:
    assert isinstance(joint, Joint)
    limits = joint.travel if isinstance(joint, Drivable) else None
    if isinstance(joint, Revolute) and joint.measure == "elevation":
        limits = None
    kind = "prismatic" if isinstance(joint, Prismatic) else "continuous" if limits is None else "revolute"
    xml = ET.SubElement(root, "joint", name=name, type=kind)
    ET.SubElement(xml, "origin", _placed(link.frame))
    ET.SubElement(xml, "parent", link=link.name)
    ET.SubElement(xml, "child", link=beyond.name)
    ET.SubElement(xml, "axis", xyz=numbers(axis))
    if kind != "continuous":
        low, high = limits if limits is not None else (-1e9, 1e9)
        ET.SubElement(xml, "limit", lower=numbers([low]), upper=numbers([high]), effort=_UNBOUNDED, velocity=_UNBOUNDED)
    lever = float(joint.lever)
    damping, friction = (joint.damping or 0.0) * lever**2, (joint.friction or 0.0) * lever
    if damping or friction:
        ET.SubElement(xml, "dynamics", damping=numbers([damping]), friction=numbers([friction]))


def _hang_platform(root: ET.Element, link: _Link, machine: Machine, leg: Leg) -> None:
    """Give the last link of the first chain, which is the platform, its mass, and mark {E} by a link of its own."""
    seat = leg.platform_frame()
    mass = carried_mass(machine.platform, machine.legs, machine.stock)
    link.parts.append(mass.into(seat).out_of(link.frame))
    _weigh(link)
    centre = ET.SubElement(root, "link", name="platform-centre")
    xml = ET.SubElement(root, "joint", name="platform-centre", type="fixed")
    ET.SubElement(xml, "origin", _placed(link.frame.place(_inverse(seat))))
    ET.SubElement(xml, "parent", link=link.name)
    ET.SubElement(xml, "child", link=centre.get("name") or "")


def _inverse(frame: Frame) -> Frame:
    """The outer frame seen from a frame that is written in it."""
    axes = np.array(frame.matrix(), dtype=float).T
    origin = -axes @ np.array(frame.origin, dtype=float)
    return Frame(type(frame.origin)(*origin), *(type(frame.origin)(*axes[:, k]) for k in range(3)))


def _locked(element: Element) -> Any:
    """The coordinate of a joint that is held, as `advance` takes it."""
    return jax.tree.map(float, coordinates_from((element,), np.zeros(0))[0])


def _link(root: ET.Element, name: str) -> _Link:
    return _Link(ET.SubElement(root, "link", name=name), name)


def _weigh(link: _Link) -> None:
    """Write what all parts weigh together, in place of what was written before."""
    for old in link.xml.findall("inertial"):
        link.xml.remove(old)
    whole = together(link.parts)
    if not whole.mass > 0:
        return
    xml = ET.Element("inertial")
    ET.SubElement(xml, "origin", xyz=numbers(whole.centre), rpy="0 0 0")
    ET.SubElement(xml, "mass", value=numbers([whole.mass]))
    ET.SubElement(xml, "inertia", {f"i{key}": numbers([value]) for key, value in whole.about_centre._asdict().items()})
    link.xml.insert(0, xml)


def _draw_rod(link: _Link, rod: Rod, machine: Machine) -> None:
    outline = machine.sections[rod.profile.section].outline
    x, y, z = beam_axes(link.frame, rod.axis)
    middle = link.frame.origin + link.frame.direction(rod.axis) * (float(rod.low + rod.high) / 2)
    xml = ET.SubElement(link.xml, "visual")
    length = float(rod.length)
    if outline.is_round:
        ET.SubElement(xml, "origin", _placed(Frame(middle, y, z, x)))
        ET.SubElement(ET.SubElement(xml, "geometry"), "cylinder", radius=numbers([outline.width / 2]), length=numbers([length]))
    else:
        ET.SubElement(xml, "origin", _placed(Frame(middle, x, y, z)))
        ET.SubElement(ET.SubElement(xml, "geometry"), "box", size=numbers([length, outline.width, outline.height]))


def _placed(frame: Frame) -> dict[str, str]:
    rpy = Rotation.from_matrix(np.array(frame.matrix(), dtype=float)).as_euler("xyz")
    return {"xyz": numbers(frame.origin), "rpy": numbers(rpy)}
