"""The textbook way through the three-circles problem: one polynomial of degree 16 in exp(i phi_1), and its companion matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from trivet.kinematics.circles import Circles

NODES = 17


def first_angles(circles: Circles) -> Any:
    """phi_1 (n, 16) of all solutions, complex, rad."""
    node = np.exp(2j * np.pi * np.arange(NODES) / NODES)
    z = np.broadcast_to(node, (len(circles.distance), NODES))
    # Quadratics in the second and third unknown, a u^2 + b u + c, at every node.
    second, third = _quadratic(circles, 0, 1, 0, z), _quadratic(circles, 0, 2, 2, z)
    value = second[0] ** 4 * third[0] ** 4
    for u in _roots(second):
        for v in _roots(third):
            value = value * _pair(circles, 1, 2, 1, u, v) * u * v
    coefficients = np.fft.fft(value * z**8, axis=1) / NODES
    return np.array([-1j * np.log(np.roots(row[::-1])) for row in coefficients])


def _point(circles: Circles, k: int, z: Any) -> Any:
    """Point on a circle for z = exp(i phi), complex (n, nodes, 3)."""
    centre, cosine, sine = (a[:, k, None, :] for a in (circles.centre, circles.cosine, circles.sine))
    return centre + ((z + 1 / z) / 2)[..., None] * cosine + ((z - 1 / z) / 2j)[..., None] * sine


def _pair(circles: Circles, i: int, j: int, side: int, u: Any, v: Any) -> Any:
    apart = _point(circles, i, u) - _point(circles, j, v)
    return np.sum(apart * apart, axis=-1) - circles.distance[:, side, None] ** 2


def _quadratic(circles: Circles, i: int, j: int, side: int, z: Any) -> tuple[Any, Any, Any]:
    """The pair equation times the unknown of circle j, through its values at 1, -1 and i."""
    at = [_pair(circles, i, j, side, z, np.full_like(z, u)) * u for u in (1.0, -1.0, 1j)]
    b = (at[0] - at[1]) / 2
    total, difference = (at[0] + at[1]) / 2, at[2] - 1j * b  # a + c, c - a
    return (total - difference) / 2, b, (total + difference) / 2


def _roots(quadratic: tuple[Any, Any, Any]) -> tuple[Any, Any]:
    a, b, c = quadratic
    root = np.sqrt(b * b - 4 * a * c)
    return (-b + root) / (2 * a), (-b - root) / (2 * a)
