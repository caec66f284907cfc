"""A front as it is told: its points with what holds each, and the alternatives that are nearly as good."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trivet.design.front.archive import Archive, is_best, ranks, spread
from trivet.design.front.box import Box
from trivet.design.front.problem import Array, Problem, Values

HELD = 1e-6
"""A constraint is active where it is at most this far from zero, a bound where a variable is as near to it, as a part of its
range."""

TWIN = 1e-3
"""Parts of the ranges of variables within which a dominated design is no alternative to one of the front."""
ALIKE = 1e-9
"""Parts of the front's extent that are no difference between objectives."""


class Bound(NamedTuple):
    """An end of a variable's range."""

    variable: str
    is_high: bool


@dataclass(frozen=True)
class Front:
    """Designs that no other dominates, by their first objective, and dominated ones beside them."""

    designs: Array
    """(n, d)"""
    values: Values
    is_polished: Array
    """(n,) whether slopes lead to nothing better."""
    active: tuple[tuple[str, ...], ...]
    """Constraints that hold each point."""
    bounds: tuple[tuple[Bound, ...], ...]
    """Ends of ranges that hold each point."""
    alternatives: Array
    """(q, d) dominated designs."""
    alternative_values: Values
    ranks: Array
    """(q,) of the alternatives: 1 where only points of the front dominate one, 2 where such alternatives do."""


def told(problem: Problem, archive: Archive, points: int) -> Front:
    """The front of an archive, with so many points at most: those that are polished, others where these leave gaps."""
    index = chosen(problem, archive, points)
    designs, values = archive.designs[index], archive.values.at(index)
    beside, next_, rank = _beside(problem, archive, designs, points)
    return Front(
        designs, values, archive.is_polished[index],
        tuple(_active(problem, row) for row in values.constraints), tuple(_bounds(problem, design) for design in designs),
        beside, next_, rank,
    )  # fmt: skip


def chosen(problem: Problem, archive: Archive, points: int) -> Array:
    """Which of an archive's designs are told, by their first objective."""
    own = np.flatnonzero(~archive.is_dominated)
    own = own[_distinct(problem, archive.designs[own], archive.values.at(own), archive.is_polished[own])]
    objectives, first = archive.values.objectives[own], np.flatnonzero(archive.is_polished[own])
    first = first[spread(objectives[first], points)]
    kept = spread(objectives, points, list(first), 1 / points if len(first) else 0.0)
    return own[kept[np.lexsort(objectives[kept].T[::-1])]]


def _distinct(problem: Problem, designs: Array, values: Values, is_polished: Array) -> Array:
    """Which designs to keep where some are one but for rounding, or better than another by no more: those that are polished and
    meet constraints best."""
    order = np.lexsort((np.max(values.constraints, axis=1, initial=0.0), ~is_polished))
    _, first = np.unique(np.rint(Box.of(problem).genes(designs[order]) / HELD), axis=0, return_index=True)
    order = order[np.sort(first)]
    width = np.ptp(values.objectives[order], axis=0)
    return order[is_best(np.rint(values.objectives[order] / (ALIKE * np.where(width > 0, width, 1.0))))]


def _beside(problem: Problem, archive: Archive, front: Array, points: int) -> tuple[Array, Values, Array]:
    """Alternatives, their values and ranks."""
    index = np.flatnonzero(archive.is_dominated)
    genes = np.rint(Box.of(problem).genes(np.concatenate([front, archive.designs[index]])) / HELD)
    _, first = np.unique(genes, axis=0, return_index=True)
    index = index[np.sort(first[first >= len(front)]) - len(front)]
    index = index[_is_other(problem, archive.designs[index], front)]
    rank = np.maximum(ranks(archive.values.objectives)[index], 1)
    objectives = archive.values.objectives[index]
    kept = spread(objectives, points)
    kept = kept[np.lexsort([*objectives[kept].T[::-1], rank[kept]])]
    return archive.designs[index[kept]], archive.values.at(index[kept]), rank[kept]


def _is_other(problem: Problem, designs: Array, front: Array) -> Array:
    """(n,) which designs are more than one of the front that is told, a little beside it."""
    genes, own = (Box.of(problem).genes(some) for some in (designs, front))
    found = np.ones(len(designs), dtype=bool)
    for row in own:
        found &= np.abs(genes - row).max(axis=1, initial=0.0) > TWIN
    return found


def _active(problem: Problem, constraints: Array) -> tuple[str, ...]:
    return tuple(name for name, value in zip(problem.constraints, constraints, strict=True) if abs(value) <= HELD)


def _bounds(problem: Problem, design: Array) -> tuple[Bound, ...]:
    box = Box.of(problem)
    genes = box.genes(design[None])[0]
    ends = [(name, gene) for name, gene, is_free in zip(problem.variables, genes, box.is_free, strict=True) if is_free]
    return tuple(Bound(name, bool(gene > 0.5)) for name, gene in ends if min(gene, 1 - gene) <= HELD)
