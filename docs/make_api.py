"""Write docs/api.md, the public names of trivet in groups, and docs/api-parts.md, the classes that those take and give.

python docs/make_api.py
"""

from __future__ import annotations

import ast
import importlib
import inspect
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, get_args, get_type_hints

import trivet

DOCS = Path(__file__).parent

PUBLIC = """# Python

Everything is at hand as `trivet.NAME`, is loaded when it is first used, and takes and gives SI: m, kg, s, N, rad. What results
hold is told in [parts of results](api-parts.md). (Made by `python docs/make_api.py` from what the names say of themselves.)"""
PARTS = """# Parts of results

The classes that the [public names](api.md) take and give. One does not make them, mostly, but reads what they hold. (Made
by `python docs/make_api.py`.)"""

# What people do, and the names for it in the order in which they meet them.
GROUPS = {
    "Machines": "load parse catalogue dimensions switched write to_text schema Machine",
    "Places, surfaces, paths": "zyz_frame hemisphere Surface over_hemisphere in_block along along_path Family read_path "
    "straight circle through timed Limits Trajectory",
    "One pose": "pose PoseReport forward Forward singularity_report SingularityReport",
    "Stiffness and singularities, pose by pose": "stiffness_map StiffnessMap compare Comparison singularity_map SingularityMap",
    "Accuracy": "accuracy Tolerances Tolerance Misalignment Positioning Play Heat read_tolerances Accuracy",
    "Reach": "tilt tilts TiltReport TiltStudy workspace workspaces WorkspaceReport WorkspaceStudy orientation_workspace "
    "OrientationReport",
    "Ways": "plan plan_along plans Plan PlanStudy cone ConePlan advice Change",
    "Drives to spare": "lock_sets LockSets advise_locks Goal LocksAdvised redundant_path RedundantPath",
    "Motion": "dynamics_report Loading DynamicsReport motion MotionReport simulate Simulation",
    "Vibration": "modes ModesReport modes_along ModePaths frf FrequencyResponse minimum_dynamic_stiffness Minimum atlas Atlas "
    "save_responses compare_dynamics DynamicComparison",
    "Milling": "lobes lobes_along Cut Lobes LobesAlong",
    "Solids": "solid_check SolidCheck",
    "Measurements": "import_files read_functions save_functions read_universal write_universal Functions Channel "
    "fit_modes ModalFit read_setup correlate Correlation update Free Update",
    "Many designs": "read_study Study sweep Sweep optimise Optimisation write_machines sensitivity Uncertainty",
    "Figures, data, other programs": "figure save write_report write_mjcf to_mjcf write_urdf to_urdf write_calculix "
    "to_calculix",
    "Errors": "TrivetError InputError NoResultError",
}


def pages() -> dict[Path, str]:
    """The pages as they should be."""
    groups = (f"## {title}\n\n" + items([f"trivet.{name}" for name in names.split()]) for title, names in GROUPS.items())
    return {
        DOCS / "api.md": "\n\n".join([PUBLIC, *groups]) + "\n",
        DOCS / "api-parts.md": "\n\n".join([PARTS, items(parts())]) + "\n",
    }


def public() -> list[str]:
    """The public names."""
    names = [name for group in GROUPS.values() for name in group.split()]
    assert sorted(names) == sorted(trivet.__all__), f"GROUPS: {set(names) ^ set(trivet.__all__)}"
    return [f"trivet.{name}" for name in names]


def parts() -> list[str]:
    """The classes which these take and give."""
    values = [the(name) for name in public()]
    found = {part for value in values for hints in types(value) for hint in hints[1].values() for part in classes(hint)}
    return sorted(f"{part.__module__}.{part.__qualname__}" for part in found.difference(values))


def the(name: str) -> Any:
    """What has this name."""
    home, _, own = name.rpartition(".")
    return getattr(importlib.import_module(home), own)


def items(names: list[str]) -> str:
    """Names, and the first sentence of what is said of each."""
    said = ((name, (inspect.getdoc(the(name)) or "").partition("\n\n")[0]) for name in names)
    return "\n".join(f"- `{name}`: {' '.join(text.split())}" for name, text in said)


def types(value: Any) -> Iterator[tuple[Any, dict[str, Any]]]:
    """A function, or a class and the functions in it, each with the types that it names."""
    own = vars(value).items() if inspect.isclass(value) else ()
    members = (
        getattr(member, "fget", None) or getattr(member, "func", None) or getattr(member, "__func__", member)
        for name, member in own
        if not name.startswith("_")
    )
    for one in (value, *(inspect.unwrap(member) for member in members if callable(member))):
        if one is value or inspect.isfunction(one):
            hints = get_type_hints(one, names_of(sys.modules[one.__module__]))
            yield one, {name: hint for name, hint in hints.items() if not name.startswith("_")}


@cache
def names_of(module: ModuleType) -> dict[str, Any]:
    """What a module knows when types are looked at."""
    known = dict(vars(module))
    for node in ast.parse(inspect.getsource(module)).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            exec(compile(ast.Module(node.body, []), module.__name__, "exec"), known)
    return known


def classes(hint: Any) -> Iterator[type]:
    """The classes of trivet of which a type is made."""
    if inspect.isclass(hint) and hint.__module__.startswith("trivet.") and not hint.__name__.startswith("_"):
        yield hint
    for argument in get_args(hint):
        yield from classes(argument)


if __name__ == "__main__":
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
