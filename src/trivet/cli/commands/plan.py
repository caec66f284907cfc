"""trivet plan."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.commands.tilt import NEUTRAL
from trivet.cli.groups import DataOutput

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.study.cone import ConePlan
    from trivet.study.plan import Plan, PlanStudy


def run(
    *,
    machines: Annotated[
        list[str], typer.Argument(help="Names in the catalogue or .toml files, or either with settings.", metavar="MACHINE...")
    ],
    to: Annotated[str, typer.Option("--to", help="The tilt to get to, from zero.")] = "90 deg",
    azimuth: Annotated[str, typer.Option("--azimuth", help="Its direction.")] = "0 deg",
    within: Annotated[
        str | None,
        typer.Option("--cone", help="Instead: one roll for every direction up to this tilt, continuous all over the cone."),
    ] = None,
    radius: Annotated[
        str | None, typer.Option("--radius", help="Radius of the sphere that the platform touches; the workpiece's by default.")
    ] = None,
    height: Annotated[
        list[str] | None,
        typer.Option("--height", help="Height of its centre above {O}; the workpiece's by default. May be repeated."),
    ] = None,
    along: Annotated[
        str | None,
        typer.Option("--path", help="Instead: through the poses of a path file, their rolls left free.", metavar="FILE"),
    ] = None,
    modes: Annotated[
        list[str] | None,
        typer.Option("--mode", help="Working mode, as in '++ +- ++', or all; the machine's own by default. May be repeated."),
    ] = None,
    start_roll: Annotated[
        str | None, typer.Option("--roll", help="azimuth + roll at zero tilt; any roll that serves by default.")
    ] = None,
    objectives: Annotated[
        list[str] | None,
        typer.Option(
            "--objective",
            help="What is to be great at the worst place: sigma_min, K_xx, 1/C_zz, …; of several the least over what counts as "
            "one, as in sigma_min=0.1 with K_xx='5 N/um'. May be repeated.",
            metavar="NAME[=ONE]",
        ),
    ] = None,
    neutral: Annotated[
        str, typer.Option("--neutral", help="Neutral axis of the cones on the platform, as in trivet tilt.", metavar=NEUTRAL)
    ] = "as-described",
    limits: Annotated[bool, typer.Option("--limits/--no-limits", help="Whether joints must stay inside their travel.")] = True,
    bodies: Annotated[bool, typer.Option("--bodies/--no-bodies", help="Whether bodies must stay apart.")] = True,
    solid: Annotated[bool, typer.Option("--solid", help="Whether bodies must stay clear of the sphere as well.")] = False,
    step: Annotated[
        str | None, typer.Option("--step", help="Step of the tilt on the first grid; 1 deg, or 2 deg of a cone, by default.")
    ] = None,
    rolls: Annotated[
        int | None,
        typer.Option("--rolls", help="Rolls of the first grid, evenly all round; 180, or 120 of a cone, by default."),
    ] = None,
    proof: Annotated[bool, typer.Option("--proof/--no-proof", help="Whether to prove that the way is free.")] = True,
    sigma: Annotated[
        float | None,
        typer.Option("--sigma", help="sigma_min that is to be proven; four fifths of the least on the way by default."),
    ] = None,
    advise: Annotated[
        bool,
        typer.Option(
            "--advise", help="Where travel, bodies or --sigma stop the one way asked for: which smallest change lets it pass."
        ),
    ] = False,
    settings: o.Settings = None,
    out: DataOutput,
) -> None:
    """How a machine gets to a tilt: without a singularity, the end of a joint's travel or a collision; proven between poses."""
    from trivet.errors import InputError
    from trivet.study.cone import cone
    from trivet.study.machines import choose, parse_settings
    from trivet.study.pathfile import read_path
    from trivet.study.plan import plans
    from trivet.views import cone as cone_view

    changes = parse_settings(settings or [])
    chosen = [choose(name, changes) for name in machines]
    if len(modes or []) > 1 and "all" in (modes or []):
        raise InputError("--mode: all is all of them; no other mode with it")
    out.check()
    start = o.quantity("--roll", start_roll, "angle", "rad")
    common: dict[str, Any] = {
        "radius": o.quantity("--radius", radius, "length", "m"),
        "neutral": neutral,
        "aims": objectives or ["sigma_min"],
        "limits": limits,
        "bodies": bodies,
        "solid": solid,
        "proof": proof,
        "sigma": sigma,
    }
    if step is not None:
        common["step"] = o.quantity("--step", step, "angle", "rad", True)
    if rolls is not None:
        common["rolls"] = rolls
    if within is not None:
        if len(chosen) > 1 or len(height or []) > 1 or len(modes or []) > 1 or start_roll is not None:
            raise InputError("--cone: takes one machine, height and mode at a time, and no --roll")
        if modes == ["all"]:
            raise InputError("--cone: takes one mode, not all of them; name it, as in --mode '++ ++ -+'")
        if advise or along is not None or (to, azimuth) != ("90 deg", "0 deg"):
            raise InputError("--cone: takes all directions; no --to, --azimuth, --path or --advise with it")
        with output.progress(out.as_json, "") as advance:
            found = cone(
                chosen[0],
                o.quantity("--cone", within, "angle", "rad", True),  # type: ignore[arg-type]
                height=o.quantity("--height", height[0], "length", "m") if height else None,
                mode=modes[0] if modes else None,
                progress=advance,
                **common,
            )
        out.give(found, cone_view)
        _leave(found)
        return
    if advise and (len(chosen) > 1 or len(height or []) > 1 or len(modes or []) > 1 or modes == ["all"]):
        raise InputError("--advise: of one machine, height and mode at a time")
    if along is not None:
        if solid or radius is not None or height or (to, azimuth) != ("90 deg", "0 deg"):
            raise InputError("--path: says where the platform goes; no --to, --azimuth, --radius, --height or --solid with it")
        del common["radius"], common["solid"]
        with output.progress(out.as_json, "plans") as advance:
            study = plans(
                chosen, modes=cast("list[str | None]", modes or [None]), path=read_path(along), start_roll=start,
                progress=advance, **common,
            )  # fmt: skip
        _give(study, chosen[0] if advise else None, out)
        return
    heights: list[Any] = [o.quantity("--height", text, "length", "m") for text in height] if height else [None]
    with output.progress(out.as_json, "plans") as advance:
        study = plans(
            chosen,
            heights,
            cast("list[str | None]", modes or [None]),
            to=o.quantity("--to", to, "angle", "rad", True),
            azimuth=o.quantity("--azimuth", azimuth, "angle", "rad"),
            start_roll=start,
            progress=advance,
            **common,
        )
    _give(study, chosen[0] if advise else None, out)


def _give(study: PlanStudy, advised: Machine | None, out: DataOutput) -> None:
    from trivet.study.advice import advice
    from trivet.views import plan as view

    out.give(study, view, None if advised is None else advice(study.plans[0], advised))
    _leave(*study.plans)


def _leave(*plans: Plan | ConePlan) -> None:
    """No result where there is no way at all, but such as are known not to be free."""
    if all(not plan.is_possible or plan.is_refuted for plan in plans):
        raise typer.Exit(1)
