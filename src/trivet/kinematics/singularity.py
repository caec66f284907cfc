"""Singularities at a pose (paper section 3.2 and Eq 35): which type, how near, and what they mean for the machine.

- Type 1, J_q singular: a drive moves, or could, without moving the platform; it exerts no force.
- Type 2, J_x singular: the platform moves, or could, while all drives stand still.
- Type 3: both.

The smallest singular value of J_x, its moments divided by the machine's `characteristic_length`, is the speed of the drives'
constraints at the platform's least controlled unit motion: without a unit, 0 at a Type 2 singularity.  It depends on that
length and on the point of reference, the platform centre; its zeros do not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import NoResultError
from trivet.kinematics.inverse import require_six_freedoms
from trivet.kinematics.jacobian import (
    ConstraintRows,
    Determinants,
    actuators,
    determinants_of,
    homogenised,
    square_rows,
)
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.model import Machine
from trivet.model.elements import Curvilinear, Drivable, Revolute
from trivet.space.batches import in_batches
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

Array = NDArray[Any]

SINGULAR = 1e-5
"""A singular value, or a lever over the characteristic length, below which a pose counts as singular."""
PURE = 1e-9
"""Part of a motion, over the whole of it, below which it does not count: a motion that turns so little is a translation."""
STEP = 1e-5
"""Step of central differences, in radians and in characteristic lengths."""
_ROUGH, _KINK = 1e-2, 1e-3
"""Where there is no derivative, differences ahead and behind differ by more than this part of the larger, and, since curvature
is of second order in the step, by more than this part of a step of the determinant's size, the characteristic length cubed."""


class Condition(NamedTuple):
    """How well the drives control the platform at one pose."""

    sigma_min: Scalar
    """Smallest singular value of J_x, moments divided by the characteristic length."""
    determinants: Determinants
    """Of these j_x is continuous over a working mode; its sign names the side of the Type 2 singularities (the aspect)."""
    rows: ConstraintRows


class Motion(NamedTuple):
    """The motion of the platform which the drives control least; at a Type 2 singularity, not at all."""

    linear: Array
    """(3,) velocity of the platform centre in {O}: m per rad, or without a unit for a translation."""
    angular: Array
    """(3,) in {O}: a unit vector, or zero for a translation."""
    direction: Array
    """(3,) unit vector along the axis, or of the translation."""
    point: Array | None
    """(3,) point of the axis nearest to the platform centre, in {O} (m); None for a translation."""
    pitch: float | None
    """Advance along the axis, m/rad; None for a translation."""


class DriveLever(NamedTuple):
    """The power at unit speed of a drive of the best unit force that the chain transmits and its other drives do not feel.

    For a drive that turns this is the distance (m) at which that force passes its axis, for one that slides the cosine of the
    angle between them; zero at a Type 1 singularity, where the drive is at fault.
    """

    name: str
    lever: float
    is_angular: bool
    is_singular: bool

    @property
    def unit(self) -> str:
        """m, or "" for a cosine."""
        return "m" if self.is_angular else ""


class Distance(NamedTuple):
    """To first order, how far the nearest Type 2 singularity is: |det J_x| over the length of its gradient.

    Infinite where the determinant does not change to first order, NaN where it has no derivative (P on the axis of a guide, a
    link at the end of its reach).
    """

    length: float
    """The shortest displacement (m) of the platform centre, orientation held, that makes det J_x zero."""
    shift: Array
    """(3,) that displacement in {O}, m."""
    angle: float
    """The smallest turn (rad) about an axis through the platform centre and across its normal, the centre held."""
    tilt: Array
    """(3,) that turn as a vector in {O}, rad."""


@dataclass(frozen=True)
class Singularity:
    """How near a pose is to a singularity, and what that means; SI, {O}."""

    machine: Machine
    mode: str
    frame: Frame
    type: Literal[0, 1, 2, 3]
    """0 where the pose is regular."""
    sigma_min: float
    """See the module."""
    determinants: Determinants
    """Of floats; `inverse` is infinite or NaN at a Type 1 singularity."""
    motion: Motion
    drives: tuple[DriveLever, ...]
    """In the order of Q."""
    distance: Distance

    @property
    def aspect_sign(self) -> int:
        """Sign of det J_x; it changes across Type 2 singularities and nowhere else while the working mode is kept."""
        return int(np.sign(self.determinants.j_x))

    @property
    def faults(self) -> list[DriveLever]:
        """The drives which a Type 1 singularity makes idle."""
        return [drive for drive in self.drives if drive.is_singular]

    @property
    def meaning(self) -> list[str]:
        """What is to be said about the pose, one sentence each; none for a regular pose."""
        joints = dict(actuators(self.machine))
        sentences = [_idle(joints[drive.name], drive) for drive in self.faults]
        if self.type >= 2:
            sentences.append(f"Type 2: with all drives held the platform {motion_words(self.motion)}")
        return sentences


def condition(machine: Machine, pose: Frame, signs: Scalar) -> Condition:
    """Condition at one pose: a kernel, smooth but for sigma_min where singular values cross.

    Args:
        machine: a machine with six actuators and six constraints.
        pose: platform frame in {O}, scalar components.
        signs: (n_chains, 2) working mode, or None as for `standing.postures`.

    Raises:
        InputError: for any other machine.
    """
    rows = square_rows(machine, pose, signs)
    values = jnp.linalg.svd(homogenised(rows.j_x, machine.characteristic_length), compute_uv=False)
    return Condition(values[-1], determinants_of(rows, pose), rows)


def _rows_and_determinants(machine: Machine, pose: Frame, signs: Scalar) -> tuple[ConstraintRows, Determinants]:
    rows = square_rows(machine, pose, signs)
    return rows, determinants_of(rows, pose)


_many = jax.jit(jax.vmap(_rows_and_determinants, in_axes=(None, 0, None)))


def conditions(machine: Machine, poses: Frame, signs: Any) -> Condition:
    """`condition` at many poses, component arrays of shape (n,); NumPy arrays, NaN where a chain does not reach the pose."""
    if signs is None:
        count = len(poses.origin.x)
        ones = [condition(machine, jax.tree.map(lambda c, k=k: float(c[k]), poses), None) for k in range(count)]
        return jax.tree.map(lambda *parts: np.stack([np.asarray(p) for p in parts]), *ones)
    rows, found = in_batches(lambda frames: _many(machine, frames, signs), poses)
    # Out here: LAPACK within kernels can stop XLA for ever, see `elimination.solved`.
    j_x = np.asarray(homogenised(rows.j_x, machine.characteristic_length))
    closed = np.all(np.isfinite(j_x), axis=(1, 2))
    values = np.linalg.svd(np.where(closed[:, None, None], j_x, 0.0), compute_uv=False)[:, -1]
    return Condition(np.where(closed, values, np.nan), found, rows)


def nudged(pose: Frame, twist: Any) -> Frame:
    """A pose displaced by a small twist (6, ...) at its centre, in {O}; right to first order, for derivatives."""
    shift, turn = Vec(*twist[:3]), Vec(*twist[3:])
    return Frame(pose.origin + shift, *(axis + turn.cross(axis) for axis in pose[1:]))


def singularity(machine: Machine, pose: Frame, mode: str | None = None) -> Singularity:
    """Singularities at one pose; travel of joints is not looked at.

    Args:
        machine: a machine with six actuators and six constraints (lock the surplus of a redundant one).
        pose: platform frame {E} in {O}, of floats (m), see `trivet.space.pose.zyz_frame`.
        mode: working mode; the machine's own when not given.

    Raises:
        InputError: for a machine with other numbers of actuators or constraints, or a mode that does not fit.
        NoResultError: a chain does not reach the pose.
    """
    require_six_freedoms(machine)
    signs = parse_mode(machine, mode)
    steps = STEP * np.r_[np.full(3, float(machine.characteristic_length)), np.ones(3)]
    found = conditions(machine, nudged(pose, np.hstack([np.zeros((6, 1)), np.diag(steps), -np.diag(steps)])), signs)
    rows = jax.tree.map(lambda a: a[0], found.rows)
    if not np.all(np.isfinite(rows.j_x)):
        where = f" in mode {mode_text(machine, signs)}" if mode_text(machine, signs) else ""
        raise NoResultError(f"{machine.name}: a chain does not reach the pose{where}")
    drives = _levers(machine, rows.j_q)
    kind = (1 if any(d.is_singular for d in drives) else 0) + (2 if found.sigma_min[0] < SINGULAR else 0)
    return Singularity(
        machine,
        mode_text(machine, signs),
        pose,
        kind,  # type: ignore[arg-type]
        float(found.sigma_min[0]),
        Determinants(*(float(d[0]) for d in found.determinants)),
        _least_controlled(machine, rows.j_x, pose),
        drives,
        _distance(found.determinants.j_x, steps, pose, float(machine.characteristic_length)),
    )


def _least_controlled(machine: Machine, j_x: Array, pose: Frame) -> Motion:
    length = float(machine.characteristic_length)
    twist = np.linalg.svd(np.asarray(homogenised(j_x, length)))[2][-1]
    linear, angular = twist[:3], twist[3:] / length
    # Its sense is free; the largest component is taken to be positive, so that a report does not depend on rounding.
    sense = math.copysign(1.0, twist[np.argmax(np.abs(twist).round(9))])
    size = float(np.linalg.norm(angular))
    if size * length < PURE:
        direction = sense * linear / np.linalg.norm(linear)
        return Motion(direction, np.zeros(3), direction, None, None)
    linear, angular = sense * linear / size, sense * angular / size
    point = np.array(pose.origin) + np.cross(angular, linear)
    return Motion(linear, angular, angular, point, float(angular @ linear))


def _levers(machine: Machine, j_q: Array) -> tuple[DriveLever, ...]:
    length, found = float(machine.characteristic_length), []
    for k, (name, joint) in enumerate(actuators(machine)):
        column, others = j_q[:, k], np.delete(j_q, k, axis=1)
        others = others / np.where((size := np.linalg.norm(others, axis=0)) > 0, size, 1.0)
        lever = float(np.linalg.norm(column - others @ np.linalg.lstsq(others, column, rcond=SINGULAR)[0]))
        turns = joint.is_angular
        found.append(DriveLever(name, lever, turns, lever < SINGULAR * (length if turns else 1.0)))
    return tuple(found)


def _distance(det: Array, steps: Array, pose: Frame, length: float) -> Distance:
    """From det J_x (13,) at the pose, at the six steps, and at the six steps back."""
    ahead, behind = det[1:7] - det[0], det[0] - det[7:]
    # Where the two differ by more than curvature does, there is no derivative: across the axis of a guide, say.
    rough = np.abs(ahead - behind) > _ROUGH * np.maximum(np.abs(ahead), np.abs(behind)) + _KINK * STEP * length**3
    slope = np.where(rough, np.nan, (ahead + behind) / (2 * steps))
    normal = np.array(pose.z, dtype=float)

    def nearest(slope: Array) -> tuple[float, Array]:
        square = float(slope @ slope)
        if square == 0:
            return math.inf, np.full(3, np.inf)
        return abs(float(det[0])) / math.sqrt(square), -det[0] * slope / square

    return Distance(*nearest(slope[:3]), *nearest(slope[3:] - normal * (normal @ slope[3:])))


def motion_words(motion: Motion) -> str:
    """A motion as the end of a sentence, "turns about ..." or "moves along ..."."""
    along = "({:.4f}, {:.4f}, {:.4f})".format(*(motion.direction.round(4) + 0.0))
    if motion.point is None or motion.pitch is None:
        return f"moves along {along}"
    through = "({:.3f}, {:.3f}, {:.3f}) mm".format(*((1e3 * motion.point).round(3) + 0.0))
    advance = f", advancing {2e3 * math.pi * motion.pitch:.4g} mm per turn" if abs(motion.pitch) > PURE else ""
    return f"turns about the axis through {through} along {along}{advance}"


def _idle(joint: Drivable, drive: DriveLever) -> str:
    if isinstance(joint, Curvilinear):
        fault = f"the force it can exert passes the axis of its guide at {1e3 * drive.lever:.3g} mm"
    elif isinstance(joint, Revolute):
        fault = f"the force it can exert passes its hinge at {1e3 * drive.lever:.3g} mm, the links are in line"
    else:
        off = math.degrees(math.asin(min(1.0, drive.lever)))
        fault = f"the force it can exert stands across its slide, {off:.3g} deg off"
    return f"Type 1: {drive.name} moves without the platform; {fault}"
