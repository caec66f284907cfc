"""Receptances along directions at many poses, their greatest values and slopes, against single poses and differences."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import numpy as np
import pytest
from machines import part

from trivet.errors import InputError
from trivet.kinematics.mode import parse_mode
from trivet.model import Machine, dimensions, load
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.symmetric import Symmetric
from trivet.vibration import directional, spectral
from trivet.vibration.directional import Asked, Entries, greatest, receptances
from trivet.vibration.least import bound, least, with_slopes
from trivet.vibration.resonance import greatest as greatest_of_one

pytestmark = pytest.mark.usefixtures("quick_kernels")

LOSS, LOW, HIGH = 0.02, 20.0, 900.0
DIAGONAL = [(axis, axis) for axis in ("x", "y", "z")]
COUNT = directional.CHUNK + 2
"""Poses, of which the last call is filled up.  The same in most tests: kernels are compiled for every number of them."""


def some_poses(machine: Machine, count: int, seed: int) -> tuple[Frame, Any]:
    random = np.random.default_rng(seed)
    place = np.array(machine.home.position) + random.uniform(-0.003, 0.003, (count, 3))
    angles = random.uniform(-3, 3, count), random.uniform(0, 0.2, count), random.uniform(-0.3, 0.3, count)
    return zyz_frame(place, *angles), parse_mode(machine)


def asked(machine: Machine, count: int = COUNT, names: Any = DIAGONAL, seed: int = 1, point: Any = None) -> Asked:
    poses, signs = some_poses(machine, count, seed)
    return Asked.of(machine, poses, signs, Entries.named(names), LOSS, point)


def test_products_without_the_inverse() -> None:
    random = np.random.default_rng(2)
    half = random.normal(size=(6, 6)) + 1j * random.normal(size=(6, 6))
    matrix = half + half.T + 9 * np.eye(6)
    columns = random.normal(size=(4, 6))
    columns[1, 2:] = 0
    pairs = [(0, 0), (1, 2), (3, 1), (1, 1)]
    rows = [[0 if c == 0 else c for c in column] for column in columns]
    found, determinant = Symmetric.of(6, matrix[np.triu_indices(6)]).products(rows, pairs)
    expected = columns @ np.linalg.inv(matrix) @ columns.T
    np.testing.assert_allclose(found, [expected[a, b] for a, b in pairs], rtol=1e-10)
    np.testing.assert_allclose(determinant, np.linalg.det(matrix), rtol=1e-10)


@pytest.mark.parametrize("name", ["azulay", "glozman", "gough-stewart"])
def test_many_poses_are_single_poses(name: str) -> None:
    machine = load(name)
    names = [*DIAGONAL, ("x", "ry"), ("rz", "rz")]
    several = asked(machine, names=names)
    frequency = np.linspace(LOW, HIGH, 70)
    signs = several.stand.signs
    found = np.concatenate([values for _, values in receptances(several, frequency)])
    for k in (0, COUNT - 1):
        whole = np.asarray(spectral.receptance(machine, part(several.poses, k), signs, frequency, LOSS))
        expected = np.stack([whole[:, 0, 0], whole[:, 1, 1], whole[:, 2, 2], whole[:, 0, 4], whole[:, 5, 5]])
        scale = np.abs(expected).max(axis=1, keepdims=True)
        assert np.abs(found[k] - expected).max() < 1e-9 * scale.max()
        assert np.all(np.abs(found[k] - expected) < 1e-7 * np.maximum(np.abs(expected), 1e-3 * scale.min()))


def test_a_point_of_the_platform() -> None:
    machine = load("azulay")
    point = (0.004, -0.003, 0.05)
    several = asked(machine, names=[("x", "x"), ("y", "z"), ("x", "rz")], point=point)
    frequency = np.linspace(LOW, HIGH, 70)
    found = np.concatenate([values for _, values in receptances(several, frequency)])
    for k in (0, COUNT - 1):
        pose = part(several.poses, k)
        whole = np.asarray(spectral.receptance(machine, pose, several.stand.signs, frequency, LOSS))
        x, y, z = np.array([pose.x, pose.y, pose.z]).T @ point
        there = np.eye(6)
        there[:3, 3:] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        moved = there @ whole @ there.T
        expected = np.stack([moved[:, 0, 0], moved[:, 1, 2], moved[:, 0, 5]])
        scale = np.abs(expected).max(axis=1, keepdims=True)
        assert np.all(np.abs(found[k] - expected) < 1e-8 * scale)


@pytest.mark.parametrize("name", ["azulay", "eclipse", "straight-column"])
def test_the_greatest_is_that_of_single_poses(name: str) -> None:
    machine = load(name).with_spherical(300.0) if name != "straight-column" else load(name)
    several = asked(machine, names=[*DIAGONAL, ("rz", "rz")])
    found = greatest(several, LOW, HIGH, LOSS)
    places = [0, 1, 2, 5]
    for k in (0, 1, COUNT - 1):
        answer = spectral.prepared(machine, part(several.poses, k), several.stand.signs, HIGH, LOSS)
        peaks = greatest_of_one(lambda f, answer=answer: np.abs(np.asarray(answer(f))[:, places, places]), LOW, HIGH, LOSS)
        np.testing.assert_allclose(found.size[k], [peak.size for peak in peaks], rtol=1e-8)
        np.testing.assert_allclose(found.frequency[k], [peak.frequency for peak in peaks], rtol=1e-5)


def test_a_pose_that_is_not_reached_has_no_value() -> None:
    machine = load("azulay")
    signs = parse_mode(machine)
    places = np.tile((0.0, 0.0, 0.125), (COUNT, 1))
    places[1, 2] = 0.9
    poses = zyz_frame(places, 0.0, 0.0, 0.0)
    found = greatest(Asked.of(machine, poses, signs, Entries.named(DIAGONAL), LOSS), LOW, HIGH, LOSS)
    assert np.isfinite(found.size).all(axis=1).tolist() == [k != 1 for k in range(COUNT)]
    assert np.isfinite(found.frequency).all(axis=1).tolist() == [k != 1 for k in range(COUNT)]


def test_wrong_ranges() -> None:
    several = asked(load("azulay"), 1)
    with pytest.raises(InputError, match="rises"):
        greatest(several, 100.0, 50.0, LOSS)
    with pytest.raises(InputError, match="damping"):
        greatest(several, 50.0, 100.0, 0.0)


@pytest.mark.parametrize("name", ["azulay", "glozman"])
def test_slopes_of_the_least_and_of_its_bound(name: str) -> None:
    machine = load(name).with_theory("timoshenko")
    poses, signs = some_poses(machine, 2, seed=4)
    entries = Entries.named([("x", "x"), ("z", "z")])

    def of(own: Machine) -> Asked:
        return Asked.of(own, poses, signs, entries, LOSS)

    found, smooth = least(of(machine), LOW, HIGH, LOSS), bound(of(machine), LOW, HIGH, LOSS)
    leaves, shape = jax.tree.flatten(machine)
    paths = list(dimensions(machine))
    assert len(paths) == len(leaves)
    taken = [k for k, path in enumerate(paths) if leaves[k] != 0 and np.any(found.slopes[path] != 0)]
    for k in np.random.default_rng(3).choice(taken, 4, replace=False):
        value = float(leaves[k])

        def with_value(number: float, k: int = k) -> Asked:
            return of(jax.tree.unflatten(shape, [*leaves[:k], number, *leaves[k + 1 :]]))

        for ours, stiffness in (
            (found, lambda own: 1 / greatest(own, LOW, HIGH, LOSS).size),
            (smooth, lambda own: bound(own, LOW, HIGH, LOSS, slopes=False).stiffness),
        ):
            near, far = (
                (stiffness(with_value(value + step)) - stiffness(with_value(value - step))) / (2 * step)
                for step in (1e-5 * abs(value), 2e-5 * abs(value))
            )
            difference = (4 * near - far) / 3  # after Richardson
            close = 1e-5 * np.maximum(np.abs(difference), 1e-2 * np.abs(ours.stiffness / value))
            assert np.all(np.abs(ours.slopes[paths[k]] - difference) < close), paths[k]


def test_the_bound_is_one() -> None:
    for name in ("azulay", "glozman", "gough-stewart"):
        machine = load(name)
        several = asked(machine, 3, [*DIAGONAL, ("rx", "rx")], seed=9)
        there = 1 / greatest(several, LOW, HIGH, LOSS).size
        below = bound(several, LOW, HIGH, LOSS, slopes=False).stiffness
        assert np.all(below <= there), name
        assert np.all(below > 0.85 * there), name


def test_slopes_at_known_frequencies_need_no_search() -> None:
    # As in the test of slopes: their kernel takes long to compile.
    several = asked(load("azulay").with_theory("timoshenko"), 2, [("x", "x"), ("z", "z")], seed=4)
    found = greatest(several, LOW, HIGH, LOSS)
    again = with_slopes(several, found)
    np.testing.assert_allclose(again.stiffness, 1 / found.size)
    doubled = dataclasses.replace(several, loss_factor=LOSS)
    whole = least(doubled, LOW, HIGH, LOSS)
    assert all(np.allclose(again.slopes[path], whole.slopes[path]) for path in again.slopes)
