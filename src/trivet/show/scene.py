"""The scene: a machine at a pose as primitive shapes, everything from its description."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.singularity import Motion
from trivet.kinematics.standing import GROUND, PLATFORM, home_pose, stand, starts
from trivet.kinematics.walk import Coordinate
from trivet.model import Leg, Machine
from trivet.model.elements import (
    Beam,
    Curvilinear,
    Drivable,
    Element,
    Joint,
    Offset,
    Prismatic,
    Profile,
    Revolute,
    Spherical,
    Universal,
)
from trivet.model.elements.beam import beam_axes
from trivet.reach.distance import Box, Capsule
from trivet.reach.scene import shape_in
from trivet.show import shapes
from trivet.show.shapes import Array, Role, Shape
from trivet.space.frame import IDENTITY, Frame

Step: TypeAlias = tuple[Element, Frame, Any]


class Label(NamedTuple):
    """A word at a point (3,) in {O}, m."""

    text: str
    point: Array


class Scene(NamedTuple):
    """What is to be seen."""

    shapes: tuple[Shape, ...]
    joints: tuple[Label, ...]
    """Names of all joints."""
    first: frozenset[str]
    """Names of the joints of the first chain of each kind: the others are its copies."""
    frames: tuple[Label, ...]
    """Names of the frames {O} and {E} and of their axes, and of the chains at their feet."""
    mode: str
    """Working mode as written; empty where the chains were closed numerically."""
    pose: Frame

    def labelled(self, marked: set[str]) -> tuple[Label, ...]:
        """The joints whose names a drawing shows: one of each kind, and those that are marked."""
        return tuple(label for label in self.joints if label.text in self.first | marked)


def scene(machine: Machine, pose: Frame | None = None, mode: str | None = None, motion: Motion | None = None) -> Scene:
    """The shapes of a machine at a pose, positions in {O} in m.

    Args:
        machine: the machine.
        pose: platform frame {E} in {O}, of floats (m); home when not given.
        mode: working mode, as `parse_mode` reads it; for machines whose chains are all solved by a leg family.
        motion: a motion of the platform, to be shown as an arrow with one head for a translation, with two for a turn.

    Raises:
        InputError: when the mode does not fit the machine.
        NoResultError: when a chain does not reach the pose.
    """
    pose = home_pose(machine) if pose is None else pose
    signs = parse_mode(machine, mode)
    stands, written = [(one.leg, list(one.steps)) for one in stand(machine, pose, signs)], mode_text(machine, signs)
    unit = _unit(machine)
    found = list(_ground(machine, unit))
    joints: list[Label] = []
    frames: list[Label] = []
    first: set[str] = set()
    for (leg, steps), start in zip(stands, starts(machine), strict=True):
        found += _rails(leg, steps, start, unit)
        found += _bodies(machine, leg, steps, start)
        marking = list(_joints(leg, steps, start, unit))
        markers = {shape.name: shape for shape in marking}
        found += marking
        joints += [Label(name, (shape.start + shape.end) / 2) for name, shape in markers.items()]
        first |= markers.keys() if leg.rotation == 0 else set()
        frames.append(Label(leg.name, _foot(steps, unit)))
    found += _platform(machine, pose, unit)
    found += _declared(machine, stands, pose)
    size = 0.5 * max(float(np.ptp(np.concatenate([s.rings.reshape(-1, 3) for s in found]), axis=0).max()), 1e-3)
    if motion is not None:
        found += arrow(motion, pose, 0.7 * size)
    for number, (name, frame, reach) in enumerate((("O", IDENTITY, 0.3 * size), ("E", pose, 0.22 * size))):
        found += (shape.on(number) for shape in _triad(name, frame, reach))
        frames += [Label(f"{{{name}}}", _point(frame))] + [
            Label(f"{axis}{'' if name == 'O' else '_E'}", _point(frame) + 1.12 * reach * column)
            for axis, column in zip("xyz", _axes(frame).T, strict=True)
        ]
    return Scene(tuple(_once(found)), tuple(joints), frozenset(first), tuple(frames), written, pose)


def _point(frame: Frame) -> Array:
    return np.array([float(c) for c in frame.origin])


def _axes(frame: Frame) -> Array:
    """Axes of a frame (3, 3) in the columns."""
    return np.array([[float(c) for c in row] for row in frame.matrix()])


def _beyond(element: Element, frame: Frame, coordinate: Coordinate) -> Frame:
    """The frame behind a sliding joint, which is where its carriage is; that of any other joint itself."""
    return element.advance(frame, coordinate) if isinstance(element, (Curvilinear, Prismatic)) else frame


def _unit(machine: Machine) -> float:
    """Size of the joints in the drawing, m: the width of the slenderest section, or a share of the machine."""
    widths = [float(section.outline.width) for section in machine.sections.values()]
    return min(widths) if widths else 0.15 * float(machine.characteristic_length) + 1e-3


def _role(joint: Element) -> Role:
    if isinstance(joint, Drivable) and joint.locked is not None:
        return "locked joint"
    return "actuated joint" if isinstance(joint, Drivable) and joint.actuated else "passive joint"


def _foot(steps: list[Step], unit: float) -> Array:
    """Where the name of a chain stands: beside its first joint, away from the middle of the machine."""
    centre = _point(_beyond(*steps[0]))
    outwards = centre[:2] / max(float(np.hypot(*centre[:2])), 1e-9)
    return centre + 3 * unit * np.array((*outwards, 0.0))


def _barrel(element: Element) -> float:
    """Length (m) of the fixed part of a telescope: a slide with a beam that never comes near zero; zero for another slide."""
    if not isinstance(element, Prismatic) or element.beam is None or element.travel is None:
        return 0.0
    return 0.9 * max(float(element.travel[0]), 0.0)


def _ground(machine: Machine, unit: float) -> Iterator[Shape]:
    """The base plate, where chains stand on places of their own."""
    feet = np.array([_point(leg.base_frame()) for leg in machine.legs if leg.chain.base is not None and leg.chain.base.radius])
    if len(feet) >= 3:
        middle = feet.mean(axis=0)
        angles = np.arctan2(*(feet - middle).T[1::-1])
        rim = middle + (feet - middle)[np.argsort(angles)] * 1.08
        yield shapes.plate("base", "ground", rim - (0, 0, unit / 2), np.array((0.0, 0.0, 1.0)), unit / 4)


def _rails(leg: Leg, steps: list[Step], start: int, unit: float) -> Iterator[Shape]:
    """The guides along which joints slide, over their travel."""
    for number, (element, frame, _) in enumerate(steps):
        carrier = start + 2 * number
        name, size = f"{leg.name}.{element.name}", (0.35 * unit, 0.35 * unit)
        if isinstance(element, Curvilinear):
            low, high = (-math.pi, math.pi) if element.travel is None else element.travel
            angles = np.linspace(float(low), float(high), max(3, round((float(high) - float(low)) * 20)))
            around = np.stack([np.cos(angles), np.sin(angles)], axis=1) * float(element.radius)
            axes = _axes(frame)
            yield shapes.curve(name, "guide", _point(frame) + around @ axes[:, :2].T, axes[:, 2], size).on(carrier)
        elif isinstance(element, Prismatic) and element.travel is not None and not _barrel(element):
            ends = [_point(element.advance(frame, float(limit))) for limit in element.travel]
            yield shapes.bar(name, "guide", ends[0], ends[1], size, is_round=False).on(carrier)


def _bodies(machine: Machine, leg: Leg, steps: list[Step], start: int) -> Iterator[Shape]:
    """Links: beams, the extended parts of slides, and rigid offsets."""
    for number, (element, frame, coordinate) in enumerate(steps):
        carrier = start + 2 * number
        name = f"{leg.name}.{element.name}"
        if isinstance(element, Beam):
            yield _link(machine, name, frame, element.axis, float(element.length), element.profile).on(carrier)
        elif isinstance(element, Prismatic) and element.beam is not None and float(coordinate) != 0:
            yield _link(machine, name, frame, element.axis, float(coordinate), element.beam).on(carrier, carrier + 1)
        elif isinstance(element, Offset):
            one, other = _point(frame), _point(element.advance(frame))
            if np.any(one != other):
                yield shapes.bar(name, "link", one, other, (0.5 * _unit(machine),) * 2, is_round=False).on(carrier)


def _link(machine: Machine, name: str, frame: Frame, axis: Any, length: float, profile: Profile) -> Shape:
    outline = machine.sections[profile.section].outline
    along, side, _ = (np.array([float(c) for c in v]) for v in beam_axes(frame, axis))
    start = _point(frame)
    size = (float(outline.width), float(outline.height))
    return shapes.bar(name, "link", start, start + along * length, size, outline.is_round, side)


def _joints(leg: Leg, steps: list[Step], start: int, unit: float) -> Iterator[Shape]:
    """Joints as markers: carriages and sliders, barrels of telescopes, pins of hinges, balls."""
    stage = 0
    for number, (element, frame, coordinate) in enumerate(steps):
        carrier = start + 2 * number
        name, role = f"{leg.name}.{element.name}", _role(element)
        place = _beyond(element, frame, coordinate)
        centre, axes = _point(place), _axes(place)
        if isinstance(element, Prismatic) and _barrel(element):
            foot = _point(frame)
            along = np.array([float(c) for c in frame.direction(element.axis)])
            yield shapes.bar(name, role, foot, foot + along * _barrel(element), (1.5 * unit, 1.5 * unit)).on(carrier)
        elif isinstance(element, (Curvilinear, Prismatic)):
            # Stages on stages: each smaller and thicker than the one below, so that all are seen where they coincide.
            edge, thick = (2.2 - 0.4 * stage) * unit, (0.5 + 0.2 * stage) * unit
            upright = isinstance(element, Prismatic) and abs(element.axis[2]) > 0.7
            yield shapes.block(name, role, centre, axes, (edge, edge, edge if upright else thick)).on(carrier + 1)
            stage += 1
        elif isinstance(element, Revolute):
            axis = np.array([float(c) for c in frame.direction(element.axis)])
            yield shapes.pin(name, role, centre, axis, 2.5 * unit, 0.9 * unit).on(carrier)
        elif isinstance(element, Universal):
            for arm, axis in enumerate(_cross(element, frame, coordinate)):
                yield shapes.pin(name, role, centre, axis, 2.2 * unit, 0.7 * unit).on(carrier + arm)
        elif isinstance(element, Spherical):
            yield shapes.ball(name, role, centre, 0.65 * unit).on(carrier)
        elif isinstance(element, Joint):
            raise TypeError(f"{type(element).__name__}: joints of this kind have no marker")


def _cross(joint: Universal, frame: Frame, coordinate: Coordinate) -> list[Array]:
    return [np.array([float(c) for c in twist.angular]) for twist in joint.freedoms(frame, coordinate, frame.origin)]


def _platform(machine: Machine, pose: Frame, unit: float) -> Iterator[Shape]:
    """The platform as its disc, or as the polygon of its joints; the tool; the workpiece."""
    platform, axes, centre = machine.platform, _axes(pose), _point(pose)
    if platform.disc is not None:
        angles = np.arange(36) * 2 * math.pi / 36
        rim = float(platform.disc.radius) * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
        thickness = float(platform.disc.thickness)
    else:
        rim = np.array([_point(leg.platform_frame()) for leg in machine.legs])
        rim, thickness = rim[np.argsort(np.arctan2(rim[:, 1], rim[:, 0]))], 0.3 * unit
    if len(rim) >= 3:
        yield shapes.plate("platform", "platform", centre + rim @ axes.T, axes[:, 2], thickness).on(PLATFORM)
    if platform.tool_tip is not None:
        tip = _point(pose.shift(platform.tool_tip))
        yield shapes.cone("tool", "tool", centre, tip, 0.8 * unit).on(PLATFORM)
    if machine.workpiece is not None:
        middle = np.array((0.0, 0.0, float(machine.workpiece.height)))
        yield shapes.dome("workpiece", "workpiece", middle, float(machine.workpiece.radius))


def _declared(machine: Machine, stands: list[tuple[Leg, list[Step]]], pose: Frame) -> Iterator[Shape]:
    """Shapes which the file gives to bodies, and fixtures; of meshes nothing is drawn."""
    given: list[tuple[str, Role, int, Frame, Any]] = []
    for (leg, steps), start in zip(stands, starts(machine), strict=True):
        for index, (element, frame, coordinate) in enumerate(steps):
            is_last = index == len(steps) - 1
            beyond = pose.place(leg.platform_frame()) if is_last else element.advance(frame, coordinate)
            carrier = start + 2 * index + 1
            given += [(f"{leg.name}.{element.name}", "link", carrier, beyond, own) for own in element.shapes or ()]
    given += [("platform", "tool", PLATFORM, pose, own) for own in machine.platform.shapes or ()]
    given += [(name, "ground", GROUND, IDENTITY, own) for name, shapes_ in machine.fixtures.items() for own in shapes_]
    for name, role, carrier, frame, own in given:
        yield from (shape.on(carrier) for shape in _solid(name, role, shape_in(own, frame)))


def _solid(name: str, role: Role, place: Any) -> Iterator[Shape]:
    if isinstance(place, Box):
        yield shapes.block(name, role, _point(place.frame), _axes(place.frame), tuple(2 * float(h) for h in place.half))  # type: ignore[arg-type]
    elif isinstance(place, Capsule):
        start, end, radius = (np.array([float(c) for c in v]) for v in (place.start, place.end, (place.radius,)))
        width = 2 * float(radius[0])
        if np.any(start != end):
            yield shapes.bar(name, role, start, end, (width, width))
        for centre in (start, end):
            yield shapes.ball(name, role, centre, width / 2)


def _triad(name: str, frame: Frame, reach: float) -> Iterator[Shape]:
    origin, thick = _point(frame), 0.035 * reach
    roles: tuple[Role, Role, Role] = ("x axis", "y axis", "z axis")
    for letter, role, column in zip("xyz", roles, _axes(frame).T, strict=True):
        neck = origin + 0.82 * reach * column
        yield shapes.bar(f"{{{name}}} {letter}", role, origin, neck, (thick, thick))
        yield shapes.cone(f"{{{name}}} {letter}", role, neck, origin + reach * column, 3 * thick)


def arrow(motion: Motion, pose: Frame, reach: float) -> Iterator[Shape]:
    """An arrow from the platform centre along a translation, or along the axis of a turn, past its point nearest to there."""
    start = _point(pose) if motion.point is None else motion.point - 0.6 * reach * motion.direction
    tip, head, thick = start + 1.2 * reach * motion.direction, 0.12 * reach * motion.direction, 0.04 * reach
    yield shapes.bar("motion", "motion", start, tip - head, (thick, thick))
    for end in (tip,) if motion.point is None else (tip, tip - head):
        yield shapes.cone("motion", "motion", end - head, end, 4 * thick)


def _once(found: list[Shape]) -> Iterator[Shape]:
    """One of several guides that coincide (the circle that all carriages share)."""
    seen: set[tuple[Any, ...]] = set()
    for shape in found:
        low, high = shape.rings.min(axis=(0, 1)), shape.rings.max(axis=(0, 1))
        key = (shape.role, shape.rings.shape, *np.round(np.concatenate([low, high]), 6).tolist())
        if shape.role != "guide" or key not in seen:
            yield shape
        seen.add(key)
