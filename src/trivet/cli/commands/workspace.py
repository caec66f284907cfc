"""trivet workspace."""

from __future__ import annotations

from typing import Annotated, cast

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.commands.tilt import NEUTRAL
from trivet.cli.groups import DataOutput

ORIENTATION = "orientation"


def run(
    *,
    machines: o.Machines = None,
    kind: Annotated[
        str,
        typer.Option(
            "--kind",
            help="With one orientation; with some, or with every direction of a cone; with every orientation whatever; or how "
            "the platform can lean at one place.",
            metavar="constant|reachable|total|dexterous|orientation",
        ),
    ] = "constant",
    azimuth: o.Azimuth = None,
    tilt: o.Tilt = None,
    roll: o.Roll = None,
    cone: Annotated[str, typer.Option("--cone", help="Half the opening of the cone of directions about z.")] = "30 deg",
    step: Annotated[str, typer.Option("--step", help="Between the directions.")] = "10 deg",
    position: o.Position = None,
    region: Annotated[
        str | None,
        typer.Option(
            "--region",
            help="Where to look, as in '-50 mm, -50 mm, 80 mm; 50 mm, 50 mm, 180 mm'; wherever its size lets it go by default.",
            metavar="X,Y,Z;X,Y,Z",
        ),
    ] = None,
    neutral: Annotated[
        str, typer.Option("--neutral", help="Neutral axis of the cones on the platform, as for trivet tilt.", metavar=NEUTRAL)
    ] = "as-described",
    bodies: Annotated[bool, typer.Option("--bodies/--no-bodies", help="Whether bodies must stay apart.")] = True,
    columns: Annotated[
        int | None,
        typer.Option("--columns", help="Columns along x and y, and samples in each; 60 of one orientation, else 24."),
    ] = None,
    mode: o.Mode = None,
    settings: o.Settings = None,
    out: DataOutput,
) -> None:
    """Where the platform centre of machines can go, and how large that is; or how the platform can lean at one place."""
    from trivet.errors import InputError
    from trivet.reach.neutral import Reference
    from trivet.study.comparison import PAPER_MACHINES
    from trivet.study.machines import choose, parse_settings
    from trivet.study.workspace import KINDS, Kind, orientation_workspace, workspaces
    from trivet.views import workspace as view

    if kind not in (*KINDS, ORIENTATION):
        raise InputError(f"--kind {kind}: expected one of {', '.join((*KINDS, ORIENTATION))}")
    changes = parse_settings(settings or [])
    chosen = [choose(name, changes) for name in machines or PAPER_MACHINES]
    place = o.triple("--position", position, "length", "m")
    if place is not None and kind != ORIENTATION:
        raise InputError(f"--position: says where the platform leans; it goes with --kind {ORIENTATION}")
    out.check()
    if kind == ORIENTATION:
        if len(chosen) > 1:
            raise InputError(f"--kind {ORIENTATION}: of one machine at a time")
        with output.busy("looking at directions", out.as_json):
            report = orientation_workspace(
                chosen[0], place, neutral=cast("Reference", neutral), mode=mode, bodies=bodies, count=columns or 60
            )
        out.give(report, view)
        return
    angles = {name: o.quantity(f"--{name}", text, "angle", "rad") for name, text in _named(azimuth, tilt, roll)}
    with output.progress(out.as_json, "slices") as advance:
        study = workspaces(
            chosen,
            cast("Kind", kind),
            **angles,
            cone=o.quantity("--cone", cone, "angle", "rad"),
            step=o.quantity("--step", step, "angle", "rad", True),
            neutral=neutral,
            mode=mode,
            bodies=bodies,
            count=columns,
            region=_region(region),
            progress=advance,
        )
    out.give(study, view)


def _named(azimuth: str | None, tilt: str | None, roll: str | None) -> tuple[tuple[str, str | None], ...]:
    return ("azimuth", azimuth), ("tilt", tilt), ("roll", roll)


def _region(text: str | None) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    from trivet.errors import InputError

    if text is None:
        return None
    parts = [o.triple("--region", part, "length", "m") for part in text.split(";")]
    if len(parts) != 2 or parts[0] is None or parts[1] is None:
        raise InputError(f'--region "{text}": expected two points, separated by a semicolon')
    return parts[0], parts[1]
