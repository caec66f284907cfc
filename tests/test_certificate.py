"""Proofs over patches: bounds hold at random places of all machines, proofs withstand attacks, false demands are refuted."""

from __future__ import annotations

import math
from typing import Any

import jax
import numpy as np
import pytest
from machines import unlocked

import trivet as t
from trivet.kinematics.mode import all_modes, parse_mode
from trivet.kinematics.standing import home_pose
from trivet.model import catalogue, load
from trivet.reach.certificate import Demand, Patches, Prover
from trivet.reach.margins import clearance, control, travel_margin
from trivet.reach.neutral import with_neutral
from trivet.reach.scene import Scene, scene_of
from trivet.reach.touch import Touch

MACHINES = [name for name in catalogue() if parse_mode(load(name)) is not None and name != "rmmt"]


def frames(touch: np.ndarray, radius: float) -> Any:
    """Platform frames of coordinates (6, n)."""
    count = touch.shape[1]
    return jax.tree.map(lambda c: np.broadcast_to(np.asarray(c), count), Touch(*touch).frame(radius))


def looked_at(name: str, mode: str | None = None) -> tuple[Any, Any, Scene]:
    machine = load(name)
    if any(getattr(e, "cone", None) is not None for chain in machine.chains.values() for e in chain.elements):
        machine = with_neutral(machine, "home", mode)
    return machine, parse_mode(machine, mode), scene_of(machine, with_workpiece=False)


def random_patches(home: Any, count: int, rng: np.random.Generator) -> Patches:
    """About home, of all sizes; every other one a line."""
    middle = np.stack([
        *(float(c) + rng.normal(0, 0.004, count) for c in home.origin), rng.uniform(-3.2, 3.2, count),
        rng.uniform(0, 0.5, count), rng.uniform(-3.2, 3.2, count),
    ])  # fmt: skip
    scale = np.array([0.01, 0.01, 0.01, 1, 1, 1])[:, None] * 10.0 ** rng.uniform(-5, -1, count)
    first, second, twist = (rng.normal(size=(6, count)) * scale for _ in range(3))
    return Patches(middle, first, second, 0.3 * twist)


@pytest.mark.parametrize("name", MACHINES)
def test_bounds_hold_everywhere(name: str) -> None:
    rng = np.random.default_rng(6)
    modes = all_modes(load(name)) if name != "gough-stewart" else [""]
    useful = 0
    for mode in (None, modes[len(modes) // 3]):
        machine, signs, scene = looked_at(name, mode or None)
        prover = Prover(machine, signs, scene, 0.003)
        patches = random_patches(home_pose(machine), 600, rng)
        lines = patches._replace(second=0 * patches.second, twist=0 * patches.twist)
        for some in (patches, lines):
            is_smooth, bounds, middles = prover.bounds(some)
            assert np.all((bounds.travel <= middles.travel) | ~np.isfinite(middles.travel))
            assert np.all((bounds.sigma_min <= middles.sigma_min) | ~np.isfinite(middles.sigma_min))
            useful += int(np.sum(is_smooth & np.isfinite(bounds.sigma_min) & (bounds.sigma_min > 0.5 * middles.sigma_min)))
            for _ in range(6):
                u, v = rng.uniform(-1, 1, (2, 600))
                poses = frames(some.middle + u * some.first + v * some.second + u * v * some.twist, 0.003)
                with np.errstate(invalid="ignore"):
                    assert np.all((travel_margin(machine, poses, signs) >= bounds.travel)[is_smooth])
                    assert np.all((clearance(machine, scene, poses, signs) >= bounds.clearance)[is_smooth])
                    sigma = control(machine, poses, signs).sigma_min
                    assert np.all((sigma >= bounds.sigma_min)[is_smooth])
                    assert np.all(np.isfinite(sigma[is_smooth]))
    assert useful > 150


def cone(tilt: float, height: float) -> np.ndarray:
    """Knots of a cone with a platform that does not spin."""
    alpha, beta = np.meshgrid(np.linspace(0, 2 * np.pi, 13), np.linspace(0, tilt, 5), indexing="ij")
    return np.stack([0 * alpha, 0 * alpha, 0 * alpha + height, alpha, beta, -alpha])


def test_a_proven_cone_withstands_an_attack() -> None:
    machine, signs, scene = looked_at("azulay")
    demand = Demand(0.8, 0.005, 0.35)
    proof = Prover(machine, signs, scene, 0.004).prove(Patches.over(cone(math.radians(10), 0.121)), demand, 200_000)
    assert proof.is_proven
    assert proof.open.many == 0
    for told, asked in zip(proof.least, demand, strict=True):
        assert told >= asked  # type: ignore[operator]
    rng = np.random.default_rng(7)
    count = 500_000
    alpha, beta = rng.uniform(0, 2 * np.pi, count), math.radians(10) * np.sqrt(rng.random(count))
    poses = frames(np.stack([0 * alpha, 0 * alpha, 0 * alpha + 0.121, alpha, beta, -alpha]), 0.004)
    assert travel_margin(machine, poses, signs).min() >= proof.least.travel
    assert clearance(machine, scene, poses, signs).min() >= proof.least.clearance  # type: ignore[operator]
    found = control(machine, poses, signs)
    assert found.sigma_min.min() >= proof.least.sigma_min
    assert len(set(found.side)) == 1
    # And it is not much less than what there is.
    assert proof.least.travel > travel_margin(machine, poses, signs).min() - 0.05


@pytest.mark.parametrize(("demand", "reason"), [
    (Demand(0.83, 0.0, 0.0), "the margin of travel"), (Demand(0.0, 0.0125, 0.0), "the clearance"),
    (Demand(0.0, 0.0, 0.39), "sigma_min"),
])  # fmt: skip
def test_false_demands_are_refuted(demand: Demand, reason: str) -> None:
    machine, signs, scene = looked_at("azulay")
    proof = Prover(machine, signs, scene, 0.004).prove(Patches.over(cone(math.radians(10), 0.121)), demand, 200_000)
    assert not proof.is_proven
    assert proof.is_refuted
    assert proof.reason == reason
    there = frames(proof.open.middle[:, [proof.smallest]], 0.004)
    values = travel_margin(machine, there, signs), clearance(machine, scene, there, signs), control(machine, there, signs)[0]
    asked = (demand.travel, demand.clearance, demand.sigma_min)
    assert any(value < bound for value, bound in zip(values, asked, strict=True))


def test_nothing_is_proven_across_a_singularity() -> None:
    """From tilt 25 to 40 degrees the paper's mode crosses its singular ring, whatever demand there is."""
    machine, signs, scene = looked_at("azulay")
    knots = np.array([[0.0, 0.0], [0.0, 0.0], [0.121, 0.121], [0.0, 0.0], np.radians([25, 40]), [0.0, 0.0]])
    proof = Prover(machine, signs, scene, 0.004).prove(Patches.along(knots), Demand(0.0, 0.0, 1e-9), 200_000)
    assert not proof.is_proven
    tilt = proof.open.middle[4, proof.smallest]
    both = np.tile(proof.open.middle[:, [proof.smallest]], 2)
    both[4] += [-1e-4, 1e-4]
    sides = control(machine, frames(both, 0.004), signs).side
    assert sides[0] != sides[1]
    assert math.radians(25) < tilt < math.radians(40)


def test_nothing_is_proven_where_a_carriage_jumps() -> None:
    """A platform joint that passes the axis of the guide takes its carriage to the other side at once."""
    machine, signs, _ = looked_at("azulay")
    knots = np.array([[-0.0221, -0.0133], [0.0, 0.0], [0.125, 0.125], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    proof = Prover(machine, signs, None, 0.0).prove(Patches.along(knots), Demand(-np.inf, None, -1.0), 10_000)
    assert not proof.is_proven
    assert "smoothly" in proof.reason
    assert proof.open.middle[0, proof.smallest] == pytest.approx(-0.018, abs=1e-3)


def test_a_budget_ends() -> None:
    machine, signs, scene = looked_at("azulay")
    proof = Prover(machine, signs, scene, 0.004).prove(Patches.over(cone(math.radians(10), 0.121)), Demand(0.8, 0.0, 0.35), 100)
    assert not proof.is_proven
    assert not proof.is_refuted
    assert 0 < proof.patches <= 100
    assert proof.reason


def test_machines_that_cannot_be_asked() -> None:
    with pytest.raises(t.InputError, match="9 actuators"):
        Prover(unlocked(), None, None, 0.004)


def test_patches_are_cut_into_their_parts() -> None:
    rng = np.random.default_rng(8)
    whole = Patches(*(rng.normal(size=(6, 5)) for _ in range(4)))
    u, v = rng.uniform(-1, 1, (2, 5))
    point = whole.middle + u * whole.first + v * whole.second + u * v * whole.twist
    halves = whole.halved()
    swap = np.abs(whole.second).max(axis=0) > np.abs(whole.first).max(axis=0)
    long, short = np.where(swap, v, u), np.where(swap, u, v)
    own = np.where(long < 0, 2 * long + 1, 2 * long - 1)
    part = halves.some(np.arange(5) + 5 * (long >= 0))
    np.testing.assert_allclose(
        part.middle + own * part.first + short * part.second + own * short * part.twist, point, atol=1e-14
    )
