"""Modal fit: closed forms, dense algebra, slopes by differences, sdypy-EMA, and a machine."""

from __future__ import annotations

import dataclasses
import math
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from synthetic_modes import LINES, PAIRS, SMALL, Truth, band_of, functions, matched, modes_of, noisy

from trivet.errors import InputError, NoResultError
from trivet.measure.functions import Channel, Functions
from trivet.measure.modal import fitting
from trivet.measure.modal.coincidence import apart
from trivet.measure.modal.fitting import fit_modes, matrix_of
from trivet.measure.modal.least_squares_complex import OrderPoles, estimate, normal_equations
from trivet.measure.modal.maximum_likelihood import directions, information, leverage, moved, projected, refine
from trivet.measure.modal.model import ModalFit
from trivet.measure.modal.residues import Modes, shapes_of, synthesised
from trivet.measure.modal.stabilisation import automatic, nearest, stabilisation

# Poles of all orders.


def test_normal_equations_are_those_of_the_dense_problem() -> None:
    """Denominators' equations are the squares of what numerators cannot tell: by orthogonal projection, order by order."""
    rng = np.random.default_rng(1)
    omega, values = np.linspace(50.0, 90.0, 40), rng.normal(size=(3, 2, 40)) + 1j * rng.normal(size=(3, 2, 40))
    found = normal_equations(omega, values, 5)
    rest = found.denominator.copy()
    for order in range(6):
        rest -= found.numerator[:, order].conj().T @ found.numerator[:, order]
        powers = np.exp(-1j * np.outer((omega - omega[0]) * found.delay, np.arange(order + 1)))
        projector = np.eye(40) - powers @ np.linalg.pinv(powers)
        dense = np.zeros((2 * (order + 1),) * 2, dtype=complex)
        for row in values / np.sqrt(np.mean(np.abs(values) ** 2, axis=(1, 2), keepdims=True)):
            own = np.einsum("nj,an->nja", powers, row).reshape(40, -1)
            dense += own.conj().T @ projector @ own
        np.testing.assert_allclose(rest[: len(dense), : len(dense)], dense, atol=1e-9)


def test_uneven_lines_give_the_same_sums() -> None:
    omega, rng = np.linspace(50.0, 90.0, 40), np.random.default_rng(1)
    values = rng.normal(size=(2, 2, 40)) + 1j * rng.normal(size=(2, 2, 40))
    bent = omega + 1e-4 * np.sin(omega)  # too uneven for a fast transform, and hardly another problem
    bent[[0, -1]] = omega[[0, -1]]
    even, uneven = (normal_equations(lines, values, 4).denominator for lines in (omega, bent))
    np.testing.assert_allclose(uneven, even, atol=0.01 * np.abs(even).max())
    assert not np.allclose(uneven, even, rtol=1e-9)


@pytest.mark.parametrize("references", [1, 2, 3])
@pytest.mark.parametrize("is_even", [True, False])
def test_poles_of_high_order(references: int, is_even: bool) -> None:
    """Without noise models of high order have the poles, with their participation; one reference sees a pair as one."""
    lines = LINES if is_even else 20 + 580 * np.linspace(0, 1, 581) ** 1.2
    values = PAIRS.matrix(lines, references, 1)
    best = estimate(2 * math.pi * lines, values, 24)[-1]
    own = matched(best.poles, PAIRS.poles[1:])
    np.testing.assert_allclose(best.poles[own], PAIRS.poles[1:], rtol=1e-5)
    for k in range(1, 5):
        seen = PAIRS.shapes[:references, 1 + k]
        assert abs(best.participation[own[k]] @ seen) / np.linalg.norm(seen) == pytest.approx(1, abs=1e-4)
    inside = best.poles[(best.poles.real < 0) & (np.abs(best.poles - 1j * best.poles.imag) < 500)]
    near = np.sum(np.abs(inside - PAIRS.poles[0]) < 1e-3 * abs(PAIRS.poles[0]))
    assert near == min(references, 2)


def test_spurious_poles_are_unstable() -> None:
    """What noise asks for comes out with growing motion: of a model with room for 26 poles per reference six remain."""
    values = noisy(PAIRS.matrix(LINES, 3, 1), "relative", 0.03, 1)
    diagram = stabilisation(estimate(2 * math.pi * LINES, values, 26), 2 * math.pi * 20, 2 * math.pi * 600)
    assert np.sum(diagram.order == 26) == 6


# Which of them are modes.


def orders(*frequencies: tuple[float, ...], damping: float = 0.01) -> list[OrderPoles]:
    """One order after another, of two references that see neighbours differently."""
    made = []
    for k, level in enumerate(frequencies):
        poles = 2 * math.pi * np.array(level) * complex(-damping, math.sqrt(1 - damping**2))
        angle = np.arange(len(level)) * 1.0
        made.append(OrderPoles(k + 1, poles, np.column_stack([np.cos(angle), np.sin(angle)]).astype(complex)))
    return made


def chosen(diagram: Any, *wanted: float) -> list[float]:
    found = nearest(diagram, wanted) if wanted else automatic(diagram)
    return (np.abs(found.poles) / (2 * math.pi)).round(6).tolist()


def test_what_comes_back_is_a_mode() -> None:
    levels = [(100.0, 200.0 + 17 * k, 300.0) for k in range(8)]
    diagram = stabilisation(orders(*levels), 0.0, 1e4)
    assert diagram.stable.sum() == 2 * 7
    assert chosen(diagram) == [100.0, 300.0]


def test_a_pair_is_two_modes_and_no_pole_is_taken_twice() -> None:
    """Also where a single pole lies nearest to both frequencies that were asked for."""
    diagram = stabilisation(orders(*[(100.0, 100.0, 130.0)] * 8), 0.0, 1e4)
    assert chosen(diagram) == [100.0, 100.0, 130.0]
    assert np.linalg.matrix_rank(automatic(diagram).participation[:, :2], tol=0.1) == 2
    assert chosen(diagram, 100.0, 101.0) == [100.0, 100.0]
    assert chosen(diagram, 101.0, 100.0, 99.0) == [100.0, 100.0, 130.0]
    assert chosen(diagram, 131.0) == [130.0]


def test_pairing_with_the_order_below_is_one_to_one() -> None:
    """A second pole that appears beside an old one is not stable by the same old one."""
    diagram = stabilisation(orders((100.0,), (100.0, 100.3)), 0.0, 1e4)
    assert diagram.in_frequency[diagram.order == 2].tolist() == [True, False]


def test_a_cluster_has_as_many_modes_as_most_orders_say() -> None:
    levels: list[tuple[float, ...]] = [(100.0, 100.02, 130.0)] * 9
    levels[6:8] = [(100.0, 100.01, 100.02, 130.0)] * 2
    diagram = stabilisation(orders(*levels), 0.0, 1e4)
    assert np.max(np.unique(diagram.order[diagram.stable & (diagram.frequency < 110)], return_counts=True)[1]) == 3
    assert chosen(diagram) == [100.0, 100.02, 130.0]


def test_stable_in_what() -> None:
    first, *_ = orders((100.0, 200.0, 300.0))
    moved_poles = first.poles * np.array([1.02, 1.0, 1.0])
    moved_poles[1] = first.poles[1] - 0.5 * abs(first.poles[1].real)
    turned = first.participation.copy()
    turned[2] = [-turned[2, 1], turned[2, 0]]
    diagram = stabilisation([first, OrderPoles(2, moved_poles, turned)], 0.0, 1e4)
    upper = diagram.order == 2
    assert diagram.in_frequency[upper].tolist() == [False, True, True]
    assert diagram.in_damping[upper].tolist() == [False, False, True]
    assert diagram.in_vector[upper].tolist() == [False, False, False]


# Shapes, likelihood.


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_residues_in_closed_form(derivatives: int) -> None:
    """Of displacement, velocity or acceleration; residuals of both kinds, complex."""
    band = band_of(PAIRS, LINES, 3, derivatives)
    upper, lower = np.full((6, 3), 2e-7 + 1e-8j), np.full((6, 3), 3.0 - 0.2j)
    band = band._replace(values=band.values + upper[:, :, None] - lower[:, :, None] / band.omega**2)
    modes = modes_of(PAIRS, 3)
    shapes, rest = shapes_of(band, modes, np.ones(band.values.shape))
    found = shapes.shapes[:, None, :] * modes.participation
    np.testing.assert_allclose(found[..., 2:], PAIRS.residues(3)[..., 2:], rtol=1e-8, atol=1e-11)
    np.testing.assert_allclose(found[..., :2].sum(-1), PAIRS.residues(3)[..., :2].sum(-1), rtol=1e-8, atol=1e-11)
    np.testing.assert_allclose(shapes.upper, upper, rtol=1e-6)
    np.testing.assert_allclose(shapes.lower, lower, rtol=1e-6)
    assert np.abs(rest).max() < 1e-9 * np.abs(band.values).max()
    np.testing.assert_allclose(synthesised(band.omega, modes, shapes), band.values, rtol=1e-8, atol=1e-14)


@pytest.mark.parametrize("group", [None, [0, 0, 1, 2, 3, 4]])
def test_slopes_by_differences(group: list[int] | None) -> None:
    """The pull of every shared unknown is minus half the slope of the least squares over it; so with a double pole."""
    band = band_of(PAIRS, LINES[::4], 3)
    rng = np.random.default_rng(3)
    weight = rng.uniform(0.5, 2, band.values.shape) / np.mean(np.abs(band.values) ** 2, axis=-1, keepdims=True)
    poles, seen = PAIRS.poles * (1 + 2e-3 * rng.normal(size=6)), PAIRS.shapes[:3] + 0.1 * rng.normal(size=(3, 6))
    off = Modes.of(poles, seen, np.array(group) if group else None)
    at = projected(band, off, weight)
    found = information(band, at, directions(off, at.shapes))
    assert np.linalg.matrix_rank(found.matrix / np.sqrt(np.outer(np.diag(found.matrix), np.diag(found.matrix)))) == len(
        found.pull
    )
    half = len(found.pull) // 2
    for k in range(len(found.pull)):
        step = np.zeros(len(found.pull))
        step[k] = 1e-6 * (abs(off.poles[0]) if k % half < len(off.groups) else 1)
        slope = (projected(band, moved(off, step), weight).cost - projected(band, moved(off, -step), weight).cost) / (
            2 * step[k]
        )
        assert slope == pytest.approx(-2 * found.pull[k], rel=1e-4, abs=1e-6 * np.abs(found.pull * step[k]).max() / step[k])


def test_directions_apart_by_differences() -> None:
    """Poles of a pair that move apart by a small matrix D, shapes kept: its eigenvalues are the new poles."""
    lines, D = LINES[::4], 0.02 * np.array([[0.3 - 1j, 0.5j], [0.2 + 0.1j, -0.3 + 1j]])
    modes = modes_of(SMALL, 2, [0, 0, 1])
    band = band_of(SMALL, lines, 2)
    at = projected(band, modes, np.ones(band.values.shape))
    roots, turn = np.linalg.eig(D)
    seen = np.column_stack([modes.participation[:, :2] @ np.linalg.inv(turn).T, modes.participation[:, 2]])
    apart_modes = Modes(modes.poles + np.append(roots, 0), seen, np.arange(3))
    shapes = at.shapes._replace(shapes=np.column_stack([at.shapes.shapes[:, :2] @ turn, at.shapes.shapes[:, 2]]))
    change = synthesised(band.omega, apart_modes, shapes) - synthesised(band.omega, modes, at.shapes)
    mixed = directions(modes, at.shapes, np.array([0, 1])).pole[..., -3:] @ np.array([D[0, 0], D[0, 1], D[1, 0]])
    slope = 1 / (1j * band.omega - modes.poles[:, None]) ** 2
    mirrored = 1 / (1j * band.omega - modes.poles.conj()[:, None]) ** 2
    expected = mixed @ slope + mixed.conj() @ mirrored
    np.testing.assert_allclose(change, expected, atol=0.02 * np.abs(expected).max())


def test_how_far_poles_come_apart() -> None:
    """Of a pair that is fitted as one pole without being one, the step of the test makes the two poles."""
    other = Truth((100, 100.02, 180), SMALL.damping, SMALL.shapes)
    band = band_of(other, LINES[::4], 2)
    weight = np.ones(band.values.shape) * 1e8 / np.mean(np.abs(band.values) ** 2)
    at = refine(band, modes_of(SMALL, 2, [0, 0, 1]), weight)
    assert apart(band, at, np.array([0, 1])).split == pytest.approx(abs(other.poles[1] - other.poles[0]), rel=0.01)


def test_leverage_counts_unknowns() -> None:
    """What the fit takes adds up to half its real unknowns: shapes, residuals, poles, participation across."""
    band = band_of(PAIRS, LINES, 3)
    at = projected(band, modes_of(PAIRS, 3), np.ones(band.values.shape) / np.abs(band.values) ** 2)
    along = directions(at.modes, at.shapes)
    taken = leverage(band, at, information(band, at, along), along)
    own, shared = 6 * (2 * 6 + 3 * 4), 2 * 6 + 2 * 6 * 2
    # Two coinciding poles that move singly have four unknowns fewer than they were given.
    assert taken.sum() == pytest.approx((own + shared) / 2, abs=2.1)
    assert np.all((taken >= 0) & (taken <= 1))


@pytest.mark.parametrize(("references", "derivatives"), [(1, 0), (2, 1), (3, 2)])
def test_exact_without_noise(references: int, derivatives: int) -> None:
    truth = PAIRS if references > 1 else Truth.of((100, 150, 300, 303, 450), (0.01, 0.02, 0.01, 0.012, 0.005), 4)
    fit = fit_modes(functions(LINES, truth.matrix(LINES, references, derivatives), derivatives))
    assert len(fit) == len(truth.natural)
    np.testing.assert_allclose(fit.poles[matched(fit.poles, truth.poles)], truth.poles, rtol=1e-9)
    assert fit.frac.min() > 1 - 1e-12
    if references > 1:
        assert fit.multiplicity.tolist() == [2, 2, 1, 1, 1, 1]


def test_shapes_of_unit_modal_mass() -> None:
    """Driving points give the scale; shapes of a pair span what they should, and participation makes the residues."""
    fit = fit_modes(functions(LINES, PAIRS.matrix(LINES, 3, 2), 2))
    scaled = fit.scaled_shapes()
    assert scaled is not None
    for k in range(2, 6):
        np.testing.assert_allclose(np.abs(scaled[:, k]), np.abs(PAIRS.shapes[:, k]), rtol=1e-7)
    np.testing.assert_allclose(scaled[:, :2] @ scaled[:, :2].T, PAIRS.shapes[:, :2] @ PAIRS.shapes[:, :2].T, atol=1e-8)
    np.testing.assert_allclose(np.abs(fit.shapes).max(axis=0), 1)
    np.testing.assert_allclose(fit.collinearity, 1, atol=1e-9)
    whole = np.einsum("or,ir->oi", fit.shapes[:, :2], fit.participation[:, :2])
    np.testing.assert_allclose(whole, PAIRS.residues(3)[..., :2].sum(-1), atol=1e-11)


def test_a_driving_point_may_point_against() -> None:
    """The exciter pushes where the sensor pulls: the same shapes."""
    values = PAIRS.matrix(LINES, 1)
    plain = functions(LINES, values)
    pulled = replace(plain, values=-plain.values, references=tuple(Channel("1", (-1.0, 0.0, 0.0)) for _ in plain.references))
    one, other = (fit_modes(each, 120, 280).scaled_shapes() for each in (plain, pulled))
    assert one is not None
    assert other is not None
    np.testing.assert_allclose(np.abs(other), np.abs(one), rtol=1e-6)
    np.testing.assert_allclose(np.angle(other[0] ** 2), np.angle(one[0] ** 2), atol=1e-6)
    turned = replace(plain, references=tuple(Channel("1", (0.0, 0.0, 1.0), True) for _ in plain.references))
    assert fit_modes(turned, 120, 280).scaled_shapes() is None


# What is asked, and what is not there.


def test_modes_that_were_asked_for() -> None:
    measured = functions(LINES, noisy(PAIRS.matrix(LINES, 3, 2), "relative", 0.01, 3), 2)
    fit = fit_modes(measured, 60, 400, poles=[150, 100, 300, 101, 301])
    assert fit.frequency.round(0).tolist() == [100, 100, 150, 300, 301]
    assert not fit.is_automatic
    with pytest.raises(NoResultError, match="no stable pole of its own is near 222 Hz"):
        fit_modes(measured, 60, 400, poles=[150, 222])
    with pytest.raises(NoResultError, match=r"no stable pole of its own is near 15[01] Hz"):
        fit_modes(measured, 60, 400, poles=[150, 151])


def test_a_mode_outside_reaches_into_what_was_asked_for() -> None:
    truth = Truth.of((100, 150, 230), (0.01, 0.01, 0.02), 4, seed=5)
    measured = functions(LINES, noisy(truth.matrix(LINES, 2, 2), "relative", 0.005, 3), 2)
    fit = fit_modes(measured, 60, 210, poles=[100, 150])
    assert len(fit) == 2
    assert len(fit.whole) == 3
    assert np.all(np.abs(fit.frequency - truth.natural[:2]) < 2 * fit.frequency_interval)
    assert np.all(np.abs(fit.damping - 0.01) < 2 * fit.damping_interval)


def test_missing_pairs() -> None:
    """A response without one of the references takes part in all but the poles of orders; none complete is refused."""
    whole = functions(LINES, noisy(PAIRS.matrix(LINES, 3), "relative", 0.01, 3))
    some = fit_modes(whole.only([k for k in range(18) if k not in (4, 17)]))
    assert some.band.known.sum() == 16
    np.testing.assert_allclose(some.frequency, PAIRS.natural, rtol=1e-3)
    assert np.isnan([some.frac[1, 1], some.noise_part[5, 2]]).all()
    assert np.isnan(some.measured[1, 1]).all()
    with pytest.raises(InputError, match=r"no response was measured with every reference: 1:\+x / 1:\+y is missing"):
        fit_modes(whole.only([0, 4, 8]))


def test_motions_may_differ() -> None:
    """One function of displacement among those of acceleration."""
    whole = functions(LINES, PAIRS.matrix(LINES, 2, 2), 2)
    values = whole.values.copy()
    values[3] /= (1j * whole.omega) ** 2
    mixed = replace(whole, values=values, motions=("acceleration",) * 3 + ("displacement",) + ("acceleration",) * 8)
    fit = fit_modes(mixed)
    np.testing.assert_allclose(fit.poles[matched(fit.poles, PAIRS.poles)], PAIRS.poles, rtol=1e-9)
    np.testing.assert_allclose(fit.synthesis()[1, 1], values[3], rtol=1e-6)
    np.testing.assert_allclose(fit.synthesis(LINES[::50])[1, 1], values[3, ::50], rtol=1e-6)


def test_zero_frequency_is_left_out() -> None:
    lines = np.arange(0.0, 601.0)
    fit = fit_modes(functions(lines, PAIRS.matrix(lines, 2, 2), 2))
    assert fit.functions.frequency[0] == 1
    np.testing.assert_allclose(fit.frequency, PAIRS.natural, rtol=1e-9)


def test_wrong_input() -> None:
    measured = functions(LINES, PAIRS.matrix(LINES, 1))
    with pytest.raises(InputError, match="5 frequencies lie in the band; expected 16 or more"):
        fit_modes(measured, 100, 104)
    with pytest.raises(InputError, match="--order 300: expected 2 to 193"):
        fit_modes(measured, order=300)
    with pytest.raises(InputError, match=r"--order 2\.5: expected 2 to 193"):
        fit_modes(measured, order=2.5)  # type: ignore[arg-type]
    for poles in ([], [math.nan], [-100.0]):
        with pytest.raises(InputError, match=r"--poles: .*expected frequencies above zero"):
            fit_modes(measured, poles=poles)
    with pytest.raises(InputError, match="measured functions"):
        fit_modes(measured.only([]))
    values = measured.values.copy()
    values[0, 7] = math.nan
    with pytest.raises(InputError, match="measured functions: "):
        fit_modes(dataclasses.replace(measured, values=values))
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(1, 1, 581)) + 1j * rng.normal(size=(1, 1, 581))
    with pytest.raises(NoResultError):
        fit_modes(functions(LINES, noise), order=20)


# Engines of others.


@pytest.mark.peer("sdypy-EMA", module="sdypy.EMA")
def test_poles_and_residues_of_sdypy() -> None:
    """Poles of a high order agree within the noise; residues of the same poles to rounding."""
    from sdypy import EMA

    lines = np.arange(1.0, 601.0)
    truth = Truth.of((100, 150, 300, 380, 450), (0.01, 0.02, 0.01, 0.012, 0.005), 4)
    values = noisy(truth.matrix(lines, 1, 2), "relative", 0.01, 1)
    theirs = EMA.Model(values[:, 0], lines, lower=20, upper=600, pol_order_high=30, frf_form="accelerance")
    theirs.get_poles(show_progress=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs.select_closest_poles(list(truth.natural))
        theirs.get_constants()
    fit = fit_modes(functions(lines, values, 2), 20, 599)
    assert len(fit) == 5
    found = np.array([theirs.all_poles[order][number] for order, number in theirs.pole_ind])
    found = np.where(found.imag > 0, found, found.conj())
    np.testing.assert_allclose(fit.frequency, np.abs(found) / (2 * math.pi), rtol=2e-3)
    np.testing.assert_allclose(fit.damping, -found.real / np.abs(found), rtol=0.1)
    # The same lines, the same poles, both residuals, no weights.
    used = (theirs.freq >= 20) & (np.arange(len(theirs.freq)) < np.argmin(np.abs(theirs.freq - 600)))
    band = matrix_of(functions(theirs.freq[used], theirs.frf[:, None, used], 2))[0]
    own, _ = shapes_of(band, Modes(found, np.ones((1, 5), dtype=complex), np.arange(5)), band.motion_size**2)
    residues = np.array(theirs.A)
    residues = np.where(np.array([theirs.all_poles[a][b] for a, b in theirs.pole_ind]).imag > 0, residues, residues.conj())
    np.testing.assert_allclose(own.shapes, residues, rtol=1e-6, atol=1e-9 * np.abs(residues).max())
    np.testing.assert_allclose(own.upper[:, 0], theirs.UR, rtol=1e-5)
    np.testing.assert_allclose(own.lower[:, 0], theirs.LR, rtol=1e-5)


def platform_functions(lines: np.ndarray) -> tuple[Functions, np.ndarray]:
    """Receptances of azulay at home at three points of the platform along three axes, pushed at the first, and its modes."""
    import trivet as t
    from trivet.kinematics.mode import parse_mode
    from trivet.space.pose import zyz_frame
    from trivet.vibration.spectral import receptance

    machine = t.load("azulay").with_spherical("free")
    frame = zyz_frame(machine.home.position, 0.0, 0.0, 0.0)
    whole = np.asarray(receptance(machine, frame, parse_mode(machine), lines, 0.02))
    places = 0.05 * np.array([[1, 0, 0.2], [-0.5, 0.8, 0.1], [-0.5, -0.8, -0.3]])
    moves = []
    for x, y, z in places:
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        moves.append(np.hstack([np.eye(3), -cross]))
    reach = np.vstack(moves)
    values = np.einsum("oa,nab,ib->oin", reach, whole, reach[:3])
    return functions(lines, values), np.asarray(t.modes(machine).frequency)


def test_a_machine_of_three_equal_legs() -> None:
    """Its modes are those of the eigenproblem, its pairs come out as one pole twice, structural damping as half its factor."""
    lines = np.linspace(650.0, 1400.0, 376)
    measured, natural = platform_functions(lines)
    fit: ModalFit = fit_modes(replace(measured, values=noisy(measured.values, "relative", 0.03, 1)))
    expected = natural[(natural > 650) & (natural < 1400)]
    assert len(fit) == len(expected) == 6
    # The pole of structural damping is omega_r sqrt(1 + i eta), its magnitude omega_r (1 + eta^2 / 4).
    np.testing.assert_allclose(fit.frequency / (1 + 0.02**2 / 4), expected, rtol=2e-4)
    np.testing.assert_allclose(fit.damping, 0.01, rtol=0.03)
    assert fit.multiplicity.tolist() == [2, 2, 1, 1, 2, 2]
    assert (~fit.band.known).sum() == 8, "zero by symmetry: they hold rounding, which is not fitted"


def test_default_order_stays_within_the_lines() -> None:
    band = band_of(PAIRS, LINES, 3)
    assert fitting._order(None, band) == 27
    assert fitting._order(None, band._replace(omega=band.omega[:30], values=band.values[..., :30])) == 10
