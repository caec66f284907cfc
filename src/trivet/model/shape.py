"""Shapes of bodies, by which it is told whether they touch."""

from __future__ import annotations

from typing import Annotated, Literal

import equinox as eqx
from pydantic import Field, StringConstraints

from trivet.model.quantity import Length, LengthOrZero, PositiveLength
from trivet.model.section import STRICT

Point = tuple[Length, Length, Length]


class Sphere(eqx.Module):
    """A sphere."""

    __pydantic_config__ = STRICT

    shape: Literal["sphere"] = eqx.field(static=True)
    radius: PositiveLength
    centre: Point = (0.0, 0.0, 0.0)
    """In the frame of its body."""


class Capsule(eqx.Module):
    """All points within a radius of a line from one point to another."""

    __pydantic_config__ = STRICT

    shape: Literal["capsule"] = eqx.field(static=True)
    start: Point
    """In the frame of its body."""
    end: Point
    """In the frame of its body."""
    radius: PositiveLength


class Box(eqx.Module):
    """A box with edges along the axes of its body."""

    __pydantic_config__ = STRICT

    shape: Literal["box"] = eqx.field(static=True)
    size: tuple[PositiveLength, PositiveLength, PositiveLength]
    """Along x, y and z."""
    centre: Point = (0.0, 0.0, 0.0)
    """In the frame of its body."""


class Mesh(eqx.Module):
    """The convex hull of a mesh file; a concave body takes several."""

    __pydantic_config__ = STRICT

    shape: Literal["mesh"] = eqx.field(static=True)
    file: Annotated[str, StringConstraints(min_length=1, max_length=1000)] = eqx.field(static=True)
    """STL, OBJ or PLY; where the machine file is, unless the path says otherwise."""
    unit: Literal["mm", "m"] = eqx.field(static=True)
    """Unit of the file's coordinates, which are in the frame of its body."""
    centre: Point = (0.0, 0.0, 0.0)
    """Where the file's origin lies, in the frame of its body."""


AnyShape = Annotated[Sphere | Capsule | Box | Mesh, Field(discriminator="shape")]

Shapes = Annotated[tuple[AnyShape, ...], Field(max_length=100)]

Touching = Annotated[tuple[str, str], Field(description="Names of two bodies.")]


class Interference(eqx.Module):
    """Which bodies may touch, and how far the others must be apart."""

    __pydantic_config__ = STRICT

    clearance: LengthOrZero = 0.0
    """Least distance of bodies that must not touch."""
    may_touch: Annotated[tuple[Touching, ...], Field(max_length=1000)] = eqx.field(static=True, default=())
    """Pairs that need not be looked at: "leg.link" (of one copy "leg-1.link"), "platform", "workpiece" or a fixture's name."""
