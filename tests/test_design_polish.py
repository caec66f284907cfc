"""Polishing by slopes: optima in closed form, fronts that only get better, models that are true nearby only."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from toy_designs import Rows, Toy, binh_korn, cantilever, osy, truss, valley, vessel, welded, zdt1, zdt3

from trivet.design.front.archive import Archive
from trivet.design.front.box import Box
from trivet.design.front.evolution import Evolution, evolved
from trivet.design.front.linear import ENOUGH, MEMBERS, PARTS, ROUNDS, coarsened
from trivet.design.front.polish import polished
from trivet.design.front.polisher import Polisher, Polishing
from trivet.design.front.problem import Asked, Values
from trivet.design.front.program import Program, improving
from trivet.design.front.search import searched
from trivet.design.front.trust import Trust
from trivet.design.front.volume import box, compared, dominates, volume

AREAS = (0.3, 0.4, 0.44, 0.45, 0.5, 0.6)


def few(evaluations=600, population=30, seed=0):
    return Evolution(evaluations, population=population, seed=seed)


def polisher(toy, design):
    """About one design."""
    asked = Asked(toy)
    archive = Archive.empty(len(toy.low), len(toy.objectives), len(toy.constraints))
    archive.add(np.array([design]), asked(np.array([design])))
    return Polisher(asked, archive, Polishing())


# Optima in closed form.


@pytest.mark.parametrize("stress", [20.0, 100.0, 150.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_truss_of_least_volume_is_found_as_by_hand(stress, seed):
    told = searched(truss(stress), few(300, seed=seed), Polishing())
    assert np.allclose(told.designs, [[10 * 20**0.5 / stress, 40 * 5**0.5 / stress, 2]], rtol=0, atol=1e-6)
    assert told.values.objectives[0, 0] == pytest.approx(400 / stress, abs=1e-6)
    assert told.active == (("stress",),)
    assert told.bounds == ((),)


def test_of_tubes_in_a_catalogue_the_best_is_found_and_the_rest_fitted_to_it():
    told = searched(truss(100.0, AREAS), few(300), Polishing())
    # The first bar is stressed to the limit: 20 sqrt(16 + y²) = 100 y x1; then the second.
    by_hand = []
    for area in AREAS:
        if (y := (16 / ((5 * area) ** 2 - 1)) ** 0.5 if 5 * area > 1 else 9.0) <= 3:
            second = 0.8 * (1 + y**2) ** 0.5 / y
            by_hand.append((area * (16 + y**2) ** 0.5 + second * (1 + y**2) ** 0.5, area, second, y))
    volume_, *design = min(by_hand)
    assert np.allclose(told.designs, [design], rtol=0, atol=1e-6)
    assert told.values.objectives[0, 0] == pytest.approx(volume_, abs=1e-6)


@pytest.mark.parametrize(
    ("make", "design", "value", "active"),
    [
        (vessel, [0.8125, 0.4375, 42.0984456, 176.6365958], 6059.714335, ("wall", "volume")),
        (welded, [0.20572964, 3.47048867, 9.03662391, 0.20572964], 1.724852309, ("shear", "bending", "weld", "buckling")),
        (valley, [1, 1], 0, ("cubic", "line")),
    ],
)
def test_optima_that_are_known_are_found(make, design, value, active):
    told = searched(make(), few(1000, 50), Polishing())
    assert np.allclose(told.designs, [design], rtol=1e-7, atol=1e-6)
    assert told.values.objectives[0, 0] == pytest.approx(value, rel=1e-9, abs=1e-12)
    assert told.active == (active,)


def test_the_front_of_a_truss_is_where_both_bars_are_stressed_alike():
    told = searched(truss(), few(), Polishing(points=24))
    free = np.array([not bounds for bounds in told.bounds])
    assert free.sum() > 5
    bar, stress = told.designs[free], told.values.objectives[free, 1]
    # Flat along y: volume is right to 1e-8, and y to its root.
    assert np.allclose(told.values.objectives[free].prod(axis=1), 400, rtol=1e-8)
    assert np.allclose(bar, np.column_stack([10 * 20**0.5 / stress, 40 * 5**0.5 / stress, np.full(free.sum(), 2.0)]), rtol=2e-4)


@pytest.mark.parametrize("many", [2, 3])
def test_the_front_of_distances_to_corners_is_between_them(many):
    toy = Toy(
        lambda x: tuple((jnp.sum((x - jnp.eye(3)[i]) ** 2),) for i in range(many)), [-1] * 3, [2] * 3, ("a", "b", "c")[:many]
    )
    told = searched(toy, few(300), Polishing(points=20))
    assert told.is_polished.all()
    assert np.allclose(told.designs.sum(axis=1), 1, atol=1e-5)
    assert np.all(told.designs > -1e-5)
    assert np.abs(told.designs[:, many:]).max(initial=0) < 1e-5
    for corner in np.eye(3)[:many]:
        assert np.min(np.abs(told.designs - corner).max(axis=1)) < 3e-5


def test_the_worst_of_several_is_least_where_they_are_equal():
    def kernel(x):  # |x - 0.3| and |x - 0.8| with weights, and a parabola: kinks
        return (*(w * (x[0] - c) for w, c in ((1, 0.8), (-3, 0.8), (2, 0.3), (-1, 0.3))), (x[1] - 0.25) ** 2 - 0.1), (
            x[1] - x[0],
        )

    toy = Toy(lambda x: (kernel(x)[0],), [0, 0], [1, 1], ("worst",))
    told = searched(toy, few(150), Polishing())
    by_hand = brentq(lambda x: -3 * (x - 0.8) - 2 * (x - 0.3), 0.3, 0.8)
    assert told.designs[0, 0] == pytest.approx(by_hand, abs=1e-9)
    assert told.values.objectives[0, 0] == pytest.approx(2 * (by_hand - 0.3), abs=1e-9)


def test_rows_far_below_the_greatest_are_taken_in_when_they_become_it():
    centres = np.linspace(-3, 3, 41)

    def kernel(x):
        return (tuple((x[0] - c) ** 2 + x[1] ** 2 for c in centres),)

    toy = Toy(kernel, [-3, -1], [3, 1], ("worst",))
    about = polisher(toy, [2.9, 0.7])
    goal = improving(np.array([100.0]), np.ones(1), np.ones(1), 0)
    program = Program(toy.model(np.array([2.9, 0.7])), about.box, np.array([2.9, 0.7]), goal, 1.0)
    genes, gained = program.solved(60, 1e-12)
    assert np.allclose(about.box.moved(np.array([2.9, 0.7]), genes[None]), 0, atol=1e-6)
    assert gained == pytest.approx(5.9**2 + 0.7**2 - 9, abs=1e-9)


@pytest.mark.parametrize("radius", [1.0, 0.1])
def test_a_linear_program_ends_where_linear_rows_are_least_or_at_its_radius(radius):
    # The first objective falls along x1 and grows along x2; x2 >= 1 - x1 from many rows, of which one holds; x2 >= 1/4.
    def kernel(x):
        return (x[1] - x[0],), tuple(c - x[0] - x[1] for c in np.linspace(-3, 1, 20)), (0.25 - x[1],)

    toy = Toy(kernel, [0, 0], [0.75, 1], ("f",), ("above", "least"))
    here = np.array([0.5, 0.5])
    goal = improving(np.zeros(1), np.ones(1), np.ones(1), 2)
    about = polisher(toy, here)
    genes = Program(toy.model(here), about.box, here, goal, radius).linear()
    found = about.box.moved(here, genes[None])[0]
    first = 0.5 + min(0.25, 0.75 * radius)
    assert found == pytest.approx([first, max(0.25, 1 - first, 0.5 - radius)], abs=1e-9)


# Never worse.


@pytest.mark.parametrize("toy", [zdt1(5), zdt3(5), binh_korn(), osy(), cantilever(), truss(None, AREAS)])
def test_what_is_polished_dominates_or_is_what_was_evolved(toy):
    asked = Asked(toy, batch=30)
    archive = evolved(asked, few())
    before, evolved_many = archive.best, asked.count
    polished(asked, archive, Polishing(points=20))
    after = archive.best
    assert after[1].is_feasible.all()
    same = (before[0][:, None] == after[0]).all(axis=2).any(axis=1)
    better = dominates(after[1].objectives, before[1].objectives).any(axis=0)
    assert np.all(same | better)
    for i, values in enumerate(toy.discrete):
        assert values is None or set(after[0][:, i]) <= set(values)
    assert evolved_many >= 600


@pytest.mark.parametrize("make", [lambda: zdt1(12), osy, cantilever], ids=["zdt1", "osy", "cantilever"])
def test_polished_fronts_have_more_volume_than_evolved_ones_of_as_many_evaluations(make):
    toy, rows = make(), [0]
    model = toy.model

    def counted(design):
        made = model(design)

        def count(of, many):
            return lambda x: (rows.__setitem__(0, rows[0] + many), of(x))[1]

        return Rows(made.owner, count(made.of, 1), count(made.by, 4))  # what slopes cost by reverse differentiation

    toy.model = counted
    asked = Asked(toy, batch=30)
    mine = evolved(asked, few())
    polished(asked, mine, Polishing(points=20))
    spent = len(asked.memo) + rows[0]
    theirs = evolved(Asked(make(), batch=30), few(spent))
    ours, other = mine.best[1].objectives, theirs.best[1].objectives
    versus = compared(ours, other)
    assert versus.volumes[0] > versus.volumes[1]
    assert versus.dominated[0] < versus.dominated[1]


@pytest.mark.parametrize("make", [lambda: zdt1(12), osy, cantilever], ids=["zdt1", "osy", "cantilever"])
def test_a_coarse_polish_is_worth_more_than_evolution_of_as_many_designs(make):
    asked = Asked(make(), batch=30)
    archive = evolved(asked, few())
    before, spent = archive.best[1].objectives, asked.count
    coarsened(Polisher(asked, archive, Polishing()))
    spent = asked.count - spent
    after = archive.best[1]
    assert after.is_feasible.all()
    assert not dominates(before, after.objectives).any()
    assert 0 < spent <= (MEMBERS + len(asked.problem.objectives)) * ROUNDS * len(PARTS)
    versus = compared(after.objectives, before)
    assert versus.volumes[0] > versus.volumes[1] + ENOUGH
    theirs = evolved(Asked(make(), batch=30), few(600 + spent)).best[1].objectives
    assert compared(after.objectives, theirs).volumes[0] > compared(after.objectives, theirs).volumes[1]


def test_each_member_by_itself_ends_where_it_is_dominated_or_the_same():
    toy = osy()
    asked = Asked(toy, batch=30)
    archive = evolved(asked, few(300))
    about = Polisher(asked, archive, Polishing())
    designs, values = archive.best
    for design, objectives in list(zip(designs, values.objectives, strict=True))[:6]:
        point = about.towards(design, objectives, about.width)
        assert np.all(point.both[:2] <= objectives)
        assert np.all(point.both[2:] <= 1e-9)


def test_ends_are_the_least_of_each_objective_and_then_of_the_other():
    # The first objective is flat along x2, which the second wants at 0.6.
    toy = Toy(lambda x: ((x[0] ** 2,), ((x[0] - 1) ** 2 + (x[1] - 0.6) ** 2,)), [-1, -1], [1, 1])
    told = searched(toy, few(150), Polishing(points=8))
    assert np.allclose(told.designs[[0, -1]], [[0, 0.6], [1, 0.6]], atol=3e-5)


def test_gaps_of_a_front_are_filled_evenly():
    told = searched(binh_korn(), few(300), Polishing(points=30))
    places = told.values.objectives / np.ptp(told.values.objectives, axis=0)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert told.is_polished.all()
    assert len(told.designs) >= 30 - 2
    assert steps.max() < 3 * 2 / 30


# Constraints, domains, degenerate problems.


def test_designs_that_miss_constraints_are_led_to_where_they_are_met():
    def kernel(x):  # a small disc that evolution does not hit
        return (x[0],), (x[1],), (10 * ((x[0] - 0.31) ** 2 + (x[1] - 0.64) ** 2) - 1e-5,)

    told = searched(Toy(kernel, [0, 0], [1, 1], constraints=("near",)), few(200), Polishing(points=6))
    offsets = told.designs - [0.31, 0.64]
    assert len(offsets) >= 5
    assert np.allclose(np.linalg.norm(offsets, axis=1), 1e-3, rtol=1e-3)  # the arc towards the origin
    assert np.all(offsets <= 1e-6)


def test_a_single_design_that_meets_all_is_found():
    def kernel(x):
        return (x[0] + x[1],), ((x[0] - 1) ** 2,), (x[0] - 0.3,), (0.3 - x[0],), (x[1] - 0.7,), (0.7 - x[1],)

    told = searched(Toy(kernel, [0, 0], [1, 1], constraints=("a", "b", "c", "d")), few(200), Polishing(points=6))
    assert np.allclose(told.designs, [[0.3, 0.7]], atol=1e-9)
    assert told.active == (("a", "b", "c", "d"),)


def test_designs_without_value_are_gone_round():
    def kernel(x):  # nothing within a disc about the middle; the best lies behind it
        hole = jnp.sqrt((x[0] - 0.5) ** 2 + (x[1] - 0.5) ** 2 - 0.04) * 0
        return ((x[0] - 0.9) ** 2 + hole,), ((x[1] - 0.9) ** 2 + x[0] + hole,)

    told = searched(Toy(kernel, [0, 0], [1, 1]), few(400), Polishing(points=10))
    assert told.is_polished.all()
    assert np.allclose(told.designs[:, 1], 0.9, atol=1e-4)
    assert np.allclose(told.designs[[0, -1], 0], [0.9, 0], atol=1e-4)


@pytest.mark.parametrize(
    ("toy", "expected"),
    [
        (Toy(lambda x: ((1.0 + 0 * x[0],), ((x[1] - 0.25) ** 2,)), [0, 0], [1, 1]), 0.25),
        (Toy(lambda x: ((x[1] ** 2 - 0.5 * x[1],), (x[0],)), [0.5, 0], [0.5, 1]), 0.25),
        (Toy(lambda x: (((x[1] - 0.25) ** 2,), (0 * x[0],)), [0, 0], [1, 1], discrete=((2.0,), None)), 0.25),
        (Toy(lambda x: ((1.0 + 0 * x[0],), (0 * x[0],)), [0, 0], [1, 1]), None),
        (Toy(lambda x: ((x[1],), (-2 * x[1],)), [0, 0], [1, 1], discrete=((1.0, 2.0), (3.0, 4.0))), None),
    ],
    ids=["objective", "variable", "choice", "all", "no slopes"],
)
def test_what_is_constant_does_no_harm(toy, expected):
    told = searched(toy, few(100, 10), Polishing(points=6))
    assert len(told.designs) == (2 if toy.discrete[1] else 1)
    assert told.is_polished.all()
    if expected is not None:
        assert told.designs[0, 1] == pytest.approx(expected, abs=1e-6)


# A model that is true nearby only: a roll that is held in it and chosen anew in truth.


@dataclass
class Rolling:
    """The best is at x = y = 0.5 with its roll, sin(3 x); with another one held, the model's best lies elsewhere."""

    variables = ("x", "y")
    objectives = ("worst",)
    constraints = ("sum",)
    discrete = (None, None)
    low, high = np.zeros(2), np.ones(2)
    models = 0

    def both(self, x, y, roll):
        worst = (x - 0.5) ** 2 + (y - 0.5) ** 2 + 0.4 * (roll - np.sin(3 * x)) ** 2
        return np.stack([worst, 0.8 - x - y + 0 * roll], axis=-1)

    def values(self, designs):
        x, y = designs.T
        found = self.both(x, y, np.sin(3 * x))
        return Values(found[:, :1], found[:, 1:])

    def model(self, design):
        self.models += 1
        roll = np.sin(3 * design[0])

        def by(at):
            return np.stack([self.both(*(at + 1e-30j * e), roll).imag / 1e-30 for e in np.eye(2)], axis=1)

        return Rows(np.arange(2), lambda at: self.both(*at, roll), by)


@dataclass
class Bending:
    """The farthest way along x + y within a circle, of which a model knows the tangent only."""

    variables = ("x", "y")
    objectives = ("behind",)
    constraints = ("circle",)
    discrete = (None, None)
    low, high = np.zeros(2), np.ones(2)

    def values(self, designs):
        return Values(-designs.sum(axis=1)[:, None], (designs**2).sum(axis=1)[:, None] - 0.64)

    def model(self, design):
        slopes = np.stack([-np.ones(2), 2 * design])
        here = np.concatenate([*self.values(design[None])])[:, 0]
        return Rows(np.arange(2), lambda at: here + slopes @ (at - design), lambda at: slopes)


def test_limits_that_bend_away_from_their_models_are_followed():
    """Every step along the tangent leaves the circle: what the whole step misses it by is taken into account."""
    about = polisher(Bending(), [0.8, 0.0])
    point = about.towards(np.array([0.8, 0.0]), np.array([-0.8]), np.ones(1))
    assert point.both[0] == pytest.approx(-0.8 * np.sqrt(2), abs=1e-8)
    assert point.both[1] <= 1e-9


def test_limits_that_are_missed_by_rounding_are_met():
    """A cone between curved ground: quadratic programming itself misses it by a few 1e-9."""

    def kernel(x):
        cone = jnp.sqrt(x[0] ** 2 + x[1] ** 2 + 1e-16) - x[2]
        return (x[2],), (cone,), (1 - x[0] - 2 * x[1] + 0.2 * x[0] ** 2,)

    toy = Toy(kernel, [-2, -2, 0], [2, 2, 3], ("height",), ("cone", "ground"))
    model = toy.model

    def stiff(at):  # 70 % of how rows bend
        made = model(at)
        here, by = made.rows(at), made.slopes(at)
        return Rows(
            made.owner, lambda x: 0.3 * (here + by @ (x - at)) + 0.7 * made.rows(x), lambda x: 0.3 * by + 0.7 * made.slopes(x)
        )

    toy.model = stiff
    start = np.array([1.7, 0.3, 0.9])
    point = polisher(toy, start).pursued(start, improving(start[2:], np.ones(1), np.ones(1), 2))
    assert np.max(point.both[1:]) <= 1e-9
    assert point.both[0] == pytest.approx(0.4506228794, abs=1e-7)


def test_a_model_without_bounds_that_bend_is_asked_once():
    """Far from true, so that steps lead to nothing: asked again, it would say the same."""
    toy = Rolling()
    toy.values = lambda designs: Values(1 + np.abs(designs - [0.1, 0.95]).sum(axis=1)[:, None], -np.ones((len(designs), 1)))
    about = polisher(toy, [0.1, 0.95])
    about.pursued(np.array([0.1, 0.95]), improving(np.ones(1), np.ones(1), np.ones(1), 1))
    assert about.few.count == 2 + 4 * toy.models


class Ending(Bending):
    """Along x + 0.6 y within a circle that no constraint tells: beyond it there are no values."""

    constraints = ()

    def values(self, designs):
        is_within = (designs**2).sum(axis=1) <= 0.64
        return Values(np.where(is_within, -designs @ [1.0, 0.6], np.nan)[:, None], np.zeros((len(designs), 0)))

    def model(self, design):
        return Rows(np.zeros(1, int), lambda at: self.values(at[None]).objectives[0], lambda at: np.array([[-1.0, -0.6]]))


def test_where_values_end_short_steps_lead_on():
    """Quadratic programming loses its way there and leads to -0.672; the best of all is -0.933."""
    about = polisher(Ending(), [0.1, 0.7])
    point = about.towards(np.array([0.1, 0.7]), np.array([-0.52]), np.ones(1))
    assert point.both[0] < -0.75


def test_models_are_trusted_as_far_as_they_were_true():
    trust = Trust(0.4, 0.5, 0.1)
    radii = []
    for part in (1.0, 0.5, 0.01, None, 1.0):
        trust.went(part)
        radii.append(trust.radius)
    assert radii == pytest.approx([0.5, 0.25, 0.025, 0.0025, 0.005])


def test_models_are_made_anew_until_nothing_is_gained():
    rolling = Rolling()
    about = polisher(rolling, [0.1, 0.95])
    point = about.towards(np.array([0.1, 0.95]), np.array([1.0]), np.ones(1))
    assert np.allclose(point.design, 0.5, atol=1e-5)
    assert rolling.models > 2


def test_a_model_that_lies_leads_to_nothing_worse():
    toy = zdt1(3)
    model = toy.model

    def lying(design):
        made = model(design)
        return Rows(made.owner, lambda x: 2 * made.of(design) - made.of(x), lambda x: -made.by(x))

    toy.model = lying
    about = polisher(toy, [0.5, 0.2, 0.4])
    start = toy.values(np.array([[0.5, 0.2, 0.4]])).objectives[0]
    point = about.towards(np.array([0.5, 0.2, 0.4]), start, np.ones(2))
    assert np.array_equal(point.both, start)
    assert np.array_equal(point.design, [0.5, 0.2, 0.4])


def test_discrete_variables_are_held_by_a_model_and_bounds_kept():
    toy = truss(None, AREAS)
    about = polisher(toy, [0.44, 3.0, 2.5])
    start = toy.values(np.array([[0.44, 3.0, 2.5]])).objectives[0]
    point = about.towards(np.array([0.44, 3.0, 2.5]), start, start)
    assert point.design[0] == 0.44
    assert np.all((point.design >= Box.of(toy).low) & (point.design <= Box.of(toy).high))
    assert np.all(point.both < start)


def test_more_points_have_more_volume():
    fronts = [searched(osy(), few(), Polishing(points=points)).values.objectives for points in (8, 40)]
    assert 6 <= len(fronts[0]) <= 8
    assert 36 <= len(fronts[1]) <= 40
    ideal, reference = box(*fronts)
    assert volume(fronts[0], ideal, reference) < volume(fronts[1], ideal, reference)
