"""Matrix structural analysis against OpenSees."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from machines import PAPER, changed, difference
from opensees_model import AREA, BALL, CENTRE, DENSITY, PLATE, build

from trivet.kinematics.mode import parse_mode
from trivet.model import Machine, load
from trivet.space.pose import zyz_frame
from trivet.statics.load import load_case
from trivet.statics.structure import structural_stiffness

opensees = pytest.mark.peer("openseespy", module="openseespy.opensees")

GRAVITY = np.array([0.5, -1.0, -9.7])


def response(name: str, rotation: Any, centre: np.ndarray, turn: np.ndarray, load_it: Callable[..., None]) -> np.ndarray:
    """Displacement (6,) of the platform centre under a load."""
    import openseespy.opensees as ops

    beams = build(name, rotation, centre, turn)
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
    # The peer knows beams alone: without a travel nothing of a rod is hidden in its guide.
    machine = changed(machine, {key: {"travel": None} for key in ("slide", "column", "telescope")})
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
