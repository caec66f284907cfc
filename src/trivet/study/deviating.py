"""Where what a tolerance file names is among the deviations of a machine (`kinematics.deviation`), as rows over all of them.

Three more columns are the tool tip, along the axes of {E}.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, nearest
from trivet.kinematics.deviation import Deviation, Way, deviations, places
from trivet.model import Machine, dimensions
from trivet.model.elements import Beam, Curvilinear, Drivable, Element, Offset, Prismatic, Revolute, Socket
from trivet.model.numbers import number
from trivet.model.quantity import Quantity

Array = NDArray[Any]
_Kind = TypeVar("_Kind", bound=Element)

AXES = ("x", "y", "z")
GROUND, PLATFORM = "ground", "platform"
"""Bodies that no element is: what the chains' bases stand on, and the platform with its joints and its tool."""


class Named(NamedTuple):
    """A row, and what it is of, in full."""

    name: str
    row: Array
    """(d + 3,)."""


class Growth(NamedTuple):
    """A body that grows when it warms."""

    names: tuple[str, ...]
    """By which it is called, the last one its own."""
    material: str | None
    row: Array
    """(d + 3,) deviations where all of its lengths grow by a part of one."""


class Deviating:
    """A machine, and where its deviations are among all of them."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.legs = machine.legs
        self.chains = [name for name, chain in sorted(machine.chains.items()) for _ in range(chain.copies)]
        """Name of the chain of every leg."""
        ways = deviations(machine)
        self.count = len(ways)
        self.place = {way: k for k, way in enumerate(ways)}

    @property
    def nothing(self) -> Array:
        """(d + 3,) no deviation."""
        return np.zeros(self.count + len(AXES))

    def row(self, leg: int, way: Way, of: str, axis: int = 0, size: float = 1.0) -> Array:
        """One deviation of one leg, as `kinematics.deviation.Deviation`."""
        found = self.nothing
        found[self.place[Deviation(leg, way, of, axis)]] = size
        return found

    def tip(self, axis: int, size: float = 1.0) -> Array:
        """The tool tip along an axis of {E}."""
        found = self.nothing
        found[self.count + axis] = size
        return found

    def name(self, leg: int, of: str) -> str:
        """Of a joint, a body or a dimension, with its leg."""
        return f"{self.legs[leg].name}.{of.removeprefix('elements.')}"

    def elements(self, name: str, kind: type[_Kind], what: str) -> list[tuple[int, _Kind]]:
        """Elements of a kind by name, with their legs: "hinge" and "leg.hinge" of all, "leg-2.hinge" of one.

        Raises:
            InputError: where there is none.
        """
        found, known = list[tuple[int, _Kind]](), set[str]()
        for k, leg in enumerate(self.legs):
            for element in leg.chain.elements:
                if isinstance(element, kind):
                    names = self._names(k, element)
                    known |= set(names)
                    found += [(k, element)] * (name in names)
        if not found:
            raise InputError(f"{name}: {self.machine.name} has no such {what}{nearest(name, known)}")
        return found

    def _names(self, leg: int, element: Element) -> tuple[str, ...]:
        return element.name, f"{self.chains[leg]}.{element.name}", f"{self.legs[leg].name}.{element.name}"

    def held(self, name: str) -> list[tuple[int, Drivable]]:
        """Joints by name which a drive or a lock holds where they are."""
        found = self.elements(name, Drivable, "drive")
        for _, joint in found:
            if not joint.actuated and joint.locked is None:
                raise InputError(f"{name}: nothing holds this joint where it is; only drives and locked joints can be off")
        return found

    def dimension(self, path: str) -> tuple[list[Named], Quantity]:
        """A number of the machine file, for every copy of its chain, and its kind.

        Raises:
            InputError: for a path that the machine does not have, or a number that places nothing.
        """
        head, _, rest = path.partition(".")
        only = next((k for k, leg in enumerate(self.legs) if leg.name == head and head not in self.machine.chains), None)
        found = number(self.machine, path if only is None else f"chains.{self.chains[only]}.{rest}")
        table, *keys = found.path.split(".")
        if found.path.startswith("platform.tool_tip."):
            return [Named(found.path, self.tip(int(keys[-1]) - 1))], found.kind
        own = ".".join(keys[1:])
        if table != "chains" or not places(own):
            raise InputError(f"{path}: has no part in where the platform is{nearest(path, self._placing())}")
        legs = [k for k, chain in enumerate(self.chains) if chain == keys[0] and only in (None, k)]
        return [Named(self.name(k, own), self.row(k, "dimension", own)) for k in legs], found.kind

    def _placing(self) -> Iterator[str]:
        for path in dimensions(self.machine):
            table, *keys = path.split(".")
            if table == "chains" and places(".".join(keys[1:])):
                yield ".".join(keys[-2:])

    def growths(self) -> Iterator[Growth]:
        """All bodies that have lengths."""
        disc, ground, platform = self.machine.platform.disc, self.nothing, self.nothing
        for axis, value in enumerate(self.machine.platform.tool_tip or ()):
            platform += self.tip(axis, float(value))
        for k, leg in enumerate(self.legs):
            sizes = {path: float(value) for path, value in dimensions(leg.chain).items()}
            for table, row in (("base", ground), ("platform_joint", platform)):
                for path in (f"{table}.radius", f"{table}.height"):
                    if path in sizes:
                        row += self.row(k, "dimension", path, size=sizes[path])
            for element in leg.chain.elements:
                own, material = self._growth(k, element, sizes)
                if own.any():
                    yield Growth(self._names(k, element), material, own)
        yield Growth((PLATFORM,), None if disc is None else disc.material, platform)
        if ground.any():
            yield Growth((GROUND,), None, ground)

    def _growth(self, leg: int, element: Element, sizes: dict[str, float]) -> tuple[Array, str | None]:
        """The row of an element that grows by a part of one, and its material."""
        if isinstance(element, Prismatic):
            return self.row(leg, "growth", element.name), None if element.beam is None else element.beam.material
        keys = {Beam: ("length",), Curvilinear: ("radius",), Offset: ("vector.1", "vector.2", "vector.3")}
        row = self.nothing
        for path in (f"elements.{element.name}.{key}" for key in keys.get(type(element), ())):
            row += self.row(leg, "dimension", path, size=sizes[path])
        return row, element.material if isinstance(element, Beam) else None


def across(joint: Element) -> Array:
    """(k, 3): directions in a joint's own frame in which a radial clearance lets it move; all three of balls and crosses."""
    if isinstance(joint, Socket):
        return np.eye(3)
    assert isinstance(joint, (Curvilinear, Prismatic, Revolute))
    axis = (0.0, 1.0, 0.0) if isinstance(joint, Curvilinear) else joint.axis  # along the guide
    found: Array = np.linalg.svd(np.array([axis]))[2][1:]
    return found
