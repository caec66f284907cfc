"""Four machines of the paper in plain NumPy, every working mode, after physics.md and not after trivet: a witness for plans.

Nothing here is the project's: numbers come from the machine files by `tomllib`, joints from triangles, the rows of J_x from a
complex step through the chain forwards instead of from screws, distances from a search instead of from projections.  Where
trivet and this module agree, an error would have to be made twice, in two ways.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

CATALOGUE = Path(__file__).parents[1] / "src/trivet/catalog"
UNITS = {"mm": 1e-3, "m": 1.0, "deg": math.pi / 180}
TINY = 1e-30
"""A complex step: its square is below everything, so that derivatives have no error but rounding."""


class Machine(NamedTuple):
    """What plans of a machine hang on, SI."""

    name: str
    platform: float
    """Radius of the platform joints; J_x has its moments over it."""
    guide: float
    links: tuple[float, ...]
    travel: tuple[float, float] | None
    """Of the second drive."""
    elevation: tuple[float, float] | None
    """Of the hinge, what its link may rise above the base plane."""
    tube: float
    """Radius of links, slides and columns."""
    disc: tuple[float, float]
    """Half the width and half the thickness of the plate."""
    gap: float
    """Least distance of bodies."""


class Ball(NamedTuple):
    """A workpiece that bodies must stay clear of, m."""

    centre: np.ndarray
    radius: float


class Chain(NamedTuple):
    """A chain at poses: the coordinates of its joints, (n,) each."""

    heading: Any
    drive: Any
    angle: Any
    """Of the last link or the telescope, from -e_r upwards."""


class Met(NamedTuple):
    """What is met at poses (n,)."""

    closes: np.ndarray
    travel: np.ndarray
    """Least margin of all joints: 1 in the middle, 0 at an end (of the sine of an elevation)."""
    clearance: np.ndarray
    """m; infinite where it was not asked for."""
    sigma: np.ndarray
    determinant: np.ndarray
    joints: np.ndarray
    """(n, 9) heading, drive and angle of each chain, rad and m."""

    @property
    def inside(self) -> np.ndarray:
        """Where all joints are inside their travel."""
        return np.asarray(self.travel >= 0)

    @property
    def heading(self) -> np.ndarray:
        """(n, 3) azimuths of the carriages, rad."""
        return self.joints[:, ::3]


def read(name: str, changes: Mapping[str, Any] | None = None) -> Machine:
    """A machine of the catalogue with some values changed, "link.length": "216 mm"."""
    changes = changes or {}
    document = tomllib.loads((CATALOGUE / f"{name}.toml").read_text(encoding="utf-8"))
    elements = {element["name"]: element for element in document["chains"]["leg"]["elements"]}

    def value(table: Mapping[str, Any], place: str, key: str) -> Any:
        found = changes.get(f"{place}.{key}", table.get(key))
        found = found["value"] if isinstance(found, dict) else found
        return tuple(_si(text) for text in found) if isinstance(found, list) else None if found is None else _si(found)

    second = {"azulay": "slide", "eclipse": "column", "alizade": "telescope", "glozman": "shoulder"}[name]
    disc, tube = document["platform"]["disc"], document["sections"]["tube"]
    return Machine(
        name,
        value(document["chains"]["leg"]["platform_joint"], "platform_joint", "radius"),
        value(elements["guide"], "guide", "radius"),
        tuple(value(elements[link], link, "length") for link in ("link", "link-1", "link-2") if link in elements),
        value(elements[second], second, "travel"),
        value(elements["hinge"], "hinge", "travel"),
        value(tube, "tube", "outer_diameter") / 2,
        (value(disc, "disc", "radius"), value(disc, "disc", "thickness") / 2),
        _si(changes.get("interference.clearance", "0 mm")),
    )


def _si(text: str) -> float:
    number, unit = text.split()
    return float(number) * UNITS[unit]


def rotation(azimuth: np.ndarray, tilt: np.ndarray, roll: np.ndarray) -> np.ndarray:
    """Rz(azimuth) Ry(tilt) Rz(roll), (n, 3, 3)."""

    def about_z(angle: np.ndarray) -> np.ndarray:
        c, s, o = np.cos(angle), np.sin(angle), 0 * angle
        return np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, o + 1]]), -1, 0)

    c, s, o = np.cos(tilt), np.sin(tilt), 0 * tilt
    about_y = np.moveaxis(np.array([[c, o, s], [o, o + 1, o], [-s, o, c]]), -1, 0)
    return about_z(azimuth) @ about_y @ about_z(roll)


def inverse(machine: Machine, joint: np.ndarray, side: float, elbow: float) -> tuple[Chain, np.ndarray]:
    """The chain that ends at platform joints (n, 3) in one mode, and where it closes."""
    out = np.hypot(joint[:, 0], joint[:, 1])
    heading = np.arctan2(side * joint[:, 1], side * joint[:, 0])
    inwards, up = machine.guide - side * out, joint[:, 2]
    if machine.name == "azulay":
        sine = up / machine.links[0]
        angle = np.arctan2(sine, elbow * np.sqrt(np.maximum(1 - sine**2, 0)))
        return Chain(heading, side * out + machine.links[0] * np.cos(angle), angle), (np.abs(sine) < 1) & (out > 0)
    if machine.name == "eclipse":
        cosine = inwards / machine.links[0]
        angle = np.arctan2(elbow * np.sqrt(np.maximum(1 - cosine**2, 0)), cosine)
        return Chain(heading, up - machine.links[0] * np.sin(angle), angle), (np.abs(cosine) < 1) & (out > 0)
    far, direction = np.hypot(inwards, up), np.arctan2(up, inwards)
    if machine.name == "alizade":
        return Chain(heading, far, direction), (far > 0) & (out > 0)
    first, second = machine.links
    cosine = (first**2 + far**2 - second**2) / (2 * first * far)
    shoulder = direction + elbow * np.arccos(np.clip(cosine, -1, 1))
    angle = np.arctan2(up - first * np.sin(shoulder), inwards - first * np.cos(shoulder))
    return Chain(heading, shoulder, angle), (np.abs(cosine) < 1) & (out > 0)


def forward(machine: Machine, chain: Chain) -> list[np.ndarray]:
    """Carriage, middle hinge and platform joint, (n, 3) each, of real or complex coordinates."""
    outwards = np.stack([np.cos(chain.heading), np.sin(chain.heading), 0 * chain.heading], axis=-1)
    upwards = np.array([0.0, 0.0, 1.0])

    def leading(length: Any, angle: Any) -> Any:
        """A vector in the plane of the chain."""
        return (-length * np.cos(angle))[:, None] * outwards + (length * np.sin(angle))[:, None] * upwards

    carriage = machine.guide * outwards
    if machine.name == "azulay":
        hinge = chain.drive[:, None] * outwards
    elif machine.name == "eclipse":
        hinge = carriage + chain.drive[:, None] * upwards
    elif machine.name == "alizade":
        hinge = carriage
    else:
        hinge = carriage + leading(machine.links[0] + 0 * chain.drive, chain.drive)
    length = chain.drive if machine.name == "alizade" else machine.links[-1] + 0 * chain.drive
    return [carriage, hinge, hinge + leading(length, chain.angle)]


def rows(machine: Machine, chain: Chain, arm: np.ndarray) -> list[np.ndarray]:
    """Both rows of J_x (n, 6): forces at the platform joint that do no work on the hinge and the other drive, in the senses of
    physics.md: ahead along the guide, and along the last link."""
    slopes = []
    for k in range(3):
        moved = Chain(*(c + (1j * TINY if own == k else 0) for own, c in enumerate(chain)))
        slopes.append(forward(machine, moved)[-1].imag / TINY)
    _, hinge, joint = forward(machine, chain)
    tangent = np.stack([-np.sin(chain.heading), np.cos(chain.heading), 0 * chain.heading], axis=-1)
    found = []
    for other, ahead in ((slopes[1], tangent), (slopes[0], joint - hinge)):
        force = np.cross(other, slopes[2])
        force /= (np.linalg.norm(force, axis=1) * np.sign(np.einsum("ni,ni->n", force, ahead)))[:, None]
        found.append(np.concatenate([force, np.cross(arm, force) / machine.platform], axis=1))
    return found


def met(
    machine: Machine, position: np.ndarray, turn: np.ndarray, mode: str, *, bodies: bool = True, solid: Ball | None = None
) -> Met:
    """What is met at platform centres (n, 3) and rotations (n, 3, 3), with a solid workpiece in the way or none."""
    count = len(position)
    closes, travel = np.ones(count, dtype=bool), np.ones(count)
    matrix, joints, points = [], [], []
    for k, signs in enumerate(mode.split()):
        side, elbow = (1.0 if s == "+" else -1.0 for s in (signs + "+")[:2])
        angle = 2 * np.pi * k / 3
        arm = turn @ np.array([machine.platform * np.cos(angle), machine.platform * np.sin(angle), 0.0])
        with np.errstate(invalid="ignore", divide="ignore"):
            chain, own = inverse(machine, position + arm, side, elbow)
        closes &= own
        joints += list(chain)
        points.append(forward(machine, chain))
        off = np.linalg.norm(points[-1][-1] - position - arm, axis=1)
        assert off[own].max(initial=0.0) < 1e-12
        if machine.travel is not None:
            start = machine.guide if machine.name == "azulay" else 0.0  # where its slide's scale begins
            travel = np.minimum(travel, _margin(chain.drive - start, *machine.travel))
        if machine.elevation is not None:
            travel = np.minimum(travel, _margin(np.sin(chain.angle), *np.sin(machine.elevation)))
        with np.errstate(invalid="ignore", divide="ignore"):
            matrix += rows(machine, chain, arm)
    jacobian = np.where(closes[:, None, None], np.nan_to_num(np.stack(matrix, axis=1)), 0.0)
    clearance = _clearance(machine, points, position, turn, solid) if bodies else np.full(count, np.inf)
    values = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
    return Met(closes, np.where(closes, travel, -np.inf), clearance, values, np.linalg.det(jacobian), np.stack(joints, axis=1))


def azulay(position: np.ndarray, turn: np.ndarray, mode: str, length: float) -> Met:
    """What the paper's machine meets with links of a length (m), bodies not looked at."""
    return met(read("azulay")._replace(links=(length,)), position, turn, mode, bodies=False)


def _margin(value: np.ndarray, low: float, high: float) -> np.ndarray:
    found: np.ndarray = 1 - np.abs(value - (low + high) / 2) / ((high - low) / 2)
    return found


def _clearance(
    machine: Machine, points: list[list[np.ndarray]], position: np.ndarray, turn: np.ndarray, solid: Ball | None
) -> np.ndarray:
    """Least distance of all bodies but those that a joint connects."""
    found = np.full(len(position), np.inf)
    tubes = [[(a, b) for a, b in itertools.pairwise(chain)][machine.name == "alizade" :] for chain in points]
    for one, two in itertools.combinations(tubes, 2):
        for (a, b), (c, d) in itertools.product(one, two):
            found = np.minimum(found, segments(a, b, c, d) - 2 * machine.tube)
    half = np.array([machine.disc[0], machine.disc[0], machine.disc[1]])
    for chain in tubes:
        for ends in chain[:-1]:  # the last carries the platform
            a, b = (np.einsum("nji,nj->ni", turn, end - position) for end in ends)
            found = np.minimum(found, segment_to_box(a, b, half) - machine.tube)
    if solid is not None:
        for a, b in itertools.chain(*tubes):
            found = np.minimum(found, _point(solid.centre, a, b) - solid.radius - machine.tube)
    return found


def segments(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distances of segments ab and cd (n, 3): least of the ends' to the other one, and of the lines where these meet inside."""
    u, v, w = b - a, d - c, a - c
    found = np.min([_point(a, c, d), _point(b, c, d), _point(c, a, b), _point(d, a, b)], axis=0)
    across = np.cross(u, v)
    square = np.einsum("ni,ni->n", across, across)
    with np.errstate(invalid="ignore", divide="ignore"):
        s, t = (np.einsum("ni,ni->n", np.cross(-w, other), across) / square for other in (v, u))
        lines = np.abs(np.einsum("ni,ni->n", w, across)) / np.sqrt(square)
    crosses = (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    return np.where(crosses, np.minimum(found, np.where(crosses, lines, np.inf)), found)


def _point(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = b - a
    square = np.maximum(np.einsum("ni,ni->n", along, along), 1e-300)
    part = np.clip(np.einsum("ni,ni->n", p - a, along) / square, 0, 1)
    return np.linalg.norm(a + part[:, None] * along - p, axis=1)


def segment_to_box(a: np.ndarray, b: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Distances of segments (n, 3) from a box about the origin, zero inside: convex along the segment, by golden sections."""

    def distance(part: np.ndarray) -> np.ndarray:
        beyond = np.maximum(np.abs(a + part[:, None] * (b - a)) - half, 0)
        return np.linalg.norm(beyond, axis=1)

    golden = (math.sqrt(5) - 1) / 2
    low, high = np.zeros(len(a)), np.ones(len(a))
    for _ in range(44):
        lower, upper = high - golden * (high - low), low + golden * (high - low)
        is_lower = distance(lower) <= distance(upper)
        low, high = np.where(is_lower, low, lower), np.where(is_lower, upper, high)
    return np.min([distance(part) for part in (low, high, np.zeros(len(a)), np.ones(len(a)))], axis=0)
