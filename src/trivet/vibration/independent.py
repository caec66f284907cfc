"""Independent displacements of a structure: what its joints leave.

A connection makes the twist of its second node that of its first, carried, plus the deflections of its screws.  So the nodes
form trees: the ground's, the platform's, and one for every part that floats between beams.  A connection that closes a loop of
rigid parts is a condition on what is left, and is taken out by its null space.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from trivet.statics.assembly import GROUND, PLATFORM, Structure
from trivet.statics.structure import carry

CLOSED = 1e-9
"""Singular value, against the greatest, of conditions that say nothing new."""


class _Branch(NamedTuple):
    """The twist of a node: that of the root of its tree, carried, plus what the screws of connections between them add."""

    root: int
    arm: np.ndarray
    """(6, 6)."""
    screws: dict[int, np.ndarray]
    """(6, k) by the number of the connection."""


def independent(structure: Structure) -> sp.csr_matrix:
    """(N, q): all displacements (6 per node, then the deflections of the joints' screws) from independent ones.

    The ground is at rest.  The independent ones are the twists of the roots, the platform's first, then the deflections.
    """
    branches, loops = _trees(structure)
    nodes = len(structure.nodes)
    starts = np.cumsum([0] + [len(tie.rates) for tie in structure.connections])
    roots = [node for node, branch in enumerate(branches) if branch.root == node and node != GROUND]
    column = {node: 6 * k for k, node in enumerate(roots)}
    first_joint, joints = 6 * len(roots), int(starts[-1])
    blocks = [(6 * nodes, first_joint, np.eye(joints))]
    for node, branch in enumerate(branches):
        if branch.root != GROUND:
            blocks.append((6 * node, column[branch.root], branch.arm))
        blocks += [(6 * node, first_joint + int(starts[number]), s) for number, s in branch.screws.items()]
    transform = _blocks(blocks, (6 * nodes + joints, first_joint + joints))
    if not loops:
        return transform
    conditions = []
    for number in loops:
        tie = structure.connections[number]
        rows = [
            (0, 6 * tie.second, carry(tie.at - structure.nodes[tie.second])),
            (0, 6 * tie.first, -carry(tie.at - structure.nodes[tie.first])),
            (0, 6 * nodes + int(starts[number]), -tie.screws),
        ]
        conditions.append(_blocks(rows, (6, 6 * nodes + joints)) @ transform)
    return sp.csr_matrix(transform @ _null_space(sp.vstack(conditions).tocsc(), structure.scale))


def _trees(structure: Structure) -> tuple[list[_Branch], list[int]]:
    """The branch of every node, and the connections that close loops."""
    neighbours: list[list[int]] = [[] for _ in structure.nodes]
    for number, tie in enumerate(structure.connections):
        neighbours[tie.first].append(number)
        neighbours[tie.second].append(number)
    branches: dict[int, _Branch] = {}
    loops: list[int] = []
    used: set[int] = set()
    for start in (GROUND, PLATFORM, *range(len(structure.nodes))):
        if start in branches:
            continue
        branches[start] = _Branch(start, np.eye(6), {})
        todo = [start]
        while todo:
            here = todo.pop()
            for number in (n for n in neighbours[here] if n not in used):
                used.add(number)
                tie = structure.connections[number]
                there = tie.second if tie.first == here else tie.first
                if there in branches:
                    loops.append(number)
                else:
                    branches[there] = _beyond(structure, number, branches[here], (here, there))
                    todo.append(there)
    return [branches[node] for node in range(len(structure.nodes))], loops


def _beyond(structure: Structure, number: int, branch: _Branch, nodes: tuple[int, int]) -> _Branch:
    """The branch on the other side of a connection."""
    tie, (here, there) = structure.connections[number], nodes
    back = carry(structure.nodes[there] - tie.at)
    step = back @ carry(tie.at - structure.nodes[here])
    sign = 1.0 if tie.first == here else -1.0
    screws = {k: step @ s for k, s in branch.screws.items()}
    return _Branch(branch.root, step @ branch.arm, screws | {number: sign * (back @ tie.screws)})


def _blocks(blocks: list[tuple[int, int, np.ndarray]], shape: tuple[int, int]) -> sp.csr_matrix:
    """A sparse matrix of dense blocks, each given by its first row and column."""
    rows, columns, values = [], [], []
    for row, column, block in blocks:
        i, j = np.indices(block.shape)
        rows.append((row + i).ravel())
        columns.append((column + j).ravel())
        values.append(block.ravel())
    return sp.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)


def _null_space(conditions: sp.csc_matrix, scale: float) -> sp.csr_matrix:
    """(q, q - rank): displacements that fulfil the conditions; those which take no part stay as they are."""
    taking = np.flatnonzero(np.diff(conditions.indptr))
    dense = conditions[:, taking].toarray()
    units = np.tile(np.r_[np.full(3, 1 / scale), np.ones(3)], len(dense) // 6)
    null = scipy.linalg.null_space(dense * units[:, None], rcond=CLOSED)
    count = conditions.shape[1]
    rest = np.setdiff1d(np.arange(count), taking)
    keep = sp.csr_matrix((np.ones(len(rest)), (rest, np.arange(len(rest)))), shape=(count, len(rest)))
    place = sp.csr_matrix((np.ones(len(taking)), (taking, np.arange(len(taking)))), shape=(count, len(taking)))
    return sp.csr_matrix(sp.hstack([keep, place @ sp.csr_matrix(null)]))
