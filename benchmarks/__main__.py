"""`python -m benchmarks`: every benchmark, printed as a table and kept in RESULTS.md with the machine and the date."""

from __future__ import annotations

import argparse
import datetime
import os
import platform
from pathlib import Path

# Peers solve small systems: threads inside LAPACK cost them more than they bring.  To be set before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks import (
    accelerator,
    atlas,
    designs,
    dynamics,
    fronts,
    kernels,
    kinematics,
    modal_fit,
    page,
    plan,
    processes,
    reach,
    vibration,
)

GROUPS = {
    "map": kernels.best_roll_map,
    "full": kernels.full_stiffness,
    "opensees": kernels.against_opensees,
    "gradient": kernels.gradient,
    "inverse": kinematics.inverse_kinematics,
    "forward": kinematics.complete_forward,
    "tracking": kinematics.tracking,
    "compile": kernels.compile_times,
    "memory": processes.constant_memory,
    "processes": processes.whole_processes,
    "vibration": vibration.responses,
    "atlas": atlas.atlas,
    "dynamics": dynamics.on_one_core,
    "tilt": reach.tilt_analysis,
    "plan": plan.roll_plan,
    "modal-fit": modal_fit.modal_fit,
    "designs": designs.sweep_of_designs,
    "fronts": fronts.fronts,
    "page": page.input_to_scene,
    "accelerator": accelerator.against_the_processor,
}


def machine() -> str:
    """The machine in words."""
    model = next(
        (
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ),
        platform.processor(),
    )
    return f"{model}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}, Python {platform.python_version()}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("groups", nargs="*", default=[g for g in GROUPS if g != "accelerator"], help=", ".join(GROUPS))
    parser.add_argument("--keep", action="store_true", help="append to benchmarks/RESULTS.md")
    chosen = parser.parse_args()
    lines = [f"## {datetime.date.today()}: {machine()}", "", "| what | figure | aim |", "|---|---|---|"]
    for group in chosen.groups:
        for what, figure, aim in GROUPS[group]():
            lines.append(f"| {what} | {figure} | {aim} |")
            print(lines[-1], flush=True)
    if chosen.keep:
        path = Path(__file__).with_name("RESULTS.md")
        path.write_text(path.read_text(encoding="utf-8").rstrip() + "\n\n" + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
