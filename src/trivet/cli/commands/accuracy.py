"""trivet accuracy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, DataOutput, Hemisphere

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.space.family import Family

HEMISPHERE_STEPS = 10


@dataclass(frozen=True)
class Where(At):
    """At which poses: one, those along a path, or the check points."""

    roll: Annotated[
        str | None,
        typer.Option(
            "--roll",
            help="Of a pose an angle; over the hemisphere an angle, -alpha, or the best for a stiffness, as in 'best K_zz'; "
            "'best K_xx' by default.",
        ),
    ] = None
    rolls: Annotated[int | None, typer.Option("--rolls", help="Rolls of the first grid of a best roll.  [default: 360]")] = None
    path: Annotated[str | None, typer.Option("--path", help="At the poses along a path file.", metavar="FILE")] = None
    steps: Annotated[
        int | None,
        typer.Option(
            "--steps", help="From pole to rim of the hemisphere (10 gives the paper's 317 points), or of a path (24)."
        ),
    ] = None
    radius: o.Radius = None
    height: o.Height = None

    @property
    def is_pose(self) -> bool:
        """Whether it is one pose; a roll alone is that of the check points."""
        return At(self.position, self.azimuth, self.tilt).is_given

    def check(self) -> None:
        """Refuse options that do not go together."""
        from trivet.errors import InputError

        if self.is_pose and self.path is not None:
            raise InputError("--path: goes without --position, --azimuth, --tilt, which are of one pose")
        is_sphere = not self.is_pose and self.path is None
        if (self.radius is not None or self.height is not None) and not is_sphere:
            raise InputError("--radius, --height: of the hemisphere; they go without --path and without a pose")
        if self.steps is not None and self.is_pose:
            raise InputError("--steps: of the hemisphere or of a path; it goes without a pose")
        if self.path is not None and (self.roll is not None or self.rolls is not None):
            raise InputError("--roll, --rolls: the path file has rolls of its own; leave them out with --path")
        if self.rolls is not None and not (is_sphere and (self.roll is None or _is_best(self.roll))):
            raise InputError("--rolls: of the search for the best roll over the hemisphere; there is none here")

    def poses(self, machine: Machine) -> Family | tuple[float, ...]:
        """The poses, as the study takes them."""
        from trivet.study.families import STEPS, along_path
        from trivet.study.machines import pose_numbers

        if self.is_pose:
            place, angles = pose_numbers(machine, *self.numbers())
            return (*place, *angles)
        if self.path is not None:
            return along_path(machine, self.path, STEPS if self.steps is None else self.steps)
        steps = HEMISPHERE_STEPS if self.steps is None else self.steps
        return Hemisphere(steps, self.radius, self.height).family(machine)

    @property
    def roll_policy(self) -> str | float | None:
        """How rolls are chosen over the hemisphere; None elsewhere."""
        if self.is_pose or self.roll is None:
            return None
        return self.roll if self.roll == "-alpha" or _is_best(self.roll) else o.quantity("--roll", self.roll, "angle", "rad")


def _is_best(roll: str) -> bool:
    return roll.partition(" ")[0] == "best"


def run(
    *,
    choice: Choice,
    tolerances: Annotated[
        str,
        typer.Argument(
            help="What is inexact: tolerances, misalignments, drives, play, warm bodies.", metavar="TOLERANCES.toml"
        ),
    ],
    where: Where,
    mode: o.Mode = None,
    point: Annotated[
        str,
        typer.Option(
            "--point", help="Of what errors are told: platform (its centre), tool (its tip).", metavar="platform|tool"
        ),
    ] = "platform",
    out: DataOutput,
) -> None:
    """How far the platform is from where it is commanded, and why: over the workpiece hemisphere, a path, or at one pose."""
    from trivet.study.accuracy import accuracy
    from trivet.views import accuracy as view

    where.check()
    chosen = choice.load()
    poses, policy = where.poses(chosen), where.roll_policy
    out.check()
    with output.progress(out.as_json) as advance:
        found = accuracy(chosen, tolerances, poses, point=point, roll=policy, mode=mode, rolls=where.rolls, progress=advance)
    out.give(found, view)
