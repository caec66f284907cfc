"""Beams and solids side by side."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.table import Table

from trivet.solids.parts import Solid
from trivet.study.response_summary import unit_of_stiffness
from trivet.study.solid_check import COARSER, SolidCheck
from trivet.views.layout import reached, table, where
from trivet.views.si import finite, minima_json, pose_keys

ENDS = {"plane": "stay plane", "rigid": "are rigid", "mean": "follow in the mean"}


def tables(check: SolidCheck) -> Iterator[Any]:
    """What became solid, natural frequencies, minimum dynamic stiffness."""
    at, low, high = check.at, check.frequency[0], check.frequency[-1]
    yield (
        f"{where(at.machine.name, at.mode, at.position, at.angles)}\n{reached(at.miss)}\n"
        f"solids in place of beams ({at.machine.theory}), whose ends {ENDS[check.ends]}; {low:g} to {high:g} Hz, "
        f"loss factor {check.loss_factor:g}"
    )
    yield _parts(check)
    yield _natural(check) if len(check.beams.natural) else f"no natural frequency from {low:g} to {high:g} Hz"
    if check.solids.minima:
        yield _minima(check)
    else:
        yield "Without damping the response has no bound at a natural frequency, and the dynamic stiffness goes down to zero."
    if len(check.beams.natural):
        yield (
            f"Coarser mesh: natural frequencies with elements {COARSER:g} times as large; the mesh itself errs less. "
            "Modes are paired by their MAC, that of motions of nodes and axes; of modes that coincide, that of their spaces."
        )


def _parts(check: SolidCheck) -> Table:
    columns = ("", "mm", "from", "elements", "size mm", "coarser", "kg", "beam kg", "modes", "all up to Hz")
    found = table("solids", *columns)
    found.columns[2].justify = "left"
    for solid, coarser in zip(check.parts, check.coarser_elements, strict=True):
        own = solid.reduced
        found.add_row(
            ", ".join(solid.names), f"{1e3 * solid.length:.6g}", _origin(solid), f"{own.grid.elements} {own.grid.kind}",
            f"{1e3 * own.grid.size:.3g}", str(coarser), f"{own.weight:.5g}", f"{solid.beam_mass:.5g}", str(len(own.modes)),
            f"{own.cut_off:g}",
        )  # fmt: skip
    return found


def _origin(solid: Solid) -> str:
    return "section" if solid.file is None else solid.file


def _natural(check: SolidCheck) -> Table:
    found = table("natural frequencies", "", "beams Hz", "solids Hz", "difference", "coarser mesh", "MAC")
    rows = zip(check.beams.natural, check.solids.natural, check.difference, check.mesh_error, check.mac, strict=True)
    for k, (beams, solids, difference, error, mac) in enumerate(rows, 1):
        shares = (f"{100 * difference:+.3f} %", f"{100 * error:+.3f} %")
        found.add_row(str(k), f"{beams:.2f}", f"{solids:.2f}", *shares, f"{mac:.4f}")
    return found


def _minima(check: SolidCheck) -> Table:
    found = table("minimum dynamic stiffness", "direction", "beams", "at Hz", "solids", "at Hz", "difference")
    for beams, solids in zip(check.beams.minima, check.solids.minima, strict=True):
        own = unit_of_stiffness(beams.direction)
        sides = [
            cell for m in (beams, solids) for cell in (f"{own.factor * m.stiffness:.5g} {own.written}", f"{m.frequency:.2f}")
        ]
        found.add_row(beams.direction, *sides, f"{100 * (solids.stiffness / beams.stiffness - 1):+.3f} %")
    return found


def as_json(check: SolidCheck) -> dict[str, Any]:
    """Both machines, the solids and their meshes."""
    at = check.at
    return {
        "machine": at.machine.name,
        "mode": at.mode,
        **pose_keys(at.position, at.angles),
        "reached": at.miss is None,
        "ends": check.ends,
        "fineness": check.fineness,
        "loss_factor": check.loss_factor,
        "solids": [
            {
                "parts": list(solid.names),
                "file": solid.file,
                "length_m": solid.length,
                "kind_of_elements": solid.reduced.grid.kind,
                "elements": solid.reduced.grid.elements,
                "elements_of_coarser_mesh": coarser,
                "size_m": solid.reduced.grid.size,
                "mass_kg": solid.reduced.weight,
                "beam_mass_kg": solid.beam_mass,
                "centre_m": finite(solid.reduced.centre),
                "inertia_kg_m2": finite(solid.reduced.inertia),
                "fixed_interface_modes_Hz": finite(solid.reduced.modes),
                "cut_off_Hz": solid.reduced.cut_off,
            }
            for solid, coarser in zip(check.parts, check.coarser_elements, strict=True)
        ],
        "natural_frequencies": {
            "beams_Hz": finite(check.beams.natural),
            "solids_Hz": finite(check.solids.natural),
            "difference": finite(check.difference),
            "MAC": finite(check.mac),
            "coarser_mesh_Hz": finite(check.coarser),
        },
        "minimum_dynamic_stiffness": {
            "beams": minima_json(check.beams.minima),
            "solids": minima_json(check.solids.minima),
        },
        "frequency_Hz": finite(check.frequency),
        "receptance_SI": {
            name: {"re": finite(np.real(side.receptance)), "im": finite(np.imag(side.receptance))}
            for name, side in (("beams", check.beams), ("solids", check.solids))
        },
    }
