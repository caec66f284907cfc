"""trivet simulate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, cast

import typer

from trivet.cli import options as o
from trivet.cli import output as to
from trivet.cli.groups import Acting, At, Choice, DataOutput, Speeds

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.study.simulation import Law


def run(
    *,
    choice: Choice,
    at: At,
    mode: o.Mode = None,
    speeds: Speeds,
    acting: Acting,
    duration: Annotated[str, typer.Option("--duration", help="How long.")] = "0.1 s",
    drives: Annotated[
        str,
        typer.Option(
            "--drives",
            help="Springs of their stiffness about what holds its weight at the start; hold, that alone; or free.",
            metavar="springs|hold|free",
        ),
    ] = "springs",
    push: Annotated[
        list[str] | None,
        typer.Option(
            "--push",
            help="A constant force of a drive besides, as in leg-1.slide='10 N'. May be repeated.",
            metavar="DRIVE=FORCE",
        ),
    ] = None,
    samples: Annotated[int, typer.Option("--samples", help="Times at which it is recorded.")] = 1000,
    step: Annotated[
        str | None, typer.Option("--step", help="Longest step; a tenth of a radian of the fastest vibration by default.")
    ] = None,
    anyway: o.Anyway = False,
    out: DataOutput,
) -> None:
    """Let a machine go: how it moves under its weight, a load, and drives that are springs or push with constant forces."""
    from trivet.study.simulation import simulate
    from trivet.views import simulation as view

    chosen = choice.load()
    length = o.quantity("--duration", duration, "time", "s", True)
    assert length is not None
    longest = o.quantity("--step", step, "time", "s", True)
    forces = dict(_force(chosen, text) for text in push or [])
    (velocity, angular_velocity), loading = speeds.numbers(), acting.loading()
    out.check()
    with to.progress(out.as_json, "samples") as advance:
        result = simulate(
            chosen,
            length,
            *at.numbers(),
            velocity=velocity,
            angular_velocity=angular_velocity,
            law=cast("Law", drives),
            forces=forces,
            loading=loading,
            mode=mode,
            samples=samples,
            step=longest,
            anyway=anyway,
            progress=lambda done, total: advance("simulating", done, total),
        )
    out.give(result, view)


def _force(machine: Machine, pushed: str) -> tuple[str, float]:
    from trivet.errors import InputError, nearest
    from trivet.kinematics.jacobian import actuators

    name, sign, text = (part.strip() for part in pushed.partition("="))
    drives = dict(actuators(machine))
    if not sign or not text:
        raise InputError(f"--push \"{pushed}\": expected DRIVE=FORCE, as in {next(iter(drives))}='10 N'")
    if name not in drives:
        raise InputError(f"--push {name}: {machine.name} has no such drive{nearest(name, drives)}")
    unit = drives[name].force_unit
    found = o.quantity(f"--push {name}", text, "force" if unit == "N" else "torque", unit)
    assert found is not None
    return name, found
