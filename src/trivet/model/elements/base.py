"""What all elements share."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from pydantic import BeforeValidator, Field, PlainSerializer, StrictBool, StringConstraints, WithJsonSchema
from pydantic_core import PydanticCustomError

from trivet.model.mass import RigidMass, Rod
from trivet.model.quantity import Inertia, Length, Mass, Ratio, RotationalStiffness, Stiffness
from trivet.model.section import STRICT, Material, Section
from trivet.model.shape import Shapes
from trivet.space.frame import Angle, Frame
from trivet.space.scalar import Scalar, cosine, sine
from trivet.space.screw import Twist, rotation, translation
from trivet.space.tensor import diagonal
from trivet.space.vector import Vec

NAME_PATTERN = r"^[a-z][a-z0-9_-]{0,39}$"
Name = Annotated[str, StringConstraints(pattern=NAME_PATTERN)]
"""A name in a machine file: lower case, as it appears in key paths and tables."""

Direction = tuple[float, float, float]

_LETTERS: dict[str, Direction] = {
    "x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0), "-z": (0.0, 0.0, -1.0),
}  # fmt: skip


def _read_axis(value: Any) -> Any:
    if isinstance(value, str):
        if value in _LETTERS:
            return _LETTERS[value]
    elif isinstance(value, (list, tuple)) and len(value) == 3 and all(type(v) in (int, float) for v in value):
        direction = _normalised(value)
        if direction is not None:
            return direction
    known = ", ".join(_LETTERS)
    raise PydanticCustomError("axis", "expected an axis: one of {known}, or three numbers not all zero", {"known": known})


def _normalised(value: Sequence[float]) -> Direction | None:
    largest = max(abs(v) for v in value)
    if not 0 < largest <= sys.float_info.max or any(v != v for v in value):
        return None
    x, y, z = (v / largest for v in value)  # so that squares neither overflow nor vanish
    length = math.hypot(x, y, z)
    # Once normalised, an axis stays as it is, so that writing and reading change nothing.
    if abs(length * largest - 1) < 1e-15:
        return (float(value[0]), float(value[1]), float(value[2]))
    return (x / length, y / length, z / length)


def _write_axis(value: Direction) -> str | list[float]:
    return next((letter for letter, axis in _LETTERS.items() if axis == value), list(value))


Axis = Annotated[
    Direction,
    BeforeValidator(_read_axis),
    PlainSerializer(_write_axis),
    WithJsonSchema({
        "x-kind": 'an axis of the frame at this place of the chain, one of "x", "y", "z", "-x", "-y", "-z", or three numbers',
        "anyOf": [{"enum": list(_LETTERS)}, {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}],
    }),
]  # fmt: skip


class Stock(eqx.Module):
    """What elements refer to by name: the machine's sections and materials; and the beam theory."""

    sections: dict[str, Section]
    materials: dict[str, Material]
    theory: Literal["euler-bernoulli", "timoshenko"] = eqx.field(static=True)
    rotary_inertia: bool = eqx.field(static=True, default=True)


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
    part: Literal["drive", "joint", "bearing", "beam"]
    """What yields: the drive of an actuated joint, a joint that is not actuated, what guides a joint, or a beam."""


class Element(eqx.Module):
    """A joint or a body of a chain."""

    __pydantic_config__ = STRICT

    COORDINATES: ClassVar[tuple[Literal["length", "angle"], ...]] = ()
    """Its coordinates in order: length (m) or angle (`Angle` to the kernels); `advance` takes one bare, several as a tuple."""

    # Described by Field, since pydantic does not hand on docstrings to the elements themselves.
    name: Annotated[Name, Field(description="Name of this joint or body; key paths and messages use it.")] = eqx.field(
        static=True
    )

    shapes: Annotated[
        Shapes | None,
        Field(
            description="What of it can touch other bodies, in the frame beyond it; when not given its beam, or the part of a "
            "slide's beam that is out."
        ),
    ] = eqx.field(default=None, kw_only=True)

    @property
    def unknowns(self) -> tuple[Literal["length", "angle"], ...]:
        """Its coordinates that are free: all, or none of a locked joint."""
        return self.COORDINATES

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

    def weigh(self, stock: Stock) -> RigidMass:
        """What this element weighs, in the frame beyond it."""
        return RigidMass.none() if self.rod is None else self.rod.weigh(stock)

    @property
    def rod(self) -> Rod | None:
        """The rod which this element is, or which moves with it; None where there is none."""
        return None

    @property
    def limits(self) -> tuple[Scalar, Scalar] | None:
        """Lower and upper limit on the scale on which a joint is compared with its travel (`kinematics.travel.Gauge`)."""
        return None

    @property
    def axis_of_body(self) -> Direction | None:
        """Direction, in the frame at this element, along which its body extends; None when it has no length."""
        return None


class Bearing(eqx.Module):
    """How what guides a joint gives way across its freedom, along the axes of the frame; rigid where nothing is given."""

    __pydantic_config__ = STRICT

    x: Stiffness | None = None
    """Stiffness along x."""
    y: Stiffness | None = None
    """Stiffness along y."""
    z: Stiffness | None = None
    """Stiffness along z."""
    rx: RotationalStiffness | None = None
    """Stiffness about x."""
    ry: RotationalStiffness | None = None
    """Stiffness about y."""
    rz: RotationalStiffness | None = None
    """Stiffness about z."""

    def flexibilities(self, frame: Frame, at: Vec) -> tuple[Flexibility, ...]:
        """Compliances at the origin of a frame, along its axes."""
        straight = [(rate, translation(axis)) for rate, axis in zip((self.x, self.y, self.z), frame[1:], strict=True)]
        about = [
            (rate, rotation(axis, frame.origin, at)) for rate, axis in zip((self.rx, self.ry, self.rz), frame[1:], strict=True)
        ]
        return tuple(Flexibility(1 / rate, twist, "bearing") for rate, twist in (*straight, *about) if rate is not None)


class Joint(Element):
    """A joint; its moving part may carry a lumped mass (carriage, slider, ball)."""

    mass: Annotated[Mass | None, Field(description="Lumped mass that moves with the joint.")] = eqx.field(
        default=None, kw_only=True
    )
    centre_of_mass: Annotated[
        tuple[Length, Length, Length] | None,
        Field(description="Where the lumped mass has its centre, in the frame beyond the joint; its origin when not given."),
    ] = eqx.field(default=None, kw_only=True)
    inertia: Annotated[
        tuple[Inertia, Inertia, Inertia] | None,
        Field(description="Principal moments of inertia of the lumped mass about its centre, along the axes beyond the joint."),
    ] = eqx.field(default=None, kw_only=True)
    bearing: Annotated[
        Bearing | None, Field(description="Stiffness of the bearing across the joint's freedom; rigid when not given.")
    ] = eqx.field(default=None, kw_only=True)
    loss_factor: Annotated[
        Ratio | None,
        Field(
            description="Structural damping eta of the joint's stiffnesses, k (1 + i eta); that of the analysis when not given."
        ),
    ] = eqx.field(default=None, kw_only=True)

    @property
    def lump(self) -> RigidMass:
        """The lumped mass which moves with the joint, in the frame beyond it."""
        if self.mass is None:
            return RigidMass.none()
        return RigidMass.centred(self.mass, Vec(*(self.centre_of_mass or (0, 0, 0))), diagonal(*(self.inertia or (0, 0, 0))))

    def weigh(self, stock: Stock) -> RigidMass:
        return self.lump if self.rod is None else self.lump.plus(self.rod.weigh(stock))

    def bearing_flexibilities(self, frame: Frame, coordinate: Any, at: Vec) -> tuple[Flexibility, ...]:
        """Compliances of the bearing, in the frame at the joint."""
        return () if self.bearing is None else self.bearing.flexibilities(frame, at)

    damping: eqx.AbstractVar[float | None]
    friction: eqx.AbstractVar[float | None]

    @property
    def viscosity(self) -> float | None:
        """Viscous damping along the twist on which the joint moves or yields (N s/m or N m s/rad); None where it has none."""
        return self.damping

    @property
    def lever(self) -> Scalar:
        """Length of the path along which damping, friction and reflected inertia are told, per unit of the coordinate."""
        return 1


class Drivable(Joint):
    """A joint of one freedom, which a drive may move."""

    actuated: Annotated[StrictBool, Field(description="Whether a drive moves the joint.")] = eqx.field(
        static=True, default=False, kw_only=True
    )
    travel: eqx.AbstractVar[tuple[float, float] | None]
    stiffness: eqx.AbstractVar[float | None]
    reflected_inertia: eqx.AbstractVar[float | None]
    locked: eqx.AbstractVar[float | None]

    @property
    def is_driven(self) -> bool:
        """Whether a drive moves the joint while the machine works: actuated, and not locked."""
        return self.actuated and self.locked is None

    @property
    def unknowns(self) -> tuple[Literal["length", "angle"], ...]:
        return self.COORDINATES if self.locked is None else ()

    def freedoms(self, frame: Frame, coordinate: Any, at: Vec) -> tuple[Twist, ...]:
        return (self.motion(frame, at),) if self.locked is None else ()

    def motion(self, frame: Frame, at: Vec) -> Twist:
        """The unit twist of the joint, whether it is locked or not."""
        raise NotImplementedError

    @property
    def is_angular(self) -> bool:
        """Whether the coordinate is an angle (rad); else it is a length (m)."""
        return self.COORDINATES == ("angle",)

    @property
    def unit(self) -> Literal["m", "rad"]:
        """Unit of the coordinate."""
        return "rad" if self.is_angular else "m"

    @property
    def force_unit(self) -> Literal["N", "N m"]:
        """Unit of the force or moment that does work on the coordinate."""
        return "N m" if self.is_angular else "N"

    def number(self, coordinate: Any) -> Scalar:
        """A coordinate as one number, m, or rad in (-pi, pi]."""
        return jnp.arctan2(coordinate.sin, coordinate.cos) if self.is_angular else coordinate

    def coordinate(self, number: Scalar) -> Scalar:
        """The coordinate that a number (m or rad) stands for, as a walk takes it."""
        return Angle(cosine(number), sine(number)) if self.is_angular else number

    @property
    def limits(self) -> tuple[Scalar, Scalar] | None:
        return self.travel

    @property
    def part(self) -> Literal["drive", "joint"]:
        """What its stiffness is the stiffness of."""
        return "drive" if self.actuated else "joint"

    def slack(self, frame: Frame, coordinate: Any, at: Vec) -> tuple[Twist, ...]:
        held = self.actuated or self.locked is not None or self.stiffness is not None
        return () if held else self.freedoms(frame, coordinate, at)


class Body(Element):
    """A body without freedom."""
