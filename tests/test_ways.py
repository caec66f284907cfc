"""Bottleneck ways and sheets against brute force, a spanning tree and union-find."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from trivet.reach.sheets import highest_sheet
from trivet.reach.ways import bottleneck, farthest, widest


def ends(shape: tuple[int, int]) -> tuple[Any, Any]:
    start, end = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    start[0], end[-1] = True, True
    return start, end


def edges(values: np.ndarray, all_round: bool) -> tuple[Any, Any, Any]:
    """Ends of the steps of a grid, and their values."""
    number = np.arange(values.size).reshape(values.shape)
    pairs = [(number[:-1].ravel(), number[1:].ravel()), (number[:, :-1].ravel(), number[:, 1:].ravel())]
    if all_round:
        pairs.append((number[:, -1], number[:, 0]))
    one, two = (np.concatenate(side) for side in zip(*pairs, strict=True))
    worth = np.minimum(values.ravel()[one], values.ravel()[two])
    is_open = np.isfinite(worth)
    return one[is_open], two[is_open], worth[is_open]


def by_union(values: np.ndarray, start: Any, end: Any, all_round: bool) -> float:
    """Steps put in, the best first, until start and end are joined."""
    parent = list(range(values.size))

    def root(node: int) -> int:
        while parent[node] != node:
            node = parent[node]
        return node

    flat = values.ravel()
    firsts = [k for k in np.flatnonzero(start) if np.isfinite(flat[k])]
    lasts = [k for k in np.flatnonzero(end) if np.isfinite(flat[k])]
    both = [flat[k] for k in firsts if k in lasts]
    one, two, worth = edges(values, all_round)
    found = max(both, default=-np.inf)
    for k in np.argsort(-worth, kind="stable"):
        if worth[k] <= found:
            break
        parent[root(one[k])] = root(two[k])
        if {root(f) for f in firsts} & {root(e) for e in lasts}:
            return float(worth[k])
    return float(found)


@pytest.mark.parametrize("all_round", [False, True])
def test_random_grids_against_union_find(all_round: bool) -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        shape = (int(rng.integers(1, 9)), int(rng.integers(3, 9)))
        values = np.round(rng.random(shape), 2)
        values[rng.random(shape) < 0.3] = -np.inf
        start, end = ends(shape)
        expected = by_union(values, start, end, all_round)
        assert bottleneck(values, start, end, all_round=all_round) == expected
        way = widest(values, start, end, all_round=all_round)
        if way is None:
            assert not np.isfinite(expected)
            assert farthest(np.isfinite(values), start, all_round=all_round) < shape[0] - 1
            continue
        assert way.value == expected == values[way.rows, way.columns % shape[1]].min()
        steps = np.abs(np.diff(way.rows)) + np.abs(np.diff(way.columns))
        assert np.all(steps == 1)
        assert way.rows[0] == 0
        assert way.rows[-1] == shape[0] - 1
        assert farthest(np.isfinite(values), start, all_round=all_round) == shape[0] - 1


def test_a_large_grid_against_a_spanning_tree() -> None:
    """The way between two nodes in a maximum spanning tree has the greatest least value that any way between them has."""
    rng = np.random.default_rng(2)
    values = gaussian_filter(rng.random((90, 180)), 3, mode="wrap")
    one, two, worth = edges(values, all_round=True)
    tree = minimum_spanning_tree(coo_matrix((2 - worth, (one, two)), shape=(values.size,) * 2).tocsr())
    for _ in range(5):
        first, last = int(rng.integers(180)), int(rng.integers(180)) + 89 * 180
        _, before = breadth_first_order(tree, first, directed=False)
        node, least = last, values.ravel()[last]
        while node != first:
            node = before[node]
            least = min(least, values.ravel()[node])
        start, end = np.zeros(values.shape, dtype=bool), np.zeros(values.shape, dtype=bool)
        start.ravel()[first] = end.ravel()[last] = True
        assert bottleneck(values, start, end, all_round=True) == least
        way = widest(values, start, end, all_round=True)
        assert way is not None
        assert way.value == least
        assert way.rows[0] * 180 + way.columns[0] % 180 == first


def test_a_way_goes_back_only_where_it_must() -> None:
    values = np.ones((5, 7))
    assert widest(values, *ends((5, 7)), all_round=False).is_steady  # type: ignore[union-attr]
    maze = np.full((5, 7), -np.inf)
    maze[:4, 1], maze[3, 1:3], maze[1:4, 3], maze[1, 3:6], maze[1:, 5] = 1.0, 1.0, 1.0, 1.0, 1.0
    way = widest(maze, *ends((5, 7)), all_round=False)
    assert way is not None
    assert not way.is_steady
    assert len(way.rows) == 13


def test_a_way_keeps_off_low_values() -> None:
    """Of all ways with the same least value one that stays away from such values elsewhere."""
    values = np.full((40, 21), 1.0)
    values[:, 10] = 0.5
    values[0] = 0.5
    way = widest(values, *ends((40, 21)), all_round=False)
    assert way is not None
    assert way.value == 0.5
    assert np.sum(values[way.rows, way.columns] < 1) == 1


def test_sheets_against_all_that_there_are() -> None:
    rng = np.random.default_rng(3)
    rays, columns = 3, 4
    found = 0
    for _ in range(60):
        stride = int(rng.integers(0, 2))
        values = np.round(rng.random((rays, 3, columns)), 1)
        values[rng.random(values.shape) < 0.2] = -np.inf
        values[:, 0] = values[0, 0]
        best = -np.inf
        for pole in range(columns):
            near = range(max(-columns // 2, pole - 2), min(columns + columns // 2, pole + 3))
            rings = [
                ring for ring in itertools.product(near, repeat=rays)
                if all(abs(ring[k] - ring[k - 1]) <= stride for k in range(rays))
            ]  # fmt: skip
            for first in rings:
                if any(abs(c - pole) > stride for c in first):
                    continue
                inner = min([values[0, 0, pole]] + [values[k, 1, first[k] % columns] for k in range(rays)])
                for second in rings:
                    if inner > best and all(abs(a - b) <= stride for a, b in zip(first, second, strict=True)):
                        best = max(best, min([inner] + [values[k, 2, second[k] % columns] for k in range(rays)]))
        sheet = highest_sheet(values, stride)
        if sheet is None:
            assert not np.isfinite(best)
            continue
        found += 1
        assert 0.95 * best <= sheet.value <= best
        assert np.all(sheet.columns[:, 0] == sheet.columns[0, 0])
        assert np.abs(np.diff(sheet.columns, axis=1)).max() <= stride
        assert np.abs(sheet.columns - np.roll(sheet.columns, 1, axis=0)).max() <= stride
    assert 10 < found < 60
