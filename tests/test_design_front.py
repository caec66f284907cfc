"""Evolution, archives, hypervolumes and how fronts are told, on problems in closed form."""

from __future__ import annotations

from itertools import groupby

import jax.numpy as jnp
import numpy as np
import pytest
from toy_designs import Toy, binh_korn, osy, truss, zdt1, zdt3

from trivet.design.front.archive import Archive, is_best, ranks, spread
from trivet.design.front.box import Box
from trivet.design.front.evolution import Evolution, evolved
from trivet.design.front.front import told as told_of
from trivet.design.front.gaps import gaps
from trivet.design.front.polisher import Polishing
from trivet.design.front.problem import Asked, Values
from trivet.design.front.search import TURNS, searched
from trivet.design.front.volume import box, compared, dominates, volume
from trivet.errors import NoResultError


def few(evaluations=600, population=30, seed=0):
    return Evolution(evaluations, population=population, seed=seed)


def random_front(seed, count=60, many=2):
    return np.random.default_rng(seed).random((count, many))


# What dominates what.


@pytest.mark.parametrize("many", [1, 2, 3])
def test_best_are_those_that_nothing_dominates(many):
    points = np.round(random_front(0, many=many), 1)
    by = dominates(points, points).any(axis=0)
    best = is_best(points)
    assert not by[best].any()
    # Of equal points one counts, so every point is dominated by a best one or equal to one.
    assert np.all(dominates(points[best], points).any(axis=0) | (points[best][:, None] == points).all(axis=2).any(axis=0))
    assert len(np.unique(points[best], axis=0)) == best.sum()
    assert np.array_equal(ranks(points) == 0, ~by)


def test_points_that_are_kept_lie_far_from_each_other_and_hold_the_ends():
    points = np.column_stack([x := np.linspace(0, 1, 301) ** 3, 1 - x])
    kept = points[spread(points, 11)]
    assert set(kept[:, 0]) >= {0.0, 1.0}
    steps = np.diff(np.sort(kept[:, 0]))
    assert steps.max() <= 2.1 * steps.min()  # as always of choices by the farthest
    assert len(spread(points, 11, [5])) == 11
    assert 5 in spread(points, 11, [5])
    assert len(spread(points, 301, [0], closest=0.5)) <= 3


def test_an_archive_holds_the_best_of_all_that_was_offered_in_any_order():
    points = random_front(1, 400)
    constraints = np.random.default_rng(2).normal(size=(400, 1))
    values, fine = Values(points, constraints), constraints[:, 0] <= 0
    for order in (np.arange(400), np.arange(400)[::-1]):
        archive = Archive.empty(2, 2, 1)
        for some in np.array_split(order, 9):
            archive.add(points[some], values.at(some))
        best = np.sort(archive.best[0], axis=0)
        assert np.array_equal(best, np.sort(points[fine][is_best(points[fine])], axis=0))


def test_what_was_dominated_stays_so_when_there_is_no_room_for_what_dominated_it():
    front, behind = (np.column_stack([x := np.linspace(0, 1, many), 1 - x]) for many in (300, 217))
    behind = behind + 0.01
    archive = Archive.empty(2, 2, 0)
    archive.limit = 20
    for some in (behind, front, front[:0]):
        archive.add(some, Values(some, np.zeros((len(some), 0))))
        archive.prune()
    assert len(archive.best[0]) == 20
    assert np.allclose(archive.best[1].objectives.sum(axis=1), 1)
    assert len(archive) == 40


# Hypervolume.


def test_volume_of_steps_is_that_of_their_boxes():
    points = np.array([[1.0, 4.0], [2.0, 2.0], [3.5, 1.0], [3.0, 3.0], [9.0, 0.0]])  # dominated and outside: nothing more
    by_hand = (2 - 1) * (5 - 4) + (3.5 - 2) * (5 - 2) + (5 - 3.5) * (5 - 1)
    assert volume(points, np.zeros(2), np.full(2, 5.0)) == pytest.approx(by_hand / 25, rel=1e-14)
    assert volume(points[-1:], np.zeros(2), np.full(2, 5.0)) == 0


def test_volume_keeps_when_objectives_are_scaled_and_grows_with_points():
    points, scale, move = random_front(3), np.array([3.0, 1e6]), np.array([-7.0, 1e5])
    ideal, reference = box(points)
    found = volume(points, ideal, reference)
    assert volume(points * scale + move, ideal * scale + move, reference * scale + move) == pytest.approx(found, rel=1e-9)
    assert volume(points[:30], ideal, reference) < found < volume(points - 0.01, ideal, reference)


def test_of_two_fronts_the_better_dominates_the_other():
    front = np.column_stack([x := np.linspace(0, 1, 50), 1 - x])
    versus = compared(front, front + 0.05)
    assert versus.volumes[0] > versus.volumes[1]
    assert versus.dominated == (0.0, 1.0)
    same = compared(front, front)
    assert same.dominated == (0.0, 0.0)
    assert same.volumes[0] == same.volumes[1]


# Where a front has room.


@pytest.mark.parametrize("many", [2, 3])
def test_gaps_of_a_curve_are_those_between_neighbours(many):
    x = np.sort(np.random.default_rng(4).random(40))
    front = np.column_stack([x, (1 - x) ** 2, 0.3 * (1 - x)])[:, :many]
    order = np.random.default_rng(5).permutation(40)
    found = gaps(front[order], np.ones(many))
    assert {tuple(sorted((order[gap.first], order[gap.second]))) for gap in found} == {(i, i + 1) for i in range(39)}
    assert [gap.length for gap in found] == sorted((gap.length for gap in found), reverse=True)
    for gap in found:
        a, b = front[order[gap.first]], front[order[gap.second]]
        assert np.allclose(gap.middle, (a + b) / 2)
        assert np.all(gap.direction > 0)
        assert np.linalg.norm(gap.direction) == pytest.approx(1)
        assert many > 2 or abs(np.dot(gap.direction, a - b)) <= 0.06 * gap.length


def test_gaps_over_a_surface_join_neighbours_only():
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    found = gaps(np.column_stack([grid, -grid.sum(axis=1)]), np.ones(3))
    steps = {tuple(np.abs(grid[gap.first] - grid[gap.second])) for gap in found}
    assert {(1.0, 0.0), (0.0, 1.0)} <= steps <= {(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)}


# Designs as genes.


def test_genes_and_designs_are_one_another_and_ends_are_not_missed():
    some = Box(np.array([-1.0, 0.1, 0.0, 3.0]), np.array([1.0, 0.7, 9.0, 3.0]), (None, None, (0.5, 2.0, 7.0), None))
    genes = np.array([[0.0, 1.0, 0, 0], [1.0, 0.0, 1, 0], [0.3, 0.3, 2, 0]])
    designs = some.designs(genes)
    assert designs[:2].tolist() == [[-1.0, 0.7, 0.5, 3.0], [1.0, 0.1, 2.0, 3.0]]
    assert np.allclose(some.genes(designs), genes, atol=1e-15)
    assert some.is_free.tolist() == [True, True, False, False]
    assert sorted(design[2] for design in some.beside(designs[1])) == [0.5, 7.0]
    assert [design[2] for design in some.beside(designs[0])] == [2.0]


# Evolution.


def test_evolution_approaches_a_front_that_is_known():
    archive = evolved(Asked(zdt1(4)), few(3000, 60))
    objectives = archive.best[1].objectives
    assert np.all(objectives[:, 1] >= 1 - np.sqrt(objectives[:, 0]) - 1e-9)
    assert volume(objectives, np.zeros(2), np.full(2, 1.1)) > 0.9 * (1.21 - 1 / 3) / 1.21


def test_more_evolution_is_never_worse():
    short, long = (evolved(Asked(zdt3(5)), few(evaluations)).best[1].objectives for evaluations in (300, 900))
    same = (short[:, None] == long).all(axis=2).any(axis=1)
    assert np.all(same | dominates(long, short).any(axis=0))
    assert len(long) > len(short)


def test_evolution_is_the_same_for_the_same_seed_and_another_for_another():
    one, again, other = (evolved(Asked(osy()), few(seed=seed)) for seed in (1, 1, 2))
    assert one.designs.tobytes() == again.designs.tobytes()
    assert one.designs.tobytes() != other.designs.tobytes()


@pytest.mark.parametrize("many", [1, 2, 3, 4])
def test_discrete_variables_take_their_values_only_and_all_of_them(many):
    seen = []

    def kernel(x):
        return tuple((jnp.sum((x - jnp.arange(4) % (i + 2)) ** 2),) for i in range(many))

    areas = (0.2, 1.1, 3.0, 1.4)
    toy = Toy(kernel, [0] * 4, [3] * 4, ("a", "b", "c", "d")[:many], discrete=(None, areas, None, (2.0,)))
    asked = Asked(toy, batch=20)
    values = toy.values
    toy.values = lambda designs: (seen.extend(designs), values(designs))[1]
    evolved(asked, few(300, 20))
    assert {design[1] for design in seen} == set(areas)
    assert {design[3] for design in seen} == {2.0}
    assert np.min(seen) >= 0
    assert np.max(seen) <= 3


def test_designs_to_begin_with_are_asked_for_first():
    toy, start = zdt1(3), np.array([[0.25, 0.0, 0.0], [0.81, 0.0, 0.0]])
    archive = evolved(Asked(toy), few(30), start)
    for design in start:
        assert np.any(np.all(np.abs(archive.best[0] - design) < 1e-15, axis=1))


# What is known already.


def test_nothing_is_asked_twice_and_always_as_much_at_once():
    toy = zdt1(3)
    asked = Asked(toy, batch=7)
    designs = np.random.default_rng(0).random((16, 3))
    first = asked(designs)
    assert toy.batches == [7, 7, 7]
    again = asked(designs[::-1])
    assert toy.batches == [7, 7, 7]
    assert np.array_equal(again.objectives, first.objectives[::-1])
    for zero in (0.0, -0.0):
        asked(zero * designs[:1])
    assert toy.batches == [7, 7, 7, 7]
    assert asked.count == 34


class Killed(Exception):
    pass


class Journal(dict):
    """Knows what was known when it was killed."""

    def __init__(self, known, lives):
        super().__init__(known)
        self.lives = lives

    def update(self, *new):
        super().update(*new)
        self.lives -= 1
        if self.lives < 0:
            raise Killed


@pytest.mark.parametrize("lives", [0, 7, 25, 60])
def test_a_search_that_was_killed_ends_as_if_it_had_not_been(lives):
    whole = searched(truss(None, (0.3, 0.5, 0.8)), few(), Polishing(points=12), Journal({}, 10**9))
    journal = Journal({}, lives)
    with pytest.raises(Killed):
        searched(truss(None, (0.3, 0.5, 0.8)), few(), Polishing(points=12), journal)
    resumed = searched(truss(None, (0.3, 0.5, 0.8)), few(), Polishing(points=12), Journal(dict(journal), 10**9))
    for a, b in ((whole.designs, resumed.designs), (whole.alternatives, resumed.alternatives)):
        assert a.tobytes() == b.tobytes()
    assert whole.active == resumed.active
    assert np.array_equal(whole.is_polished, resumed.is_polished)


def test_what_is_known_needs_neither_values_nor_models():
    memo = {}
    whole = searched(binh_korn(), few(300), Polishing(points=8), memo)
    idle = binh_korn()
    idle.values = idle.model = None
    assert searched(idle, few(300), Polishing(points=8), memo).designs.tobytes() == whole.designs.tobytes()


# How a front is told.


def test_a_front_tells_what_holds_its_points_and_what_comes_next():
    told = searched(binh_korn(), few(), Polishing(points=16))
    objectives = told.values.objectives
    assert np.all(np.diff(objectives[:, 0]) > 0)
    assert np.all(np.diff(objectives[:, 1]) < 0)
    assert told.values.is_feasible.all()
    assert told.is_polished.all()
    x, y = told.designs.T
    assert np.allclose(y, np.minimum(x, 3), atol=2e-5)  # the front in closed form
    for design, bounds in zip(told.designs, told.bounds, strict=True):
        assert [tuple(bound) for bound in bounds if bound.variable == "x2"] == (
            [("x2", False)] if design[1] < 1e-6 else [("x2", True)] if design[1] > 3 - 1e-6 else []
        )
    assert set().union(*told.active) <= {"inside"}
    beside = (told.alternatives[:, None] - told.designs) / np.ptp([binh_korn().low, binh_korn().high], axis=0)
    assert np.abs(beside).max(axis=2).min() > 1e-3  # none is a point once more


def test_alternatives_are_dominated_and_ranked_by_what_dominates_them():
    archive = evolved(Asked(binh_korn()), few(300))
    front, beside = told_of(binh_korn(), archive, 16), archive.values.objectives[archive.is_dominated]
    found = front.alternative_values
    assert len(front.alternatives) == 16
    assert found.is_feasible.all()
    assert dominates(archive.best[1].objectives, found.objectives).any(axis=0).all()
    assert np.array_equal(front.ranks, 1 + dominates(beside, found.objectives).any(axis=0))
    assert np.all(np.diff(front.ranks) >= 0)
    assert set(front.ranks) == {1, 2}


def test_progress_is_told_of_all_stages_and_grows_in_each():
    heard = []
    searched(binh_korn(), few(200), Polishing(points=6), tell=heard.append)
    parts = [(stage, list(some)) for stage, some in groupby(heard, key=lambda one: one.stage)]
    assert [stage for stage, _ in parts] == ["evolution", "coarse polish"] * TURNS + ["polish"]
    evolving = [[one.done for one in some] for stage, some in parts if stage == "evolution"]
    assert evolving == [[0, 30, 60], [60, 90, 120], [120, 150, 180], [180, 210]]  # in all; whole generations
    for stage, some in parts:
        done = [one.done for one in some]
        assert done == sorted(done)
        assert stage == "evolution" or done[0] == 0  # before what may take long
        assert {one.of for one in some} == {"evolution": {210}, "coarse polish": {8}, "polish": {None}}[stage]
        assert all(one.of is None or one.done <= one.of for one in some)
    assert [one.done for one in parts[-1][1]] == list(range(len(parts[-1][1])))  # none is left out, none twice


def test_evolution_of_no_whole_generations_is_told_no_more_than_it_was_asked_for():
    heard = []
    evolved(Asked(binh_korn()), few(50), tell=heard.append)
    assert [(one.done, one.of) for one in heard] == [(0, 50), (30, 50), (50, 50)]


def test_that_limits_are_yet_to_be_met_is_told():
    toy = Toy(lambda x: ((x[0],), (x[1],), (x[0] - 0.3,), (2 - x[1],)), [0, 0], [1, 1], constraints=("short", "high"))
    heard = []
    with pytest.raises(NoResultError):
        searched(toy, few(60), Polishing(), tell=heard.append)
    assert heard[-1][:3] == ("limits", 0, None)


# Where there is no result.


def test_contradictory_constraints_are_both_named():
    toy = Toy(lambda x: ((x[0],), (x[1],), (x[0] - 0.3,), (0.5 - x[0],), (x[1] - 2,)), [0, 0], [1, 1],
              constraints=("short", "long", "tall"))  # fmt: skip
    with pytest.raises(NoResultError, match=r"misses 'short' by 0\.1 and 'long' by 0\.1, .*relax one of them") as caught:
        searched(toy, few(300), Polishing(), memo := {})
    assert "tall" not in str(caught.value)
    with pytest.raises(NoResultError) as again:  # also of how many designs it tells the same
        searched(toy, few(300), Polishing(), memo)
    assert str(again.value) == str(caught.value)


def test_a_constraint_that_cannot_be_met_is_named():
    toy = Toy(lambda x: ((x[0],), (x[1],), (x[0] - 0.3,), (2 - x[1],)), [0, 0], [1, 1], constraints=("short", "high"))
    with pytest.raises(NoResultError, match=r"nearest misses 'high' by 1, .*relax it"):
        searched(toy, few(300), Polishing())


def test_designs_without_any_value_are_said_to_have_none():
    toy = Toy(lambda x: ((jnp.nan * x[0],), (x[1],)), [0, 0], [1, 1])
    with pytest.raises(NoResultError, match="none of the 300 designs tried has a value"):
        searched(toy, few(300), Polishing())


@pytest.mark.parametrize("is_late", [False, True])
def test_time_that_is_up_leaves_an_honest_front(is_late):
    seconds = 0.0 if is_late else float("inf")
    told = searched(binh_korn(), Evolution(10**9 if is_late else 90, seconds, 30), Polishing(points=6, seconds=seconds))
    assert len(told.designs) > 0
    assert told.values.is_feasible.all()
    assert told.is_polished.any() != is_late
