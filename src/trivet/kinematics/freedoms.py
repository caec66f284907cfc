"""Freedoms of platform and chains with some drives held: ranks of joint screws, whatever the chains are made of.

A chain moves the platform along the span of the screws of its joints that are free; the platform has what is common to all
chains.  In numbers, with S_k the screws of chain k at the platform centre and N_k the wrenches that do no work on them,

    freedoms of all loops = 6 + sum of columns of S_k - (sum of rank S_k + rank [N_1 N_2 ...]),

of which a chain has (columns of S_k - rank S_k) on its own and the platform the rest (K. Waldron, The constraint analysis of
mechanisms, J. Mech. 1, 1966).  Ranks are the greatest at several poses near home: they are the generic ones, for a singular
pose only takes rank away.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import NoResultError
from trivet.kinematics.closure import Closure, close_chain
from trivet.kinematics.walk import walk_from
from trivet.model import Leg, Machine
from trivet.model.elements import Drivable
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame

Array = NDArray[Any]

RANK = 1e-6
"""A singular value counts when it is above this part of the greatest; screws have no unit, turns count at a length."""
SAMPLES = 4
"""Poses beside home."""
ASIDE, TURNED = 0.08, 0.15
"""How far they are: parts of the characteristic length, and rad."""
JITTER = 0.2
"""Part of their travel by which drives are moved there."""


class ChainScrews(NamedTuple):
    """The joint screws of one chain at one pose, reduced at the platform centre, in {O}."""

    joints: tuple[str, ...]
    """Names of the joints, one per column."""
    drives: tuple[str, ...]
    """Those of its joints that a drive moves."""
    columns: Array
    """(6, f) velocity, and angular velocity times the characteristic length."""

    def free(self, held: Collection[str]) -> Array:
        """The columns of the joints that are not held."""
        return self.columns[:, [k for k, name in enumerate(self.joints) if name not in held]]


class Freedoms(NamedTuple):
    """What moves when some drives are held."""

    platform: int
    """Freedoms of the platform."""
    loose: tuple[int, ...]
    """Per chain: motions that it has on its own, while the platform stands still."""


@dataclass(frozen=True)
class Sampled:
    """A machine's joint screws at a few poses; the first is home where its chains close there."""

    machine: Machine
    """Its drives free."""
    poses: tuple[Frame, ...]
    screws: tuple[tuple[ChainScrews, ...], ...]
    """Per pose and chain."""
    is_home: bool = True
    """Whether the first pose is home."""

    @classmethod
    def of(cls, machine: Machine) -> Sampled:
        """At home, where drives that the machine locks stand at their locks, and beside it.

        Raises:
            NoResultError: the chains close at none of the poses.
        """
        random = np.random.default_rng(0)
        home, length, free = machine.home, float(machine.characteristic_length), machine.with_free_drives()
        poses, found = [], []
        reason, still, is_home = "", np.zeros(6), False
        for aside in [still, *random.uniform(-1, 1, (SAMPLES, 6))]:
            place = np.array(home.position, dtype=float) + ASIDE * length * aside[:3]
            angles = np.array([home.azimuth, home.tilt, home.roll]) + TURNED * aside[3:]
            pose = zyz_frame(tuple(float(c) for c in place), *(float(a) for a in angles))
            try:
                if aside is still:
                    found.append(tuple(_at_home(*legs, pose, length) for legs in zip(machine.legs, free.legs, strict=True)))
                    is_home = True
                else:
                    found.append(tuple(_screws(leg, _moved(leg, pose, length, random), pose, length) for leg in free.legs))
                poses.append(pose)
            except NoResultError as error:
                reason = str(error)
        if not found:
            raise NoResultError(f"{machine.name}: its freedoms are not known, for it closes at no pose near home: {reason}")
        return cls(free, tuple(poses), tuple(found), is_home)

    @property
    def chains(self) -> tuple[ChainScrews, ...]:
        """The chains at the first pose."""
        return self.screws[0]

    def freedoms(self, held: Sequence[Collection[str]], first_alone: bool = False) -> Freedoms:
        """What moves when joints are held, by their names, chain by chain: the generic numbers, or those of the first pose."""
        screws = self.screws[:1] if first_alone else self.screws
        per_pose = [[own.free(names) for own, names in zip(chains, held, strict=True)] for chains in screws]
        ranks = np.array([[ranked(columns) for columns in chains] for chains in per_pose])
        together = [ranked(np.hstack([wrenches(columns) for columns in chains])) for chains in per_pose]
        counts = np.array([columns.shape[1] for columns in per_pose[0]])
        loose = counts - ranks.max(axis=0)
        whole = 6 + counts.sum() - (ranks.sum(axis=1) + together).max()
        return Freedoms(int(whole - loose.sum()), tuple(loose.tolist()))

    def generic(self, number: int, held: Collection[str]) -> int:
        """Number of the first pose at which a chain with joints held has its generic rank."""
        return int(np.argmax([ranked(chains[number].free(held)) for chains in self.screws]))


def ranked(columns: Array) -> int:
    """Rank of screws (6, f), by singular values above `RANK` of the greatest."""
    if not columns.size:
        return 0
    values = np.linalg.svd(columns, compute_uv=False)
    return int(np.sum(values > RANK * values[0]))


def wrenches(columns: Array) -> Array:
    """(6, r) wrenches, orthonormal, that do no work on screws (6, f): forces, and moments over the characteristic length."""
    left = np.linalg.svd(columns, full_matrices=True)[0] if columns.size else np.eye(6)
    return left[:, ranked(columns) :]


def _jittered(leg: Leg, closed: Closure, length: float, random: np.random.Generator) -> dict[str, tuple[float, ...]]:
    moved: dict[str, tuple[float, ...]] = {}
    for e in leg.chain.elements:
        if isinstance(e, Drivable) and e.is_driven:
            span = (float(e.travel[1]) - float(e.travel[0])) if e.travel else (1.0 if e.is_angular else length)
            moved[e.name] = (closed.numbers[e.name][0] + JITTER * span * random.uniform(-1, 1),)
    return moved


def _at_home(locked: Leg, free: Leg, pose: Frame, length: float) -> ChainScrews:
    """Drives at their locks where the chain closes with them."""
    try:
        return _screws(free, close_chain(locked, pose), pose, length)
    except NoResultError:
        return _screws(free, close_chain(free, pose), pose, length)


def _moved(leg: Leg, pose: Frame, length: float, random: np.random.Generator) -> Closure:
    """With drives, where they are more than the pose decides, moved at random: the middle of a travel is seldom generic."""
    closed = close_chain(leg, pose)
    with suppress(NoResultError):
        closed = close_chain(leg, pose, closed.numbers | _jittered(leg, closed, length, random))
    return closed


def _screws(leg: Leg, closed: Closure, pose: Frame, length: float) -> ChainScrews:
    names, drives, columns = [], [], []
    for element, frame, coordinate in walk_from(leg.base_frame(), leg.chain.elements, closed.coordinates):
        for twist in element.freedoms(frame, coordinate, pose.origin):
            names.append(element.name)
            columns.append([*twist.linear, *(length * c for c in twist.angular)])
        if isinstance(element, Drivable) and element.is_driven:
            drives.append(element.name)
    made = np.array([[float(c) for c in column] for column in columns]).reshape(-1, 6).T
    return ChainScrews(tuple(names), tuple(drives), made)
