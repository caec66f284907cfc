"""trivet tilt."""

from __future__ import annotations

from typing import Annotated, Any, cast

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import DataOutput

NEUTRAL = "as-described|home|normal|radial|elevation"


def run(
    *,
    machines: o.Machines = None,
    radius: Annotated[
        list[str] | None, typer.Option("--radius", help="Radius of the sphere; the workpiece's by default. May be repeated.")
    ] = None,
    height: Annotated[
        list[str] | None,
        typer.Option("--height", help="Height of its centre above {O}; the workpiece's by default. May be repeated."),
    ] = None,
    neutral: Annotated[
        list[str] | None,
        typer.Option(
            "--neutral",
            help="Neutral axis of the cones on the platform: as the file says, or the stem at home, the platform normal, "
            "outwards in its plane, or elevation from that plane. May be repeated.",
            metavar=NEUTRAL,
        ),
    ] = None,
    bodies: Annotated[bool, typer.Option("--bodies/--no-bodies", help="Whether bodies must stay apart.")] = True,
    solid: Annotated[
        bool, typer.Option("--solid", help="Whether bodies must stay clear of the sphere as well: a workpiece, not a place.")
    ] = False,
    azimuths: Annotated[int, typer.Option("--azimuths", help="Directions of tilt, evenly all round.")] = 36,
    step: Annotated[str, typer.Option("--step", help="Step of the tilt.")] = "1 deg",
    most: Annotated[str, typer.Option("--most", help="Greatest tilt looked at.")] = "180 deg",
    rolls: Annotated[int, typer.Option("--rolls", help="Rolls, evenly all round.")] = 180,
    mode: o.Mode = None,
    settings: o.Settings = None,
    out: DataOutput,
) -> None:
    """How far machines can tilt while they touch a sphere, with the best roll; pose by pose, and connected to home."""
    from trivet.reach.neutral import Reference
    from trivet.study.comparison import PAPER_MACHINES
    from trivet.study.machines import choose, parse_settings
    from trivet.study.tilt import tilts
    from trivet.views import tilt as view

    changes = parse_settings(settings or [])
    chosen = [choose(name, changes) for name in machines or PAPER_MACHINES]
    out.check()
    with output.progress(out.as_json, "azimuths") as advance:
        study = tilts(
            chosen,
            _lengths("--radius", radius),
            _lengths("--height", height),
            cast("list[Reference]", neutral or ["as-described"]),
            mode=mode,
            bodies=bodies,
            solid=solid,
            azimuths=azimuths,
            step=o.quantity("--step", step, "angle", "rad", True),
            most=o.quantity("--most", most, "angle", "rad", True),
            rolls=rolls,
            progress=advance,
        )
    out.give(study, view)


def _lengths(option: str, given: list[str] | None) -> list[Any]:
    return [o.quantity(option, text, "length", "m") for text in given] if given else [None]
