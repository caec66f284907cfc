"""A structure as finite elements: mass and stiffness on independent displacements, sparse.

The structure is that of the statics (`statics.assembly`), its beams divided into elements; joints are exact
(`vibration.independent`).
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from trivet.errors import InputError
from trivet.statics.assembly import Connection, NodeMass, Structure
from trivet.statics.beam_element import BeamElement, global_stiffness, turned
from trivet.statics.structure import carry
from trivet.vibration.beam_mass import local_mass
from trivet.vibration.bodies import Body
from trivet.vibration.independent import independent

MOST_ELEMENTS = 400
"""Elements of one beam."""
STUB = 1e-2
"""Length of a beam, against the structure's `scale`, below which it is a joint with six springs."""


@dataclass(frozen=True)
class Mesh:
    """A structure with N displacements that follow from q: 6 per node in {O}, then the deflections of the joints' screws, then
    the internal coordinates of bodies."""

    structure: Structure
    """With its beams divided."""
    transform: sp.csr_matrix
    """(N, q): all displacements from the independent ones."""
    inertia: sp.csr_matrix
    """(N, N): mass on all displacements, those of the ground included."""
    mass: sp.csc_matrix
    """(q, q), SI."""
    stiffness: sp.csc_matrix
    """(q, q), SI."""
    loss: sp.csc_matrix
    """(q, q): imaginary part of the stiffness of all that has a loss factor of its own, eta_own k."""
    undetermined: sp.csc_matrix
    """(q, q): stiffness of all that has none, and takes that of the analysis."""
    viscosity: sp.csc_matrix
    """(q, q): viscous damping of the joints."""
    bodies: tuple[Body, ...] = ()
    """What stands in place of beams."""

    def dynamic_stiffness(self, omega: float, loss_factor: float) -> sp.csc_matrix:
        """(q, q) complex: K (1 + i eta) + i omega C - omega^2 M."""
        damped = self.stiffness + 1j * (self.loss + loss_factor * self.undetermined)
        return damped + 1j * omega * self.viscosity - omega**2 * self.mass

    def rows(self, node: int, at: np.ndarray | None = None) -> sp.csr_matrix:
        """(6, q): twist of a node, or of a point rigid with it (m, in {O}), from the independent displacements."""
        own = self.transform[6 * node : 6 * node + 6]
        return own if at is None else sp.csr_matrix(carry(at - self.structure.nodes[node])) @ own


def mesh(structure: Structure, elements: int | Mapping[str, int], bodies: Sequence[Body] = ()) -> Mesh:
    """A structure at one pose as finite elements.

    Args:
        structure: as `statics.assembly.assemble` gives it, without batch axes.
        elements: per beam; or by the name of a beam ("link", or "leg-1.link"), one for those that are not named.
        bodies: between nodes of the structure, whose beams there have been taken out.
    """
    fine = divided(structure, elements)
    nodes, joints = len(fine.nodes), sum(len(tie.rates) for tie in fine.connections)
    size = 6 * nodes + joints + sum(body.internal for body in bodies)
    transform = sp.block_diag((independent(fine), sp.eye(size - 6 * nodes - joints)), format="csr")
    masses, stiffnesses, losses, others = (list[tuple[np.ndarray, np.ndarray]]() for _ in range(4))
    for beam in fine.beams:
        dofs = np.r_[6 * beam.first : 6 * beam.first + 6, 6 * beam.second : 6 * beam.second + 6]
        stiffness = global_stiffness(beam)
        masses.append((dofs, turned(local_mass(beam), beam.axes)))
        stiffnesses.append((dofs, stiffness))
        own = beam.made_of.loss_factor
        (others if own is None else losses).append((dofs, stiffness * (1 if own is None else own)))
    for body, dofs in zip(bodies, dofs_of(bodies, 6 * nodes + joints), strict=True):
        stiffness = body.in_world(body.stiffness)
        masses.append((dofs, body.in_world(body.mass)))
        stiffnesses.append((dofs, stiffness))
        own = body.loss_factor
        (others if own is None else losses).append((dofs, stiffness * (1 if own is None else own)))
    for lump in fine.masses:
        masses.append((np.arange(6 * lump.node, 6 * lump.node + 6), inertia_at_node(fine, lump)))
    rates, loss, free, viscous = (np.zeros(size) for _ in range(4))
    place = 6 * nodes
    for tie in fine.connections:
        own = slice(place, place + len(tie.rates))
        place = own.stop
        rates[own], viscous[own] = tie.rates, tie.viscosity
        if tie.loss_factor is None:
            free[own] = tie.rates
        else:
            loss[own] = tie.rates * tie.loss_factor

    def reduced(blocks: list[tuple[np.ndarray, np.ndarray]], diagonal: np.ndarray | None = None) -> sp.csc_matrix:
        whole = _scattered(blocks, size)
        if diagonal is not None:
            whole = whole + sp.diags(diagonal)
        return sp.csc_matrix(transform.T @ whole @ transform)

    return Mesh(
        fine,
        transform,
        _scattered(masses, size),
        reduced(masses),
        reduced(stiffnesses, rates),
        reduced(losses, loss),
        reduced(others, free),
        reduced([], viscous),
        tuple(bodies),
    )


def dofs_of(bodies: Sequence[Body], place: int) -> Iterator[np.ndarray]:
    """Per body the numbers (12 + i,) of its displacements; internal coordinates follow one another from a place on."""
    for body in bodies:
        ends = (np.arange(6 * node, 6 * node + 6) for node in (body.first, body.second))
        yield np.concatenate([*ends, np.arange(place, place + body.internal)])
        place += body.internal


def divided(structure: Structure, elements: int | Mapping[str, int]) -> Structure:
    """A structure with every beam divided into equal elements; new nodes come after the old ones, and stubs are joints."""
    if structure.nodes.ndim != 2:
        raise InputError("finite elements take one pose at a time")
    if not isinstance(elements, int):
        known = {name for beam in structure.beams for name in (beam.name, beam.name.partition(".")[2])}
        for name in elements:
            if name not in known:
                raise InputError(f"elements: no beam is called {name}; there are {', '.join(sorted(known))}")
    nodes, beams = list(structure.nodes), []
    connections, masses = list(structure.connections), list(structure.masses)
    for beam in structure.beams:
        if beam.length < STUB * structure.scale:
            connections.append(_springs(structure, beam))
            masses.append(_rigid(structure, beam))
            continue
        count = _count(beam.name, elements)
        ends = [beam.first]
        for k in range(1, count):
            share = k / count
            nodes.append((1 - share) * structure.nodes[beam.first] + share * structure.nodes[beam.second])
            ends.append(len(nodes) - 1)
        ends.append(beam.second)
        for first, second in itertools.pairwise(ends):
            beams.append(dataclasses.replace(beam, first=first, second=second, length=np.asarray(beam.length) / count))
    return dataclasses.replace(
        structure, nodes=np.array(nodes), beams=tuple(beams), connections=tuple(connections), masses=tuple(masses)
    )


def _springs(structure: Structure, stub: BeamElement) -> Connection:
    """A beam as a joint at its middle, where its compliance is diagonal.

    As an element its stiffness, which grows as L^-3, would drown that of the machine in rounding.
    """
    made, length = stub.made_of, float(stub.length)
    shears = [length**3 / (12 * e) + length / g for e, g in ((made.flexural_z, made.shear_y), (made.flexural_y, made.shear_z))]
    turns = [length / rate for rate in (made.torsion, made.flexural_y, made.flexural_z)]
    rates = 1 / np.array([length / made.axial, *shears, *turns], dtype=float)
    screws = np.kron(np.eye(2), stub.axes)
    loss = None if made.loss_factor is None else float(made.loss_factor)
    return Connection(stub.name, stub.first, stub.second, _middle(structure, stub), screws, rates, loss, np.zeros(6))


def _rigid(structure: Structure, stub: BeamElement) -> NodeMass:
    """The mass of a beam that hardly bends, as it moves with its near node."""
    made, length = stub.made_of, float(stub.length)
    across = made.mass * length**3 / 12
    moments = np.array([made.polar, made.rotary_y, made.rotary_z]) * length + [0, across, across]
    inertia = (stub.axes * moments) @ stub.axes.T
    return NodeMass(stub.name, stub.first, _middle(structure, stub), float(made.mass * length), inertia)


def _middle(structure: Structure, beam: BeamElement) -> np.ndarray:
    at: np.ndarray = (structure.nodes[beam.first] + structure.nodes[beam.second]) / 2
    return at


def _count(name: str, elements: int | Mapping[str, int]) -> int:
    count = elements if isinstance(elements, int) else elements.get(name, elements.get(name.partition(".")[2], 1))
    if not 1 <= count <= MOST_ELEMENTS:
        raise InputError(f"elements: {count} for {name}; expected 1 to {MOST_ELEMENTS}")
    return count


def inertia_at_node(structure: Structure, lump: NodeMass) -> np.ndarray:
    """(6, 6): inertia of a rigid mass at its node, in {O}."""
    own = np.zeros((6, 6))
    own[:3, :3], own[3:, 3:] = lump.mass * np.eye(3), lump.inertia
    to = carry(lump.at - structure.nodes[lump.node])
    turned_in: np.ndarray = to.T @ own @ to
    return turned_in


def _scattered(blocks: list[tuple[np.ndarray, np.ndarray]], size: int) -> sp.csr_matrix:
    """Sum of dense blocks on sets of displacements."""
    if not blocks:
        return sp.csr_matrix((size, size))
    rows = np.concatenate([np.repeat(dofs, len(dofs)) for dofs, _ in blocks])
    columns = np.concatenate([np.tile(dofs, len(dofs)) for dofs, _ in blocks])
    return sp.csr_matrix((np.concatenate([block.ravel() for _, block in blocks]), (rows, columns)), shape=(size, size))
