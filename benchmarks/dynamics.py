"""Inverse dynamics of many states, against MuJoCo with its loops closed as in the tests, and against Pinocchio.

All on one core: `python -m benchmarks.dynamics` prints the rows as JSON, and `on_one_core` runs it there.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.kernels import Row, quartiles
from benchmarks.pairs import PAIRS, Paired, seconds

STATES = 8
"""States through which an engine goes, one after the other."""
BATCH = 65_536
"""States that trivet does at a time."""
MACHINES = ("azulay", "gough-stewart")


def on_one_core() -> Iterator[Row]:
    """The rows, from a process that has one core: neither side has more threads than the other."""
    core = min(os.sched_getaffinity(0))
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.dynamics"],
        preexec_fn=partial(os.sched_setaffinity, 0, {core}),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    for row in json.loads(done.stdout.splitlines()[-1]):
        yield tuple(row)


class Side(NamedTuple):
    """What is timed, and how many states it does."""

    call: Any
    states: int


def against_engines() -> Iterator[Row]:
    """Per state: ours a batch at a time, theirs one after the other from Python."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    import jax

    from trivet.dynamics import batch
    from trivet.dynamics.bodies import Bodies

    for name in MACHINES:
        machine, signs, states, situations = _states(name)
        case = batch.Case(machine, signs, (0.0, 0.0, -9.81))
        asked = [situation.asked(pose) for pose, situation in zip(states, situations, strict=True)]
        whole = jax.tree.map(lambda *c: np.resize(np.array(c, dtype=float), BATCH), *asked)
        mujoco, simulate, forces = _peers(machine, signs, states, situations)
        ours = Side(lambda case=case, whole=whole: batch.drive_motion(case, *whole), BATCH)
        found = ours.call().force[:STATES]
        assert np.abs(found - forces).max() < 1e-9 * np.abs(forces).max(), "the same numbers"
        for what, peer, aim in (
            ("MuJoCo's mass matrix and bias, loops closed exactly", mujoco, "≥ 20"),
            ("Pinocchio's constraintDynamics", simulate, "≥ 5"),
        ):
            yield f"inverse dynamics of {name}, one core, per state: ratio to {what}", _told(_paired(ours, peer)), aim
        one = jax.tree.map(lambda c: np.array([c], dtype=float), asked[0])
        batch.drive_motion(case, *one)
        single = seconds(lambda case=case, one=one: batch.drive_motion(case, *one), 200)
        bodies = jax.tree.map(np.asarray, Bodies.of(machine))
        kernel = partial(batch._in_mode, batch._drive_motion, bodies, signs, (np.array(case.gravity), np.array(0.0)))
        jax.block_until_ready(kernel(one))
        alone = seconds(lambda kernel=kernel, one=one: jax.block_until_ready(kernel(one)), 200)
        yield "the same, one state at a time", f"{1e6 * alone:.0f} µs the kernel, {1e6 * single:.0f} µs from Python", ""


def _states(name: str) -> tuple[Any, Any, list[Any], list[Any]]:
    from machines import part
    from test_dynamics_peers import Situation

    from trivet.kinematics.mode import parse_mode
    from trivet.model import load
    from trivet.space.pose import zyz_frame

    machine, rng = load(name), np.random.default_rng(0)
    position = np.array(machine.home.position) + rng.uniform(-0.003, 0.003, (STATES, 3))
    angles = rng.uniform(-3, 3, STATES), rng.uniform(0, 0.1, STATES), rng.uniform(-0.1, 0.1, STATES)
    poses = zyz_frame(position, *angles)
    situations = [Situation.random(k)._replace(gravity=np.array([0.0, 0.0, -9.81])) for k in range(STATES)]
    return machine, parse_mode(machine), [part(poses, k) for k in range(STATES)], situations


def _peers(machine: Any, signs: Any, poses: list[Any], situations: list[Any]) -> tuple[Side, Side, np.ndarray]:
    """MuJoCo's inverse dynamics and Pinocchio's constrained forward dynamics; and the forces that MuJoCo gives."""
    from test_dynamics_peers import Exact, Tree, driven

    from trivet.interop.mjcf import to_mjcf

    names, _ = driven(machine)
    models = [Exact(to_mjcf(machine, pose), situation) for pose, situation in zip(poses, situations, strict=True)]

    def forces(model: Any, situation: Any) -> np.ndarray:
        model.update()
        closed = model.closed(names)
        found: np.ndarray = closed.forces(closed.accelerations(situation.acceleration), situation.load)[0]
        return found

    def inverse() -> list[np.ndarray]:
        return [forces(model, situation) for model, situation in zip(models, situations, strict=True)]

    trees = [Tree(machine, pose, signs, situation) for pose, situation in zip(poses, situations, strict=True)]
    runs = [tree.solver() for tree in trees]
    given = [tree.closed(names).drives.T @ own for tree, own in zip(trees, inverse(), strict=True)]

    def forward() -> None:
        for run, along in zip(runs, given, strict=True):
            run(along)

    return Side(inverse, STATES), Side(forward, STATES), np.array(inverse())


def _paired(ours: Side, peer: Side) -> Paired:
    for _ in range(2):
        ours.call()
        peer.call()
    times = [(seconds(ours.call, 1) / ours.states, seconds(peer.call, 3) / peer.states) for _ in range(PAIRS)]
    return Paired(*np.array(times).T)


def _told(result: Paired) -> str:
    ours, peer = np.median(result.ours), np.median(result.peer)
    return f"{quartiles(result)}×; {1e6 * ours:.2f} µs against {1e6 * peer:.1f} µs"


if __name__ == "__main__":
    print(json.dumps(list(against_engines())))
