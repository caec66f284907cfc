"""trivet locks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, cast

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import At, DataOutput, FrequencyRange, Hemisphere, Model, given

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.space.family import Family
    from trivet.study.lock_advice import LocksAdvised, Modes
    from trivet.study.lock_measures import Goal
    from trivet.study.redundant import RedundantPath

PATH_STEPS, HEMISPHERE_STEPS = 12, 4


@dataclass(frozen=True)
class Task(At):
    """For which poses."""

    roll: Annotated[
        str | None, typer.Option("--roll", help="Of a pose; over the hemisphere an angle, -alpha, or best; best by default.")
    ] = None
    path: Annotated[str | None, typer.Option("--path", help="For the poses along a path file.", metavar="FILE")] = None
    hemisphere: Annotated[bool, typer.Option("--hemisphere", help="For the workpiece hemisphere.")] = False
    steps: Annotated[
        int | None, typer.Option("--steps", help="Of the path (12), or from pole to rim of the hemisphere (4).")
    ] = None
    radius: o.Radius = None
    height: o.Height = None

    @property
    def is_given(self) -> bool:
        """Whether there is one; without, lock sets are told."""
        return self.path is not None or self.hemisphere or super().is_given

    def check(self) -> None:
        """Refuse options that do not go together."""
        from trivet.errors import InputError

        has_pose = At(self.position, self.azimuth, self.tilt, None if self.hemisphere else self.roll).is_given
        if sum((self.path is not None, self.hemisphere, has_pose)) > 1:
            raise InputError("--path, --hemisphere, --position, --azimuth, --tilt, --roll: one task at a time")
        if (self.radius is not None or self.height is not None) and not self.hemisphere:
            raise InputError("--radius, --height: of the hemisphere; add --hemisphere")
        if self.steps is not None and self.path is None and not self.hemisphere:
            raise InputError("--steps: of a path or a hemisphere; add --path or --hemisphere")

    def family(self, machine: Machine) -> Family | None:
        """The path or the hemisphere; None for a pose."""
        from trivet.study.families import along_path

        if self.path is not None:
            return along_path(machine, self.path, PATH_STEPS if self.steps is None else self.steps)
        steps = HEMISPHERE_STEPS if self.steps is None else self.steps
        return Hemisphere(steps, self.radius, self.height).family(machine) if self.hemisphere else None

    def pose(self, machine: Machine) -> list[tuple[float, ...]]:
        """The pose, as the studies take it."""
        from trivet.study.machines import pose_numbers

        place, angles = pose_numbers(machine, *self.numbers())
        return [(*place, *angles)]

    @property
    def roll_policy(self) -> str | float | None:
        """How rolls are chosen over the hemisphere; None elsewhere."""
        if not self.hemisphere:
            return None
        return self.roll if self.roll in (None, "best", "-alpha") else o.quantity("--roll", self.roll, "angle", "rad")


@dataclass(frozen=True)
class Wish:
    """What is to be great, and in which way."""

    objective: Annotated[
        str | None,
        typer.Option(
            "--objective",
            help="What is to be great: K_xx, 1/C_zz, …; D_xx (least dynamic stiffness); sigma_min; 1/rate; travel.  "
            "[default: 1/C_xx]",
        ),
    ] = None
    modes: Annotated[
        str | None,
        typer.Option(
            "--modes",
            help="Working modes that are looked at: all, or the machine's own.  [default: all]",
            metavar="all|own",
        ),
    ] = None
    redundant: Annotated[bool, typer.Option("--redundant", help="Along --path: all drives at work, beside the best locks.")] = (
        False
    )
    rate: Annotated[
        float | None,
        typer.Option("--rate", help="With --redundant: travels of itself that a drive may cover along the path.  [default: 2]"),
    ] = None

    def check(self, task: Task) -> None:
        """Refuse options that do not go together."""
        from trivet.errors import InputError

        if self.redundant and task.path is None:
            raise InputError("--redundant: all drives are chosen along a path; give --path")
        if self.rate is not None and not self.redundant:
            raise InputError("--rate: is of all drives at work; add --redundant")

    def goal(self, over: FrequencyRange) -> Goal:
        """What is to be great, as the studies take it."""
        from trivet.errors import InputError
        from trivet.study.lock_measures import Goal

        made = Goal(Goal().objective if self.objective is None else self.objective, **over.numbers())
        if given(over) and not made.is_dynamic:
            raise InputError(f"{', '.join(given(over))}: of a dynamic stiffness; choose an --objective such as D_zz")
        return made


def run(
    *,
    machine: o.Machine,
    settings: o.Settings = None,
    model: Model,
    task: Task,
    wish: Wish,
    over: FrequencyRange,
    write: Annotated[
        str | None,
        typer.Option("--write", help="Write the machine, locked as is best, with a line of that.", metavar="FILE.toml"),
    ] = None,
    out: DataOutput,
) -> None:
    """Which drives of a redundant machine to lock, and where; without a task, which sets of them leave six freedoms."""
    from trivet.errors import InputError
    from trivet.files import check_writable
    from trivet.study.locks import lock_sets
    from trivet.study.machines import choose, parse_settings
    from trivet.views import locks as view

    task.check()
    wish.check(task)
    out.check()
    if write is not None:
        check_writable(write, overwrite=out.overwrite)
    chosen = model.of(choose(machine, parse_settings(settings or [])))
    if task.is_given:
        advised = _advised(chosen, task, wish, over, out.as_json)
        if write is not None:
            _keep(advised, write, out.overwrite)
        out.give(advised, view)
        return
    idle = [
        *given(wish),
        *given(over),
        *(["--write"] if write else []),
        *(name for name in given(out) if name in ("--figure", "--data")),
    ]
    if idle:
        raise InputError(f"{', '.join(idle)}: of advice for a task; give --path, --hemisphere or a pose")
    with output.busy("looking at locks", out.as_json):
        sets = lock_sets(chosen)
    out.say(sets, view)


def _keep(advised: LocksAdvised | RedundantPath, path: str, overwrite: bool) -> None:
    """Write the machine, locked as is best."""
    from trivet.model import write
    from trivet.study.lock_advice import LocksAdvised

    best = advised if isinstance(advised, LocksAdvised) else advised.fixed
    write(best.locked, path, overwrite=overwrite)
    output.wrote(path)


def _advised(chosen: Machine, task: Task, wish: Wish, over: FrequencyRange, quiet: bool) -> LocksAdvised | RedundantPath:
    from trivet.study.lock_advice import advise_locks
    from trivet.study.redundant import RATE, redundant_path

    goal, family = wish.goal(over), task.family(chosen)
    modes = cast("Modes", "all" if wish.modes is None else wish.modes)
    with output.progress(quiet, "") as advance:
        if wish.redundant and family is not None:
            rate = RATE if wish.rate is None else wish.rate
            return redundant_path(chosen, family, goal, rate=rate, modes=modes, progress=advance)
        poses = task.pose(chosen) if family is None else family
        return advise_locks(chosen, poses, goal, roll=task.roll_policy, modes=modes, progress=advance)
