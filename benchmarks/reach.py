"""Tilt analysis against a hand-fused loop that does no more than the inverse kinematics of the same poses."""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.kernels import ROLLS, Row
from benchmarks.kinematics import inverse_loop
from benchmarks.pairs import paired
from trivet.kinematics.mode import parse_mode
from trivet.model import load
from trivet.reach.margins import travel_margin_on_grid
from trivet.reach.neutral import with_neutral
from trivet.reach.scene import Ball, scene_of
from trivet.reach.tilt import Grid, Looked, best_rolls, inside, is_clear
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled
from trivet.space.vector import Vec
from trivet.statics.best_roll import unrolled
from trivet.study.stiffness_map import surface_of


def tilt_analysis() -> Iterator[Row]:
    """317 points x 360 rolls of the paper's machine, with limits (a cone on the balls too) and clearance."""
    machine = with_neutral(load("azulay"), "radial")
    signs, surface = parse_mode(machine), surface_of(machine)
    ball = Ball(Vec(0.0, 0.0, float(surface.position[:, 2].min())), 0.004)
    looked = Looked(machine, signs, scene_of(machine, with_workpiece=True), ball)
    frames = unrolled(surface.position, surface.azimuth, surface.tilt)
    rolls = 2 * np.pi / ROLLS * np.arange(ROLLS)
    every = _every(frames, rolls)
    peer, its = inverse_loop(), _arguments(machine, every)

    def whole() -> np.ndarray:
        good = travel_margin_on_grid(machine, frames, rolls, signs) >= 0
        rows = np.flatnonzero(good.ravel())
        good.ravel()[rows] = is_clear(looked, _some(every, rows))
        return good

    assert np.array_equal(best_rolls(looked, frames, rolls)[0] >= 0, whole().any(axis=1)), "the same points"
    poses = len(surface) * ROLLS
    for what, call in (
        ("best roll of each, bodies looked at where it may be it", lambda: best_rolls(looked, frames, rolls)),
        ("every pose with its bodies", whole),
    ):
        found = paired(call, lambda: peer(*its), calls=5)
        times = np.median(found.ours / found.peer)
        rate = poses / np.median(found.ours) / 1e6
        low, high = np.quantile(found.ours / found.peer, [0.25, 0.75])
        yield (
            f"tilt analysis of 317 × 360 poses, limits and clearance, {what}: time over that of a numba loop of drives alone",
            f"{times:.2f} ({low:.2f} to {high:.2f}); {rate:.1f} million poses/s",
            "≤ 4",
        )
    yield from _cost(looked)


def _cost(looked: Looked) -> Iterator[Row]:
    """Time per pose and memory of grids ten times larger each."""
    for azimuths, step in ((12, 1.0), (36, 0.3), (120, 0.1)):
        grid = Grid.of((0.0, 0.0, 0.121), 0.004, azimuths, math.radians(step), math.radians(120), 120)
        inside(looked, grid._replace(azimuths=grid.azimuths[:1]))
        start = time.perf_counter()
        found = inside(looked, grid)
        per_pose = (time.perf_counter() - start) / found.inside.size
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        yield (
            f"tilt grid of {found.inside.size:,} poses",
            f"{1e9 * per_pose:.0f} ns per pose; peak of the process {peak:.0f} MiB (of which a byte per pose)",
            "linear, constant",
        )


def _every(frames: Frame, rolls: np.ndarray) -> Frame:
    many = len(rolls)
    tall = Frame(*(Vec(*(np.repeat(np.broadcast_to(c, len(frames.origin.x)), many) for c in v)) for v in frames))
    wide = np.tile(rolls, len(frames.origin.x))
    return rolled(tall, Angle(np.cos(wide), np.sin(wide)))


def _some(frames: Frame, rows: np.ndarray) -> Frame:
    return Frame(*(Vec(*(c[rows] for c in v)) for v in frames))


def _arguments(machine: Any, poses: Frame) -> tuple[Any, ...]:
    azimuths, radius = 2 * math.pi / 3 * np.arange(3), float(machine.characteristic_length)
    columns = [np.ascontiguousarray(c) for v in (poses.origin, poses.x, poses.y) for c in v]
    chain = machine.chains["leg"].elements
    return (*columns, radius * np.cos(azimuths), radius * np.sin(azimuths), chain[0].radius, chain[3].length)
