"""Which drives of a machine can be locked so that the platform keeps its six freedoms, each driven by one of those left."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.freedoms import Freedoms, Sampled, ranked, wrenches
from trivet.model import Machine
from trivet.model.elements import Drivable
from trivet.space.frame import Frame
from trivet.study.machines import MachineLike, choose

Array = NDArray[Any]

MOST_SETS = 5000
"""Sets that are looked at, at most."""
PURE = 1e-6
"""Part of a wrench, over the whole of it, that is rounding."""


@dataclass(frozen=True)
class LockSet:
    """As many drives locked as there are to spare, and what that leaves."""

    drives: tuple[str, ...]
    """The locked ones: "leg-1.guide"."""
    platform: int
    """Freedoms of the platform."""
    loose: Mapping[str, int]
    """Chains that keep motions of their own which drives would move, and how many."""
    is_whole: bool
    """Whether the platform keeps six freedoms, each driven by one of the drives that are left."""
    at_home: int | None
    """Freedoms of the platform at the machine's home, with the drives where its file locks them: fewer where home is singular
    for the set.  None where it does not close there."""
    verdict: str
    """What it leaves, or what is wrong with it, in words."""
    group: int
    """Sets of one number become each other when the machine is turned about z by its symmetry."""

    @property
    def name(self) -> str:
        """As people write it."""
        return " ".join(self.drives)


@dataclass(frozen=True)
class LockSets:
    """All sets of drives to lock."""

    machine: Machine
    """With its drives free."""
    drives: tuple[str, ...]
    """All of them."""
    spare: int
    """Drives beyond the six freedoms."""
    symmetry: int
    """Number of turns about z, in a full one, that put every chain in the place of its copy."""
    sets: tuple[LockSet, ...]

    @cached_property
    def whole(self) -> tuple[LockSet, ...]:
        """Those that leave six freedoms."""
        return tuple(one for one in self.sets if one.is_whole)

    @property
    def groups(self) -> dict[int, tuple[LockSet, ...]]:
        """The sets by their group, in order."""
        found: dict[int, list[LockSet]] = {}
        for one in self.sets:
            found.setdefault(one.group, []).append(one)
        return {group: tuple(own) for group, own in found.items()}


def lock_sets(machine: MachineLike) -> LockSets:
    """All sets of drives that can be locked for the surplus of a machine, and what each of them leaves.

    Args:
        machine: machine, name or file, with more drives than its platform has freedoms; which of them its file locks matters
            for what is told of home alone.

    Raises:
        InputError: for a machine without a drive to spare, without six freedoms, or with too many sets.
        NoResultError: the machine closes at no pose near home.
    """
    chosen = choose(machine)
    free = chosen.with_free_drives()
    drives = drives_of(free)
    spare = len(drives) - 6
    if spare < 1:
        raise InputError(f"{free.name}: has {len(drives)} drives, none to spare; to lock one takes more than six")
    if math.comb(len(drives), spare) > MOST_SETS:
        raise InputError(
            f"{free.name}: {len(drives)} drives make {math.comb(len(drives), spare)} sets of {spare} to lock; "
            f"at most {MOST_SETS} are looked at"
        )
    sampled = Sampled.of(chosen)
    found = sampled.freedoms([()] * len(free.legs)).platform
    if found < 6:
        raise InputError(f"{free.name}: with all drives free the platform has {found} freedoms; six are expected")
    symmetry = reduce(math.gcd, (chain.copies for chain in free.chains.values()))
    groups: dict[tuple[str, ...], int] = {}
    made = []
    for names in combinations(drives, spare):
        turns = [_sorted(drives, [_turned(free, name, k, symmetry) for name in names]) for k in range(symmetry)]
        group = groups.setdefault(min(turns, key=lambda turn: [drives.index(n) for n in turn]), len(groups) + 1)
        made.append(_lock_set(sampled, names, group))
    return LockSets(free, tuple(drives), spare, symmetry, tuple(made))


def drives_of(machine: Machine) -> list[str]:
    """Every drive of a machine, locked or not, chain by chain: "leg-1.guide"."""
    return [
        f"{leg.name}.{e.name}" for leg in machine.legs for e in leg.chain.elements if isinstance(e, Drivable) and e.actuated
    ]


def with_drives_locked(machine: Machine, coordinates: Mapping[str, float]) -> Machine:
    """A machine with these drives locked (m or rad), by "leg-1.guide", and no others; what else is locked stays so."""
    free = machine.with_free_drives()
    touched = {name.partition(".")[0] for name in coordinates}
    kept = {
        f"{leg.name}.{e.name}": float(e.locked)
        for leg in free.legs
        for e in leg.chain.elements
        if leg.name in touched and isinstance(e, Drivable) and e.locked is not None
    }
    return free.with_locks(kept | dict(coordinates))


def _lock_set(sampled: Sampled, drives: tuple[str, ...], group: int) -> LockSet:
    legs = sampled.machine.legs
    held = [{n.partition(".")[2] for n in drives if n.partition(".")[0] == leg.name} for leg in legs]
    left = sampled.freedoms(held)
    stopped = sampled.freedoms([set(own.drives) for own in sampled.chains])
    loose = {leg.name: n - idle for leg, n, idle in zip(legs, left.loose, stopped.loose, strict=True) if n > idle}
    is_whole = left.platform == 6 and not loose and stopped.platform == 0
    at_home = sampled.freedoms(held, first_alone=True).platform if sampled.is_home else None
    return LockSet(drives, left.platform, loose, is_whole, at_home, _verdict(sampled, held, left, loose, stopped), group)


def _verdict(sampled: Sampled, held: list[set[str]], left: Freedoms, loose: Mapping[str, int], stopped: Freedoms) -> str:
    said = []
    for k, leg in enumerate(sampled.machine.legs):
        at = sampled.generic(k, held[k])
        columns = sampled.screws[at][k].free(held[k])
        lost = 6 - ranked(columns)
        if lost == 1:
            said.append(f"{leg.name} stops {_lost(wrenches(columns)[:, 0], sampled, at)}")
        elif lost:
            said.append(f"{leg.name} takes {lost} freedoms of the platform")
    if left.platform < 6 and not said:
        said.append(f"the chains together leave the platform {left.platform} freedoms")
    said += [f"{name} moves by itself" + (f" in {n} ways" if n > 1 else "") for name, n in loose.items()]
    if stopped.platform:
        said.append(f"with all drives stopped the platform still has {stopped.platform} freedoms")
    return "; ".join(said) if said else "six freedoms, six drives"


def _lost(wrench: Array, sampled: Sampled, at: int) -> str:
    """The motion that a wrench forbids, at one of the poses; said where that is not home."""
    length, pose = float(sampled.machine.characteristic_length), sampled.poses[at]
    force, moment = wrench[:3], wrench[3:] * length
    beside = "" if at == 0 and sampled.is_home else " at a pose beside home"
    sense = math.copysign(1.0, wrench[np.argmax(np.abs(wrench).round(9))])
    if np.linalg.norm(force) < PURE:
        return f"turns about {_direction(sense * moment)}{beside}"
    size = float(np.linalg.norm(force))
    point = _centre(pose) + np.cross(force, moment) / size**2
    x, y, z = (f"{1e3 * c + 0.0:.1f}" for c in point.round(9))
    words = f"motion along {_direction(sense * force)} through ({x}, {y}, {z}) mm{beside}"
    pitch = float(force @ moment) / size**2
    return words if abs(pitch) < PURE * length else f"{words}, unless it turns by the way over {-1e3 * pitch:.4g} mm"


def _direction(vector: Array) -> str:
    return "({:.2f}, {:.2f}, {:.2f})".format(*((vector / np.linalg.norm(vector)).round(2) + 0.0))


def _centre(pose: Frame) -> Array:
    return np.array([float(c) for c in pose.origin])


def _turned(machine: Machine, drive: str, turns: int, symmetry: int) -> str:
    """The drive that takes the place of another when the machine is turned."""
    leg, _, joint = drive.partition(".")
    for name, chain in machine.chains.items():
        own = _names(name, chain.copies)
        if leg in own:
            return f"{own[(own.index(leg) + turns * chain.copies // symmetry) % chain.copies]}.{joint}"
    raise AssertionError(drive)


def _names(name: str, copies: int) -> list[str]:
    return [f"{name}-{k + 1}" for k in range(copies)] if copies > 1 else [name]


def _sorted(drives: list[str], names: list[str]) -> tuple[str, ...]:
    return tuple(sorted(names, key=drives.index))
