"""trivet map."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Choice, DataOutput, Hemisphere, Model

DYNAMIC = "dynamic-stiffness"
_OPTIONS = {"entries": "--entries", "point": "--point", "low": "--from", "high": "--to", "loss_factor": "--loss-factor"}


def run(
    *,
    choice: Choice,
    quantity: Annotated[
        str,
        typer.Option(
            "--quantity",
            help="What to map: stiffness; dynamic-stiffness; or, with the singular curves, sigma_min, 'det J_x', "
            "'1/det J_G^-1', '1/det J^-1', ITI, OTI, LTI.",
        ),
    ] = "stiffness",
    objective: Annotated[str | None, o.OBJECTIVE] = None,
    roll: Annotated[
        str | None,
        typer.Option("--roll", help="For other quantities than stiffness: an angle, -alpha, or best; best by default."),
    ] = None,
    mode: o.Mode = None,
    points: Hemisphere,
    rolls: Annotated[int | None, o.ROLLS] = None,
    entries: Annotated[
        str | None,
        typer.Option("--entries", help="Of dynamic-stiffness: motion, then load, such as xx, z_ry.  [default: xx,yy,zz]"),
    ] = None,
    point: Annotated[
        str | None,
        typer.Option("--point", help="Of dynamic-stiffness: platform or tool.  [default: platform]", metavar="platform|tool"),
    ] = None,
    low: Annotated[
        str | None, typer.Option("--from", help="Of dynamic-stiffness.  [default: 5 Hz]", metavar="FREQUENCY")
    ] = None,
    high: Annotated[
        str | None, typer.Option("--to", help="Of dynamic-stiffness.  [default: 3000 Hz]", metavar="FREQUENCY")
    ] = None,
    loss_factor: Annotated[
        float | None,
        typer.Option("--loss-factor", help="Of dynamic-stiffness: of all that has none of its own.  [default: 0.02]"),
    ] = None,
    model: Model,
    out: DataOutput,
) -> None:
    """Stiffness, dynamic stiffness or singularities over the workpiece hemisphere, with the best roll at every point."""
    from trivet.cli.views import atlas as dynamic
    from trivet.cli.views import singularity_map as singularities
    from trivet.cli.views import stiffness_map as stiffnesses
    from trivet.errors import InputError
    from trivet.statics.best_roll import ROLLS
    from trivet.study.atlas import atlas
    from trivet.study.singularity_map import singularity_map
    from trivet.study.stiffness_map import stiffness_map

    if roll is not None and quantity == "stiffness":
        raise InputError("--roll: the stiffness is mapped with its best roll; choose another --quantity")
    policy = _policy(roll, objective)
    if (objective or rolls) and quantity != "stiffness" and not str(policy).startswith("best"):
        raise InputError("--objective and --rolls choose the best roll; they do not go with another --roll")
    asked = {"entries": entries, "point": point, "low": low, "high": high, "loss_factor": loss_factor}
    vibrating = _vibrating(asked)
    if vibrating and quantity != DYNAMIC:
        raise InputError(f"{', '.join(_OPTIONS[name] for name in vibrating)}: only with --quantity {DYNAMIC}")
    chosen = choice.load(model)
    surface = points.over(chosen)
    out.check()
    with output.progress(out.as_json) as advance:
        advance(chosen.name, 0, len(surface))

        def done(count: int) -> None:
            advance(chosen.name, count, len(surface))

        if quantity == "stiffness":
            stiff = stiffness_map(
                chosen, surface, objective=objective or "K_xx", mode=mode, rolls=rolls or ROLLS, progress=done
            )
        elif quantity == DYNAMIC:
            found = atlas(
                chosen, points.family(chosen), roll=policy, mode=mode, rolls=rolls or ROLLS,
                progress=lambda count, total: advance(chosen.name, count, total), **vibrating,
            )  # fmt: skip
        else:
            near = singularity_map(
                chosen, surface, quantity=quantity, roll=policy, mode=mode, rolls=rolls or ROLLS, progress=done
            )
    if quantity == "stiffness":
        out.give(stiff, stiffnesses)
    elif quantity == DYNAMIC:
        out.give(found, dynamic)
    else:
        out.give(near, singularities)


def _vibrating(asked: dict[str, Any]) -> dict[str, Any]:
    """What is given of the options of a map of dynamic stiffness, as `atlas` takes it."""
    given = {name: value for name, value in asked.items() if value is not None}
    if "entries" in given:
        given["entries"] = tuple(name.strip() for name in given["entries"].split(","))
    for name in ("low", "high"):
        if name in given:
            given[name] = o.quantity(_OPTIONS[name], given[name], "frequency", "Hz", True)
    return given


def _policy(text: str | None, objective: str | None) -> str | float:
    """A policy for the roll as `singularity_map` takes it."""
    if text is None or text == "best":
        return f"best {objective or 'K_xx'}"
    if text == "-alpha" or text.startswith("best "):
        return text
    return o.quantity("--roll", text, "angle", "rad") or 0.0
