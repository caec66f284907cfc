"""One function for every picture."""

from __future__ import annotations

import os
from functools import singledispatch
from typing import Any

from trivet.design.optimisation import Optimisation
from trivet.design.sweep import Sweep
from trivet.design.uncertainty import Uncertainty
from trivet.kinematics.forward import Forward
from trivet.measure.imported import Imported
from trivet.measure.modal.model import ModalFit
from trivet.model import Machine
from trivet.show.accuracy import draw_accuracy
from trivet.show.assembly import draw_assembly
from trivet.show.atlas import draw_atlas
from trivet.show.comparison import draw_comparison
from trivet.show.cone import draw_cone
from trivet.show.correlation import draw_correlation
from trivet.show.drawing import draw
from trivet.show.dynamic_comparison import draw_dynamics, draw_whole
from trivet.show.front import draw_front
from trivet.show.histories import draw_motion, draw_simulation
from trivet.show.lobes import draw_lobes
from trivet.show.locks import draw_locks
from trivet.show.maps import draw_map
from trivet.show.measured import draw_measured
from trivet.show.measured_points import draw_points
from trivet.show.modal_fit import draw_modal_fit
from trivet.show.mode_paths import draw_mode_paths
from trivet.show.mode_shapes import draw_modes
from trivet.show.plan import draw_plans
from trivet.show.response import draw_response
from trivet.show.singularity import draw_singularities
from trivet.show.solids import draw_solids
from trivet.show.sweep import draw_sweep
from trivet.show.tilt import draw_tilts
from trivet.show.uncertainty import draw_uncertainty
from trivet.show.update import draw_update
from trivet.show.workspace import draw_orientations, draw_workspaces
from trivet.study.accuracy import Accuracy
from trivet.study.atlas import Atlas
from trivet.study.comparison import Comparison
from trivet.study.cone import ConePlan
from trivet.study.correlate import Correlation, MappedPoints, ShownCorrelation
from trivet.study.dynamic_comparison import DynamicComparison
from trivet.study.frf import FrequencyResponse
from trivet.study.lobes import Lobes, LobesAlong
from trivet.study.lock_advice import LocksAdvised
from trivet.study.mode_paths import ModePaths
from trivet.study.modes import ModesReport
from trivet.study.motion import MotionReport
from trivet.study.plan import Plan, PlanStudy
from trivet.study.pose import PoseReport
from trivet.study.redundant import RedundantPath
from trivet.study.response_summary import ShownResponse
from trivet.study.simulation import Simulation
from trivet.study.singularity import SingularityReport
from trivet.study.singularity_map import SingularityMap
from trivet.study.solid_check import SolidCheck
from trivet.study.stiffness_map import StiffnessMap
from trivet.study.tilt import TiltReport, TiltStudy
from trivet.study.update import Update
from trivet.study.whole_comparison import WholeComparison
from trivet.study.workspace import OrientationReport, WorkspaceReport, WorkspaceStudy


@singledispatch
def figure(result: Any, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a machine, a pose, a map, a comparison, modes, responses, a motion, a plan, a sweep or what else trivet gives.

    Args:
        result: a Machine (at home), or what `pose`, `forward`, `singularity_report`, `stiffness_map`, `singularity_map`,
            `compare`, `compare_dynamics`, `modes`, `modes_along`, `frf`, `lobes`, `lobes_along`, `advise_locks`,
            `redundant_path`, `solid_check`, `motion`,
            `simulate`, `tilt`, `workspace`, `plan`, `cone`, `accuracy`, `optimise` or (the first of two results) `sweep` gave.
        path: file to write; .png is a picture, .html a page that needs no network.
        overwrite: whether the file may be replaced.

    Raises:
        InputError: for another suffix, a file that exists unasked or that cannot be written.
    """
    raise TypeError(
        f"no figure of a {type(result).__name__}; machines, poses, maps, comparisons, responses, motions, simulations, "
        "tilts, workspaces, plans, sweeps and optimisations can be drawn"
    )


@figure.register
def _(result: Machine, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw(result, path=path, overwrite=overwrite)


@figure.register
def _(result: PoseReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    status = result.miss.reason if result.miss is not None else ""
    draw(result.machine, result.frame, result.mode, path=path, status=status, overwrite=overwrite)


@figure.register
def _(result: Forward, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_assembly(result, path, overwrite=overwrite)


@figure.register
def _(result: StiffnessMap, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_map(result, path, overwrite=overwrite)


@figure.register
def _(result: Atlas, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_atlas(result, path, overwrite=overwrite)


@figure.register
def _(result: Accuracy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_accuracy(result, path, overwrite=overwrite)


@figure.register
def _(result: SingularityReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    found = result.singularity
    moves = "moves along the arrow" if found.motion.point is None else "turns about the arrow"
    status = [f"Type 1: {', '.join(drive.name for drive in found.faults)} moves without the platform"] if found.faults else []
    if found.type != 1:
        status.append(f"{'Type 2: with all drives held' if found.type else 'least controlled:'} the platform {moves}")
    draw(
        found.machine,
        found.frame,
        found.mode,
        path=path,
        status="; ".join(status),
        motion=found.motion,
        overwrite=overwrite,
    )


@figure.register
def _(result: SingularityMap, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_singularities(result, path, overwrite=overwrite)


@figure.register
def _(result: Comparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_comparison(result, path, overwrite=overwrite)


@figure.register
def _(result: FrequencyResponse, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_response(ShownResponse(result), path, overwrite=overwrite)


@figure.register
def _(result: ShownResponse, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_response(result, path, overwrite=overwrite)


@figure.register
def _(result: Correlation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_correlation(ShownCorrelation(result), path, overwrite=overwrite)


@figure.register
def _(result: ShownCorrelation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_correlation(result, path, overwrite=overwrite)


@figure.register
def _(result: MappedPoints, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_points(result, path, overwrite=overwrite)


@figure.register
def _(result: Lobes | LobesAlong, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_lobes(result, path, overwrite=overwrite)


@figure.register
def _(result: Imported, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_measured(result, path, overwrite=overwrite)


@figure.register
def _(result: ModalFit, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_modal_fit(result, path, overwrite=overwrite)


@figure.register
def _(result: LocksAdvised | RedundantPath, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_locks(result, path, overwrite=overwrite)


@figure.register
def _(result: SolidCheck, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_solids(result, path, overwrite=overwrite)


@figure.register
def _(result: ModesReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_modes(result, path, overwrite=overwrite)


@figure.register
def _(result: ModePaths, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_mode_paths(result, path, overwrite=overwrite)


@figure.register
def _(result: TiltStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_tilts(result, path, overwrite=overwrite)


@figure.register
def _(result: WorkspaceStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_workspaces(result, path, overwrite=overwrite)


@figure.register
def _(result: OrientationReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_orientations(result, path, overwrite=overwrite)


@figure.register
def _(result: DynamicComparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_dynamics(result, path, overwrite=overwrite)


@figure.register
def _(result: WholeComparison, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_whole(result, path, overwrite=overwrite)


@figure.register
def _(result: MotionReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_motion(result, path, overwrite=overwrite)


@figure.register
def _(result: Simulation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_simulation(result, path, overwrite=overwrite)


@figure.register
def _(result: PlanStudy, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_plans(result, path, overwrite=overwrite)


@figure.register
def _(result: Plan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_plans(PlanStudy((result,)), path, overwrite=overwrite)


@figure.register
def _(result: ConePlan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_cone(result, path, overwrite=overwrite)


@figure.register
def _(result: TiltReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_tilts(TiltStudy((result,)), path, overwrite=overwrite)


@figure.register
def _(result: WorkspaceReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_workspaces(WorkspaceStudy((result,)), path, overwrite=overwrite)


@figure.register
def _(result: Update, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_update(result, path, overwrite=overwrite)


@figure.register
def _(result: Sweep, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_sweep(result, path, overwrite=overwrite)


@figure.register
def _(result: Optimisation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_front(result, path, overwrite=overwrite)


@figure.register
def _(result: Uncertainty, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    draw_uncertainty(result, path, overwrite=overwrite)
