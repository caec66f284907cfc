"""trivet: analysis and design of parallel kinematic machines.

One description of a machine, everything derived:

    import trivet
    comparison = trivet.compare("azulay", "eclipse", "my-machine.toml")
    trivet.figure(comparison, "compare.png")

The names below are loaded when they are first used, so that importing trivet, and `trivet --help`, cost nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trivet.chatter.cut import Cut
    from trivet.design.optimisation import Optimisation, optimise
    from trivet.design.study import Study, read_study
    from trivet.design.sweep import Sweep, sweep
    from trivet.design.uncertainty import Uncertainty, sensitivity
    from trivet.design.writing import write_machines
    from trivet.errors import InputError, NoResultError, TrivetError
    from trivet.interop.calculix import to_calculix, write_calculix
    from trivet.interop.mjcf import to_mjcf, write_mjcf
    from trivet.interop.urdf import to_urdf, write_urdf
    from trivet.kinematics.forward import Forward
    from trivet.measure.files.by_suffix import read_functions, save_functions
    from trivet.measure.files.several import import_files
    from trivet.measure.functions import Channel, Functions
    from trivet.measure.machine.parameters import Free
    from trivet.measure.machine.setup import read_setup
    from trivet.measure.modal.fitting import fit_modes
    from trivet.measure.modal.model import ModalFit
    from trivet.measure.universal.reading import read_universal
    from trivet.measure.universal.writing import write_universal
    from trivet.model import Machine, catalogue, dimensions, load, parse, schema, to_text, write
    from trivet.report.making import write_report
    from trivet.show.figure import figure
    from trivet.space.curve import Limits, Trajectory, circle, straight, through, timed
    from trivet.space.family import Family, along, in_block, over_hemisphere
    from trivet.space.pose import zyz_frame
    from trivet.space.surface import Surface, hemisphere
    from trivet.study.accuracy import Accuracy, accuracy
    from trivet.study.advice import Change, advice
    from trivet.study.atlas import Atlas, atlas
    from trivet.study.atlas_datasets import save_responses
    from trivet.study.comparison import Comparison, compare
    from trivet.study.cone import ConePlan, cone
    from trivet.study.correlate import Correlation, correlate
    from trivet.study.datasets import save
    from trivet.study.dynamic_comparison import DynamicComparison, compare_dynamics
    from trivet.study.dynamics import DynamicsReport, Loading, dynamics_report
    from trivet.study.families import along_path
    from trivet.study.forward import forward
    from trivet.study.frf import FrequencyResponse, Minimum, frf, minimum_dynamic_stiffness
    from trivet.study.lobes import Lobes, LobesAlong, lobes, lobes_along
    from trivet.study.lock_advice import LocksAdvised, advise_locks
    from trivet.study.lock_measures import Goal
    from trivet.study.locks import LockSets, lock_sets
    from trivet.study.machines import switched
    from trivet.study.mode_paths import ModePaths, modes_along
    from trivet.study.modes import ModesReport, modes
    from trivet.study.motion import MotionReport, motion
    from trivet.study.pathfile import read_path
    from trivet.study.plan import Plan, PlanStudy, plan, plan_along, plans
    from trivet.study.pose import PoseReport, pose
    from trivet.study.redundant import RedundantPath, redundant_path
    from trivet.study.simulation import Simulation, simulate
    from trivet.study.singularity import SingularityReport, singularity_report
    from trivet.study.singularity_map import SingularityMap, singularity_map
    from trivet.study.solid_check import SolidCheck, solid_check
    from trivet.study.stiffness_map import StiffnessMap, stiffness_map
    from trivet.study.tilt import TiltReport, TiltStudy, tilt, tilts
    from trivet.study.tolerance_file import Heat, Misalignment, Play, Positioning, Tolerance, Tolerances, read_tolerances
    from trivet.study.update import Update, update
    from trivet.study.workspace import (
        OrientationReport,
        WorkspaceReport,
        WorkspaceStudy,
        orientation_workspace,
        workspace,
        workspaces,
    )

_HOMES = {
    "trivet.chatter.cut": ("Cut",),
    "trivet.design.optimisation": ("Optimisation", "optimise"),
    "trivet.design.study": ("Study", "read_study"),
    "trivet.design.sweep": ("Sweep", "sweep"),
    "trivet.design.uncertainty": ("Uncertainty", "sensitivity"),
    "trivet.design.writing": ("write_machines",),
    "trivet.errors": ("InputError", "NoResultError", "TrivetError"),
    "trivet.interop.calculix": ("to_calculix", "write_calculix"),
    "trivet.interop.mjcf": ("to_mjcf", "write_mjcf"),
    "trivet.interop.urdf": ("to_urdf", "write_urdf"),
    "trivet.kinematics.forward": ("Forward",),
    "trivet.measure.files.by_suffix": ("read_functions", "save_functions"),
    "trivet.measure.modal.fitting": ("fit_modes",),
    "trivet.measure.files.several": ("import_files",),
    "trivet.measure.modal.model": ("ModalFit",),
    "trivet.measure.functions": ("Channel", "Functions"),
    "trivet.measure.machine.parameters": ("Free",),
    "trivet.measure.machine.setup": ("read_setup",),
    "trivet.measure.universal.reading": ("read_universal",),
    "trivet.measure.universal.writing": ("write_universal",),
    "trivet.model": ("Machine", "catalogue", "dimensions", "load", "parse", "schema", "to_text", "write"),
    "trivet.report.making": ("write_report",),
    "trivet.show.figure": ("figure",),
    "trivet.space.curve": ("Limits", "Trajectory", "circle", "straight", "through", "timed"),
    "trivet.space.family": ("Family", "along", "in_block", "over_hemisphere"),
    "trivet.space.pose": ("zyz_frame",),
    "trivet.space.surface": ("Surface", "hemisphere"),
    "trivet.study.accuracy": ("Accuracy", "accuracy"),
    "trivet.study.advice": ("Change", "advice"),
    "trivet.study.atlas": ("Atlas", "atlas"),
    "trivet.study.atlas_datasets": ("save_responses",),
    "trivet.study.comparison": ("Comparison", "compare"),
    "trivet.study.cone": ("ConePlan", "cone"),
    "trivet.study.correlate": ("Correlation", "correlate"),
    "trivet.study.datasets": ("save",),
    "trivet.study.dynamic_comparison": ("DynamicComparison", "compare_dynamics"),
    "trivet.study.dynamics": ("DynamicsReport", "Loading", "dynamics_report"),
    "trivet.study.families": ("along_path",),
    "trivet.study.forward": ("forward",),
    "trivet.study.frf": ("FrequencyResponse", "Minimum", "frf", "minimum_dynamic_stiffness"),
    "trivet.study.lobes": ("Lobes", "LobesAlong", "lobes", "lobes_along"),
    "trivet.study.lock_advice": ("LocksAdvised", "advise_locks"),
    "trivet.study.lock_measures": ("Goal",),
    "trivet.study.locks": ("LockSets", "lock_sets"),
    "trivet.study.machines": ("switched",),
    "trivet.study.mode_paths": ("ModePaths", "modes_along"),
    "trivet.study.modes": ("ModesReport", "modes"),
    "trivet.study.motion": ("MotionReport", "motion"),
    "trivet.study.pathfile": ("read_path",),
    "trivet.study.plan": ("Plan", "PlanStudy", "plan", "plan_along", "plans"),
    "trivet.study.pose": ("PoseReport", "pose"),
    "trivet.study.redundant": ("RedundantPath", "redundant_path"),
    "trivet.study.simulation": ("Simulation", "simulate"),
    "trivet.study.singularity": ("SingularityReport", "singularity_report"),
    "trivet.study.singularity_map": ("SingularityMap", "singularity_map"),
    "trivet.study.solid_check": ("SolidCheck", "solid_check"),
    "trivet.study.stiffness_map": ("StiffnessMap", "stiffness_map"),
    "trivet.study.tilt": ("TiltReport", "TiltStudy", "tilt", "tilts"),
    "trivet.study.tolerance_file": (
        "Heat",
        "Misalignment",
        "Play",
        "Positioning",
        "Tolerance",
        "Tolerances",
        "read_tolerances",
    ),
    "trivet.study.update": ("Update", "update"),
    "trivet.study.workspace": (
        "OrientationReport",
        "WorkspaceReport",
        "WorkspaceStudy",
        "orientation_workspace",
        "workspace",
        "workspaces",
    ),
}

__all__ = [
    "Accuracy", "Atlas", "Change", "Channel", "Comparison", "ConePlan", "Correlation", "Cut", "DynamicComparison",
    "DynamicsReport", "Family", "Forward", "Free", "FrequencyResponse", "Functions", "Goal", "Heat", "InputError", "Limits",
    "Loading", "Lobes", "LobesAlong", "LockSets", "LocksAdvised", "Machine", "Minimum", "Misalignment", "ModalFit",
    "ModePaths", "ModesReport", "MotionReport", "NoResultError", "Optimisation", "OrientationReport", "Plan", "PlanStudy",
    "Play", "PoseReport", "Positioning", "RedundantPath", "Simulation", "SingularityMap", "SingularityReport", "SolidCheck",
    "StiffnessMap", "Study", "Surface", "Sweep", "TiltReport", "TiltStudy", "Tolerance", "Tolerances", "Trajectory",
    "TrivetError", "Uncertainty", "Update", "WorkspaceReport", "WorkspaceStudy", "accuracy", "advice", "advise_locks",
    "along", "along_path", "atlas", "catalogue", "circle", "compare", "compare_dynamics", "cone", "correlate", "dimensions",
    "dynamics_report", "figure", "fit_modes", "forward", "frf", "hemisphere", "import_files", "in_block", "load", "lobes",
    "lobes_along", "lock_sets", "minimum_dynamic_stiffness", "modes", "modes_along", "motion", "optimise",
    "orientation_workspace", "over_hemisphere", "parse", "plan", "plan_along", "plans", "pose", "read_functions", "read_path",
    "read_setup", "read_study", "read_tolerances", "read_universal", "redundant_path", "save", "save_functions",
    "save_responses", "schema", "sensitivity", "simulate", "singularity_map", "singularity_report", "solid_check",
    "stiffness_map", "straight", "sweep", "switched", "through", "tilt", "tilts", "timed", "to_calculix", "to_mjcf",
    "to_text", "to_urdf", "update", "workspace", "workspaces", "write", "write_calculix", "write_machines", "write_mjcf",
    "write_report", "write_universal", "write_urdf", "zyz_frame",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(home), name)
    raise AttributeError(f"module 'trivet' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
