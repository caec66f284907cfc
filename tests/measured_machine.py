"""A hammer test of a machine that no model here describes: solid bodies in CalculiX, on a joint model of its own.

The machine is the tripod of `solid_model`, but its feet stand on springs alike in all directions (trivet's model: along the
guide and the slide, else rigid), its balls resist turning, and its modes have one damping ratio each, as modal damping has it
(trivet's: structural).  Sensors sit on the platform and weigh; accelerances carry noise.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from solid_model import Mesh, Model, Tripod, frequencies, run

from trivet.measure.functions import Channel, Functions

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
POINTS = {
    "1": (0.018, 0.0, 0.135),
    "2": (-0.009, 0.0155, 0.135),
    "3": (-0.006, -0.011, 0.125),
    "4": (0.004, -0.015, 0.135),
    "5": (0.010, 0.009, 0.135),
}
"""In {O}, m; the platform is level, its centre at 130 mm."""
SENSORS = {"1": 0.004, "2": 0.004, "3": 0.004, "4": 0.004, "5": 0.004}
"""kg, along x, y and z, fixed during all measurements."""
REFERENCES = (("1", "z"), ("2", "x"), ("3", "y"))


class Joints(NamedTuple):
    """Springs of the machine as it stands."""

    foot: float = 2.4e6
    """N/m, alike in all directions."""
    tilt: float = 3.0e4
    """N m/rad, of a foot about all axes."""
    ball: float = 420.0
    """N m/rad, about all axes."""


class Standing(Model):
    """The tripod on its springs."""

    def __init__(self, tripod: Tripod, mesh: Mesh, joints: Joints) -> None:
        super().__init__(tripod, mesh)
        self.joints = joints

    def tube(self, start: np.ndarray, end: np.ndarray, aside: np.ndarray, count: int, hinge: int = 0):  # type: ignore[no-untyped-def]
        first, last = super().tube(start, end, aside, count, hinge)
        if hinge:
            self.tips = [*getattr(self, "tips", []), last]
        return first, last

    def deck(self) -> list[str]:
        lines = [line for line in super().deck() if not line.startswith("*BOUNDARY")]
        number = len(self.bricks) + len(self.weights) + 1
        ground = [(point.place, self.joints.foot) for point in self.fixed] + [(p.turn, self.joints.tilt) for p in self.fixed]
        for node, rate in ground:
            for axis in (1, 2, 3):
                lines += [
                    f"*ELEMENT, TYPE=SPRING1, ELSET=S{number}\n{number}, {node}",
                    f"*SPRING, ELSET=S{number}\n{axis}\n{rate}",
                ]
                number += 1
        for tip in self.tips:
            for axis in (1, 2, 3):
                lines += [
                    f"*ELEMENT, TYPE=SPRING2, ELSET=S{number}\n{number}, {tip.turn}, {self.centre.turn}",
                    f"*SPRING, ELSET=S{number}\n{axis}, {axis}\n{self.joints.ball}",
                ]
                number += 1
        return lines


class Solids(NamedTuple):
    """Modes of the machine of solids."""

    frequency: np.ndarray
    """(m,) Hz."""
    shapes: np.ndarray
    """(6, m): twists of the platform's centre, of unit modal mass."""


def modes_of_solids(joints: Joints, folder: Path, count: int = 40) -> Solids:
    """Modes in CalculiX."""
    model = Standing(Tripod(), Mesh(1, 12, 2, 14), joints)
    step = ["*STEP", f"*FREQUENCY\n{count}", "*NODE PRINT, NSET=CENTRE\nU", "*END STEP", ""]
    printed = run("\n".join((*model.deck(), *step)), folder)
    number = r" +(\S+)"
    block = re.compile(rf"displacements .* set CENTRE .*\n\n +\d+{3 * number}\n +\d+{3 * number}\n")
    shapes = np.array(block.findall(printed), dtype=float)
    return Solids(frequencies(printed), shapes.T)


def hammer_test(solids: Solids, low: float = 40.0, high: float = 900.0, lines: int = 861, noise: float = 0.03) -> Functions:
    """Accelerances between the sensors and three references, with additive noise, of so much of each function's root mean
    square, in its real and imaginary parts together."""
    frequency = np.linspace(low, high, lines)
    omega = 2 * np.pi * frequency
    own = 2 * np.pi * solids.frequency
    random = np.random.default_rng(2014)
    damping = random.uniform(0.008, 0.014, len(own))
    factors = 1 / (own**2 - omega[:, None] ** 2 + 2j * damping * own * omega[:, None])
    centre = np.einsum("ir,nr,jr->nij", solids.shapes, factors, solids.shapes)
    heavy = sum(mass * np.outer(row, row) for point, mass in SENSORS.items() for row in (along(point, a) for a in AXES))
    loaded = np.linalg.inv(np.linalg.inv(centre) - omega[:, None, None] ** 2 * heavy)
    pairs = [(Channel(p, AXES[a]), Channel(q, AXES[b])) for q, b in REFERENCES for p in SENSORS for a in AXES]
    values = []
    for response, reference in pairs:
        rows = [_row(channel) for channel in (response, reference)]
        clean = -(omega**2) * np.einsum("i,nij,j->n", rows[0], loaded, rows[1])
        error = random.normal(size=(2, lines)).T @ np.array([1, 1j]) / np.sqrt(2)
        values.append(clean + noise * np.sqrt(np.mean(np.abs(clean) ** 2)) * error)
    return Functions(
        frequency,
        np.array(values),
        ("acceleration",) * len(pairs),
        tuple(a for a, _ in pairs),
        tuple(b for _, b in pairs),
        POINTS,
        source="hammer test of solids in CalculiX",
    )


def along(point: str, axis: str) -> np.ndarray:
    """(6,) what a sensor sees of the twist of the platform's centre."""
    return _row(Channel(point, AXES[axis]))


def _row(channel: Channel) -> np.ndarray:
    way = np.array(channel.direction)
    arm = np.array(POINTS[channel.point]) - [0, 0, Tripod().height]
    return np.concatenate([way, np.cross(arm, way)])
