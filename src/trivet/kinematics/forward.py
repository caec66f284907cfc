"""Forward kinematics: all poses which a machine can take with its drives at given coordinates (paper section 2.1).

For three chains that keep a hinge and a ball each when the drives are locked, every assembly mode is found and their number is
proved (`circles`); any other machine is solved from a starting pose (`approach`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError, nearest
from trivet.kinematics.approach import approach
from trivet.kinematics.aspect import Verdict, connected
from trivet.kinematics.circles import Circles, CircleSolutions, Status, solve
from trivet.kinematics.inverse import branches, inverse
from trivet.kinematics.jacobian import actuator_names, is_driven
from trivet.kinematics.locked import by_leg, circles_of, frames_at, hinge_place, mirror_plane
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.report import JointState, Shortfall, joint_state, joint_state_once, shortfall
from trivet.kinematics.standing import home_pose
from trivet.model import Leg, Machine
from trivet.model.elements import Drivable
from trivet.space.frame import Frame
from trivet.space.pose import zyz_angles
from trivet.space.scalar import Scalar

LARGEST = 1e3
"""Drive coordinate (m or rad) from which on digits that matter are lost."""
LOOSE = 1e-6
"""Deviation of the drives (m or rad) at a pose above which it is no solution."""

DEGENERATE = {
    Status.NO_CIRCLE: "a circle on which a ball moves has no radius, so that a hinge can take any angle",
    Status.NO_TRIANGLE: "two platform joints coincide, so that the platform can turn about the line to the third",
    Status.COAXIAL: "all hinges have one axis: what fits can turn about it",
    Status.SELF_MOTION: "the platform moves with its drives locked (self-motion): there are infinitely many poses",
    Status.INCOMPLETE: "the number of poses could not be proved: two of them coincide, or nearly",
}


@dataclass(frozen=True)
class AssemblyMode:
    """One pose which the machine can take; SI, {E} in {O}."""

    frame: Frame
    hinges: dict[str, float]
    """Angles of the passive hinges by name, rad; empty for a pose found from a starting pose."""
    mode: str
    """Working mode in which the pose lies."""
    miss: Shortfall | None
    """The joint furthest outside its travel, or None when all are inside."""
    mirror: int | None
    """Number of the mode that is its mirror image in the plane of the hinge axes, counted from 0."""
    home: Verdict
    """Whether it is connected to the home pose without crossing a singularity or a limit."""
    multiplicity: int
    """2 where two assembly modes coincide, at a singularity."""
    residual: float
    """Greatest deviation of the drives, by inverse kinematics at the pose, from their given coordinates, m or rad."""
    error: float
    """Bound of the error of the hinge angles up to a factor 2, rad; NaN where modes coincide, and from a starting pose."""

    @property
    def position(self) -> tuple[float, float, float]:
        """Platform centre in {O}, m."""
        x, y, z = (float(c) for c in self.frame.origin)
        return x, y, z

    @property
    def angles(self) -> tuple[float, float, float]:
        """alpha, beta, gamma of R = Rz(alpha) Ry(beta) Rz(gamma), rad."""
        azimuth, tilt, roll = (float(a) for a in zyz_angles(self.frame))
        return azimuth, tilt, roll


@dataclass(frozen=True)
class Forward:
    """All assembly modes at given drive coordinates."""

    machine: Machine
    drives: dict[str, float]
    """Coordinates by name, in the order of Q, m or rad."""
    modes: tuple[AssemblyMode, ...]
    """Real poses; those connected to home first, then those inside their travel, then by height."""
    expected: int | None
    """Number of complex solutions, counted with multiplicity, that theory demands; None where none tells."""
    found: int
    """Number of complex solutions found and proved to be different, counted with multiplicity."""
    remark: str
    """What keeps the number from being proved, or empty."""

    @property
    def complete(self) -> bool:
        """Whether all solutions are known to be there."""
        return self.found == self.expected


def drive_values(machine: Machine, drives: Mapping[str, float] | Sequence[float], anyway: bool = False) -> NDArray[Any]:
    """Coordinates of all drives in the order of Q, checked.

    Args:
        machine: the machine.
        drives: by name ("leg-1.slide"), or in the order of Q; m and rad.
        anyway: whether coordinates may be outside their travel.

    Raises:
        InputError: for a wrong number, an unknown or missing name, a number that is not finite or outside its travel.
    """
    names = actuator_names(machine)
    if isinstance(drives, Mapping):
        for name in drives:
            if name not in names:
                raise InputError(f"drive {name}: {machine.name} has no such drive{nearest(name, names)}")
        missing = [name for name in names if name not in drives]
        if missing:
            raise InputError(f"{machine.name}: no coordinate for {', '.join(missing)}; its drives are {', '.join(names)}")
        ordered = [drives[name] for name in names]
    else:
        ordered = list(drives)
        if len(ordered) != len(names):
            raise InputError(
                f"{machine.name}: {len(ordered)} drive coordinates, but it has {len(names)} drives: {', '.join(names)}"
            )
    values = np.array(ordered, dtype=float)
    for name, element, value in zip(names, drive_elements(machine), values, strict=True):
        _check_drive(name, element, float(value), anyway)
    return values


def drive_elements(machine: Machine) -> list[Drivable]:
    """The driven joints in the order of Q."""
    joints = {f"{leg.name}.{e.name}": e for leg in machine.legs for e in leg.chain.elements if isinstance(e, Drivable)}
    return [joints[name] for name in actuator_names(machine)]


def _check_drive(name: str, element: Drivable, value: float, anyway: bool) -> None:
    unit, scale = ("deg", math.degrees(1)) if element.is_angular else ("mm", 1e3)
    if not abs(value) < LARGEST:
        raise InputError(f"drive {name}: {value:g} m or rad; expected a number below {LARGEST:g}")
    if element.travel is None or anyway:
        return
    low, high = element.travel
    turns = 2 * math.pi * round(((low + high) / 2 - value) / (2 * math.pi)) if element.is_angular else 0.0
    slack = 1e-9 * (high - low)
    if not low - slack <= value + turns <= high + slack:
        raise InputError(
            f"drive {name}: {value * scale:.6g} {unit} is outside its travel, {low * scale:.6g} to {high * scale:.6g} {unit}"
        )


def assembly_modes(machine: Machine, values: NDArray[Any]) -> Forward:
    """All assembly modes at drive coordinates.

    Args:
        machine: three chains that keep a hinge and a ball each when the drives are locked.
        values: (n_actuators,) as `drive_values` gives them.

    Raises:
        InputError: when the machine is not of this kind.
        NoResultError: when there is no real pose, or infinitely many.
    """
    circles = circles_of(machine, values[None])
    solutions = solve(circles)
    status = Status(int(solutions.status[0]))
    if status > Status.INCOMPLETE:
        raise NoResultError(f"{machine.name}: degenerate: {DEGENERATE[status]}")
    expected, found = int(solutions.expected[0]), int(solutions.found[0])
    rows = np.flatnonzero(solutions.real[0])
    if not len(rows):
        raise NoResultError(
            f"{machine.name}: no pose has these drive coordinates: {found} of {expected} solutions found, none of them real"
        )
    poses = jax.tree.map(lambda c: c[0], frames_at(machine, values[None], np.real(solutions.angle)))
    modes = _labelled(machine, circles, solutions, rows, poses, values)
    worst = max(modes, key=lambda mode: mode.residual)
    if not worst.residual < LOOSE and solutions.multiplicity[0].max() == 1:
        raise NoResultError(
            f"{machine.name}: its drives deviate by {worst.residual:.2g} m or rad at a pose found; too unequal dimensions"
        )
    return Forward(machine, _named(machine, values), _sorted(modes), expected, found, DEGENERATE.get(status, ""))


def nearest_pose(machine: Machine, values: NDArray[Any], start: Frame, signs: Any) -> Forward:
    """The pose at drive coordinates to which a starting pose leads, for any machine with six drives.

    Args:
        machine: the machine.
        values: (6,) as `drive_values` gives them.
        start: platform frame {E} in {O} from which to search, of floats (m).
        signs: (n_chains, 2) working mode, or None as for `standing.postures`.

    Raises:
        NoResultError: when the search ends without a pose.
    """
    found = approach(machine, values, start, signs)
    miss = shortfall(machine, joint_state_once(machine, found.frame, signs))
    verdict = _from_home(machine, found.frame, signs, miss)
    mode = AssemblyMode(found.frame, {}, mode_text(machine, signs), miss, None, verdict, 1, found.residual, math.nan)
    remark = f"found from a starting pose, its chains closed to {found.gap * 1e3:.1g} mm; there may be other poses"
    return Forward(machine, _named(machine, values), (mode,), None, 1, remark)


def _named(machine: Machine, values: NDArray[Any]) -> dict[str, float]:
    return dict(zip(actuator_names(machine), values.tolist(), strict=True))


def _labelled(
    machine: Machine, circles: Circles, solutions: CircleSolutions, rows: Any, poses: Frame, values: NDArray[Any]
) -> list[AssemblyMode]:
    signs, residual = match_modes(machine, poses, values)
    states = JointState(*(np.asarray(a) for a in _states(_arrays(machine), poses, signs)))
    angles = np.real(solutions.angle[0])
    mirrors = _mirrors(circles, angles, rows)
    names = [f"{leg.name}.{leg.chain.elements[hinge_place(leg)].name}" for leg in machine.legs]
    found = []
    for row, mirror in zip(rows, mirrors, strict=True):
        frame = jax.tree.map(lambda c, row=row: float(c[row]), poses)
        miss = shortfall(machine, states, int(row))
        verdict = _from_home(machine, frame, signs[row], miss)
        hinges = dict(zip(names, angles[row].tolist(), strict=True))
        exact = int(solutions.multiplicity[0, row]), float(residual[row]), float(solutions.error[0, row])
        found.append(AssemblyMode(frame, hinges, mode_text(machine, signs[row]), miss, mirror, verdict, *exact))
    return found


def _from_home(machine: Machine, frame: Frame, signs: Any, miss: Shortfall | None) -> Verdict:
    """Whether a pose in a working mode (None: not known by name) is connected to the home pose in its own."""
    if miss is not None:
        return "apart"
    if signs is None:
        return "unknown"
    return connected(machine, home_pose(machine), frame, signs) if np.array_equal(signs, parse_mode(machine)) else "apart"


def _sorted(modes: list[AssemblyMode]) -> tuple[AssemblyMode, ...]:
    """In the order of `Forward.modes`, mirror twins renumbered."""
    rank = {"connected": 0, "unknown": 1, "apart": 2}
    order = sorted(range(len(modes)), key=lambda k: (rank[modes[k].home], modes[k].miss is not None, -modes[k].position[2]))
    place = {old: new for new, old in enumerate(order)}
    return tuple(
        replace(modes[k], mirror=None if modes[k].mirror is None else place[modes[k].mirror])  # type: ignore[index]
        for k in order
    )


def _arrays(machine: Machine) -> Machine:
    return jax.tree.map(jnp.asarray, machine)


_states = jax.jit(jax.vmap(joint_state, in_axes=(None, 0, 0)))


def match_modes(machine: Machine, poses: Frame, values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The working modes in which poses lie, found by what inverse kinematics makes of the drives.

    Args:
        machine: its chains in closed form.
        poses: n platform frames, component arrays (n,).
        values: (n_actuators,) or (n, n_actuators) drive coordinates of the poses, m or rad.

    Returns:
        Signs (n, n_chains, 2), and the deviation of the drives in that mode (n,), m or rad.
    """
    n = np.shape(poses.origin.x)[0]
    every = np.broadcast_to(values, (n, np.shape(values)[-1]))
    signs, deviation = _match(_arrays(machine), poses, every)
    return np.asarray(signs), np.asarray(deviation)


def _matched(machine: Machine, pose: Frame, values: Scalar) -> tuple[Scalar, Scalar]:
    signs, worst = [], []
    for leg, own in zip(machine.legs, by_leg(machine, values), strict=True):
        choices = branches(leg)
        tried = np.ones((2 ** len(choices), 2))
        tried[:, choices] = list(product((1.0, -1.0), repeat=len(choices)))
        off = jnp.stack([_deviation(leg, pose, sign, own) for sign in tried])
        best = jnp.argmin(off)
        signs.append(jnp.asarray(tried)[best])
        worst.append(off[best])
    return jnp.stack(signs), jnp.max(jnp.stack(worst))


def _deviation(leg: Leg, pose: Frame, signs: Any, own: dict[str, Scalar]) -> Scalar:
    """Greatest deviation of a chain's drives in one working mode; infinite where it does not reach."""
    posture = inverse(leg, pose, signs)
    found = []
    for element, coordinate in zip(leg.chain.elements, posture.coordinates, strict=True):
        if element.name in own and is_driven(element):
            value = own[element.name]
            if element.is_angular:
                # The sine of half the difference: as exact as the coordinate, whole turns apart or not.
                value = 2 * element.number(coordinate) - 2 * value
                found.append(2 * jnp.abs(jnp.sin(value / 4)))
            else:
                found.append(jnp.abs(coordinate - value))
    worst = jnp.max(jnp.stack(found))
    return jnp.where(jnp.isnan(worst), jnp.inf, worst)


_match = jax.jit(jax.vmap(_matched, in_axes=(None, 0, 0)))


def _mirrors(circles: Circles, angles: NDArray[Any], rows: NDArray[Any]) -> list[int | None]:
    """Per real solution the place in `rows` of its mirror image in the plane of the axes; None where there is no such plane."""
    plane = mirror_plane(circles)
    if plane is None:
        return [None] * len(rows)
    normal, point = plane
    own = angles[rows][:, :, None]
    balls = circles.centre[0] + np.cos(own) * circles.cosine[0] + np.sin(own) * circles.sine[0]
    images = balls - 2 * ((balls - point) @ normal)[..., None] * normal
    apart = np.linalg.norm(images[:, None] - balls[None], axis=-1).max(axis=-1)
    return [int(k) for k in apart.argmin(axis=1)]
