"""A machine as the kernels of rigid-body dynamics see it, and how it stands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from trivet.errors import InputError
from trivet.kinematics.alike import Alike, alike, stacked
from trivet.kinematics.jacobian import is_driven
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.elements import Prismatic, Stock
from trivet.model.machine import Platform
from trivet.model.mass import RigidMass, platform_mass
from trivet.space.scalar import Scalar


class Bodies(NamedTuple):
    """A machine without words, home and workpiece, so that machines of one topology share compiled kernels."""

    legs: tuple[Leg, ...]
    stock: Stock
    own: Platform
    length: Scalar
    """By which moments are compared with forces, m."""

    @classmethod
    def of(cls, machine: Machine) -> Bodies:
        """The bodies of a machine.

        Raises:
            InputError: unless six drives move the platform's six freedoms.
        """
        found = cls(tuple(leg.unnamed for leg in machine.legs), machine.stock, machine.platform, machine.characteristic_length)
        count = len(found.ranks)
        if count != 6:
            raise InputError(
                f"{machine.name}: {count} drives for the platform's six freedoms; lock or release drives until there are six"
            )
        return found

    @property
    def platform(self) -> RigidMass:
        """The platform in {E}, with what is beyond the last joints of the chains."""
        return carried_mass(self.own, self.legs, self.stock)

    @property
    def ranks(self) -> list[tuple[int, int]]:
        """Per actuator in the order of Q: its chain, and its place among the chain's drives."""
        counts = [sum(is_driven(e) for e in leg.chain.elements) for leg in self.legs]
        places = [(c, k) for c, count in enumerate(counts) for k in range(count)]
        return sorted(places, key=lambda place: (place[1], place[0]))

    def alike(self) -> list[Alike]:
        """The chains, those made alike as one."""
        return alike(self.legs)

    def grouped(self, stand: Sequence[Posture]) -> list[Posture]:
        """Postures of the chains one by one, at one pose, as those of chains that are made alike: components (chains, 1)."""
        return [stacked([stand[k] for k in group.places]) for group in self.alike()]


def carried_mass(platform: Platform, legs: Sequence[Leg], stock: Stock) -> RigidMass:
    """A platform in {E}, with what is beyond the last joints of its chains and moves with it."""
    mass = platform_mass(platform, stock)
    for leg in legs:
        mass = mass.plus(leg.chain.elements[-1].weigh(stock).out_of(leg.platform_frame()))
    return mass


def require_masses(machine: Machine) -> None:
    """Raise InputError, naming the slide, where the mass of a rod is unknown, as long as its travel is."""
    for leg in machine.legs:
        for element in leg.chain.elements:
            if isinstance(element, Prismatic) and element.beam is not None and element.travel is None:
                raise InputError(
                    f"chains.{leg.name}.elements.{element.name}.travel: missing, and the rod is as long as that asks for; "
                    "give a travel, or the lumped mass in place of the beam"
                )
