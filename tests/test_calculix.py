"""Machines of solids as decks for CalculiX: its frequencies beside those of the solids here, equations, elements, files."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from documents import message_of
from machines import changed
from solid_model import frequencies
from solid_model import run as ccx
from step_files import TUBE, step_file

import trivet as t
from trivet.interop.calculix_elements import elements, without_middles
from trivet.interop.calculix_equations import NOTHING, dependence, solved
from trivet.model import catalogue, document_of, load
from trivet.model.section import Rectangle, Rod, Section, Tube
from trivet.solids.bricks import bricks
from trivet.solids.ends import ENDS, Ends, coupling, face, held
from trivet.solids.grid import Grid
from trivet.statics.assembly import PLATFORM, Connection, Structure, assemble
from trivet.statics.structure import carry
from trivet.study.solid_check import SolidCheck
from trivet.vibration.independent import independent

pytestmark = pytest.mark.peer("scikit-fem", module="skfem")
calculix = pytest.mark.peer("CalculiX", program="ccx")
gmsh = pytest.mark.peer("gmsh")

Run = Callable[..., tuple[int, str, str]]
TUBE_OF_AZULAY, BAR = Tube("tube", 0.019, 0.014), Rectangle("rectangle", 0.010, 0.020)
SECTIONS: tuple[Section, ...] = (TUBE_OF_AZULAY, Rod("rod", 0.02), BAR)


@pytest.fixture(scope="module")
def tilted() -> SolidCheck:
    """A machine with springs, joints that weigh, and a platform whose inertia lies across {E}, at a pose without symmetry."""
    azulay = load("azulay").with_theory("timoshenko")
    own = {key: value for key, value in document_of(azulay)["platform"].items() if key != "disc"} | {
        "mass": "0.08 kg",
        "centre_of_mass": ["2 mm", "-1 mm", "5 mm"],
        "inertia": ["8e-6 kg m^2", "9e-6 kg m^2", "14e-6 kg m^2"],
        "products_of_inertia": ["1e-6 kg m^2", "-1e-6 kg m^2", "2e-6 kg m^2"],
    }
    heavy = changed(azulay, {"hinge": {"mass": "0.05 kg", "inertia": ["3e-6 kg m^2"] * 3}}, platform=own)
    return t.solid_check(heavy, position=(0.005, 0.003, 0.12), azimuth=0.4, tilt=0.2, roll=0.1, high=2600.0, points=5)


@pytest.fixture(scope="module")
def printed(tilted: SolidCheck, tmp_path_factory: pytest.TempPathFactory) -> str:
    """What CalculiX makes of it."""
    return ccx(t.to_calculix(tilted), tmp_path_factory.mktemp("ccx"))


@calculix
def test_a_machine_has_the_same_frequencies_there(tilted: SolidCheck, printed: str) -> None:
    """Elements, assembly and solution are those of CalculiX."""
    theirs, ours = frequencies(printed), tilted.solids.natural[:12]
    assert len(theirs) == len(ours) == 12
    np.testing.assert_allclose(ours, theirs, rtol=6e-4)
    np.testing.assert_allclose(ours[:6], theirs[:6], rtol=1.5e-4)


@calculix
def test_the_platform_moves_there_as_here(tilted: SolidCheck, printed: str) -> None:
    """The nodes PLATFORM: the first mode's twist of the platform's centre, in {O}."""
    block = re.search(r"displacements .* set PLATFORM .*\n\n +3 +(\S+) +(\S+) +(\S+)\n +4 +(\S+) +(\S+) +(\S+)\n", printed)
    assert block
    theirs = np.array(block.groups(), dtype=float)
    at = tilted.at
    ours = t.modes(at.machine, at.position, *at.angles, mode=at.mode, count=1).modes.platform[:, 0]
    for own in (slice(0, 3), slice(3, 6)):
        cosine = theirs[own] @ ours[own] / np.linalg.norm(theirs[own]) / np.linalg.norm(ours[own])
        assert abs(cosine) == pytest.approx(1, abs=1e-6)
    lengths = [np.linalg.norm(own[:3]) / np.linalg.norm(own[3:]) for own in (theirs, ours)]
    assert lengths[0] == pytest.approx(lengths[1], rel=5e-3)


@calculix
@gmsh
def test_the_command_and_parts_from_files(trivet: Run, tmp_path: Path) -> None:
    """The links are tetrahedra then, and all that is not named is made from its section."""
    step_file(tmp_path, TUBE, 216, "link.step")
    few = ("--part", "leg.link=link.step", "--to", "700 Hz", "--points", "5", "--fineness", "0.7", "--ends", "mean")
    code, out, err = trivet("solids", "azulay", *few, "--calculix", "azulay.inp", "--json")
    assert code == 0, err
    assert "wrote azulay.inp" in err
    assert [solid["kind_of_elements"] for solid in json.loads(out)["solids"]] == ["tetrahedra", "hexahedra"]
    deck = (tmp_path / "azulay.inp").read_text()
    assert deck.count("TYPE=C3D10") == deck.count("TYPE=C3D20R") == 3
    ours = json.loads(out)["natural_frequencies"]["solids_Hz"]
    folder = tmp_path / "ccx"
    folder.mkdir()
    np.testing.assert_allclose(ours, frequencies(ccx(deck, folder))[: len(ours)], rtol=1e-4)


def test_a_deck_says_what_it_is(tilted: SolidCheck) -> None:
    deck = t.to_calculix(tilted)
    assert deck.startswith("*HEADING\nazulay, solid bodies; by trivet\n** x y z = 5 3 120 mm, alpha beta gamma = 22.9183 ")
    assert "*NSET, NSET=PLATFORM\n3, 4\n" in deck
    assert "*STEP\n*FREQUENCY\n12\n" in deck
    assert max(map(len, deck.splitlines())) < 132
    assert max(len(number) for line in deck.splitlines() if line[0].isdigit() for number in line.split(", ")) <= 20
    masses = [float(found) for found in re.findall(r"\*MASS, ELSET=MASS\d+\n(\S+)", deck)]
    assert 6 * sum(masses) == pytest.approx(0.08 + 3 * 0.05)


def test_beams_cannot_be_in_a_deck() -> None:
    check = t.solid_check("azulay", ["leg.slide"], high=600.0, points=5, fineness=0.7)
    found = message_of(lambda: t.to_calculix(check))
    assert found.startswith("the deck for CalculiX has no beams, and the check has leg-1.link, leg-2.link, leg-3.link;")


def test_files(trivet: Run, tmp_path: Path) -> None:
    """What cannot be written is said before the work, with code 2 and on one line; what is there stays."""
    (tmp_path / "there.inp").write_text("mine")
    for name, message in (
        ("deck.txt", "deck.txt: a deck for CalculiX ends in .inp"),
        ("there.inp", r".*there.inp: exists already; choose another name, or allow overwriting \(--overwrite\)"),
        ("none/deck.inp", r".*deck.inp: cannot be written: No such file or directory"),
    ):
        code, out, err = trivet("solids", "azulay", "--calculix", name)
        assert (code, out) == (2, "")
        assert re.fullmatch(f"trivet: {message}\n", err), err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["there.inp"]
    assert (tmp_path / "there.inp").read_text() == "mine"
    few = ("--to", "600 Hz", "--points", "5", "--fineness", "0.7")
    assert trivet("solids", "alizade", *few, "--calculix", "there.inp", "--overwrite")[0] == 0
    assert (tmp_path / "there.inp").read_text().startswith("*HEADING\nalizade")


def rigid(structure: Structure) -> Structure:
    """The structure with rigid ties in place of its beams, which close loops."""
    none = np.zeros((6, 0))
    ties = [
        Connection(beam.name, beam.first, beam.second, structure.nodes[beam.second], none, np.zeros(0), None, np.zeros(0))
        for beam in structure.beams
    ]
    return dataclasses.replace(structure, beams=(), connections=(*structure.connections, *ties))


STIFF = {"alizade", "glozman"}
"""Machines of which nothing moves without their beams: their balls are rigid, and three freedoms of a chain too few."""


@pytest.mark.parametrize(
    ("name", "loops"), [(name, loops) for name in catalogue() for loops in (False, True) if not (loops and name in STIFF)]
)
def test_displacements_follow_from_those_left_free(name: str, loops: bool) -> None:
    at = t.pose(name)
    structure = assemble(at.machine, at.frame, at.signs)
    structure = rigid(structure) if loops else dataclasses.replace(structure, beams=())
    whole, own = independent(structure).toarray(), dependence(structure)
    assert sorted([*own.fixed, *own.free, *own.rest]) == list(range(len(whole)))
    assert len(own.free) == np.linalg.matrix_rank(whole)
    np.testing.assert_allclose(own.follow @ whole[own.free], whole[own.rest], atol=1e-9)
    assert not np.any(np.abs(whole[own.fixed]) > NOTHING)
    if not loops:
        assert set(range(6 * PLATFORM, 6 * PLATFORM + 6)) <= set(own.free), "the platform keeps its own"


def test_each_equation_is_solved_for_a_freedom_of_its_own() -> None:
    rows = np.random.default_rng(3).normal(size=(5, 12))
    left = np.linalg.svd(rows)[2][len(rows) :].T
    terms = list(solved(rows, 8))
    pivots = [int(own[0]) for own in terms]
    assert len(set(pivots)) == 5
    assert max(pivots) < 8
    np.testing.assert_allclose(rows[:, pivots], np.eye(5), atol=1e-12)
    assert all(not set(own[1:]) & set(pivots) for own in terms)
    np.testing.assert_allclose(rows @ left, 0, atol=1e-12)


@pytest.mark.parametrize("ends", ENDS)
def test_equations_of_ends_leave_what_ends_leave(ends: Ends) -> None:
    grid = bricks("link", BAR, 0.06, 1.0)
    points, free = coupling(grid, ends)
    for at, point in ((0.0, slice(0, 6)), (grid.length, slice(6, 12))):
        own = face(grid, at)
        dofs = (3 * own.nodes[:, None] + np.arange(3)).ravel()
        rates = held(own, ends)
        np.testing.assert_allclose(rates @ free.toarray()[dofs], 0, atol=1e-12)
        np.testing.assert_allclose(points.toarray()[dofs][:, point], carry(own.arms)[:, :3].reshape(-1, 6), atol=1e-15)
        assert np.linalg.matrix_rank(rates) == len(rates) == 3 * len(own.nodes) - np.linalg.matrix_rank(free.toarray()[dofs])


@pytest.mark.parametrize("section", SECTIONS, ids=lambda s: s.shape)
def test_bricks_without_middles(section: Section) -> None:
    """Corners and middles of edges lie as CalculiX has them, and end faces keep area and moments."""
    grid: Grid = bricks("link", section, 0.06, 1.0)
    own = elements(grid)
    assert own.type == "C3D20R"
    at = grid.points[:, own.nodes].T[own.corners]  # (e, 20, 3)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    straight = np.stack([(at[:, a] + at[:, b]) / 2 for a, b in edges], axis=1)
    assert np.abs(at[:, 8:] - straight).max() < (1e-12 if section is BAR else 4e-4)
    sides = (at[:, k] - at[:, 0] for k in (1, 3, 4))
    assert np.all(np.einsum("ei,ei->e", np.cross(next(sides), next(sides)), next(sides)) > 0), "right-handed"
    for x in (0.0, grid.length):
        before = face(grid, x)
        after = without_middles(grid, before)
        assert set(after.nodes) <= set(own.nodes)
        assert len(after.nodes) < len(before.nodes)
        assert after.area == pytest.approx(before.area, rel=1e-12)
        np.testing.assert_allclose(after.moments.sum(axis=0), before.moments.sum(axis=0), atol=1e-15)
        # A face that turns about the axis turns by as much, but for how far curved edges leave their middles.
        turns = [np.cross(one.arms, one.moments)[:, 0].sum() for one in (before, after)]
        twice = [np.einsum("fi,fi->", one.arms, one.moments) for one in (before, after)]
        assert turns == pytest.approx([0, 0], abs=1e-15)
        assert twice[1] == pytest.approx(twice[0], rel=1e-12 if section is BAR else 2e-3)
