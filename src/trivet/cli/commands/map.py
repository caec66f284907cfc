"""trivet map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Choice, DataOutput, FrequencyRange, Hemisphere, Model, given

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.space.family import Family

DYNAMIC = "dynamic-stiffness"


@dataclass(frozen=True)
class Vibrating:
    """What concerns dynamic stiffness only."""

    entries: Annotated[
        str | None,
        typer.Option(
            "--entries",
            help="Of dynamic-stiffness: motion, then load, such as xx, z_ry.  [default: xx,yy,zz]",
        ),
    ] = None
    point: Annotated[
        str | None,
        typer.Option("--point", help="Of dynamic-stiffness: platform or tool.  [default: platform]", metavar="platform|tool"),
    ] = None
    path: Annotated[
        str | None,
        typer.Option("--path", help="Of dynamic-stiffness: along a path file instead, in --steps steps.", metavar="FILE"),
    ] = None
    block: Annotated[
        str | None,
        typer.Option(
            "--block",
            help="Of dynamic-stiffness: in a block of this size instead, --steps from side to side; 0 mm for none.",
            metavar="X,Y,Z",
        ),
    ] = None
    centre: Annotated[str | None, typer.Option("--centre", help="Of the block; home by default.", metavar="X,Y,Z")] = None
    azimuth: Annotated[str | None, typer.Option("--azimuth", help="Of the platform normal in a block; 0 by default.")] = None
    tilt: Annotated[str | None, typer.Option("--tilt", help="Of the platform normal in a block; 0 by default.")] = None
    no_worst: Annotated[
        bool, typer.Option("--no-worst", help="Of dynamic-stiffness: do not seek the worst poses between the points.")
    ] = False
    responses: Annotated[
        bool, typer.Option("--responses", help="Of dynamic-stiffness: write the responses of every pose into --data as well.")
    ] = False

    def asked(self) -> dict[str, Any]:
        """What is given of the entries, the point and the search, as `study.atlas` takes it."""
        entries = None if self.entries is None else tuple(name.strip() for name in self.entries.split(","))
        asked = {"entries": entries, "point": self.point, "search": False if self.no_worst else None}
        return {name: value for name, value in asked.items() if value is not None}

    def family(self, machine: Machine, points: Hemisphere) -> Family:
        """Over which poses."""
        from trivet.errors import InputError
        from trivet.space.family import in_block
        from trivet.study.families import along_path

        if self.path is not None and self.block is not None:
            raise InputError("--path, --block: one or the other")
        if (self.path is not None or self.block is not None) and any(length is not None for length in points.lengths()):
            raise InputError("--radius, --height: of the hemisphere; not with --path or --block")
        if self.block is None and (self.centre, self.azimuth, self.tilt) != (None, None, None):
            raise InputError("--centre, --azimuth, --tilt: of a block; give --block as well")
        if self.path is not None:
            return along_path(machine, self.path, points.steps)
        size = o.triple("--block", self.block, "length", "m")
        if size is None:
            return points.family(machine)
        centre = o.triple("--centre", self.centre, "length", "m") or machine.home.position
        angles = (o.quantity(name, text, "angle", "rad") for name, text in (("--azimuth", self.azimuth), ("--tilt", self.tilt)))
        azimuth, tilt = (angle or 0.0 for angle in angles)
        return in_block(centre, size, (points.steps,) * 3, azimuth, tilt)


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
    objective: Annotated[
        str | None,
        typer.Option(
            "--objective", help="What the roll maximises: K_xx, 1/C_zz, K_rx, 'K(1,0,1)', …; of dynamic-stiffness also D_xx, …"
        ),
    ] = None,
    roll: Annotated[
        str | None,
        typer.Option("--roll", help="For other quantities than stiffness: an angle, -alpha, or best; best by default."),
    ] = None,
    mode: o.Mode = None,
    points: Hemisphere,
    rolls: Annotated[int | None, o.ROLLS] = None,
    vibrating: Vibrating,
    over: FrequencyRange,
    model: Model,
    out: DataOutput,
) -> None:
    """Stiffness, dynamic stiffness or singularities over the workpiece hemisphere, with the best roll at every point."""
    from trivet.errors import InputError, nearest
    from trivet.statics.best_roll import ROLLS
    from trivet.study.singularity_map import QUANTITIES, singularity_map
    from trivet.study.stiffness_map import stiffness_map
    from trivet.views import singularity_map as singularities
    from trivet.views import stiffness_map as stiffnesses

    known = ("stiffness", DYNAMIC, *QUANTITIES)
    if quantity not in known:
        raise InputError(f'--quantity "{quantity}": is not known{nearest(quantity, known)}')
    if roll is not None and quantity == "stiffness":
        raise InputError("--roll: the stiffness is mapped with its best roll; choose another --quantity")
    if objective is not None and objective.startswith("D_") and quantity != DYNAMIC:
        raise InputError(f'--objective "{objective}": is of dynamic stiffness; add --quantity {DYNAMIC}')
    if objective is not None and roll not in (None, "best"):
        raise InputError(f'--objective: says what the best roll maximises; it does not go with --roll "{roll}"')
    policy = _policy(roll, objective)
    if (objective or rolls) and quantity != "stiffness" and not str(policy).startswith("best"):
        raise InputError("--objective and --rolls choose the best roll; they do not go with another --roll")
    if (idle := given(vibrating) + given(over)) and quantity != DYNAMIC:
        raise InputError(f"{', '.join(idle)}: only with --quantity {DYNAMIC}")
    chosen = choice.load(model)
    if quantity == DYNAMIC:
        is_given = roll is not None or objective is not None
        if vibrating.path is not None and (is_given or rolls is not None):
            raise InputError("--roll, --objective, --rolls: the path file has rolls of its own; leave them out with --path")
        if vibrating.entries is None and objective is not None and objective.startswith("D_"):
            vibrating = replace(vibrating, entries=objective.removeprefix("D_"))
        _dynamic(chosen, vibrating, over, points, policy if is_given else None, mode, rolls, out)
        return
    surface, first = points.over(chosen), ROLLS if rolls is None else rolls
    out.check()
    with output.progress(out.as_json) as advance:
        advance(chosen.name, 0, len(surface))

        def done(count: int) -> None:
            advance(chosen.name, count, len(surface))

        if quantity == "stiffness":
            stiff = stiffness_map(chosen, surface, objective=objective or "K_xx", mode=mode, rolls=first, progress=done)
        else:
            near = singularity_map(chosen, surface, quantity=quantity, roll=policy, mode=mode, rolls=first, progress=done)
    if quantity == "stiffness":
        out.give(stiff, stiffnesses)
    else:
        out.give(near, singularities)


def _dynamic(
    chosen: Machine,
    vibrating: Vibrating,
    over: FrequencyRange,
    points: Hemisphere,
    policy: str | float | None,
    mode: str | None,
    rolls: int | None,
    out: DataOutput,
) -> None:
    from trivet.errors import InputError
    from trivet.files import check_room
    from trivet.study.atlas import DEFAULT, POINTS, atlas
    from trivet.study.atlas_datasets import save_responses, size_of_responses
    from trivet.views import atlas as view

    if vibrating.responses and out.data is None:
        raise InputError("--responses: are written into --data; give it a file")
    family, asked = vibrating.family(chosen, points), vibrating.asked() | over.numbers()
    out.check()
    if vibrating.responses and out.data is not None:
        check_room(out.data, size_of_responses(len(family), len(asked.get("entries", DEFAULT)), POINTS))
    with output.progress(out.as_json, "") as advance:
        found = atlas(chosen, family, roll=policy, mode=mode, rolls=rolls, progress=advance, **asked)
    if not vibrating.responses:
        out.give(found, view)
        return
    assert out.data is not None
    with output.progress(out.as_json, "poses") as advance:
        save_responses(found, out.data, overwrite=out.overwrite, progress=lambda done, total: advance("responses", done, total))
    output.wrote(out.data)
    out.without_data().give(found, view)


def _policy(text: str | None, objective: str | None) -> str | float:
    """A policy for the roll as `singularity_map` and `atlas` take it."""
    if text is None or text == "best":
        return f"best {objective or 'K_xx'}"
    if text == "-alpha" or text.startswith("best "):
        return text
    return o.quantity("--roll", text, "angle", "rad") or 0.0
