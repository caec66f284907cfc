"""trivet modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, Choice, DataOutput, Model

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.study.pathfile import PathFile


@dataclass(frozen=True)
class Way:
    """A path along which modes are followed."""

    to: Annotated[
        str | None,
        typer.Option("--to", help="Follow the modes to this platform centre, straight from the pose.", metavar="X,Y,Z"),
    ] = None
    to_azimuth: Annotated[str | None, typer.Option("--to-azimuth", help="Azimuth to go to; as at the pose by default.")] = None
    to_tilt: Annotated[str | None, typer.Option("--to-tilt", help="Tilt to go to.")] = None
    to_roll: Annotated[str | None, typer.Option("--to-roll", help="Roll to go to.")] = None
    along: Annotated[
        str | None, typer.Option("--path", help="Follow the modes through the poses of a path file.", metavar="FILE")
    ] = None
    steps: Annotated[
        int | None, typer.Option("--steps", help="Steps between poses that are told of, over the whole path; 24 by default.")
    ] = None

    @property
    def goal(self) -> At:
        """The pose to go to."""
        return At(self.to, self.to_azimuth, self.to_tilt, self.to_roll)

    @property
    def is_given(self) -> bool:
        """Whether there is a path."""
        return self.goal.is_given or self.along is not None

    def path(self, machine: Machine, at: At) -> PathFile:
        """The poses."""
        from trivet.errors import InputError
        from trivet.study.machines import pose_numbers
        from trivet.study.pathfile import PathFile, PathPose, read_path

        if self.along is not None:
            if at.is_given or self.goal.is_given:
                raise InputError(
                    "--path: says where the platform goes; no --position, --azimuth, --tilt, --roll, --to or --to-… with it"
                )
            return read_path(self.along)
        start, angles = pose_numbers(machine, *at.numbers())
        place, *turns = self.goal.numbers()
        end = pose_numbers(
            machine,
            start if place is None else place,
            *(own if turn is None else turn for own, turn in zip(angles, turns, strict=True)),
        )
        return PathFile([PathPose(start, *angles), PathPose(end[0], *end[1])])


def run(
    *,
    choice: Choice,
    at: At,
    way: Way,
    mode: o.Mode = None,
    model: Model,
    count: Annotated[int, typer.Option("--count", help="How many modes.", min=1, max=100)] = 12,
    elements: Annotated[
        int | None, typer.Option("--elements", help="Finite elements of every beam for the shapes; 8 by default.")
    ] = None,
    anyway: o.Anyway = False,
    out: DataOutput,
) -> None:
    """Natural frequencies at a pose, or followed along a path: how the platform moves in every mode, which parts yield."""
    chosen = choice.load(model)
    if way.is_given:
        _along(chosen, at, way, mode, count, elements, anyway, out)
        return
    from trivet.errors import InputError
    from trivet.study.mode_summary import MORE, aligned
    from trivet.study.modes import modes
    from trivet.views import modes as view

    if way.steps is not None:
        raise InputError("--steps: speaks of a path; give --to, --to-tilt, … or --path as well")
    out.check()
    with output.busy("finding modes", out.as_json):
        found = modes(chosen, *at.numbers(), mode=mode, anyway=anyway, count=count + MORE, elements=elements)
        result = aligned(found, count)
        _ = result.frequency  # worked out when it is first asked for
    out.give(result, view)


def _along(
    chosen: Machine, at: At, way: Way, mode: str | None, count: int, elements: int | None, anyway: bool, out: DataOutput
) -> None:
    from trivet.study.mode_paths import STEPS, modes_along
    from trivet.views import mode_paths as view

    path = way.path(chosen, at)
    out.check()
    with output.progress(out.as_json, "poses, twice each") as advance:
        found = modes_along(
            chosen,
            path,
            count=count,
            steps=STEPS if way.steps is None else way.steps,
            elements=elements,
            mode=mode,
            anyway=anyway,
            progress=lambda done, total: advance("following modes", done, total),
        )
    out.give(found, view)
