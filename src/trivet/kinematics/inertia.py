"""What bodies weigh: mass, centre of mass and inertia of beams, joints, offsets and the platform."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from trivet.kinematics.walk import Coordinate
from trivet.model import Machine
from trivet.model.elements import Beam, Element, Joint, Offset, Prismatic, Profile, Stock
from trivet.model.elements.base import Direction
from trivet.model.elements.beam import along, beam_axes
from trivet.space.frame import Frame
from trivet.space.vector import Vec

Array: TypeAlias = Any


class RigidMass(NamedTuple):
    """A mass (kg), its centre (3,) (m) and its inertia (3, 3) about that centre (kg m^2), in the axes of some body."""

    mass: float
    centre: Array
    inertia: Array

    def times(self, factor: float) -> RigidMass:
        """The same shape, heavier by a factor."""
        return RigidMass(self.mass * factor, self.centre, self.inertia * factor)

    def seen_from(self, frame: Frame) -> RigidMass:
        """The same in the axes of a frame, which is given in the present axes."""
        axes = np.array(frame.matrix(), dtype=float)
        return RigidMass(self.mass, axes.T @ (self.centre - _array(frame.origin)), axes.T @ self.inertia @ axes)


class Bar(NamedTuple):
    """A straight beam: the frame in which it starts, its direction there, its length (m; below zero it runs the other way)."""

    start: Frame
    axis: Direction
    length: float
    profile: Profile

    @property
    def middle(self) -> Vec:
        """Its middle."""
        return along(self.start, self.axis, self.length / 2).origin


def together(parts: Iterable[RigidMass]) -> RigidMass:
    """What parts weigh as one rigid body (Steiner)."""
    present = [part for part in parts if part.mass > 0]
    if not present:
        return RigidMass(0.0, np.zeros(3), np.zeros((3, 3)))
    mass = sum(part.mass for part in present)
    centre = sum(part.mass * part.centre for part in present) / mass
    inertia = np.zeros((3, 3))
    for part in present:
        arm = part.centre - centre
        inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return RigidMass(mass, centre, inertia)


def bar_of(element: Element, coordinate: Coordinate, beyond: Frame) -> Bar | None:
    """The beam that ends in the frame beyond an element: a link, or the extended part of a slide (coordinate in m)."""
    if isinstance(element, Beam):
        axis, length, profile = element.axis, float(element.length), element.profile
    elif isinstance(element, Prismatic) and element.beam is not None:
        axis, length, profile = element.axis, float(coordinate), element.beam
    else:
        return None
    return Bar(along(beyond, axis, -length), axis, length, profile)


def element_mass(element: Element, coordinate: Coordinate, beyond: Frame, stock: Stock) -> Iterator[RigidMass]:
    """What an element weighs, in the axes in which the frame beyond it is written."""
    if isinstance(element, Joint):
        yield from joint_mass(element, beyond)
    if isinstance(element, Offset) and element.mass is not None:
        x, y, z = element.vector
        for frame in (beyond.shift((-x, -y, -z)), beyond):
            yield _point(element.mass / 2, frame.origin)
    bar = bar_of(element, coordinate, beyond)
    if bar is not None:
        yield _bar_mass(bar, stock)


def joint_mass(joint: Joint, beyond: Frame) -> Iterator[RigidMass]:
    """The lump which moves with a joint, in the axes in which the frame beyond it is written."""
    if joint.mass is not None:
        axes = np.array(beyond.matrix(), dtype=float)
        centre = beyond.shift(joint.centre_of_mass or (0, 0, 0)).origin
        moments = np.diag(np.array(joint.inertia or (0, 0, 0), dtype=float))
        yield RigidMass(float(joint.mass), _array(centre), axes @ moments @ axes.T)


def platform_mass(machine: Machine) -> RigidMass:
    """The platform in the axes of {E}: without mass when the machine gives none, a point when it gives no inertia."""
    platform = machine.platform
    mass, inertia = float(platform.mass or 0), np.diag(np.array(platform.inertia or (0, 0, 0), dtype=float))
    if platform.products_of_inertia is not None:
        for (i, j), product in zip(((0, 1), (0, 2), (1, 2)), platform.products_of_inertia, strict=True):
            inertia[i, j] = inertia[j, i] = float(product)
    if platform.disc is not None:
        radius, thickness = float(platform.disc.radius), float(platform.disc.thickness)
        mass = math.pi * radius**2 * thickness * float(machine.materials[platform.disc.material].density)
        across = mass * (3 * radius**2 + thickness**2) / 12
        inertia = np.diag([across, across, mass * radius**2 / 2])
    return RigidMass(mass, _array(Vec(*(platform.centre_of_mass or (0, 0, 0)))), inertia)


def _array(vector: Vec) -> Array:
    return np.array([float(c) for c in vector])


def _point(mass: float, at: Vec) -> RigidMass:
    return RigidMass(float(mass), _array(at), np.zeros((3, 3)))


def _bar_mass(bar: Bar, stock: Stock) -> RigidMass:
    """A uniform rod, with what its cross-section adds to the inertia of a thin one."""
    material = stock.materials[bar.profile.material]
    section = stock.sections[bar.profile.section].properties(material.poisson_ratio)
    length, density = abs(bar.length), float(material.density)
    mass = density * float(section.area) * length
    y, z, thin = density * length * float(section.inertia_y), density * length * float(section.inertia_z), mass * length**2 / 12
    axes = np.stack([_array(v) for v in beam_axes(bar.start, bar.axis)], axis=1)
    return RigidMass(mass, _array(bar.middle), axes @ np.diag([y + z, thin + y, thin + z]) @ axes.T)
