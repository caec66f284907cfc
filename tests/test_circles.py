"""All solutions of the three-circles problem: complete, certified, and counted again in exact arithmetic."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from trivet.errors import InputError
from trivet.kinematics.circles import Circles, CircleSolutions, Status, solve

Array = np.ndarray[Any, Any]
Made = tuple[Circles, Array]
"""Circles, and the angles (n, 3) of one solution."""

BASE, PLATFORM, LINK = 0.162, 0.018, 0.216


def _points(circles: Circles, angle: Array) -> Array:
    """(n, …, 3, 3) at angles (n, …, 3), which may be complex."""
    axes = (a.reshape(a.shape[0], *(angle.ndim - 2) * (1,), 3, 3) for a in circles[:3])
    centre, cosine, sine = axes
    return np.asarray(centre + np.cos(angle)[..., None] * cosine + np.sin(angle)[..., None] * sine)


def _through(centre: Array, cosine: Array, sine: Array, angle: Array) -> Made:
    """Circles whose distances fit at the given angles."""
    points = _points(Circles(centre, cosine, sine, angle), angle)
    distance = np.linalg.norm(points - np.roll(points, -1, axis=1), axis=2)
    return Circles(centre, cosine, sine, distance), angle


def _random_circles(random: np.random.Generator, count: int, parallel: tuple[int, ...] = (), coaxial: bool = False) -> Made:
    frames = np.linalg.qr(random.normal(size=(count, 3, 3, 3)))[0]
    for k in parallel:
        frames[:, k, :, 2] = frames[:, parallel[0], :, 2] * random.choice([-1, 1], size=(count, 1))
    frames[:, :, :, 0] = np.cross(frames[:, :, :, 1], frames[:, :, :, 2])
    frames[:, :, :, 0] /= np.linalg.norm(frames[:, :, :, 0], axis=2, keepdims=True)
    frames[:, :, :, 1] = np.cross(frames[:, :, :, 2], frames[:, :, :, 0])
    radius = random.uniform(0.5, 1.5, size=(count, 3, 1))
    centre = random.normal(size=(count, 3, 3))
    if coaxial:
        centre[:, 1] = centre[:, 0] + random.normal(size=(count, 1)) * frames[:, 0, :, 2]
    return _through(centre, radius * frames[..., 0], radius * frames[..., 1], random.uniform(0, 2 * np.pi, size=(count, 3)))


def _machine(random: np.random.Generator, count: int, leg: str) -> Made:
    """Radial slides, columns or telescopes on a circular guide, at random poses of the platform."""
    azimuth, roll = random.uniform(0, 2 * np.pi, size=(2, count, 1, 1))
    tilt, turn = random.uniform(0, 1.4, size=(count, 1, 1)), 2 * np.pi / 3 * np.arange(3)[:, None]
    flat = np.concatenate([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * PLATFORM
    points = np.broadcast_to(flat, (count, 3, 3))
    for axis, angle in ((2, roll), (1, tilt), (2, azimuth)):
        unit = np.eye(3)[axis]
        points = (
            np.cos(angle) * points
            + np.sin(angle) * np.cross(unit, points)
            + (1 - np.cos(angle)) * (points @ unit)[..., None] * unit
        )
    points = (
        points
        + np.concatenate([random.normal(size=(count, 2)) * 0.004, random.uniform(0.08, 0.16, size=(count, 1))], axis=1)[:, None]
    )
    rho, height = np.hypot(points[..., 0], points[..., 1])[..., None], points[..., 2:]
    radial = np.concatenate([points[..., :2] / rho, 0 * rho], axis=2)
    up = np.broadcast_to([0.0, 0.0, 1.0], radial.shape)
    if leg == "slide":
        radius, foot, rise = LINK, rho + np.sqrt(LINK**2 - height**2), 0 * rho
    elif leg == "column":
        radius, foot, rise = LINK, BASE + 0 * rho, height - np.sqrt(LINK**2 - (BASE - rho) ** 2)
    else:
        radius, foot, rise = np.hypot(BASE - rho, height), BASE + 0 * rho, 0 * rho
    centre = foot * radial + rise * up
    return _through(centre, -radius * radial, radius * up, np.arctan2(height - rise, foot - rho)[..., 0])


FAMILIES: dict[str, tuple[int, Callable[[np.random.Generator, int], Made]]] = {
    "slide": (16, lambda random, count: _machine(random, count, "slide")),
    "column": (16, lambda random, count: _machine(random, count, "column")),
    "telescope": (16, lambda random, count: _machine(random, count, "telescope")),
    "generic": (16, _random_circles),
    "two parallel": (16, lambda random, count: _random_circles(random, count, (0, 1))),
    "parallel": (12, lambda random, count: _random_circles(random, count, (0, 1, 2))),
    "two coaxial": (8, lambda random, count: _random_circles(random, count, (0, 1), coaxial=True)),
    "parallel, two coaxial": (8, lambda random, count: _random_circles(random, count, (0, 1, 2), coaxial=True)),
}
"""Expected number of solutions, and how to make them."""
COPLANAR = ("slide", "telescope")


def _apart(solutions: CircleSolutions, angle: Array) -> Array:
    """Greatest difference (n, 16) of exp(i phi), relative to it, between solutions and angles (n, 3)."""
    return np.asarray(np.abs(np.expm1(1j * (solutions.angle - angle[:, None]))).max(axis=2))


def _is_closed(solutions: CircleSolutions, images: Array) -> bool:
    """Whether each image (n, 16, 3) of a solution is a solution."""
    apart = np.abs(np.expm1(1j * (images[:, :, None] - solutions.angle[:, None]))).max(axis=3)
    nearest = np.min(np.where(np.isnan(apart), np.inf, apart), axis=2)
    there = solutions.multiplicity > 0
    return bool((nearest[there] < np.maximum(1e-11, 8 * np.nan_to_num(solutions.error[there]))).all())


def _real_count(solutions: CircleSolutions) -> Array:
    return np.asarray((solutions.real * solutions.multiplicity).sum(axis=1))


@pytest.mark.parametrize("name", FAMILIES)
def test_complete(name: str) -> None:
    expected, make = FAMILIES[name]
    circles, planted = make(np.random.default_rng(3), 400)
    found = solve(circles)
    assert (found.status == Status.COMPLETE).all()
    assert (found.expected == expected).all()
    assert (found.found == expected).all()
    assert (_real_count(found) % 2 == 0).all()
    assert _is_closed(found, found.angle.conj())
    off = np.where(found.real, _apart(found, planted), np.inf)
    nearest = off.argmin(axis=1)[:, None]
    assert (np.take_along_axis(off, nearest, 1) < np.maximum(1e-12, np.take_along_axis(found.error, nearest, 1))).all()
    points = _points(circles, found.angle)
    sides = points - np.roll(points, -1, axis=2)
    gap = np.einsum("nskj,nskj->nsk", sides, sides) - circles.distance[:, None] ** 2
    size = (np.abs(points).max(axis=(2, 3)) + np.abs(circles.centre).max(axis=(1, 2))[:, None]) ** 2
    assert np.nanmax(np.abs(gap) / size[:, :, None]) < 1e-13
    assert np.nanmax(found.residual) < 1e-13


@pytest.mark.parametrize("name", COPLANAR)
def test_coplanar_axes_pair_solutions_by_mirror(name: str) -> None:
    found = solve(FAMILIES[name][1](np.random.default_rng(4), 300)[0])
    assert _is_closed(found, -found.angle)
    assert (_real_count(found) % 4 == 0).all()


def test_unequal_heights_do_not_pair() -> None:
    found = solve(FAMILIES["column"][1](np.random.default_rng(4), 300)[0])
    assert (_real_count(found) % 4 != 0).any()


def test_one_problem_is_solved_as_in_a_batch() -> None:
    circles = FAMILIES["slide"][1](np.random.default_rng(5), 300)[0]
    alone, batch = solve(Circles(*(a[-1:] for a in circles))), solve(circles)
    assert np.array_equal(alone.angle[0], batch.angle[-1])


# --- Exact arithmetic -------------------------------------------------------------------------------------------------------


def _rational_circles(random: np.random.Generator) -> list[list[Any]]:
    """Centre, cosine, sine of three circles in fractions, from rational rotations (Euler's parameters)."""
    made = []
    for _ in range(3):
        a, b, c, d = (int(v) for v in random.integers(-6, 7, size=4))
        a = a or 7
        square, radius = a * a + b * b + c * c + d * d, Fraction(int(random.integers(8, 25)), 16)
        cosine = [
            radius * Fraction(v, square) for v in (a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c))
        ]
        sine = [radius * Fraction(v, square) for v in (2 * (b * c - a * d), a * a - b * b + c * c - d * d, 2 * (c * d + a * b))]
        made.append([[Fraction(int(v), 32) for v in random.integers(-48, 49, size=3)], cosine, sine])
    return made


def _in_tangents(one: list[Any], other: list[Any], distance: Fraction) -> list[list[Fraction]]:
    """Coefficients of one equation in powers 0, 1, 2 of tan(phi_i / 2), tan(phi_j / 2)."""

    def dot(a: list[Fraction], b: list[Fraction]) -> Fraction:
        return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))

    offset = [p - q for p, q in zip(one[0], other[0], strict=True)]
    form = [[-2 * dot(a, b) for b in (offset, *other[1:])] for a in ([-v for v in offset], *one[1:])]
    form[0] = [dot(offset, offset) + dot(one[1], one[1]) + dot(other[1], other[1]) - distance**2, *(-v for v in form[0][1:])]
    form[0][1:] = [-2 * dot(offset, b) for b in other[1:]]
    for k, a in enumerate(one[1:], start=1):
        form[k][0] = 2 * dot(offset, a)
    powers = ((1, 0, 1), (1, 0, -1), (0, 2, 0))  # 1, cos, sin times 1 + t^2
    return [
        [sum((powers[a][m] * form[a][b] * powers[b][n] for a in range(3) for b in range(3)), Fraction(0)) for n in range(3)]
        for m in range(3)
    ]


def _determinant(rows: list[list[Fraction]]) -> Fraction:
    if len(rows) == 1:
        return rows[0][0]
    minors = ([row[:k] + row[k + 1 :] for row in rows[1:]] for k in range(len(rows)))
    return sum((((-1) ** k * v * _determinant(m) for k, (v, m) in enumerate(zip(rows[0], minors, strict=True)))), Fraction(0))


def _resultant(equations: list[list[list[Fraction]]], t: Fraction) -> Fraction:
    """Determinant of f23 with the companion matrices of t2 and t3 in the place of the unknowns."""
    f12, f23, f31 = equations
    second = [sum((f12[m][n] * t**m for m in range(3)), Fraction(0)) for n in range(3)]
    third = [sum((f31[m][n] * t**n for n in range(3)), Fraction(0)) for m in range(3)]

    def powers(quadratic: list[Fraction]) -> list[list[list[Fraction]]]:
        c, b, a = quadratic
        one = [[Fraction(1), Fraction(0)], [Fraction(0), Fraction(1)]]
        x = [[Fraction(0), -c / a], [Fraction(1), -b / a]]
        return [one, x, [[sum((x[i][k] * x[k][j] for k in range(2)), Fraction(0)) for j in range(2)] for i in range(2)]]

    x, y = powers(second), powers(third)
    index = [(i, j) for i in range(2) for j in range(2)]
    rows = [
        [sum((f23[m][n] * x[m][i][k] * y[n][j][q] for m in range(3) for n in range(3)), Fraction(0)) for k, q in index]
        for i, j in index
    ]
    return _determinant(rows) * (second[2] * third[2]) ** 4


def _interpolated(equations: list[list[list[Fraction]]]) -> list[int]:
    """Integer coefficients, lowest first, of the polynomial of degree 16 in tan(phi_1 / 2), by Newton's differences."""
    nodes = [Fraction(2 * k - 17, 8) for k in range(17)]
    table = [_resultant(equations, t) for t in nodes]
    for level in range(1, 17):
        table[level:] = [(b - a) / (nodes[level + k] - nodes[k]) for k, (a, b) in enumerate(pairwise(table[level - 1 :]))]
    polynomial = [Fraction(0)]
    for t, value in zip(reversed(nodes), reversed(table), strict=True):
        shifted = [Fraction(0), *polynomial]
        polynomial = [a - t * b for a, b in zip(shifted, [*polynomial, Fraction(0)], strict=True)]
        polynomial[0] += value
    return _primitive(polynomial[:17])


def _primitive(polynomial: list[Any]) -> list[int]:
    """Times a positive number, to integers without a common factor."""
    scale = math.lcm(*(Fraction(c).denominator for c in polynomial))
    whole = [int(c * scale) for c in polynomial]
    common = math.gcd(*whole) or 1
    return [c // common for c in whole]


def _sturm_count(polynomial: list[int]) -> tuple[int, int]:
    """Numbers of distinct complex and of distinct real roots (Sturm)."""
    chain = [polynomial, _primitive([k * c for k, c in enumerate(polynomial)][1:])]
    while len(chain[-1]) > 1:
        rest, divisor = list(chain[-2]), chain[-1]
        while len(rest) >= len(divisor):
            lead, factor = rest[-1], abs(divisor[-1])
            rest = [factor * c for c in rest]
            for k, c in enumerate(divisor):
                rest[len(rest) - len(divisor) + k] -= lead * c * (1 if divisor[-1] > 0 else -1)
            rest.pop()
        while rest and rest[-1] == 0:
            rest.pop()
        if not rest:
            break
        chain.append(_primitive([-c for c in rest]))
    above = [p[-1] > 0 for p in chain]
    below = [(p[-1] > 0) == (len(p) % 2 == 1) for p in chain]
    changes = [sum(a != b for a, b in pairwise(signs)) for signs in (below, above)]
    return len(polynomial) - len(chain[-1]), changes[0] - changes[1]


def _newton_step(polynomial: list[int], t: complex) -> float:
    """Distance from a number to the nearest root, to first order; the polynomial evaluated without rounding."""
    scale = max(Fraction(part).denominator for part in (t.real, t.imag))
    x, y = int(Fraction(t.real) * scale), int(Fraction(t.imag) * scale)
    value, slope, power = (0, 0), (0, 0), 1
    for c in reversed(polynomial):
        slope = (slope[0] * x - slope[1] * y + value[0] * scale, slope[0] * y + slope[1] * x + value[1] * scale)
        value = (value[0] * x - value[1] * y + c * power, value[0] * y + value[1] * x)
        power *= scale
    square = slope[0] ** 2 + slope[1] ** 2
    real, imag = (
        Fraction(value[0] * slope[0] + value[1] * slope[1], square),
        Fraction(value[1] * slope[0] - value[0] * slope[1], square),
    )
    return abs(complex(real, imag))


def test_counts_and_roots_in_exact_arithmetic() -> None:
    random = np.random.default_rng(6)
    exact = [_rational_circles(random) for _ in range(200)]
    floats = np.array(exact, dtype=float)
    circles, _ = _through(floats[:, :, 0], floats[:, :, 1], floats[:, :, 2], random.uniform(0, 2 * np.pi, size=(200, 3)))
    distance = np.round(circles.distance * 1024) / 1024
    found = solve(circles._replace(distance=distance))
    assert (found.status == Status.COMPLETE).all()
    tangents = np.tan(found.angle[:, :, 0] / 2)
    for k, ((one, two, three), sides) in enumerate(zip(exact, distance, strict=True)):
        pairs = ((one, two), (two, three), (three, one))
        polynomial = _interpolated([_in_tangents(*pair, Fraction(float(d))) for pair, d in zip(pairs, sides, strict=True)])
        assert _sturm_count(polynomial) == (16, _real_count(found)[k])
        steps = [_newton_step(polynomial, complex(t)) / abs(1 + t * t) for t in tangents[k]]
        assert max(steps) < 1e-9
        apart = np.abs(tangents[k][:, None] - tangents[k]) / np.abs(1 + tangents[k] ** 2) + np.eye(16)
        assert apart.min() > 1e-7  # sixteen numbers, each on a root, no two on the same


# --- Degenerate and special problems -----------------------------------------------------------------------------------------


def _slope(circles: Circles, angle: Array) -> Array:
    """Determinant (n,) that vanishes at singular configurations (Type 2)."""
    point, motion = _points(circles, angle), _points(circles._replace(centre=0 * circles.centre), angle + np.pi / 2)
    e = point - np.roll(point, -1, axis=1)
    ahead = np.einsum("nij,nij->ni", e, motion).prod(axis=1)
    return np.asarray(ahead - np.einsum("nij,nij->ni", e, np.roll(motion, -1, axis=1)).prod(axis=1))


@pytest.mark.parametrize("name", ["slide", "column", "generic", "parallel"])
def test_assembly_modes_meet_in_a_double_root(name: str) -> None:
    expected, make = FAMILIES[name]
    circles, low = make(np.random.default_rng(7), 60)
    high = low + np.random.default_rng(8).uniform(0.5, np.pi, size=(60, 1)) * (0, 0, 1)
    crosses = _slope(circles, low) * _slope(circles, high) < 0
    circles, low, high = Circles(*(a[crosses] for a in circles)), low[crosses], high[crosses]
    assert len(low) > 10
    sign = np.sign(_slope(circles, low))
    for _ in range(80):
        middle = (low + high) / 2
        same = (np.sign(_slope(circles, middle)) == sign)[:, None]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    found = solve(_through(*circles[:3], low)[0])
    assert (found.status == Status.COMPLETE).all()
    assert (found.found == expected).all()
    double = np.where(found.real & (found.multiplicity == 2), _apart(found, low), np.inf)
    assert double.min(axis=1).max() < 1e-11


def _at_home(distance: Array) -> Circles:
    """Three equal legs with slides at the same distance from the axis."""
    turn = 2 * np.pi / 3 * np.arange(3)[:, None]
    radial = np.concatenate([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    centre = distance[:, None, None] * radial
    cosine = np.broadcast_to(-LINK * radial, centre.shape)
    sides = np.full((len(distance), 3), math.sqrt(3) * PLATFORM)
    return Circles(centre, cosine, np.broadcast_to([0.0, 0.0, LINK], centre.shape), sides)


def test_symmetric_machine_at_home() -> None:
    """Solutions differ in two angles only, so that every resultant has double roots which are none of the problem."""
    found = solve(_at_home(np.linspace(0.15, 0.23, 50)))
    assert (found.status == Status.COMPLETE).all()
    assert (found.multiplicity == 1).all()
    assert _is_closed(found, np.roll(found.angle, 1, axis=2))
    assert _is_closed(found, found.angle[:, :, [0, 2, 1]])


def test_stretched_flat_machine_has_a_root_of_multiplicity_eight() -> None:
    found = solve(_at_home(np.array([LINK + PLATFORM])))
    assert found.status[0] == Status.COMPLETE
    assert sorted(found.multiplicity[0])[-2:] == [1, 8]
    assert np.abs(found.angle[0][found.multiplicity[0] == 8]).max() < 1e-9


@pytest.mark.parametrize(("shrunk", "expected"), [(1.0, 10), (0.6, 10)])
def test_similar_triangles_lose_two_more(shrunk: float, expected: int) -> None:
    circles, _ = _random_circles(np.random.default_rng(9), 100, (0, 1, 2))
    found = solve(circles._replace(distance=_similar_sides(circles, shrunk)))
    assert (found.expected == expected).all()
    assert np.mean(found.status == Status.COMPLETE) > 0.97  # some triangles are needles


def _similar_sides(circles: Circles, shrunk: float) -> Array:
    axis = np.cross(circles.cosine[:, 0], circles.sine[:, 0])
    side = circles.centre - np.roll(circles.centre, -1, axis=1)
    square = (np.einsum("nij,nj->ni", side, axis) / np.linalg.norm(axis, axis=1)[:, None]) ** 2
    return np.asarray(np.sqrt(square + shrunk**2 * (np.einsum("nij,nij->ni", side, side) - square)))


def test_parallelogram_moves() -> None:
    circles, _ = _random_circles(np.random.default_rng(10), 20, (0, 1, 2))
    radius = np.linalg.norm(circles.cosine, axis=2, keepdims=True)
    equal = circles._replace(cosine=circles.cosine / radius, sine=circles.sine / radius, distance=_similar_sides(circles, 1.0))
    found = solve(equal)
    assert (found.status == Status.SELF_MOTION).all()
    assert not found.found.any()
    assert not found.expected.any()


def test_coincident_circles() -> None:
    circles, _ = _random_circles(np.random.default_rng(11), 3)
    two = Circles(*(a[:, [0, 0, 2]] for a in circles[:3]), circles.distance)
    found = solve(two)
    assert (found.status == Status.COMPLETE).all()
    assert (found.found == 8).all()
    assert (solve(Circles(*(a[:, [0, 0, 0]] for a in circles[:3]), circles.distance)).status == Status.COAXIAL).all()


def test_no_circle_and_no_triangle() -> None:
    circles, _ = _random_circles(np.random.default_rng(12), 3)
    circles.cosine[0, 1] = circles.sine[0, 1] = 0
    circles.distance[1, 2] = 0
    found = solve(circles)
    assert list(found.status) == [Status.NO_CIRCLE, Status.NO_TRIANGLE, Status.COMPLETE]
    assert np.isnan(found.angle[:2]).all()
    assert list(found.expected) == [0, 0, 16]


@pytest.mark.parametrize(
    ("field", "index", "value", "message"),
    [
        ("distance", (1, 0), -1.0, "negative in problem 1"),
        ("centre", (2, 0, 0), np.nan, "not a finite number in problem 2"),
        ("sine", (0, 1), 0.0, "not orthogonal and equally long in problem 0"),
    ],
)
def test_wrong_input(field: str, index: tuple[int, ...], value: float, message: str) -> None:
    circles, _ = _random_circles(np.random.default_rng(13), 3)
    with pytest.raises(InputError, match=r"circles.distance: shape \(3, 2\); expected \(3, 3\)"):
        solve(circles._replace(distance=circles.distance[:, :2]))
    getattr(circles, field)[index] = value
    with pytest.raises(InputError, match=message):
        solve(circles)
