"""Vectors, frames, screws and small symmetric matrices obey their laws, with zeros known at trace time and without."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trivet.space.frame import IDENTITY, Angle, Frame, about_z
from trivet.space.pose import rolled, steady_angles, tangent_axes, zyz_frame
from trivet.space.scalar import Scalar, add, is_zero, mul, sub
from trivet.space.screw import Twist, Wrench, rotation, translation
from trivet.space.singular import least_singular_values
from trivet.space.symmetric import Symmetric
from trivet.space.vector import ZERO, Vec, X, Y, Z

components = st.one_of(st.sampled_from([0, 1, -1, 0.0]), st.floats(-1e3, 1e3))
vectors = st.builds(Vec, components, components, components)
angles = st.floats(-7, 7)
directions = st.one_of(
    st.sampled_from([(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)]),
    st.tuples(angles, angles).map(lambda a: (math.cos(a[0]) * math.cos(a[1]), math.sin(a[0]) * math.cos(a[1]), math.sin(a[1]))),
)
turns = st.lists(st.tuples(directions, angles), min_size=0, max_size=3)


def angle(value: float) -> Angle:
    return Angle(math.cos(value), math.sin(value))


def array(v: Vec) -> np.ndarray:
    return np.array(v, dtype=float)


def frame(origin: Vec, turned: list[tuple[tuple[float, float, float], float]]) -> Frame:
    found = IDENTITY._replace(origin=origin)
    for axis, value in turned:
        found = found.turn(axis, angle(value))
    return found


frames = st.builds(frame, vectors, turns)


def close(a: object, b: object, scale: float = 1.0) -> None:
    np.testing.assert_allclose(np.array(a, dtype=float), np.array(b, dtype=float), rtol=0, atol=1e-12 * max(scale, 1.0))


@given(components, components)
def test_scalars_fold_to_the_same_numbers(a: Scalar, b: Scalar) -> None:
    for folded, plain in ((add(a, b), a + b), (sub(a, b), a - b), (mul(a, b), a * b)):
        assert folded == plain


def test_known_zeros_stay_known_while_tracing() -> None:
    def kernel(a: Scalar) -> Scalar:
        assert is_zero(mul(0, a))
        assert is_zero(mul(a, 0))
        assert add(0, a) is a
        assert add(a, 0) is a
        assert sub(a, 0) is a
        assert mul(1, a) is a
        assert not is_zero(mul(2, a))
        assert not is_zero(sub(a, a))
        return a

    jax.make_jaxpr(kernel)(1.0)


def test_a_known_zero_annihilates_what_is_not_finite() -> None:
    assert mul(0, math.nan) == mul(math.inf, 0) == 0


@given(vectors, vectors, components)
def test_vectors_are_those_of_numpy(a: Vec, b: Vec, factor: Scalar) -> None:
    size = 1 + np.linalg.norm(array(a)) * np.linalg.norm(array(b))
    close(a + b, array(a) + array(b))
    close(a - b, array(a) - array(b))
    close(-a, -array(a))
    close(a * factor, array(a) * factor, 1e6)
    close(a @ b, array(a) @ array(b), size)
    close(a.cross(b), np.cross(array(a), array(b)), size)


def rodrigues(axis: tuple[float, float, float], value: float) -> np.ndarray:
    a = np.array(axis)
    skew = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + math.sin(value) * skew + (1 - math.cos(value)) * skew @ skew


@given(frames, directions, angles)
def test_a_turn_is_about_the_frames_own_axis(start: Frame, axis: tuple[float, float, float], value: float) -> None:
    turned = start.turn(axis, angle(value))
    close(turned.matrix(), np.array(start.matrix(), dtype=float) @ rodrigues(axis, value))
    close(turned.origin, start.origin)


@pytest.mark.parametrize("aside", [1e-12, 1e-9, 1e-8, 1e-4])
def test_an_axis_nearly_along_one_of_the_frame(aside: float) -> None:
    axis = (math.cos(aside), math.sin(aside), 0.0)
    np.testing.assert_allclose(IDENTITY.turn(axis, angle(1.0)).matrix(), rodrigues(axis, 1.0), rtol=0, atol=1e-15)


@given(frames)
def test_axes_are_orthonormal_and_right_handed(found: Frame) -> None:
    matrix = np.array(found.matrix(), dtype=float)
    close(matrix.T @ matrix, np.eye(3))
    close(found.x.cross(found.y), found.z)


@given(frames, frames, frames)
def test_placing_is_associative_and_has_a_unit(a: Frame, b: Frame, c: Frame) -> None:
    for left, right in ((a.place(b).place(c), a.place(b.place(c))), (a.place(IDENTITY), a), (IDENTITY.place(a), a)):
        close(left.matrix(), right.matrix())
        close(left.origin, right.origin, 1e4)


@given(frames, vectors)
def test_directions_and_shifts(found: Frame, v: Vec) -> None:
    outer = np.array(found.matrix(), dtype=float) @ array(v)
    close(found.direction(v), outer, 1e4)
    close(found.shift(v).origin, array(found.origin) + outer, 1e4)


@given(vectors, angles)
def test_about_z(v: Vec, value: float) -> None:
    close(about_z(angle(value), v), rodrigues((0.0, 0.0, 1.0), value) @ array(v), 1e4)


@given(angles, angles, angles)
def test_poses_are_turned_about_z_y_z(azimuth: float, tilt: float, roll: float) -> None:
    y, z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    expected = rodrigues(z, azimuth) @ rodrigues(y, tilt) @ rodrigues(z, roll)
    pose = zyz_frame((1.0, 2.0, 3.0), azimuth, tilt, roll)
    close(pose.matrix(), expected)
    close(pose.origin, (1, 2, 3))
    close(frame(ZERO, [(z, azimuth), (y, tilt), (z, roll)]).matrix(), expected)
    close(np.array(tangent_axes(azimuth, tilt)), np.array(zyz_frame((0, 0, 0), azimuth, tilt, 0.0)[1:])[[2, 0, 1]])
    close(rolled(pose, angle(0.3)).matrix(), zyz_frame((0, 0, 0), azimuth, tilt, roll + 0.3).matrix())


def test_poses_broadcast() -> None:
    pose = zyz_frame(np.zeros((5, 1, 3)), np.zeros((5, 1)), 0.1, np.linspace(0, 1, 7))
    assert np.shape(pose.x.x) == (5, 7)


LEVEL = st.sampled_from([0.0, math.pi, -math.pi])
TILTS = st.one_of(LEVEL, st.floats(0.1, 3.0))


@given(st.lists(st.tuples(angles, TILTS, angles), min_size=2, max_size=6))
def test_poses_that_change_steadily_are_the_poses(given: list[tuple[float, float, float]]) -> None:
    azimuth, tilt, roll = np.array(given).T
    found = steady_angles(azimuth, tilt, roll)
    close(zyz_frame((0, 0, 0), *found).matrix(), zyz_frame((0, 0, 0), azimuth, tilt, roll).matrix())
    for turns in found[::2]:
        assert np.all(np.abs(np.diff(turns)) <= math.pi + 1e-12)
    # Where it is level, the azimuth is that of the pose before it, or after it.
    level = np.abs(np.sin(tilt)) < 1e-12
    if not level.all():
        first = int(np.argmin(level))
        change = np.diff(found[0])
        np.testing.assert_array_equal(change[:first], 0)
        np.testing.assert_array_equal(change[first:][level[first + 1 :]], 0)


@given(vectors, vectors, vectors)
def test_a_rotation_moves_points_as_it_should(axis: Vec, through: Vec, at: Vec) -> None:
    twist = rotation(axis, through, at)
    close(twist.linear, np.cross(array(axis), array(at) - array(through)), 1e7)
    close(twist.angular, axis)
    close(rotation(axis, at, at).linear, (0, 0, 0))


@given(vectors, vectors, vectors, vectors, vectors, angles)
def test_power_does_not_depend_on_axes_and_point(force: Vec, moment: Vec, v: Vec, omega: Vec, arm: Vec, heading: float) -> None:
    # A wrench carried to another point, on the motion which that point sees, has the power of the wrench on the twist.
    turn = angle(heading)
    v_out, omega_out = about_z(turn, v), about_z(turn, omega)
    there = Twist(v_out - omega_out.cross(arm), omega_out)
    here = Wrench(force, moment) @ Twist(v, omega)
    close(Wrench(force, moment).carried(turn, arm) @ there, here, 1e10)
    assert Wrench(force, moment) @ translation(v) == force @ v
    close(Wrench(force, moment).plus(Wrench(v, omega), 2.0).moment, array(moment) + 2 * array(omega), 1e4)


@st.composite
def matrices(draw: st.DrawFn) -> Symmetric:
    """Positive definite, block diagonal after a shuffle: what stands outside the blocks is a known zero."""
    size = draw(st.integers(1, 6))
    block = draw(st.lists(st.integers(0, 2), min_size=size, max_size=size))
    noise = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).normal(size=(size, size))
    same = np.array(block)[:, None] == np.array(block)
    dense = (noise * same) @ (noise * same).T + 0.1 * np.eye(size)
    matrix = Symmetric(size)
    for i in range(size):
        for j in range(i, size):
            matrix[i, j] = float(dense[i, j]) if same[i, j] else 0
    return matrix


def dense(matrix: Symmetric) -> np.ndarray:
    return np.array(matrix.full(), dtype=float)


@settings(max_examples=300)
@given(matrices())
def test_inverse_is_that_of_numpy(matrix: Symmetric) -> None:
    expected = np.linalg.inv(dense(matrix))
    np.testing.assert_allclose(dense(matrix.inverse()), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@given(matrices())
def test_inverse_keeps_the_blocks_and_their_zeros(matrix: Symmetric) -> None:
    inverse = matrix.inverse()
    assert sorted(i for block in matrix.blocks() for i in block) == list(range(matrix.size))
    for block in matrix.blocks():
        for i in block:
            for j in set(range(matrix.size)) - set(block):
                assert is_zero(inverse[i, j])


@given(st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_dyads_and_blocks(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix, expected = Symmetric(size), np.zeros((size, size))
    for _ in range(3):
        v, factor = rng.normal(size=size), rng.normal()
        matrix.add_dyad([float(c) for c in v], float(factor))
        expected += factor * np.outer(v, v)
    close(dense(matrix), expected, 1e2)
    picked = [int(i) for i in rng.permutation(size)[: max(1, size // 2)]]
    close(dense(matrix.block(picked)), expected[np.ix_(picked, picked)], 1e2)


def test_an_indefinite_matrix_is_inverted_too() -> None:
    matrix = Symmetric(4)
    for (i, j), value in {(0, 0): 1.0, (0, 3): 2.0, (3, 3): 1.0, (1, 2): 3.0, (1, 1): 1.0, (2, 2): -1.0}.items():
        matrix[i, j] = value
    close(dense(matrix.inverse()) @ dense(matrix), np.eye(4))


@settings(max_examples=30)
@given(vectors, directions, st.floats(0.1, 3))
def test_derivatives_pass_through_frames(point: Vec, axis: tuple[float, float, float], value: float) -> None:
    def place(turned: Scalar) -> jax.Array:
        found = IDENTITY.turn(axis, Angle(jax.numpy.cos(turned), jax.numpy.sin(turned))).shift(point).origin
        return jax.numpy.stack([jax.numpy.asarray(c, dtype=float) for c in found])

    expected = np.cross(axis, np.asarray(place(value)))
    close(jax.jacfwd(place)(value), expected, 1e4)


@pytest.mark.parametrize("axis", [X, Y, Z])
def test_a_full_turn_comes_back(axis: Vec) -> None:
    found = IDENTITY
    for _ in range(8):
        found = found.turn(axis, angle(math.pi / 4))
    close(found.matrix(), np.eye(3))


@pytest.mark.parametrize(
    "spectrum",
    [
        (3.0, 2.0, 2.0, 1.0, 1.0, 0.4),
        (3.0, 2.0, 2.0, 1.0, 0.1, 0.1),
        (3.0, 2.0, 2.0, 0.1, 0.1, 0.1),
        (3.0, 2.0, 2.0, 1.0, 0.1 + 1e-9, 0.1),
        (1e3, 1.0, 1.0, 1e-3, 1e-3, 1e-6),
        (1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
        (3.0, 2.0, 1.0, 1.0, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    ],
)
def test_least_singular_value_of_matrices_made_with_it(spectrum: tuple[float, ...]) -> None:
    """The values that come together, or vanish, are where a search for them stands still."""
    rng = np.random.default_rng(0)
    left, right = (np.linalg.qr(rng.normal(size=(300, 6, 6)))[0] for _ in range(2))
    matrices = np.moveaxis(left * spectrum @ right, 0, 2)
    found = np.asarray(least_singular_values(jnp.asarray(matrices)))
    assert np.abs(found - spectrum[-1]).max() < 1e-14 * spectrum[0]


@pytest.mark.parametrize("size", [2, 4, 6])
def test_least_singular_values_as_lapack_has_them(size: int) -> None:
    matrices = np.random.default_rng(1).normal(size=(size, size, 1000))
    matrices[0, :, 7] = matrices[:, 1, 8] = matrices[:, :, 9] = 0.0
    matrices[:, :, 10], matrices[:, :, 11] = np.eye(size), np.eye(size)[::-1]
    found = np.asarray(least_singular_values(jnp.asarray(matrices)))
    expected = np.linalg.svd(np.moveaxis(matrices, 2, 0), compute_uv=False)
    assert np.abs(found - expected[:, -1]).max() < 1e-14 * expected.max()


def test_least_singular_value_of_what_is_not_known_is_not_known() -> None:
    matrices = np.random.default_rng(2).normal(size=(6, 6, 36))
    for k in range(36):
        matrices[k // 6, k % 6, k] = np.nan
    assert np.isnan(least_singular_values(jnp.asarray(matrices))).all()
