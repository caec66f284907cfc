"""trivet locks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import DataOutput, Model

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.study.lock_task import TaskLike

PATH_STEPS, HEMISPHERE_STEPS = 12, 4


def run(
    *,
    machine: o.Machine,
    settings: o.Settings = None,
    model: Model,
    path: Annotated[str | None, typer.Option("--path", help="For the poses along a path file.", metavar="FILE")] = None,
    hemisphere: Annotated[bool, typer.Option("--hemisphere", help="For the workpiece hemisphere.")] = False,
    steps: Annotated[
        int | None, typer.Option("--steps", help="Of the path (12), or from pole to rim of the hemisphere (4).")
    ] = None,
    radius: o.Radius = None,
    height: o.Height = None,
    position: o.Position = None,
    azimuth: o.Azimuth = None,
    tilt: o.Tilt = None,
    roll: Annotated[
        str | None, typer.Option("--roll", help="Of a pose; over the hemisphere an angle, -alpha, or best; best by default.")
    ] = None,
    objective: Annotated[
        str,
        typer.Option(
            "--objective", help="What is to be great: K_xx, 1/C_zz, …; D_xx (least dynamic stiffness); sigma_min; travel."
        ),
    ] = "K_xx",
    modes: Annotated[
        str, typer.Option("--modes", help="Working modes that are looked at: all, or the machine's own.", metavar="all|own")
    ] = "all",
    redundant: Annotated[
        bool, typer.Option("--redundant", help="Along --path: all drives at work, beside the best locks.")
    ] = False,
    rate: Annotated[
        float | None, typer.Option("--rate", help="With --redundant: travels of itself that a drive may cover along the path.")
    ] = None,
    low: Annotated[str, typer.Option("--from", help="Of a dynamic stiffness.", metavar="FREQUENCY")] = "5 Hz",
    high: Annotated[str, typer.Option("--to", help="Of a dynamic stiffness.", metavar="FREQUENCY")] = "3000 Hz",
    loss_factor: Annotated[
        float, typer.Option("--loss-factor", help="Of a dynamic stiffness: of all that has none of its own.")
    ] = 0.02,
    out: DataOutput,
) -> None:
    """Which drives of a redundant machine to lock, and where; without a task, which sets of them leave six freedoms."""
    from trivet.cli.views import locks as view
    from trivet.errors import InputError
    from trivet.study.lock_advice import advise_locks
    from trivet.study.locks import lock_sets
    from trivet.study.machines import choose, parse_settings
    from trivet.study.redundant import RATE, redundant_path

    chosen = model.of(choose(machine, parse_settings(settings or [])))
    pose = (position, azimuth, tilt, None if hemisphere else roll)
    _check(path, hemisphere, any(text is not None for text in pose), steps, radius or height, roll)
    if redundant and path is None:
        raise InputError("--redundant: all drives are chosen along a path; give --path")
    if rate is not None and not redundant:
        raise InputError("--rate: is of all drives at work; add --redundant")
    out.check()
    if path is None and not hemisphere and not any(text is not None for text in pose):
        if out.figure or out.data:
            raise InputError("--figure, --data: show advice for a task; give --path, --hemisphere or a pose")
        with output.busy("looking at locks", out.as_json):
            sets = lock_sets(chosen)
        out.say(sets, view)
        return
    asked: dict[str, Any] = {
        "modes": modes,
        "low": o.quantity("--from", low, "frequency", "Hz", True),
        "high": o.quantity("--to", high, "frequency", "Hz", True),
        "loss_factor": loss_factor,
    }
    task = _task(chosen, path, hemisphere, steps, (radius, height), pose)
    found: Any
    with output.progress(out.as_json, "") as advance:
        if redundant:
            found = redundant_path(
                chosen, cast(Any, task), objective, rate=RATE if rate is None else rate, progress=advance, **asked
            )
        else:
            asked["roll"] = _roll(roll) if hemisphere else None
            found = advise_locks(
                chosen, task, objective, progress=lambda done, total: advance("lock sets", done, total), **asked
            )
    out.give(found, view)


def _check(
    path: str | None, hemisphere: bool, has_pose: bool, steps: int | None, lengths: str | None, roll: str | None
) -> None:
    from trivet.errors import InputError

    if sum((path is not None, hemisphere, has_pose)) > 1:
        raise InputError("--path, --hemisphere, --position, --azimuth, --tilt, --roll: one task at a time")
    if path is not None and roll is not None:
        raise InputError("--roll: the path file has rolls of its own")
    if lengths is not None and not hemisphere:
        raise InputError("--radius, --height: of the hemisphere; add --hemisphere")
    if steps is not None and path is None and not hemisphere:
        raise InputError("--steps: of a path or a hemisphere; add --path or --hemisphere")


def _task(
    chosen: Machine,
    path: str | None,
    hemisphere: bool,
    steps: int | None,
    lengths: tuple[str | None, str | None],
    pose: tuple[str | None, ...],
) -> TaskLike:
    from trivet.study.families import along_path, hemisphere_of
    from trivet.study.machines import pose_numbers

    if path is not None:
        return along_path(chosen, path, PATH_STEPS if steps is None else steps)
    if hemisphere:
        size, level = (
            o.quantity(name, text, "length", "m") for name, text in zip(("--radius", "--height"), lengths, strict=True)
        )
        return hemisphere_of(chosen, HEMISPHERE_STEPS if steps is None else steps, size, level)
    angles = (
        o.quantity(name, text, "angle", "rad") for name, text in zip(("--azimuth", "--tilt", "--roll"), pose[1:], strict=True)
    )
    place, turns = pose_numbers(chosen, o.triple("--position", pose[0], "length", "m"), *angles)
    return [(*place, *turns)]


def _roll(text: str | None) -> str | float | None:
    return text if text in (None, "best", "-alpha") else o.quantity("--roll", text, "angle", "rad")
