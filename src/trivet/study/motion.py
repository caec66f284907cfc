"""A motion along a path: what every drive must do for it, where its forces and powers are greatest, and what joints bear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.dynamics.batch import Case, DriveMotion, drive_motion, energies, joint_list, reactions
from trivet.dynamics.equations import State
from trivet.errors import InputError, NoResultError
from trivet.kinematics.approach import drives_at
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.mode import closed_form_signs, mode_text
from trivet.kinematics.report import joint_states, shortfall, travel_excess
from trivet.kinematics.singularity import SINGULAR, conditions
from trivet.model import Machine
from trivet.space.batches import in_batches
from trivet.space.curve import Moving, Trajectory
from trivet.space.frame import Frame
from trivet.space.pose import zyz_angles
from trivet.space.screw import Wrench
from trivet.space.vector import Vec
from trivet.study.dynamics import Loading, force_units, require_inertia, without_jumps
from trivet.study.machines import MachineLike, choose
from trivet.study.pose import pose

Array = NDArray[Any]

FEWEST, MOST = 50, 200_000
"""Samples of a motion: fewer miss its peaks, more fill the memory."""

USUAL, PER_KNOT = 1000, 20
"""Samples unless said otherwise, and for each pose that a smooth way passes."""

AGREED = 1e-9
"""How closely (s) the time is told at which a path leaves what a machine can do."""


@dataclass(frozen=True)
class Peak:
    """The greatest size of something along a motion."""

    value: float
    """With its sign."""
    time: float
    """s."""


@dataclass(frozen=True)
class DriveSizing:
    """What one drive must be able to do; m and N, or rad and N m."""

    name: str
    unit: str
    """Of the coordinate: "m" or "rad"."""
    low: float
    high: float
    """Least and greatest coordinate."""
    speed: Peak
    acceleration: Peak
    force: Peak
    rms_force: float
    """Root of the mean square over the motion."""
    power_given: Peak
    """W; greatest that the drive gives, to the motor's size."""
    power_taken: Peak
    """W, below zero; greatest that the drive takes back, when it brakes."""
    mean_power: float
    """W, of what the drive gives, over the motion; what it takes back is not counted."""


@dataclass(frozen=True)
class JointSizing:
    """What one joint must bear: its greatest force (N) and moment (N m), with their sizes and times."""

    name: str
    force: Peak
    moment: Peak


@dataclass(frozen=True)
class MotionReport:
    """A machine along a path; all in SI and {O}, actuators in the order of Q, arrays over n times."""

    machine: Machine
    mode: str
    trajectory: Trajectory
    loading: Loading
    moving: Moving
    """Times, poses, twists and accelerations of the platform."""
    coordinates: Array
    """(n, 6): of the drives, m and rad; angles without jumps."""
    drives: DriveMotion
    """Forces, speeds and accelerations of the drives, (n, 6)."""
    sigma_min: Array
    """(n,): how well the drives control the platform."""

    @property
    def time(self) -> Array:
        """(n,), s."""
        return self.moving.time

    @property
    def actuators(self) -> list[str]:
        """Names of the actuated joints."""
        return [name for name, _ in actuators(self.machine)]

    @property
    def units(self) -> list[str]:
        """Unit of each actuator's force: "N" or "N m"."""
        return force_units(self.machine)

    @property
    def case(self) -> Case:
        """The machine with what acts on it, as `trivet.dynamics.batch` takes it."""
        return Case(self.machine, closed_form_signs(self.machine, self.mode), self.loading.gravity)

    @property
    def state(self) -> State:
        """Poses and twists."""
        return State(self.moving.pose, self.moving.twist)

    @property
    def load(self) -> Wrench:
        """The load at the platform centre."""
        return self.loading.on(self.machine, self.moving.pose)

    @property
    def powers(self) -> Array:
        """(n, 6) that the drives give, W."""
        power: Array = self.drives.force * self.drives.speed
        return power

    @cached_property
    def energies(self) -> tuple[Array, Array]:
        """Kinetic and potential energy (n,), J."""
        return energies(self.case, self.state)

    @cached_property
    def reactions(self) -> Array:
        """(n, joints, 6): wrenches in the joints, as `DynamicsReport.reactions`."""
        return reactions(self.case, self.state, self.moving.acceleration, self.load)

    def pose_at(self, time: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Platform centre (m) and alpha, beta, gamma (rad) at a time (s)."""
        return _numbers(self.trajectory.at(np.array([time])).pose)

    @cached_property
    def drive_sizing(self) -> list[DriveSizing]:
        """What every drive must be able to do."""
        found = []
        for k, (name, joint) in enumerate(actuators(self.machine)):
            force, power = self.drives.force[:, k], self.powers[:, k]
            own = self.coordinates[:, k]
            found.append(
                DriveSizing(
                    name,
                    joint.unit,
                    float(own.min()),
                    float(own.max()),
                    self._peak(self.drives.speed[:, k]),
                    self._peak(self.drives.acceleration[:, k]),
                    self._peak(force),
                    float(np.sqrt(self._mean(force * force))),
                    self._peak(np.maximum(power, 0.0)),
                    self._peak(np.minimum(power, 0.0)),
                    float(self._mean(np.maximum(power, 0.0))),
                )
            )
        return found

    @cached_property
    def joint_sizing(self) -> list[JointSizing]:
        """What every joint must bear."""
        sizes = np.linalg.norm(self.reactions.reshape(len(self.time), -1, 2, 3), axis=-1)
        return [
            JointSizing(name, self._peak(sizes[:, k, 0]), self._peak(sizes[:, k, 1]))
            for k, name in enumerate(joint_list(self.machine))
        ]

    def _peak(self, values: Array) -> Peak:
        k = int(np.argmax(np.abs(values)))
        return Peak(float(values[k]), float(self.time[k]))

    def _mean(self, values: Array) -> float:
        return float(np.trapezoid(values, self.time) / (self.time[-1] - self.time[0]))


def motion(
    machine: MachineLike,
    trajectory: Trajectory,
    *,
    loading: Loading | None = None,
    mode: str | None = None,
    samples: int | None = None,
    anyway: bool = False,
) -> MotionReport:
    """A machine along a path, by inverse dynamics at many times.

    Args:
        machine: machine, name or file.
        trajectory: the platform's motion in time, see `trivet.space.curve`.
        loading: weight and load; the weight of a machine that stands upright when not given.
        mode: working mode; the machine's own when not given.
        samples: equally spaced times; those at which the jerk jumps are added.  USUAL, or PER_KNOT for each pose that the
            way passes where these are more, when not given.
        anyway: go on where a joint is outside its travel.

    Raises:
        InputError: for a machine with a chain without closed form, or other than six drives; for too few or too many samples.
        NoResultError: naming time and pose, where a chain does not reach, a joint leaves its travel, or a singularity is met.
    """
    chosen = choose(machine)
    if not isinstance(trajectory, Trajectory):
        raise InputError("trajectory: expected what trivet.timed gives (trivet.read_path reads a path file)")
    if samples is None:
        samples = min(MOST, max(USUAL, PER_KNOT * sum(len(law.curve.knots) for law in trajectory.laws)))
    if not FEWEST <= samples <= MOST:
        step = trajectory.duration / max(samples, 1)
        raise InputError(
            f"samples: {samples} are {'too few' if samples < FEWEST else 'too many'}, a time step of {step:.3g} s; "
            f"between {FEWEST} and {MOST}"
        )
    signs = closed_form_signs(chosen, mode)
    moving = trajectory.at(trajectory.times(samples))
    require_inertia(pose(chosen, *_open(_numbers(trajectory.at(np.zeros(1)).pose)), mode=mode, anyway=True))
    _require_reached(chosen, signs, trajectory, moving, anyway)
    sigma = _require_regular(chosen, signs, trajectory, moving)
    found = Loading() if loading is None else loading
    case, state = Case(chosen, signs, found.gravity), State(moving.pose, moving.twist)
    drives = drive_motion(case, state, moving.acceleration, found.on(chosen, moving.pose))
    coordinates = without_jumps(chosen, in_batches(lambda frames: drives_at(chosen, frames, signs), moving.pose))
    return MotionReport(chosen, mode_text(chosen, signs), trajectory, found, moving, coordinates, drives, sigma)


def _require_reached(machine: Machine, signs: Any, trajectory: Trajectory, moving: Moving, anyway: bool) -> None:
    """Raise NoResultError where a chain does not reach or, unless that is no matter, a joint is outside its travel."""

    def misses(times: Array) -> Array:
        states = in_batches(lambda frames: joint_states(machine, frames, signs), trajectory.at(times).pose)
        outside = np.any(travel_excess(states) > 0, axis=1) & (not anyway)
        missed: Array = ~np.all(states.reach >= 0, axis=1) | outside
        return missed

    first = _first(misses, moving.time)
    if first is not None:
        states = in_batches(lambda frames: joint_states(machine, frames, signs), trajectory.at(np.array([first])).pose)
        miss = shortfall(machine, states)
        reason = "a chain does not reach" if miss is None else miss.reason
        raise NoResultError(f"{machine.name}: the path leaves what the machine reaches {_where(trajectory, first)}: {reason}")


def _require_regular(machine: Machine, signs: Any, trajectory: Trajectory, moving: Moving) -> Array:
    """Smallest singular values (n,); raises NoResultError where they vanish, or the platform changes sides in between."""
    found = conditions(machine, moving.pose, signs)
    side = np.sign(found.determinants.j_x[0])

    def crossed(times: Array) -> Array:
        there = conditions(machine, trajectory.at(times).pose, signs)
        lost: Array = (there.sigma_min < SINGULAR) | (np.sign(there.determinants.j_x) != side)
        return lost

    first = _first(crossed, moving.time)
    if first is not None:
        raise NoResultError(
            f"{machine.name}: the path meets a Type 2 singularity {_where(trajectory, first)}: the drives lose hold of the "
            "platform; lead the path around it, or choose another working mode (trivet map --quantity sigma_min shows where)"
        )
    return np.asarray(found.sigma_min)


def _first(fails: Callable[[Array], Array], times: Array) -> float | None:
    """The first time at which something fails, to `AGREED`; None where it never does."""
    failed = fails(times)
    if not np.any(failed):
        return None
    k = int(np.argmax(failed))
    if k == 0:
        return float(times[0])
    low, high = times[k - 1], times[k]
    while high - low > max(AGREED, 4 * np.spacing(high)):
        between = np.linspace(low, high, 101)
        own = int(np.argmax(fails(between)))
        if own == 0:
            return float(between[0])
        low, high = between[own - 1], between[own]
    return float(high)


def _where(trajectory: Trajectory, time: float) -> str:
    (x, y, z), (alpha, beta, gamma) = _numbers(trajectory.at(np.array([time])).pose)
    angles = ", ".join(f"{name} {np.degrees(v):.4g}°" for name, v in (("alpha", alpha), ("beta", beta), ("gamma", gamma)))
    return f"at t = {time:.6g} s, centre ({x * 1e3:.5g}, {y * 1e3:.5g}, {z * 1e3:.5g}) mm, {angles}"


def _numbers(pose: Frame) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    one = Frame(*(Vec(*(float(c[0]) for c in v)) for v in pose))
    x, y, z = one.origin
    alpha, beta, gamma = (float(a) for a in zyz_angles(one))
    return (x, y, z), (alpha, beta, gamma)


def _open(numbers: tuple[Sequence[float], Sequence[float]]) -> tuple[Any, ...]:
    place, angles = numbers
    return (place, *angles)
