"""Results of studies as labelled datasets, and as NetCDF files."""

from __future__ import annotations

import os
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.kinematics.report import OK, STATUS_WORDS, joint_names
from trivet.measure.files.by_suffix import save_functions
from trivet.measure.imported import Imported
from trivet.measure.modal.model import ModalFit
from trivet.results.netcdf import COMPONENTS, labelled, write_groups, write_netcdf
from trivet.study.accuracy import Accuracy
from trivet.study.accuracy_datasets import accuracy_dataset
from trivet.study.atlas import Atlas
from trivet.study.atlas_datasets import atlas_dataset
from trivet.study.chatter_datasets import lobes_along_dataset, lobes_dataset
from trivet.study.comparison import Comparison
from trivet.study.cone import ConePlan
from trivet.study.correlate import Correlation, ShownCorrelation
from trivet.study.dynamic_comparison import DynamicComparison
from trivet.study.dynamics_datasets import motion_dataset, simulation_dataset
from trivet.study.frf import FrequencyResponse
from trivet.study.lobes import Lobes, LobesAlong
from trivet.study.lock_advice import LocksAdvised
from trivet.study.lock_datasets import advice_dataset, redundant_dataset
from trivet.study.measure_datasets import correlation_dataset, update_dataset
from trivet.study.modal_fit_dataset import fit_dataset
from trivet.study.mode_paths import ModePaths
from trivet.study.modes import ModesReport
from trivet.study.motion import MotionReport
from trivet.study.plan import Plan, PlanStudy
from trivet.study.plan_datasets import cone_dataset, plan_datasets
from trivet.study.reach_datasets import orientation_dataset, tilt_datasets, workspace_datasets
from trivet.study.redundant import RedundantPath
from trivet.study.response_summary import ShownResponse
from trivet.study.simulation import Simulation
from trivet.study.singularity_map import SingularityMap
from trivet.study.solid_check import SolidCheck
from trivet.study.solid_datasets import solid_dataset
from trivet.study.stiffness_map import StiffnessMap
from trivet.study.tilt import TiltReport, TiltStudy
from trivet.study.update import Update
from trivet.study.vibration_datasets import dynamic_comparison_datasets, mode_paths_dataset, modes_dataset, response_dataset
from trivet.study.whole_comparison import WholeComparison
from trivet.study.workspace import OrientationReport, WorkspaceReport, WorkspaceStudy

if TYPE_CHECKING:
    import xarray as xr


def map_dataset(result: StiffnessMap) -> xr.Dataset:
    """A stiffness map as a dataset over its check points."""
    status = np.full(len(result.surface), OK)
    reason = [""] * len(result.surface)
    for k, miss in result.excluded.items():
        status[k], reason[k] = miss.status, miss.reason
    coordinates = np.where(result.used[:, None], result.joints.coordinate, np.nan)
    mixed = "N/m (force, translation), N/rad (force, rotation), N m/rad (moment, rotation)"
    words = ", ".join(f"{i} {word}" for i, word in enumerate(STATUS_WORDS))
    return labelled(
        result.machine,
        {
            "position": (("point", "axis"), result.surface.position, "m", "platform centre in {O}"),
            "azimuth": (("point",), result.surface.azimuth, "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
            "tilt": (("point",), result.surface.tilt, "rad", "beta"),
            "roll": (("point",), result.best.roll, "rad", "gamma, best roll; NaN where no roll reaches"),
            "objective": (
                ("point",),
                result.best.value,
                "N m/rad" if result.objective.is_rotational else "N/m",
                f"{result.objective.name}, maximised over the roll",
            ),
            "ties": (("point",), result.best.ties, "1", "number of rolls that are equally good"),
            "at_limit": (("point",), result.best.at_limit.astype(np.int8), "1", "1 where a joint limit decides the roll"),
            "stiffness": (("point", "row", "column"), result.matrix, mixed, "stiffness at the platform centre in {O}"),
            "joint_coordinate": (("point", "joint"), coordinates, "m or rad", "joint coordinates at the best roll"),
            "status": (("point",), status, "1", words),
            "reason": (("point",), np.array(reason, dtype=object), "1", "why a point is not reached"),
        },
        {"axis": COMPONENTS[:3], "row": COMPONENTS, "column": COMPONENTS, "joint": joint_names(result.machine)},
        working_mode=result.mode,
        surface=result.surface.name,
        objective_name=result.objective.name,
    )


_PLAIN = {"det J_x": "det_J_x", "1/det J_G^-1": "inverse_of_det_J_G_inverse", "1/det J^-1": "inverse_of_det_J_inverse"}
"""Names of fields as NetCDF takes them, which wants no slash."""


def singularity_dataset(result: SingularityMap) -> xr.Dataset:
    """A map of singularities as a dataset over its check points and the points of its singular curves."""
    curve = np.concatenate([np.full(len(c.roll), k) for k, c in enumerate(result.curves)] or [np.zeros(0, dtype=int)])
    places = np.concatenate([c.surface.position for c in result.curves] or [np.zeros((0, 3))])
    rolls = np.concatenate([c.roll for c in result.curves] or [np.zeros(0)])
    fields = {
        _PLAIN.get(name, name): (("point",), values, result.unit(name) or "1", name) for name, values in result.fields.items()
    }
    return labelled(
        result.machine,
        {
            "position": (("point", "axis"), result.surface.position, "m", "platform centre in {O}"),
            "azimuth": (("point",), result.surface.azimuth, "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
            "tilt": (("point",), result.surface.tilt, "rad", "beta"),
            "roll": (("point",), result.roll, "rad", f"gamma, {result.policy}; NaN where the pose is not reached"),
            "curve_position": (("curve_point", "axis"), places, "m", "points of Type 2 singularities, curve after curve"),
            "curve_roll": (("curve_point",), rolls, "rad", "gamma there"),
            "curve": (("curve_point",), curve, "1", "number of the curve"),
        }
        | fields,
        {"axis": COMPONENTS[:3]},
        working_mode=result.mode,
        surface=result.surface.name,
        roll_policy=result.policy,
    )


@singledispatch
def save(result: Any, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a result as labelled NetCDF with units and the machine file inside; a comparison has one group per machine.

    Args:
        result: what `stiffness_map`, `atlas`, `singularity_map`, `compare`, `compare_dynamics`, `modes`, `modes_along`, `frf`,
            `lobes`, `lobes_along`, `advise_locks`, `redundant_path`, `solid_check`, `motion`, `simulate`, `tilt`,
            `workspace`, `plan`, `cone` or `accuracy` gave.
        path: file to write; it appears whole or not at all.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: when the file exists unasked or cannot be written.
    """
    raise TypeError(
        f"no NetCDF of a {type(result).__name__}; maps, comparisons, modes, responses, motions, simulations, tilts, workspaces "
        "and plans can be saved"
    )


@save.register
def _(result: StiffnessMap, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(map_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: Atlas, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(atlas_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: Accuracy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(accuracy_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: SingularityMap, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(singularity_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: ModesReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(modes_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: ModePaths, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(mode_paths_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: FrequencyResponse, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(response_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: ModalFit, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(fit_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: Lobes, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(lobes_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: LobesAlong, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(lobes_along_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: Imported, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    save_functions(result.functions, path, overwrite=overwrite)


@save.register
def _(result: LocksAdvised, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(advice_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: RedundantPath, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(redundant_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: SolidCheck, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(solid_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: ShownResponse, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(response_dataset(result.whole), path, overwrite=overwrite)


@save.register
def _(result: Correlation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(correlation_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: ShownCorrelation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(correlation_dataset(result.whole), path, overwrite=overwrite)


@save.register
def _(result: MotionReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(motion_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: Simulation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(simulation_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: Comparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_groups({m.machine.name: map_dataset(m) for m in result.maps}, path, overwrite=overwrite)


@save.register
def _(result: DynamicComparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_groups(dynamic_comparison_datasets(result), path, overwrite=overwrite)


@save.register
def _(result: WholeComparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    groups = {m.machine.name: map_dataset(m) for m in result.static.maps}
    for name, dynamic in (dynamic_comparison_datasets(result.dynamic) if result.dynamic is not None else {}).items():
        groups[name] = groups[name].merge(dynamic, combine_attrs="no_conflicts") if name in groups else dynamic
    write_groups(groups, path, overwrite=overwrite)


@save.register
def _(result: TiltStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_groups(tilt_datasets(result), path, overwrite=overwrite)


@save.register
def _(result: WorkspaceStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_groups(workspace_datasets(result), path, overwrite=overwrite)


@save.register
def _(result: OrientationReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(orientation_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: TiltReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    save(TiltStudy((result,)), path, overwrite=overwrite)


@save.register
def _(result: WorkspaceReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    save(WorkspaceStudy((result,)), path, overwrite=overwrite)


@save.register
def _(result: PlanStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_groups(plan_datasets(result), path, overwrite=overwrite)


@save.register
def _(result: Plan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    save(PlanStudy((result,)), path, overwrite=overwrite)


@save.register
def _(result: ConePlan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(cone_dataset(result), path, overwrite=overwrite)


@save.register
def _(result: Update, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    write_netcdf(update_dataset(result), path, overwrite=overwrite)
