"""Modes at a pose."""

from __future__ import annotations

from typing import Any

from trivet.study.mode_summary import summaries, total_mass
from trivet.study.modes import ModesReport
from trivet.views.layout import reached, table, where
from trivet.views.si import finite, pose_keys


def tables(report: ModesReport) -> list[Any]:
    """What every mode does."""
    at = report.at
    columns = ("", "Hz", "platform moves", "what yields, share of the strain energy", "effective mass x", "y", "z")
    found = table("modes", *columns)
    found.columns[2].justify = found.columns[3].justify = "left"
    modes = summaries(report)
    for mode in modes:
        parts = ", ".join(f"{part} {100 * share:.0f} %" for part, share in mode.yielding)
        fractions = (f"{100 * f:.1f} %" for f in mode.mass_fraction)
        found.add_row(str(mode.number), f"{mode.frequency:.2f}", mode.motion, parts, *fractions)
    together = (f"{100 * sum(m.mass_fraction[k] for m in modes):.1f} %" for k in range(3))
    found.add_row("", "", "", "together", *together)
    return [
        f"{where(at.machine.name, at.mode, at.position, at.angles)}\n{reached(at.miss)}",
        found,
        f"Effective mass: of the machine's {total_mass(report):.4g} kg, what takes part when the ground moves along x, y, z.",
    ]


def as_json(report: ModesReport) -> dict[str, Any]:
    """Modes with all shares."""
    at = report.at
    return {
        "machine": at.machine.name,
        "mode": at.mode,
        **pose_keys(at.position, at.angles),
        "reached": at.miss is None,
        "mass_kg": total_mass(report),
        "modes": [
            {
                "number": mode.number,
                "frequency_Hz": finite(mode.frequency),
                "platform_moves": mode.motion,
                "platform_twist_1_or_rad_per_m_per_sqrt_kg": finite(report.platform[:, k]),
                "strain_energy_shares": {part: finite(share) for part, share in report.shares[k]},
                "effective_mass_kg": finite(report.effective_mass[:3, k]),
                "effective_inertia_kg_m2": finite(report.effective_mass[3:, k]),
                "effective_mass_fraction": finite(mode.mass_fraction),
            }
            for k, mode in enumerate(summaries(report))
        ],
    }
