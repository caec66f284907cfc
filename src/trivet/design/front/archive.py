"""The best designs met so far, and those that come next to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from trivet.design.front.problem import Array, Values

LIMIT = 500
"""Designs kept on the front, and again beside it."""
NEXT = 2
"""Ranks kept beyond the first."""
SCATTERED = 12
"""Designs kept of the first that were offered."""
MANY = 8
"""Designs at once, at least, that tell how far objectives lie apart: fewer may be all on one way of polishing."""
NEAREST = 5
"""Designs kept that come nearest to all constraints."""


def spread(objectives: Array, count: int, taken: Sequence[int] = (), closest: float = 0.0) -> Array:
    """Which of points (n, m) to keep, spread evenly: some (the ends where not given), then ever the one farthest from those.

    Args:
        objectives: the points.
        count: how many to keep.
        taken: which to begin with.
        closest: none is added that is nearer than this to another, as a part of the extent.
    """
    if len(objectives) <= count and not closest:
        return np.arange(len(objectives))
    width = np.ptp(objectives, axis=0)
    places = objectives / np.where(width > 0, width, 1.0)
    kept = list(taken) or list(dict.fromkeys(int(i) for i in places.argmin(axis=0)))[:count]
    apart = np.min([np.sum((places - places[i]) ** 2, axis=1) for i in kept], axis=0)
    while len(kept) < min(count, len(places)) and apart.max() > closest**2:
        kept.append(int(apart.argmax()))
        apart = np.minimum(apart, np.sum((places - places[kept[-1]]) ** 2, axis=1))
    return np.sort(np.array(kept, int))


def ranks(objectives: Array) -> Array:
    """(n,) 0 for points (n, m) that no other dominates, 1 for those that only such dominate, and so on."""
    import moocore

    if not len(objectives):
        return np.zeros(0, int)
    return np.asarray(moocore.pareto_rank(objectives), int)


def is_best(objectives: Array) -> Array:
    """(n,) whether no other point (n, m) dominates one; of equal points the first counts."""
    import moocore

    if not len(objectives):
        return np.zeros(0, bool)
    return np.asarray(moocore.is_nondominated(objectives, keep_weakly=False), bool)


@dataclass
class Archive:
    """Feasible designs: those which none dominates and, beside them, some that few do."""

    designs: Array
    """(n, d)"""
    values: Values
    is_dominated: Array
    """(n,) what was once dominated stays so, even where what dominated it was left out for want of room."""
    nearest: tuple[Array, Array]
    """Designs (q, d) that miss constraints the least, and those constraints (q, k)."""
    first: Array
    """Designs (q, d) of those that were offered first, some with value."""
    seen: int = 0
    """Designs that were offered."""
    polished: set[bytes] = field(default_factory=set)
    """Designs, by their bytes, that slopes make no better; they stay as long as nothing dominates them."""
    usual: Array | None = None
    """(m,) how far objectives lie apart among the first feasible designs."""
    limit: int = LIMIT

    @classmethod
    def empty(cls, variables: int, objectives: int, constraints: int) -> Archive:
        """Nothing yet."""
        none, values = np.zeros((0, variables)), Values(np.zeros((0, objectives)), np.zeros((0, constraints)))
        return cls(none, values, np.zeros(0, bool), (none, values.constraints), none)

    def __len__(self) -> int:
        return len(self.designs)

    @property
    def best(self) -> tuple[Array, Values]:
        """Designs on the front, and their values."""
        return self.designs[~self.is_dominated], self.values.at(~self.is_dominated)

    @property
    def is_polished(self) -> Array:
        """(n,)"""
        return np.array([design.tobytes() in self.polished for design in self.designs], bool)

    def add(self, designs: Array, values: Values) -> None:
        """Takes in what is feasible of designs (n, d)."""
        if not self.seen:
            self.first = designs[values.has_value][:SCATTERED]
        self.seen += len(designs)
        if not len(self):
            self._keep_nearest(designs, values)
        fine = values.is_feasible
        designs, values = designs[fine], values.at(fine)
        if self.usual is None and len(designs) >= MANY:
            self.usual = np.median(values.objectives, axis=0) - values.objectives.min(axis=0)
        self.designs = np.concatenate([self.designs, designs])
        self.values = Values(*(np.concatenate(both) for both in zip(self.values, values, strict=True)))
        self.is_dominated = np.concatenate([self.is_dominated, np.zeros(len(designs), bool)])
        open_ = np.flatnonzero(~self.is_dominated)
        self.is_dominated[open_] = ~is_best(self.values.objectives[open_])
        if len(self) > 4 * self.limit:
            self.prune()

    def _keep_nearest(self, designs: Array, values: Values) -> None:
        """Of those which miss constraints."""
        missed = np.isfinite(values.violation) & ~values.is_feasible
        every = np.concatenate([self.nearest[0], designs[missed]])
        constraints = np.concatenate([self.nearest[1], values.constraints[missed]])
        first = np.argsort(np.max(constraints, axis=1, initial=0.0), kind="stable")[:NEAREST]
        self.nearest = every[first], constraints[first]

    def prune(self) -> None:
        """Keeps what has room, evenly spread."""
        front, beside = np.flatnonzero(~self.is_dominated), np.flatnonzero(self.is_dominated)
        rank = ranks(self.values.objectives)[beside]
        _, first = np.unique(self.designs[beside], axis=0, return_index=True)
        beside = beside[np.intersect1d(first, np.flatnonzero(rank <= NEXT))]
        stays = np.flatnonzero(self.is_polished[front])
        front = front[spread(self.values.objectives[front], self.limit, list(stays))]
        beside = beside[spread(self.values.objectives[beside], self.limit)]
        index = np.sort(np.concatenate([front, beside]))
        self.designs, self.values, self.is_dominated = self.designs[index], self.values.at(index), self.is_dominated[index]
