"""The best roll: a true optimum, limits respected, ties and unreachable points told; its derivatives."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from trivet.errors import InputError, NoResultError
from trivet.kinematics.mode import parse_mode
from trivet.model import Machine, dimensions, load
from trivet.space.frame import Angle
from trivet.space.surface import Surface, hemisphere
from trivet.statics.best_roll import POINTS_PER_CHUNK, ROLLS, best_roll, mean_and_gradient, on_grid, unrolled
from trivet.statics.objective import K_XX, objective
from trivet.study.stiffness_map import roll_symmetry, stiffness_map, surface_of

FOUR = ("azulay", "eclipse", "alizade", "glozman")


def arrays(machine: Machine) -> Machine:
    return jax.tree.map(jnp.asarray, machine)


def some(surface: Surface, keep: np.ndarray) -> Surface:
    return Surface(surface.name, surface.position[keep], surface.azimuth[keep], surface.tilt[keep])


def test_the_paper_has_317_points() -> None:
    surface = hemisphere(0.121, 0.004)
    assert len(surface) == 317
    assert np.sum(surface.tilt == math.pi / 2) == 12
    assert np.allclose(np.linalg.norm(surface.position - [0, 0, 0.121], axis=1), 0.004, atol=1e-17)


@pytest.mark.parametrize("name", FOUR)
def test_no_roll_of_a_finer_grid_is_better(name: str) -> None:
    machine = load(name)
    signs = parse_mode(machine)
    surface = some(surface_of(machine), np.arange(0, 317, 13))
    best = best_roll(machine, surface, signs, K_XX)
    rolls = 2 * math.pi / 20_000 * np.arange(20_000)
    frames = unrolled(surface.position, surface.azimuth, surface.tilt)
    fine = np.asarray(on_grid(arrays(machine).mechanism, frames, Angle(np.cos(rolls), np.sin(rolls)), jnp.asarray(signs), K_XX))
    assert np.all(best.value >= fine.max(axis=1) * (1 - 1e-12))
    # and the optimum is that of a reached pose, not beyond a limit
    at_best = np.asarray(
        on_grid(arrays(machine).mechanism, frames, Angle(np.cos(best.roll), np.sin(best.roll)), jnp.asarray(signs), K_XX)
    ).diagonal()
    assert np.allclose(at_best, best.value, rtol=1e-9)


def test_rotational_symmetry_makes_three_equal_rolls() -> None:
    machine = load("azulay")
    assert roll_symmetry(machine, "++ ++ ++") == 3
    assert roll_symmetry(machine, "++ ++ +-") == 1
    best = best_roll(machine, surface_of(machine), parse_mode(machine), K_XX)
    assert best.ties.min() == 3
    assert best.roll.max() < 2 * math.pi / 3 + 1e-6, "the smallest of the ties"


def test_a_limit_that_decides_is_told() -> None:
    machine = load("eclipse")
    result = stiffness_map(machine)
    assert 0 < result.best.at_limit.sum() < 317
    joints, limited = result.joints, result.best.at_limit
    margin = np.minimum(joints.gauge - joints.low, joints.high - joints.gauge)
    margin = np.where(np.isfinite(margin), margin, np.inf).min(axis=1)
    assert np.all(margin >= 0)
    assert np.all(margin[limited] < 1e-8)
    assert np.all(margin[~limited] > 1e-8)


def test_unreachable_points_have_reasons() -> None:
    machine = load("azulay", {"slide.travel": ["0 mm", "36 mm"]})  # type: ignore[dict-item]
    result = stiffness_map(machine)
    assert 0 < result.used.sum() < 317
    assert set(result.excluded) == set(np.flatnonzero(~result.used))
    assert result.exclusions() == {"slide outside travel": int((~result.used).sum())}
    assert all("slide" in miss.reason and "36 mm" in miss.reason for miss in result.excluded.values())
    assert np.all(np.isnan(result.matrix[~result.used]))


def test_a_surface_out_of_reach_says_why() -> None:
    machine = load("azulay")
    with pytest.raises(NoResultError, match="cannot close"):
        stiffness_map(machine, hemisphere(0.4, 0.004, 2))
    with pytest.raises(NoResultError, match=r"leg-\d\.hinge elevation at .* deg is below its limit of 5 deg"):
        stiffness_map(machine, hemisphere(0.03, 0.004, 2))


@pytest.mark.parametrize("steps", [0, -3, 100_000])
def test_empty_and_huge_surfaces_are_refused(steps: int) -> None:
    with pytest.raises(InputError, match="steps"):
        hemisphere(0.1, 0.004, steps)


@pytest.mark.parametrize("name", ["K_yy", "1/C_zz", "K_rz", "K(1,0,1)", "1/C(0,1,1)"])
def test_any_scalar_can_be_the_objective(name: str) -> None:
    machine = load("azulay")
    surface = some(surface_of(machine), np.arange(0, 317, 29))
    scalar = objective(name)
    result = stiffness_map(machine, surface, objective=name)
    direction = np.array(scalar.direction)
    if scalar.held:
        expected = np.einsum("i,nij,j->n", direction, result.matrix, direction)
    else:
        expected = 1 / np.einsum("i,nij,j->n", direction, np.linalg.inv(result.matrix), direction)
    assert np.allclose(result.best.value, expected, rtol=1e-9)
    # As many points and rolls as the search itself looks at, so that its kernel serves.
    own, count = np.arange(len(surface)), POINTS_PER_CHUNK
    points = some(surface, np.resize(own, count))
    turned = np.resize(np.concatenate([result.best.roll - 0.01, result.best.roll + 0.01]), ROLLS)
    frames = unrolled(points.position, points.azimuth, points.tilt)
    signs = jnp.asarray(parse_mode(machine))
    found = np.asarray(on_grid(arrays(machine).mechanism, frames, Angle(np.cos(turned), np.sin(turned)), signs, scalar))
    for beside in (found[own, own], found[own, own + len(own)]):
        reached = np.isfinite(beside)
        assert reached.sum() > 0.8 * len(own)
        assert beside[reached].mean() < result.best.value[reached].mean()


@pytest.mark.parametrize("name", ["K_xy", "K_x", "1/C", "K(0,0,0)", "K(1,nan,0)", "K(1,2)", ""])
def test_unknown_objectives_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="objective"):
        objective(name)


@pytest.mark.parametrize("spherical", ["free", "clamped"])
@pytest.mark.parametrize("name", FOUR)
def test_derivatives_with_respect_to_every_dimension(name: str, spherical: str) -> None:
    """Of the mean best-roll K_xx over points with interior optima, against central differences that optimise the rolls anew."""
    machine = load(name).with_spherical(spherical)  # type: ignore[arg-type]
    signs = parse_mode(machine)
    surface = surface_of(machine)
    interior = ~best_roll(machine, surface, signs, K_XX).at_limit
    surface = some(surface, np.flatnonzero(interior)[::5])
    best = best_roll(machine, surface, signs, K_XX)
    value, slopes = mean_and_gradient(machine, surface, best, signs, K_XX)
    assert value == pytest.approx(best.value.mean(), rel=1e-12)
    leaves, structure = jax.tree.flatten(machine)
    paths = list(dimensions(machine))
    assert list(slopes) == paths
    seen = 0
    for k, path in enumerate(paths):
        step = 1e-4 * (abs(leaves[k]) or 0.1)
        means = []
        for moved in (leaves[k] + step, leaves[k] - step):
            changed = jax.tree.unflatten(structure, [*leaves[:k], moved, *leaves[k + 1 :]])
            means.append(best_roll(changed, surface, signs, K_XX).value.mean())
        difference = (means[0] - means[1]) / (2 * step)
        # Relative to the change of the stiffness over a change of the dimension by its own size, so that zeros compare too.
        scale = value / (abs(leaves[k]) or 1.0)
        assert slopes[path] == pytest.approx(difference, rel=1e-6, abs=1e-7 * scale), path
        seen += abs(difference) > 1e-3 * scale
    assert seen >= 7, "most dimensions matter"


def test_derivatives_where_limits_hold_rolls() -> None:
    """Eclipse's columns stop most rolls short of a top: these go with the limit, which the envelope theorem knows nothing of.

    Against central differences with rolls that are sought anew; the limit itself is one of the dimensions.
    """
    machine, step = load("eclipse"), 1e-6
    signs, surface = parse_mode(machine), surface_of(machine)
    surface = some(surface, np.arange(0, len(surface), 7))
    best = best_roll(machine, surface, signs, K_XX)
    assert 10 < best.at_limit.sum() < len(surface)
    _, slopes = mean_and_gradient(machine, surface, best, signs, K_XX)
    leaves, structure = jax.tree.flatten(machine)
    paths = list(dimensions(machine))
    for own in ("elements.link.length", "elements.guide.radius", "elements.column.travel.1", "platform_joint.radius"):
        path, means = f"chains.leg.{own}", []
        k = paths.index(path)
        for moved in (leaves[k] + step, leaves[k] - step):
            changed = jax.tree.unflatten(structure, [*leaves[:k], moved, *leaves[k + 1 :]])
            means.append(best_roll(changed, surface, signs, K_XX).value.mean())
        assert slopes[path] == pytest.approx((means[0] - means[1]) / (2 * step), rel=1e-4, abs=1e3), path
