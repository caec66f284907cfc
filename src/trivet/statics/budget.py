"""Compliance budget: what share of a deflection comes from each link, joint and actuator."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import NoResultError
from trivet.kinematics.standing import postures
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.statics.compliance import leg_compliance

SINGULAR = 1e-13
"""Reciprocal condition number (moments scaled) below which a stiffness counts as singular."""


class Share(NamedTuple):
    """Share of one link, joint or drive in the deflection along the load."""

    chain: str
    element: str
    part: str
    """What of the element yields: its "drive", the "joint" itself, or the "beam"."""
    share: float
    """Fraction of the deflection of the loaded point along the load; all shares add up to one."""


def require_finite(machine: Machine, stiffness: NDArray[Any]) -> None:
    """Raise NoResultError when a stiffness has left the range of numbers."""
    if not np.isfinite(stiffness).all():
        raise NoResultError(
            f"{machine.name}: the stiffness here is not a finite number; look at stiffnesses, sections and materials"
        )


def compliance(machine: Machine, stiffness: NDArray[Any]) -> NDArray[Any]:
    """Inverse of a 6 x 6 stiffness (SI).

    Raises:
        NoResultError: when the stiffness is singular.
    """
    require_finite(machine, stiffness)
    scale = np.diag([1.0] * 3 + [1.0 / float(machine.characteristic_length or 1.0)] * 3)
    homogeneous = scale @ stiffness @ scale
    singular_values = np.linalg.svd(homogeneous, compute_uv=False)
    if not singular_values[-1] > SINGULAR * singular_values[0]:
        raise NoResultError(
            f"{machine.name}: the stiffness is singular at this pose; the platform moves freely along some twist"
        )
    return scale @ np.linalg.inv(homogeneous) @ scale


def compliance_budget(machine: Machine, pose: Frame, signs: Any, stiffness: NDArray[Any], wrench: NDArray[Any]) -> list[Share]:
    """Shares of all compliant elements in the deflection under a wrench, greatest first.

    The deflection along the load is twice the strain energy per unit load, and the energy is a sum over the elements:
    sum over screws of compliance times (wrench in the chain on the screw)^2.

    Args:
        machine: the machine.
        pose: platform frame in {O}, float components.
        signs: (n_chains, 2) working mode.
        stiffness: (6, 6) at the platform centre (SI).
        wrench: (6,) force (N) and moment (N m) at the platform centre in {O}; its size does not matter.

    Raises:
        NoResultError: when the stiffness is singular or the wrench is zero.
    """
    twist = compliance(machine, stiffness) @ wrench
    deflection = float(wrench @ twist)
    if not deflection > 0:
        raise NoResultError("the compliance budget needs a load that is not zero")
    energies: dict[tuple[str, str, str], float] = {}
    for leg, posture in zip(machine.legs, postures(machine, pose, signs), strict=True):
        part = leg_compliance(leg, posture, machine.stock)
        arm = pose.direction(leg.platform_frame().origin)
        rows = np.array([_floats(w.carried(posture.heading, arm)) for w in part.wrenches])
        amplitudes = np.linalg.solve(np.array(part.matrix.full(), dtype=float), rows @ twist)
        for element, flexibility in part.parts:
            power = sum(float(w @ flexibility.twist) * a for w, a in zip(part.wrenches, amplitudes, strict=True))
            key = (leg.name, element.name, flexibility.part)
            energies[key] = energies.get(key, 0.0) + float(flexibility.compliance) * power**2
    shares = [Share(*key, energy / deflection) for key, energy in energies.items()]
    return sorted(shares, key=lambda s: -s.share)


def _floats(wrench: Any) -> list[float]:
    return [float(c) for c in (*wrench.force, *wrench.moment)]
