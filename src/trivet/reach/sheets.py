"""Rolls over a whole surface that change continuously and whose worst value is as great as it can be.

A surface is a fan: rays of rows from one pole, all round.  At every node one column, a roll, is to be chosen, so that
neighbours differ by a few columns at most.  Such choices are closed under taking the greater, node by node, of two of them:
hence striking out, again and again, the columns that have no partner at some neighbour decides whether there is one at all, and
the greatest columns that are left are one (P. Jeavons, M. Cooper, Tractable constraints on ordered domains, Artificial
Intelligence 79, 1995).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

KEPT = 0.95
"""Part of the greatest least value with which a sheet is content when it can turn less for it."""


class Sheet(NamedTuple):
    """A column for every node of a fan."""

    value: float
    """The least value on it."""
    columns: Array
    """(rays, rows), counted on where they run all round."""
    stride: int
    """By how many columns neighbours differ, at most."""


def highest_sheet(values: Array, stride: int, progress: Callable[[int, int], None] = lambda done, total: None) -> Sheet | None:
    """A sheet whose least value is nearly the greatest there can be, and which turns little.

    Args:
        values: (rays, rows, columns), rays and columns all round; minus infinity where nothing is allowed.  The first row is
            the pole and the same on every ray.
        stride: by how many columns neighbours may differ.
        progress: called with how many thresholds of how many have been tried.

    Returns:
        The sheet; None where there is none.
    """
    levels = np.unique(values[np.isfinite(values)])
    low, high = -1, len(levels)
    total = max(len(levels), 1).bit_length()
    for done in range(total):
        if high - low <= 1:
            break
        middle = (low + high) // 2
        low, high = (middle, high) if _struck(_unrolled(values >= levels[middle]), stride) is not None else (low, middle)
        progress(done + 1, total)
    if low < 0:
        return None
    level = levels[low]
    left, calmer = _unrolled(values >= level), _unrolled(values >= (KEPT * level if level > 0 else level))
    while stride > 0 and _struck(calmer, stride - 1) is not None:
        left, stride = calmer, stride - 1
    columns = _chosen(left, stride)
    around = values.shape[2]
    picked = np.take_along_axis(values, (columns % around)[:, :, None], 2)
    return Sheet(float(picked.min()), columns, stride)


def _unrolled(is_open: Array) -> Array:
    """(rays, rows, 3 columns): from a whole turn below the columns at the pole to a whole turn above; one pole for all rays."""
    around = is_open.shape[2]
    found = np.tile(is_open, 3)
    found[:, 0, :around] = found[:, 0, 2 * around :] = False
    found[:, 0] &= found[:, 0].all(axis=0)
    return found


def _struck(left: Array, stride: int) -> Array | None:
    """What is left when columns without partners at some neighbour are struck out; None where a node keeps none."""
    while True:
        wide = _widened(left, stride)
        new = left & np.roll(wide, 1, axis=0) & np.roll(wide, -1, axis=0)
        new[:, 1:] &= wide[:, :-1]
        new[:, :-1] &= wide[:, 1:]
        new[:, 0] &= new[:, 0].all(axis=0)
        if not new.any(axis=2).all():
            return None
        if np.array_equal(new, left):
            return left
        left = new


def _widened(nodes: Array, stride: int) -> Array:
    """Columns with an open one at most so far away."""
    found = nodes.copy()
    for k in range(1, stride + 1):
        found[..., k:] |= nodes[..., :-k]
        found[..., :-k] |= nodes[..., k:]
    return found


def _chosen(left: Array, stride: int) -> Array:
    """(rays, rows) one of the sheets: halfway between the lowest and the greatest, where that is allowed, else the greatest."""
    found = _struck(left, stride)
    assert found is not None
    own = np.flatnonzero(found[0, 0])
    for column in own[np.argsort(np.abs(own - own[len(own) // 2]), kind="stable")]:
        tried = found.copy()
        tried[:, 0] = False
        tried[:, 0, column] = True
        fixed = _struck(tried, stride)
        if fixed is not None:
            found = fixed
            break
    size = found.shape[2]
    greatest, lowest = size - 1 - found[..., ::-1].argmax(axis=2), found.argmax(axis=2)
    middle = (greatest + lowest) // 2
    is_allowed = np.take_along_axis(left, middle[:, :, None], 2).all()
    columns: Array = (middle if is_allowed else greatest) - size // 3
    return columns
