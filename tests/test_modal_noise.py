"""Modal fit under noise: what it recovers, how sure it is, which modes it finds, by statistics over draws."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2
from synthetic_modes import LINES, PAIRS, SMALL, Kind, Truth, band_of, functions, matched, modes_of, noisy

from trivet.measure.modal.coincidence import apart, joined
from trivet.measure.modal.fitting import fit_modes
from trivet.measure.modal.maximum_likelihood import covariance, directions, information, projected, refine
from trivet.measure.modal.noise import Noise, estimated
from trivet.measure.modal.refinement import _missing, _with_one_more, settled
from trivet.measure.modal.residues import synthesised


def test_noise_of_both_kinds_is_told() -> None:
    size = np.abs(PAIRS.matrix(LINES, 2))
    root = np.sqrt(np.mean(size**2, axis=-1))
    rng = np.random.default_rng(5)
    for added, relative in ((0.02, 0.03), (0.03, 0.0), (0.0, 0.03)):
        deviation = np.sqrt((added * root[:, :, None]) ** 2 + (relative * size) ** 2)
        errors = deviation * (rng.normal(size=size.shape) + 1j * rng.normal(size=size.shape)) / math.sqrt(2)
        found = estimated(errors, size, np.zeros(size.shape))
        assert np.sqrt(np.mean(found.added / root**2)) == pytest.approx(added, rel=0.1, abs=0.002)
        assert np.sqrt(np.mean(found.relative)) == pytest.approx(relative, rel=0.1)
        assert found.relative.any() == bool(relative), "none at all where there is none"
        again = estimated(errors, size, np.zeros(size.shape), Noise(found.added, np.zeros(found.added.shape)))
        assert np.sqrt(np.mean(again.relative)) == pytest.approx(relative, rel=0.1), "from a start that had none"


def test_what_the_fit_took_is_put_back() -> None:
    """Errors of lines that the fit follows are small; the noise is not."""
    rng = np.random.default_rng(6)
    taken = np.tile(np.linspace(0, 0.8, 2000), (1, 1, 1))
    errors = np.sqrt(1 - taken) * (rng.normal(size=taken.shape) + 1j * rng.normal(size=taken.shape)) / math.sqrt(2)
    found = estimated(errors, np.ones(taken.shape), taken)
    assert found.variance(np.ones(taken.shape)).mean() == pytest.approx(1, rel=0.06)


@pytest.mark.parametrize("kind", ["relative", "added"])
@pytest.mark.parametrize("derivatives", [0, 2])
def test_recovery_at_three_percent(kind: Kind, derivatives: int) -> None:
    """To 0.1 % in frequency and 5 % in damping, pairs included; the second pair is told apart, the first is one pole twice."""
    values = noisy(PAIRS.matrix(LINES, 3, derivatives), kind, 0.03, 7)
    fit = fit_modes(functions(LINES, values, derivatives))
    assert len(fit) == 6
    own = matched(fit.poles, PAIRS.poles)
    np.testing.assert_allclose(fit.frequency[own], PAIRS.natural, rtol=1e-3)
    np.testing.assert_allclose(fit.damping[own], PAIRS.damping, rtol=0.05)
    assert fit.multiplicity.tolist() == [2, 2, 1, 1, 1, 1]
    np.testing.assert_allclose(np.nanmean(fit.noise_part), 0.03, rtol=0.1)


@cache
def draws(kind: Kind) -> tuple[np.ndarray, np.ndarray]:
    """(d, 2, 3) errors of frequency and damping over half the interval, and (d,) how many modes are one pole twice."""
    lines = np.linspace(60.0, 240.0, 121)
    clean = SMALL.matrix(lines, 2)
    errors, twice = [], []
    for seed in range(200):
        fit = fit_modes(functions(lines, noisy(clean, kind, 0.03, seed)), order=8, poles=SMALL.natural)
        assert len(fit) == 3
        own = matched(fit.poles, SMALL.poles)
        off = (fit.frequency[own] - SMALL.natural) / fit.frequency_interval[own]
        errors.append([off, (fit.damping[own] - SMALL.damping) / fit.damping_interval[own]])
        twice.append(np.sum(fit.multiplicity == 2))
    return np.array(errors), np.array(twice)


@pytest.mark.parametrize("kind", ["relative", "added"])
def test_intervals_hold_in_95_of_100_draws(kind: Kind) -> None:
    errors, twice = draws(kind)
    held = np.mean(np.abs(errors) < 1, axis=0)
    assert np.all((held >= 0.90) & (held <= 0.99)), held
    assert np.all(np.abs(errors.mean(axis=0)) < 0.15), "no bias beside the interval"
    assert np.mean(twice == 2) > 0.95


def test_the_test_of_one_pole_has_its_level() -> None:
    """Chances are uniform where two poles are one, and nought where they are apart by more than can be overlooked."""
    lines, rng = np.linspace(60.0, 240.0, 181), np.random.default_rng(8)
    clean = SMALL.matrix(lines, 2)
    band, modes = band_of(SMALL, lines, 2), modes_of(SMALL, 2, [0, 0, 1])
    deviation = 0.03 * np.sqrt(np.mean(np.abs(clean) ** 2, axis=-1, keepdims=True))
    weight = np.broadcast_to(1 / deviation**2, clean.shape)
    chances = []
    for _ in range(100):
        errors = deviation * (rng.normal(size=clean.shape) + 1j * rng.normal(size=clean.shape)) / math.sqrt(2)
        at = refine(band._replace(values=clean + errors), modes, weight)
        chances.append(apart(band, at, np.array([0, 1])).chance)
    assert -2 * np.sum(np.log(chances)) == pytest.approx(200, abs=4 * 20)
    assert chi2.sf(-2 * np.sum(np.log(chances)), 200) > 1e-3
    other = Truth((100, 100.4, 180), SMALL.damping, SMALL.shapes)
    values = noisy(other.matrix(lines, 2), "added", 0.03, 1)
    at = joined(band, refine(band._replace(values=values), modes_of(other, 2), weight))
    assert len(at.modes.groups) == 3


def test_covariance_is_that_of_the_draws() -> None:
    """Standard deviations of known noise, without anything estimated of it."""
    lines, rng = np.linspace(60.0, 240.0, 91), np.random.default_rng(9)
    truth = Truth.of((100, 180), (0.01, 0.02), 2)
    clean, band, start = truth.matrix(lines, 1), band_of(truth, lines, 1), modes_of(truth, 1)
    deviation = 0.03 * np.sqrt(np.mean(np.abs(clean) ** 2, axis=-1, keepdims=True))
    weight = np.broadcast_to(1 / deviation**2, clean.shape)
    at = projected(band, start, weight)
    stated = np.sqrt(np.diag(covariance(information(band, at, directions(start, at.shapes)))))
    found = []
    for _ in range(400):
        errors = deviation * (rng.normal(size=clean.shape) + 1j * rng.normal(size=clean.shape)) / math.sqrt(2)
        poles = refine(band._replace(values=clean + errors), start, weight).modes.poles
        found.append(np.concatenate([poles.real, poles.imag]))
    np.testing.assert_allclose(np.std(found, axis=0), stated, rtol=0.15)


def test_weights_do_not_follow_the_noise() -> None:
    """Much noise in proportion: weights of measured magnitudes would make the functions smaller by twice its square, 8 %."""
    lines = np.linspace(60.0, 240.0, 361)
    clean = SMALL.matrix(lines, 2)
    band = band_of(SMALL, lines, 2)._replace(values=noisy(clean, "relative", 0.2, 3))
    found = settled(band, modes_of(SMALL, 2, [0, 0, 1])).at
    assert np.mean(np.abs(synthesised(band.omega, found.modes, found.shapes) / clean)) == pytest.approx(1, abs=0.015)


def test_what_is_missing_is_looked_for_outside_too() -> None:
    truth = Truth.of((60, 200, 900), (0.01, 0.01, 0.01), 4, seed=4)
    band = band_of(truth, np.linspace(120.0, 600.0, 121), 2)
    at = projected(band, modes_of(truth, 2).only(np.array([1])), 1 / np.abs(band.values) ** 2)
    inside, below, above = (np.abs(more.poles[more.poles != truth.poles[1]][0]) for more in _missing(band, at)[:3])
    assert below < band.omega[0] <= inside <= band.omega[-1] < above


def test_the_second_of_a_close_pair_is_looked_for_beside_the_first() -> None:
    """One reference, a weak neighbour that the first has swallowed: what is left says little of where it is."""
    shapes = np.random.default_rng(1).normal(size=(6, 2)) * np.array([1.0, 0.06])
    truth, lines = Truth((100.0, 100.3), (0.004, 0.004), shapes), np.linspace(60.0, 140.0, 401)
    values = noisy(truth.matrix(lines, 1), "relative", 0.03, 1)
    weight = 1 / (0.03 * np.abs(truth.matrix(lines, 1))) ** 2
    alone = Truth((100.0,), (0.004,), shapes[:, :1])
    at = refine(band_of(truth, lines, 1)._replace(values=values), modes_of(alone, 1), weight)
    more = _with_one_more(band_of(truth, lines, 1)._replace(values=values), at)
    assert more is not None
    np.testing.assert_allclose(np.abs(more.poles) / (2 * math.pi), truth.natural, atol=0.05)


def test_a_mode_that_is_hardly_seen_is_one() -> None:
    """Left out, it would move the damping of the mode beside it by five standard deviations; where it is not, none is found."""
    shapes = np.random.default_rng(5).normal(size=(24, 3)) * np.array([1.0, 0.05, 1.0])
    truth, lines = Truth((100.0, 115.0, 160.0), (0.03, 0.03, 0.02), shapes), np.linspace(60.0, 200.0, 101)
    fit = fit_modes(functions(lines, noisy(truth.matrix(lines, 1), "relative", 0.03, 2)))
    np.testing.assert_allclose(fit.frequency, truth.natural, rtol=0.01)
    assert np.all(np.abs(fit.damping - truth.damping) < 1.5 * fit.damping_interval)
    without = replace(truth, natural=(100.0, 160.0), damping=(0.03, 0.02), shapes=shapes[:, [0, 2]])
    assert len(fit_modes(functions(lines, noisy(without.matrix(lines, 1), "relative", 0.03, 2)))) == 2


def test_modes_outside_the_band_do_not_mislead() -> None:
    """Those that reach in are modes of the fit too, and are not reported."""
    truth = Truth.of((60, 200, 300, 300, 700, 900), (0.01, 0.01, 0.01, 0.01, 0.02, 0.01), 6, seed=4)
    lines = np.linspace(120.0, 600.0, 481)
    fit = fit_modes(functions(lines, noisy(truth.matrix(lines, 3, 2), "relative", 0.03, 2), 2))
    inside = truth.poles[1:4]
    assert len(fit) == 3 < len(fit.whole)
    own = matched(fit.poles, inside)
    assert np.all(np.abs(fit.frequency[own] - np.abs(inside) / (2 * math.pi)) < 2 * fit.frequency_interval[own])
    assert np.all(np.abs(fit.damping[own] - 0.01) < 2 * fit.damping_interval[own])
