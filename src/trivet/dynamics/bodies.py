"""A machine as the kernels of rigid-body dynamics see it, and how it stands."""

from __future__ import annotations

from typing import Any, NamedTuple

from trivet.errors import InputError
from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import is_driven
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.elements import Stock
from trivet.model.machine import Platform
from trivet.model.mass import RigidMass, platform_mass
from trivet.space.frame import Frame
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
        mass = platform_mass(self.own, self.stock)
        for leg in self.legs:
            mass = mass.plus(leg.chain.elements[-1].weigh(self.stock).out_of(leg.platform_frame()))
        return mass

    @property
    def ranks(self) -> list[tuple[int, int]]:
        """Per actuator in the order of Q: its chain, and its place among the chain's drives."""
        counts = [sum(is_driven(e) for e in leg.chain.elements) for leg in self.legs]
        places = [(c, k) for c, count in enumerate(counts) for k in range(count)]
        return sorted(places, key=lambda place: (place[1], place[0]))

    def stand(self, pose: Frame, signs: Any) -> tuple[Posture, ...]:
        """How every chain stands at a pose in a working mode, (n_chains, 2)."""
        return tuple(inverse(leg, pose, signs[k]) for k, leg in enumerate(self.legs))
