"""The machine: one description of which everything is derived.

A `Machine` is a JAX pytree.  Every dimension is a leaf (float in SI), so any result can be differentiated with respect to any
of them; the topology is static.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Annotated, Literal, NamedTuple, TypeVar

import equinox as eqx
from pydantic import Field, StrictBool, StringConstraints, TypeAdapter

from trivet.errors import InputError, nearest
from trivet.model.elements import AnyElement, Curvilinear, Drivable, Element, Spherical, Stock
from trivet.model.elements.base import Name
from trivet.model.quantity import (
    AngleValue,
    Inertia,
    Length,
    LengthOrZero,
    Mass,
    PositiveLength,
    ProductOfInertia,
    Stiffness,
    StiffnessVariance,
)
from trivet.model.section import STRICT, Material, Section
from trivet.model.shape import Interference, Shapes
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar, cosine, sine

MOST_COPIES = 24
_T = TypeVar("_T")

Status = Literal["given", "fitted", "assumed"]
"""How sure a number is: stated by its source, fitted to published results, or assumed."""


@dataclass(frozen=True)
class Published:
    """Published statistics of a stiffness over the machine's workpiece, to be printed beside our own."""

    __pydantic_config__ = STRICT

    source: Annotated[str, StringConstraints(min_length=1)]
    """Where it is published."""
    quantity: Literal["K_xx", "K_yy", "K_zz"]
    """Which stiffness."""
    mean: Stiffness
    """Arithmetic mean over the check points."""
    variance: StiffnessVariance | None = None
    """Population variance over the check points."""


@dataclass(frozen=True)
class PublishedDynamic:
    """A published minimum dynamic stiffness at home, to be printed beside our own."""

    __pydantic_config__ = STRICT

    source: Annotated[str, StringConstraints(min_length=1)]
    """Where it is published."""
    quantity: Literal["D_xx", "D_yy", "D_zz"]
    """Along which axis of {O} the platform centre is excited and moves."""
    minimum: Stiffness
    """Minimum over frequency of the force per displacement, 1/|H_jj|."""


@dataclass(frozen=True)
class Note:
    """Where a number comes from."""

    path: str
    source: str = ""
    status: Status = "given"


@dataclass(frozen=True)
class About:
    """Words about a machine.  They take no part in comparison: two machines of one topology share compiled kernels."""

    __pydantic_config__ = STRICT

    name: Name = field(compare=False)
    """Name of the machine."""
    title: str = field(default="", compare=False)
    """One line that says what it is."""
    description: str = field(default="", compare=False)
    """What there is to say about it."""
    source: str = field(default="", compare=False)
    """Source of every number that has none of its own."""
    published: tuple[Published, ...] = field(default=(), compare=False)
    """Published static stiffnesses to be printed beside ours."""
    published_dynamic: tuple[PublishedDynamic, ...] = field(default=(), compare=False)
    """Published dynamic stiffnesses to be printed beside ours."""
    notes: tuple[Note, ...] = field(default=(), compare=False)
    """Sources of single numbers; written beside the numbers in the file."""


class Base(eqx.Module):
    """Where a chain stands: the frame of its first joint is turned by the azimuth about z, then moved out and up."""

    __pydantic_config__ = STRICT

    azimuth: AngleValue = 0.0
    """Angle about z."""
    radius: LengthOrZero | None = None
    """Distance from the z axis; zero when not given."""
    height: Length | None = None
    """Height above the base plane; zero when not given."""


class PlatformJoint(eqx.Module):
    """Where a chain ends, in the platform frame {E}; its frame there is turned by the azimuth about z_E."""

    __pydantic_config__ = STRICT

    radius: LengthOrZero
    """Distance from the z_E axis."""
    azimuth: AngleValue = 0.0
    """Angle about z_E."""
    height: Length | None = None
    """Height above the platform's x-y plane; zero when not given."""


class Chain(eqx.Module):
    """A kinematic chain, from the ground to the platform, repeated by rotation about z."""

    __pydantic_config__ = STRICT

    platform_joint: PlatformJoint
    """Where the chain ends on the platform."""
    elements: Annotated[tuple[AnyElement, ...], Field(min_length=2, max_length=24)]
    """Joints and bodies in order, the first joint on the ground and the last one on the platform."""
    copies: Annotated[int, Field(strict=True, ge=1, le=MOST_COPIES)] = eqx.field(static=True, default=1)
    """How many such chains stand around the z axis, equally spaced."""
    base: Base | None = None
    """Where the chain stands; not needed by a chain that starts on a circular guide about z."""


class Disc(eqx.Module):
    """A homogeneous round plate about the platform centre, which gives the platform its mass."""

    __pydantic_config__ = STRICT

    radius: PositiveLength
    thickness: PositiveLength
    material: str = eqx.field(static=True)
    """Name of an entry of [materials], or of a material that trivet knows."""


class Platform(eqx.Module):
    """The rigid moving platform; its frame {E} has its origin in the platform centre and z_E along the platform normal."""

    __pydantic_config__ = STRICT

    disc: Disc | None = None
    """Shape from which the mass is derived; the platform has no mass when neither this nor `mass` is given."""
    mass: Mass | None = None
    """Mass, instead of a disc."""
    inertia: tuple[Inertia, Inertia, Inertia] | None = None
    """Moments of inertia I_xx, I_yy, I_zz about the centre of mass, along the axes of {E}; with `mass`."""
    products_of_inertia: tuple[ProductOfInertia, ProductOfInertia, ProductOfInertia] | None = None
    """Off-diagonal entries I_xy, I_xz, I_yz of the inertia matrix (minus the integrals of xy, xz, yz); with `inertia`."""
    centre_of_mass: tuple[Length, Length, Length] | None = None
    """In {E}; the platform centre when not given."""
    tool_tip: tuple[Length, Length, Length] | None = None
    """In {E}; the platform centre when not given."""
    shapes: Shapes | None = None
    """What of it, and of its tool, can touch other bodies, in {E}; the box around its disc when not given."""


class Home(eqx.Module):
    """The home pose, and the working mode in which the machine is assembled."""

    __pydantic_config__ = STRICT

    position: tuple[Length, Length, Length]
    """Platform centre in {O}."""
    azimuth: AngleValue = 0.0
    """alpha of R = Rz(alpha) Ry(beta) Rz(gamma)."""
    tilt: AngleValue = 0.0
    """beta."""
    roll: AngleValue = 0.0
    """gamma."""
    mode: Annotated[str, StringConstraints(pattern=r"^[+\- ]*$", max_length=100)] = eqx.field(static=True, default="")
    """Working mode, one group of signs per chain ("++ +- ++"); all plus when not given."""


class Workpiece(eqx.Module):
    """The hemisphere over which machines are compared; its centre lies on the z axis."""

    __pydantic_config__ = STRICT

    height: Length
    """Height of its centre above {O}, z0."""
    radius: PositiveLength


class Machine(eqx.Module):
    """A parallel kinematic machine: platform, chains, and what they are made of; lengths in m, forces in N, angles in rad."""

    __pydantic_config__ = STRICT

    about: About = eqx.field(static=True)
    """Name, title and sources."""
    platform: Platform
    """The moving platform."""
    chains: Annotated[dict[Name, Chain], Field(min_length=1, max_length=MOST_COPIES)]
    """Kinematic chains by name."""
    home: Home
    """The home pose."""
    sections: dict[Name, Annotated[Section, Field(discriminator="shape")]] = eqx.field(default_factory=dict)
    """Beam sections by name."""
    materials: dict[Name, Material] = eqx.field(default_factory=dict)
    """Materials by name; those that trivet knows need not be given."""
    workpiece: Workpiece | None = None
    """The hemisphere over which the machine is compared with others."""
    fixtures: dict[Name, Shapes] = eqx.field(default_factory=dict)
    """What stands on the ground beside the machine, by name, in {O}: frame, table, vice."""
    interference: Interference | None = None
    """Which bodies may touch, and how far the others must be apart."""
    theory: Literal["euler-bernoulli", "timoshenko"] = eqx.field(static=True, default="euler-bernoulli")
    """Beam theory: without or with shear deflection."""
    rotary_inertia: StrictBool = eqx.field(static=True, default=True)
    """Whether the cross-sections of vibrating beams have rotary inertia."""
    format: Literal[1] = eqx.field(static=True, default=1)
    """Version of the file format."""

    def __repr__(self) -> str:
        return f"<Machine {self.name}: {self.about.title}>"

    @property
    def name(self) -> str:
        """Name of the machine."""
        return self.about.name

    @property
    def stock(self) -> Stock:
        """Sections, materials and beam theory."""
        return Stock(self.sections, self.materials, self.theory, self.rotary_inertia)

    @property
    def apart(self) -> Interference:
        """How far bodies must be apart."""
        return Interference() if self.interference is None else self.interference

    @property
    def mechanism(self) -> Mechanism:
        """What kernels need of the machine."""
        return Mechanism(self.legs, self.stock)

    @property
    def legs(self) -> tuple[Leg, ...]:
        """The chains one by one: "leg-1", "leg-2", … for the copies of the chain "leg"."""
        return tuple(self._legs())

    @property
    def legs_unnamed(self) -> tuple[Leg, ...]:
        """The chains as kernels take them."""
        return tuple(leg.unnamed for leg in self._legs())

    def _legs(self) -> Iterator[Leg]:
        for name, chain in sorted(self.chains.items()):  # the order in which JAX rebuilds a dict
            for copy in range(chain.copies):
                yield Leg.standing(chain, copy_rotation(chain, copy), f"{name}-{copy + 1}" if chain.copies > 1 else name)

    @property
    def characteristic_length(self) -> Scalar:
        """Mean radius of the platform joints (m), by which rotations are made comparable with translations."""
        chains = self.chains.values()
        return sum(chain.copies * chain.platform_joint.radius for chain in chains) / sum(chain.copies for chain in chains)

    def renamed(self, name: str) -> Machine:
        """The machine under another name in tables; published values, which speak of the original, are left behind."""
        return _replace(self, about=_replace(self.about, name=name, published=(), published_dynamic=()))

    def with_spherical(self, rotation: Literal["free", "clamped"] | float) -> Machine:
        """The machine with every spherical joint free, clamped, or elastic with a rotational stiffness (N m/rad)."""

        def change(joint: Spherical) -> Spherical:
            kind, rate = (rotation, None) if isinstance(rotation, str) else ("elastic", rotation)
            return _replace(joint, rotation=kind, stiffness=rate)

        return self._with_elements(lambda e: change(e) if isinstance(e, Spherical) else e)

    def with_guide(self, yields: Literal["translation", "rotation"]) -> Machine:
        """The machine with every curvilinear joint yielding along its tangent or along its circle."""
        return self._with_elements(lambda e: _replace(e, yields=yields) if isinstance(e, Curvilinear) else e)

    def with_rigid_drives(self) -> Machine:
        """The machine with every drive rigid: its actuators locked."""
        return self._with_elements(lambda e: _replace(e, stiffness=None) if isinstance(e, Drivable) and e.actuated else e)

    def with_free_drives(self) -> Machine:
        """The machine with none of its drives locked, whatever its file says; locks of joints without a drive stay."""
        return self._with_elements(lambda e: _replace(e, locked=None) if isinstance(e, Drivable) and e.actuated else e)

    def with_theory(self, theory: Literal["euler-bernoulli", "timoshenko"]) -> Machine:
        """The machine with or without shear deflection of its beams."""
        return _replace(self, theory=theory)

    def with_locks(self, locks: Mapping[str, float]) -> Machine:
        """The machine with joints locked at coordinates (m or rad) while it works.

        Args:
            locks: by the name of a joint, in every chain that has it ("radial"), or in one chain ("leg-2.radial").  A chain
                that is named keeps none of the locks of its file.  Copies of a chain that differ become chains of their own.

        Raises:
            InputError: for a name that no joint which can be locked has.
        """
        own = {leg.name: _locks_of(leg, locks) for leg in self.legs}
        used = {written for found in own.values() for written, _, _ in found}
        names = [f"{leg.name}.{e.name}" for leg in self.legs for e in leg.chain.elements if isinstance(e, Drivable)]
        for written in locks:
            if written not in used:
                raise InputError(f"lock {written}: no such joint{nearest(written, names)}")
        chains: dict[str, Chain] = {}
        for name, chain in self.chains.items():
            legs = [leg for leg in self.legs if leg.chain is chain]
            sets = [{element: value for _, element, value in own[leg.name]} for leg in legs]
            if all(s == sets[0] for s in sets):
                chains[name] = _relocked(chain, sets[0])
            else:
                chains |= {leg.name: _relocked(leg.alone(), s) for leg, s in zip(legs, sets, strict=True)}
        return _replace(self, chains=chains)

    def _with_elements(self, change: Callable[[Element], Element]) -> Machine:
        chains = {
            name: _replace(chain, elements=tuple(change(e) for e in chain.elements)) for name, chain in self.chains.items()
        }
        return _replace(self, chains=chains)


class Leg(eqx.Module):
    """One chain where it stands, with what depends on dimensions alone worked out: kernels would do it at every pose."""

    name: str = eqx.field(static=True)
    chain: Chain
    rotation: Scalar
    """Rotation about z from the first copy of the chain, rad; of its base and of its platform joint alike."""
    base_turn: Angle
    """Turn about z of the first joint's frame from {O}."""
    tip_turn: Angle
    """Turn about z_E of the platform joint's frame from {E}."""
    limits: tuple[tuple[Scalar, Scalar] | None, ...]
    """Per element: lower and upper limit on the scale of its gauge (`Element.limits`), or None."""

    @classmethod
    def standing(cls, chain: Chain, rotation: Scalar, name: str = "") -> Leg:
        """A chain turned about z by a rotation (rad)."""
        base_azimuth = 0.0 if chain.base is None else chain.base.azimuth
        turns = turned_by(base_azimuth, rotation), turned_by(chain.platform_joint.azimuth, rotation)
        limits = tuple(e.limits for e in chain.elements)
        return cls(name, chain, rotation, *turns, limits)

    def alone(self) -> Chain:
        """The chain as a chain of its own, standing where this copy stands."""
        # Without a base the angle on the circle is counted from {O}, in every copy.
        base = self.chain.base and _replace(self.chain.base, azimuth=self.chain.base.azimuth + self.rotation)
        joint = _replace(self.chain.platform_joint, azimuth=self.chain.platform_joint.azimuth + self.rotation)
        return _replace(self.chain, copies=1, base=base, platform_joint=joint)

    @property
    def unnamed(self) -> Leg:
        """The leg as kernels take it, which are the same for all copies of a chain."""
        return _replace(self, name="")

    def platform_frame(self) -> Frame:
        """Frame of the platform joint in {E}."""
        joint = self.chain.platform_joint
        return _polar(self.tip_turn, joint.radius, joint.height)

    def base_frame(self) -> Frame:
        """Frame of the first joint in {O}; {O} itself for a chain without a base (a carriage on a circle about z)."""
        base = self.chain.base
        if base is None:
            return IDENTITY
        return _polar(self.base_turn, base.radius, base.height)


class Mechanism(NamedTuple):
    """A machine as kernels see it: no words, no home, no workpiece, so that machines share compiled kernels."""

    legs: tuple[Leg, ...]
    stock: Stock


def _locks_of(leg: Leg, locks: Mapping[str, float]) -> list[tuple[str, str, float]]:
    """Locks that concern a leg: as written, the element, and the coordinate."""
    drivable = [e.name for e in leg.chain.elements if isinstance(e, Drivable)]
    return [(text, e, locks[text]) for e in drivable for text in (e, f"{leg.name}.{e}") if text in locks]


def _relocked(chain: Chain, locks: Mapping[str, float]) -> Chain:
    """A chain with these locks instead of its own; as it is when there are none."""
    if not locks:
        return chain
    elements = tuple(
        _replace(e, locked=float(locks[e.name]) if e.name in locks else None) if isinstance(e, Drivable) else e
        for e in chain.elements
    )
    return _replace(chain, elements=elements)


def copy_rotation(chain: Chain, copy: int) -> float:
    """Rotation of a copy of a chain about z, rad."""
    return 2 * math.pi * copy / chain.copies


def _polar(turn: Angle, radius: Scalar | None, height: Scalar | None) -> Frame:
    """A frame turned about z, then moved out along its x and up along z; None is zero, known as such to the kernels."""
    turned = IDENTITY.turn((0.0, 0.0, 1.0), turn)
    return turned.shift((0 if radius is None else radius, 0, 0 if height is None else height))


def turned_by(azimuth: Scalar, rotation: Scalar) -> Angle:
    """Cosine and sine of an azimuth plus a rotation."""
    return Angle(cosine(azimuth + rotation), sine(azimuth + rotation))


def _replace(module: _T, **changes: object) -> _T:
    return dataclasses.replace(module, **changes)  # type: ignore[type-var]


@cache
def adapter() -> TypeAdapter[Machine]:
    """What pydantic makes of the fields above: the reader, the writer and the JSON schema of machines."""
    return TypeAdapter(Machine)


PLATFORM, WORKPIECE = "platform", "workpiece"
"""Bodies that every machine has, by the names which `interference.may_touch` gives them."""


def bodies(machine: Machine) -> dict[str, list[str]]:
    """Names of bodies: every one as itself, and an element's without its copy, "leg.link", as all of its copies."""
    found = {name: [name] for name in (PLATFORM, WORKPIECE, *machine.fixtures)}
    for name, chain in machine.chains.items():
        copies = [name] if chain.copies == 1 else [f"{name}-{k + 1}" for k in range(chain.copies)]
        for element in chain.elements:
            found |= {f"{copy}.{element.name}": [f"{copy}.{element.name}"] for copy in copies}
            found[f"{name}.{element.name}"] = [f"{copy}.{element.name}" for copy in copies]
    return found
