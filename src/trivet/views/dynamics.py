"""Rigid-body dynamics in one state of motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.dynamics.sensitivity import Slopes
from trivet.kinematics.jacobian import actuators
from trivet.model import Machine
from trivet.model.elements import Joint
from trivet.study.dynamics import DynamicsReport, Loading
from trivet.views.layout import beside, reached, table, where
from trivet.views.si import finite, pose_keys

NEAR_SINGULAR = "near a singularity, where forces grow without bound (trivet singularity tells more)"

MOST_DIMENSIONS = 12
"""Dimensions that a table of slopes shows: those with the greatest effect."""


def tables(report: DynamicsReport, slopes: Slopes | None = None) -> Iterator[Any]:
    """What drives give, joints bear, and of what."""
    at = report.at
    kinetic, _ = report.energy
    yield (
        f"{where(at.machine.name, at.mode, at.position, at.angles)}\n{reached(at.miss)}\n"
        f"{loaded(report.loading)}; kinetic energy {kinetic:.4g} J; sigma_min {report.sigma_min:.3g}"
        + (f", {NEAR_SINGULAR}" if report.sigma_min < 0.01 else "")
    )
    yield _drives(report)
    yield _shares(report)
    yield unweighed(at.machine)
    inertia = table("M_Q, inertia seen by the drives (kg, kg m, kg m²)", "", *report.actuators)
    size = np.sqrt(np.abs(np.diag(report.equations.actuators.inertia)))
    for k, (name, row) in enumerate(zip(report.actuators, report.equations.actuators.inertia, strict=True)):
        inertia.add_row(name, *(f"{v if abs(v) > 1e-12 * size[k] * size[j] else 0.0:.4g}" for j, v in enumerate(row)))
    yield inertia
    yield _joints(report)
    if slopes is not None:
        yield _slopes(report, slopes)


def unweighed(machine: Machine) -> str:
    """What counts for nothing since the machine file does not give it: sizes of motors depend on it."""
    drives = [joint for _, joint in actuators(machine)]
    joints = [e for chain in machine.chains.values() for e in chain.elements if isinstance(e, Joint)]
    missing = {
        "motors (reflected_inertia)": not any(joint.reflected_inertia for joint in drives),
        "friction": not any(joint.friction or joint.damping for joint in joints),
        "masses of " + ", ".join(dict.fromkeys(e.name for e in joints if not e.mass)): any(not e.mass for e in joints),
        "the platform's mass": not machine.platform.mass and machine.platform.disc is None,
    }
    found = [what for what, is_missing in missing.items() if is_missing]
    return f"not in the machine file, and counted as nothing: {'; '.join(found)}" if found else ""


def loaded(loading: Loading) -> str:
    """What acts, in words."""
    x, y, z = (f"{v + 0.0:g}" for v in loading.gravity)
    words = f"free fall ({x}, {y}, {z}) m/s²"
    if any(loading.force):
        words += f", force ({', '.join(f'{v + 0.0:g}' for v in loading.force)}) N"
        if loading.point is not None:
            words += f" at ({', '.join(f'{1e3 * v + 0.0:g}' for v in loading.point)}) mm in {{E}}"
    if any(loading.moment):
        words += f", moment ({', '.join(f'{v + 0.0:g}' for v in loading.moment)}) N m"
    return words


def _drives(report: DynamicsReport) -> Any:
    found = table("drives", "drive", "speed", "acceleration", "force", "power")
    drives = report.drives
    speed, rise, force, power = (_greatest(a) for a in (*drives[1:], drives.force, report.powers))
    for k, (name, unit) in enumerate(zip(report.actuators, report.units, strict=True)):
        way = "m" if unit == "N" else "rad"
        scale, shown = (1e3, "mm") if way == "m" else (math.degrees(1), "°")
        found.add_row(
            name, f"{beside(drives.speed[k] * scale, speed)} {shown}/s",
            f"{beside(drives.acceleration[k] * scale, rise)} {shown}/s²",
            f"{beside(drives.force[k], force)} {unit}", f"{beside(report.powers[k], power)} W",
        )  # fmt: skip
    return found


def _greatest(values: Any) -> float:
    return float(np.abs(np.asarray(values)).max())


def _shares(report: DynamicsReport) -> Any:
    found = table("what the forces are for", "drive", *report.shares, "together")
    greatest = max(_greatest(share) for share in report.shares.values())
    for k, (name, unit) in enumerate(zip(report.actuators, report.units, strict=True)):
        cells = (beside(share[k], greatest) for share in report.shares.values())
        found.add_row(name, *cells, f"{beside(report.drives.force[k], greatest)} {unit}")
    return found


def _joints(report: DynamicsReport) -> Any:
    title = "what the joints bear: on the body beyond, in the joint's axes"
    found = table(title, "joint", "Fx N", "Fy N", "Fz N", "Mx N m", "My N m", "Mz N m")
    greatest = max(_greatest(wrench) for wrench in report.reactions.values())
    for name, wrench in report.reactions.items():
        found.add_row(name, *(beside(v, greatest) for v in wrench))
    return found


def _slopes(report: DynamicsReport, slopes: Slopes) -> Any:
    """Dimensions by what a change of a hundredth of them changes."""
    from trivet.model import dimensions

    values = dimensions(report.machine)
    effects = {path: np.asarray(slope) * 0.01 * float(values[path]) for path, slope in slopes.dimensions.items()}
    ranked = sorted(effects, key=lambda path: -_greatest(effects[path]))[:MOST_DIMENSIONS]
    found = table("change of the forces when a dimension grows by 1 %, the pose held (N, N m)", "dimension", *report.actuators)
    greatest = _greatest(effects[ranked[0]])
    for path in ranked:
        if _greatest(effects[path]) > 1e-12 * greatest:
            found.add_row(path, *(beside(v, greatest, 3) for v in effects[path]))
    return found


def as_json(report: DynamicsReport, slopes: Slopes | None = None) -> dict[str, Any]:
    """Everything about the state."""
    at, (task, own), drives = report.at, report.equations, report.drives
    kinetic, potential = report.energy
    found: dict[str, Any] = {
        "machine": at.machine.name,
        "mode": at.mode,
        **pose_keys(at.position, at.angles),
        "reached": at.miss is None,
        "reason": at.miss.reason if at.miss else None,
        "twist_m_per_s_rad_per_s": finite(np.array([*report.twist.linear, *report.twist.angular], dtype=float)),
        "acceleration_m_per_s2_rad_per_s2": finite(
            np.array([*report.acceleration.linear, *report.acceleration.angular], dtype=float)
        ),
        **report.loading.stated(report.machine),
        "sigma_min": finite(report.sigma_min),
        "drives": [
            {
                "name": name,
                f"speed_{way}_per_s": finite(drives.speed[k]),
                f"acceleration_{way}_per_s2": finite(drives.acceleration[k]),
                f"force_{unit.replace(' ', '_')}": finite(drives.force[k]),
                "power_W": finite(report.powers[k]),
                "force_shares": {what: finite(share[k]) for what, share in report.shares.items()},
            }
            for k, (name, unit, way) in enumerate(
                (name, unit, "m" if unit == "N" else "rad") for name, unit in zip(report.actuators, report.units, strict=True)
            )
        ],
        "actuator_space_SI": {
            "M_Q": finite(own.inertia), "C_Q": finite(own.coriolis), "g_Q": finite(own.gravity), "F_Q": finite(own.friction),
        },
        "task_space_SI": {
            "M_t": finite(task.inertia), "C_t": finite(task.coriolis), "g_t": finite(task.gravity),
            "F_t": finite(task.friction), "inverse_jacobian": finite(task.jacobian),
        },
        "joint_wrenches_N_Nm": {name: finite(wrench) for name, wrench in report.reactions.items()},
        "kinetic_energy_J": kinetic,
        "potential_energy_J": potential,
    }  # fmt: skip
    if slopes is not None:
        found["force_slopes_SI"] = {
            "dimensions": {path: finite(np.asarray(slope)) for path, slope in slopes.dimensions.items()},
            "pose": finite(slopes.pose),
            "twist": finite(slopes.twist),
            "acceleration": finite(slopes.acceleration),
        }
    return found
