"""Matrix structural analysis against OpenSees, built from the paper's geometry and nothing of ours but the dimensions.

Joints are zeroLength elements in the axes of their chain: a spring where the drive yields, nothing where the joint is slack,
and springs that are stiff against everything else where it is rigid; the platform hangs on rigid links.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from machines import PAPER, difference

from trivet.kinematics.mode import parse_mode
from trivet.model import Machine, load
from trivet.space.pose import zyz_frame
from trivet.statics.load import load_case
from trivet.statics.structure import structural_stiffness

opensees = pytest.mark.peer("openseespy", module="openseespy.opensees")

GUIDE, PLATE, LINK, BAR = 0.162, 0.018, 0.216, 0.130
YOUNG, SHEAR, DENSITY = 205e9, 205e9 / 2 / 1.29, 7870.0
AREA, INERTIA = np.pi / 4 * (0.019**2 - 0.014**2), np.pi / 64 * (0.019**4 - 0.014**4)
DRIVE, SHOULDER, BALL = 3e6, 24300.0, 300.0
# Differences from ours follow 1 / RIGID until rounding takes over.
RIGID = (3e13,) * 3 + (1e11,) * 3
CENTRE, FIRST, SECOND, THIRD = 1, 0, 1, 2
GRAVITY = np.array([0.5, -1.0, -9.7])


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


def response(name: str, rotation: Any, centre: np.ndarray, turn: np.ndarray, load_it: Callable[..., None]) -> np.ndarray:
    """Displacement (6,) of the platform centre under a load."""
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
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    load_it(ops, beams)
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    # Iterations on the same matrix take back what the stiff springs lose to rounding.
    ops.test("FixedNumIter", 4)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    assert ops.analyze(1) == 0
    return np.array(ops.nodeDisp(CENTRE))


def standing(name: str, rotation: Any) -> tuple[Machine, np.ndarray, np.ndarray, Any]:
    machine = load(name).with_spherical(rotation)
    centre = np.add(machine.home.position, (0.002, 0.003, -0.001))
    a, b, c = 0.3, 0.35, 0.2

    def about_z(angle: float) -> np.ndarray:
        return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])

    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return machine, centre, about_z(a) @ about_y @ about_z(c), zyz_frame(centre, a, b, c)


@opensees
@pytest.mark.parametrize("rotation", ["free", "clamped", BALL])
@pytest.mark.parametrize("name", PAPER)
def test_stiffness(name: str, rotation: Any) -> None:
    machine, centre, turn, pose = standing(name, rotation)
    columns = []
    for unit in np.eye(6):
        columns.append(response(name, rotation, centre, turn, lambda ops, _, f=unit: ops.load(CENTRE, *map(float, f))))
    found = structural_stiffness(machine, pose, parse_mode(machine))
    assert difference(machine, found, np.linalg.inv(np.array(columns).T)) < 1e-5


@opensees
@pytest.mark.parametrize("rotation", ["free", "clamped"])
@pytest.mark.parametrize("name", PAPER)
def test_self_weight(name: str, rotation: Any) -> None:
    machine, centre, turn, pose = standing(name, rotation)
    plate = DENSITY * np.pi * PLATE**2 * 0.010

    def weigh(ops: Any, beams: list[tuple[int, np.ndarray]]) -> None:
        ops.load(CENTRE, *map(float, plate * GRAVITY), 0.0, 0.0, 0.0)
        for number, axes in beams:
            along, y, z = DENSITY * AREA * axes @ GRAVITY
            ops.eleLoad("-ele", number, "-type", "-beamUniform", float(y), float(z), float(along))

    moved = response(name, rotation, centre, turn, weigh)
    ours = load_case(machine, pose, parse_mode(machine), gravity=tuple(GRAVITY)).platform_centre
    for part in (slice(0, 3), slice(3, 6)):
        np.testing.assert_allclose(ours[part], moved[part], rtol=0, atol=1e-5 * np.linalg.norm(moved[part]))
