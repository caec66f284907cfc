"""Frequency responses against superposition of modes in SciPy and OpenSees, and against solid bodies in CalculiX."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.kernels import Row, quartiles
from benchmarks.pairs import PAIRS, Paired, paired
from benchmarks.superposition import Choice, Ready, distance, fastest, matrices, shortest, sufficient, superposed
from trivet.kinematics.mode import parse_mode
from trivet.model import Machine, load
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.statics.assembly import Structure, assemble
from trivet.vibration import spectral, spectral_machine
from trivet.vibration.mesh import mesh
from trivet.vibration.panels import Blocks, quotients
from trivet.vibration.spectral_machine import arguments, at_nodes, sampled, standing

HEIGHT, ETA, LEAST = 0.130, 0.02, 1e-3
FREQUENCY = np.linspace(5.0, 3000.0, 2000)
POSES = 64
SOLIDS = (1, 12, 2, 14)
"""Elements through the wall, around, along the radial tube and along the link, as in the tests, which try finer ones too."""
WHAT = "one FRF of 2,000 frequencies, full 6×6, azulay"


class Setting(NamedTuple):
    """The machine at home, its exact response and its structure."""

    machine: Machine
    signs: Any
    home: Frame
    reference: np.ndarray
    structure: Structure

    def ours(self) -> Any:
        return spectral.receptance(self.machine, self.home, self.signs, FREQUENCY, ETA).block_until_ready()


@cache
def setting() -> Setting:
    machine = load("azulay").with_spherical("free").with_theory("timoshenko").with_rigid_drives()
    signs, home = parse_mode(machine), zyz_frame((0.0, 0.0, HEIGHT), 0.0, 0.0, 0.0)
    reference = np.asarray(spectral.receptance(machine, home, signs, FREQUENCY, ETA))
    return Setting(machine, signs, home, reference, assemble(machine, home, signs))


@cache
def choices(most: float, links: tuple[int, ...]) -> list[Choice]:
    """Coarsest meshes and fewest modes of an error."""
    found = setting()
    return list(sufficient(found.structure, FREQUENCY, found.reference, ETA, most, links))


def milliseconds(times: np.ndarray) -> str:
    return f"{1e3 * np.median(times):.2f} ms"


def faster(result: Paired) -> str:
    return f"{quartiles(result)}×; {milliseconds(result.ours)} against {milliseconds(result.peer)}"


def against_scipy() -> Iterator[Row]:
    """Superposition of the fewest modes of the coarsest mesh that are exact to 1e-3, and to 1e-5."""
    found = setting()
    structure = found.structure
    fine = Choice(8, 60, 60, True, "eigsh", 0.0)
    apart = distance(Ready.of(matrices(structure, 8, 60), "eigsh").response(fine, FREQUENCY, ETA), found.reference)
    assert apart < 1e-5, "the same structure"
    yield f"{WHAT}: trivet against the modes of a mesh of {fine.radial} + {fine.link} elements", f"error {apart:.0e}", "≤ 1e-3"

    for least, links in ((LEAST, tuple(range(2, 17))), (1e-5, tuple(range(32, 64, 4)))):
        best = fastest(structure, choices(least, links), FREQUENCY, ETA)
        ready = Ready.of(matrices(structure, best.radial, best.link), best.solver)

        def from_matrices(best: Choice = best, ready: Ready = ready) -> np.ndarray:
            return ready.response(best, FREQUENCY, ETA)

        def from_structure(best: Choice = best) -> np.ndarray:
            own = Ready.of(matrices(structure, best.radial, best.link), best.solver)
            return own.response(best, FREQUENCY, ETA)

        def from_mesh(best: Choice = best) -> np.ndarray:
            own = mesh(structure, {"slide": best.radial, "link": best.link})
            made = Ready.of((own.stiffness.toarray(), own.mass.toarray()), best.solver)
            return made.response(best, FREQUENCY, ETA)

        for call in (from_matrices, from_structure, from_mesh):
            error = distance(call(), found.reference)
            assert error < 1.01 * least, "as exact as it was chosen to be"
        peer = f"{WHAT}: ratio to SciPy ({best}; error {error:.0e})"
        aim = "≥ 10" if least == LEAST else ""
        yield f"{peer}, matrices put together by hand", faster(paired(found.ours, from_structure)), aim
        yield f"{peer}, matrices put together by trivet's mesh", faster(paired(found.ours, from_mesh, calls=5)), aim
        yield f"{peer}, matrices ready", faster(paired(found.ours, from_matrices)), aim


def opensees_response(choice: Choice) -> np.ndarray:
    """Receptance (n, 6, 6) of the modes that OpenSees finds."""
    from tests.opensees_model import Vibration, build, compliance, modes

    build("azulay", "free", np.array([0.0, 0.0, HEIGHT]), np.eye(3), Vibration((choice.radial, choice.link), True, True))
    natural, shapes = modes(choice.modes)
    static = compliance() if choice.corrected else None
    return superposed(np.square(2 * np.pi * natural), shapes, static, FREQUENCY, ETA)


def against_opensees() -> Iterator[Row]:
    """The same superposition from OpenSees' modes: its elements are the same."""
    found = setting()
    some = choices(LEAST, tuple(range(2, 17)))
    best = min(some, key=lambda choice: shortest(partial(opensees_response, choice)))
    error = distance(opensees_response(best), found.reference)
    assert error < 1.05 * LEAST, "the same structure"
    result = paired(found.ours, partial(opensees_response, best), calls=5)
    what = str(best).rpartition(",")[0]
    yield f"{WHAT}: ratio to OpenSeesPy ({what}; error {error:.0e}), model built anew", faster(result), "≥ 10"


def against_solids() -> Iterator[Row]:
    """The same machine as solid bodies, by superposition of modes: one run."""
    from tests.solid_model import Mesh, Model, Tripod, frf_deck, response, run

    count = 12
    deck = frf_deck(Model(Tripod(height=HEIGHT), Mesh(*SOLIDS)), count, ETA / 2, FREQUENCY[0], FREQUENCY[-1], 250)
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        printed = run(deck, Path(folder))
        theirs = time.perf_counter() - start
    frequency, solids = response(printed)
    found = setting()
    beams = np.asarray(spectral.receptance(found.machine, found.home, found.signs, frequency, ETA))
    ours = shortest(found.ours, PAIRS)
    yield (
        f"{WHAT}: ratio to CalculiX (solid bodies, {count} modes, {len(frequency):,} frequencies, one run; "
        f"{distance(solids, beams):.0e} from beams)",
        f"{theirs / len(frequency) * len(FREQUENCY) / ours:,.0f}×; {theirs:.1f} s",
        "≥ 500",
    )


def batch() -> Iterator[Row]:
    """Many poses about home, per pose."""
    found = setting()
    random = np.random.default_rng(0)
    place = np.array([0.0, 0.0, HEIGHT]) + random.uniform(-0.004, 0.004, (POSES, 3))
    poses = zyz_frame(place, random.uniform(-3, 3, POSES), random.uniform(0, 0.3, POSES), random.uniform(-3, 3, POSES))

    def ours() -> Any:
        return spectral.receptance(found.machine, poses, found.signs, FREQUENCY, ETA).block_until_ready()

    assert np.all(np.isfinite(ours())), "all poses are reached"
    best = fastest(found.structure, choices(LEAST, tuple(range(2, 17))), FREQUENCY, ETA)

    def from_structure() -> np.ndarray:
        return Ready.of(matrices(found.structure, best.radial, best.link), best.solver).response(best, FREQUENCY, ETA)

    result = paired(ours, from_structure, pairs=9, calls=2)
    per_pose = Paired(result.ours / POSES, result.peer)
    yield (
        f"{POSES} poses × 2,000 frequencies, per pose: ratio to SciPy ({best}), matrices put together by hand",
        faster(per_pose),
        "",
    )


def compile_times() -> Iterator[Row]:
    """Seconds to compile each kernel, without any cache; and to trace them all."""
    for name in ("azulay", "eclipse", "alizade", "glozman"):
        loaded = load(name).with_spherical("free").with_theory("timoshenko")
        times, tracing = {}, 0.0
        for kernel, (function, taken) in kernels_of(loaded).items():
            jax.clear_caches()  # type: ignore[no-untyped-call]
            start = time.perf_counter()
            lowered = function.lower(*taken)
            traced = time.perf_counter()
            lowered.compile()
            times[kernel] = time.perf_counter() - traced
            tracing += traced - start
        figure = ", ".join(f"{k} {t:.1f}" for k, t in times.items())
        yield f"{name}, free: seconds to compile for FRFs", f"{figure}; tracing them all {tracing:.1f}", "≤ 5 each"


def kernels_of(machine: Machine) -> dict[str, tuple[Any, tuple[Any, ...]]]:
    """The kernels of a response at home and their gradients in every dimension, with what they take."""
    home = zyz_frame(machine.home.position, 0.0, 0.0, 0.0)
    poses = jax.tree.map(lambda c: np.atleast_1d(np.asarray(c, dtype=float)), home)
    stand, omega = standing(machine, home, parse_mode(machine)), 2 * np.pi * FREQUENCY
    chosen = spectral.plan(machine, poses, stand, float(omega[-1]))
    finish = spectral.Matrices(inverted=True, alone=True)
    nodes = spectral._nodes(omega, chosen)
    assert nodes is not None, "more frequencies than nodes"
    blocks = Blocks.of(omega, chosen.cuts, chosen.power)
    samples_of = jax.jit(partial(sampled, effort=chosen.effort))
    between_nodes = jax.jit(partial(spectral_machine._between, power=chosen.power, finish=finish, arms=None))
    at_those = jax.jit(partial(at_nodes, finish=finish, arms=None))
    parts = (jax.tree.map(jnp.asarray, machine), poses, stand, nodes.omega, None if chosen.is_real else ETA)
    samples = samples_of(*parts)
    along = (samples, nodes, blocks.nodes.omega.reshape(1, -1), ETA)
    ratio = (*between_nodes(*along), blocks.nodes, blocks.power, blocks.panel)
    return {
        "arguments": (arguments, (machine, poses, stand, omega[-1])),
        "samples": (samples_of, parts),
        "between": (between_nodes, along),
        "quotients": (quotients, ratio),
        "at nodes": (at_those, (samples, nodes.omega)),
        "gradient of samples": (gradient(samples_of), parts),
        "gradient of between": (gradient(between_nodes), along),
        "gradient of quotients": (gradient(quotients), ratio),
    }


def gradient(kernel: Any) -> Any:
    """A kernel with its derivatives with respect to its first argument, summed up with equal weights."""

    def total(first: Any, *rest: Any) -> Any:
        return sum(jnp.sum(jnp.real(leaf)) for leaf in jax.tree.leaves(kernel(first, *rest)))

    return jax.jit(jax.value_and_grad(total, allow_int=True))


def responses() -> Iterator[Row]:
    """All of them."""
    parts: tuple[Callable[[], Iterator[Row]], ...] = (against_scipy, against_opensees, against_solids, batch, compile_times)
    for part in parts:
        yield from part()
