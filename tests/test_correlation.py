"""Criteria of likeness: closed forms, what changes them and what does not, statistics, and MAC by a program of others."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from trivet.measure import correlation as c

BY_FUNCTION, BY_FREQUENCY = (c.frac, c.faac), (c.csac, c.csf)
SIZES = st.one_of(st.just(0.0), st.floats(1e-6, 1e3), st.floats(-1e3, -1e-6))


def complexes(*shape: int) -> Any:
    return st.tuples(arrays(float, shape, elements=SIZES), arrays(float, shape, elements=SIZES)).map(lambda p: p[0] + 1j * p[1])


FACTORS = st.tuples(st.floats(1e-3, 1e3), st.floats(-math.pi, math.pi)).map(lambda p: p[0] * np.exp(1j * p[1]))


def noise(*shape: int, seed: int = 4) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def modes(frequency: Any, shapes: np.ndarray, damping: float = 0.01) -> c.ModeSet:
    return c.ModeSet(np.array(frequency, float), np.full(len(frequency), damping), shapes)


@given(complexes(3, 5), complexes(3, 5), FACTORS)
def test_bounds_symmetry_and_scale(one: np.ndarray, other: np.ndarray, factor: complex) -> None:
    for shape, size in (BY_FUNCTION, BY_FREQUENCY):
        for criterion in (shape, size):
            found = criterion(one, other)
            assert np.all((found >= 0) & (found <= 1) | np.isnan(found))
            np.testing.assert_allclose(criterion(other, one), found, atol=1e-12)
            np.testing.assert_allclose(criterion(one.conj(), other.conj()), found, atol=1e-12)
            np.testing.assert_allclose(criterion(factor * one, factor * other), found, atol=1e-9)
        np.testing.assert_allclose(shape(factor * one, other), shape(one, other), atol=1e-9)
        # The mean of two squares is not below their product: the size criterion is the stricter one.
        assert np.all((size(one, other) <= np.sqrt(shape(one, other)) + 1e-12) | np.isnan(shape(one, other)))


@given(complexes(3, 5), FACTORS)
def test_of_what_differs_by_a_factor(one: np.ndarray, factor: complex) -> None:
    """The shape is the same; the size is 2 |c| / (1 + |c|^2), whatever the phase."""
    for (shape, size), axis in ((BY_FUNCTION, 1), (BY_FREQUENCY, 0)):
        moves = np.any(one != 0, axis=axis)
        np.testing.assert_allclose(shape(one, factor * one), np.where(moves, 1, np.nan), rtol=1e-9)
        expected = 2 * abs(factor) / (1 + abs(factor) ** 2)
        np.testing.assert_allclose(size(one, factor * one), np.where(moves, expected, np.nan), rtol=1e-9)


def test_closed_forms() -> None:
    one, other = np.array([[1.0, 1j, 0]]), np.array([[1.0, 0, 2]])
    assert c.frac(one, other) == pytest.approx(1 / (2 * 5))
    assert c.faac(one, other) == pytest.approx(2 / (2 + 5))
    assert c.csac(one.T, other.T) == pytest.approx(1 / (2 * 5))
    assert c.csf(one.T, other.T) == pytest.approx(2 / (2 + 5))
    # Conjugates are other functions: time runs backwards.
    assert c.frac(np.array([[1, 1j]]), np.array([[1, -1j]])) == pytest.approx(0)


def test_the_curvature_at_a_perfect_match() -> None:
    """1 - FAAC = e^2/2 for a size that is wrong by e; 1 - FRAC is the square of what is added at right angles."""
    one = noise(4, 50)
    across = noise(4, 50, seed=5)
    across -= one * (np.sum(one.conj() * across, axis=1) / np.sum(np.abs(one) ** 2, axis=1))[:, None]
    across *= (np.linalg.norm(one, axis=1) / np.linalg.norm(across, axis=1))[:, None]
    e = 1e-3
    np.testing.assert_allclose(1 - c.faac(one, (1 + e) * one), e**2 / 2, rtol=2e-3)
    np.testing.assert_allclose(1 - c.frac(one, one + e * across), e**2, rtol=1e-5)
    np.testing.assert_allclose(1 - c.faac(one, one + e * across), e**2 / 2, rtol=1e-5)


def test_of_noise_and_noise() -> None:
    """|x^H a|^2 of independent unit vectors of n complex normal numbers has the distribution Beta(1, n - 1)."""
    n, count = 6, 20_000
    found = c.frac(noise(count, n, seed=1), noise(count, n, seed=2))
    assert found.mean() == pytest.approx(1 / n, abs=4 * found.std() / math.sqrt(count))
    assert (found > 0.5).mean() == pytest.approx(0.5 ** (n - 1), abs=4 * math.sqrt(0.5 ** (n - 1) / count))


def test_what_is_not_known_does_not_count() -> None:
    one, other = noise(2, 6), noise(2, 6, seed=5)
    holes = other.copy()
    holes[0, 2], holes[1, :] = np.nan, np.nan
    kept = [0, 1, 3, 4, 5]
    assert c.frac(one, holes)[0] == pytest.approx(c.frac(one[:1, kept], other[:1, kept])[0])
    assert math.isnan(c.faac(one, holes)[1])
    assert math.isnan(c.csac(one, holes)[2])
    assert c.csf(one, holes)[0] == pytest.approx(c.faac(one[:1, :1], other[:1, :1])[0])
    assert math.isnan(c.frac(0 * one, other)[0])


@given(complexes(4, 2), complexes(4, 3), FACTORS)
def test_mac_bounds_and_scale(one: np.ndarray, other: np.ndarray, factor: complex) -> None:
    found = c.mac(one, other)
    assert found.shape == (2, 3)
    assert np.all((found >= 0) & (found <= 1) | np.isnan(found))
    np.testing.assert_allclose(c.mac(factor * one, other), found, atol=1e-9)
    np.testing.assert_allclose(c.mac(other, one).T, found, atol=1e-12)
    turned = np.linalg.qr(noise(4, 4))[0]
    np.testing.assert_allclose(c.mac(turned @ one, turned @ other), found, atol=1e-9)
    for k in range(2):
        np.testing.assert_allclose(c.frac(one[:, k][None], other[:, :1].T)[0], found[k, 0], atol=1e-12)


@pytest.mark.peer("sdypy-EMA", module="sdypy.EMA.tools")
@pytest.mark.filterwarnings("ignore::numpy.exceptions.ComplexWarning")
def test_mac_by_others() -> None:
    from sdypy.EMA.tools import MAC

    one, other = noise(7, 3), noise(7, 4, seed=5)
    np.testing.assert_allclose(c.mac(one, other), MAC(one, other).real, rtol=1e-12)
    functions, computed = noise(5, 40), noise(5, 40, seed=6)
    np.testing.assert_allclose(c.frac(functions, computed), np.diag(MAC(functions.T, computed.T)).real, rtol=1e-12)
    np.testing.assert_allclose(c.csac(functions, computed), np.diag(MAC(functions, computed)).real, rtol=1e-12)
    assert np.isnan(c.mac(np.zeros((3, 1)), np.ones((3, 1)))).all()


def test_modes_that_coincide_are_compared_as_spaces() -> None:
    shapes = noise(6, 4)
    computed = modes([100, 200, 200, 350], shapes)
    mixed = shapes.copy()
    mixed[:, 1:3] = shapes[:, 1:3] @ noise(2, 2, seed=8)
    measured = modes([101, 199.9, 200.1, 352], mixed)
    assert c.mac(mixed, shapes)[1, 1] < 0.9
    found = c.mac_of_spaces(measured, computed)
    np.testing.assert_allclose([found[0, 0], found[3, 3]], 1)
    np.testing.assert_allclose(found[1:3, 1:3], 1)
    alone, near = modes([210, 352], mixed[:, [1, 3]]), modes([100, 200, 200.1, 350], shapes)
    assert [(p.measured, p.computed) for p in c.pairs(alone, near)] == [(0, 1), (1, 3)], "the lower of two that are one"
    # A pair that measurement has split: each of its modes lies in the space of the computed two.
    split = modes([101, 195, 205, 352], mixed)
    np.testing.assert_allclose(c.mac_of_spaces(split, computed)[1:3, 1:3], 1)
    assert [(p.measured, p.computed) for p in c.pairs(split, computed)] == [(0, 0), (1, 1), (2, 2), (3, 3)]
    # Two measured vectors of a pair that are nearly one: half of the space is missing.
    mixed[:, 2] = mixed[:, 1] + 1e-3 * noise(6, seed=9)
    assert np.all(c.mac_of_spaces(modes([101, 199.9, 200.1, 352], mixed), computed)[1:3, 1:3] < 0.95)


def test_principal_angles() -> None:
    """Spaces with one common direction and one at an angle t: the mean of 1 and cos^2 t."""
    e, t = np.eye(4), 0.4
    turned = np.stack([e[0], math.cos(t) * e[1] + math.sin(t) * e[2]], axis=1)
    found = c.mac_of_spaces(modes([10, 10], e[:, :2] @ noise(2, 2)), modes([10, 10], turned @ noise(2, 2, seed=3)))
    np.testing.assert_allclose(found, (1 + math.cos(t) ** 2) / 2)
    assert c.runs(np.array([1.0, 1.0001, 2, 3, 3.0001, 3.0002])) == [[0, 1], [2], [3, 4, 5]]
    assert c.runs(np.array([])) == []
    single, pair = modes([10], e[:, :1]), modes([10, 10], turned)
    for found in (c.mac_of_spaces(single, pair).T, c.mac_of_spaces(pair, single)):
        np.testing.assert_allclose(found, [[1], [1]])
    # Modes of a pair that channels see alike span one direction.
    other = noise(6, 2)
    same = other[:, :1] * np.array([[1.0, 2j]])
    np.testing.assert_allclose(c.mac_of_spaces(modes([10, 10], same), modes([10, 10], other)), 1)
    # One channel sees one direction, of however many modes.
    assert c.mac_of_spaces(modes([10, 10], e[:1, :2] + 1), modes([10], e[:1, :1]))[0, 0] == pytest.approx(1)


@given(st.permutations(range(5)), FACTORS)
def test_modes_find_each_other(order: list[int], factor: complex) -> None:
    """In whatever order, of whatever scale, with noise: the pairs are those that were made."""
    shapes = noise(9, 5, seed=11)
    frequency = np.linspace(100, 120, 5)
    measured = modes(frequency, factor * (shapes[:, order] + 0.1 * noise(9, 5, seed=12)), 0.02)
    found = c.pairs(measured, modes(frequency * 1.01, shapes))
    assert [(p.measured, p.computed) for p in found] == list(enumerate(order))
    assert all(p.mac > 0.95 for p in found)
    first = found[0]
    assert first.frequency_difference == pytest.approx(1.01 * frequency[order[0]] / 100 - 1)
    assert first.damping_difference == pytest.approx(-0.5)


def test_modes_without_a_partner() -> None:
    e = np.eye(4)
    found = c.pairs(modes([10, 20], e[:, :2]), modes([11, 21, 31], e[:, [0, 2, 3]]))
    assert [(p.measured, p.computed) for p in found] == [(0, 0)]
    # Channels that cannot tell modes apart: frequencies do.
    ones = np.ones((1, 3))
    found = c.pairs(modes([20, 30], ones[:, :2]), modes([10, 21, 29], ones))
    assert [(p.measured, p.computed) for p in found] == [(0, 1), (1, 2)]
    assert math.isnan(c.pairs(modes([10], e[:, :1], 0.0), modes([11], e[:, :1]))[0].damping_difference)


def test_comac_tells_the_channel() -> None:
    shapes = np.random.default_rng(3).normal(size=(6, 4))
    computed = modes([10, 20, 30, 40], shapes)
    scales = np.array([3.0, -1e-3, 2j, 1e4 * np.exp(1j)])
    found = c.pairs(modes(computed.frequency, shapes * scales), computed)
    np.testing.assert_allclose(c.comac(*c.matched(modes(computed.frequency, shapes * scales), computed, found)), 1)
    wrong = shapes * scales
    wrong[2, :2] = 0
    bad = modes(computed.frequency, wrong)
    alike = c.comac(*c.matched(bad, computed, c.pairs(bad, computed)))
    assert int(np.argmin(alike)) == 2
    assert alike[2] < 0.7
    assert np.all(np.delete(alike, 2) > 0.9)
    one, other = np.array([[1.0, 2j]]), np.array([[3.0, 1.0]])
    assert c.comac(one, other) == pytest.approx((3 + 2) ** 2 / (5 * 10))
    assert math.isnan(c.comac(np.zeros((1, 2)), np.ones((1, 2)))[0])
    assert c.matched(bad, computed, [])[0].shape == (6, 0)


def test_comac_of_modes_that_coincide() -> None:
    """Whichever basis either side has of a pair, channels that move alike have a CoMAC of 1."""
    shapes = np.random.default_rng(5).normal(size=(6, 3))
    computed = modes([10, 20, 20], shapes)
    mixed = shapes.copy() * np.array([2.0, 1, 1])
    mixed[:, 1:] = shapes[:, 1:] @ np.array([[0.6, -0.8], [0.8, 0.6]])
    for measured in (modes([10, 20, 20.01], mixed), modes([10, 19, 21], mixed)):
        found = c.pairs(measured, computed)
        assert len(found) == 3
        np.testing.assert_allclose(c.comac(*c.matched(measured, computed, found)), 1)
        back = [pair._replace(measured=pair.computed, computed=pair.measured) for pair in found]
        np.testing.assert_allclose(c.comac(*c.matched(computed, measured, back)), 1)


def test_one_frequency_has_no_shape() -> None:
    one = np.array([[1 + 1j], [2.0 + 0j]])
    assert np.isnan(c.frac(one, 3 * one)).all()
    np.testing.assert_allclose(c.faac(one, one), 1)
