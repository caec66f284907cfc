"""Matrix structural analysis against the reference cases, against the condensed path, and against its own laws."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from machines import (
    PAPER,
    STATIC_CASES,
    bracketed,
    difference,
    part,
    random_stands,
    reference_machine,
    reference_pose,
    reference_stiffness,
)

from trivet.errors import InputError, NoResultError
from trivet.kinematics.closure import close_machine
from trivet.kinematics.inverse import inverse
from trivet.kinematics.mode import parse_mode
from trivet.model import Machine, catalogue, load
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.statics.assembly import PLATFORM, Structure, assemble, assemble_standing
from trivet.statics.beam_element import global_stiffness, local_stiffness
from trivet.statics.compliance import platform_stiffness
from trivet.statics.structure import a_k, k_t, solve, structural_stiffness

POSES, CHUNK = 1000, 100
# Compiling takes longer than computing here.
QUICK = {"xla_backend_optimization_level": 0}


def condensed(machine: Machine, pose: Frame, signs: Any) -> Any:
    total, _ = platform_stiffness(machine.mechanism, pose, signs)
    shape = jnp.shape(pose.origin.x)
    return jnp.stack([jnp.stack([jnp.broadcast_to(v, shape) for v in row], axis=-1) for row in total.full()], axis=-2)


def worst_difference(machine: Machine, count: int, seed: int, kernel: Any = condensed) -> float:
    """Greatest difference of the two paths over random poses and modes."""
    pose, signs = random_stands(machine, count, seed)
    expected = np.asarray(kernel(machine, pose, signs))
    worst = 0.0
    for start in range(0, count, CHUNK):
        chunk = slice(start, start + CHUNK)
        found = structural_stiffness(machine, part(pose, chunk), signs[..., chunk])
        worst = max(worst, float(difference(machine, found, expected[chunk]).max()))
    return worst


@pytest.mark.parametrize(("rotation", "key"), [("free", "K_free"), ("clamped", "K_fixed")])
@pytest.mark.parametrize("case", STATIC_CASES, ids=lambda c: f"{c['id']}-{c['mechanism']}")
def test_reference_cases(case: dict[str, Any], rotation: Any, key: str) -> None:
    machine = reference_machine(case).with_spherical(rotation)
    found = structural_stiffness(machine, reference_pose(case), parse_mode(machine))
    assert difference(machine, found, reference_stiffness(case, key)) < 1e-9


@pytest.mark.parametrize("rotation", ["free", "clamped"])
@pytest.mark.parametrize("name", PAPER)
def test_both_paths_agree(name: str, rotation: Any) -> None:
    assert (
        worst_difference(load(name).with_spherical(rotation), POSES, seed=1, kernel=jax.jit(condensed, compiler_options=QUICK))
        < 1e-9
    )


@pytest.mark.parametrize("name", sorted({*catalogue()} - {*PAPER, "azulay-196", "azulay-236"}))
def test_both_paths_agree_on_every_kind_of_chain(name: str) -> None:
    assert worst_difference(load(name), 100, seed=7) < 1e-9


def test_both_paths_agree_whatever_is_locked() -> None:
    locks = {"leg-1.guide": 0.1, "leg-2.tangential": 0.002, "leg-3.radial": 0.0395}
    assert worst_difference(load("rmmt").with_locks(locks), 50, seed=8) < 1e-9


@pytest.mark.parametrize(
    ("name", "rotation"), [("azulay", 300.0), ("eclipse", "clamped"), ("alizade", "free"), ("glozman", 300.0)]
)
def test_both_paths_agree_in_every_variant(name: str, rotation: Any) -> None:
    machine = load(name).with_spherical(rotation).with_theory("timoshenko").with_guide("rotation")
    assert worst_difference(machine, 100, seed=2) < 1e-9


def test_both_paths_agree_on_rigid_bodies() -> None:
    assert worst_difference(bracketed().with_spherical("free"), 100, seed=5) < 1e-9


def held_stiffness(structure: Structure) -> np.ndarray:
    return solve(structure, np.zeros((*structure.nodes.shape[:-1], 6, 6)), platform_twists=np.eye(6)).held


def test_a_hexapod_is_six_struts() -> None:
    """Between a cross and a ball a strut carries nothing but an axial force: K = sum k n n^T, n the line of the strut."""
    machine = load("gough-stewart")
    pose = zyz_frame(np.add(machine.home.position, (0.02, -0.01, 0.01)), 0.3, 0.2, 0.1)
    closed = close_machine(machine, pose)
    structure = assemble_standing(machine, pose, [c.coordinates for c in closed])
    tube = machine.sections["tube"]
    area = np.pi / 4 * (tube.outer_diameter**2 - tube.inner_diameter**2)  # type: ignore[union-attr]
    expected = np.zeros((6, 6))
    for leg in machine.legs:
        arm = np.array([float(c) for c in pose.direction(leg.platform_frame().origin)])
        run = arm + [float(c) for c in pose.origin] - np.array([float(c) for c in leg.base_frame().origin])
        length = np.linalg.norm(run)
        line = np.r_[run, np.cross(arm, run)] / length
        strut = machine.materials["steel"].youngs_modulus * area / length
        expected += np.outer(line, line) / (1 / strut + 1 / leg.chain.elements[1].stiffness)  # type: ignore[union-attr]
    assert difference(machine, held_stiffness(structure), expected) < 1e-9


def stand(name: str = "azulay", rotation: Any = "clamped") -> tuple[Machine, Frame, Any]:
    """A machine at a pose that has no symmetry."""
    machine = load(name).with_spherical(rotation)
    pose = zyz_frame(np.add(machine.home.position, (0.002, 0.003, -0.001)), 0.3, 0.35, 0.2)
    return machine, pose, parse_mode(machine)


@pytest.mark.parametrize("rotation", ["free", "clamped"])
@pytest.mark.parametrize("name", PAPER)
def test_stiffness_is_symmetric_and_positive(name: str, rotation: Any) -> None:
    machine, pose, signs = stand(name, rotation)
    k = structural_stiffness(machine, pose, signs)
    scale = np.r_[np.ones(3), np.full(3, 1 / float(machine.characteristic_length))]
    k = k * scale[:, None] * scale
    assert np.abs(k - k.T).max() < 1e-11 * np.abs(k).max()
    assert np.linalg.eigvalsh(k)[0] > 1e-6 * np.linalg.eigvalsh(k)[-1]


@pytest.mark.parametrize("name", PAPER)
def test_balls_lie_between_free_and_clamped(name: str) -> None:
    low, middle, high = (structural_stiffness(*stand(name, r)) for r in ("free", 300.0, "clamped"))
    for more, less in ((middle, low), (high, middle)):
        assert np.linalg.eigvalsh((more - less + (more - less).T) / 2)[0] > -1e-6 * np.linalg.norm(more)
    assert difference(load(name), structural_stiffness(*stand(name, 1e-6)), low) < 1e-6


@pytest.mark.parametrize("name", PAPER)
def test_solution_fulfils_the_equations_of_the_paper(name: str) -> None:
    """Eq 37 in the nodes' own displacements, from K_T and A_K, solved without any help."""
    structure = assemble(*stand(name))
    stiffness, ties = k_t(structure), a_k(structure)
    rows, size = ties.shape
    rng = np.random.default_rng(3)
    loads = rng.normal(size=(len(structure.nodes), 6, 1))
    matrix = np.block([[stiffness, ties.T], [ties, np.zeros((rows, rows))]])
    loaded = np.zeros((size + rows, 1))
    loaded[: loads.size] = loads.reshape(-1, 1)
    found = np.linalg.solve(matrix, loaded)
    ours = solve(structure, loads)
    for own, theirs in (
        (ours.displacements, found[: loads.size]),
        (ours.deflections, found[loads.size : size]),
        (ours.ties, found[size + 6 :]),
    ):
        np.testing.assert_allclose(own.ravel(), theirs.ravel(), rtol=0, atol=1e-7 * np.abs(theirs).max())


def test_beams_resist_no_rigid_motion() -> None:
    structure = assemble(*stand("glozman"))
    for beam in structure.beams:
        arm = structure.nodes[beam.second] - structure.nodes[beam.first]
        turn = np.cross(np.eye(3), arm).T  # columns: omega x arm
        rigid = np.block([[np.eye(6)], [np.eye(3), turn], [np.zeros((3, 3)), np.eye(3)]])
        assert np.abs(global_stiffness(beam) @ rigid).max() < 1e-12 * np.abs(global_stiffness(beam)).max()
        np.testing.assert_array_equal(local_stiffness(beam), local_stiffness(beam).T)


def test_short_beams_do_not_drown_the_rest() -> None:
    """Where the slide stands almost on the guide circle, 12 EI / L^3 outgrows every other stiffness by up to 1e25."""
    machine = load("azulay")
    gaps = np.array([1e-3, 1e-5, 1e-7, -1e-9])
    link = machine.chains["leg"].elements[3].length  # type: ignore[union-attr]
    heights = np.sqrt(link**2 - (0.162 + gaps - 0.018) ** 2)
    pose = zyz_frame(np.stack([0 * gaps, 0 * gaps, heights], axis=-1), 0 * gaps, 0 * gaps, 0 * gaps)
    signs = parse_mode(machine)
    np.testing.assert_allclose(assemble(machine, pose, signs).beams[0].length, np.abs(gaps), rtol=1e-3)
    expected = np.asarray(condensed(machine, pose, signs))
    assert np.all(difference(machine, structural_stiffness(machine, pose, signs), expected) < 1e-9)


def slid_to(machine: Machine, pose: Frame, length: Any) -> Structure:
    """The structure with the second joint of every chain set to a length (m) of our choice; its chains need not close."""
    standing = []
    for leg, sign in zip(machine.legs, parse_mode(machine), strict=True):
        guide, _, *rest = inverse(leg, pose, sign).coordinates
        standing.append((guide, length, *rest))
    return assemble_standing(machine, pose, standing)


def test_a_zero_beam_is_rigid() -> None:
    machine = load("azulay")
    pose = zyz_frame(machine.home.position, 0.0, 0.0, 0.0)

    def stiffness(length: float) -> np.ndarray:
        structure = slid_to(machine, pose, length)
        return held_stiffness(structure)

    rigid = stiffness(0.0)
    for length in (1e-12, -1e-12, 1e-17):
        assert difference(machine, stiffness(length), rigid) < 1e-9
    assert difference(machine, stiffness(0.02), rigid) > 1e-3


def test_a_batch_is_its_poses() -> None:
    machine = load("eclipse")
    pose, signs = random_stands(machine, 5, seed=4)
    together = structural_stiffness(machine, pose, signs)
    for i in range(5):
        np.testing.assert_allclose(
            together[i], structural_stiffness(machine, part(pose, i), signs[..., i]), rtol=1e-8, atol=1e-3
        )


def test_out_of_reach_is_named() -> None:
    machine = load("azulay")
    with pytest.raises(NoResultError, match=r"azulay: chain leg-1 does not reach"):
        assemble(machine, zyz_frame([0.0, 0.0, 0.5], 0.0, 0.0, 0.0), parse_mode(machine))


def test_a_mechanism_is_no_result() -> None:
    structure = assemble(*stand("azulay", "free"))
    loads = np.zeros((len(structure.nodes), 6, 1))
    loads[PLATFORM, 2] = 1.0
    assert np.isfinite(solve(structure, loads).displacements).all()
    fallen = tuple(c for c in structure.connections if not c.name.startswith("leg-2"))
    with pytest.raises(NoResultError, match="without resistance"):
        solve(dataclasses.replace(structure, connections=fallen), loads)


def test_an_idle_freedom_is_no_result() -> None:
    """A link between two balls spins freely.  Rounding hides it from the elimination: no pivot is exactly zero."""
    structure = assemble(*stand("azulay", "free"))
    rotations = np.concatenate([np.zeros((3, 3)), np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 + np.eye(3))[0]])
    loose = tuple(
        dataclasses.replace(c, screws=rotations, rates=np.zeros(3)) if c.name == "leg-3.hinge" else c
        for c in structure.connections
    )
    with pytest.raises(NoResultError, match="without resistance"):
        held_stiffness(dataclasses.replace(structure, connections=loose))


def test_mixed_zero_lengths_are_refused() -> None:
    machine = load("azulay")
    pose = zyz_frame(np.tile(machine.home.position, (2, 1)), np.zeros(2), np.zeros(2), np.zeros(2))
    with pytest.raises(InputError, match=r"leg-1\.slide: zero length at some poses"):
        slid_to(machine, pose, np.array([0.0, 0.01]))
