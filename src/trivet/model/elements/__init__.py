"""The elements of a chain, one file each.

Joints are curvilinear, prismatic, revolute, spherical or universal; bodies are beams or offsets.

An element is declared data (its TOML keys with units) plus a small kernel on the frames of the walk down the chain:

- `advance(frame, coordinate)`: the frame beyond the element;
- `freedoms(frame, coordinate, at)`: the twists which the joint allows, in the order of its coordinates;
- `slack(frame, coordinate, at)`: those of them which transmit no wrench (passive and without stiffness);
- `flexibilities(frame, coordinate, at, stock)`: compliances, each with the twist along which it yields.

All twists are reduced at the point `at` and written in the axes in which the frame is written.
"""

from __future__ import annotations

import dataclasses
import typing
from typing import Annotated

import equinox as eqx
from pydantic import Field

from trivet.model.elements.base import Body, Drivable, Element, Flexibility, Joint, Profile, Stock
from trivet.model.elements.beam import Beam
from trivet.model.elements.curvilinear import Curvilinear
from trivet.model.elements.offset import Offset
from trivet.model.elements.prismatic import Prismatic
from trivet.model.elements.revolute import Revolute
from trivet.model.elements.socket import Neutral, Socket
from trivet.model.elements.spherical import Spherical
from trivet.model.elements.universal import Universal

AnyElement = Annotated[Curvilinear | Prismatic | Revolute | Spherical | Universal | Beam | Offset, Field(discriminator="type")]


def _tables(hint: object) -> frozenset[str]:
    """The keys of the table that a value of this type is, if it is one."""
    inner = typing.get_args(hint)
    if inner:
        return frozenset().union(*(_tables(one) for one in inner))
    if not (isinstance(hint, type) and issubclass(hint, eqx.Module)):
        return frozenset()
    return frozenset(field.name for field in dataclasses.fields(hint))


KEYS: dict[str, frozenset[str]] = {
    key: _tables(hint)
    for kind in typing.get_args(typing.get_args(AnyElement)[0])
    for key, hint in typing.get_type_hints(kind).items()
    if key in {field.name for field in dataclasses.fields(kind)}
}
"""Every key that an element of some type may have; with the keys of the table that it is, where it is one."""

__all__ = [
    "KEYS", "AnyElement", "Beam", "Body", "Curvilinear", "Drivable", "Element", "Flexibility", "Joint", "Neutral", "Offset",
    "Prismatic", "Profile", "Revolute", "Socket", "Spherical", "Stock", "Universal",
]  # fmt: skip
