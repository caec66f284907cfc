"""An existing homotopy solver (POLSYS_PLP by way of pypolsys, when it is installed) on the three-circles problem."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from trivet.kinematics.circles import Circles


def solve_some(circles: Circles, count: int) -> tuple[float, int]:
    """Solves per second, and how many of the first `count` problems came out with 16 different finite solutions.

    In t_i = tan(phi_i / 2), three biquadratic polynomials, three-homogeneous start system (16 paths).
    """
    import pypolsys
    import sympy

    t = sympy.symbols("t1:4")
    complete, elapsed = 0, 0.0
    for k in range(count):
        polynomials = [_polynomial(circles, k, pair, t) for pair in ((0, 1, 0), (1, 2, 1), (2, 0, 2))]
        system = pypolsys.utils.fromSympy(polynomials)
        partition = pypolsys.utils.make_mh_part(3, [[1], [2], [3]])
        start = time.perf_counter()
        pypolsys.polsys.init_poly(*system)
        pypolsys.polsys.init_partition(*partition)
        pypolsys.polsys.solve(1e-8, 1e-14, 0.0)
        elapsed += time.perf_counter() - start
        roots = pypolsys.polsys.myroots
        finite = np.abs(roots[3]) > 1e-8 * np.abs(roots[:3]).max(axis=0)
        found = (roots[:3] / roots[3]).T[finite]
        apart = np.abs(found[:, None] - found[None]).max(axis=2) + np.eye(len(found))
        complete += len(found) == 16 and apart.min() > 1e-9
    return count / elapsed, complete


def _polynomial(circles: Circles, k: int, pair: tuple[int, int, int], t: Any) -> Any:
    """The equation of a pair times (1 + t_i^2)(1 + t_j^2), through its values at t = 0, 1 and -1."""
    import sympy

    i, j, side = pair
    nodes = np.array([0.0, 1.0, -1.0])
    points = [
        circles.centre[k, c] * (1 + nodes**2)[:, None]
        + circles.cosine[k, c] * (1 - nodes**2)[:, None]
        + circles.sine[k, c] * 2 * nodes[:, None]
        for c in (i, j)
    ]
    scale = 1 + nodes**2
    apart = points[0][:, None] / scale[:, None, None] - points[1][None] / scale[None, :, None]
    values = (np.sum(apart**2, axis=-1) - circles.distance[k, side] ** 2) * scale[:, None] * scale[None]
    inverse = np.linalg.inv(np.vander(nodes, increasing=True))
    coefficients = inverse @ values @ inverse.T / np.abs(values).max()
    return sympy.Poly(sum(float(coefficients[a, b]) * t[i] ** a * t[j] ** b for a in range(3) for b in range(3)), *t)
