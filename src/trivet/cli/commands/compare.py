"""trivet compare."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import DataOutput, Hemisphere, Model

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.study.dynamic_comparison import DynamicComparison


def run(
    *,
    machines: o.Machines = None,
    objective: o.Objective = "K_xx",
    mode: o.Mode = None,
    points: Hemisphere,
    rolls: o.Rolls = 360,
    finer: Annotated[
        int, typer.Option("--finer", help="Refinement of the lattice for the convergence check; 1 leaves it out.")
    ] = 2,
    static_only: Annotated[bool, typer.Option("--static-only", help="Leave out the dynamic stiffness.")] = False,
    sensitivity: Annotated[
        bool,
        typer.Option(
            "--sensitivity/--no-sensitivity",
            help="Vary what descriptions leave open to see what it does to the dynamic stiffness.",
        ),
    ] = True,
    settings: o.Settings = None,
    model: Model,
    out: DataOutput,
) -> None:
    """Compare machines: means and variances of the stiffness over a hemisphere, minimum dynamic stiffness at home."""
    from trivet.errors import NoResultError
    from trivet.study.comparison import PAPER_MACHINES, compare
    from trivet.study.machines import choose, parse_settings
    from trivet.study.whole_comparison import WholeComparison
    from trivet.views import whole_comparison as view

    changes = parse_settings(settings or [])
    chosen = [model.of(choose(name, changes)) for name in machines or PAPER_MACHINES]
    radius, height = points.lengths()
    out.check()
    for machine in chosen:
        output.warn_of_home(machine, mode)
    with output.progress(out.as_json) as advance:
        static = compare(
            *chosen,
            objective=objective,
            mode=mode,
            steps=points.steps,
            radius=radius,
            height=height,
            rolls=rolls,
            finer=finer,
            progress=advance,
        )
    dynamic, missing = None, ""
    if not static_only:
        try:
            dynamic = _dynamics(chosen, mode, sensitivity, out.as_json)
        except NoResultError as error:
            missing = str(error)
    result = WholeComparison(static, dynamic, missing, tuple(machine.name for machine in chosen))
    out.give(result, view)
    if result.without_result:
        raise NoResultError("; ".join(result.without_result))


def _dynamics(chosen: list[Machine], mode: str | None, sensitivity: bool, quiet: bool) -> DynamicComparison:
    from trivet.study.dynamic_comparison import compare_dynamics, variants

    total = len(variants()) if sensitivity else 1
    done = dict.fromkeys((machine.name for machine in chosen), 0)
    with output.progress(quiet, "variants at home") as advance:

        def begin(name: str, variant: str) -> None:
            advance(name, done[name], total)
            done[name] += 1

        return compare_dynamics(*chosen, mode=mode, sensitivity=sensitivity, progress=begin)
