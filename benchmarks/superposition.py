"""Frequency responses of the paper's machine by superposition of modes in NumPy and SciPy, as fast as they go.

The structure is taken from trivet; the matrices are put together by hand for this machine, whose drives are rigid and whose
balls are free: radial beam, hinge, link, platform.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg

from trivet.statics.assembly import PLATFORM, Structure
from trivet.statics.beam_element import local_stiffness, turned
from trivet.vibration.beam_mass import local_mass
from trivet.vibration.mesh import inertia_at_node

Matrices = tuple[np.ndarray, np.ndarray]
RADIUS = 0.018
"""Length (m) by which rotations are made comparable."""
WEIGHT = np.outer(np.r_[np.ones(3), np.full(3, RADIUS)], np.r_[np.ones(3), np.full(3, RADIUS)])


class Choice(NamedTuple):
    """A mesh and a number of modes."""

    radial: int
    """Elements of a radial beam."""
    link: int
    modes: int
    corrected: bool
    """Whether the static response of the modes left out is added."""
    solver: str
    error: float

    def __str__(self) -> str:
        rest = "" if self.corrected else " without correction"
        return f"{self.radial} + {self.link} elements, {self.modes} modes{rest}, {self.solver}"


def distance(found: np.ndarray, reference: np.ndarray) -> float:
    """Greatest error of receptances (n, 6, 6) over the greatest size, rotations scaled by the platform's radius."""
    sizes = np.linalg.norm(reference * WEIGHT, axis=(1, 2))
    return float(np.linalg.norm((found - reference) * WEIGHT, axis=(1, 2)).max() / sizes.max())


def matrices(structure: Structure, radial: int, link: int) -> Matrices:
    """Stiffness and mass (q, q); the platform's twist comes first."""
    own = 6 * radial + 1 + 6 * (link - 1) + 3
    stiffness, mass = (np.zeros((6 + 3 * own, 6 + 3 * own)) for _ in range(2))
    mass[:6, :6] = inertia_at_node(structure, structure.masses[-1])
    hinges, balls = ([tie for tie in structure.connections if tie.name.endswith(name)] for name in ("hinge", "ball"))
    for leg, (hinge, ball) in enumerate(zip(hinges, balls, strict=True)):
        beam, rod = (
            dataclasses.replace(b, length=b.length / n)
            for b, n in zip(structure.beams[2 * leg : 2 * leg + 2], (radial, link), strict=True)
        )
        # Columns: platform, knee, hinge, inner nodes of the link, turn of its tip.
        ends = np.zeros((6 * link + 6, 6 + 6 + 1 + 6 * (link - 1) + 3))
        ends[:6, 6:12], ends[:6, 12] = np.eye(6), hinge.screws[:, 0]
        ends[6:-6, 13:-3] = np.eye(6 * (link - 1))
        x, y, z = ball.at - structure.nodes[PLATFORM]
        ends[-6:-3, :3], ends[-6:-3, 3:6] = np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        ends[-3:, -3:] = np.eye(3)
        first, last = 6 + leg * own, 6 + (leg + 1) * own
        near, far = slice(first, first + 6 * radial), slice(first + 6 * radial - 6, last)
        for whole, local in ((stiffness, local_stiffness), (mass, local_mass)):
            whole[near, near] += _row(turned(local(beam), beam.axes), radial)[6:, 6:]
            part = ends.T @ _row(turned(local(rod), rod.axes), link) @ ends
            whole[:6, :6] += part[:6, :6]
            whole[:6, far] += part[:6, 6:]
            whole[far, :6] += part[6:, :6]
            whole[far, far] += part[6:, 6:]
    return stiffness, mass


def _row(element: np.ndarray, count: int) -> np.ndarray:
    """Equal elements one after the other."""
    whole = np.zeros((6 * count + 6, 6 * count + 6))
    for k in range(0, 6 * count, 6):
        whole[k : k + 12, k : k + 12] += element
    return whole


def _some(stiffness: np.ndarray, mass: np.ndarray, count: int) -> Matrices:
    return scipy.linalg.eigh(stiffness, mass, subset_by_index=[0, count - 1], check_finite=False)


def _all(stiffness: np.ndarray, mass: np.ndarray, count: int) -> Matrices:
    squares, shapes = scipy.linalg.eigh(stiffness, mass, check_finite=False)
    return squares[:count], shapes[:, :count]


def _lanczos(stiffness: Any, mass: Any, count: int) -> Matrices:
    start = np.cos(np.arange(stiffness.shape[0]) ** 2)
    return scipy.sparse.linalg.eigsh(stiffness, count, mass, sigma=0.0, v0=start)


SOLVERS: dict[str, Callable[[Any, Any, int], Matrices]] = {"eigh, some": _some, "eigh, all": _all, "eigsh": _lanczos}


def superposed(
    squares: np.ndarray, shapes: np.ndarray, static: np.ndarray | None, frequency: np.ndarray, eta: float
) -> np.ndarray:
    """Receptance (n, 6, 6) of modes (6, m), and the static response of the others when it is given with that of all."""
    count = len(squares)
    factors = np.empty((len(frequency), count + 1), dtype=complex)
    np.divide(1, squares * (1 + 1j * eta) - np.square(2 * np.pi * frequency)[:, None], out=factors[:, :count])
    factors[:, count] = 1 / (1 + 1j * eta)
    dyads = np.empty((count + 1, 6, 6))
    np.multiply(shapes.T[:, :, None], shapes.T[:, None, :], out=dyads[:count])
    dyads[count] = 0 if static is None else static - (shapes / squares) @ shapes.T
    return (factors @ dyads.reshape(-1, 36)).reshape(-1, 6, 6)


class Ready(NamedTuple):
    """Matrices as a solver wants them."""

    stiffness: Any
    mass: Any
    solver: str

    @classmethod
    def of(cls, found: Matrices, solver: str) -> Ready:
        stiffness, mass = (sp.csc_matrix(m) if solver == "eigsh" else m for m in found)
        return cls(stiffness, mass, solver)

    def response(self, choice: Choice, frequency: np.ndarray, eta: float) -> np.ndarray:
        """Receptance (n, 6, 6) at the platform centre."""
        squares, shapes = SOLVERS[self.solver](self.stiffness, self.mass, choice.modes)
        return superposed(squares, shapes[:6], self.static() if choice.corrected else None, frequency, eta)

    def static(self) -> np.ndarray:
        """(6, 6) compliance at the platform centre."""
        loads = np.eye(self.stiffness.shape[0], 6)
        if self.solver == "eigsh":
            return scipy.sparse.linalg.splu(self.stiffness).solve(loads)[:6]
        factor = scipy.linalg.cho_factor(self.stiffness, check_finite=False)
        return scipy.linalg.cho_solve(factor, loads, check_finite=False)[:6]


def sufficient(
    structure: Structure, frequency: np.ndarray, reference: np.ndarray, eta: float, most: float, links: tuple[int, ...]
) -> Iterator[Choice]:
    """For every mesh of the radial beams the coarsest of the links, and the fewest modes, whose error is small enough."""
    for radial in (1, 2):
        for corrected in (True, False):
            for link in links:
                ready = Ready.of(matrices(structure, radial, link), "eigh, some")
                enough = min(60, len(ready.mass))
                squares, shapes = _some(ready.stiffness, ready.mass, enough)
                static = ready.static() if corrected else None
                errors = (
                    (m, distance(superposed(squares[:m], shapes[:6, :m], static, frequency, eta), reference))
                    for m in range(3, enough + 1)
                )
                found = next(((m, error) for m, error in errors if error <= most), None)
                if found is not None:
                    yield Choice(radial, link, found[0], corrected, "eigh, some", found[1])
                    break


def fastest(structure: Structure, choices: list[Choice], frequency: np.ndarray, eta: float) -> Choice:
    """The fastest of some choices, with the solver that is fastest for it."""
    times = {}
    for choice in choices:
        found = matrices(structure, choice.radial, choice.link)
        for solver in SOLVERS:
            ready, own = Ready.of(found, solver), choice._replace(solver=solver)
            times[own] = shortest(lambda: ready.response(own, frequency, eta))  # noqa: B023
    return min(times, key=lambda choice: times[choice])


def shortest(call: Callable[[], Any], calls: int = 7) -> float:
    """Least time of some calls."""
    times = []
    for _ in range(calls):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)
