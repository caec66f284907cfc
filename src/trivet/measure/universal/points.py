"""Points of universal files, and which way their directions point: datasets 15, 2411 and 2420."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from trivet.measure.functions import Channel
from trivet.measure.universal.parse import Fields
from trivet.measure.universal.scan import Block
from trivet.measure.universal.units import Declared, Scale, metres

CARTESIAN, CYLINDRICAL, SPHERICAL = 0, 1, 2
GLOBAL = (0, 1)
"""Systems that need no definition: none, and the first one, the axes of the part unless dataset 2420 says otherwise."""
SQUARE = 1e-4
"""How far axes of a system may be from being square to each other."""


class System(NamedTuple):
    """A local coordinate system."""

    kind: int
    axes: np.ndarray
    """(3, 3): its axes as columns, in those of the part."""
    origin: np.ndarray
    """(3,) in the unit of the file."""


@dataclass(frozen=True)
class Geometry:
    """Where the points of a file are, and along which axes they move."""

    positions: Mapping[int, np.ndarray] = field(default_factory=dict)
    """(3,) m, in the axes of the part."""
    systems: Mapping[int, System] = field(default_factory=dict)
    moving: Mapping[int, int] = field(default_factory=dict)
    """Of each point the system along which it moves."""
    length: float = 1.0
    """m of the unit of the file."""

    def channel(self, block: Block, fields: Fields, side: str) -> Channel:
        """The point and the direction of a function: `side` is "rsp" for the response, "ref" for the reference."""
        node, name, code = fields.get(f"{side}_node", 0), str(fields.get(f"{side}_ent_name", "")), fields.get(f"{side}_dir", 0)
        word = "response" if side == "rsp" else "reference"
        named = name.upper() not in ("", "NONE")
        if node == 0 and not named and code == 0:
            raise block.error(f"names no {word}", 7)
        if code == 0 or abs(code) > 6:
            raise block.error(f"direction of its {word} is {code}; expected +-1 to +-3 along x, y, z, +-4 to +-6 about them", 7)
        axes = self._axes(block, node) if node else np.eye(3)
        column = axes[:, (abs(code) - 1) % 3] * math.copysign(1.0, code)
        x, y, z = (float(c) + 0.0 for c in column)
        return Channel(str(node) if node or not named else name, (x, y, z), abs(code) > 3)

    def _axes(self, block: Block, node: int) -> np.ndarray:
        """(3, 3): the axes along which a point moves, as columns."""
        label = self.moving.get(node, 0)
        if label in GLOBAL and label not in self.systems:
            return np.eye(3)
        if label not in self.systems:
            raise block.error(f"point {node} moves along coordinate system {label}, which no dataset 2420 of the file defines")
        system = self.systems[label]
        if system.kind == CARTESIAN:
            return system.axes
        at = system.axes.T @ (self.positions[node] / self.length - system.origin)
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


def geometry(datasets: Iterable[tuple[Block, Fields]], scale: Scale | None, given: Declared) -> Geometry:
    """Points of a file; raises InputError for systems that are none, points that are defined twice, and unknown units."""
    systems: dict[int, System] = {}
    points = []
    for block, fields in datasets:
        if block.kind == 2420:
            systems |= _systems(block, fields)
        elif block.kind in (15, 2411):
            points.append((block, fields))
    positions: dict[int, np.ndarray] = {}
    moving: dict[int, int] = {}
    length = 1.0
    for block, fields in points:
        length = metres(block, scale, given)
        numbers, local, along = (np.asarray(fields[key]).astype(int).tolist() for key in ("node_nums", "def_cs", "disp_cs"))
        places = np.column_stack([fields["x"], fields["y"], fields["z"]])
        for number, label, system, place in zip(numbers, local, along, places, strict=True):
            # Dataset 2411 has positions in the axes of the part, whatever system it names beside them.
            put = place if block.kind == 2411 else _put(block, number, label, place, systems)
            at = length * put + 0.0
            if number in positions and not np.allclose(at, positions[number], rtol=1e-5, atol=1e-9):
                raise block.error(f"point {number} is at {_mm(at)} mm here, at {_mm(positions[number])} mm before")
            positions[number], moving[number] = at, system
    return Geometry(positions, systems, moving, length)


def _systems(block: Block, fields: Fields) -> dict[int, System]:
    found = {}
    for label, kind, matrix in zip(fields["CS_sys_labels"], fields["CS_types"], fields["CS_matrices"], strict=True):
        # Three rows that take local components to those of the part: its axes are the columns. The fourth is the origin.
        axes, origin = np.array(matrix[:3]), np.array(matrix[3])
        if kind not in (CARTESIAN, CYLINDRICAL, SPHERICAL):
            raise block.error(f"coordinate system {label} is of type {kind}; expected 0, 1 or 2")
        if np.abs(axes).max() > 1 + SQUARE or np.abs(axes.T @ axes - np.eye(3)).max() > SQUARE or np.linalg.det(axes) < 0:
            raise block.error(f"axes of coordinate system {label} are not square to each other, or left-handed")
        found[int(label)] = System(kind, axes / np.linalg.norm(axes, axis=0), origin)
    return found


def _put(block: Block, number: int, label: int, place: np.ndarray, systems: Mapping[int, System]) -> np.ndarray:
    """A position given in a local system, in the axes of the part."""
    if label in GLOBAL and label not in systems:
        return place
    if label not in systems:
        raise block.error(f"point {number} lies in coordinate system {label}, which no dataset 2420 of the file defines")
    if systems[label].kind != CARTESIAN:
        raise block.error(f"point {number} lies in a curved coordinate system; its angles have no stated unit: write x, y, z")
    return systems[label].axes @ place + systems[label].origin


def _mm(place: np.ndarray) -> str:
    return "({})".format(", ".join(f"{1e3 * c:g}" for c in place.tolist()))
