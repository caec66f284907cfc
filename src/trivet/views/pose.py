"""Everything about one pose."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from rich.table import Table

from trivet.statics.load import LoadResult
from trivet.statics.objective import AXES
from trivet.study.pose import PoseReport
from trivet.views.layout import reached, table, where
from trivet.views.si import diagonal_key, finite

NEAREST = 3
"""Pairs of bodies that a table shows."""


def tables(report: PoseReport, load: LoadResult | None = None) -> Iterator[Any]:
    """Everything about one pose."""
    heading = where(report.machine.name, report.mode, report.position, report.angles)
    yield f"{heading}\n{reached(report.miss)}{_touching(report)}"
    joints = table("joints", "joint", "coordinate", "limited", "from", "to", "margin", "")
    for j in report.joints:
        unit, scale = ("mm", 1e3) if j.unit == "m" else ("°", math.degrees(1))
        limits = [f"{v * scale:.4g} {unit}" if math.isfinite(v) else "" for v in (j.low, j.high)]
        limited, margin = (f"{v * scale:.4f} {unit}" if limits[1] else "" for v in (j.limited, j.margin))
        kind = "actuated" if j.actuated else "locked" if j.locked else ""
        words = " ".join(w for w in (kind, "" if j.inside else "OUTSIDE") if w)
        joints.add_row(j.name, f"{j.coordinate * scale:.4f} {unit}", limited, *limits, margin, words)
    yield joints
    if report.clearances:
        yield _clearances(report)
    stiffness = table("stiffness at the platform centre in {O} (forces in N, moments in N m, per m and rad)", "", *AXES)
    size = [abs(report.stiffness[i, i]) ** 0.5 for i in range(6)]
    for i, axis in enumerate(("Fx", "Fy", "Fz", "Mx", "My", "Mz")):
        # What is rounding beside the diagonal is printed as the zero that it is.
        row = (v if abs(v) > 1e-12 * size[i] * size[j] else 0.0 for j, v in enumerate(report.stiffness[i]))
        stiffness.add_row(axis, *(f"{v:.5g}" for v in row))
    yield stiffness
    both = table("along each axis", "axis", "K_ii (others held)", "1/C_ii (others free)")
    for a in AXES:
        name, scale, unit = (f"_{a}{a}", 1e-6, "N/µm") if len(a) == 1 else (f"_{a}", 1.0, "N m/rad")
        both.add_row(a, *(f"{report.diagonal(kind + name) * scale:.5g} {unit}" for kind in ("K", "1/C")))
    yield both
    yield budget_table(report)
    if load is not None:
        yield from load_tables(load)


def _touching(report: PoseReport) -> str:
    """What the first line says of bodies that are too near."""
    least = float(report.machine.apart.clearance)
    near = [pair for pair in report.clearances if pair.distance < least]
    if not near:
        return ""
    first = f"{near[0].one} and {near[0].other} {'TOUCH' if near[0].distance < 0 else 'are TOO NEAR'}"
    return f"; {first}" + (f", and {len(near) - 1} more pairs" if len(near) > 1 else "")


def _clearances(report: PoseReport) -> Table:
    """The nearest of the bodies that must not touch."""
    least = float(report.machine.apart.clearance)
    found = table("bodies that must stay apart, the nearest first", "", "", "distance", "")
    for one, other, distance in report.clearances[:NEAREST]:
        found.add_row(
            one, other, f"{distance * 1e3:.3f} mm", "" if distance >= least else "TOUCH" if distance < 0 else "TOO NEAR"
        )
    return found


def budget_table(report: PoseReport) -> Table:
    """Shares of the deflection under a force along x, y and z."""
    shares = {a: {(s.chain, f"{s.element} {s.part}"): s.share for s in report.budget(a)} for a in AXES[:3]}
    budget = table("compliance budget: share of the deflection under a force along", "what yields", *AXES[:3])
    elements = list(dict.fromkeys(element for _, element in shares["x"]))
    for element in elements:
        totals = [sum(v for (_, e), v in shares[a].items() if e == element) for a in AXES[:3]]
        budget.add_row(f"all {element}", *(f"{100 * t:.1f} %" for t in totals))
        for chain in dict.fromkeys(c for c, e in shares["x"] if e == element):
            budget.add_row(f"  {chain}.{element}", *(f"{100 * shares[a][chain, element]:.1f} %" for a in AXES[:3]))
    return budget


def masses_table(report: PoseReport) -> Table:
    """What moves and weighs something, and all of it together."""
    found = table("masses of what moves", "body", "kg")
    for name, mass in report.masses.items():
        if mass:
            found.add_row(name, f"{float(mass):.4g}")
    found.add_row("together", f"{float(sum(report.masses.values())):.4g}")
    return found


def load_tables(load: LoadResult) -> list[Table]:
    """Deflections and drive loads of a load case."""
    moved = table("deflection under the load", "", "x µm", "y µm", "z µm", "rx µrad", "ry µrad", "rz µrad")
    moved.add_row("tool tip", *(f"{v * 1e6:.4f}" for v in load.tool_tip))
    moved.add_row("platform centre", *(f"{v * 1e6:.4f}" for v in load.platform_centre))
    drives = table("what the drives carry", "drive", "load")
    for name, drive in load.drives.items():
        drives.add_row(name, f"{drive.load:.4f} {drive.unit}")
    return [moved, drives]


def as_json(report: PoseReport, load: LoadResult | None = None) -> dict[str, Any]:
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
                f"margin_{j.unit}": finite(j.margin),
                "inside": j.inside,
                "actuated": j.actuated,
                "locked": j.locked,
            }
            for j in report.joints
        ],
        "clearances": [{"bodies": [c.one, c.other], "distance_m": c.distance} for c in report.clearances],
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
