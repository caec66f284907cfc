"""Everything about one pose: joints, limits, stiffness, compliance budget, deflection under a load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError, nearest
from trivet.kinematics.inverse import require_six_freedoms
from trivet.kinematics.jacobian import actuator_names, inverse_jacobian
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.report import JointState, Shortfall, joint_elements, joint_names, joint_state_once, shortfall
from trivet.model import Machine
from trivet.reach.margins import all_distances
from trivet.reach.scene import scene_of
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.statics.budget import Share, compliance, compliance_budget, require_finite
from trivet.statics.load import LoadResult, load_case, masses
from trivet.statics.objective import AXES, Objective, objective
from trivet.statics.stiffness import stiffness
from trivet.statics.structure import structural_stiffness
from trivet.study.home import NOT_REACHED, home_words
from trivet.study.machines import MachineLike, choose, pose_numbers

_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class JointRow:
    """One joint at a pose (m or rad)."""

    name: str
    unit: str
    coordinate: float
    limited: float
    """What the travel limits: the coordinate, or the elevation of the next body."""
    low: float
    high: float
    actuated: bool
    """Whether a drive moves it while the machine works."""
    locked: bool

    @property
    def inside(self) -> bool:
        """Whether the joint is inside its travel."""
        return self.low <= self.limited <= self.high

    @property
    def margin(self) -> float:
        """How far it is from the nearest end of its travel: below zero outside, infinite without any."""
        return min(self.limited - self.low, self.high - self.limited)


class Clearance(NamedTuple):
    """Two bodies and their signed distance, m."""

    one: str
    other: str
    distance: float


@dataclass(frozen=True)
class PoseReport:
    """A machine at one pose; all in SI and {O}."""

    machine: Machine
    mode: str
    position: tuple[float, float, float]
    angles: tuple[float, float, float]
    """alpha, beta, gamma (rad)."""
    frame: Frame
    state: JointState
    miss: Shortfall | None
    """Why the pose is not reached, or None."""

    @property
    def joints(self) -> list[JointRow]:
        """All joints with their limits."""
        rows = []
        for k, (name, element) in enumerate(zip(joint_names(self.machine), joint_elements(self.machine), strict=True)):
            state = self.state
            coordinate, limited, low, high = (float(a[0, k]) for a in (state.coordinate, state.gauge, state.low, state.high))
            rows.append(
                JointRow(name, element.unit, coordinate, limited, low, high, element.is_driven, element.locked is not None)
            )
        return rows

    @property
    def signs(self) -> Any:
        """Signs of the working mode; None for a machine that is closed numerically."""
        return parse_mode(self.machine, self.mode)

    @cached_property
    def stiffness(self) -> NDArray[Any]:
        """(6, 6) at the platform centre, forces first (N/m, N/rad, N m/rad)."""
        matrix: NDArray[Any]
        if self.signs is None:
            matrix = structural_stiffness(self.machine, self.frame, None)
        else:
            batch = Frame(*(type(v)(*(np.asarray([c], dtype=float) for c in v)) for v in self.frame))
            matrix = stiffness(self.machine, batch, self.signs)[0][0]
        require_finite(self.machine, matrix)
        return matrix

    def stiffness_at(self, point: Sequence[float]) -> NDArray[Any]:
        """(6, 6) at a point rigid to the platform, given in {E} (m)."""
        arm = np.array(self.frame.direction((point[0], point[1], point[2])), dtype=float)
        shift = np.eye(6)
        # Twist of the centre from the twist at the point: v = v_point - omega x arm.
        shift[:3, 3:] = [[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]]
        matrix: NDArray[Any] = shift.T @ self.stiffness @ shift
        return matrix

    @cached_property
    def compliance(self) -> NDArray[Any]:
        """(6, 6) inverse of the stiffness; raises NoResultError where it is singular."""
        return compliance(self.machine, self.stiffness)

    @cached_property
    def inverse_jacobian(self) -> NDArray[Any]:
        """(n_actuators, 6) Qdot = J^-1 V, actuators in the order of `actuators`."""
        return np.asarray(inverse_jacobian(self.machine, self.frame, self.signs))

    @property
    def actuators(self) -> list[str]:
        """Names of the actuated joints in the order of Q."""
        return actuator_names(self.machine)

    def diagonal(self, name: str) -> float:
        """An element of the diagonal or a direction: "K_xx", "1/C_zz", "K(1,0,1)" (N/m, N m/rad)."""
        wanted: Objective = objective(name)
        along = np.array(wanted.direction)
        return float(along @ self.stiffness @ along) if wanted.held else float(1 / (along @ self.compliance @ along))

    def budget(self, direction: str | Sequence[float] = "z") -> list[Share]:
        """Shares of links, joints and actuators in the deflection along a direction: x, y, z, rx, ry, rz or a wrench (6,)."""
        if isinstance(direction, str) and direction not in AXES:
            raise InputError(f"direction '{direction}' is not known{nearest(direction, AXES)}")
        wrench = np.eye(6)[AXES.index(direction)] if isinstance(direction, str) else np.asarray(direction, dtype=float)
        return compliance_budget(self.machine, self.frame, self.signs, self.stiffness, wrench)

    @cached_property
    def clearances(self) -> list[Clearance]:
        """Bodies that must not touch, the nearest first; none for a machine that is closed numerically."""
        if self.signs is None:
            return []
        scene = scene_of(self.machine, with_workpiece=False)
        poses = Frame(*(type(v)(*(np.asarray([c], dtype=float) for c in v)) for v in self.frame))
        found = zip(scene.names(), all_distances(self.machine, scene, poses, self.signs)[0].tolist(), strict=True)
        return sorted((Clearance(*pair, gap) for pair, gap in found), key=lambda own: own.distance)

    @property
    def masses(self) -> dict[str, float]:
        """Masses of links, joints and platform at this pose (kg), by "leg-1.link" and "platform"."""
        return masses(self.machine, self.frame, self.signs)

    def load(
        self, force: Sequence[float] = _NONE, moment: Sequence[float] = _NONE, gravity: Sequence[float] = _NONE
    ) -> LoadResult:
        """Deflections and drive loads under force (N) and moment (N m) at the tool tip and gravity (m/s^2), in {O}."""
        return load_case(self.machine, self.frame, self.signs, force, moment, gravity)


def pose(
    machine: MachineLike,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    *,
    mode: str | None = None,
    anyway: bool = False,
) -> PoseReport:
    """A machine at one pose.

    Args:
        machine: machine, name or file.
        position: platform centre in {O}, m; the home position when not given.
        azimuth, tilt, roll: alpha, beta, gamma of R = Rz(alpha) Ry(beta) Rz(gamma), rad; those of home when not given.
        mode: working mode; the machine's own when not given.
        anyway: report a pose at which a joint is outside its travel, instead of raising; where a chain cannot close at all the
            error is raised in any case.

    Raises:
        NoResultError: naming chain, joint, value and limit.
    """
    chosen = choose(machine)
    place, angles = pose_numbers(chosen, position, azimuth, tilt, roll)
    require_six_freedoms(chosen)
    signs = parse_mode(chosen, mode)
    frame = zyz_frame(place, *angles)
    state = joint_state_once(chosen, frame, signs)
    miss = shortfall(chosen, state)
    if miss is not None and (not anyway or miss.joint is None):
        at_home = all(given is None for given in (position, azimuth, tilt, roll))
        raise NoResultError(home_words(chosen, miss, signs) if at_home else f"{chosen.name}: {NOT_REACHED}: {miss.reason}")
    return PoseReport(chosen, mode_text(chosen, signs), place, angles, frame, state, miss)
