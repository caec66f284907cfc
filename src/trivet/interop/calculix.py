"""CalculiX: a machine of solid bodies as an input deck of its finite-element program, ccx, for its natural frequencies.

Every node of the machine's structure is two nodes of the deck, whose displacements are its displacement and its rotation, and
every screw along which a joint yields is a node more, whose first displacement is its deflection.  What joints and rigid parts
make of these are equations, and so is how end faces follow their nodes; drives and stiff joints are springs on deflections;
rigid masses are points with the same inertia.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from trivet.errors import InputError
from trivet.files import replacing
from trivet.interop.calculix_elements import elements, without_middles
from trivet.interop.calculix_equations import Freedom, dependence, equation, solved
from trivet.model import Machine
from trivet.model.section import Material
from trivet.solids.ends import face, held
from trivet.solids.parts import Solid, profiles, put_in
from trivet.statics.assembly import PLATFORM, NodeMass, Structure, assemble
from trivet.statics.structure import carry
from trivet.study.solid_check import SolidCheck
from trivet.vibration.bodies import Body
from trivet.vibration.mesh import divided

MODES = 12
"""How many the deck asks for."""
PER_LINE = 10
"""Numbers of nodes on a line."""

_NOTES = (
    "SI units: m, N, kg, s, rad; axes of {O}. Run: ccx FILE, without .inp; frequencies in FILE.dat, shapes in FILE.frd.",
    "Of the two nodes PLATFORM the first has the displacement of the platform's centre, the second its rotation.",
    "Natural frequencies without damping; what of a rod its guide hides takes no part.",
)


@dataclass
class _Deck:
    """A deck while it is put together."""

    structure: Structure
    nodes: list[np.ndarray] = field(default_factory=list)
    """(k, 3) m, numbered as they come, from 1."""
    count: int = 0
    elements: int = 0
    parts: list[str] = field(default_factory=list)
    equations: list[str] = field(default_factory=list)

    def add(self, points: np.ndarray) -> int:
        """Add nodes (k, 3); returns the number of the first."""
        self.nodes.append(points)
        self.count += len(points)
        return self.count - len(points) + 1

    def element(self, kind: str, name: str, corners: Iterable[Sequence[int]]) -> None:
        """Add a set of elements by the numbers of their nodes."""
        self.parts.append(f"*ELEMENT, TYPE={kind}, ELSET={name}")
        for own in corners:
            self.elements += 1
            self.parts += _lines([self.elements, *own])

    def tie(self, rows: np.ndarray, freedoms: list[Freedom], dependent: int) -> None:
        """Make rows times freedoms zero, each solved for one of the first `dependent`."""
        for row, terms in zip(rows, solved(rows, dependent), strict=True):
            self.equations += equation([freedoms[k] for k in terms], row[terms])

    def of_structure(self, number: int) -> Freedom:
        """The freedom that is a displacement of the structure: six per node, then the deflections of joints' screws."""
        joints = 6 * len(self.structure.nodes)
        return (number // 3 + 1, number % 3 + 1) if number < joints else (joints // 3 + number - joints + 1, 1)

    def of_node(self, node: int) -> list[Freedom]:
        """The six freedoms of a node of the structure."""
        return [self.of_structure(6 * node + k) for k in range(6)]


def to_calculix(check: SolidCheck) -> str:
    """A machine of solids as a deck for CalculiX: its first `MODES` natural frequencies and their shapes, in SI and {O}.

    Bodies, ends and joints are those of the solids that the check compares with beams, and so should be the frequencies; the
    elements (20-node bricks of sections, 10-node tetrahedra of files), their assembly and the solution are CalculiX's.

    Raises:
        InputError: not all beams are among the solids.
    """
    at = check.at
    rest, bodies = put_in(at.machine, assemble(at.machine, at.frame, at.signs), check.parts)
    structure = divided(rest, 1)  # beams too short for solids are joints
    if structure.beams:
        names = ", ".join(beam.name for beam in structure.beams)
        raise InputError(f"the deck for CalculiX has no beams, and the check has {names}; make the whole machine solid")
    deck = _Deck(structure)
    deck.add(np.repeat(structure.nodes, 2, axis=0))
    _add_joints(deck)
    of = {name: solid for solid in check.parts for name in solid.names}
    made_of = profiles(at.machine)
    for body in bodies:
        _add_solid(deck, body, of[body.name], check)
        material = made_of[body.name].material.upper()
        deck.parts.append(f"*SOLID SECTION, ELSET={body.name.upper()}, MATERIAL={material}")
    for number, lump in enumerate((lump for lump in structure.masses if lump.mass > 0), 1):
        _add_mass(deck, number, lump)
    return "\n".join((*_head(check), *_whole(deck, at.machine), ""))


def write_calculix(check: SolidCheck, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a machine of solids as a deck for CalculiX.

    Args:
        check: see `to_calculix`.
        path: file to write, .inp; it appears whole or not at all.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: as `to_calculix`; when the file exists unasked, cannot be written, or does not end in .inp.
    """
    check_ending(path)
    text = to_calculix(check)
    with replacing(path, overwrite=overwrite) as file:
        file.write_text(text, encoding="ascii")


def check_ending(path: str | os.PathLike[str]) -> None:
    """Raise InputError unless a file ends in .inp, as ccx has it."""
    if not os.fspath(path).endswith(".inp"):
        raise InputError(f"{os.fspath(path)}: a deck for CalculiX ends in .inp")


def _head(check: SolidCheck) -> Iterator[str]:
    x, y, z = (1e3 * own for own in check.at.position)
    alpha, beta, gamma = np.degrees(check.at.angles)
    yield f"*HEADING\n{check.at.machine.name}, solid bodies; by trivet"
    yield f"** x y z = {x:g} {y:g} {z:g} mm, alpha beta gamma = {alpha:g} {beta:g} {gamma:g} deg, mode {check.at.mode or '-'}"
    yield from (f"** {note}" for note in _NOTES)


def _whole(deck: _Deck, machine: Machine) -> Iterator[str]:
    """Nodes before what is made of them, materials, what is fixed, and the step."""
    yield "*NODE, NSET=ALL"
    for number, (x, y, z) in enumerate(np.concatenate(deck.nodes), 1):
        yield f"{number}, {x:.12e}, {y:.12e}, {z:.12e}"
    for name, material in machine.materials.items():
        yield _material(name, material)
    yield from deck.parts
    yield from deck.equations
    place, turn = 2 * PLATFORM + 1, 2 * PLATFORM + 2
    yield f"*NSET, NSET=PLATFORM\n{place}, {turn}"
    yield f"*STEP\n*FREQUENCY\n{MODES}\n*NODE FILE\nU\n*NODE PRINT, NSET=PLATFORM\nU\n*END STEP"


def _material(name: str, material: Material) -> str:
    young, poisson, density = material.youngs_modulus, material.poisson_ratio, material.density
    elastic = f"*ELASTIC\n{young:.12e}, {poisson:.12e}"
    return f"*MATERIAL, NAME={name.upper()}\n{elastic}\n*DENSITY\n{density:.12e}"


def _add_joints(deck: _Deck) -> None:
    """What joints leave of the freedoms of nodes, and their springs."""
    own = dependence(deck.structure)
    free = [deck.of_structure(int(number)) for number in own.free]
    for number, row in zip(own.rest, own.follow, strict=True):
        deck.tie(np.r_[1.0, -row][None], [deck.of_structure(int(number)), *free], 1)
    deck.parts += [f"*BOUNDARY\n{node}, {way}" for node, way in map(deck.of_structure, map(int, own.fixed))]
    for joint in deck.structure.connections:
        deck.parts.append(f"** {joint.name}: {len(joint.rates)} screws")
        for rate in joint.rates:
            node = deck.add(joint.at[None])
            if rate > 0:
                deck.element("SPRING1", f"SPRING{node}", [[node]])
                deck.parts.append(f"*SPRING, ELSET=SPRING{node}\n1\n{rate:.12e}\n*BOUNDARY\n{node}, 2, 3")


def _add_solid(deck: _Deck, body: Body, solid: Solid, check: SolidCheck) -> None:
    """A solid between its nodes, and its ends."""
    grid = solid.reduced.grid
    own = elements(grid)
    first = deck.add(deck.structure.nodes[body.first] + (body.axes @ grid.points[:, own.nodes]).T)
    deck.element(own.type, body.name.upper(), (first + own.corners).tolist())
    numbers = dict(zip(own.nodes.tolist(), range(first, first + len(own.nodes)), strict=True))
    for at, node in ((0.0, body.first), (grid.length, body.second)):
        end = without_middles(grid, face(grid, at))
        rates = held(end, check.ends)
        of_point = -rates @ carry(end.arms)[:, :3].reshape(-1, 6)
        # To the axes of {O}, in which a row is turned as a vector is.
        rows = np.hstack([rates, of_point]).reshape(len(rates), -1, 3) @ body.axes.T
        nodes = [numbers[k] for k in end.nodes.tolist()]
        freedoms = [(k, way) for k in nodes for way in (1, 2, 3)]
        deck.tie(rows.reshape(len(rates), -1), freedoms + deck.of_node(node), len(freedoms))


def _add_mass(deck: _Deck, number: int, lump: NodeMass) -> None:
    """A rigid mass as six equal ones in pairs on its principal axes, which have its inertia."""
    moments, axes = np.linalg.eigh(lump.inertia)
    squares = 3 * np.maximum(moments.sum() / 2 - moments, 0) / lump.mass
    half = np.sqrt(squares)[:, None] * axes.T
    arms = lump.at - deck.structure.nodes[lump.node] + np.concatenate([half, -half])
    first = deck.add(deck.structure.nodes[lump.node] + arms)
    for k, arm in enumerate(arms):
        rows = np.hstack([np.eye(3), -carry(arm)[:3]])
        deck.tie(rows, [*((first + k, way) for way in (1, 2, 3)), *deck.of_node(lump.node)], 3)
    deck.parts.append(f"** {lump.name}")
    deck.element("MASS", f"MASS{number}", [[first + k] for k in range(len(arms))])
    deck.parts.append(f"*MASS, ELSET=MASS{number}\n{lump.mass / len(arms):.12e}")


def _lines(numbers: Sequence[int]) -> Iterator[str]:
    """Numbers on lines, all but the last of which end with a comma."""
    parts = [", ".join(map(str, numbers[k : k + PER_LINE])) for k in range(0, len(numbers), PER_LINE)]
    yield from (f"{part}," for part in parts[:-1])
    yield parts[-1]
