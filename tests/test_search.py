"""Least values over families of poses and over the circle, of functions whose least values are known."""

from __future__ import annotations

import numpy as np
import pytest

from trivet.space.family import Axis, Family, Places
from trivet.space.search import lowest, lowest_angles

AXES = (Axis("x"), Axis("y"))


def edge(coordinates: np.ndarray) -> np.ndarray:
    return np.clip(coordinates, -1, 1)


def bowl(coordinates: np.ndarray) -> np.ndarray:
    return np.hypot(coordinates[:, 0] - 0.31, 2 * (coordinates[:, 1] + 0.27)) + 0.1 * np.cos(20 * coordinates[:, 0])


def plane(coordinates: np.ndarray) -> Places:
    inside = np.all(np.abs(coordinates) <= 1, axis=1)[:, None]
    flat = np.where(inside, np.column_stack([coordinates, np.zeros(len(coordinates))]), np.nan)
    return Places(flat, np.zeros(len(flat)), np.zeros(len(flat)), None)


def test_lowest_is_that_of_a_fine_grid() -> None:
    line = np.linspace(-1, 1, 9)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    family = Family("square", grid, np.array([0.25, 0.25]), plane, AXES, edge)
    found = lowest(family, bowl(grid), lambda c, bound: bowl(c))
    fine = np.linspace(-1, 1, 1601)
    brute = bowl(np.stack(np.meshgrid(fine, fine, indexing="ij"), axis=-1).reshape(-1, 2)).min()
    assert found.value <= brute
    np.testing.assert_allclose(found.value, brute, atol=2e-3)
    np.testing.assert_allclose(bowl(found.coordinates[None])[0], found.value)
    # At an edge, beyond which the function has no value.
    least = lowest(family, grid @ [1.0, 0.5], lambda c, bound: np.where(np.all(np.abs(c) <= 1, axis=1), c @ [1.0, 0.5], np.nan))
    np.testing.assert_allclose(least.coordinates, [-1, -1], atol=1e-5)
    assert np.isnan(lowest(family, np.full(len(grid), np.nan), lambda c, bound: bowl(c)).value)


def test_the_lowest_point_of_a_grid_may_lead_astray() -> None:
    """A wide valley, and a narrow one beside a point of the grid."""

    def valleys(x: np.ndarray) -> np.ndarray:
        return np.minimum((x[:, 0] + 0.5) ** 2, 21 * np.abs(x[:, 0] - 0.45) - 1)

    grid = np.linspace(-1, 1, 21)[:, None]
    family = Family("line", grid, np.array([0.1]), plane, AXES[:1], edge)
    np.testing.assert_allclose(grid[valleys(grid).argmin()], -0.5)
    found = lowest(family, valleys(grid), lambda c, bound: valleys(c))
    np.testing.assert_allclose((found.coordinates[0], found.value), (0.45, -1), atol=1e-4)


class Circle:
    """Functions with a smooth bottom (even numbers) or a sharp one (odd numbers) at known angles; number 3 has no values."""

    def __init__(self, count: int = 40) -> None:
        self.bottom = np.linspace(0, 2 * np.pi, count, endpoint=False) + 0.01
        self.looks = np.zeros(count, dtype=int)

    def __call__(self, which: np.ndarray, angle: np.ndarray) -> np.ndarray:
        np.add.at(self.looks, which, 1)
        apart = np.mod(angle - self.bottom[which] + np.pi, 2 * np.pi) - np.pi
        values = np.where(which % 2 == 0, 1 - np.cos(apart), np.abs(apart)) + which
        return np.where(which == 3, np.nan, values)


def test_lowest_angles_smooth_and_sharp() -> None:
    circle = Circle()
    found = lowest_angles(circle, 40, 36)
    known = np.arange(40) != 3
    np.testing.assert_allclose(found.angle[known], circle.bottom[known], atol=1e-6)
    np.testing.assert_allclose(found.value[known], np.arange(40)[known], atol=1e-6)
    assert np.isnan(found.angle[3])
    assert np.isnan(found.value[3])
    assert np.all((found.angle[known] >= 0) & (found.angle[known] < 2 * np.pi))


def test_the_lower_of_two_valleys() -> None:
    """The valley which the grid shows lower is not the lower one."""

    def valleys(which: np.ndarray, angle: np.ndarray) -> np.ndarray:
        narrow = 3 * np.abs(angle - (1.0 + 0.4 * 2 * np.pi / 24)) - 1.0
        return np.minimum(narrow, np.square(angle - 4.0) - 0.9)

    found = lowest_angles(valleys, 1, 24)
    np.testing.assert_allclose((found.angle[0], found.value[0]), (1.0 + 0.4 * 2 * np.pi / 24, -1.0), atol=1e-6)


def test_a_function_that_ends_on_its_way_down() -> None:
    found = lowest_angles(lambda which, angle: np.where((angle > 1.01) & (angle < 2.0 + which), angle, np.nan), 3, 36)
    np.testing.assert_allclose(found.angle, 1.01, atol=1e-6)


def test_no_angle_is_better() -> None:
    found = lowest_angles(lambda which, angle: np.full(len(which), 7.0), 2, 12)
    assert found.value.tolist() == [7.0, 7.0]
    assert np.isfinite(found.angle).all()


def test_what_is_enough_ends_the_search() -> None:
    circle = Circle()
    tried = np.column_stack([circle.bottom + 2.0, circle.bottom + 0.5])
    enough = np.arange(40) + np.where(np.arange(40) < 20, 0.6, -1.0)
    found = lowest_angles(circle, 40, 36, tried=tried, enough=enough)
    assert circle.looks[[0, 1, 10, 19]].tolist() == [2, 2, 2, 2]
    np.testing.assert_allclose(found.angle[[0, 10]], circle.bottom[[0, 10]] + 0.5)
    assert np.all(circle.looks[20:] > 38)
    np.testing.assert_allclose(found.angle[20:], circle.bottom[20:], atol=1e-6)


def test_a_period() -> None:
    found = lowest_angles(lambda which, angle: -np.cos(3 * (angle - 1.7)), 1, 12, period=2 * np.pi / 3)
    np.testing.assert_allclose(found.angle, 1.7, atol=1e-6)


def test_a_valley_that_leaves_through_a_corner() -> None:
    """Steps that would go beyond an edge go on along it."""

    def valley(c: np.ndarray) -> np.ndarray:
        return 20 * np.abs(c[:, 0] - 1.17 * c[:, 1] + 0.12) - c[:, 0] - 0.3 * c[:, 1]

    line = np.linspace(-1, 1, 4)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    family = Family("square", grid, np.full(2, line[1] - line[0]), plane, AXES, edge)
    found = lowest(family, valley(grid), lambda c, bound: valley(c))
    np.testing.assert_allclose(found.coordinates, [1.0, 1.12 / 1.17], atol=1e-4)


@pytest.mark.parametrize("steps", [7, 9, 12])
@pytest.mark.parametrize(("steep", "error"), [(5.0, 1e-7), (20.0, 2e-5)])
def test_a_sharp_and_narrow_valley_that_bends(steps: int, steep: float, error: float) -> None:
    """A ring with two low places, of which the grid shows neither."""

    def ring(c: np.ndarray) -> np.ndarray:
        angle = np.arctan2(c[:, 1], c[:, 0])
        along = 0.05 * np.cos(2 * (angle - 0.4)) + 0.01 * np.cos(angle - 0.4)
        return steep * np.abs(np.hypot(*c.T) - 0.71) + along

    line = np.linspace(-1, 1, steps)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    family = Family("square", grid, np.full(2, line[1] - line[0]), plane, AXES, edge)
    found = lowest(family, ring(grid), lambda c, bound: ring(c))
    angle = np.linspace(0, 2 * np.pi, 100_001)
    least = ring(0.71 * np.column_stack([np.cos(angle), np.sin(angle)])).min()
    np.testing.assert_allclose(found.value, least, rtol=0, atol=error)


def test_what_is_not_below_its_bound_does_not_matter() -> None:
    """Each start has its own bound: the second is long above that of the first before it gets below it."""

    def valleys(c: np.ndarray) -> np.ndarray:
        return np.minimum(np.square(c[:, 0] + 0.5), 2 * np.abs(c[:, 0] - 0.37123) - 0.001)

    grid = np.linspace(-1, 1, 21)[:, None]
    family = Family("line", grid, np.array([0.1]), plane, AXES[:1], edge)
    known = lowest(family, valleys(grid), lambda c, bound: valleys(c))
    lazy = lowest(family, valleys(grid), lambda c, bound: np.where(valleys(c) < bound, valleys(c), bound + 5.0))
    np.testing.assert_allclose(known.coordinates, 0.37123, atol=1e-6)
    assert lazy.value == known.value
    np.testing.assert_array_equal(lazy.coordinates, known.coordinates)
