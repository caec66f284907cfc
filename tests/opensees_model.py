"""The four machines of the paper in OpenSees, from the paper's geometry and nothing of ours but the dimensions.

Joints are zeroLength elements in the axes of their chain: a spring where the drive yields, nothing where the joint is slack,
and springs that are stiff against everything else where it is rigid; the platform hangs on rigid links.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

GUIDE, PLATE, LINK, BAR = 0.162, 0.018, 0.216, 0.130
YOUNG, SHEAR, DENSITY = 205e9, 205e9 / 2 / 1.29, 7870.0
AREA, INERTIA = np.pi / 4 * (0.019**2 - 0.014**2), np.pi / 64 * (0.019**4 - 0.014**4)
DRIVE, SHOULDER, BALL = 3e6, 24300.0, 300.0
# Differences from ours follow 1 / RIGID until rounding takes over.
RIGID = (3e13,) * 3 + (1e11,) * 3
CENTRE, FIRST, SECOND, THIRD = 1, 0, 1, 2


class Leg(NamedTuple):
    """What a chain is made of, from the ground on: ("joint", place, x axis, y axis, rates of 6) or ("beam", from, to)."""

    steps: list[tuple[Any, ...]]
    end: np.ndarray


def swapped(rates: tuple[float, ...], place: int, rate: float) -> tuple[float, ...]:
    return (*rates[:place], rate, *rates[place + 1 :])


def leg_of(name: str, end: np.ndarray) -> Leg:
    """A chain in the paper's mode (section 3.1): carriage on the side of P, C outside or below P, elbow outward and up."""
    rho, z = np.hypot(end[0], end[1]), end[2]
    er = np.array([end[0], end[1], 0]) / rho
    ez = np.array([0.0, 0.0, 1.0])
    et = np.cross(ez, er)
    carriage = GUIDE * er
    hinge = swapped(RIGID, 4, 0.0)  # about local y
    guide = ("joint", carriage, er, et, swapped(RIGID, SECOND, DRIVE))
    if name == "alizade":
        along = (end - carriage) / np.linalg.norm(end - carriage)
        slide = ("joint", carriage, along, et, swapped(RIGID, FIRST, DRIVE))
        return Leg([guide, ("joint", carriage, er, et, hinge), slide, ("beam", carriage, end)], end)
    if name == "glozman":
        shoulder = ("joint", carriage, er, et, swapped(RIGID, 4, SHOULDER))
        line = end - carriage
        rise = np.arccos(np.linalg.norm(line) / 2 / BAR)  # both links are as long
        angle = np.arctan2(z, rho - GUIDE) - rise
        knee = carriage + BAR * (np.cos(angle) * er + np.sin(angle) * ez)
        return Leg([guide, shoulder, ("beam", carriage, knee), ("joint", knee, er, et, hinge), ("beam", knee, end)], end)
    if name == "azulay":
        knee = (rho + np.sqrt(LINK**2 - z**2)) * er
        slide = ("joint", carriage, er, et, swapped(RIGID, FIRST, DRIVE))
    else:
        knee = carriage + (z - np.sqrt(LINK**2 - (GUIDE - rho) ** 2)) * ez
        slide = ("joint", carriage, er, et, swapped(RIGID, THIRD, DRIVE))
    return Leg([guide, slide, ("beam", carriage, knee), ("joint", knee, er, et, hinge), ("beam", knee, end)], end)


class Model:
    """Nodes, elements and materials of an OpenSees model, numbered as they come."""

    def __init__(self, ops: Any) -> None:
        self.ops, self.nodes, self.elements, self.materials = ops, CENTRE, 0, 0
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 6)

    def node(self, at: np.ndarray) -> int:
        self.nodes += 1
        self.ops.node(self.nodes, *map(float, at))
        return self.nodes

    def joint(self, first: int, second: int, x: np.ndarray, y: np.ndarray, rates: tuple[float, ...]) -> None:
        tags = []
        for rate in rates:
            self.materials += 1
            self.ops.uniaxialMaterial("Elastic", self.materials, rate)
            tags.append(self.materials)
        self.elements += 1
        self.ops.element(
            "zeroLength",
            self.elements,
            first,
            second,
            "-mat",
            *tags,
            "-dir",
            1,
            2,
            3,
            4,
            5,
            6,
            "-orient",
            *map(float, x),
            *map(float, y),
        )

    def beam(self, first: int, second: int, run: np.ndarray) -> tuple[int, np.ndarray]:
        """A tube; its number and its local axes by rows."""
        self.elements += 1
        x = run / np.linalg.norm(run)
        aside = np.array([0.3, 0.5, 0.8])
        self.ops.geomTransf("Linear", self.elements, *map(float, aside))
        self.ops.element(
            "elasticBeamColumn", self.elements, first, second, AREA, YOUNG, SHEAR, 2 * INERTIA, INERTIA, INERTIA, self.elements
        )
        y = np.cross(aside, x) / np.linalg.norm(np.cross(aside, x))
        return self.elements, np.array([x, y, np.cross(x, y)])


def build(name: str, rotation: Any, centre: np.ndarray, turn: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Build a machine at a pose (centre, rotation matrix) with balls "free", "clamped" or elastic; gives its beams."""
    import openseespy.opensees as ops

    model = Model(ops)
    ops.node(CENTRE, *map(float, centre))
    ball = {"free": (*RIGID[:3], 0.0, 0.0, 0.0), "clamped": RIGID}.get(rotation, (*RIGID[:3], BALL, BALL, BALL))
    beams = []
    for azimuth in np.radians([0, 120, 240]):
        leg = leg_of(name, centre + PLATE * turn @ [np.cos(azimuth), np.sin(azimuth), 0])
        node = model.node(leg.steps[0][1])
        ops.fix(node, 1, 1, 1, 1, 1, 1)
        for kind, *step in leg.steps:
            after = model.node(step[0] if kind == "joint" else step[1])
            if kind == "joint":
                model.joint(node, after, *step[1:])
            else:
                beams.append(model.beam(node, after, step[1] - step[0]))
            node = after
        after = model.node(leg.end)
        model.joint(node, after, np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), ball)
        ops.rigidLink("beam", CENTRE, after)
    return beams
