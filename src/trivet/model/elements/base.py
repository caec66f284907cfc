"""What all elements share."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import equinox as eqx
from pydantic import BeforeValidator, PlainSerializer, StringConstraints, WithJsonSchema
from pydantic_core import PydanticCustomError

from trivet.model.quantity import Mass
from trivet.model.section import STRICT, Material, Section
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist
from trivet.space.vector import Vec

Name = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_-]{0,39}$")]
"""A name in a machine file: lower case, as it appears in key paths and tables."""

Direction = tuple[float, float, float]

_LETTERS: dict[str, Direction] = {
    f"{sign}{letter}": tuple((-1.0 if sign else 1.0) if k == i else 0.0 for k in range(3))  # type: ignore[misc]
    for i, letter in enumerate("xyz")
    for sign in ("", "-")
}


def _read_axis(value: Any) -> Any:
    if isinstance(value, str):
        if value in _LETTERS:
            return _LETTERS[value]
        raise PydanticCustomError("axis", "expected an axis: one of {known}, or three numbers", {"known": ", ".join(_LETTERS)})
    if isinstance(value, (list, tuple)) and len(value) == 3 and all(type(v) in (int, float) for v in value):
        length = sum(float(v) ** 2 for v in value) ** 0.5
        if 0 < length < float("inf"):
            return tuple(float(v) / length if length != 1 else float(v) for v in value)
    raise PydanticCustomError("axis", "expected an axis: one of x, y, z, -x, -y, -z, or three numbers not all zero", {})


def _write_axis(value: Direction) -> str | list[float]:
    letters = {v: k for k, v in _LETTERS.items()}
    return letters.get(tuple(value), list(value))  # type: ignore[call-overload, no-any-return]


Axis = Annotated[
    Direction,
    BeforeValidator(_read_axis),
    PlainSerializer(_write_axis),
    WithJsonSchema({
        "description": "an axis of the frame at this place of the chain: x radially outward, y tangential, z up at zero joint values",
        "anyOf": [{"enum": list(_LETTERS)}, {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}],
    }),
]  # fmt: skip


class Stock(eqx.Module):
    """What elements refer to by name: the machine's sections and materials, and the beam theory."""

    sections: dict[str, Section]
    materials: dict[str, Material]
    theory: Literal["euler-bernoulli", "timoshenko"] = eqx.field(static=True)


class Profile(eqx.Module):
    """Section and material of a beam, by name."""

    __pydantic_config__ = STRICT

    section: str = eqx.field(static=True)
    """Name of an entry of [sections]."""
    material: str = eqx.field(static=True)
    """Name of an entry of [materials], or of a material that trivet knows."""


class Flexibility(NamedTuple):
    """A compliance (m/N for a translation, rad/(N m) for a rotation) with the unit twist along which it yields."""

    compliance: Scalar
    twist: Twist


class Element(eqx.Module):
    """A joint or a body of a chain."""

    __pydantic_config__ = STRICT

    COORDINATES: ClassVar[tuple[Literal["length", "angle"], ...]] = ()
    """Its coordinates in order: a length (m) or an angle (an `Angle` to the kernels); `advance` takes one bare, several as a tuple."""

    name: Name = eqx.field(static=True)

    def advance(self, frame: Frame, coordinate: Any) -> Frame:
        """The frame beyond this element."""
        raise NotImplementedError

    def freedoms(self, frame: Frame, coordinate: Any, at: Vec) -> tuple[Twist, ...]:
        """Twists which this element allows, one per coordinate."""
        return ()

    def slack(self, frame: Frame, coordinate: Any, at: Vec) -> tuple[Twist, ...]:
        """Freedoms which transmit no wrench."""
        return ()

    def flexibilities(self, frame: Frame, coordinate: Any, at: Vec, stock: Stock) -> tuple[Flexibility, ...]:
        """Compliances of this element."""
        return ()

    @property
    def axis_of_body(self) -> Direction | None:
        """Direction, in the frame at this element, along which its body extends; None when it has no length."""
        return None


class Joint(Element):
    """A joint; its moving part may carry a lumped mass (carriage, slider, ball)."""

    mass: Mass | None = eqx.field(default=None, kw_only=True)
    """Lumped mass that moves with the joint."""


class Body(Element):
    """A body without freedom."""
