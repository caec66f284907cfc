"""Where on a machine measured points lie: a file of the test set-up (TOML, with units), and the points in {O}."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from trivet.errors import InputError, NoResultError
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.report import joint_state_once, shortfall
from trivet.measure.functions import Channel, Functions
from trivet.model import Machine
from trivet.model.checked import read_checked
from trivet.model.machine import turned_by
from trivet.model.quantity import AngleValue, Length, Mass
from trivet.model.section import STRICT
from trivet.space.frame import IDENTITY, Frame
from trivet.statics.assembly import Structure, assemble
from trivet.vibration.places import place_of

MOST_POINTS = 10_000
ON_PLATFORM = "platform"
_Y, _Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
SQUARE = 1e-6
"""Cosine between two axes of the measurement up to which they count as square to each other."""


@dataclass(frozen=True)
class Spot:
    """Where one measured point lies on the machine."""

    __pydantic_config__ = STRICT

    on: str = ON_PLATFORM
    """The platform, a joint ("leg-1.hinge", its side of the platform) or a share of a beam ("leg-1.link@0.5")."""
    at: tuple[Length, Length, Length] | None = None
    """On the platform: the place in {E}; where it was measured when not given."""
    mass: Mass = 0.0
    """Of a sensor that is fixed there during all measurements."""


@dataclass(frozen=True)
class Axes:
    """Where the axes of the measurement lie in {O}; as {O} when nothing is given."""

    __pydantic_config__ = STRICT

    origin: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    """In {O}."""
    x: tuple[float, float, float] = (1.0, 0.0, 0.0)
    """Direction of the x axis in {O}, of any length."""
    z: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Direction of the z axis in {O}, square to x."""

    def turn(self) -> np.ndarray:
        """(3, 3): directions from the axes of the measurement into {O}."""
        x, z = (np.array(axis, dtype=float) for axis in (self.x, self.z))
        x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
        return np.stack([x, np.cross(z, x), z], axis=1)


@dataclass(frozen=True)
class Posed:
    """The pose of the platform while it was measured; what is not given is as at home."""

    __pydantic_config__ = STRICT

    position: tuple[Length, Length, Length] | None = None
    azimuth: AngleValue | None = None
    tilt: AngleValue | None = None
    roll: AngleValue | None = None
    mode: str | None = None

    def frame(self, machine: Machine) -> Frame:
        """The platform frame, which follows the machine's home where nothing else is given; JAX may trace it."""
        home = machine.home
        given = zip((self.azimuth, self.tilt, self.roll), (home.azimuth, home.tilt, home.roll), strict=True)
        alpha, beta, gamma = (turned_by(default if angle is None else angle, 0.0) for angle, default in given)
        centre = IDENTITY.shift(home.position if self.position is None else self.position)
        return centre.turn(_Z, alpha).turn(_Y, beta).turn(_Z, gamma)


@dataclass(frozen=True)
class Setup:
    """A test set-up: where the axes of the measurement and its points lie on the machine, and where the machine stood."""

    __pydantic_config__ = STRICT

    points: Annotated[dict[str, Spot], Field(max_length=MOST_POINTS)] = field(default_factory=dict)
    """Measured points by name."""
    others: Literal["platform"] | None = None
    """Where all points lie that have no entry: on the platform, where they were measured."""
    axes: Axes = Axes()
    pose: Posed = Posed()
    format: Literal[1] = 1
    """Version of the file format."""


class Site(NamedTuple):
    """A measured point on the machine."""

    point: str
    on: str
    at: np.ndarray
    """(3,) in {O}, m."""
    measured: np.ndarray | None
    """(3,) where it was measured, in {O}, m."""
    mass: float
    """Of the sensor there, kg."""

    @property
    def distance(self) -> float:
        """From where it was measured, m; NaN where the measurement has no position."""
        return math.nan if self.measured is None else float(np.linalg.norm(self.at - self.measured))


@dataclass(frozen=True)
class Placed:
    """A machine where it was measured, with the measured points on it."""

    machine: Machine
    pose: Posed
    signs: Any
    """(n_chains, 2) working mode; None for a machine without."""
    frame: Frame
    """The platform frame."""
    turn: np.ndarray
    """(3, 3): directions from the axes of the measurement into {O}."""
    sites: Mapping[str, Site]
    idle: tuple[str, ...] = ()
    """Points of the set-up that no function has, and where no sensor stays."""

    @property
    def is_on_platform(self) -> bool:
        """Whether all sensors and all points are on the platform."""
        return all(site.on == ON_PLATFORM for site in self.sites.values())

    @property
    def centre(self) -> np.ndarray:
        """(3,) platform centre in {O}, m."""
        return np.array([float(c) for c in self.frame.origin])

    def along(self, channel: Channel) -> np.ndarray:
        """(6,) what a channel sees of a twist of its point in {O}; also the wrench of a unit load of that channel there."""
        direction = self.turn @ np.array(channel.direction, dtype=float)
        none = np.zeros(3)
        return np.concatenate([none, direction] if channel.is_rotation else [direction, none])


def read_setup(path: str | os.PathLike[str]) -> Setup:
    """Read a set-up file.

    Raises:
        InputError: with the key, the value and what was expected.
    """
    setup = read_checked(path, Setup, "a set-up file")
    try:
        check_setup(setup)
    except InputError as error:
        raise InputError(f"{os.fspath(path)}: {error}") from None
    return setup


def check_setup(setup: Setup) -> None:
    """Refuse axes that are none, and masses that no sensor has.

    Raises:
        InputError: with the key and the value.
    """
    x, z = (np.array(axis, dtype=float) for axis in (setup.axes.x, setup.axes.z))
    lengths = np.linalg.norm(x) * np.linalg.norm(z)
    if not 0 < lengths < math.inf or abs(x @ z) > SQUARE * lengths:
        raise InputError(f"axes.x and axes.z: {setup.axes.x} and {setup.axes.z} are not square to each other")
    for point, spot in setup.points.items():
        if not 0 <= spot.mass < math.inf:
            raise InputError(f"points.{point}.mass: {spot.mass:g} kg; expected 0 or more")


def placed(machine: Machine, setup: Setup, functions: Functions) -> Placed:
    """The points of all channels of some functions on a machine.

    Raises:
        InputError: for a point that the set-up does not place, or a place that the machine does not have.
        NoResultError: the pose of the set-up is not reached.
    """
    check_setup(setup)
    signs, frame = parse_mode(machine, setup.pose.mode), setup.pose.frame(machine)
    miss = shortfall(machine, joint_state_once(machine, frame, signs))
    if miss is not None:
        raise NoResultError(f"{machine.name}: the pose of the set-up is not reached: {miss.reason}")
    used = dict.fromkeys(c.point for c in (*functions.responses, *functions.references))
    heavy = [point for point, spot in setup.points.items() if spot.mass > 0]
    turn, origin = setup.axes.turn(), np.array(setup.axes.origin)
    structure: Structure | None = None
    sites = {}
    for point in (*used, *(p for p in heavy if p not in used)):
        spot = setup.points.get(point, Spot() if setup.others is not None else None)
        if spot is None:
            raise InputError(
                f'point {point}: the set-up does not say where it is; add [points.{point}], or others = "platform"'
            )
        measured = None if point not in functions.points else origin + turn @ np.array(functions.points[point])
        if spot.on == ON_PLATFORM:
            at = _on_platform(point, spot, measured, frame)
        else:
            structure = assemble(machine, frame, signs) if structure is None else structure
            at = _on_chain(point, spot, machine, frame, structure)
        sites[point] = Site(point, spot.on, at, measured, float(spot.mass))
    idle = tuple(point for point in setup.points if point not in sites)
    return Placed(machine, setup.pose, signs, frame, turn, sites, idle)


def _on_platform(point: str, spot: Spot, measured: np.ndarray | None, frame: Frame) -> np.ndarray:
    if spot.at is not None:
        return np.array([float(c) for c in frame.shift(spot.at).origin])
    if measured is None:
        raise InputError(f"point {point}: was measured without a position; give [points.{point}] at = [...], in {{E}}")
    return measured


def _on_chain(point: str, spot: Spot, machine: Machine, frame: Frame, structure: Structure) -> np.ndarray:
    if spot.at is not None:
        raise InputError(f"points.{point}.at: is for points on the platform; {spot.on} says by itself where it is")
    try:
        place = place_of(machine, frame, structure, spot.on)
    except InputError as error:
        raise InputError(f"points.{point}.on: {error}") from None
    return place.at
