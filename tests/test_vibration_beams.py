"""Vibrating beams: transfer matrix, consistent mass, and structures whose frequencies are in textbooks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import brentq

from trivet.errors import InputError, NoResultError
from trivet.statics.assembly import GROUND, PLATFORM, Connection, NodeMass, Structure
from trivet.statics.beam_element import BeamElement, Uniform, local_stiffness
from trivet.statics.structure import carry
from trivet.vibration.beam_mass import local_mass
from trivet.vibration.exact import ExactStructure, exact_mesh
from trivet.vibration.mesh import MOST_ELEMENTS, divided, mesh
from trivet.vibration.modes import LARGEST_DENSE, eigenmodes, exact_frequencies
from trivet.vibration.response import direct_receptance, exact_receptance
from trivet.vibration.spectral_beam import terms_for, transfer_matrix, wave_numbers

LENGTH = 0.7
# A steel bar of 20 mm by 30 mm, and what makes it an Euler-Bernoulli beam.
SHEARED = Uniform(1.2e8, 3.7e3, 9.2e3, 4.1e3, 3.9e7, 3.7e7, 4.7, 3.6e-4, 1.6e-4, 5.2e-4, None)
THIN = SHEARED._replace(shear_y=math.inf, shear_z=math.inf, rotary_y=0.0, rotary_z=0.0)
THEORIES = pytest.mark.parametrize("made", [THIN, SHEARED], ids=["euler-bernoulli", "timoshenko"])
BENDING = {"y": ("flexural_z", "shear_y", "rotary_z"), "z": ("flexural_y", "shear_z", "rotary_y")}

# Local axes in {O}: a beam that lies along none of them.
AXES = np.linalg.qr(np.array([[1.0, 0.3, -0.2], [0.4, -1.0, 0.1], [-0.5, 0.2, 1.0]]))[0]
AXES[:, 2] = np.cross(AXES[:, 0], AXES[:, 1])
ALL = np.kron(np.eye(2), AXES)
"""Six local screws (three translations, three rotations) as columns, in {O}."""
START, FAR = np.array([0.2, -0.1, 0.3]), PLATFORM


def held(node: int, at: np.ndarray, free: Sequence[int], rates: Sequence[float] | None = None) -> Connection:
    """A tie to the ground which leaves some of the six local screws, slack or with springs."""
    springs = np.zeros(len(free)) if rates is None else np.array(rates, dtype=float)
    return Connection(f"at-{node}", GROUND, node, at, ALL[:, list(free)], springs, None, np.zeros(len(free)))


def bar(made: Uniform, *ties: tuple[int, Sequence[int]], masses: tuple[NodeMass, ...] = ()) -> Structure:
    """A beam from node 2 to the platform's; each tie holds one of its ends but for some local screws."""
    nodes = np.array([np.zeros(3), START + LENGTH * AXES[:, 0], START])
    beam = BeamElement("beam", 2, FAR, AXES, np.array(LENGTH), made)
    return Structure(nodes, (beam,), tuple(held(n, nodes[n], free) for n, free in ties), masses, LENGTH)


def cantilever(made: Uniform) -> Structure:
    return bar(made, (2, ()))


def free_free(made: Uniform) -> Structure:
    return bar(made)


def pinned_pinned(made: Uniform) -> Structure:
    """Both ends turn about y and z; the far one also slides and twists."""
    return bar(made, (2, (4, 5)), (FAR, (0, 3, 4, 5)))


def roots(condition: Callable[[float], float], count: int) -> np.ndarray:
    """The lowest roots above 0.1 of a continuous function."""
    grid = np.linspace(0.1, 40.0, 8001)
    signs = np.sign([condition(x) for x in grid])
    brackets = [(grid[k], grid[k + 1]) for k in np.flatnonzero(signs[1:] != signs[:-1])[:count]]
    return np.array([brentq(condition, *bracket, xtol=1e-14) for bracket in brackets])


def clamped_free(count: int) -> np.ndarray:
    """beta L with cos cosh = -1; divided by cosh, so that it stays of order one."""
    return roots(lambda x: math.cos(x) + 1 / math.cosh(x), count)


def both_free(count: int) -> np.ndarray:
    return roots(lambda x: math.cos(x) - 1 / math.cosh(x), count)


def bending_frequencies(made: Uniform, beta: np.ndarray) -> np.ndarray:
    """Hz, both planes, from beta L of an Euler-Bernoulli beam."""
    both = [np.sqrt(getattr(made, flexural) / made.mass) for flexural, _, _ in BENDING.values()]
    return np.concatenate([(beta / LENGTH) ** 2 * speed for speed in both]) / (2 * math.pi)


def along_frequencies(made: Uniform, phase: np.ndarray) -> np.ndarray:
    """Hz, stretching and torsion, from k L."""
    both = math.sqrt(made.axial / made.mass), math.sqrt(made.torsion / made.polar)
    return np.concatenate([phase / LENGTH * speed for speed in both]) / (2 * math.pi)


def pinned_timoshenko(made: Uniform, count: int) -> np.ndarray:
    """Hz, both planes: waves sin(n pi x / L) fulfil the ends; of the two frequencies of each the lower."""
    found = []
    for names in BENDING.values():
        flexural, shear, rotary = (getattr(made, name) for name in names)
        square = (np.arange(1, count + 1) * math.pi / LENGTH) ** 2
        # a w^4 - b w^2 + c = 0
        a = rotary * made.mass / shear
        b, c = made.mass + (rotary + flexural * made.mass / shear) * square, flexural * square**2
        found.append(np.sqrt(2 * c / (b + np.sqrt(b * b - 4 * a * c))))
    return np.concatenate(found) / (2 * math.pi)


def lowest(structure: Structure, count: int, elements: int = 8, shift: float = 0.0) -> np.ndarray:
    """Frequencies (Hz) without the error of the mesh."""
    return exact_frequencies(structure, eigenmodes(mesh(structure, elements), count, shift)[0])


HALVES = (np.arange(1, 30) - 0.5) * math.pi
WHOLES = np.arange(1, 30) * math.pi


def test_cantilever() -> None:
    expected = np.sort(np.concatenate([bending_frequencies(THIN, clamped_free(10)), along_frequencies(THIN, HALVES)]))[:10]
    np.testing.assert_allclose(clamped_free(3), [1.8751040687, 4.6940911330, 7.8547574382], rtol=1e-10)
    np.testing.assert_allclose(lowest(cantilever(THIN), 10), expected, rtol=1e-8)


def test_free_free() -> None:
    """Six rigid motions at zero, then the elastic ones."""
    structure = free_free(THIN)
    found = lowest(structure, 18, shift=1e6)
    expected = np.sort(np.concatenate([bending_frequencies(THIN, both_free(10)), along_frequencies(THIN, WHOLES)]))[:12]
    assert np.all(found[:6] < 1e-3 * expected[0])
    np.testing.assert_allclose(found[6:], expected, rtol=1e-8)


@THEORIES
def test_pinned_pinned(made: Uniform) -> None:
    bending = pinned_timoshenko(SHEARED, 10) if made is SHEARED else bending_frequencies(THIN, WHOLES[:10])
    expected = np.sort(np.concatenate([bending, along_frequencies(made, HALVES)]))[:16]
    np.testing.assert_allclose(lowest(pinned_pinned(made), 16), expected, rtol=1e-8)
    # A coarse mesh leads to the same modes, though it is far off in the last ones.
    np.testing.assert_allclose(lowest(pinned_pinned(made), 16, elements=3), expected, rtol=1e-8)


def test_theories_differ_where_they_should() -> None:
    thin, thick = lowest(pinned_pinned(THIN), 8), lowest(pinned_pinned(SHEARED), 8)
    assert np.all(thick < thin * (1 + 1e-9))
    assert thick[6] < 0.98 * thin[6]


@pytest.mark.parametrize(
    ("made", "free", "expected", "orders"),
    [
        (THIN, (1, 5), bending_frequencies(THIN, WHOLES[:1])[0], (4, 4)),
        (THIN, (2, 4), bending_frequencies(THIN, WHOLES[:1])[1], (4, 4)),
        (SHEARED, (1, 5), pinned_timoshenko(SHEARED, 1)[0], (2.8, 2.3)),
        (SHEARED, (2, 4), pinned_timoshenko(SHEARED, 1)[1], (2.4, 2.1)),
        (THIN, (0,), along_frequencies(THIN, HALVES[:1])[0], (2, 2)),
        (THIN, (3,), along_frequencies(THIN, HALVES[:1])[1], (2, 2)),
    ],
    ids=["thin-y", "thin-z", "sheared-y", "sheared-z", "stretching", "torsion"],
)
def test_order_of_the_mesh(made: Uniform, free: tuple[int, ...], expected: float, orders: tuple[float, float]) -> None:
    """Bending converges with the fourth power of the elements' length, stretching and torsion with the second.

    So does what shear adds, since an element has one shear force: at first it hides behind the bending, then it is left.
    """
    others, errors = [i for i in range(6) if i not in free], []
    for elements in (8, 16, 32):
        fine = mesh(pinned_pinned(made), elements)
        frequencies, shapes = eigenmodes(fine, 16)
        middle = np.abs(ALL.T @ fine.rows(3 + elements // 3) @ shapes)
        own = frequencies[middle[list(free)].max(axis=0) > 1e3 * middle[others].max(axis=0)][0]
        errors.append((own / expected) ** 2 - 1)
    assert np.all(np.array(errors) > 0), "a consistent mesh is too stiff"
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), orders, atol=0.1)


def test_rod_between_a_spring_and_a_mass() -> None:
    """u = A sin kx + B cos kx with EA u'(0) = c u(0) and EA u'(L) = omega^2 M u(L)."""
    rate, weight = 5e7, 1.3
    structure = bar(THIN, masses=(NodeMass("tip", FAR, START + LENGTH * AXES[:, 0], weight, np.zeros((3, 3))),))
    structure = dataclasses.replace(structure, connections=(held(2, START, [0], [rate]),))

    def condition(phase: float) -> float:
        k = phase / LENGTH
        a, b = rate, THIN.axial * k
        slope = a * math.cos(phase) - b * math.sin(phase)
        size = a * math.sin(phase) + b * math.cos(phase)
        return (THIN.axial * k * slope - THIN.axial / THIN.mass * k * k * weight * size) / 1e9

    expected = roots(condition, 2) / LENGTH * math.sqrt(THIN.axial / THIN.mass) / (2 * math.pi)
    frequencies, shapes = eigenmodes(mesh(structure, 16), 14)
    stretched = np.abs(AXES[:, 0] @ mesh(structure, 16).rows(FAR)[:3] @ shapes)
    turned = np.abs(mesh(structure, 16).rows(FAR)[3:] @ shapes).max(axis=0)
    exact = exact_frequencies(structure, frequencies)
    np.testing.assert_allclose(exact[stretched > 1e3 * turned], expected, rtol=1e-8)


def test_a_lump_on_a_spring() -> None:
    """A mass beside a hinge with a spring: omega^2 = c / (J + m r^2), and no beam anywhere."""
    rate, weight, arm, inertia = 700.0, 2.0, 0.15, 0.03
    nodes = np.array([np.zeros(3), START])
    lump = NodeMass("lump", FAR, START + AXES @ [arm, 0, 0.4], weight, AXES @ np.diag([1.0, 1.0, inertia]) @ AXES.T)
    structure = Structure(nodes, (), (held(FAR, START, [5], [rate]),), (lump,), 1.0)
    frequencies, _ = eigenmodes(mesh(structure, 1), 1)
    expected = math.sqrt(rate / (inertia + weight * arm**2)) / (2 * math.pi)
    np.testing.assert_allclose(frequencies, [expected], rtol=1e-12)
    np.testing.assert_allclose(exact_frequencies(structure, frequencies * 0.7), [expected], rtol=1e-12)


def test_rigid_loops_are_taken_out() -> None:
    """A block that two hinges in one line and a third rigid tie hold twice over still turns about their line."""
    nodes = np.array([np.zeros(3), START, START + 0.3 * AXES[:, 2], START + 0.1 * AXES[:, 0]])
    ties = (
        held(FAR, START, [5], [700.0]),
        held(2, nodes[2], [2, 5]),
        dataclasses.replace(held(2, nodes[2], ()), first=FAR),
        dataclasses.replace(held(3, nodes[3], ()), first=2),
    )
    lump = NodeMass("lump", 3, nodes[3], 2.0, np.zeros((3, 3)))
    frequencies, _ = eigenmodes(mesh(Structure(nodes, (), ties, (lump,), 1.0), 1), 5)
    np.testing.assert_allclose(frequencies, [math.sqrt(700.0 / (2.0 * 0.1**2)) / (2 * math.pi)], rtol=1e-9)


def test_many_displacements_lead_to_the_same_modes() -> None:
    """Beyond a size the lowest modes are found by iterations, on a sparse matrix."""
    structure = cantilever(THIN)
    fine = mesh(structure, 260)
    assert fine.mass.shape[0] > LARGEST_DENSE
    frequencies, shapes = eigenmodes(fine, 6)
    np.testing.assert_allclose(frequencies, lowest(structure, 6), rtol=1e-7)
    np.testing.assert_allclose(shapes.T @ fine.mass @ shapes, np.eye(6), atol=1e-7)
    np.testing.assert_allclose(np.diag(shapes.T @ fine.stiffness @ shapes), (2 * math.pi * frequencies) ** 2, rtol=1e-5)


@THEORIES
def test_tip_receptance(made: Uniform) -> None:
    """The exact response of a cantilever at its tip, from its transfer matrix, at frequencies where it is cut into many."""
    structure, loss = cantilever(made), 0.03
    frequency = np.array([3.0, 140.0, 2500.0, 21000.0])
    chosen = exact_mesh(structure, 2 * math.pi * frequency[-1])
    assert len(chosen.structure.beams) > 5
    rows = chosen.rows(FAR)
    found = exact_receptance(ExactStructure(chosen), rows, rows, frequency, loss)
    for f, answer in zip(frequency, found, strict=True):
        soft = tip_compliance(made, 2 * math.pi * f, 1 + 1j * loss)
        np.testing.assert_allclose(ALL.T @ answer @ ALL, soft, rtol=0, atol=1e-9 * np.abs(soft).max())


def tip_compliance(made: Uniform, omega: float, elastic: complex, pieces: int = 32) -> np.ndarray:
    """(6, 6): motion of the end of a cantilever from the wrench on it; all states between its pieces solved together."""
    step = scaled(scipy.linalg.expm(state_matrix(made, omega, elastic) * LENGTH / pieces), FORCE)
    size = 12 * (pieces + 1)
    matrix, load = np.zeros((size, size), dtype=complex), np.zeros((size, 6))
    matrix[:6, :6] = np.eye(6)
    for k in range(pieces):
        rows = slice(6 + 12 * k, 18 + 12 * k)
        matrix[rows, 12 * k : 12 * k + 12], matrix[rows, 12 * k + 12 : 12 * k + 24] = step, -np.eye(12)
    matrix[-6:, -6:], load[-6:] = np.eye(6), np.eye(6) / FORCE
    answer: np.ndarray = np.linalg.solve(matrix, load)[-12:-6]
    return answer


def test_direct_response_nears_the_exact_one() -> None:
    structure, frequency, loss = cantilever(SHEARED), np.array([3.0, 140.0, 900.0]), 0.03
    chosen = exact_mesh(structure, 2 * math.pi * frequency[-1])
    rows = chosen.rows(FAR)
    exact = exact_receptance(ExactStructure(chosen), rows, rows, frequency, loss)
    errors = []
    for elements in (8, 16, 32):
        fine = mesh(structure, elements)
        rows = fine.rows(FAR)
        found = direct_receptance(fine, rows, rows, frequency, loss)
        errors.append(np.abs(found[:, :2, :2] - exact[:, :2, :2]).max() / np.abs(exact[:, :2, :2]).max())
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
    assert errors[-1] < 1e-5


def state_matrix(made: Uniform, omega: float, elastic: complex = 1.0) -> np.ndarray:
    """(12, 12): d/dx of the state (v, w, f, m) along a beam, written from equilibrium and Timoshenko's law."""
    matrix = np.zeros((12, 12), dtype=complex)
    v, w, f, m = (np.arange(3) + 3 * k for k in range(4))
    square = omega**2
    stretch = [1 / made.axial, 1 / made.shear_y, 1 / made.shear_z]
    bend = [1 / made.torsion, 1 / made.flexural_y, 1 / made.flexural_z]
    matrix[v, f] = np.array(stretch) / elastic
    matrix[w, m] = np.array(bend) / elastic
    matrix[f, v] = -square * made.mass
    matrix[m, w] = -square * np.array([made.polar, made.rotary_y, made.rotary_z])
    # v' = w x e_x and m' = f x e_x
    matrix[v[1], w[2]], matrix[v[2], w[1]] = 1, -1
    matrix[m[1], f[2]], matrix[m[2], f[1]] = 1, -1
    return matrix


def scaled(matrix: np.ndarray, force: float) -> np.ndarray:
    """A transfer matrix with forces in a unit (N)."""
    by = np.r_[np.ones(6), np.full(6, force)]
    answer: np.ndarray = matrix / by[:, None] * by
    return answer


FORCE = 1e5
"""N, a force that makes the blocks of a transfer matrix alike."""


@THEORIES
@pytest.mark.parametrize("loss", [0.0, 0.05])
@pytest.mark.parametrize("frequency", [0.0, 1e-3, 40.0, 900.0, 20000.0])
def test_transfer_matrix(made: Uniform, frequency: float, loss: float) -> None:
    omega, elastic = 2 * math.pi * frequency, 1 + 1j * loss if loss else 1.0
    length = min(LENGTH, 7.5 / max(float(wave_numbers(made, omega).max()), 1e-9))
    terms = terms_for(8.0)
    found = scaled(np.asarray(transfer_matrix(made, length, jnp.array([omega**2]), elastic, terms))[0], FORCE)
    expected = scaled(scipy.linalg.expm(state_matrix(made, omega, elastic) * length), FORCE)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    assert np.iscomplexobj(found) == bool(loss)
    # What goes in at one end comes out at the other: T^T J T = J.
    turn = np.block([[np.zeros((6, 6)), np.eye(6)], [-np.eye(6), np.zeros((6, 6))]])
    size = np.abs(found).max() ** 2
    np.testing.assert_allclose(found.T @ turn @ found, turn, rtol=0, atol=1e-13 * size)


@THEORIES
def test_transfer_matrix_at_rest_is_the_static_flexibility(made: Uniform) -> None:
    matrix = np.asarray(transfer_matrix(made, LENGTH, jnp.zeros(1), 1.0, 8))[0]
    beam = BeamElement("beam", 0, 1, np.eye(3), np.array(LENGTH), made)
    soft = matrix[:6, 6:] @ np.linalg.inv(matrix[6:, 6:])
    np.testing.assert_allclose(soft, np.linalg.inv(local_stiffness(beam)[6:, 6:]), rtol=1e-12, atol=1e-22)


@THEORIES
def test_a_beam_without_length_changes_nothing(made: Uniform) -> None:
    found = transfer_matrix(made, 0.0, jnp.array([0.0, 1e4, 1e10]), 1 + 0.02j, 16)
    np.testing.assert_array_equal(found, np.broadcast_to(np.eye(12), (3, 12, 12)))


@THEORIES
def test_waves_are_no_shorter_than_said(made: Uniform) -> None:
    for omega in (1.0, 1e3, 1e5, 1e7):
        exponents = np.linalg.eigvals(scaled(state_matrix(made, omega), FORCE / omega))
        across, along = wave_numbers(made, omega)
        greatest = max(float(across), float(along))
        assert np.abs(exponents).max() <= greatest * (1 + 1e-6)
        assert np.abs(exponents).max() > 0.5 * greatest


def section_motions(made: Uniform, x: float) -> np.ndarray:
    """(6, 12): motion of the section at x from those of both ends, of a beam without loads between."""
    matrix = state_matrix(made, 0.0).real
    whole, part = scipy.linalg.expm(matrix * LENGTH), scipy.linalg.expm(matrix * x)
    near = np.linalg.inv(whole[:6, 6:])  # wrench at the near end per motion of the far one
    wrench = np.hstack([-near @ whole[:6, :6], near])
    return part[:6, :6] @ np.eye(6, 12) + part[:6, 6:] @ wrench


@THEORIES
def test_consistent_mass(made: Uniform) -> None:
    """The integral of the static shapes."""
    per_length = np.diag([made.mass] * 3 + [made.polar, made.rotary_y, made.rotary_z])
    places, weights = np.polynomial.legendre.leggauss(8)
    expected = np.zeros((12, 12))
    for place, weight in zip((places + 1) / 2 * LENGTH, weights / 2 * LENGTH, strict=True):
        shape = section_motions(made, place)
        expected += weight * shape.T @ per_length @ shape
    found = local_mass(BeamElement("beam", 0, 1, np.eye(3), np.array(LENGTH), made))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@THEORIES
def test_rigid_mass_of_an_element(made: Uniform) -> None:
    """Moved as a rigid body an element has the mass and the inertia of the rod."""
    rigid = np.vstack([np.eye(6), carry(np.array([LENGTH, 0.0, 0.0]))])
    found = rigid.T @ local_mass(BeamElement("beam", 0, 1, np.eye(3), np.array(LENGTH), made)) @ rigid
    mass = made.mass * LENGTH
    thin = mass * LENGTH**2 / 3
    expected = np.diag([mass] * 3 + [made.polar * LENGTH, thin + made.rotary_y * LENGTH, thin + made.rotary_z * LENGTH])
    expected[1, 5] = expected[5, 1] = mass * LENGTH / 2
    expected[2, 4] = expected[4, 2] = -mass * LENGTH / 2
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


def test_exact_stiffness_and_its_slope() -> None:
    """The derivative with respect to omega^2, and what damping makes of it."""
    structure = cantilever(SHEARED)
    exact = ExactStructure(exact_mesh(structure, 3000.0))
    square = 2500.0**2
    stiffness, mass = exact.real(square)
    step = 1e-4 * square
    slope = (exact.real(square + step)[0] - exact.real(square - step)[0]) / (2 * step)
    np.testing.assert_allclose(mass, -slope, rtol=0, atol=1e-7 * np.abs(mass).max())
    np.testing.assert_allclose(
        exact.damped(np.array([2500.0]), 0.0)[0], stiffness, rtol=0, atol=1e-12 * np.abs(stiffness).max()
    )
    damped = exact.damped(np.array([2500.0]), 0.04)[0]
    assert np.all(np.linalg.eigvalsh(damped.imag) > 0)


def test_elements_by_name() -> None:
    structure = cantilever(THIN)
    beam = structure.beams[0]
    named = dataclasses.replace(structure, beams=(dataclasses.replace(beam, name="leg-1.link"),))
    for elements, count in ((3, 3), ({"link": 4}, 4), ({"leg-1.link": 5, "link": 2}, 5), ({}, 1)):
        fine = divided(named, elements)
        assert len(fine.beams) == count
        np.testing.assert_allclose(sum(float(b.length) for b in fine.beams), LENGTH)
        ends = [fine.nodes[b.second] - fine.nodes[b.first] for b in fine.beams]
        np.testing.assert_allclose(ends, np.tile(LENGTH / count * AXES[:, 0], (count, 1)))
    for elements, message in (
        (0, "expected 1 to"),
        (MOST_ELEMENTS + 1, "expected 1 to"),
        ({"link": 0}, "expected 1 to"),
        ({"lnk": 2}, "no beam is called lnk; there are leg-1.link, link"),
    ):
        with pytest.raises(InputError, match=message):
            divided(named, elements)


def test_many_poses_are_no_mesh() -> None:
    structure = cantilever(THIN)
    with pytest.raises(InputError, match="one pose at a time"):
        divided(dataclasses.replace(structure, nodes=np.stack([structure.nodes] * 2)), 2)


def test_what_has_no_mass_has_no_modes() -> None:
    light = THIN._replace(mass=0.0, polar=0.0)
    with pytest.raises(NoResultError, match="nothing in this structure has a mass"):
        eigenmodes(mesh(cantilever(light), 4), 3)


def test_what_moves_freely_is_named() -> None:
    """A beam on a slide that nothing drives."""
    with pytest.raises(NoResultError, match="freely moves at-2"):
        eigenmodes(mesh(bar(THIN, (2, (0,))), 4), 3)
    with pytest.raises(NoResultError, match="freely moves the platform"):
        eigenmodes(mesh(bar(THIN, (GROUND, ())), 4), 3)


@pytest.mark.parametrize("count", [0, -3])
def test_there_is_no_such_number_of_modes(count: int) -> None:
    with pytest.raises(InputError, match=f"count: {count}; expected at least 1 mode"):
        eigenmodes(mesh(cantilever(THIN), 2), count)
