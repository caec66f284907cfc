"""trivet lobes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, DataOutput, Model

if TYPE_CHECKING:
    from trivet.chatter.cut import Cut, Side


def run(
    *,
    choice: Choice,
    at: At,
    along: Annotated[str | None, typer.Option("--path", help="Instead: at the poses of a path file.", metavar="FILE")] = None,
    mode: o.Mode = None,
    model: Model,
    diameter: Annotated[str, typer.Option("--diameter", help="Of the cutter, as in '16 mm'.")],
    teeth: Annotated[int, typer.Option("--teeth", help="Of the cutter.")],
    radial: Annotated[
        str | None, typer.Option("--radial-depth", help="Width of the cut; the diameter, which makes a slot, by default.")
    ] = None,
    side: Annotated[
        str | None,
        typer.Option("--side", help="Whether teeth enter (up) or leave (down) where the chip is thin.", metavar="up|down"),
    ] = None,
    entry: Annotated[
        str | None, typer.Option("--entry", help="Instead: angle at which a tooth enters, from the normal of the feed.")
    ] = None,
    leave: Annotated[str | None, typer.Option("--exit", help="Angle at which it leaves, with --entry.")] = None,
    material: Annotated[
        str | None, typer.Option("--material", help="Of the workpiece, for published cutting forces: aluminium-7075-t6, …")
    ] = None,
    tangential: Annotated[
        str | None, typer.Option("--tangential", help="Instead: tangential specific force K_t, as in '600 N/mm^2'.")
    ] = None,
    ratio: Annotated[
        float | None, typer.Option("--radial-ratio", help="Radial over tangential force K_r, with --tangential.")
    ] = None,
    feed: Annotated[
        str, typer.Option("--feed", help="Way of the tool, about the platform normal from the direction of growing tilt.")
    ] = "0 deg",
    slowest: Annotated[str, typer.Option("--from", help="Lowest spindle speed.", metavar="SPEED")] = "2000 rpm",
    fastest: Annotated[str, typer.Option("--to", help="Highest spindle speed.", metavar="SPEED")] = "20000 rpm",
    points: Annotated[int, typer.Option("--points", help="Equally spaced spindle speeds.")] = 400,
    highest: Annotated[
        str, typer.Option("--highest", help="Highest chatter frequency that is sought.", metavar="FREQUENCY")
    ] = "3000 Hz",
    loss_factor: Annotated[
        float, typer.Option("--loss-factor", help="Of all that has none of its own; twice the damping ratio.")
    ] = 0.02,
    check: Annotated[
        int | None, typer.Option("--check", help="Work out the depth at so many speeds by semi-discretisation as well.")
    ] = None,
    anyway: o.Anyway = False,
    out: DataOutput,
) -> None:
    """How deep a machine mills without chatter: stability lobes over spindle speed, at a pose or along a path."""
    from trivet.errors import InputError
    from trivet.study.lobes import lobes, lobes_along
    from trivet.study.pathfile import read_path
    from trivet.views import lobes as view

    chosen = choice.load(model)
    speeds = [o.quantity(name, text, "spindle speed", "rad/s", True) for name, text in (("--from", slowest), ("--to", fastest))]
    settings: dict[str, Any] = {
        "cut": _cut(diameter, teeth, radial, side, entry, leave, material, tangential, ratio),
        "feed": o.quantity("--feed", feed, "angle", "rad"),
        "slowest": speeds[0],
        "fastest": speeds[1],
        "points": points,
        "highest": o.quantity("--highest", highest, "frequency", "Hz", True),
        "loss_factor": loss_factor,
        "mode": mode,
        "anyway": anyway,
    }
    if along is not None and (at.is_given or check is not None):
        raise InputError("--path: has poses of its own; no --position, --azimuth, --tilt, --roll or --check with it")
    if check is not None and not 1 <= check <= points:
        raise InputError(f"--check: {check}; expected 1 to {points} speeds, those of --points")
    out.check()
    if along is not None:
        with output.progress(out.as_json, "poses") as advance:
            whole = lobes_along(chosen, read_path(along), progress=advance, **settings)
        out.give(whole, view)
        return
    with output.busy("working out lobes", out.as_json):
        found = lobes(chosen, *at.numbers(), **settings)
    with output.progress(out.as_json, "speeds") as advance:
        checked = None if check is None else found.check(check, advance)
    out.give(found, view, checked)


def _cut(
    diameter: str,
    teeth: int,
    radial: str | None,
    side: str | None,
    entry: str | None,
    leave: str | None,
    material: str | None,
    tangential: str | None,
    ratio: float | None,
) -> Cut:
    from trivet.chatter.cut import Cut
    from trivet.errors import InputError

    size = cast(float, o.quantity("--diameter", diameter, "length", "m", True))
    depth = o.quantity("--radial-depth", radial, "length", "m", True)
    force = o.quantity("--tangential", tangential, "specific force", "Pa", True)
    angles = [o.quantity(name, text, "angle", "rad") for name, text in (("--entry", entry), ("--exit", leave))]
    forces: dict[str, Any] = {"material": material, "tangential": force, "radial_ratio": ratio}
    if angles == [None, None]:
        if side is None and depth is not None and depth < size:
            raise InputError("--side: is needed for a cut that is no slot; write --side up, or --side down")
        return Cut.of(size, teeth, size if depth is None else depth, cast("Side", side or "up"), **forces)
    if None in angles or depth is not None or side is not None:
        raise InputError("--entry and --exit: go together, and instead of --radial-depth and --side")
    slot = Cut.of(size, teeth, size, **forces)
    return Cut(size, teeth, cast(float, angles[0]), cast(float, angles[1]), slot.tangential, slot.radial_ratio)
