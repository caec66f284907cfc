"""The same kernels on an accelerator and on the processor of the same machine; `python -m benchmarks accelerator` where one is.

What is asked of the processor is a chunk at a time, as the library does it; the accelerator gets all poses at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from benchmarks.kernels import ROLLS, Row
from benchmarks.pairs import Paired, paired
from trivet.dynamics import batch
from trivet.dynamics.bodies import Bodies
from trivet.dynamics.equations import State
from trivet.kinematics.mode import parse_mode
from trivet.model import load
from trivet.space.frame import Angle
from trivet.space.pose import zyz_frame
from trivet.space.screw import Twist
from trivet.space.vector import Vec
from trivet.statics.best_roll import on_grid, unrolled
from trivet.statics.compliance import leg_stiffnesses, total
from trivet.statics.objective import K_XX

POSES = 1 << 20


class Work(NamedTuple):
    """A compiled kernel over cases along the first axis of `cases`, and how many poses each of them is."""

    name: str
    kernel: Callable[..., Any]
    fixed: Any
    cases: Any
    each: int
    chunk: int
    """Cases per call on the processor."""


def against_the_processor() -> Iterator[Row]:
    """Poses per second, and the largest difference between both over the largest of the results."""
    accelerator, processor = jax.devices()[0], jax.devices("cpu")[0]
    if accelerator.platform == "cpu":
        raise SystemExit("JAX finds no accelerator here")
    for work in (_map(), _full(), _inverse_dynamics()):
        there = jax.device_put((work.fixed, work.cases), accelerator)
        here = jax.device_put(work.fixed, processor)
        part = jax.device_put(jax.tree.map(lambda c, work=work: c[: work.chunk], work.cases), processor)
        ours = partial(work.kernel, *there)
        theirs = partial(work.kernel, here, part)
        found, expected = (jax.tree.map(np.asarray, call()) for call in (ours, theirs))
        off = max(
            np.nanmax(np.abs(f[: work.chunk] - e)[np.isfinite(e)]) / np.nanmax(np.abs(e[np.isfinite(e)]))
            for f, e in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True)
        )
        times = paired(
            lambda ours=ours: jax.block_until_ready(ours()), lambda theirs=theirs: jax.block_until_ready(theirs()), 7, 5
        )
        count = len(jax.tree.leaves(work.cases)[0])
        per_pose = Paired(times.ours / count / work.each, times.peer / work.chunk / work.each)
        median, low, high = per_pose.ratio
        rates = [1 / np.median(t) / 1e6 for t in (per_pose.ours, per_pose.peer)]
        yield (
            f"{work.name}, {count * work.each:,} poses on {accelerator.device_kind}: ratio to its processor",
            f"{median:.0f} ({low:.0f} to {high:.0f})×; "
            f"{rates[0]:.0f} against {rates[1]:.1f} million poses/s; they differ by {off:.0e}",
            "",
        )


def _done(call: Callable[[], Any]) -> None:
    jax.block_until_ready(call())  # type: ignore[no-untyped-call]


def _map() -> Work:
    machine = load("azulay")
    rng = np.random.default_rng(0)
    count = POSES * 4 // ROLLS
    frames = unrolled(np.tile(machine.home.position, (count, 1)), rng.uniform(0, 6.3, count), rng.uniform(0, 1.5, count))
    gamma = 2 * np.pi / ROLLS * np.arange(ROLLS)
    fixed = machine.mechanism, Angle(np.cos(gamma), np.sin(gamma)), parse_mode(machine)

    @jax.jit
    def kernel(fixed: Any, frames: Any) -> Any:
        mechanism, rolls, signs = fixed
        return on_grid(mechanism, frames, rolls, signs, K_XX).max(axis=1)

    return Work("best-roll K_xx of azulay", kernel, fixed, frames, ROLLS, 320)


def _full() -> Work:
    machine, rng = load("azulay"), np.random.default_rng(1)
    poses = _poses(machine, rng)

    @jax.jit
    def kernel(fixed: Any, poses: Any) -> Any:
        def one(pose: Any) -> Any:
            stiffness, _ = total(leg_stiffnesses(fixed[0], pose, fixed[1]))
            return stiffness.upper()

        return jax.vmap(one)(poses)

    return Work("full 6×6 of azulay", kernel, (machine.mechanism, parse_mode(machine)), poses, 1, 4096)


def _inverse_dynamics() -> Work:
    machine, rng = load("azulay"), np.random.default_rng(2)
    twists = [Twist(Vec(*rng.normal(0, 0.1, (3, POSES))), Vec(*rng.normal(0, 1, (3, POSES)))) for _ in range(2)]
    bodies = jax.tree.map(np.asarray, Bodies.of(machine))
    around = np.array([0.0, 0.0, -9.81]), np.array(0.0)

    def kernel(fixed: Any, cases: Any) -> Any:
        bodies, signs = fixed
        return batch._in_mode(batch._drive_motion, bodies, signs, around, (*cases, batch.NO_LOAD))

    cases = State(_poses(machine, rng), twists[0]), twists[1]
    return Work("inverse dynamics of azulay", kernel, (bodies, parse_mode(machine)), cases, 1, 4096)


def _poses(machine: Any, rng: Any) -> Any:
    position = np.array(machine.home.position) + rng.normal(0, 2e-3, (POSES, 3))
    return zyz_frame(position, rng.uniform(0, 6.3, POSES), rng.uniform(0, 0.5, POSES), rng.uniform(0, 6.3, POSES))
