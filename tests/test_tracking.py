"""Modes followed by MAC: oscillators with known crossings and veerings, then machines."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import trivet as t
from trivet.errors import InputError
from trivet.model import load
from trivet.study.mode_paths import ModePaths, modes_along
from trivet.study.pathfile import PathFile, PathPose
from trivet.vibration.assurance import assurance, coinciding, overlap
from trivet.vibration.encounters import Encounter
from trivet.vibration.kinetic import Layout
from trivet.vibration.tracking import Branches, Sample, track

Matrix = Callable[[float], np.ndarray]
HERTZ = 2 * math.pi


def oscillators(matrix: Matrix) -> Callable[[float, int], Sample]:
    """Modes of unit masses whose stiffness depends on a parameter."""

    def solve(place: float, count: int) -> Sample:
        squares, vectors = np.linalg.eigh(matrix(place))
        # Signs as rounding chooses them.
        signs = np.where(np.sin(1e3 * place + np.arange(len(squares))) < 0, -1.0, 1.0)
        return Sample(np.sqrt(squares[:count]) / HERTZ, (vectors * signs)[:, :count])

    return solve


def follow(matrix: Matrix, start: float, end: float, steps: int, count: int) -> Branches:
    return track(oscillators(matrix), np.linspace(start, end, steps + 1).tolist(), count)


def hertz(square: float) -> float:
    return math.sqrt(square) / HERTZ


def pair(coupling: float) -> Matrix:
    """Two oscillators whose squares 10 + s and 11 - s meet at s = 1/2."""
    return lambda s: np.array([[10 + s, coupling / 2], [coupling / 2, 11 - s]])


def turned(matrix: Matrix, rate: float) -> Matrix:
    """The same with shapes that all turn slowly, so that no mode keeps to an axis."""

    def at(s: float) -> np.ndarray:
        own = matrix(s)
        size, angle = len(own), rate * s
        turn = np.eye(size)
        turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        return turn @ own @ turn.T

    return at


@pytest.mark.parametrize("steps", [3, 7, 19, 80])
def test_uncoupled_oscillators_cross(steps: int) -> None:
    found = follow(pair(0.0), 0.0, 1.03, steps, 2)
    for place, frequency in zip(found.place, found.frequency, strict=True):
        assert frequency == pytest.approx([hertz(10 + place), hertz(11 - place)], rel=1e-12)
    (one,) = found.encounters
    assert (one.kind, one.first, one.second, one.gap) == ("cross", 0, 1, 0.0)
    assert one.place == pytest.approx(0.5, abs=1e-5)
    assert one.frequency == pytest.approx(hertz(10.5), rel=1e-6)
    assert found.doubts == ()


@pytest.mark.parametrize("coupling", [0.3, 1e-2, 1e-4])
@pytest.mark.parametrize("steps", [3, 19, 80])
def test_coupled_oscillators_veer_however_close_they_come(coupling: float, steps: int) -> None:
    found = follow(pair(coupling), 0.0, 1.03, steps, 2)
    for place, frequency in zip(found.place, found.frequency, strict=True):
        half = math.hypot(2 * place - 1, coupling) / 2
        assert frequency == pytest.approx([hertz(10.5 - half), hertz(10.5 + half)], rel=1e-12)
    (one,) = found.encounters
    assert (one.kind, one.first, one.second) == ("veer", 0, 1)
    assert one.place == pytest.approx(0.5, abs=2e-4)
    # The squares differ by the coupling there: f1 - f2 = coupling / (4 pi^2 (f1 + f2)).
    assert one.gap == pytest.approx(coupling / (HERTZ**2 * 2 * hertz(10.5)), rel=1e-3)
    # Away from the middle the shapes lean by atan(coupling / (difference of the squares)) / 2.
    whole = (math.atan2(coupling, -1.0) - math.atan2(coupling, 1.06)) / 2
    assert one.exchange == pytest.approx(whole, rel=1e-3)
    assert found.doubts == ()
    assert found.mac.min() > 0.8


def test_a_weak_interplay_is_no_veering() -> None:
    """The squares differ by less in the middle than at the ends, and the shapes turn by 33 deg only."""
    found = follow(pair(1.5), 0.0, 1.0, 20, 2)
    assert found.encounters == ()


def test_branches_that_touch() -> None:
    found = follow(lambda s: np.diag([10.0, 10 + (s - 0.5) ** 2]), 0.0, 1.0, 10, 2)
    (one,) = found.encounters
    assert (one.kind, one.place, one.gap) == ("touch", pytest.approx(0.5), 0.0)
    assert found.frequency[:, 0] == pytest.approx([hertz(10.0)] * 11)


@pytest.mark.parametrize("matrix", [pair(0.0), pair(0.05), turned(pair(0.0), 2.0), turned(pair(0.05), 2.0)])
def test_backwards_the_branches_are_the_same(matrix: Matrix) -> None:
    def backwards(place: float) -> np.ndarray:
        return matrix(1.0 - place)

    there = follow(matrix, 0.0, 0.9, 12, 2)
    back = follow(backwards, 0.1, 1.0, 12, 2)
    mine = back.frequency[::-1]
    same = mine if mine[0, 0] < mine[0, 1] else mine[:, ::-1]
    np.testing.assert_allclose(there.frequency, same, rtol=1e-10)
    assert [(one.kind, round(one.place, 3)) for one in there.encounters] == [
        (one.kind, round(1.0 - one.place, 3)) for one in back.encounters
    ]


def test_step_sizes_make_no_difference() -> None:
    """Twelve coupled oscillators with many crossings and veerings: every fourth of 80 steps is one of 20."""
    rng = np.random.default_rng(3)
    slopes = rng.uniform(-1, 1, 12)
    links = 0.03 * rng.standard_normal((12, 12)) * (rng.random((12, 12)) < 0.3)

    def matrix(s: float) -> np.ndarray:
        return np.diag(10 + 0.25 * np.arange(12) + slopes * s) + links + links.T

    coarse, fine = (follow(matrix, 0.0, 2.0, steps, 6) for steps in (20, 80))
    assert len(coarse.encounters) >= 8
    assert {one.kind for one in coarse.encounters} == {"cross", "veer"} or {one.kind for one in fine.encounters} == {"veer"}
    for k in range(6):
        other = int(np.argmin(np.abs(fine.frequency[0] - coarse.frequency[0, k])))
        np.testing.assert_allclose(coarse.frequency[:, k], fine.frequency[::4, other], rtol=1e-12)
    assert coarse.doubts == fine.doubts == ()


def test_a_pair_parts_and_its_mixture_is_that_which_goes_on() -> None:
    """Alike until s = 1, apart from then on along axes at 30 deg: the turns of all places before lead to these."""
    axes = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])

    def matrix(s: float) -> np.ndarray:
        return axes @ np.diag([10.0, 10.0 + max(0.0, s - 1.0)]) @ axes.T

    solve = oscillators(matrix)
    found = track(solve, np.linspace(0, 2, 9).tolist(), 2)
    assert found.frequency[-1] == pytest.approx([hertz(10.0), hertz(11.0)])
    assert found.doubts == ()
    assert found.encounters == ()
    for place, turn in zip(found.place, found.turn, strict=True):
        np.testing.assert_allclose(np.abs(axes.T @ solve(place, 2).vectors @ turn), np.eye(2), atol=1e-7)
    shapes = [solve(place, 2).vectors @ turn for place, turn in zip(found.place, found.turn, strict=True)]
    assert all(np.all(np.sum(a * b, axis=0) > 0.99) for a, b in pairwise(shapes))


def test_a_turn_of_the_path_at_a_double_mode_is_not_certain() -> None:
    """In along one axis, out along another at 45 deg to it: no mode that leaves is one of those that came."""
    along, across = np.array([[1.0, 0.0], [0.0, -1.0]]), np.array([[0.0, 1.0], [1.0, 0.0]])

    def matrix(s: float) -> np.ndarray:
        return 10 * np.eye(2) + abs(s - 1) * (along if s < 1 else across)

    found = follow(matrix, 0.0, 2.0, 10, 2)
    assert {doubt.branch for doubt in found.doubts} == {0, 1}
    for doubt in found.doubts:
        assert doubt.mac == pytest.approx(0.5, abs=1e-3)
        assert (doubt.start, doubt.end) == pytest.approx((1.0, 1.0), abs=1e-4)


def test_modes_come_in_and_go_out() -> None:
    """The tenth oscillator falls through the lowest three; those that it pushes up are followed on."""

    def matrix(s: float) -> np.ndarray:
        return np.diag([10.0 + k for k in range(14)] + [30.0 - 25 * s])

    found = follow(matrix, 0.0, 1.0, 40, 3)
    assert found.frequency.shape == (41, 4)
    np.testing.assert_allclose(found.frequency[:, :3], [[hertz(10.0 + k) for k in range(3)]] * 41)
    comes = found.frequency[:, 3]
    seen = np.isfinite(comes)
    assert not seen[0]
    assert seen[-1]
    assert comes[seen] == pytest.approx([hertz(30 - 25 * s) for s in found.place[seen]])
    assert [(one.kind, one.first, one.second) for one in found.encounters] == [("cross", k, 3) for k in (2, 1, 0)]
    assert found.number[-1].tolist() == [1, 2, 3, 0]
    assert found.doubts == ()


def test_mac_is_a_squared_cosine() -> None:
    rng = np.random.default_rng(1)
    first, _ = np.linalg.qr(rng.standard_normal((9, 4)))
    second, _ = np.linalg.qr(rng.standard_normal((9, 4)))
    singles = [[k] for k in range(4)]
    mac = assurance(overlap(first, second), singles, singles)
    assert np.all((mac >= 0) & (mac <= 1))
    np.testing.assert_allclose(mac, assurance(overlap(-first, second), singles, singles))
    np.testing.assert_allclose(assurance(overlap(first, first), singles, singles), np.eye(4), atol=1e-15)
    # Spaces: whatever mixtures span them.
    runs = [[0, 1], [2], [3]]
    angle = rng.uniform(0, 6)
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    np.testing.assert_allclose(
        assurance(overlap(first @ turn, second), runs, runs), assurance(overlap(first, second), runs, runs), atol=1e-14
    )
    np.testing.assert_allclose(assurance(overlap(first @ turn, first), runs, runs)[:2, :2], 1.0)
    assert coinciding(np.array([1.0, 1.0 + 1e-8, 1.001])) == [[0, 1], [2]]


@pytest.mark.parametrize("places", [[], [1.0], [1.0, 1.0], [2.0, 1.0]])
def test_a_way_has_at_least_two_places(places: list[float]) -> None:
    with pytest.raises(InputError, match="at least two, each beyond"):
        track(oscillators(pair(0.0)), places, 1)
    with pytest.raises(InputError, match="count: 0"):
        track(oscillators(pair(0.0)), [0.0, 1.0], 0)


def vectors(name: str, **pose: Any) -> np.ndarray:
    """The lowest eight modes as vectors."""
    report = t.modes(name, count=8, **pose)
    return Layout().vectors(report.modes, np.array(report.at.frame.matrix(), dtype=float))


@pytest.mark.parametrize("name", t.catalogue())
def test_modes_are_orthonormal_vectors(name: str) -> None:
    own = vectors(name)
    np.testing.assert_allclose(own.T @ own, np.eye(8), atol=1e-9)


def test_a_machine_that_turns_as_a_whole_has_the_vectors_it_had() -> None:
    """Eclipse's circular guide lets it turn about z: in the axes of the parts nothing changes."""
    here, there = vectors("eclipse"), vectors("eclipse", roll=0.3)
    found = assurance(overlap(here, there), *[coinciding(t.modes("eclipse", count=8).modes.mesh_frequency)] * 2)
    np.testing.assert_allclose(np.diag(found), 1.0, atol=1e-6)


def to(name: str, *, by: tuple[float, float, float] = (0, 0, 0), start: float = 0.0, **angles: float) -> PathFile:
    """From home, tilted by `start`, to a pose that differs by so much (m and rad)."""
    home = load(name).home
    place = tuple(float(c) + d for c, d in zip(home.position, by, strict=True))
    end = {key: getattr(home, key) + angles.get(key, 0.0) for key in ("azimuth", "tilt", "roll")}
    return PathFile([PathPose(home.position, home.azimuth, home.tilt + start, home.roll), PathPose(place, **end)])


@cache
def meridian(steps: int = 8) -> ModePaths:
    return modes_along("azulay", to("azulay", tilt=math.radians(20)), count=6, steps=steps, elements=4)


def test_pairs_of_a_symmetric_machine_part_along_a_meridian() -> None:
    found = meridian()
    np.testing.assert_allclose(found.frequency[0, [0, 4]], found.frequency[0, [1, 5]], rtol=1e-6)
    crossings = [one for one in found.encounters if one.kind == "cross"]
    assert [(one.first, one.second) for one in crossings] == [(0, 1)]
    assert found.scale.at(crossings[0].place) == pytest.approx(5.93, abs=0.02)
    # The plane of the meridian is one of symmetry: a mode moves the platform within it or across it, at every pose.
    within, across = found.platform[:, [0, 2, 4]], found.platform[:, [1, 3, 5]]
    length = np.array([1, 1, found.length])[:, None]
    sizes = np.linalg.norm(within * length[[0, 1, 2]], axis=1), np.linalg.norm(across * length[[0, 2, 2]], axis=1)
    assert np.all(np.minimum(*sizes) < 1e-5 * np.maximum(*sizes))
    assert np.all((sizes[0] > sizes[1]) == (sizes[0] > sizes[1])[0])
    assert found.branches.doubts == ()


EVERYTHING_MOVES = to("glozman", by=(0.003, 0.002, -0.004), start=0.02, tilt=0.25, azimuth=0.6, roll=-0.5)


@pytest.mark.parametrize(
    ("name", "path", "steps", "met"),
    [("azulay", to("azulay", tilt=math.radians(20)), 8, (3, 5, 8)), ("glozman", EVERYTHING_MOVES, 7, (1, 3, 5))],
)
def test_branches_are_modes_of_the_single_poses(name: str, path: PathFile, steps: int, met: tuple[int, ...]) -> None:
    """Numbered by frequency at the first pose; each has the frequency and the motion of the mode that it is said to be."""
    found = meridian() if name == "azulay" else modes_along(name, path, count=6, steps=steps, elements=4)
    numbers = found.branches.number
    assert np.all(np.diff(numbers[0][numbers[0] >= 0]) > 0)
    assert np.all(np.diff((numbers < 0).argmin(axis=0)) >= 0)
    start, end = (np.array([*p.position, p.azimuth, p.tilt, p.roll]) for p in path.poses)
    for k in met:
        x, y, z, *angles = start + k / steps * (end - start)
        single, own = t.modes(name, (x, y, z), *angles, count=12, elements=4), numbers[k]
        np.testing.assert_allclose(found.frequency[k], single.frequency[own], rtol=1e-8)
        np.testing.assert_allclose(found.branches.frequency[k], single.modes.mesh_frequency[own], rtol=1e-8)
        scale = np.abs(single.platform).max()
        np.testing.assert_allclose(np.abs(found.platform[k]), np.abs(single.platform[:, own]), rtol=0, atol=1e-5 * scale)
        largest = np.linalg.norm(single.modes.displacements[:, :3], axis=1).max(axis=0)
        np.testing.assert_allclose(found.largest[k], largest[own], rtol=1e-5)


def test_places_between_are_where_they_are_said_to_be() -> None:
    found = meridian()
    between = np.setdiff1d(found.branches.fine_place, found.place)
    assert len(between)
    for place in between:
        tilt = (place - 1) * math.radians(20)
        single = t.modes("azulay", tilt=tilt, count=6, elements=4).modes.mesh_frequency
        row = found.branches.fine_frequency[found.branches.fine_place == place][0]
        np.testing.assert_allclose(np.sort(row), single, rtol=1e-8)


def test_machines_do_not_depend_on_the_step_either() -> None:
    coarse, fine = meridian(), meridian(24)
    np.testing.assert_allclose(coarse.frequency, fine.frequency[::3], rtol=1e-8)
    assert [one.place for one in coarse.encounters] == pytest.approx([one.place for one in fine.encounters], abs=1e-3)


def kinds(found: list[Encounter]) -> list[str]:
    return sorted(one.kind for one in found)


@pytest.mark.parametrize(
    ("name", "path", "met"),
    [
        ("azulay", to("azulay", tilt=math.radians(16)), ["cross"]),
        ("glozman", EVERYTHING_MOVES, []),
    ],
)
def test_backwards_a_machine_has_the_same_branches(name: str, path: PathFile, met: list[str]) -> None:
    there = modes_along(name, path, count=6, steps=6, elements=3)
    back = modes_along(name, PathFile(path.poses[::-1]), count=6, steps=6, elements=3)
    order = [int(np.nanargmin(np.abs(back.frequency[0] - f))) for f in there.frequency[-1]]
    assert len(set(order)) == len(order)
    np.testing.assert_allclose(there.frequency, back.frequency[::-1, order], rtol=1e-7)
    assert kinds(there.encounters) == kinds(back.encounters) == met


def test_struts_of_a_hexapod_veer() -> None:
    """Twelve modes of six struts within a few Hz: they part at once, and exchange their shapes with the platform's."""
    path = to("gough-stewart", by=(0.01, 0.008, -0.004), tilt=0.1, azimuth=0.6, roll=-0.2)
    found = modes_along("gough-stewart", path, count=12, steps=3, elements=2)
    assert "veer" in kinds(found.encounters)
    assert found.branches.doubts == ()
    assert np.all(np.isfinite(found.frequency[:, :6]))


@pytest.mark.parametrize("name", t.catalogue())
def test_branches_of_every_machine_are_continuous(name: str) -> None:
    """Along a short random path frequencies and shapes change little, and every pose has all of its lowest modes."""
    rng = np.random.default_rng(t.catalogue().index(name))
    size = 0.05 * float(load(name).characteristic_length)
    move = tuple(float(c) for c in size * rng.uniform(-1, 1, 3))
    path = to(name, by=move, start=0.01, tilt=0.01 + 0.03 * float(rng.random()), roll=0.02 * float(rng.uniform(-1, 1)))
    found = modes_along(name, path, count=5, steps=3, elements=2, anyway=True)
    assert found.branches.doubts == ()
    for numbers, frequency in zip(found.branches.number, found.frequency, strict=True):
        assert set(range(5)) <= set(numbers.tolist())
        order = np.argsort(numbers[numbers >= 0])
        assert np.all(np.diff(frequency[numbers >= 0][order]) >= -1e-9 * frequency[0])
    change = np.abs(np.diff(np.log(found.branches.fine_frequency), axis=0))
    assert np.nanmax(change) < 0.2
    moved = found.platform * np.repeat([1.0, found.length], 3)[:, None]
    along = np.sum(moved[1:] * moved[:-1], axis=1) / np.linalg.norm(moved[1:], axis=1) / np.linalg.norm(moved[:-1], axis=1)
    steady = np.linalg.norm(moved, axis=1).min(axis=0) > 0.1 * found.largest.max(axis=0)
    assert np.all(along[:, steady] > 0.5)
