"""Atlases over a hemisphere against two witnesses: the mesh of single poses, and modes of OpenSees put together."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import cache, partial

import numpy as np
import pytest
from opensees_model import Vibration, build, compliance, modes
from scipy.optimize import minimize_scalar
from test_vibration_peer import ETA, superposition

from trivet.kinematics.mode import parse_mode
from trivet.model import load
from trivet.space.family import over_hemisphere
from trivet.space.pose import zyz_frame
from trivet.statics.objective import AXES
from trivet.study.atlas import Atlas, atlas
from trivet.vibration.response import receptance

opensees = pytest.mark.peer("openseespy", module="openseespy.opensees")

HEIGHTS = {"azulay": 0.121, "alizade": 0.157}
BALL = 300.0  # N m/rad
LOW, HIGH = 20.0, 900.0
DIAGONAL = ("xx", "zz")
EVERY = tuple(f"{motion}_{load}" for motion in AXES for load in AXES)
CLOSE = 1e-3
FINE = 40
"""Elements of a beam of OpenSees; ours converge faster."""


@cache
def over(name: str) -> Atlas:
    """Of a machine whose beams have no rotary inertia, as those of OpenSees have none."""
    machine = dataclasses.replace(load(name).with_spherical(BALL), rotary_inertia=False)
    family = over_hemisphere(HEIGHTS[name], 0.004, 4)
    return atlas(machine, family, entries=DIAGONAL, low=LOW, high=HIGH, points=40, loss_factor=ETA)


@cache
def responses(name: str) -> np.ndarray:
    """(n, f, 6, 6) receptances of the atlas, the load along columns."""
    whole = dataclasses.replace(over(name), entries=EVERY)
    found = np.concatenate([values for _, values in whole.receptances()])
    return np.moveaxis(found.reshape(len(found), 6, 6, -1), -1, 1)


def some(name: str, count: int) -> np.ndarray:
    """Points of the atlas, by rising tilt from level to the horizon."""
    chosen = np.random.default_rng(8).permutation(len(over(name).family))[:20]
    rising: np.ndarray = chosen[np.argsort(over(name).places.tilt[chosen], kind="stable")]
    return rising[np.linspace(0, 19, count).round().astype(int)]


def angles(name: str, point: int) -> tuple[float, float, float]:
    """Azimuth, tilt and roll of a point."""
    places = over(name).places
    assert places.roll is not None
    return float(places.azimuth[point]), float(places.tilt[point]), float(places.roll[point])


def distance(name: str, found: np.ndarray, expected: np.ndarray) -> float:
    """Greatest relative distance over frequency of receptances (f, 6, 6), rotations scaled by the platform's radius."""
    scale = np.r_[np.ones(3), np.full(3, float(over(name).machine.characteristic_length))]
    weight = scale[:, None] * scale
    apart = np.linalg.norm((found - expected) * weight, axis=(1, 2)) / np.linalg.norm(expected * weight, axis=(1, 2))
    return float(apart.max())


@pytest.mark.parametrize("name", HEIGHTS)
def test_twenty_poses_of_the_mesh(name: str) -> None:
    found = over(name)
    points = some(name, 20)
    assert found.places.tilt[points[0]] < 0.3
    assert found.places.tilt[points[-1]] == pytest.approx(math.pi / 2)
    for point in points:
        pose = zyz_frame(found.places.position[point], *angles(name, point))
        expected = receptance(
            found.machine, pose, parse_mode(found.machine), found.frequency, method="direct", elements=16, loss_factor=ETA
        )
        assert distance(name, responses(name)[point], expected) < CLOSE


def turned(azimuth: float, tilt: float, roll: float) -> np.ndarray:
    """Rz(azimuth) Ry(tilt) Rz(roll)."""

    def about_z(angle: float) -> np.ndarray:
        return np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])

    about_y = np.array([[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]])
    return about_z(azimuth) @ about_y @ about_z(roll)


def least(response: Callable[[np.ndarray], np.ndarray], axis: int) -> tuple[float, float]:
    """Dynamic stiffness along an axis where it is least, and that frequency, Hz."""

    def stiffness(frequency: float) -> float:
        return float(1 / abs(response(np.array([frequency]))[0, axis, axis]))

    grid = np.linspace(LOW, HIGH, 4000)
    peak = int(np.argmax(abs(response(grid)[:, axis, axis])))
    around = grid[[max(peak - 1, 0), min(peak + 1, len(grid) - 1)]]
    found = minimize_scalar(stiffness, bounds=around, method="bounded")
    return found.fun, found.x


@opensees
@pytest.mark.parametrize("name", HEIGHTS)
def test_poses_of_opensees(name: str) -> None:
    """Responses in all directions, the least dynamic stiffnesses and where over frequency they are."""
    found = over(name)
    for point in some(name, 4):
        build(name, BALL, found.places.position[point], turned(*angles(name, point)), Vibration(FINE, False, False))
        response = partial(superposition, *modes(40), compliance())
        assert distance(name, responses(name)[point], response(found.frequency)) < CLOSE
        for k, axis in enumerate(AXES.index(entry[0]) for entry in DIAGONAL):
            stiffness, frequency = least(response, axis)
            np.testing.assert_allclose(found.stiffness[point, k], stiffness, rtol=CLOSE)
            np.testing.assert_allclose(found.at_frequency[point, k], frequency, rtol=CLOSE / 5)
