"""Results as JSON: SI throughout, the unit at the end of every key that has one, null where there is no number."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from trivet.kinematics.forward import Forward
    from trivet.model import Machine
    from trivet.study.comparison import Comparison
    from trivet.study.pose import PoseReport
    from trivet.study.singularity import SingularityReport
    from trivet.study.singularity_map import SingularityMap
    from trivet.study.stiffness_map import StiffnessMap

AXES = ("x", "y", "z", "rx", "ry", "rz")


def finite(value: Any) -> Any:
    """Numbers and arrays as JSON can hold them: NaN and infinities become null."""
    if isinstance(value, np.ndarray):
        return [finite(v) for v in value.tolist()]
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value


def diagonal_key(name: str) -> str:
    """ "K_xx" as "K_xx_N_per_m", a rotational one as "K_rx_N_m_per_rad"."""
    return f"{name}_{'N_m_per_rad' if '_r' in name else 'N_per_m'}"


def card(machine: Machine) -> dict[str, Any]:
    """A machine in short."""
    from trivet.kinematics.jacobian import is_driven

    return {
        "name": machine.name,
        "title": machine.about.title,
        "description": machine.about.description,
        "source": machine.about.source,
        "chains": {
            name: {
                "copies": chain.copies,
                "elements": [{"name": e.name, "type": e.type, "actuated": is_driven(e)} for e in chain.elements],
            }
            for name, chain in sorted(machine.chains.items())
        },
        "notes": [{"path": n.path, "status": n.status, "source": n.source} for n in machine.about.notes],
    }


def machine_json(machine: Machine) -> dict[str, Any]:
    """A machine with every dimension by its key path, in SI."""
    from trivet.model import dimensions

    return card(machine) | {"dimensions_SI": {k: finite(float(v)) for k, v in dimensions(machine).items()}}


def pose_json(report: PoseReport, load: Any = None) -> dict[str, Any]:
    """Everything about one pose."""
    names = [f"K_{a}{a}" if len(a) == 1 else f"K_{a}" for a in AXES]
    free = [n.replace("K", "1/C") for n in names]
    result: dict[str, Any] = {
        "machine": report.machine.name,
        "mode": report.mode,
        "position_m": list(report.position),
        "angles_alpha_beta_gamma_rad": list(report.angles),
        "reached": report.miss is None,
        "reason": report.miss.reason if report.miss else None,
        "joints": [
            {
                "name": j.name,
                f"coordinate_{j.unit}": finite(j.coordinate),
                f"limited_{j.unit}": finite(j.limited),
                f"low_{j.unit}": finite(j.low),
                f"high_{j.unit}": finite(j.high),
                "inside": j.inside,
                "actuated": j.actuated,
                "locked": j.locked,
            }
            for j in report.joints
        ],
        "stiffness_SI": finite(report.stiffness),
        "stiffness_axes": list(AXES),
        "actuators": report.actuators,
        "inverse_jacobian_SI": finite(report.inverse_jacobian),
        "diagonal": {diagonal_key(n): finite(report.diagonal(n)) for n in names + free},
        "compliance_budget": {
            a: [{"chain": s.chain, "element": s.element, "part": s.part, "share": float(s.share)} for s in report.budget(a)]
            for a in AXES[:3]
        },
        "masses_kg": {k: finite(float(v)) for k, v in report.masses.items()},
    }
    if load is not None:
        result["load"] = {
            "tool_tip_m_rad": finite(load.tool_tip),
            "platform_centre_m_rad": finite(load.platform_centre),
            "reactions_N_Nm": {k: finite(v) for k, v in load.reactions.items()},
            "drives": {k: {f"load_{d.unit.replace(' ', '_')}": finite(d.load)} for k, d in load.drives.items()},
        }
    return result


def statistics_json(result: StiffnessMap) -> dict[str, Any]:
    """Moments of the stiffness over the points which are reached."""
    from trivet.study.comparison import FREE, HELD
    from trivet.study.statistics import moments

    found = {}
    for quantity in (*HELD, *FREE):
        m = moments(result.diagonal(quantity)[result.used])
        found[quantity] = {
            "mean_N_per_m": finite(m.mean), "variance_N2_per_m2": finite(m.variance),
            "least_N_per_m": finite(m.least), "greatest_N_per_m": finite(m.greatest),
        }  # fmt: skip
    return {
        "machine": result.machine.name,
        "mode": result.mode,
        "surface": result.surface.name,
        "objective": result.objective.name,
        "points": len(result.surface),
        "used": int(result.used.sum()),
        "excluded": result.exclusions(),
        "points_where_a_limit_decides": int(result.best.at_limit.sum()),
        "points_with_ties_beyond_symmetry": int(result.ties_beyond_symmetry.sum()),
        "statistics": found,
    }


def _stiffness_map_json(result: StiffnessMap) -> dict[str, Any]:
    """A stiffness map, point by point."""
    points = {
        "position_m": finite(result.surface.position),
        "azimuth_rad": finite(result.surface.azimuth),
        "tilt_rad": finite(result.surface.tilt),
        "roll_rad": finite(result.best.roll),
        "ties": finite(result.best.ties),
        "at_limit": finite(result.best.at_limit),
    }
    points |= {diagonal_key(q): finite(result.diagonal(q)) for q in ("K_xx", "K_yy", "K_zz", "1/C_xx", "1/C_yy", "1/C_zz")}
    reasons = {str(k): miss.reason for k, miss in result.excluded.items()}
    return statistics_json(result) | {"by_point": points, "excluded_because": reasons}


def comparison_json(result: Comparison) -> dict[str, Any]:
    """A comparison."""
    from trivet.study.comparison import CAVEATS

    return {
        "machines": [statistics_json(m) for m in result.maps],
        "published": [
            {
                "machine": d.machine, "source": d.source, "quantity": d.quantity, "published_mean_N_per_m": d.published,
                "mean_N_per_m": d.ours, "relative_deviation": d.relative, "published_variance_N2_per_m2": d.published_variance,
                "variance_N2_per_m2": d.our_variance,
            }
            for d in result.deviations
        ],
        "tests": [
            {
                "first": t.first, "second": t.second, "quantity": t.quantity, "difference_N_per_m": finite(t.difference),
                "t": finite(t.t), "degrees_of_freedom": finite(t.freedom), "p": finite(t.p),
                "p_holm": finite(t.p_holm), "hedges_g": finite(t.effect),
            }
            for t in result.tests
        ],
        "convergence": [
            {
                "machine": c.machine, "quantity": c.quantity, "points": c.points, "mean_N_per_m": c.mean,
                "finer_points": c.finer_points, "finer_mean_N_per_m": c.finer_mean, "relative_change": c.relative,
            }
            for c in result.convergence
        ],
        "caveats": list(CAVEATS),
    }  # fmt: skip


def forward_json(result: Forward) -> dict[str, Any]:
    """All assembly modes at drive coordinates."""
    return {
        "machine": result.machine.name,
        "drives_m_or_rad": result.drives,
        "complex_solutions_expected": result.expected,
        "complex_solutions_found": result.found,
        "complete": result.complete,
        "remark": result.remark,
        "poses": [
            {
                "position_m": pose.position,
                "azimuth_rad": pose.angles[0],
                "tilt_rad": pose.angles[1],
                "roll_rad": pose.angles[2],
                "rotation": [[float(c) for c in row] for row in pose.frame.matrix()],
                "hinges_rad": pose.hinges,
                "mode": pose.mode,
                "inside_travel": pose.miss is None,
                "reason": None if pose.miss is None else pose.miss.reason,
                "mirror": pose.mirror,
                "home": pose.home,
                "multiplicity": pose.multiplicity,
                "drive_residual_m_or_rad": finite(pose.residual),
                "angle_error_rad": finite(pose.error),
            }
            for pose in result.modes
        ],
    }


def map_json(result: StiffnessMap | SingularityMap) -> dict[str, Any]:
    """A map of either kind."""
    from trivet.study.stiffness_map import StiffnessMap

    return _stiffness_map_json(result) if isinstance(result, StiffnessMap) else _singularity_map_json(result)


def _singularity_map_json(result: SingularityMap) -> dict[str, Any]:
    return {
        "machine": result.machine.name,
        "mode": result.mode,
        "surface": result.surface.name,
        "roll_policy": result.policy,
        "points": len(result.surface),
        "used": int(result.used.sum()),
        "position_m": finite(result.surface.position),
        "roll_rad": finite(result.roll),
        "fields_SI": {name: finite(values) for name, values in result.fields.items()},
        "units": {name: result.unit(name) for name in result.fields},
        "singular_curves": [
            {"position_m": finite(c.surface.position), "roll_rad": finite(c.roll), "closed": c.is_closed, "length_m": c.length}
            for c in result.curves
        ],
        "sign_changes_by_jumps": result.jumps,
    }


def singularity_json(report: SingularityReport) -> dict[str, Any]:
    """Singularity and transmission at one pose."""
    found, moved = report.singularity, report.transmission
    motion, far, det = found.motion, found.distance, found.determinants
    return {
        "machine": found.machine.name,
        "mode": found.mode,
        "position_m": [float(c) for c in found.frame.origin],
        "azimuth_rad": report.angles[0],
        "tilt_rad": report.angles[1],
        "roll_rad": report.angles[2],
        "type": found.type,
        "meaning": found.meaning,
        "sigma_min": finite(found.sigma_min),
        "aspect_sign": found.aspect_sign,
        "det_J_x_m3": finite(det.j_x),
        "det_J_q_SI": finite(det.j_q),
        "det_J_G_inverse_SI": finite(det.inverse),
        "det_J_inverse_SI": finite(det.inverse_analytical),
        "least_controlled_motion": {
            "linear": finite(motion.linear),
            "angular": finite(motion.angular),
            "direction": finite(motion.direction),
            "point_m": None if motion.point is None else finite(motion.point),
            "pitch_m_per_rad": finite(motion.pitch),
        },
        "distance_m": finite(far.length) if far.length < 1 else None,
        "shift_to_singularity_m": finite(far.shift) if far.length < 1 else None,
        "distance_rad": finite(far.angle) if far.angle < math.pi else None,
        "tilt_to_singularity_rad": finite(far.tilt) if far.angle < math.pi else None,
        "tilt_margin_rad": finite(report.tilt_margin.angle),
        "tilt_margin_azimuth_rad": finite(report.tilt_margin.azimuth),
        "drives": [
            {
                "name": drive.name,
                "lever_m" if drive.is_angular else "lever": finite(drive.lever),
                "singular": drive.is_singular,
                "ITI": finite(float(moved.input[k])),
                "OTI": finite(float(moved.output[k])),
            }
            for k, drive in enumerate(found.drives)
        ],
        "LTI": finite(float(moved.local)),
    }
