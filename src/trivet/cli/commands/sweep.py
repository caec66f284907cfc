"""trivet sweep."""

from __future__ import annotations

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Output


def run(
    *,
    study: o.Study,
    store: o.Store = None,
    workers: o.Workers = 0,
    scheduler: o.Scheduler = None,
    out: Output,
) -> None:
    """Work out quantities of many designs of machines, as a study file asks for; goes on where it was interrupted."""
    from trivet.design.study import read_study
    from trivet.design.sweep import check, sweep
    from trivet.errors import NoResultError
    from trivet.views import sweep as view

    asked = read_study(study, check)
    out.check()
    folder = o.store_of(study, store)
    with output.goes_on(folder), output.remaining(out.as_json, "designs") as advance:
        result, outcome = sweep(asked, folder, workers=workers, scheduler=scheduler, progress=advance)
    output.wrote(folder)
    out.give(result, view, outcome, wrapped=True)
    if outcome.failures:
        raise NoResultError(f"{len(outcome.failures)} chunks failed; the same command tries them again")
