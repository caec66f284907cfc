"""trivet singularity."""

from __future__ import annotations

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, Output


def run(*, choice: Choice, at: At, mode: o.Mode = None, out: Output) -> None:
    """How near a pose is to a singularity, what would go wrong there, and how well forces are transmitted."""
    from trivet.study.singularity import singularity_report
    from trivet.views import singularity as view

    chosen = choice.load()
    out.check()
    with output.busy("looking for singularities", out.as_json):
        result = singularity_report(chosen, at.closing(chosen, mode), mode=mode)
    out.give(result, view)
