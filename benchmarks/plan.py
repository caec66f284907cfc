"""Roll plans against SciPy's minimum spanning tree of the same grid graph; and proofs attacked by ten million random poses."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import jax
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import minimum_spanning_tree

from benchmarks.kernels import Row
from benchmarks.pairs import paired
from trivet.kinematics.mode import closed_form_signs
from trivet.model import load
from trivet.reach.certificate import Demand, Patches, Prover
from trivet.reach.margins import clearance, control, travel_margin
from trivet.reach.scene import scene_of
from trivet.reach.touch import Touch
from trivet.reach.ways import widest
from trivet.study.aims import SIGMA
from trivet.study.roll_grid import Field, RollGrid, Rules, best_way, field_of
from trivet.study.tilt import ball_of

ROWS, COLUMNS, HEIGHT, RADIUS = 180, 360, 0.11, 0.004
MODE = "++ ++ -+"
ATTACKS, AT_A_TIME = 10_000_000, 500_000


def roll_plan() -> Iterator[Row]:
    """A grid of 180 tilts up to the horizon and 360 rolls of the paper's machine, in a mode that gets there."""
    for limits, bodies, words in (
        (True, True, "limits and bodies kept to"),
        (False, False, "neither limits nor bodies looked at"),
    ):
        rules = _rules(limits, bodies)
        tilts = np.linspace(0.0, math.pi / 2, ROWS)
        still = (np.zeros(ROWS), np.zeros(ROWS), np.full(ROWS, HEIGHT), np.zeros(ROWS))
        grid = RollGrid(Touch(*still, tilts, np.zeros(ROWS)), 2 * math.pi / COLUMNS, COLUMNS)
        field = field_of(rules, grid)
        start, end = np.zeros(grid.shape, dtype=bool), np.zeros(grid.shape, dtype=bool)
        start[0], end[-1] = True, True
        graph = _graph(field)
        side = np.where(field.side == np.sign(field.side.sum()), field.value, -np.inf)
        calls = (
            ("max-min plan", lambda side=side, start=start, end=end: widest(side, start, end, all_round=True), "≤ 2"),
            (
                "margins, both sides of the singularities and the plan",
                lambda rules=rules, grid=grid, start=start: best_way(field_of(rules, grid), start, all_round=True),
                "≤ 5",
            ),
        )
        for what, call, aim in calls:
            found = paired(call, lambda graph=graph: minimum_spanning_tree(graph), calls=9)
            ratio = found.ours / found.peer
            low, high = np.quantile(ratio, [0.25, 0.75])
            yield (
                f"{ROWS} × {COLUMNS} poses, {words}, {what}: time over that of a minimum spanning tree",
                f"{np.median(ratio):.2f} ({low:.2f} to {high:.2f}); {1e3 * np.median(found.ours):.1f} ms against "
                f"{1e3 * np.median(found.peer):.1f} ms",
                aim,
            )
    yield from _attacked()


def _rules(limits: bool, bodies: bool) -> Rules:
    machine = load("azulay")
    scene = scene_of(machine, with_workpiece=False) if bodies else None
    ball = ball_of((0.0, 0.0, HEIGHT), RADIUS)
    return Rules(machine, closed_form_signs(machine, MODE), scene, ball, RADIUS, limits, (SIGMA,))


def _graph(field: Field) -> coo_matrix:
    """The grid as a graph of all its steps, whose least spanning tree holds the widest ways."""
    values = np.where(np.isfinite(field.value), field.value, -1.0).ravel()
    number = np.arange(values.size).reshape(field.value.shape)
    pairs = [
        (number[:-1].ravel(), number[1:].ravel()),
        (number[:, :-1].ravel(), number[:, 1:].ravel()),
        (number[:, -1], number[:, 0]),
    ]
    one, two = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return coo_matrix((9.0 - np.minimum(values[one], values[two]), (one, two)), shape=(values.size,) * 2).tocsr()


def _attacked() -> Iterator[Row]:
    """Every pose of a proven cone has what was proven."""
    machine = load("azulay")
    signs, scene = closed_form_signs(machine, None), scene_of(machine, with_workpiece=False)
    tilt, height = math.radians(20), 0.121
    alpha, beta = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, tilt, 11), indexing="ij")
    knots = np.stack([0 * alpha, 0 * alpha, 0 * alpha + height, alpha, beta, 1.0 - alpha])
    start = time.perf_counter()
    proof = Prover(machine, signs, scene, RADIUS).prove(Patches.over(knots), Demand(0.0, 0.0, 0.15), 200_000)
    taken = time.perf_counter() - start
    assert proof.is_proven
    rng, violations = np.random.default_rng(0), 0
    least = np.full(3, np.inf)
    for _ in range(ATTACKS // AT_A_TIME):
        azimuth, lean = rng.uniform(0, 2 * np.pi, AT_A_TIME), tilt * np.sqrt(rng.random(AT_A_TIME))
        touch = Touch(0 * lean, 0 * lean, 0 * lean + height, azimuth, lean, 1.0 - azimuth)
        poses = jax.tree.map(np.asarray, touch.frame(RADIUS))
        met = travel_margin(machine, poses, signs), clearance(machine, scene, poses, signs), control(machine, poses, signs)[0]
        bounds = (proof.least.travel, proof.least.clearance, proof.least.sigma_min)
        violations += sum(int(np.sum(own < bound)) for own, bound in zip(met, bounds, strict=True))
        least = np.minimum(least, [own.min() for own in met])
    yield (
        f"cone of 20° of azulay proven: {proof.patches:,} pieces, {taken:.1f} s; {ATTACKS:,} random poses in it",
        f"{violations} violations of sigma_min ≥ {proof.least.sigma_min:.4f} (met {least[2]:.4f}), travel ≥ "
        f"{proof.least.travel:.3f} (met {least[0]:.3f}), clearance ≥ {1e3 * proof.least.clearance:.2f} mm (met "
        f"{1e3 * least[1]:.2f})",
        "0",
    )
