"""The four machines of the paper in OpenSees, from the paper's geometry and nothing of ours but the dimensions.

Joints are zeroLength elements in the axes of their chain: a spring where the drive yields, nothing where the joint is slack,
and springs that are stiff against everything else where it is rigid; the platform hangs on rigid links.  For vibration beams
are divided into elements with consistent mass, and weights on rigid links stand for the platform's disc.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

GUIDE, PLATE, LINK, BAR = 0.162, 0.018, 0.216, 0.130
THICKNESS = 0.010
POISSON = 0.29
YOUNG, SHEAR, DENSITY = 205e9, 205e9 / 2 / (1 + POISSON), 7870.0
AREA, INERTIA = np.pi / 4 * (0.019**2 - 0.014**2), np.pi / 64 * (0.019**4 - 0.014**4)
DRIVE, SHOULDER, BALL = 3e6, 24300.0, 300.0
# Differences from ours follow 1 / RIGID until rounding takes over.
RIGID = (3e13,) * 3 + (1e11,) * 3
CENTRE, FIRST, SECOND, THIRD = 1, 0, 1, 2
# Cowper (1966), hollow circle.
HOLLOW = (14 / 19) ** 2
SHEAR_AREA = (
    AREA * 6 * (1 + POISSON) * (1 + HOLLOW) ** 2 / ((7 + 6 * POISSON) * (1 + HOLLOW) ** 2 + (20 + 12 * POISSON) * HOLLOW)
)


class Vibration(NamedTuple):
    """What vibration needs besides."""

    elements: int | tuple[int, ...]
    """Elements of every beam, or of the beams of a chain from the ground on."""
    timoshenko: bool
    """Beams with shear deflection and rotary inertia of their sections, or with neither."""
    locked: bool
    """Drives as rigid as joints are."""


class Leg(NamedTuple):
    """What a chain is made of, from the ground on: ("joint", place, x axis, y axis, rates of 6) or ("beam", from, to)."""

    steps: list[tuple[Any, ...]]
    end: np.ndarray


def swapped(rates: tuple[float, ...], place: int, rate: float) -> tuple[float, ...]:
    return (*rates[:place], rate, *rates[place + 1 :])


def leg_of(name: str, end: np.ndarray, locked: bool = False) -> Leg:
    """A chain in the paper's mode (section 3.1): carriage on the side of P, C outside or below P, elbow outward and up."""

    def drive(place: int, rate: float) -> tuple[float, ...]:
        return RIGID if locked else swapped(RIGID, place, rate)

    rho, z = np.hypot(end[0], end[1]), end[2]
    er = np.array([end[0], end[1], 0]) / rho
    ez = np.array([0.0, 0.0, 1.0])
    et = np.cross(ez, er)
    carriage = GUIDE * er
    hinge = swapped(RIGID, 4, 0.0)  # about local y
    guide = ("joint", carriage, er, et, drive(SECOND, DRIVE))
    if name == "alizade":
        along = (end - carriage) / np.linalg.norm(end - carriage)
        slide = ("joint", carriage, along, et, drive(FIRST, DRIVE))
        return Leg([guide, ("joint", carriage, er, et, hinge), slide, ("beam", carriage, end)], end)
    if name == "glozman":
        shoulder = ("joint", carriage, er, et, drive(4, SHOULDER))
        line = end - carriage
        rise = np.arccos(np.linalg.norm(line) / 2 / BAR)  # both links are as long
        angle = np.arctan2(z, rho - GUIDE) - rise
        knee = carriage + BAR * (np.cos(angle) * er + np.sin(angle) * ez)
        return Leg([guide, shoulder, ("beam", carriage, knee), ("joint", knee, er, et, hinge), ("beam", knee, end)], end)
    if name == "azulay":
        knee = (rho + np.sqrt(LINK**2 - z**2)) * er
        slide = ("joint", carriage, er, et, drive(FIRST, DRIVE))
    else:
        knee = carriage + (z - np.sqrt(LINK**2 - (GUIDE - rho) ** 2)) * ez
        slide = ("joint", carriage, er, et, drive(THIRD, DRIVE))
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

    def beam(
        self, first: int, second: int, run: np.ndarray, timoshenko: bool = False, mass: tuple[Any, ...] = ()
    ) -> tuple[int, np.ndarray]:
        """A tube; its number and its local axes by rows."""
        self.elements += 1
        x = run / np.linalg.norm(run)
        aside = np.array([0.3, 0.5, 0.8])
        self.ops.geomTransf("Linear", self.elements, *map(float, aside))
        inertia = (2 * INERTIA, INERTIA, INERTIA)
        if timoshenko:
            kind, section = "ElasticTimoshenkoBeam", (YOUNG, SHEAR, AREA, *inertia, SHEAR_AREA, SHEAR_AREA)
        else:
            kind, section = "elasticBeamColumn", (AREA, YOUNG, SHEAR, *inertia)
        self.ops.element(kind, self.elements, first, second, *section, self.elements, *mass)
        y = np.cross(aside, x) / np.linalg.norm(np.cross(aside, x))
        return self.elements, np.array([x, y, np.cross(x, y)])

    def vibrating_beam(self, first: int, start: np.ndarray, end: np.ndarray, elements: int, timoshenko: bool) -> int:
        """A tube of elements with consistent mass: of Euler-Bernoulli without rotary inertia, of Timoshenko with it."""
        for k in range(1, elements + 1):
            second = self.node(start + (end - start) * k / elements)
            self.beam(first, second, end - start, timoshenko, ("-mass", DENSITY * AREA, "-cMass"))
            first = second
        return first

    def disc(self, centre: np.ndarray, turn: np.ndarray) -> None:
        """The platform: six equal weights, in pairs on its axes, have the mass and the inertia of a disc."""
        mass = DENSITY * np.pi * PLATE**2 * THICKNESS / 6
        half = np.diag([np.sqrt(0.75) * PLATE, np.sqrt(0.75) * PLATE, THICKNESS / 2])
        for arm in (*half, *-half):
            weight = self.node(centre + turn @ arm)
            self.ops.mass(weight, mass, mass, mass, 0.0, 0.0, 0.0)
            self.ops.rigidLink("beam", CENTRE, weight)


def build(
    name: str, rotation: Any, centre: np.ndarray, turn: np.ndarray, vibration: Vibration | None = None
) -> list[tuple[int, np.ndarray]]:
    """Build a machine at a pose (centre, rotation matrix) with balls "free", "clamped" or elastic; gives its whole beams."""
    import openseespy.opensees as ops

    model = Model(ops)
    ops.node(CENTRE, *map(float, centre))
    ball = {"free": (*RIGID[:3], 0.0, 0.0, 0.0), "clamped": RIGID}.get(rotation, (*RIGID[:3], BALL, BALL, BALL))
    beams = []
    for azimuth in np.radians([0, 120, 240]):
        leg = leg_of(
            name, centre + PLATE * turn @ [np.cos(azimuth), np.sin(azimuth), 0], vibration is not None and vibration.locked
        )
        node = model.node(leg.steps[0][1])
        ops.fix(node, 1, 1, 1, 1, 1, 1)
        bars = 0
        for kind, *step in leg.steps:
            if kind == "beam" and vibration is not None:
                elements = vibration.elements if isinstance(vibration.elements, int) else vibration.elements[bars]
                node = model.vibrating_beam(node, *step, elements, vibration.timoshenko)
                bars += 1
                continue
            after = model.node(step[0] if kind == "joint" else step[1])
            if kind == "joint":
                model.joint(node, after, *step[1:])
            else:
                beams.append(model.beam(node, after, step[1] - step[0]))
            node = after
        after = model.node(leg.end)
        model.joint(node, after, np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), ball)
        ops.rigidLink("beam", CENTRE, after)
    if vibration is not None:
        model.disc(centre, turn)
    return beams


def modes(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies (m,) in Hz of the machine that was built, and twists (6, m) of its centre, of unit modal mass."""
    import openseespy.opensees as ops

    tries = []
    for more in (0, 2):
        ops.wipeAnalysis()
        ops.constraints("Transformation")
        ops.numberer("RCM")
        squares = np.array(ops.eigen("-genBandArpack", count + more))[:count]
        tries.append((np.sqrt(squares) / (2 * np.pi), np.array([ops.nodeEigenvector(CENTRE, k + 1) for k in range(count)]).T))
    # Once in a hundred times its ARPACK, which starts at random, misses one of a pair of equal modes: all above move up.
    return min(tries, key=lambda one: float(one[0].sum()))


def compliance() -> np.ndarray:
    """Static 6 x 6 compliance at the centre of the machine that was built."""
    import openseespy.opensees as ops

    ops.wipeAnalysis()
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    # Iterations on the same matrix take back what the stiff springs lose to rounding.
    ops.test("FixedNumIter", 4)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    columns = []
    for k, unit in enumerate(np.eye(6), 1):
        ops.timeSeries("Linear", k)
        ops.pattern("Plain", k, k)
        ops.load(CENTRE, *map(float, unit))
        assert ops.analyze(1) == 0
        columns.append(ops.nodeDisp(CENTRE))
        ops.remove("loadPattern", k)
        ops.reset()
    return np.array(columns).T
