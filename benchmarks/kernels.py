"""Kernels against their peers."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks import loop
from benchmarks.opensees import stiffness_once
from benchmarks.pairs import Paired, paired
from trivet.kinematics.mode import parse_mode
from trivet.model import Mechanism, load
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled, zyz_frame
from trivet.statics.best_roll import best_roll, mean_and_gradient, mean_objective, on_grid, unrolled
from trivet.statics.objective import K_XX
from trivet.statics.stiffness import CHUNK, TILE, _tiles, stiffness, stream
from trivet.study.stiffness_map import surface_of

ROLLS = 360
Row = tuple[str, str, str]
VARIANTS = ("free", "clamped")


def quartiles(result: Paired) -> str:
    median, low, high = result.ratio
    return f"{median:.2f} ({low:.2f} to {high:.2f})"


def _setting(spherical: str) -> tuple[Mechanism, Frame, Angle, Any]:
    machine = load("azulay").with_spherical(spherical)  # type: ignore[arg-type]
    surface = surface_of(machine)
    gamma = 2 * np.pi / ROLLS * np.arange(ROLLS)
    frames = unrolled(surface.position, surface.azimuth, surface.tilt)
    rolls = Angle(np.cos(gamma), np.sin(gamma))
    return jax.tree.map(jnp.asarray, (machine.mechanism, frames, rolls, parse_mode(machine)))  # type: ignore[no-any-return]


def _peer(spherical: str) -> tuple[Any, tuple[Any, ...]]:
    machine = load("azulay")
    return loop.make(spherical == "clamped"), loop.arguments(machine, surface_of(machine), ROLLS)


def best_roll_map() -> Iterator[Row]:
    """Best-roll K_xx over 317 x 360 poses, from the general description."""
    highest = jax.jit(lambda *a: on_grid(*a, K_XX).max(axis=1))
    for spherical in VARIANTS:
        setting = _setting(spherical)
        peer, its = _peer(spherical)
        assert np.allclose(highest(*setting), peer(*its), rtol=1e-12), "the same numbers"
        found = paired(lambda: highest(*setting).block_until_ready(), lambda: peer(*its))  # noqa: B023
        poses = 317 * ROLLS / np.median(found.ours) / 1e6
        yield (
            f"best-roll K_xx, 317 × 360 poses, ball joints {spherical}: ratio to the numba loop",
            f"{quartiles(found)}; {poses:.0f} million poses/s",
            "≥ 1.0",
        )


def _poses(batches: int) -> list[Frame]:
    generator = np.random.default_rng(0)
    shape = (CHUNK, TILE)
    found = []
    for _ in range(batches):
        position = np.stack(
            [generator.normal(0, 2e-3, shape), generator.normal(0, 2e-3, shape), generator.normal(0.123, 1e-3, shape)], axis=-1
        )
        frame = zyz_frame(
            position, generator.uniform(0, 6, shape), generator.uniform(0, 1.5, shape), generator.uniform(0, 6, shape)
        )
        found.append(jax.tree.map(jnp.asarray, frame))
    return found


def full_stiffness() -> Iterator[Row]:
    """All 21 entries of the 6 x 6, in poses per second against the poses per second of the loop."""
    batches = _poses(4)
    count = len(batches) * CHUNK * TILE
    for spherical in VARIANTS:
        machine, signs = load("azulay").with_spherical(spherical), _setting(spherical)[-1]  # type: ignore[arg-type]
        peer, its = _peer(spherical)

        def all_of_it(machine: Any = machine, signs: Any = signs) -> None:
            for _ in stream(machine, iter(batches), signs):
                pass

        found = paired(all_of_it, lambda: peer(*its))  # noqa: B023
        per_pose = Paired(found.ours / count, found.peer / (317 * ROLLS))
        rate = count / np.median(found.ours) / 1e6
        yield (
            f"full 6×6, ball joints {spherical}: its poses/s over those of the loop",
            f"{quartiles(per_pose)}; {rate:.1f} million poses/s",
            "≥ 0.15",
        )


def against_opensees() -> Iterator[Row]:
    """One stiffness in OpenSeesPy against one pose of ours."""
    batches = _poses(4)
    count = len(batches) * CHUNK * TILE
    highest = jax.jit(lambda *a: on_grid(*a, K_XX).max(axis=1))
    for spherical in VARIANTS:
        machine, signs = load("azulay").with_spherical(spherical), _setting(spherical)[-1]  # type: ignore[arg-type]
        place, frame = np.array([0.001, 0.002, 0.123]), zyz_frame((0.001, 0.002, 0.123), 0.3, 0.6, 0.2)
        turn = np.array(frame.matrix(), dtype=float)
        theirs = stiffness_once("azulay", spherical, place, turn)
        ours = stiffness(load("azulay").with_spherical(spherical), jax.tree.map(np.atleast_1d, frame), signs)[0][0]  # type: ignore[arg-type]
        assert np.allclose(theirs, ours, rtol=1e-4, atol=1e-5 * np.abs(ours).max()), "the same structure"

        peer_call = partial(stiffness_once, "azulay", spherical, place, turn)
        grid = _setting(spherical)
        found = paired(lambda: highest(*grid).block_until_ready(), peer_call)  # noqa: B023
        median, low, high = Paired(found.ours / (317 * ROLLS), found.peer).ratio
        figure = f"{median:,.0f}× ({low:,.0f} to {high:,.0f})"
        yield f"best-roll K_xx, ball joints {spherical}: per pose against a stiffness in OpenSeesPy", figure, "≥ 50,000"

        def all_of_it(machine: Any = machine, signs: Any = signs) -> None:
            for _ in stream(machine, iter(batches), signs):
                pass

        found = paired(all_of_it, peer_call)
        per_pose = Paired(found.ours / count, found.peer)
        median, low, high = per_pose.ratio
        yield (
            f"full 6×6, ball joints {spherical}: per pose against OpenSeesPy",
            f"{median:,.0f}× ({low:,.0f} to {high:,.0f})",
            "≥ 50,000",
        )


def gradient() -> Iterator[Row]:
    """Mean best-roll K_xx with its derivatives in every dimension against the value alone."""
    for name in ("azulay", "glozman"):
        machine = load(name)
        signs, surface = parse_mode(machine), surface_of(machine)
        model = jax.tree.map(jnp.asarray, machine)

        def value(machine: Any = machine, surface: Any = surface, signs: Any = signs) -> Any:
            return best_roll(machine, surface, signs, K_XX)

        def both() -> None:
            mean_and_gradient(machine, surface, value(), signs, K_XX)  # noqa: B023

        found = paired(value, both)
        yield f"{name}: mean best-roll K_xx with its full gradient, time over that of the value", quartiles(found), "≤ 4"
        best = value()
        frames, roll = unrolled(surface.position, surface.azimuth, surface.tilt), Angle(np.cos(best.roll), np.sin(best.roll))
        alone = jax.jit(lambda *a: mean_objective(*a, K_XX))
        slope = jax.jit(jax.value_and_grad(lambda *a: mean_objective(*a, K_XX)))
        found = paired(
            lambda: alone(model, frames, roll, signs).block_until_ready(),  # noqa: B023
            lambda: jax.block_until_ready(slope(model, frames, roll, signs)),  # noqa: B023
        )
        yield f"{name}: the same at fixed rolls, 317 poses, time over that of the value", quartiles(found), "≤ 4"


def compile_times() -> Iterator[Row]:
    """Seconds to compile each kernel, without any cache."""
    for name in ("azulay", "eclipse", "alizade", "glozman"):
        for spherical in VARIANTS:
            loaded = load(name).with_spherical(spherical)  # type: ignore[arg-type]
            machine, mechanism = jax.tree.map(jnp.asarray, (loaded, loaded.mechanism))
            signs, surface = jnp.asarray(parse_mode(loaded)), surface_of(loaded)
            frames = unrolled(surface.position, surface.azimuth, surface.tilt)
            angle = Angle(np.cos(surface.tilt), np.sin(surface.tilt))
            tile = jax.tree.map(lambda c: jnp.broadcast_to(c[:1], (CHUNK, TILE)), rolled(frames, angle))
            kernels = {
                "map": (lambda m, f, r, s: on_grid(m, f, r, s, K_XX), (mechanism, frames, angle, signs)),
                "6×6": (_tiles, (mechanism, tile, signs)),
                "gradient": (
                    jax.value_and_grad(lambda m, f, r, s: mean_objective(m, f, r, s, K_XX)),
                    (machine, frames, angle, signs),
                ),
            }
            times = {}
            for kernel, (function, arguments) in kernels.items():
                lowered = jax.jit(function).lower(*arguments)  # type: ignore[arg-type]
                start = time.perf_counter()
                lowered.compile()
                times[kernel] = time.perf_counter() - start
            yield f"{name}, {spherical}: seconds to compile", ", ".join(f"{k} {t:.1f}" for k, t in times.items()), "≤ 5 each"
