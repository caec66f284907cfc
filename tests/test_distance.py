"""Signed distances of capsules and boxes: against an engine that nobody here wrote, against sampled points, their slopes."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trivet.reach.distance import Box, Capsule, boxes, capsule_to_box, capsules
from trivet.space.frame import IDENTITY, Frame
from trivet.space.vector import Vec

PAIRS = 4000
KINDS = {"capsules": (capsules, "cc"), "capsule and box": (capsule_to_box, "cb"), "boxes": (boxes, "bb")}


class Given:
    """Random shapes of every size and closeness; some capsules are spheres, some are parallel."""

    def __init__(self, seed: int, count: int = PAIRS) -> None:
        rng = np.random.default_rng(seed)
        self.turn = Rotation.random(count, random_state=seed).as_matrix()
        upright = rng.uniform(size=count) < 0.1
        self.turn[upright] = np.eye(3)
        self.place = rng.uniform(-1, 1, (count, 3)) * rng.choice([0.3, 1.0, 2.5], (count, 1))
        self.half = np.exp(rng.uniform(np.log(0.05), np.log(1.2), (count, 3)))
        self.length = np.exp(rng.uniform(np.log(0.01), np.log(2.0), count)) * (rng.uniform(size=count) > 0.1)
        self.radius = rng.uniform(0.02, 0.5, count)

    def shape(self, kind: str) -> Any:
        axes = [vec(self.turn[:, :, k]) for k in range(3)]
        if kind == "b":
            return Box(Frame(vec(self.place), *axes), vec(self.half))
        along = self.turn[:, :, 2] * self.length[:, None] / 2
        return Capsule(vec(self.place - along), vec(self.place + along), self.radius)

    def points(self, kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
        """(n, count, 3) on the surface, corners, edges and ends among them."""
        n = len(self.place)
        if kind == "b":
            local = rng.uniform(-1, 1, (n, count, 3))
            face = rng.integers(0, 3, (n, count))
            sides = rng.choice([-1.0, 1.0], (n, count))
            np.put_along_axis(local, face[..., None], sides[..., None], axis=2)
            edge = rng.uniform(size=(n, count)) < 0.5
            other = (face + 1) % 3
            moved = np.where(edge, rng.choice([-1.0, 1.0], (n, count)), np.take_along_axis(local, other[..., None], 2)[..., 0])
            np.put_along_axis(local, other[..., None], moved[..., None], axis=2)
            local = local * self.half[:, None]
        else:
            out = rng.normal(size=(n, count, 3))
            out *= (self.radius[:, None] / np.linalg.norm(out, axis=2))[..., None]
            local = out + np.stack(
                [0 * out[..., 0], 0 * out[..., 0], rng.uniform(-0.5, 0.5, (n, count)) * self.length[:, None]], 2
            )
        found: np.ndarray = np.einsum("nij,nkj->nki", self.turn, local) + self.place[:, None]
        return found


def vec(a: np.ndarray) -> Vec:
    return Vec(*np.asarray(a).T)


@pytest.mark.peer("coal")
@pytest.mark.parametrize("name", KINDS)
def test_against_coal(name: str) -> None:
    """12,000 pairs in all, one in six of which overlap: there the depth is compared."""
    import coal

    function, (first, second) = KINDS[name]
    one, two = Given(1), Given(2)
    found = np.asarray(jax.jit(function)(one.shape(first), two.shape(second)))
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = 1e-9
    request.gjk_max_iterations, request.epa_max_iterations = 1000, 2000
    expected = np.empty(PAIRS)
    for k in range(PAIRS):
        shapes = []
        for given, kind in ((one, first), (two, second)):
            box = coal.Box(*(2 * given.half[k])) if kind == "b" else coal.Capsule(given.radius[k], given.length[k])
            shapes += [box, coal.Transform3s(given.turn[k], given.place[k])]
        result = coal.DistanceResult()
        coal.distance(*shapes, request, result)
        expected[k] = result.min_distance
    assert 0.1 < (expected < 0).mean() < 0.5
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)
    assert np.quantile(np.abs(found - expected), 0.99) < 1e-13


@pytest.mark.parametrize("name", KINDS)
def test_against_points_on_the_surfaces(name: str) -> None:
    """No two points are nearer than the distance, and the nearest of many are not much farther."""
    function, (first, second) = KINDS[name]
    one, two = Given(3, 400), Given(4, 400)
    found = np.asarray(jax.jit(function)(one.shape(first), two.shape(second)))
    rng = np.random.default_rng(5)
    apart = found > 0
    a, b = one.points(first, 600, rng), two.points(second, 600, rng)
    nearest = np.array([np.linalg.norm(p[:, None] - q, axis=2).min() for p, q in zip(a[apart], b[apart], strict=True)])
    assert apart.sum() > 200
    assert np.all(nearest > found[apart] - 1e-12)
    assert np.median(nearest - found[apart]) < 0.05
    assert np.quantile(nearest - found[apart], 0.95) < 0.25


@pytest.mark.parametrize("name", KINDS)
def test_overlap_is_what_takes_them_apart(name: str) -> None:
    """No direction takes them apart by less than the depth, and one of many does by little more."""
    function, (first, second) = KINDS[name]
    one, two = Given(6, 300), Given(7, 300)
    shape, other = one.shape(first), two.shape(second)
    run = jax.jit(function)
    found = np.asarray(run(shape, other))
    rng = np.random.default_rng(8)
    over, least = found < 0, np.full(300, np.inf)
    for _ in range(200):
        way = rng.normal(size=(300, 3))
        way /= np.linalg.norm(way, axis=1)[:, None]
        # A little less than the depth never does.
        assert np.all(np.asarray(run(moved(shape, way * 0.999 * -found[:, None]), other))[over] < 0)
        for share in (1.02, 1.1, 1.3, 2.0):
            apart = np.asarray(run(moved(shape, way * share * -found[:, None]), other)) > 0
            least = np.where(apart & (share < least), share, least)
    assert over.sum() > 30
    assert np.median(least[over]) <= 1.3


def moved(shape: Any, by: np.ndarray) -> Any:
    step = vec(by)
    if isinstance(shape, Box):
        return Box(shape.frame._replace(origin=shape.frame.origin + step), shape.half)
    return Capsule(shape.start + step, shape.end + step, shape.radius)


@pytest.mark.parametrize("name", KINDS)
def test_slopes_against_differences(name: str) -> None:
    function, (first, second) = KINDS[name]
    one, two = Given(9, 400).shape(first), Given(10, 400).shape(second)
    rng, step = np.random.default_rng(11), 1e-6
    spin, way, grow = vec(rng.normal(size=(400, 3))), vec(rng.normal(size=(400, 3))), rng.uniform(-1, 1, 400)

    def at(size: Any) -> Any:
        """The first moves and grows; frames stay orthonormal to second order."""
        if isinstance(one, Box):
            axes = (axis + spin.cross(axis) * size for axis in one.frame[1:])
            return function(Box(Frame(one.frame.origin + way * size, *axes), one.half * (1 + grow * size)), two)
        ends = (end + (way + spin.cross(end)) * size for end in (one.start, one.end))
        return function(Capsule(*ends, one.radius * (1 + grow * size)), two)

    _, slope = jax.jvp(at, (0.0,), (1.0,))
    ahead, behind, here = (np.asarray(at(s)) for s in (step, -step, 0.0))
    one_sided = np.abs((ahead - here) - (here - behind)) / step
    smooth = one_sided < 1e-3  # not where the nearest points change
    assert smooth.mean() > 0.75
    np.testing.assert_allclose(np.asarray(slope)[smooth], ((ahead - behind) / (2 * step))[smooth], rtol=1e-6, atol=1e-6)
    assert np.all(np.isfinite(np.asarray(slope)))


def test_what_can_be_told_by_hand() -> None:
    sphere = Capsule(Vec(0.0, 0.0, 2.0), Vec(0.0, 0.0, 2.0), 0.5)
    cube = Box(IDENTITY, Vec(1.0, 1.0, 1.0))
    assert float(capsule_to_box(sphere, cube)) == pytest.approx(0.5, abs=1e-15)
    centre = Capsule(Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0), 0.5)
    assert float(capsule_to_box(centre, cube)) == pytest.approx(-1.5, abs=1e-15)
    through = Capsule(Vec(-3.0, 0.0, 0.9), Vec(3.0, 0.0, 0.9), 0.2)
    assert float(capsule_to_box(through, cube)) == pytest.approx(-0.3, abs=1e-15)
    crossing = Capsule(Vec(0.0, -1.0, 0.0), Vec(0.0, 1.0, 0.0), 0.2), Capsule(Vec(-1.0, 0.0, 0.1), Vec(1.0, 0.0, 0.1), 0.2)
    assert float(capsules(*crossing)) == pytest.approx(-0.3, abs=1e-15)
    parallel = Capsule(Vec(0.0, 0.0, 0.0), Vec(1.0, 0.0, 0.0), 0.1), Capsule(Vec(3.0, 0.0, 4.0), Vec(2.5, 0.0, 4.0), 0.1)
    assert float(capsules(*parallel)) == pytest.approx(np.hypot(1.5, 4.0) - 0.2, abs=1e-15)
    beside = Box(Frame(Vec(2.5, 0.3, -0.2), *IDENTITY[1:]), Vec(1.0, 1.0, 1.0))
    assert float(boxes(cube, beside)) == pytest.approx(0.5, abs=1e-15)
    assert float(boxes(cube, cube)) == pytest.approx(-2.0, abs=1e-15)
    assert np.all(np.isfinite(jax.tree.leaves(jax.grad(lambda s: jnp.sum(capsules(s, s)))(centre))))
