"""The same kernels on an accelerator and on the processor of the same machine; `python -m benchmarks accelerator` where one is.

The processor does it as the library does, in chunks over all its cores; the accelerator gets all poses at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from benchmarks.kernels import ROLLS, Row
from benchmarks.pairs import paired
from trivet.dynamics import batch
from trivet.dynamics.bodies import Bodies
from trivet.dynamics.equations import State
from trivet.kinematics.mode import parse_mode
from trivet.model import load
from trivet.reach import margins
from trivet.reach.margins import ROWS
from trivet.reach.neutral import with_neutral
from trivet.reach.scene import scene_of
from trivet.space.frame import Angle
from trivet.space.pose import zyz_frame
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec
from trivet.statics.best_roll import POINTS_PER_CHUNK, on_grid, unrolled
from trivet.statics.compliance import leg_stiffnesses, total
from trivet.statics.objective import K_XX
from trivet.statics.stiffness import CHUNK, TILE, stream

POSES = 1 << 20


class Work(NamedTuple):
    """The same work for both sides, with poses and twists already where they are worked on."""

    name: str
    poses: int
    kernel: Callable[..., Any]
    arguments: Any
    on_processor: Callable[[], Any]


def against_the_processor() -> Iterator[Row]:
    """Poses per second, and the largest difference between both over the largest of the results."""
    accelerator, processor = jax.devices()[0], jax.devices("cpu")[0]
    if accelerator.platform == "cpu":
        raise SystemExit("JAX finds no accelerator here")
    for made in (_map, _full, _inverse_dynamics, _margins, _clearances, _controls):
        work = made()
        ours = partial(work.kernel, *jax.device_put(work.arguments, accelerator))

        def theirs(work: Work = work) -> Any:
            # Not the context manager: that holds for one thread, and the library starts its own.
            jax.config.update("jax_default_device", processor)
            try:
                return jax.block_until_ready(work.on_processor())  # type: ignore[no-untyped-call]
            finally:
                jax.config.update("jax_default_device", None)

        pairs = zip(jax.tree.leaves(ours()), jax.tree.leaves(theirs()), strict=True)
        off = max(float(np.nanmax(np.abs(np.asarray(a) - b)) / np.nanmax(np.abs(b))) for a, b in pairs)
        times = paired(partial(_done, ours), theirs, pairs=7, calls=3)
        median, low, high = times.ratio
        rates = [work.poses / np.median(t) / 1e6 for t in (times.ours, times.peer)]
        yield (
            f"{work.name}, {work.poses:,} poses on {accelerator.device_kind}: ratio to its processor",
            f"{median:.0f} ({low:.0f} to {high:.0f})×; "
            f"{rates[0]:.0f} against {rates[1]:.1f} million poses/s; they differ by {off:.0e}",
            "",
        )


def _done(call: Callable[[], Any]) -> None:
    jax.block_until_ready(call())  # type: ignore[no-untyped-call]


def _map() -> Work:
    machine, signs = load("azulay"), parse_mode(load("azulay"))
    rng = np.random.default_rng(0)
    count = POSES * 4 // ROLLS // POINTS_PER_CHUNK * POINTS_PER_CHUNK
    # Reached with some roll, so that no infinity is compared.
    frames = unrolled(np.tile(machine.home.position, (count, 1)), rng.uniform(0, 6.3, count), rng.uniform(0, 1, count))
    gamma = 2 * np.pi / ROLLS * np.arange(ROLLS)
    rolls = Angle(np.cos(gamma), np.sin(gamma))

    @jax.jit
    def kernel(mechanism: Any, frames: Any, rolls: Any, signs: Any) -> Any:
        return on_grid(mechanism, frames, rolls, signs, K_XX).max(axis=1)

    def on_processor() -> Any:
        chunks = range(0, count, POINTS_PER_CHUNK)
        parts = (jax.tree.map(lambda c, start=start: c[start : start + POINTS_PER_CHUNK], frames) for start in chunks)
        return np.concatenate([kernel(machine.mechanism, part, rolls, signs) for part in parts])

    return Work("best-roll K_xx of azulay", count * ROLLS, kernel, (machine.mechanism, frames, rolls, signs), on_processor)


def _full() -> Work:
    machine, signs = load("azulay"), parse_mode(load("azulay"))
    poses = _poses(machine, np.random.default_rng(1))

    @jax.jit
    def kernel(mechanism: Any, poses: Any, signs: Any) -> Any:
        def one(pose: Any) -> Any:
            return total(leg_stiffnesses(mechanism, pose, signs))[0].upper()

        return jax.vmap(one)(poses)

    def on_processor() -> Any:
        tiles = jax.tree.map(lambda c: c.reshape(-1, CHUNK, TILE), poses)
        batches = (jax.tree.map(lambda c, k=k: c[k], tiles) for k in range(POSES // CHUNK // TILE))
        entries = [[np.ravel(e) for e in upper] for (upper, _) in stream(machine, batches, signs)]
        return [np.concatenate(column) for column in zip(*entries, strict=True)]

    return Work("full 6×6 of azulay", POSES, kernel, (machine.mechanism, poses, signs), on_processor)


def _inverse_dynamics() -> Work:
    machine, rng = load("azulay"), np.random.default_rng(2)
    signs, around = parse_mode(machine), (np.array([0.0, 0.0, -9.81]), np.array(0.0))
    velocity, rise = (Twist(Vec(*rng.normal(0, 0.1, (3, POSES))), Vec(*rng.normal(0, 1, (3, POSES)))) for _ in range(2))
    state = State(_poses(machine, rng), velocity)
    bodies = jax.tree.map(np.asarray, Bodies.of(machine))
    # The kernel that the library compiles, given all states at once.
    kernel = partial(batch._in_mode, batch._drive_motion)
    load_of_none = jax.tree.map(np.zeros_like, rise)

    def on_processor() -> Any:
        found = batch.drive_motion(batch.Case(machine, signs, (0.0, 0.0, -9.81)), state, rise)
        return tuple(tuple(column.T) for column in found)

    arguments = bodies, signs, around, (state, rise, Wrench(*load_of_none))
    return Work("inverse dynamics of azulay", POSES, kernel, arguments, on_processor)


def _margins() -> Work:
    machine, rng = with_neutral(load("azulay"), "radial"), np.random.default_rng(3)
    signs, count = parse_mode(machine), POSES * 4 // ROLLS // ROWS * ROWS
    frames = unrolled(np.tile(machine.home.position, (count, 1)), rng.uniform(0, 6.3, count), rng.uniform(0, 1, count))
    gamma = 2 * np.pi / ROLLS * np.arange(ROLLS)

    def on_processor() -> Any:
        return margins.travel_margin_on_grid(machine, frames, gamma, signs)

    arguments = machine.legs_unnamed, frames, Angle(np.cos(gamma), np.sin(gamma)), signs
    return Work("margins of travel of azulay, cones too", count * ROLLS, margins._margins_on_grid, arguments, on_processor)


def _clearances() -> Work:
    machine, rng = load("azulay"), np.random.default_rng(4)
    signs, poses, scene = parse_mode(machine), _poses(machine, rng), scene_of(machine, with_workpiece=False)
    kernel = partial(margins.clearances, scene)

    def on_processor() -> Any:
        return margins.clearance(machine, scene, poses, signs)

    arguments = jax.tree.map(np.asarray, machine), None, poses, signs
    return Work(f"clearance of azulay, {len(scene.pairs)} pairs of bodies", POSES, kernel, arguments, on_processor)


def _controls() -> Work:
    machine, rng = load("azulay"), np.random.default_rng(5)
    signs, poses, length = parse_mode(machine), _poses(machine, rng), machine.characteristic_length

    def on_processor() -> Any:
        return margins._over(partial(margins.controls, machine.legs_unnamed, length), poses, signs)

    arguments = machine.legs_unnamed, length, poses, signs
    return Work("sigma_min and det J_x of azulay", POSES, margins.controls, arguments, on_processor)


def _poses(machine: Any, rng: Any) -> Any:
    position = np.array(machine.home.position) + rng.normal(0, 2e-3, (POSES, 3))
    return zyz_frame(position, rng.uniform(0, 6.3, POSES), rng.uniform(0, 0.5, POSES), rng.uniform(0, 6.3, POSES))
