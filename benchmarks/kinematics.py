"""Kinematics against peers: inverse, complete forward, tracking."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

import jax
import jax.numpy as jnp
import numba
import numpy as np

from benchmarks.homotopy import solve_some
from benchmarks.kernels import Row, quartiles
from benchmarks.naive_circles import first_angles
from benchmarks.pairs import paired
from trivet.kinematics.approach import drives_at
from trivet.kinematics.circles import Circles, Status, solve
from trivet.kinematics.locked import circles_of
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.tracking import hinge_angles, track
from trivet.model import Machine, load
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame

FAMILIES = ("azulay", "eclipse", "alizade", "glozman", "behi", "ben-horin", "tahmasebi", "straight-elbow")


def _poses(machine: Machine, count: int, seed: int = 0) -> Frame:
    random = np.random.default_rng(seed)
    place = np.array(machine.home.position) + random.uniform(-0.004, 0.004, (count, 3))
    return zyz_frame(place, *random.uniform(-0.6, 0.6, (3, count)))


def inverse_loop() -> Callable[..., Any]:
    """Inverse kinematics of the paper's machine in its own mode, as one would write it by hand."""

    @numba.njit(parallel=True, fastmath=True, error_model="numpy")
    def drives(px, py, pz, xx, xy, xz, yx, yy, yz, ax, ay, foot, length):  # type: ignore[no-untyped-def]
        out = np.empty((px.size, 6))
        for i in numba.prange(px.size):
            for k in range(3):
                x = px[i] + ax[k] * xx[i] + ay[k] * yx[i]
                y = py[i] + ax[k] * xy[i] + ay[k] * yy[i]
                z = pz[i] + ax[k] * xz[i] + ay[k] * yz[i]
                out[i, k] = math.atan2(y, x)
                out[i, 3 + k] = math.sqrt(x * x + y * y) + math.sqrt(length * length - z * z) - foot
        return out

    return drives


def inverse_kinematics() -> Iterator[Row]:
    """Drive coordinates of the paper's machine at many poses."""
    machine, count = load("azulay"), 1 << 17
    poses, signs = jax.tree.map(jnp.asarray, (_poses(machine, count), parse_mode(machine)))
    model = jax.tree.map(jnp.asarray, machine.mechanism)
    azimuths = 2 * math.pi / 3 * np.arange(3)
    radius = float(machine.characteristic_length)
    columns = [np.asarray(c) for v in (poses.origin, poses.x, poses.y) for c in v]
    chain = machine.chains["leg"].elements
    its = (*columns, radius * np.cos(azimuths), radius * np.sin(azimuths), chain[0].radius, chain[3].length)
    peer = inverse_loop()
    assert np.allclose(drives_at(model, poses, signs), peer(*its), atol=1e-12), "the same numbers"
    found = paired(lambda: drives_at(model, poses, signs).block_until_ready(), lambda: peer(*its))
    rate = count / np.median(found.ours) / 1e6
    yield "inverse kinematics of azulay: ratio to a numba loop", f"{quartiles(found)}; {rate:.1f} million poses/s", "≥ 0.7"


def _circles(count: int) -> tuple[Circles, int]:
    """Problems of all families, from random poses and from random drives alike; the second kind often has no real pose."""
    parts = []
    for number, name in enumerate(FAMILIES):
        machine = load(name)
        share = count // len(FAMILIES)
        poses, signs = _poses(machine, share, number), parse_mode(machine)
        values = np.asarray(drives_at(machine.mechanism, poses, jnp.asarray(signs)))
        values = values[np.isfinite(values).all(axis=1)]
        random = np.random.default_rng(number)
        half = len(values) // 2
        values[:half] += random.normal(0, 0.05, (half, 6)) * np.std(values, axis=0)
        parts.append(circles_of(machine, values))
    together = Circles(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    return together, len(together.distance)


def complete_forward() -> Iterator[Row]:
    """All 16 complex solutions of 1e5 problems of all families."""
    circles, count = _circles(100_000)
    solve(Circles(*(a[:4096] for a in circles)))
    start = time.perf_counter()
    found = solve(circles)
    seconds = time.perf_counter() - start
    right = (found.status == Status.COMPLETE) & (found.found == found.expected)
    yield (
        "complete forward kinematics of 8 families, 1e5 inputs",
        f"{count / seconds:,.0f} solves/s; {int(right.sum())} of {count} complete, proved",
        "≥ 5,000, aiming at 20,000; all",
    )
    naive, wrong = _naive(Circles(*(a[:2000] for a in circles)))
    yield (
        "the same by one polynomial and its companion matrix",
        f"{naive:,.0f} solves/s; angles wrong by up to {wrong:.0e} rad",
        "",
    )
    if find_spec("pypolsys") is not None:
        some = np.random.default_rng(0).choice(count, 200, replace=False)
        rate, complete = solve_some(Circles(*(a[some] for a in circles)), len(some))
        yield (
            "the same by homotopy (POLSYS_PLP through pypolsys)",
            f"{rate:.0f} solves/s; {complete} of {len(some)} complete",
            "",
        )


def _naive(circles: Circles) -> tuple[float, float]:
    """The textbook way: interpolate the resultant in z = exp(i phi_1) on the unit circle, then numpy.roots."""
    true = solve(circles)
    start = time.perf_counter()
    found = first_angles(circles)
    rate = len(found) / (time.perf_counter() - start)
    error = np.abs(np.exp(1j * true.angle[:, :, None, 0]) - np.exp(1j * found[:, None, :])).min(axis=2)
    return rate, float(np.nanmax(np.where(true.real, error, np.nan)))


def tracking() -> Iterator[Row]:
    """The pose that follows, batched."""
    for name in ("azulay", "tahmasebi"):
        machine, count = load(name), 1 << 16
        poses, signs = _poses(machine, count), parse_mode(machine)
        values = drives_at(machine.mechanism, jax.tree.map(jnp.asarray, poses), jnp.asarray(signs))
        angles = jnp.asarray(hinge_angles(machine, poses, signs)) + 1e-4
        found = paired(lambda: jax.block_until_ready(track(machine, values, angles)), lambda: None)  # type: ignore[no-untyped-call]  # noqa: B023
        yield f"tracking, {name}", f"{count / np.median(found.ours) / 1e6:.2f} million poses/s", "≥ 1"
