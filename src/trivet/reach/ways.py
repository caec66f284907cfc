"""Ways over a grid on which the worst value is as great as it can be: bottleneck, or max-min, ways.

A grid has rows, which a way leads along, and columns, which are free: the poses of a path, and the rolls at each of them.  A
step leads to the next row or to the next column; its value is the lesser of its ends.  The bottleneck is exact on the grid: the
greatest value at which start and end still hang together, which is that of the way between them in a maximum spanning tree.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

CAREFUL = 10.0
"""How much dearer a step is at the bottleneck's value than at twice that value."""
LEAP = 8
"""By how much a leap down the levels is longer than the one before."""
_CLOSED = 1e7
"""Cost of a step that is not open; more than any way has."""


class Way(NamedTuple):
    """A way over a grid."""

    value: float
    """The least value on it."""
    rows: Array
    """(k,) from node to node, one step each."""
    columns: Array
    """(k,) not taken back into the grid where the way runs all round."""

    @property
    def is_steady(self) -> bool:
        """Whether it never goes back along the rows."""
        return bool(np.all(np.diff(self.rows) >= 0))


def widest(values: Array, start: Array, end: Array, *, all_round: bool) -> Way | None:
    """The way with the greatest least value, and of these one that is short and keeps off low values.

    Args:
        values: (rows, columns); minus infinity where there is no way.
        start, end: (rows, columns) nodes from which to which it may lead; a way that need not go back along the rows is
            preferred when all starts are in the first row and all ends in the last.
        all_round: whether the last column is next to the first.

    Returns:
        The way, or None where start and end do not hang together.
    """
    value = bottleneck(values, start, end, all_round=all_round)
    if not np.isfinite(value):
        return None
    is_open = values >= value
    cost = np.where(is_open, _cost(values, value), _CLOSED)
    way = _steady(cost, start[0] & is_open[0], end[-1] & is_open[-1], all_round=all_round)
    rows, columns = way if way is not None else _any(cost, start & is_open, end & is_open, all_round=all_round)
    return Way(float(values[rows, columns % values.shape[1]].min()), rows, columns)


def bottleneck(values: Array, start: Array, end: Array, *, all_round: bool) -> float:
    """The value of the widest way; minus infinity where there is none.  Arguments as for `widest`."""
    # Every way meets every row, so that none is better than the best node of the worst row; most often one is as good.
    most = min(*(np.max(values, where=nodes, initial=-np.inf) for nodes in (start, end)), _narrowest(values, start, end))
    levels = np.unique(values[np.isfinite(values) & (values <= most)])
    low, high, leap = len(levels) - 1, len(levels), 1  # not joined at levels[high]
    while low >= 0 and not _is_joined(values >= levels[low], start, end, all_round):
        low, high, leap = max(low - leap, -1), low, LEAP * leap
    while high - low > 1:  # joined at levels[low]
        middle = (low + high) // 2
        if _is_joined(values >= levels[middle], start, end, all_round):
            low = middle
        else:
            high = middle
    return float(levels[low]) if low >= 0 else -np.inf


def _narrowest(values: Array, start: Array, end: Array) -> float:
    """The best value of the worst row between all starts and all ends."""
    first, last = np.flatnonzero(start.any(axis=1)), np.flatnonzero(end.any(axis=1))
    between = values[first.max(initial=0) : last.min(initial=len(values)) + 1]
    return float(between.max(axis=1).min(initial=np.inf)) if len(between) else np.inf


def farthest(is_open: Array, start: Array, *, all_round: bool) -> int:
    """The last row to which a way leads over open nodes; -1 where no start is open."""
    pieces, name = _pieces(is_open, all_round)
    first = np.unique(name[pieces[start & is_open]])
    rows = np.flatnonzero((np.isin(name[pieces], first) & is_open).any(axis=1))
    return int(rows[-1]) if len(rows) else -1


def _pieces(is_open: Array, all_round: bool) -> tuple[Array, Array]:
    """Numbers of pieces over the grid, and the number of the whole to which each piece belongs across the seam."""
    from scipy.ndimage import label

    pieces, count = label(is_open)
    if not all_round:
        return pieces, np.arange(count + 1)
    seam = pieces[:, [0, -1]][is_open[:, 0] & is_open[:, -1]]
    return pieces, _merged(count + 1, np.unique(seam, axis=0))


def _is_joined(is_open: Array, start: Array, end: Array, all_round: bool) -> bool:
    pieces, name = _pieces(is_open, all_round)
    first, last = np.unique(name[pieces[start & is_open]]), np.unique(name[pieces[end & is_open]])
    return bool(len(np.intersect1d(first, last, assume_unique=True)))


def _merged(count: int, pairs: Array) -> Array:
    """(count,) numbers of pieces, equal for those which pairs (k, 2) join."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    found: Array = connected_components(graph, directed=False)[1]
    return found


def _cost(values: Array, least: float) -> Array:
    if least <= 0:
        return np.ones(values.shape)
    near: Array = 1 + CAREFUL * np.clip(2 - np.where(np.isfinite(values), values, 0.0) / least, 0.0, 1.0)
    return near


def _steady(cost: Array, start: Array, end: Array, *, all_round: bool) -> tuple[Array, Array] | None:
    """The cheapest way from the first row to the last that never goes back: row by row."""
    rows, columns = cost.shape
    turns = 2 if all_round else 1
    wide = np.tile(cost, (1, turns))
    up, down = np.cumsum(wide, axis=1), np.cumsum(wide[:, ::-1], axis=1)
    best = np.empty(cost.shape)
    entered = np.where(start, 0.0, np.inf)
    for row in range(rows):
        # The least cost at each place of a row which is entered at some cost, and along which every step costs its place's.
        own = np.concatenate([entered] * turns)
        forth = np.minimum.accumulate(own - up[row]) + up[row]
        back = np.minimum.accumulate(own[::-1] - down[row]) + down[row]
        best[row] = np.minimum(forth[-columns:], back[-columns:][::-1])
        if row + 1 < rows:
            entered = best[row] + cost[row + 1]
    last = np.where(end, best[-1], np.inf)
    column = int(last.argmin())
    if not last[column] < _CLOSED:
        return None
    row, found = rows - 1, [(rows - 1, column)]
    while True:
        place = column % columns
        entry = best[row - 1, place] + cost[row, place] if row else (0.0 if start[place] else np.inf)
        if entry < best[row, place] + 1e-3:  # rounding is far below, steps are far above
            if row == 0:
                break
            row -= 1
        else:
            sides = [column - 1, column + 1] if all_round else [c for c in (column - 1, column + 1) if 0 <= c < columns]
            column = min(sides, key=lambda c: best[row, c % columns])
        found.append((row, column))
    return tuple(np.array(found[::-1]).T)


def _any(cost: Array, start: Array, end: Array, *, all_round: bool) -> tuple[Array, Array]:
    """The cheapest way, back and forth."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    columns = cost.shape[1]
    number = np.arange(cost.size).reshape(cost.shape)
    pairs = [(number[:-1].ravel(), number[1:].ravel()), (number[:, :-1].ravel(), number[:, 1:].ravel())]
    if all_round:
        pairs.append((number[:, -1], number[:, 0]))
    one, two = (np.concatenate(side) for side in zip(*pairs, strict=True))
    flat = cost.ravel()
    is_open = (flat[one] < _CLOSED) & (flat[two] < _CLOSED)
    one, two = one[is_open], two[is_open]
    graph = coo_matrix(((flat[one] + flat[two]) / 2, (one, two)), shape=(cost.size, cost.size)).tocsr()
    far, before, _ = dijkstra(graph, directed=False, indices=number[start], min_only=True, return_predecessors=True)
    node = int(number[end][np.argmin(far[number[end]])])
    nodes = [node]
    while before[nodes[-1]] >= 0:
        nodes.append(int(before[nodes[-1]]))
    row, column = np.divmod(np.array(nodes[::-1]), columns)
    if all_round:
        steps = (np.diff(column) + columns // 2) % columns - columns // 2
        column = column[0] + np.concatenate([[0], np.cumsum(steps)])
    return row, column
