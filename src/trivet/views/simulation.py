"""A machine let go."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.study.dynamics import force_units
from trivet.study.simulation import LAW_WORDS, Simulation
from trivet.views.dynamics import loaded
from trivet.views.layout import beside, fixed, table, where
from trivet.views.si import finite, pose_keys

STILL = 1e-9
"""Speed (m/s, rad/s) of a machine that stands."""


def tables(result: Simulation) -> Iterator[Any]:
    """How it moved, and how far energy and loops can be trusted."""
    at = result.at
    held = [f"{f:.1f}" for f in result.frequencies if f > 0]
    yield (
        f"{where(at.machine.name, at.mode, at.position, at.angles)}\n"
        f"{LAW_WORDS[result.law]}, {loaded(result.loading)}, {result.time[-1]:.4g} s in {result.steps} steps"
        + (f"\nnatural frequencies on the drives' springs: {', '.join(held)} Hz" if held else "")
        + (f"\nended {result.ended}" if result.ended else "")
    )
    moved = table("platform centre", "", "x mm", "y mm", "z mm")
    place = np.stack(list(result.state.pose.origin)) * 1e3
    moved.add_row("at the start", *(fixed(v, 6) for v in place[:, 0]))
    moved.add_row("at the end", *(fixed(v, 6) for v in place[:, -1]))
    moved.add_row("least", *(fixed(v, 6) for v in place.min(axis=1)))
    moved.add_row("greatest", *(fixed(v, 6) for v in place.max(axis=1)))
    yield moved
    drives = table("drives", "drive", "least", "greatest", "greatest force")
    most = float(np.abs(result.forces).max())
    for k, (name, unit) in enumerate(zip(result.actuators, force_units(result.machine), strict=True)):
        scale, shown = (1e3, "mm") if unit == "N" else (math.degrees(1), "°")
        own = result.coordinates[:, k] * scale
        greatest = float(result.forces[np.argmax(np.abs(result.forces[:, k])), k])
        drives.add_row(
            name, f"{fixed(own.min(), 6)} {shown}", f"{fixed(own.max(), 6)} {shown}", f"{beside(greatest, most)} {unit}"
        )
    yield drives
    balance = result.balance
    energies = table("energy, J", "", "kinetic", "weight", "springs", "friction took", "forces put in")
    for name, k in (("at the start", 0), ("at the end", -1)):
        energies.add_row(name, *(f"{float(part[k]) + 0.0:.6g}" for part in balance))
    yield energies
    if max(np.abs(part).max() for part in (*result.state.twist.linear, *result.state.twist.angular)) > STILL:
        yield f"energy drift {np.abs(result.drift).max():.1e} of what moved, loops closed to {result.gap:.1e} m"
    else:
        yield "in balance, and at rest: give it a --velocity, a --force or a --push, or let the drives be free (--drives free)"


def as_json(result: Simulation) -> dict[str, Any]:
    """The whole run."""
    at, state = result.at, result.state
    return {
        "machine": at.machine.name,
        "mode": at.mode,
        **pose_keys(at.position, at.angles),
        "drives": result.law,
        **result.loading.stated(result.machine),
        "natural_frequencies_Hz": finite(result.frequencies),
        "steps": result.steps,
        "longest_step_s": result.longest_step,
        "ended": result.ended,
        "energy_drift": finite(float(np.abs(result.drift).max())),
        "greatest_gap_m": finite(result.gap),
        "actuators": result.actuators,
        "time_s": finite(result.time),
        "position_m": finite(np.stack(list(state.pose.origin), axis=-1)),
        "rotation_matrix": finite(np.stack([np.stack(list(v), axis=-1) for v in state.pose[1:]], axis=-1)),
        "twist_m_per_s_rad_per_s": finite(np.stack([*state.twist.linear, *state.twist.angular], axis=-1)),
        "drive_coordinates_m_or_rad": finite(result.coordinates),
        "drive_forces_N_or_N_m": finite(result.forces),
        "energies_J": {name: finite(np.asarray(part)) for name, part in result.balance._asdict().items()},
    }
