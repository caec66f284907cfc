"""Modes, frequency responses and dynamic comparisons as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.dynamic_comparison import TRANSLATIONS, DynamicComparison
from trivet.study.frf import FrequencyResponse
from trivet.study.mode_paths import ModePaths
from trivet.study.mode_summary import total_mass
from trivet.study.modes import ModesReport
from trivet.study.pose import PoseReport
from trivet.study.response_summary import ShownResponse

if TYPE_CHECKING:
    import xarray as xr

_RECEPTANCE = "m/N (translation, force), m/(N m) (translation, moment), rad/N (rotation, force), rad/(N m) (rotation, moment)"
_STIFFNESS = "N/m along x, y, z; N m/rad about rx, ry, rz"


def modes_dataset(report: ModesReport) -> xr.Dataset:
    """Modes with their shapes at the nodes of the mesh."""
    modes, structure = report.modes, report.modes.mesh.structure
    parts = list(modes.strain_shares)
    beams = np.array([(beam.first, beam.second) for beam in structure.beams]).reshape(-1, 2)
    shape = "1/sqrt(kg) along x, y, z; rad/(m sqrt(kg)) about rx, ry, rz"
    return labelled(
        report.at.machine,
        _pose(report.at)
        | {
            "frequency": (("mode",), report.frequency, "Hz", "natural frequency"),
            "platform": (("component", "mode"), report.platform, shape, "twist of the platform centre, modal mass 1"),
            "node_position": (("node", "axis"), structure.nodes, "m", "nodes of the mesh in {O}; 0 the ground, 1 the platform"),
            "shape": (("node", "component", "mode"), modes.displacements, shape, "twists of the nodes, modal mass 1"),
            "strain_energy_share": (
                ("part", "mode"), np.array([modes.strain_shares[part] for part in parts]), "1", "share of the strain energy",
            ),
            "effective_mass": (
                ("component", "mode"), report.effective_mass, "kg along x, y, z; kg m^2 about rx, ry, rz",
                "mass that takes part when the ground moves",
            ),
            "mass": ((), total_mass(report), "kg", "mass that vibrates, of rods what is out"),
            "beam_nodes": (("beam", "end"), beams, "1", "nodes between which the elements lie"),
        },
        {
            "component": COMPONENTS, "axis": COMPONENTS[:3], "mode": range(1, len(report.frequency) + 1), "part": parts,
            "beam": [beam.name for beam in structure.beams], "end": ("first", "second"),
        },
        working_mode=report.at.mode,
    )  # fmt: skip


def mode_paths_dataset(report: ModePaths) -> xr.Dataset:
    """Branches of modes over the poses of a path, and where they meet."""
    branches, met = report.branches, report.encounters
    pairs = np.array([(one.first + 1, one.second + 1) for one in met], dtype=int).reshape(-1, 2)
    twist = "1/sqrt(kg) along x, y, z; rad/(m sqrt(kg)) about rx, ry, rz"
    return labelled(
        report.machine,
        {
            "position": (("place", "axis"), report.poses[:, :3], "m", "platform centre in {O}"),
            "azimuth": (("place",), report.poses[:, 3], "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
            "tilt": (("place",), report.poses[:, 4], "rad", "beta"),
            "roll": (("place",), report.poses[:, 5], "rad", "gamma"),
            "frequency": (("place", "branch"), report.frequency, "Hz", "natural frequency; NaN above what is looked at"),
            "mode_number": (
                ("place", "branch"), branches.number + 1, "1", "which mode at that pose it is, by frequency from 1; 0 for none",
            ),
            "platform": (
                ("place", "component", "branch"), report.platform, twist, "twist of the platform centre, modal mass 1",
            ),
            "least_mac": (("step", "branch"), branches.mac, "1", "least MAC on the way from pose to pose"),
            "steps": (("step",), branches.steps, "1", "into how many steps the way from pose to pose was divided"),
            "encounter_kind": (("encounter",), np.array([one.kind for one in met], dtype=object), "1", "what branches do"),
            "encounter_place": (("encounter",), np.array([one.place for one in met], dtype=float), "1", "place on the path"),
            "encounter_branches": (("encounter", "end"), pairs, "1", "branches that meet"),
            "encounter_frequency": (("encounter",), np.array([one.frequency for one in met], dtype=float), "Hz", "where"),
            "encounter_gap": (("encounter",), np.array([one.gap for one in met], dtype=float), "Hz", "between the branches"),
            "encounter_exchange": (
                ("encounter",), np.array([one.exchange for one in met], dtype=float), "rad", "turn of shapes into each other",
            ),
        },
        {
            "place": report.place, "axis": COMPONENTS[:3], "component": COMPONENTS,
            "branch": range(1, report.frequency.shape[1] + 1), "end": ("first", "second"),
        },
        working_mode=report.mode,
        doubts=len(branches.doubts),
    )  # fmt: skip


def response_dataset(result: FrequencyResponse) -> xr.Dataset:
    """A frequency response; NetCDF has no complex numbers, so real and imaginary part are the last axis."""
    receptance = np.stack([result.receptance.real, result.receptance.imag], axis=-1)
    minima = ShownResponse(result).minima
    least: dict[str, tuple[Any, ...]] = {}
    if minima:
        least["minimum_dynamic_stiffness"] = (
            ("component",), [m.stiffness for m in minima], _STIFFNESS, "minimum over frequency of 1/|H_jj|",
        )  # fmt: skip
        least["frequency_of_minimum"] = (("component",), [m.frequency for m in minima], "Hz", "where it is")
    return labelled(
        result.at.machine,
        _pose(result.at)
        | {
            "frequency": (("frequency",), result.frequency, "Hz", "frequency, exp(+i omega t)"),
            "receptance": (
                ("frequency", "motion", "load", "part"), receptance, _RECEPTANCE,
                "motion at the response per load at the excitation",
            ),
            "natural_frequency": (("natural",), result.natural, "Hz", "natural frequencies without damping, in the range"),
        }
        | least,
        {"axis": COMPONENTS[:3], "motion": COMPONENTS, "load": COMPONENTS, "part": ("real", "imag")}
        | ({"component": COMPONENTS} if minima else {}),
        working_mode=result.at.mode,
        response=result.response,
        excitation=result.excitation,
        method=result.method,
        damping=result.damping,
        loss_factor=result.loss_factor,
    )  # fmt: skip


def dynamic_comparison_datasets(result: DynamicComparison) -> dict[str, xr.Dataset]:
    """The minimum dynamic stiffness of every machine, by its name, over variants."""
    return {at.machine.name: _dynamics(result, at) for at in result.poses}


def _dynamics(result: DynamicComparison, at: PoseReport) -> xr.Dataset:
    own = [result.of(at.machine.name, variant) for variant in result.variant_names]
    count = max(len(one.natural) for one in own)

    def over_axes(value: str) -> list[list[float]]:
        return [[getattr(one.along(axis), value, np.nan) for axis in TRANSLATIONS] for one in own]

    natural = [[*one.natural, *[np.nan] * (count - len(one.natural))] for one in own]
    return labelled(
        at.machine,
        {
            "minimum_dynamic_stiffness": (
                ("variant", "axis"), over_axes("stiffness"), "N/m", "minimum over frequency of 1/|H_jj| at home",
            ),
            "frequency_of_minimum": (("variant", "axis"), over_axes("frequency"), "Hz", "where it is"),
            "natural_frequency": (("variant", "natural"), natural, "Hz", "the lowest natural frequencies, without damping"),
            "variant_status": (
                ("variant",), np.array([one.status for one in own], dtype=object), "1", "why a variant has no result",
            ),
        },
        {"variant": result.variant_names, "axis": TRANSLATIONS},
        lowest_frequency=result.low,
        highest_frequency=result.high,
        loss_factor=result.loss_factor,
    )  # fmt: skip


def _pose(at: PoseReport) -> dict[str, tuple[Any, ...]]:
    azimuth, tilt, roll = at.angles
    return {
        "position": (("axis",), at.position, "m", "platform centre in {O}"),
        "azimuth": ((), azimuth, "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
        "tilt": ((), tilt, "rad", "beta"),
        "roll": ((), roll, "rad", "gamma"),
    }
