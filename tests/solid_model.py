"""The proposed machine as solid bodies in CalculiX, from plain dimensions in SI and nothing of ours.

Tubes are structured meshes of 20-node bricks.  Their end sections follow a point with six freedoms as beam theory has it: they
stay plane, and are otherwise free.  Against that, rigid ones would hold back Poisson's contraction and raise the frequencies by
0.1 to 0.6 %, ones that may warp would lower them by 0.1 to 1.9 %.
"""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np

# Corners, then middles of edges of a brick in the order of CalculiX, in half elements (through the wall, around, along).
BRICK = (
    *((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)),
    *((1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)),
    *((0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)),
)


class Tripod(NamedTuple):
    """The machine at home, drives locked: radial tube, hinge, link, ball, platform; m, Pa, kg/m^3."""

    guide: float = 0.162
    ball: float = 0.018
    link: float = 0.216
    height: float = 0.130
    outer: float = 0.019
    inner: float = 0.014
    disc: float = 0.018
    thickness: float = 0.010
    young: float = 205e9
    poisson: float = 0.29
    density: float = 7870.0


class Mesh(NamedTuple):
    """Elements through the wall and around of all tubes, along the radial tube and along the link."""

    wall: int
    around: int
    radial: int
    link: int


class Point(NamedTuple):
    """A point with six freedoms: the node of its displacement, and the node whose displacement is its rotation."""

    place: int
    turn: int


class Model:
    """Nodes, bricks and equations of a machine, numbered as they come."""

    def __init__(self, tripod: Tripod, mesh: Mesh) -> None:
        self.tripod, self.mesh = tripod, mesh
        self.nodes: list[np.ndarray] = []
        self.bricks: list[list[int]] = []
        self.equations: list[str] = []
        self.fixed: list[Point] = []
        self.balls: list[int] = []
        up = np.array([0.0, 0.0, 1.0])
        for azimuth in np.radians([0, 120, 240]):
            out, aside = np.array([np.cos(azimuth), np.sin(azimuth), 0]), np.array([-np.sin(azimuth), np.cos(azimuth), 0])
            knee = (tripod.ball + np.sqrt(tripod.link**2 - tripod.height**2)) * out
            ball = tripod.ball * out + tripod.height * up
            foot, before = self.tube(tripod.guide * out, knee, aside, mesh.radial)
            after, tip = self.tube(knee, ball, aside, mesh.link, before.place)
            # The hinge: about all but e_t the link turns with the radial tube.
            self.tie(np.array([[*out, *-out], [*up, *-up]]), freedoms(after.turn, before.turn), 3)
            self.fixed.append(foot)
            self.balls.append(tip.place)  # its rotations stay free
        self.centre = self.point(tripod.height * up)
        self.weights = [self.node(tripod.height * up + arm) for arm in weights_of(tripod)]

    def node(self, at: np.ndarray) -> int:
        self.nodes.append(at)
        return len(self.nodes)

    def point(self, at: np.ndarray) -> Point:
        return Point(self.node(at), self.node(at))

    def tube(self, start: np.ndarray, end: np.ndarray, aside: np.ndarray, count: int, hinge: int = 0) -> tuple[Point, Point]:
        """A tube between two places; the points of its ends.  The first one takes the node `hinge`, if any, for its place."""
        axis = (end - start) / np.linalg.norm(end - start)
        wall, ring = 2 * self.mesh.wall, 2 * self.mesh.around
        found: dict[tuple[int, ...], int] = {}
        for place in np.ndindex(wall + 1, ring, 2 * count + 1):
            if sum(i % 2 for i in place) < 2:  # no nodes in the middle of faces and bricks
                radius = self.tripod.inner / 2 + (self.tripod.outer - self.tripod.inner) / 2 * place[0] / wall
                angle = 2 * np.pi * place[1] / ring
                across = np.cos(angle) * aside + np.sin(angle) * np.cross(axis, aside)
                found[place] = self.node(start + (end - start) * place[2] / (2 * count) + radius * across)
        for i, j, k in np.ndindex(self.mesh.wall, self.mesh.around, count):
            self.bricks.append([found[2 * i + a, (2 * j + b) % ring, 2 * k + c] for a, b, c in BRICK])
        first = Point(hinge, self.node(start)) if hinge else self.point(start)
        last = self.point(end)
        for layer, point in ((0, first), (2 * count, last)):
            shares = {node: self.share(place[0], place[1]) for place, node in found.items() if place[2] == layer}
            self.section(shares, axis, point)
        return first, last

    def share(self, i: int, j: int) -> float:
        """Share of a node in an even load on its section: of the load on an 8-node face corners take -1/12, mid-edges 1/3."""
        faces = (1 if i in (0, 2 * self.mesh.wall) or i % 2 else 2) * (2 - j % 2)
        return faces / 3 if (i + j) % 2 else -faces / 12

    def section(self, shares: dict[int, float], axis: np.ndarray, point: Point) -> None:
        """Keep a section plane; within its plane only its mean displacement and its mean turn follow the point."""
        nodes, weight = list(shares), np.array([*shares.values()])[:, None] / sum(shares.values())
        arms = np.array([self.nodes[node - 1] for node in nodes]) - self.nodes[point.place - 1]
        across = arms[0] / np.linalg.norm(arms[0])
        # By condition, node, direction: what is zero in sum when the section stays where it is.
        plane = [row[:, None] * axis for row in np.eye(len(nodes))]
        mean = [weight * way for way in (across, np.cross(axis, across), np.cross(axis, arms) / self.tripod.outer)]
        rates = np.array([*plane, *mean])
        # A rigid motion u + w x arm is free.
        moved, turned = rates.sum(axis=1), np.cross(arms, rates).sum(axis=1)
        rows = np.hstack((rates.reshape(len(rates), -1), -moved, -turned))
        self.tie(rows, freedoms(*nodes, *point), 3 * len(nodes))

    def tie(self, rows: np.ndarray, dofs: list[str], dependent: int) -> None:
        """Make rows times freedoms zero.

        CalculiX wants each equation solved for a freedom of its own, which occurs in no other: one of the first `dependent`.
        """
        rows, pivots = rows.copy(), []
        for number, row in enumerate(rows):
            pivots.append(int(np.argmax(np.abs(row[:dependent]))))
            row /= row[pivots[-1]]
            others = np.arange(len(rows)) != number
            rows[others] -= np.outer(rows[others, pivots[-1]], row)
        for row, pivot in zip(rows, pivots, strict=True):
            terms = [pivot, *(int(i) for i in np.flatnonzero(np.abs(row) > 1e-12) if i != pivot)]
            self.equations += ["*EQUATION", f"{len(terms)}", *(f"{dofs[i]}, {row[i]:.12e}" for i in terms)]

    def deck(self) -> list[str]:
        """Lines of the model, before any step; CalculiX reads 20 characters of a number."""
        steel, lump = self.tripod, len(self.bricks) + 1
        mass = steel.density * np.pi * steel.disc**2 * steel.thickness
        return [
            "*NODE, NSET=ALL",
            *(f"{number}, " + ", ".join(f"{x:.12e}" for x in at) for number, at in enumerate(self.nodes, 1)),
            "*ELEMENT, TYPE=C3D20R, ELSET=TUBES",
            *(f"{number}, {listed(nodes[:10])},\n{listed(nodes[10:])}" for number, nodes in enumerate(self.bricks, 1)),
            "*ELEMENT, TYPE=MASS, ELSET=WEIGHTS",
            *(f"{number}, {node}" for number, node in enumerate(self.weights, lump)),
            f"*MASS, ELSET=WEIGHTS\n{mass / len(self.weights):.12e}",
            f"*NSET, NSET=PLATFORM\n{listed([*self.balls, *self.weights])}",
            f"*NSET, NSET=CENTRE\n{listed(self.centre)}",
            f"*RIGID BODY, NSET=PLATFORM, REF NODE={self.centre.place}, ROT NODE={self.centre.turn}",
            *self.equations,
            f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{steel.young}, {steel.poisson}\n*DENSITY\n{steel.density}",
            "*SOLID SECTION, ELSET=TUBES, MATERIAL=STEEL",
            *(f"*BOUNDARY\n{node}, 1, 3" for point in self.fixed for node in point),
        ]


def weights_of(tripod: Tripod) -> np.ndarray:
    """Where six equal masses, in pairs on the axes of the platform, have the inertia of its disc (m, from the centre)."""
    polar, across = tripod.disc**2 / 2, tripod.disc**2 / 4 + tripod.thickness**2 / 12
    level, upright = np.sqrt(1.5 * polar), np.sqrt(3 * across - 1.5 * polar)
    half = np.diag([level, level, upright])
    return np.concatenate((half, -half))


def freedoms(*nodes: int) -> list[str]:
    return [f"{node}, {direction}" for node in nodes for direction in (1, 2, 3)]


def listed(numbers: tuple[int, ...] | list[int]) -> str:
    return ", ".join(map(str, numbers))


def frequency_deck(model: Model, count: int) -> str:
    """The first modes of the machine, without damping."""
    return "\n".join((*model.deck(), "*STEP", f"*FREQUENCY, STORAGE=YES\n{count}", "*END STEP", ""))


def frf_deck(model: Model, count: int, damping: float, low: float, high: float, points: int) -> str:
    """Responses of the platform's centre to unit forces (N) in x, y, z and moments (N m) about them, by superposition of modes.

    CalculiX sets the points, evenly and ends included, on every interval between natural frequencies from `low` to `high` (Hz).
    The two frequencies of a symmetric pair, which rounding may set apart, can make an interval too.
    """
    steps = []
    for load in freedoms(*model.centre):
        steps += ["*STEP", f"*STEADY STATE DYNAMICS\n{low}, {high}, {points}, 1.", f"*MODAL DAMPING\n1, {count}, {damping}"]
        steps += [f"*CLOAD, OP=NEW\n{load}, 1.", "*NODE PRINT, NSET=CENTRE\nU", "*END STEP"]
    return "\n".join((frequency_deck(model, count) + steps[0], *steps[1:], ""))


def run(deck: str, folder: Path) -> str:
    """Run CalculiX on one processor (test processes are many) and give its table of results."""
    (folder / "machine.inp").write_text(deck)
    one = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(["ccx", "machine"], cwd=folder, env=one, capture_output=True, text=True, check=False)
    if "Job finished" not in done.stdout or "*ERROR" in done.stdout:
        raise RuntimeError(done.stdout[-2000:])
    return (folder / "machine.dat").read_text()


def frequencies(printed: str) -> np.ndarray:
    """Natural frequencies (Hz), in order."""
    table = printed.split("E I G E N V A L U E   O U T P U T")[1].split("P A R T I C I P A T I O N")[0]
    return np.array([float(line.split()[3]) for line in table.splitlines() if re.match(r" +\d+ ", line)])


def response(printed: str) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (Hz), and compliances by frequency, motion and load (m and rad per N and N m)."""
    number = r" +(\S+)"
    block = re.compile(rf" displacements .* time{number}\n\n +\d+{3 * number}\n +\d+{3 * number}\n")
    found = np.array(block.findall(printed), float)  # per load and frequency the real part and then the imaginary one
    real, imaginary = found.reshape(6, -1, 2, 7).transpose(2, 0, 1, 3)
    return real[0, :, 0], (real + 1j * imaginary)[..., 1:].transpose(1, 2, 0)
