"""Points by index: laws of each sampling, whatever is asked for together, and SciPy and SALib as witnesses."""

from __future__ import annotations

import itertools
import math
import warnings
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest, qmc

from trivet.design.sampling import MOST, Grid, LatinHypercube, Random, Saltelli, Sampling, Sobol, sampling
from trivet.errors import InputError

Array = NDArray[Any]

ALL = [
    Grid((3, 1, 7, 5)), Random(107, 3, 5), LatinHypercube(107, 3, 5), Sobol(107, 3, 5), Saltelli(21, 3, 5),
    Random(1, 2), LatinHypercube(1, 2), Sobol(1, 2), Grid((1,)),
]  # fmt: skip


@pytest.mark.parametrize("own", ALL, ids=str)
def test_points_are_the_same_whichever_are_asked_for_together(own: Sampling) -> None:
    together = own.points(0, own.count)
    assert together.shape == (own.count, own.dimensions)
    assert own.points(0, 0).shape == (0, own.dimensions)
    for size in (1, 2, 5, 64):
        parts = [own.points(k, min(k + size, own.count)) for k in range(0, own.count, size)]
        assert np.array_equal(np.concatenate(parts), together)
    with pytest.raises(ValueError, match="points"):
        own.points(0, own.count + 1)


@pytest.mark.parametrize("own", [one for one in ALL if not isinstance(one, Grid)], ids=str)
def test_points_lie_in_the_unit_cube_and_follow_the_seed(own: Sampling) -> None:
    points = own.points(0, own.count)
    assert points.min() >= 0
    assert points.max() < 1
    other = type(own)(own.count, own.dimensions, 6)  # type: ignore[call-arg]
    assert not np.any(other.points(0, own.count) == points)


@pytest.mark.parametrize(("count", "dimensions", "seed"), [(1, 1, 0), (2, 3, 1), (1000, 5, 7), (4096, 40, 2**32 - 1)])
def test_sobol_points_are_those_of_scipy(count: int, dimensions: int, seed: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a number that is no power of two
        expected = qmc.Sobol(dimensions, scramble=True, rng=seed).random(count)
    assert np.array_equal(Sobol(count, dimensions, seed).points(0, count), expected)


def test_sobol_points_far_out_are_those_of_scipy() -> None:
    own, far = Sobol(50_000_000, 2, 3), 49_999_000
    expected = qmc.Sobol(2, scramble=True, rng=3).fast_forward(far).random(1000)
    assert np.array_equal(own.points(far, own.count), expected)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 1000, 65537])
def test_a_latin_hypercube_has_one_point_in_each_stratum(count: int) -> None:
    strata = np.floor(LatinHypercube(count, 3, 11).points(0, count) * count).astype(int)
    assert np.array_equal(np.sort(strata, axis=0), np.repeat(np.arange(count)[:, None], 3, axis=1))


def test_every_order_of_few_strata_is_as_likely_as_the_others() -> None:
    orders = [tuple(np.floor(LatinHypercube(4, 1, seed).points(0, 4)[:, 0] * 4)) for seed in range(2400)]
    counts = [orders.count(order) for order in itertools.permutations(range(4))]
    assert sum((count - 100) ** 2 for count in counts) / 100 < 49.7  # chi squared, 23 degrees of freedom, p = 0.001


@pytest.mark.parametrize("own", [Random(4000, 4, 1), LatinHypercube(4000, 4, 1)], ids=str)
def test_random_points_are_uniform_and_their_coordinates_and_neighbours_unrelated(own: Sampling) -> None:
    points = own.points(0, own.count)
    if isinstance(own, Random):
        assert all(kstest(column, "uniform").pvalue > 1e-3 for column in points.T)
    within = points * own.count % 1
    assert all(kstest(column, "uniform").pvalue > 1e-3 for column in within.T)
    related = np.corrcoef(np.hstack([points[:-1], points[1:]]).T) - np.eye(8)
    assert np.abs(related).max() < 4 / math.sqrt(own.count)


def test_a_grid_has_all_levels_with_all_others_the_last_dimension_fastest() -> None:
    expected = list(itertools.product((0.0, 0.5, 1.0), (0.5,), (0.0, 1.0), (0.0, 0.25, 0.5, 0.75, 1.0)))
    assert np.array_equal(Grid((3, 1, 2, 5)).points(0, 30), expected)


def test_a_billion_points_take_no_more_memory_than_those_asked_for() -> None:
    for own in (Grid((1000, 1000, 1000)), Random(MOST, 3), LatinHypercube(MOST, 3)):
        last = own.points(MOST - 10, MOST)
        assert last.shape == (10, 3)
        assert np.array_equal(last[3:], own.points(MOST - 7, MOST))
        assert len(np.unique(own.points(MOST - 1000, MOST)[:, -1])) == 1000


def test_saltelli_points_give_the_indices_of_a_known_function() -> None:
    from SALib.analyze import sobol

    own = Saltelli(4096, 3, 1)
    x = np.pi * (2 * own.points(0, own.count) - 1)
    a, b = 7.0, 0.1
    y = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
    problem = {"num_vars": 3, "names": ["1", "2", "3"], "bounds": [[0, 1]] * 3}
    found = sobol.analyze(problem, y, calc_second_order=False, seed=1, num_resamples=2)
    # Ishigami and Homma 1990: parts of the variance in closed form.
    v1, v2, v13 = 0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, 8 * b**2 * np.pi**8 / 225
    total = v1 + v2 + v13
    assert np.allclose(found["S1"], [v1 / total, v2 / total, 0], atol=0.02)
    assert np.allclose(found["ST"], [(v1 + v13) / total, v2 / total, v13 / total], atol=0.02)


def test_saltelli_points_are_halves_of_one_sequence() -> None:
    own = Saltelli(8, 2, 4)
    both = Sobol(8, 4, 4).points(0, 8)
    rows = own.points(0, own.count).reshape(8, 4, 2)
    assert np.array_equal(rows[:, 0], both[:, :2])
    assert np.array_equal(rows[:, 1], both[:, [2, 1]])
    assert np.array_equal(rows[:, 2], both[:, [0, 3]])
    assert np.array_equal(rows[:, 3], both[:, 2:])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sobol", 3, None), 'count: is missing; method = "sobol"'),
        (("random", 3, 0), "count: 0 designs; expected 1 to 1000000000"),
        (("latin-hypercube", 3, MOST + 1), "count: 1000000001 designs"),
        (("random", 0, 3), "dimensions: 0; expected at least 1"),
        (("sobol", 30_000, 3), "dimensions: 30000; .* at most 21201"),
        (("grid", 3, 8, 0, (2, 2, 2)), "count: 8; that of a grid follows"),
        (("grid", 2, None, 0, (100_000, 100_000)), "steps: 10000000000 designs"),
    ],
)
def test_wrong_counts_are_refused(arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        sampling(*arguments)


def test_a_sampling_is_had_by_its_name() -> None:
    assert sampling("grid", 2, None, 0, [2, 3]) == Grid((2, 3))
    assert sampling("latin-hypercube", 2, 5, 3) == LatinHypercube(5, 2, 3)
    assert sampling("sobol", 2, 5, 3) == Sobol(5, 2, 3)
    assert sampling("random", 2, 5, 3) == Random(5, 2, 3)


def test_too_many_designs_for_indices_are_refused() -> None:
    with pytest.raises(InputError, match="count: 500000000, with 5 designs of each: 2500000000 designs"):
        Saltelli(500_000_000, 3)
