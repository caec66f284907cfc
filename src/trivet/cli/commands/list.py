"""trivet list."""

from __future__ import annotations

from trivet.cli import options as o
from trivet.cli import output


def run(as_json: o.Json = False) -> None:
    """List the machines of the catalogue."""
    from trivet.model import catalogue, load
    from trivet.views.machine import card, catalogue_table

    machines = [load(name) for name in catalogue()]
    if as_json:
        output.print_json([card(m) for m in machines])
    else:
        output.print_parts(catalogue_table(machines))
