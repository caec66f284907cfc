"""Rigid-body dynamics at one state: what the drives must give, what the joints bear, and the equations of motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.dynamics.batch import Case, DriveMotion, Equations, drive_motion, energies, equations, joint_list, reactions
from trivet.dynamics.equations import State
from trivet.dynamics.sensitivity import Slopes, force_slopes
from trivet.errors import InputError, NoResultError
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.singularity import SINGULAR, singularity
from trivet.model import Machine
from trivet.model.mass import STANDARD_GRAVITY
from trivet.space.frame import Frame
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec
from trivet.study.machines import MachineLike
from trivet.study.pose import PoseReport, pose

Array = NDArray[Any]

_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Loading:
    """What acts on a machine in motion: its weight, and a load on the platform."""

    gravity: tuple[float, float, float] = (0.0, 0.0, -STANDARD_GRAVITY)
    """Acceleration of free fall in {O}, m/s^2."""
    force: tuple[float, float, float] = _NONE
    """In {O}, N."""
    moment: tuple[float, float, float] = _NONE
    """In {O}, N m."""
    point: tuple[float, float, float] | None = None
    """Where the force acts, in {E} (m); at the tool tip when not given."""

    @classmethod
    def of(
        cls,
        gravity: Sequence[float],
        force: Sequence[float] = _NONE,
        moment: Sequence[float] = _NONE,
        point: Sequence[float] | None = None,
    ) -> Loading:
        """A loading from sequences.

        Raises:
            InputError: for anything but three finite numbers each.
        """
        return cls(
            three("gravity", gravity), three("force", force), three("moment", moment),
            None if point is None else three("point", point),
        )  # fmt: skip

    def point_on(self, machine: Machine) -> tuple[float, float, float]:
        """Where the force acts, in {E}, m."""
        return machine.platform.tool_tip or _NONE if self.point is None else self.point

    def on(self, machine: Machine, poses: Frame) -> Wrench:
        """The load at the platform centre in {O}, at poses."""
        arm, force = poses.direction(self.point_on(machine)), Vec(*self.force)
        return Wrench(force, Vec(*self.moment) + arm.cross(force))

    def stated(self, machine: Machine) -> dict[str, list[float]]:
        """All of it in numbers, named with units as in results."""
        return {
            "gravity_m_per_s2": list(self.gravity),
            "force_N": list(self.force),
            "moment_N_m": list(self.moment),
            "force_at_in_E_m": list(self.point_on(machine)),
        }


@dataclass(frozen=True)
class DynamicsReport:
    """A machine in one state of motion; all in SI and {O}, actuators in the order of Q."""

    at: PoseReport
    twist: Twist
    """V of the platform centre (m/s, rad/s)."""
    acceleration: Twist
    """Vdot (m/s^2, rad/s^2)."""
    loading: Loading
    sigma_min: float
    """How well the drives control the platform: smallest singular value of J_x, moments over the characteristic length."""

    @property
    def machine(self) -> Machine:
        """The machine."""
        return self.at.machine

    @property
    def case(self) -> Case:
        """The machine with what acts on it, as `trivet.dynamics.batch` takes it."""
        return Case(self.machine, self.at.signs, self.loading.gravity)

    @property
    def state(self) -> State:
        """Pose and twist."""
        return State(self.at.frame, self.twist)

    @property
    def load(self) -> Wrench:
        """The load at the platform centre."""
        return self.loading.on(self.machine, self.at.frame)

    @property
    def actuators(self) -> list[str]:
        """Names of the actuated joints."""
        return self.at.actuators

    @property
    def units(self) -> list[str]:
        """Unit of each actuator's force: "N" or "N m"."""
        return force_units(self.machine)

    @cached_property
    def drives(self) -> DriveMotion:
        """Forces, speeds and accelerations of the actuators, (6,) each."""
        found = drive_motion(self.case, self.state, self.acceleration, self.load)
        return DriveMotion(*(column[0] for column in found))

    @property
    def powers(self) -> Array:
        """(6,) that the actuators give, W."""
        power: Array = self.drives.force * self.drives.speed
        return power

    @cached_property
    def equations(self) -> Equations:
        """Eqs (17) and (27) here: arrays (6, 6) and (6,)."""
        task, own = equations(self.case, self.state)
        return Equations(type(task)(*(a[0] for a in task)), type(own)(*(a[0] for a in own)))

    @cached_property
    def shares(self) -> dict[str, Array]:
        """What the forces are made of: inertia, Coriolis, weight, friction, load; they add up to `drives.force`."""
        task, own = self.equations
        load = self.load
        jacobian = np.linalg.inv(task.jacobian)
        given = jacobian.T @ np.array([*load.force, *load.moment], dtype=float)
        return {
            "inertia": own.inertia @ self.drives.acceleration,
            "coriolis": own.coriolis,
            "weight": own.gravity,
            "friction": own.friction,
            "load": -given,
        }

    @cached_property
    def reactions(self) -> dict[str, Array]:
        """Per joint the wrench (6,) on the body beyond it: force (N) and moment (N m) at the joint, in its axes."""
        found = reactions(self.case, self.state, self.acceleration, self.load)[0]
        return dict(zip(joint_list(self.machine), found, strict=True))

    @cached_property
    def energy(self) -> tuple[float, float]:
        """Kinetic and potential energy, J; the latter from the origin of {O}."""
        kinetic, potential = energies(self.case, self.state)
        return float(kinetic[0]), float(potential[0])

    @cached_property
    def slopes(self) -> Slopes:
        """Derivatives of the forces with respect to state and dimensions.

        Raises:
            InputError: for a machine with a chain without closed form.
        """
        closed_form_signs(self.machine, self.at.mode)
        return force_slopes(self.case, self.state, self.acceleration, self.load)


def dynamics_report(
    machine: MachineLike,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    *,
    velocity: Sequence[float] = _NONE,
    angular_velocity: Sequence[float] = _NONE,
    acceleration: Sequence[float] = _NONE,
    angular_acceleration: Sequence[float] = _NONE,
    loading: Loading | None = None,
    mode: str | None = None,
    anyway: bool = False,
) -> DynamicsReport:
    """A machine in one state of motion.

    Args:
        machine: machine, name or file.
        position, azimuth, tilt, roll: the pose, as for `pose`.
        velocity, angular_velocity: of the platform, at its centre in {O} (m/s, rad/s).
        acceleration, angular_acceleration: their time derivatives (m/s^2, rad/s^2).
        loading: weight and load; the weight of a machine that stands upright when not given.
        mode, anyway: as for `pose`.

    Raises:
        InputError: unless six drives move the platform's six freedoms, or for numbers that are not finite.
        NoResultError: when the pose is not reached, or is singular.
    """
    at = pose(machine, position, azimuth, tilt, roll, mode=mode, anyway=anyway)
    twist = Twist(Vec(*three("velocity", velocity)), Vec(*three("angular velocity", angular_velocity)))
    rise = Twist(Vec(*three("acceleration", acceleration)), Vec(*three("angular acceleration", angular_acceleration)))
    require_inertia(at)
    found = singularity(at.machine, at.frame, mode)
    if found.type:
        raise NoResultError(
            f"{at.machine.name}: the pose is a Type {found.type} singularity (sigma_min {found.sigma_min:.2g}, limit "
            f"{SINGULAR:g}); no drive forces belong to a motion there. trivet singularity says which motion is lost"
        )
    return DynamicsReport(at, twist, rise, loading or Loading(), found.sigma_min)


def require_inertia(at: PoseReport) -> None:
    """Raise InputError where some motion of the platform moves no mass at all: no force belongs to its acceleration."""
    case = Case(at.machine, at.signs)
    state = State(at.frame, Twist(Vec(0, 0, 0), Vec(0, 0, 0)))
    inertia = equations(case, state).task.inertia[0]
    length = float(at.machine.characteristic_length) or 1.0
    scale = np.r_[np.ones(3), np.full(3, 1 / length)]
    sizes = np.linalg.eigvalsh(inertia * scale[:, None] * scale)
    if not sizes[0] > 1e-9 * max(sizes[-1], 1e-300):
        raise InputError(
            f"{at.machine.name}: its masses leave a motion of the platform without inertia; give platform.disc, or "
            "platform.mass with platform.inertia, or bodies that weigh something"
        )


def force_units(machine: Machine) -> list[str]:
    """Unit of each actuator's force, in the order of Q."""
    return [joint.force_unit for _, joint in actuators(machine)]


def without_jumps(machine: Machine, coordinates: Array) -> Array:
    """Drive coordinates (n, 6) over time, m and rad, with angles that go on through +-pi."""
    found = np.array(coordinates)
    for k, (_, joint) in enumerate(actuators(machine)):
        if joint.is_angular:
            found[:, k] = np.unwrap(found[:, k])
    return found


def three(name: str, value: Sequence[float]) -> tuple[float, float, float]:
    """Three finite numbers.

    Raises:
        InputError: for anything else.
    """
    try:
        x, y, z = (float(v) for v in value)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected three numbers, got {value!r}") from None
    if not all(np.isfinite((x, y, z))):
        raise InputError(f"{name}: expected three finite numbers, got {value!r}")
    return x, y, z
