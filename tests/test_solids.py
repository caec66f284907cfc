"""Solids: meshes, elasticity, ends, reduction, and their place in a machine."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
import scipy.sparse as sp
import scipy.sparse.linalg
from documents import message_of
from machines import changed
from solid_model import Mesh as Bricks
from solid_model import Model, Tripod, frequencies, frequency_deck, run
from step_files import AHEAD, BAR, EYES, FACE, HOLES, ROUND, TUBE, TWO, step_file

import trivet as t
from trivet.errors import NoResultError
from trivet.model import Machine, load
from trivet.model.elements import Profile, Stock
from trivet.model.section import General, Material, Rectangle, Rod, Section, Tube
from trivet.solids import bricks as bricks_module
from trivet.solids import ends as ends_module
from trivet.solids import step, tetrahedra
from trivet.solids.bricks import bricks
from trivet.solids.elasticity import elastic
from trivet.solids.ends import Ends, coupling
from trivet.solids.grid import Grid
from trivet.solids.pairing import Shapes, divided_alike, pairs, shapes
from trivet.solids.parts import put_in, solids, wanted
from trivet.solids.reduction import Reduced, reduced
from trivet.statics.assembly import PLATFORM, assemble
from trivet.statics.beam_element import BeamElement, Uniform, local_stiffness, uniform
from trivet.statics.structure import carry
from trivet.vibration.bodies import Body
from trivet.vibration.mesh import Mesh, mesh
from trivet.vibration.modes import Modes, eigenmodes, held_modes
from trivet.vibration.response import direct_receptance
from trivet.vibration.ritz import ritz

pytestmark = pytest.mark.peer("scikit-fem", module="skfem")
gmsh = pytest.mark.peer("gmsh")
calculix = pytest.mark.peer("CalculiX", program="ccx")

STEEL = Material(205e9, 0.29, 7870.0)
TUBE_OF_AZULAY, BAR_OF_TESTS = Tube("tube", 0.019, 0.014), Rectangle("rectangle", 0.010, 0.020)
SECTIONS: tuple[Section, ...] = (TUBE_OF_AZULAY, Rod("rod", 0.02), BAR_OF_TESTS)
LENGTH = 0.216
HIGH = 3000.0


def made_of(section: Section) -> Uniform:
    return uniform(Profile("own", "steel"), Stock({"own": section}, {"steel": STEEL}, "timoshenko", True)).numbers()


@cache
def solid(section: Section, length: float = LENGTH, fineness: float = 1.0, ends: Ends = "plane") -> Reduced:
    return reduced(bricks("link", section, length, fineness), STEEL, HIGH, ends)


def cantilever(body: Reduced) -> np.ndarray:
    """Natural frequencies with the near end held, Hz."""
    squares = scipy.linalg.eigh(body.stiffness[6:, 6:], body.mass[6:, 6:], eigvals_only=True)
    found: np.ndarray = np.sqrt(squares) / (2 * np.pi)
    return found


def bending_of_a_cantilever(made: Uniform, length: float, count: int) -> list[float]:
    """Of a Timoshenko beam (Hz): zeros of the determinant of what its held end may bear, by the matrix exponential."""
    e, g, m, r = float(made.flexural_z), float(made.shear_y), float(made.mass), float(made.rotary_z)

    def determinant(frequency: float) -> float:
        square = (2 * np.pi * frequency) ** 2
        # d/dx of deflection, turn, moment, shear force.
        slope = np.array([[0, 1, 0, 1 / g], [0, 0, 1 / e, 0], [0, -r * square, 0, -1], [-m * square, 0, 0, 0]])
        free = scipy.linalg.expm(length * slope)[2:, 2:]
        return float(np.linalg.det(free))

    steps = np.linspace(10, 20000, 4000)
    values = [determinant(f) for f in steps]
    found = [k for k in range(len(steps) - 1) if values[k] * values[k + 1] < 0][:count]
    return [float(scipy.optimize.brentq(determinant, steps[k], steps[k + 1])) for k in found]


@pytest.mark.parametrize("section", SECTIONS, ids=lambda s: s.shape)
def test_weight(section: Section) -> None:
    """Mass, centre and inertia of the mesh are those of the body; of circles but for their twelve curved sides."""
    body, made = solid(section), made_of(section)
    mass = float(made.mass) * LENGTH
    across = mass * LENGTH**2 / 12
    inertia = np.diag([made.polar * LENGTH, made.rotary_y * LENGTH + across, made.rotary_z * LENGTH + across])
    rtol = 1e-12 if section is BAR_OF_TESTS else 4e-4
    assert body.weight == pytest.approx(mass, rel=rtol)
    np.testing.assert_allclose(body.centre, [LENGTH / 2, 0, 0], atol=1e-12)
    np.testing.assert_allclose(body.inertia, inertia, rtol=rtol, atol=1e-12 * mass * LENGTH**2)


def test_matrices_are_those_of_scikit_fem() -> None:
    """Its own weak forms, assembled by itself."""
    import skfem
    from skfem.helpers import ddot, dot, sym_grad, trace

    grid = bricks("link", Rod("rod", 0.02), 0.02, 0.5)
    shear, nu = STEEL.shear_modulus, STEEL.poisson_ratio
    lame = 2 * shear * nu / (1 - 2 * nu)

    @skfem.BilinearForm
    def strain(u: Any, v: Any, _: Any) -> Any:
        return lame * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * shear * ddot(sym_grad(u), sym_grad(v))

    @skfem.BilinearForm
    def inertia(u: Any, v: Any, _: Any) -> Any:
        return STEEL.density * dot(u, v)

    scalar = skfem.Basis(grid.mesh, grid.mesh.elem())
    vector = skfem.Basis(grid.mesh, skfem.ElementVector(grid.mesh.elem()), intorder=5)
    # Its vector element has the three components of a node one after the other wherever the node lies.
    order = np.zeros(3 * scalar.N, dtype=int)
    for k, nodes in enumerate(scalar.element_dofs):
        for axis in range(3):
            order[3 * nodes + axis] = vector.element_dofs[3 * k + axis]
    ours = elastic(grid, STEEL)
    for matrix, form in zip(ours, (strain, inertia), strict=True):
        theirs = form.assemble(vector)[order][:, order]
        assert abs(matrix - theirs).max() < 1e-12 * abs(theirs).max()


@pytest.mark.parametrize("ends", ends_module.ENDS)
def test_rigid_motions_are_free(ends: Ends) -> None:
    """Six zeros, of the whole mesh to rounding and of the reduced body too; and then none."""
    grid = solid(BAR_OF_TESTS).grid
    points, free = coupling(grid, ends)
    of_nodes = carry(grid.points.T)[:, :3].reshape(-1, 6)
    of_points = np.vstack([np.eye(6), carry(np.array([LENGTH, 0, 0]))])
    stiffness = elastic(grid, STEEL).stiffness
    assert abs(stiffness @ of_nodes).max() < 1e-11 * abs(stiffness).max()
    on_ends = np.repeat((grid.points[0] == 0) | (grid.points[0] == LENGTH), 3)
    np.testing.assert_allclose((points @ of_points)[on_ends], of_nodes[on_ends], atol=1e-12)
    held = {"plane": 45 + 3, "rigid": 135, "mean": 6}[ends]  # of 45 nodes on a face
    assert free.shape[1] == 3 * grid.points.shape[1] - 2 * held
    body = solid(BAR_OF_TESTS, ends=ends)
    scale = np.repeat([1, 1 / LENGTH, 1, 1 / LENGTH], 3)
    statics = scale[:, None] * body.stiffness[:12, :12] * scale
    assert abs(statics @ (of_points / scale[:, None])).max() < 1e-14 * abs(statics).max()
    found = np.sqrt(np.abs(scipy.linalg.eigh(body.stiffness, body.mass, eigvals_only=True))) / (2 * np.pi)
    assert np.all(found[:6] < 1e-2)
    assert found[6] > 1000


@pytest.mark.parametrize("section", SECTIONS, ids=lambda s: s.shape)
def test_a_cantilever_bends_as_a_timoshenko_beam(section: Section) -> None:
    body, made = solid(section, 0.4), made_of(section)
    expected = bending_of_a_cantilever(made, 0.4, 3)
    found = cantilever(body)
    for frequency in expected:
        assert abs(found / frequency - 1).min() < 2.5e-3
    stretched = np.sqrt(float(made.axial) / float(made.mass)) / (4 * 0.4)
    assert abs(found / stretched - 1).min() < 1e-3
    if section is not BAR_OF_TESTS:  # a bar's ends, which stay plane, hold warping back
        twisted = np.sqrt(float(made.torsion) / float(made.polar)) / (4 * 0.4)
        assert abs(found / twisted - 1).min() < 1e-3


def test_finer_meshes_converge(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the fourth power of the size, as eigenvalues on elements of second order do where all elements shrink alike."""
    monkeypatch.setattr(bricks_module, "_stations", lambda length, size: np.linspace(0, length, round(2 * length / size) + 1))
    first = []
    for fineness in (0.5, 1.0, 2.0):
        own = elastic(bricks("link", BAR_OF_TESTS, 0.0565685, fineness), STEEL)
        squares = scipy.sparse.linalg.eigsh(own.stiffness, 7, own.mass, sigma=-1e6, return_eigenvectors=False)
        first.append(np.sqrt(squares.max()) / (2 * np.pi))
    assert 11 < (first[0] - first[1]) / (first[1] - first[2]) < 20
    assert 0 < first[1] / first[2] - 1 < 1e-3


def test_ends_decide_as_much_as_theory() -> None:
    """Rigid ends are stiffer than plane ones, those that may warp softer; as CalculiX has it."""
    first = {ends: cantilever(solid(TUBE_OF_AZULAY, 0.08, ends=ends))[0] for ends in ends_module.ENDS}
    assert 1e-3 < first["rigid"] / first["plane"] - 1 < 2e-2
    assert 1e-4 < 1 - first["mean"] / first["plane"] < 2e-2


@cache
def whole() -> tuple[Grid, sp.csc_matrix, sp.csc_matrix, int]:
    """A short tube with its near end held: matrices of all that is free, the far end's six first."""
    grid = bricks("link", TUBE_OF_AZULAY, 0.06, 1.0)
    own = elastic(grid, STEEL)
    points, free = coupling(grid, "plane")
    all_free = sp.csc_matrix(sp.hstack([points[:, 6:], free]))
    stiffness, mass = (sp.csc_matrix(all_free.T @ m @ all_free) for m in own)
    return grid, stiffness, mass, all_free.shape[1]


def test_reduction_keeps_statics() -> None:
    grid, stiffness, _, size = whole()
    body = reduced(grid, STEEL, 4000.0)
    load = np.zeros((size, 6))
    load[:6] = np.eye(6)
    exact = scipy.sparse.linalg.spsolve(stiffness, load)[:6]
    np.testing.assert_allclose(np.linalg.inv(body.stiffness[6:12, 6:12]), exact, rtol=1e-7, atol=1e-9 * abs(exact).max())
    assert not np.any(body.stiffness[:12, 12:])


def test_reduction_keeps_frequencies() -> None:
    """Up to the highest frequency that was asked for, and well beyond."""
    grid, stiffness, mass, _ = whole()
    squares = scipy.sparse.linalg.eigsh(stiffness, 8, mass, sigma=0.0, return_eigenvectors=False)
    exact = np.sqrt(np.sort(squares)) / (2 * np.pi)
    body = reduced(grid, STEEL, 4000.0)
    found = cantilever(body)[:8]
    assert np.all(found > exact * (1 - 1e-7)), "a Ritz value is no less than the eigenvalue"
    np.testing.assert_allclose(found[exact < 8000], exact[exact < 8000], rtol=2e-4)
    assert found[0] == pytest.approx(found[1], rel=1e-9), "a pair stays one"
    assert body.cut_off == 32000.0
    more = reduced(grid, STEEL, 16000.0)
    assert np.all(more.modes < more.cut_off)
    assert len(more.modes) > len(body.modes)
    np.testing.assert_allclose(more.modes[: len(body.modes)], body.modes, rtol=1e-8)


def test_the_axis_moves_as_that_of_a_beam() -> None:
    """With the ends as one body, and in the arc to which opposite turns of the ends bend it."""
    body = solid(BAR_OF_TESTS)
    ends = np.vstack([np.eye(6), carry(np.array([LENGTH, 0, 0]))])
    places = np.concatenate([carry(np.array([place * LENGTH, 0, 0])) for place in (0.25, 0.5, 0.75)])
    np.testing.assert_allclose(body.axis[:, :12] @ ends, places, atol=1e-9)
    for axis, way, sign in ((5, 1, 1), (4, 2, -1)):
        turned = body.axis[:, axis] - body.axis[:, 6 + axis]
        arc = sign * LENGTH * np.array([3 / 16, 1 / 4, 3 / 16])
        np.testing.assert_allclose(turned[way::6], arc, rtol=2e-2)
        np.testing.assert_allclose(turned[axis::6], [0.5, 0, -0.5], atol=1e-2)


def test_modes_are_paired_by_their_shapes() -> None:
    """Whatever their order; a pair that coincides is known in any mixture of its modes."""
    machine = machine_of_beams()
    at = t.pose(machine)
    structure = assemble(machine, at.frame, at.signs)
    first = shapes("azulay", structure, mesh(structure, divided_alike(structure, 2e4, 0.4)), 8)
    assert first.frequency[1] == pytest.approx(first.frequency[0], rel=1e-8)
    mixed = first.motion.copy()
    mixed[:, :2] = first.motion[:, :2] @ np.array([[0.8, -0.6], [0.6, 0.8]]) * [1, -3]
    frequency = np.array([50.0, 60.0, 60.0, 70.0, 80.0, 90.0, 100.0, 110.0])
    order = [2, 0, 1, 7, 3, 6, 4, 5]
    found = pairs(structure, first, Shapes(frequency, mixed[:, order]))
    assert found.second.tolist() == [1, 2, 0, 4, 6, 7, 3, 5], "4 and 5 coincide, and 6 and 7"
    np.testing.assert_allclose(found.mac, 1, atol=1e-9)
    fewer = pairs(structure, first, Shapes(frequency[3:], mixed[:, order[3:]]))
    assert fewer.first.tolist() == [3, 4, 5, 6, 7]
    apart = pairs(structure, first, Shapes(np.arange(1.0, 9.0), mixed[:, order]))
    assert apart.second.tolist() == found.second.tolist()


def test_a_body_is_the_same_whichever_way_it_points() -> None:
    body = solid(BAR_OF_TESTS)
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    placed = Body("link", 0, 1, turn, body.stiffness, body.mass, None)
    stiffness, mass = placed.in_world(body.stiffness), placed.in_world(body.mass)
    values = [scipy.linalg.eigh(k, m, eigvals_only=True)[6:] for k, m in ((stiffness, mass), (body.stiffness, body.mass))]
    np.testing.assert_allclose(*values, rtol=1e-8)
    along = np.r_[turn[:, 0], np.zeros(3), np.zeros(6 + len(body.modes))]  # the near end along the axis
    assert along @ stiffness @ along == pytest.approx(body.stiffness[0, 0])


@cache
def machine_of_beams(theory: str = "timoshenko") -> Machine:
    return load("azulay").with_spherical("free").with_theory(theory).with_rigid_drives()  # type: ignore[arg-type]


def test_slender_solids_make_the_machine_of_beams() -> None:
    slim = changed(machine_of_beams(), sections={"tube": {"shape": "tube", "outer_diameter": "8 mm", "inner_diameter": "5 mm"}})
    check = t.solid_check(slim, ["leg.link"], high=1500.0, points=20)
    assert [solid.names for solid in check.parts] == [("leg-1.link", "leg-2.link", "leg-3.link")]
    assert len(check.beams.natural) > 8
    np.testing.assert_allclose(check.solids.natural, check.beams.natural, rtol=1.5e-3)
    assert np.max(np.abs(check.mesh_error)) < 1e-3
    assert np.all((check.mac > 0.9995) & (check.mac <= 1))
    for solids_, beams in zip(check.solids.minima, check.beams.minima, strict=True):
        assert solids_.stiffness == pytest.approx(beams.stiffness, rel=5e-3)


@cache
def placed() -> Mesh:
    """The machine at home with all beams as solids."""
    machine = machine_of_beams()
    at = t.pose(machine)
    structure = assemble(machine, at.frame, at.signs)
    made = solids(machine, structure, wanted(machine, structure, None), HIGH, 2 / 3, "plane")
    rest, bodies = put_in(machine, structure, made)
    assert not rest.beams
    return mesh(rest, 1, bodies)


def test_modes_of_a_machine_with_solids() -> None:
    found = placed()
    assert len(found.bodies) == 6
    modes = Modes(found.structure, found, *eigenmodes(found, 12))
    np.testing.assert_array_equal(modes.frequency, modes.mesh_frequency)
    shares = modes.strain_shares
    assert {"leg-1.slide", "leg-1.link", "leg-3.link"} <= set(shares)
    np.testing.assert_allclose(sum(shares.values()), 1.0, rtol=1e-9)
    energy = np.einsum("im,im->m", modes.shapes, found.stiffness @ modes.shapes)
    np.testing.assert_allclose(energy, (2 * np.pi * modes.frequency) ** 2, rtol=1e-8)
    solid_links = shares["leg-1.link"] + shares["leg-2.link"] + shares["leg-3.link"]
    assert solid_links[0] == pytest.approx(0.69, abs=0.02)  # as of beams, see docs/vibration.md


def test_receptances_are_reciprocal_and_those_of_the_whole_mesh() -> None:
    found = placed()
    rows = found.rows(PLATFORM)
    frequency = np.array([20.0, 115.0, 900.0, 2600.0])
    small = ritz("azulay", found, rows, HIGH).receptance(frequency, 0.02)
    direct = direct_receptance(found, rows, rows, frequency, 0.02)
    scale = np.sqrt(np.abs(np.einsum("nii->ni", direct)))
    off = np.abs(small - direct) / (scale[:, :, None] * scale[:, None, :])
    assert off.max() < 2e-5
    asymmetry = np.abs(direct - direct.transpose(0, 2, 1)) / (scale[:, :, None] * scale[:, None, :])
    assert asymmetry.max() < 1e-9


def test_a_loose_joint_is_named_with_solids_too() -> None:
    machine = changed(load("azulay").with_spherical("free"), {"slide": {"actuated": False, "stiffness": None}})
    at = t.pose(machine)
    structure = assemble(machine, at.frame, at.signs)
    rest, bodies = put_in(
        machine, structure, solids(machine, structure, wanted(machine, structure, ["leg.link"]), 500.0, 0.5, "plane")
    )
    with pytest.raises(NoResultError, match=r"leg-\d.slide"):
        held_modes(machine.name, mesh(rest, 2, bodies), 4)


@calculix
def test_machine_of_solids_in_calculix(tmp_path: Path) -> None:
    """The same machine, ends and all, by other elements of another program."""
    theirs = frequencies(run(frequency_deck(Model(Tripod(), Bricks(1, 16, 4, 28)), 12), tmp_path))
    check = t.solid_check(machine_of_beams(), position=(0, 0, Tripod().height), high=3300.0, points=10)
    np.testing.assert_allclose(check.solids.natural[:12], theirs, rtol=1.5e-3)
    np.testing.assert_allclose(check.solids.natural[:3], theirs[:3], rtol=2e-4)


@gmsh
@pytest.mark.parametrize(("section", "what"), [(TUBE_OF_AZULAY, TUBE), (BAR_OF_TESTS, BAR)], ids=["tube", "bar"])
def test_a_file_is_the_section_that_it_shows(section: Section, what: str, tmp_path: Path) -> None:
    """Unit, axis, and which way y and z point."""
    grid = step.from_step("leg.link", step_file(tmp_path, what, 80), 0.080, 0.7)
    assert grid.kind == "tetrahedra"
    assert grid.length == pytest.approx(0.080, rel=1e-9)
    of_file, of_section = reduced(grid, STEEL, 2000.0), reduced(bricks("link", section, 0.08, 1.0), STEEL, 2000.0)
    assert of_file.weight == pytest.approx(of_section.weight, rel=1e-3)
    np.testing.assert_allclose(of_file.centre, of_section.centre, atol=2e-5)
    # Its coarse tetrahedra hold warping back, in torsion, at an end that stays plane.
    np.testing.assert_allclose(np.diag(of_file.stiffness)[:12], np.diag(of_section.stiffness)[:12], rtol=3e-2)
    np.testing.assert_allclose(of_file.stiffness[[1, 2], [5, 4]], of_section.stiffness[[1, 2], [5, 4]], rtol=1e-2)
    np.testing.assert_allclose(cantilever(of_file)[:3], cantilever(of_section)[:3], rtol=6e-3)
    made = local_stiffness(BeamElement("", 0, 1, np.eye(3), np.asarray(0.08), made_of(section)))
    np.testing.assert_allclose(np.diag(of_file.stiffness)[[0, 1, 2, 4, 5]], np.diag(made)[[0, 1, 2, 4, 5]], rtol=4e-2)


@gmsh
def test_a_link_with_eyes(tmp_path: Path) -> None:
    grid = step.from_step("leg.link", step_file(tmp_path, EYES, 120), 0.120, 0.8)
    body, bar = reduced(grid, STEEL, 2000.0), reduced(bricks("link", BAR_OF_TESTS, 0.12, 1.0), STEEL, 2000.0)
    assert bar.weight - body.weight == pytest.approx(7870 * 2 * np.pi * 0.006**2 * 0.010, rel=2e-3)
    np.testing.assert_allclose(body.centre, [0.06, 0, 0], atol=1e-5)
    assert 0.7 < body.stiffness[0, 0] / bar.stiffness[0, 0] < 0.92
    # An eye hardly weakens bending about its own axis (y), in the middle of the section, and weakens that across it by more.
    weaker = np.diag(body.stiffness)[4:6] / np.diag(bar.stiffness)[4:6]
    assert weaker[0] > weaker[1] + 0.05


def folder_of(what: str | None, folder: Path, text: str | bytes = "") -> str:
    if what is not None:
        return step_file(folder, what, 216)
    path = folder / "part.step"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return str(path)


@gmsh
@pytest.mark.parametrize(
    ("what", "text", "message"),
    [
        (None, "", "expected more than nothing"),
        (None, "solid tube\n", "cannot be read as a STEP file|has no solid"),
        (None, bytes(range(256)) * 20, "cannot be read as a STEP file|has no solid"),
        (FACE, "", "has no solid"),
        (TWO, "", "has 2 solids"),
        (ROUND, "", "has no flat face across x at its near end, x = -?0 mm"),
        (AHEAD, "", "begins at x = -20 mm"),
    ],
)
def test_files_that_are_no_parts(what: str | None, text: str | bytes, message: str, tmp_path: Path) -> None:
    file = folder_of(what, tmp_path, text)
    found = message_of(lambda: step.from_step("leg.link", file, 0.216, 0.5))
    assert found.startswith(file)
    assert re.search(message, found), found


@gmsh
def test_lengths_and_units_of_files(tmp_path: Path) -> None:
    file = step_file(tmp_path, BAR, 200)
    found = message_of(lambda: step.from_step("leg-1.link", file, 0.216, 0.5))
    assert "the part is 200 mm long, leg-1.link 216 mm at this pose; they may differ by 0.1 %" in found
    text = Path(file).read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    Path(file).write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"))
    assert "the part is 2000 mm long" in message_of(lambda: step.from_step("leg-1.link", file, 0.216, 0.5))


def test_names_of_files(tmp_path: Path) -> None:
    assert "cannot be read: No such file" in message_of(lambda: step.from_step("l", str(tmp_path / "none.step"), 0.2, 1.0))
    (tmp_path / "a.stl").write_text("x")
    assert "a part is a STEP file, .step or .stp" in message_of(lambda: step.from_step("l", str(tmp_path / "a.stl"), 0.2, 1.0))
    (tmp_path / "b.step").mkdir()
    assert "is no file" in message_of(lambda: step.from_step("l", str(tmp_path / "b.step"), 0.2, 1.0))


def test_gmsh_that_breaks_down_or_never_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = folder_of(None, tmp_path, "ISO-10303-21;")

    def crash(*_: Any, **__: Any) -> Any:
        return subprocess.CompletedProcess([], -11, "", "Segmentation fault")

    monkeypatch.setattr(step.subprocess, "run", crash)
    assert "gmsh broke down over it (exit code -11)" in message_of(lambda: step.from_step("l", file, 0.2, 1.0))
    monkeypatch.undo()
    monkeypatch.setattr(step, "LONGEST", 0.05)
    assert "no mesh within 0.05 s" in message_of(lambda: step.from_step("l", file, 0.2, 1.0))


@gmsh
def test_meshes_that_gmsh_must_not_make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Too many nodes by the volume; by the surface, of which small holes need many; more memory than there may be."""
    file = step_file(tmp_path, TUBE, 216)
    remedy = r"at most 15,000, give a coarser mesh \(--fineness\) or a simpler part$"
    found = message_of(lambda: step.from_step("l", file, 0.216, 4.0))
    assert re.match(rf"{file}: takes 42\d,\d\d\d nodes or more, with elements of 0.927 mm; {remedy}", found), found
    holes = step_file(tmp_path, HOLES, 216, "holes.step")
    found = message_of(lambda: step.from_step("l", holes, 0.216, 1.0))
    assert re.match(rf"{holes}: takes [3-9]\d,\d\d\d nodes or more, with elements of 9.\d* mm; {remedy}", found), found
    monkeypatch.setattr(step, "MOST_MEMORY", 100_000_000)
    found = message_of(lambda: step.from_step("l", file, 0.216, 1.0))
    assert found == (f"{file}: meshing takes more than 0.1 GB of memory; give a coarser mesh (--fineness) or a simpler part")


def test_memory_that_runs_out_under_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever library says so, and however it ends."""
    file = folder_of(None, tmp_path, "ISO-10303-21;")
    for code, out, err in (
        (2, "cannot be meshed: Out of memory in boundary mesh recovery", ""),
        (-6, "", "[0]PETSC ERROR: Out of memory. This could be due to allocating"),
        (-6, "", "terminate called after throwing an instance of 'std::bad_alloc'"),
        (1, "", "numpy._core._exceptions._ArrayMemoryError: Unable to allocate"),
    ):
        done = subprocess.CompletedProcess([], code, out, err)
        monkeypatch.setattr(step.subprocess, "run", lambda *_, own=done, **__: own)
        found = message_of(lambda: step.from_step("l", file, 0.2, 1.0))
        assert found.startswith(f"{file}: meshing takes more than 4 GB of memory;"), found


def test_a_missing_extra(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "skfem", None)
    wanted_ = "solids need scikit-fem; install it with: pip install 'trivet[solids]'"
    assert message_of(lambda: bricks("link", BAR_OF_TESTS, 0.2, 1.0)) == wanted_
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(tetrahedra.CannotError, match=r"pip install 'trivet\[solids\]'"):
        tetrahedra.loaded()
    monkeypatch.delitem(sys.modules, "gmsh")
    (tmp_path / "gmsh.py").write_text('raise OSError("libGLU.so.1: cannot open shared object file: No such file or directory")')
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(
        tetrahedra.CannotError, match=r"libGLU.so.1: .*; install it, on Debian with: apt-get install libglu1-mesa"
    ):
        tetrahedra.loaded()


def test_parts_that_are_not_there() -> None:
    def asked(*parts: str) -> str:
        return message_of(lambda: t.solid_check("azulay", parts, points=2))

    assert asked("leg.lnk").startswith("part leg.lnk: not known; did you mean 'leg.link'")
    assert asked("leg.hinge").startswith("part leg.hinge: is no beam, or has no length at this pose")
    assert asked("platform").startswith("part platform: is no beam")
    assert asked("leg.link", "leg-1.link") == "part leg-1.link: given twice"
    assert asked() == "parts: none is named"


def test_numbers_out_of_range() -> None:
    def asked(**changes: Any) -> str:
        return message_of(lambda: t.solid_check("azulay", **changes))

    assert asked(ends="plain") == "ends 'plain' is not known; did you mean 'plane'?"
    assert asked(fineness=9.0) == "fineness: 9; expected 0.5 to 4"
    assert asked(low=10.0, high=5.0).startswith("frequencies: 10 Hz to 5 Hz")
    assert asked(loss_factor=2.0).startswith("loss factor: 2; expected")
    assert asked(points=1).startswith("points: 1; expected 2")


def test_sections_without_a_shape() -> None:
    general = General("general", 1e-4, 1e-9, 1e-9, 2e-9)
    found = message_of(lambda: bricks("leg-1.link", general, 0.2, 1.0))
    assert found.startswith("leg-1.link: its section is given by its numbers and has no shape; give a solid as a file")


def test_meshes_that_are_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "too many for a mesh of" in message_of(lambda: bricks("link", Rod("rod", 0.001), 2.0, 1.0))
    monkeypatch.setattr(ends_module, "MOST_ON_FACE", 10)
    found = message_of(lambda: coupling(bricks("link", BAR_OF_TESTS, 0.05, 1.0), "plane"))
    assert "nodes on an end face; at most 10" in found
    monkeypatch.setattr(bricks_module, "MOST_NODES", 100)
    assert "at most" in found


def test_elements_inside_out() -> None:
    grid = bricks("link", BAR_OF_TESTS, 0.05, 1.0)
    grid.mesh.doflocs[0, grid.mesh.t[0, 0]] += 0.1
    assert "elements turned inside out" in message_of(lambda: elastic(grid, STEEL))


def test_a_solid_without_mass_has_no_modes() -> None:
    body = reduced(bricks("link", BAR_OF_TESTS, 0.1, 1.0), Material(205e9, 0.29, 0.0), HIGH)
    assert body.mass.shape == (12, 12)
    assert not body.mass.any()
    assert body.weight == 0
    with_mass = reduced(bricks("link", BAR_OF_TESTS, 0.1, 1.0), STEEL, HIGH)
    np.testing.assert_allclose(body.stiffness, with_mass.stiffness[:12, :12], rtol=1e-9, atol=1e-6 * abs(body.stiffness).max())
