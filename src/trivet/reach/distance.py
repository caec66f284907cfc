"""Signed distances between capsules (spheres among them) and boxes; below zero by how far they must be moved apart.

All are exact.  Both bodies of a pair are convex, so their distance is that of the origin from the difference of the two; where
they overlap it is minus the depth of the origin in it.  The difference of two line segments is flat and has no depth; that of a
segment and a box, or of two boxes, is bounded by faces across the axes of the boxes and across pairs of edges.

Derivatives are exact where the nearest points are unique: these are found with their derivatives stopped, for what they would
add is zero (the envelope theorem).
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp

from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

_EDGES = tuple((axis, signs) for axis in range(3) for signs in itertools.product((-1.0, 1.0), repeat=2))
"""Of a box: along which axis, and on which sides of the other two axes, in cyclic order."""


class Capsule(NamedTuple):
    """All points within a radius (m) of a line segment; a sphere where its ends are one."""

    start: Vec
    end: Vec
    radius: Scalar


class Box(NamedTuple):
    """A box about the origin of a frame, its edges along the axes."""

    frame: Frame
    half: Vec
    """Half its size along each axis, m."""


def capsules(one: Capsule, two: Capsule) -> Scalar:
    """Distance of two capsules."""
    return segments(one.start, one.end - one.start, two.start, two.end - two.start) - (one.radius + two.radius)


def segments(p: Vec, u: Vec, q: Vec, v: Vec) -> Scalar:
    """Distance of the segments p + s u and q + t v, 0 <= s, t <= 1 (C. Ericson, Real-Time Collision Detection, 2005, 5.1.9).

    A second projection mends what rounding spoils where the segments are nearly parallel.
    """
    r = p - q
    s, t = jax.lax.stop_gradient(_nearest(r, u, v))
    return _length(r + u * s - v * t)


def _nearest(r: Vec, u: Vec, v: Vec) -> tuple[Scalar, Scalar]:
    a, b, e, c, f = u @ u, u @ v, v @ v, u @ r, v @ r
    over = a * e - b * b
    s = _unit(_ratio(b * f - c * e, over))
    t = _unit(_ratio(b * s + f, e))
    s = _unit(_ratio(b * t - c, a))
    t = _unit(_ratio(b * s + f, e))
    return s, t


def capsule_to_box(capsule: Capsule, box: Box) -> Scalar:
    """Distance of a capsule from a box."""
    start, along = _within(box.frame, capsule.start), _turned(box.frame, capsule.end - capsule.start)
    return segment_to_box(start, along, box.half) - capsule.radius


def segment_to_box(p: Vec, d: Vec, half: Vec) -> Scalar:
    """Distance of the segment p + t d, 0 <= t <= 1, from a box about the origin with edges along x, y, z.

    The square of the distance is convex in t, with a slope that is linear between the places where the segment passes a face.
    """
    t = jax.lax.stop_gradient(_nearest_to_box(p, d, half))
    away = Vec(*(_beyond(a + t * b, h) for a, b, h in zip(p, d, half, strict=True)))
    outside = _length(away)
    return jnp.where(away @ away > 0, outside, -_depth_of_segment(p, d, half))


def _nearest_to_box(p: Vec, d: Vec, half: Vec) -> Scalar:
    def slope(t: Scalar) -> Scalar:
        return sum(b * _beyond(a + t * b, h) for a, b, h in zip(p, d, half, strict=True))

    zero = jnp.zeros_like(p.x + d.x)
    places = [zero, zero + 1] + [
        _unit(_ratio(side * h - a, b)) for a, b, h in zip(p, d, half, strict=True) for side in (-1.0, 1.0)
    ]
    low, high = zero, zero + 1
    at_low, at_high = slope(low), slope(high)
    for t in places[2:]:
        own = slope(t)
        rises = own >= 0
        nearer_low, nearer_high = ~rises & (t > low), rises & (t < high)
        low, at_low = jnp.where(nearer_low, t, low), jnp.where(nearer_low, own, at_low)
        high, at_high = jnp.where(nearer_high, t, high), jnp.where(nearer_high, own, at_high)
    between = low - at_low * _ratio(high - low, at_high - at_low)
    return jnp.where(at_low >= 0, low, jnp.where(at_high <= 0, high, between))


def _depth_of_segment(p: Vec, d: Vec, half: Vec) -> Scalar:
    """How far a segment that meets a box must be moved to leave it; NaN nowhere, and of no meaning where it does not meet."""
    middle, reach = p + d * 0.5, Vec(*(jnp.abs(c) * 0.5 for c in d))
    depths = [h + r - jnp.abs(m) for m, r, h in zip(middle, reach, half, strict=True)]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        across = jnp.hypot(d[i], d[j])  # |e_k x d|
        apart = jnp.abs(d[j] * middle[i] - d[i] * middle[j])
        depth = _ratio(half[i] * jnp.abs(d[j]) + half[j] * jnp.abs(d[i]) - apart, across)
        depths.append(jnp.where(across > 0, depth, jnp.inf))
    return _least(depths)


def boxes(one: Box, two: Box) -> Scalar:
    """Distance of two boxes.

    Apart, an edge of one is nearest to the other box: all twelve edges of each are looked at.
    """
    centre = _within(two.frame, one.frame.origin)
    axes = [_turned(two.frame, axis) for axis in one.frame[1:]]
    back = [Vec(*(axis[k] for axis in axes)) for k in range(3)]  # axes of the second in those of the first
    separation = _separation(centre, axes, one.half, two.half)
    seen_from_one = -Vec(*(centre @ axis for axis in axes))
    edges = [
        *(segment_to_box(start, along, two.half) for start, along in _edges(centre, axes, one.half)),
        *(segment_to_box(start, along, one.half) for start, along in _edges(seen_from_one, back, two.half)),
    ]
    return jnp.where(separation < 0, separation, _least(edges))


def _separation(centre: Vec, axes: list[Vec], own: Vec, half: Vec) -> Scalar:
    """Greatest gap of two boxes across the faces and pairs of edges; below zero only where they overlap."""
    found = []
    for k in range(3):
        reach = sum(h * jnp.abs(axis[k]) for h, axis in zip(own, axes, strict=True))
        found.append(jnp.abs(centre[k]) - half[k] - reach)
        turned = axes[k]
        reach = sum(h * jnp.abs(c) for h, c in zip(half, turned, strict=True))
        found.append(jnp.abs(centre @ turned) - own[k] - reach)
    units = (Vec(1, 0, 0), Vec(0, 1, 0), Vec(0, 0, 1))
    for axis in axes:
        for unit in units:
            normal = axis.cross(unit)
            size = _length(normal)
            reach = sum(h * jnp.abs(other @ normal) for h, other in zip(own, axes, strict=True))
            reach = reach + sum(h * jnp.abs(c) for h, c in zip(half, normal, strict=True))
            gap = _ratio(jnp.abs(centre @ normal) - reach, size)
            found.append(jnp.where(size > 1e-9, gap, -jnp.inf))  # parallel edges: the faces tell
    return -_least([-gap for gap in found])


def _edges(centre: Vec, axes: list[Vec], half: Vec) -> list[tuple[Vec, Vec]]:
    found = []
    for k, (first, second) in _EDGES:
        i, j = (k + 1) % 3, (k + 2) % 3
        start = centre + axes[i] * (first * half[i]) + axes[j] * (second * half[j]) - axes[k] * half[k]
        found.append((start, axes[k] * (2 * half[k])))
    return found


def _within(frame: Frame, point: Vec) -> Vec:
    return _turned(frame, point - frame.origin)


def _turned(frame: Frame, vector: Vec) -> Vec:
    return Vec(vector @ frame.x, vector @ frame.y, vector @ frame.z)


def _beyond(value: Scalar, half: Scalar) -> Scalar:
    """How far a coordinate is outside -half to half, with its sign."""
    return value - jnp.clip(value, -half, half)


def _length(v: Vec) -> Scalar:
    """Of a vector; its derivative is zero, not NaN, where it vanishes."""
    square = v @ v
    positive = square > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, square, 1.0)), 0.0)


def _ratio(above: Scalar, below: Scalar) -> Scalar:
    """Zero where the divisor vanishes."""
    fine = below != 0
    return jnp.where(fine, above / jnp.where(fine, below, 1.0), 0.0)


def _unit(value: Scalar) -> Scalar:
    return jnp.clip(value, 0.0, 1.0)


def _least(values: list[Scalar]) -> Scalar:
    found = values[0]
    for value in values[1:]:
        found = jnp.minimum(found, value)
    return found
