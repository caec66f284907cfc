"""How a whole machine stands at one pose: in closed form in a working mode, or, failing that, closed numerically."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import NoResultError
from trivet.kinematics.closure import close_machine, posture_of
from trivet.kinematics.inverse import inverse
from trivet.kinematics.walk import Posture, walk_from
from trivet.model import Leg, Machine
from trivet.model.elements import Element
from trivet.space.frame import IDENTITY, Frame
from trivet.space.pose import zyz_frame


class Standing(NamedTuple):
    """One chain where it stands."""

    leg: Leg
    posture: Posture
    steps: tuple[tuple[Element, Frame, Any], ...]
    """Every element with the frame in which it starts, in {O}, and its coordinate."""


def home_pose(machine: Machine) -> Frame:
    """The platform frame at home."""
    home = machine.home
    return zyz_frame(home.position, home.azimuth, home.tilt, home.roll)


def postures(machine: Machine, pose: Frame, signs: Any) -> tuple[Posture, ...]:
    """The posture of every chain.

    Args:
        machine: the machine.
        pose: platform frame {E} in {O}, m; of floats where signs is None.
        signs: (n_chains, 2) working mode, or None for a machine that has none (`mode.parse_mode`): its chains are closed
            numerically.

    Raises:
        NoResultError: a chain does not close numerically.
    """
    if signs is None:
        return tuple(posture_of(leg, pose, c) for leg, c in zip(machine.legs, close_machine(machine, pose), strict=True))
    with np.errstate(all="ignore"):  # what does not reach is told by `reach`, of plain numbers as of traced ones
        return tuple(inverse(leg, pose, signs[index]) for index, leg in enumerate(machine.legs))


def stand(machine: Machine, pose: Frame, signs: Any) -> tuple[Standing, ...]:
    """Every chain of a machine with its elements in {O}.

    Args:
        machine, pose, signs: as for `postures`; components of the pose are numbers, or arrays of one batch shape.

    Raises:
        NoResultError: a chain does not reach the pose (travel limits are not looked at).
    """
    found = []
    for leg, posture in zip(machine.legs, postures(machine, pose, signs), strict=True):
        if not np.all(np.asarray(posture.reach) >= 0):
            raise NoResultError(f"{machine.name}: chain {leg.name} does not reach the pose in this working mode")
        steps = walk_from(leg.base_frame(), leg.chain.elements, posture.coordinates)
        found.append(Standing(leg, posture, tuple(steps)))
    return tuple(found)


class Bodies(NamedTuple):
    """Where all bodies of a machine are."""

    frames: Any
    """(n, 4, 3) origin (m) and axes in {O}: of the ground, of the platform, then of every element of every chain, where it
    starts and where it ends (`GROUND`, `PLATFORM`, `starts`)."""
    reach: Any
    """(n_chains,) below zero where a chain cannot close (m^2)."""


GROUND, PLATFORM = 0, 1
"""Numbers of the first two frames."""


def starts(machine: Machine) -> tuple[int, ...]:
    """Per chain the number of the frame in which its first element starts; the next is where it ends, and so on."""
    numbers = [2]
    for leg in machine.legs:
        numbers.append(numbers[-1] + 2 * len(leg.chain.elements))
    return tuple(numbers[:-1])


def bodies(machine: Machine, pose: Frame, signs: Any) -> Bodies:
    """Where all bodies of a machine are at one pose of floats; what does not reach is NaN.

    Args:
        machine, pose, signs: as for `postures`.

    Raises:
        NoResultError: a chain does not close numerically.
    """
    legs = machine.legs
    found = Bodies(*_closed(legs, pose, signs)) if signs is not None else _placed(legs, pose, postures(machine, pose, None))
    return Bodies(np.asarray(found.frames), np.asarray(found.reach))


@jax.jit
def _closed(legs: tuple[Leg, ...], pose: Frame, signs: Any) -> Bodies:
    return _placed(legs, pose, tuple(inverse(leg, pose, signs[index]) for index, leg in enumerate(legs)))


def _placed(legs: tuple[Leg, ...], pose: Frame, found: tuple[Posture, ...]) -> Bodies:
    frames = [IDENTITY, pose]
    for leg, posture in zip(legs, found, strict=True):
        steps = walk_from(leg.base_frame(), leg.chain.elements, posture.coordinates)
        for element, frame, coordinate in steps[:-1]:
            frames += [frame, element.advance(frame, coordinate)]
        frames += [steps[-1][1], pose.place(leg.platform_frame())]
    table = [[[jnp.asarray(c, dtype=float) for c in v] for v in frame] for frame in frames]
    return Bodies(jnp.array(table), jnp.array([posture.reach for posture in found]))
