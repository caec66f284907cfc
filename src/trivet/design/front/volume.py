"""How good fronts are: the part of a box of objectives that their designs dominate (E. Zitzler and L. Thiele, 1999)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trivet.design.front.problem import Array


class Versus(NamedTuple):
    """Two fronts against each other, in one box about both."""

    volumes: tuple[float, float]
    """Hypervolumes, parts of the box."""
    dominated: tuple[float, float]
    """The part of each front's points that points of the other dominate."""


def volume(objectives: Array, ideal: Array, reference: Array) -> float:
    """The part of the box from an ideal point (m,) to a reference point (m,) that points (n, m) dominate."""
    import moocore

    width = np.where(reference > ideal, reference - ideal, 1.0)
    places = (objectives - ideal) / width
    inside = places[np.all(places < 1, axis=1)]
    return float(moocore.hypervolume(np.maximum(inside, 0.0), ref=np.ones(len(width)))) if len(inside) else 0.0


def box(*fronts: Array, beyond: float = 0.1) -> tuple[Array, Array]:
    """Ideal and reference point (m,) of some fronts (n, m): their least values, and so much beyond their greatest."""
    every = np.concatenate(fronts)
    low, high = every.min(axis=0), every.max(axis=0)
    width = np.where(high > low, high - low, np.maximum(np.abs(high), 1.0))
    return low, high + beyond * width


def dominates(a: Array, b: Array) -> Array:
    """(n, k) whether points a (n, m) dominate points b (k, m)."""
    return np.asarray(np.all(a[:, None] <= b, axis=2) & np.any(a[:, None] < b, axis=2))


def compared(a: Array, b: Array, beyond: float = 0.1) -> Versus:
    """Two fronts (n, m) and (k, m)."""
    ideal, reference = box(a, b, beyond=beyond)
    by_a = dominates(a, b)
    by_b = dominates(b, a)
    shares = (float(by_b.any(axis=0).mean()), float(by_a.any(axis=0).mean()))
    return Versus((volume(a, ideal, reference), volume(b, ideal, reference)), shares)
