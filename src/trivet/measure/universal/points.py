"""Points of universal files, and which way their directions point: datasets 15, 2411 and 2420."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trivet.measure.functions import Channel
from trivet.measure.joining import is_at
from trivet.measure.universal.description import Described
from trivet.measure.universal.plain import Fields
from trivet.measure.universal.scan import Block
from trivet.measure.universal.units import Declared, Scale, is_none, metres

CARTESIAN, CYLINDRICAL, SPHERICAL = 0, 1, 2
PART = (0, 1)
"""Systems that need no definition: none, and the first one, the axes of the part unless dataset 2420 says otherwise."""
SQUARE = 1e-4
"""How far axes of a system may be from being square to each other."""


class System(NamedTuple):
    """A local coordinate system."""

    block: Block
    """Where it is defined."""
    kind: int
    axes: np.ndarray
    """(3, 3): its axes as columns, in those of the part."""
    origin: np.ndarray
    """(3,) in the unit of its file."""
    scale: Scale | None
    """Of its file."""


class Point(NamedTuple):
    """A point of a file."""

    block: Block
    """Where it is defined."""
    at: np.ndarray
    """(3,) m, in the axes of the part."""
    moving: int
    """System along which it moves."""


@dataclass(frozen=True)
class Geometry:
    """Where the points of some files are, and along which axes they move."""

    known: Mapping[int, Point]
    systems: Mapping[int, System]
    owners: Mapping[int, Sequence[str]]
    """What points belong to, by their number, where several have the same one."""
    given: Declared

    @property
    def points(self) -> dict[str, tuple[float, float, float]]:
        """Positions of the points of which there is one only, m."""
        return {
            str(number): (float(point.at[0]), float(point.at[1]), float(point.at[2]))
            for number, point in self.known.items()
            if number not in self.owners
        }

    def channel(self, block: Block, fields: Fields, side: str) -> Channel:
        """The point and the direction of a function: `side` is "rsp" for the response, "ref" for the reference."""
        node, name, code = fields.get(f"{side}_node", 0), str(fields.get(f"{side}_ent_name", "")), fields.get(f"{side}_dir", 0)
        word = "response" if side == "rsp" else "reference"
        if node == 0 and is_none(name) and code == 0:
            raise block.error(f"names no {word}", 7)
        if code == 0 or abs(code) > 6:
            raise block.error(f"direction of its {word} is {code}; expected +-1 to +-3 along x, y, z, +-4 to +-6 about them", 7)
        axes = self.axes(block, node) if node else np.eye(3)
        column = axes[:, (abs(code) - 1) % 3] * math.copysign(1.0, code)
        x, y, z = (float(c) + 0.0 for c in column)
        return Channel(self._name(node, name), (x, y, z), abs(code) > 3)

    def _name(self, node: int, name: str) -> str:
        if not node and not is_none(name):
            return name
        return f"{name}-{node}" if node in self.owners and not is_none(name) else str(node)

    def axes(self, block: Block, node: int) -> np.ndarray:
        """(3, 3): the axes along which a point moves, as columns."""
        label = self.known[node].moving if node in self.known else 0
        if label in PART and label not in self.systems:
            return np.eye(3)
        if node in self.owners:
            whose = f"{' and '.join(self.owners[node])} have a point {node} each"
            raise block.error(f"{whose}, which moves along coordinate system {label}; give their files apart")
        if label not in self.systems:
            raise block.error(f"point {node} moves along coordinate system {label}, which no dataset 2420 defines")
        system = self.systems[label]
        if system.kind == CARTESIAN:
            return system.axes
        at = system.axes.T @ (self.known[node].at - _origin(system, self.given))
        return system.axes @ _curved(block, node, system.kind, at)


def _curved(block: Block, node: int, kind: int, at: np.ndarray) -> np.ndarray:
    """(3, 3): directions of the coordinates r, theta, z or r, theta, phi at a place (3,), as columns.

    theta turns about z from x, phi is measured from z.
    """
    radius = math.hypot(at[0], at[1])
    if radius <= 1e-9 * float(np.linalg.norm(at)):
        raise block.error(f"point {node} lies on the axis of its coordinate system, where its directions have no meaning")
    cos, sin = at[0] / radius, at[1] / radius
    about = [-sin, cos, 0.0]
    if kind == CYLINDRICAL:
        return np.array([[cos, sin, 0.0], about, [0.0, 0.0, 1.0]]).T
    down = math.atan2(radius, at[2])
    out = [cos * math.sin(down), sin * math.sin(down), math.cos(down)]
    return np.array([out, about, [cos * math.cos(down), sin * math.cos(down), -math.sin(down)]]).T


def geometry(files: Sequence[Described], given: Declared) -> Geometry:
    """Points and axes of some files.

    Raises:
        InputError: for systems that are none, points and systems that are defined twice, and unknown units.
    """
    systems: dict[int, System] = {}
    for file, block, fields in _datasets(files, 2420):
        for label, system in _systems(block, fields, file.scale):
            _check_same_system(label, system, systems.setdefault(label, system))
    known: dict[int, Point] = {}
    for file, block, fields in _datasets(files, 15, 2411):
        for number, point in _points(block, fields, file.scale, systems, given):
            _check_same_point(number, point, known.setdefault(number, point))
    owners: dict[int, list[str]] = {}
    for number, name in sorted({pair for file in files for pair in file.names}):
        owners.setdefault(number, []).append(name)
    several = {number: names for number, names in owners.items() if len(names) > 1}
    return Geometry(known, systems, several, given)


def _datasets(files: Sequence[Described], *kinds: int) -> Iterator[tuple[Described, Block, Fields]]:
    """Those of some kinds."""
    for file in files:
        for block, fields in file.datasets:
            if block.kind in kinds:
                yield file, block, fields


def _points(
    block: Block, fields: Fields, scale: Scale | None, systems: Mapping[int, System], given: Declared
) -> Iterator[tuple[int, Point]]:
    length = metres(block, scale, given)
    numbers, local, along = (np.asarray(fields[key]).astype(int).tolist() for key in ("node_nums", "def_cs", "disp_cs"))
    places = length * np.column_stack([fields["x"], fields["y"], fields["z"]])
    for number, label, moving, place in zip(numbers, local, along, places, strict=True):
        # Dataset 2411 has positions in the axes of the part, whatever system it names beside them.
        at = place if block.kind == 2411 else _put(block, number, label, place, systems, given)
        yield number, Point(block, at + 0.0, 0 if moving in PART and moving not in systems else moving)


def _check_same_point(number: int, point: Point, before: Point) -> None:
    where = f"before ({before.block.title})"
    if not is_at(point.at, before.at):
        raise point.block.error(f"point {number} is at {_mm(point.at)} mm here, at {_mm(before.at)} mm {where}")
    if point.moving != before.moving:
        raise point.block.error(
            f"point {number} moves along coordinate system {point.moving} here, along {before.moving} {where}"
        )


def _systems(block: Block, fields: Fields, scale: Scale | None) -> Iterator[tuple[int, System]]:
    for label, kind, matrix in zip(fields["CS_sys_labels"], fields["CS_types"], fields["CS_matrices"], strict=True):
        # Three rows that take local components to those of the part: its axes are the columns. The fourth is the origin.
        axes, origin = np.array(matrix[:3]), np.array(matrix[3])
        if kind not in (CARTESIAN, CYLINDRICAL, SPHERICAL):
            raise block.error(f"coordinate system {label} is of type {kind}; expected 0, 1 or 2")
        if np.abs(axes).max() > 1 + SQUARE or np.abs(axes.T @ axes - np.eye(3)).max() > SQUARE or np.linalg.det(axes) < 0:
            raise block.error(f"axes of coordinate system {label} are not square to each other, or left-handed")
        yield int(label), System(block, kind, axes / np.linalg.norm(axes, axis=0), origin, scale)


def _check_same_system(label: int, system: System, before: System) -> None:
    origins = [s.origin * (1.0 if s.scale is None else s.scale.length) for s in (system, before)]
    if system.kind != before.kind or np.abs(system.axes - before.axes).max() > SQUARE or not is_at(*origins):
        raise system.block.error(f"coordinate system {label} is another one here than before ({before.block.title})")


def _origin(system: System, given: Declared) -> np.ndarray:
    """(3,) m."""
    return system.origin * metres(system.block, system.scale, given) if system.origin.any() else system.origin


def _put(
    block: Block, number: int, label: int, place: np.ndarray, systems: Mapping[int, System], given: Declared
) -> np.ndarray:
    """A position (m) given in a local system, in the axes of the part."""
    if label in PART and label not in systems:
        return place
    if label not in systems:
        raise block.error(f"point {number} lies in coordinate system {label}, which no dataset 2420 defines")
    if systems[label].kind != CARTESIAN:
        raise block.error(f"point {number} lies in a curved coordinate system; its angles have no stated unit: write x, y, z")
    return systems[label].axes @ place + _origin(systems[label], given)


def _mm(place: np.ndarray) -> str:
    return "({})".format(", ".join(f"{1e3 * c:g}" for c in place.tolist()))
