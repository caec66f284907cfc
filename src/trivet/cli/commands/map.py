"""trivet map."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Choice, DataOutput, Hemisphere, Model


def run(
    *,
    choice: Choice,
    quantity: Annotated[
        str,
        typer.Option(
            "--quantity",
            help="What to map: stiffness; or, with the singular curves, sigma_min, 'det J_x', '1/det J_G^-1', '1/det J^-1', "
            "ITI, OTI, LTI.",
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
    model: Model,
    out: DataOutput,
) -> None:
    """Stiffness over the machine's workpiece hemisphere, with the best roll at every point; or singularities there."""
    from trivet.cli.views import singularity_map as singularities
    from trivet.cli.views import stiffness_map as stiffnesses
    from trivet.errors import InputError
    from trivet.statics.best_roll import ROLLS
    from trivet.study.singularity_map import singularity_map
    from trivet.study.stiffness_map import stiffness_map

    if roll is not None and quantity == "stiffness":
        raise InputError("--roll: the stiffness is mapped with its best roll; choose another --quantity")
    policy = _policy(roll, objective)
    if (objective or rolls) and quantity != "stiffness" and not str(policy).startswith("best"):
        raise InputError("--objective and --rolls choose the best roll; they do not go with another --roll")
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
        else:
            near = singularity_map(
                chosen, surface, quantity=quantity, roll=policy, mode=mode, rolls=rolls or ROLLS, progress=done
            )
    if quantity == "stiffness":
        out.give(stiff, stiffnesses)
    else:
        out.give(near, singularities)


def _policy(text: str | None, objective: str | None) -> str | float:
    """A policy for the roll as `singularity_map` takes it."""
    if text is None or text == "best":
        return f"best {objective or 'K_xx'}"
    if text == "-alpha" or text.startswith("best "):
        return text
    return o.quantity("--roll", text, "angle", "rad") or 0.0
