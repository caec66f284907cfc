"""Beam: a straight elastic link of fixed length; and the flexibility of any straight beam."""

from __future__ import annotations

import math
from typing import Literal

import equinox as eqx
import jax.numpy as jnp

from trivet.model.elements.base import Axis, Body, Direction, Flexibility, Profile, Stock
from trivet.model.mass import Rod
from trivet.model.quantity import PositiveLength
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import rotation, translation
from trivet.space.vector import Vec


class Beam(Body):
    """A straight elastic link of fixed length."""

    type: Literal["beam"] = eqx.field(static=True)
    axis: Axis = eqx.field(static=True)
    """Direction in which the link runs."""
    length: PositiveLength
    """Length of the link."""
    section: str = eqx.field(static=True)
    """Name of an entry of [sections]."""
    material: str = eqx.field(static=True)
    """Name of an entry of [materials], or of a material that trivet knows."""

    @property
    def profile(self) -> Profile:
        """Section and material."""
        return Profile(self.section, self.material)

    @property
    def rod(self) -> Rod:
        return Rod(self.axis, -self.length, 0, self.profile)

    @property
    def axis_of_body(self) -> Direction:
        return self.axis

    def advance(self, frame: Frame, coordinate: None = None) -> Frame:
        return along(frame, self.axis, self.length)

    def flexibilities(self, frame: Frame, coordinate: None, at: Vec, stock: Stock) -> tuple[Flexibility, ...]:
        return beam_flexibilities(frame, self.axis, self.length, self.profile, at, stock)


def along(frame: Frame, axis: Direction, distance: Scalar) -> Frame:
    """The frame moved along one of its own directions (m)."""
    return frame._replace(origin=frame.origin + frame.direction(axis) * distance)


def beam_axes(frame: Frame, axis: Direction) -> tuple[Vec, Vec, Vec]:
    """Local axes of a beam along a direction of a frame: x along it, y nearest to the frame's y (its z for a beam along y)."""
    towards = (0.0, 0.0, 1.0) if abs(axis[1]) == 1 else (0.0, 1.0, 0.0)
    overlap = sum(a * b for a, b in zip(axis, towards, strict=True))
    across = [b - overlap * a for a, b in zip(axis, towards, strict=True)]
    size = math.sqrt(sum(c * c for c in across))
    x, y = frame.direction(axis), frame.direction((across[0] / size, across[1] / size, across[2] / size))
    return x, y, x.cross(y)


def beam_flexibilities(
    frame: Frame, axis: Direction, length: Scalar, profile: Profile, at: Vec, stock: Stock
) -> tuple[Flexibility, ...]:
    """Six flexibilities of a straight uniform beam that starts in a frame; a negative length runs the other way, zero is rigid.

    A uniform beam that is held at one end and loaded at the other yields, seen from its middle, along six uncoupled twists:
    L/EA along its axis, L^3/12EI (+ L/GA_s for a Timoshenko beam) across it, L/GJ about its axis and L/EI about the others.
    Carried to the end these are the textbook end compliances L^3/3EI, L^2/2EI and L/EI.
    """
    material = stock.materials[profile.material]
    section = stock.sections[profile.section].properties(material.poisson_ratio)
    young, shear = material.youngs_modulus, material.shear_modulus
    x, y, z = beam_axes(frame, axis)
    middle = frame.origin + x * (length * 0.5)
    span = jnp.abs(length)
    # Reciprocals of what the length does not touch: in a batch they are computed once, and divisions are dear.
    bend_y, bend_z = span * (1 / (young * section.inertia_y)), span * (1 / (young * section.inertia_z))
    sway_y, sway_z = span * span * bend_z * (1 / 12), span * span * bend_y * (1 / 12)
    if stock.theory == "timoshenko":
        sway_y = sway_y + span * (1 / (shear * section.shear_area_y))
        sway_z = sway_z + span * (1 / (shear * section.shear_area_z))
    return (
        Flexibility(span * (1 / (young * section.area)), translation(x), "beam"),
        Flexibility(sway_y, translation(y), "beam"),
        Flexibility(sway_z, translation(z), "beam"),
        Flexibility(span * (1 / (shear * section.torsion)), rotation(x, middle, at), "beam"),
        Flexibility(bend_y, rotation(y, middle, at), "beam"),
        Flexibility(bend_z, rotation(z, middle, at), "beam"),
    )
