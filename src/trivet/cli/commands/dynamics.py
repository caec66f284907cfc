"""trivet dynamics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trivet.cli import options as o
from trivet.cli import output as to
from trivet.cli.groups import Acting, At, Choice, DataOutput, Speeds

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.space.curve import Limits, Trajectory


@dataclass(frozen=True)
class Way:
    """A path, and how fast it is run through."""

    to: Annotated[
        str | None, typer.Option("--to", help="Platform centre to go to from the pose, straight and at rest.", metavar="X,Y,Z")
    ] = None
    to_azimuth: Annotated[str | None, typer.Option("--to-azimuth", help="Azimuth to go to; as at the pose by default.")] = None
    to_tilt: Annotated[str | None, typer.Option("--to-tilt", help="Tilt to go to.")] = None
    to_roll: Annotated[str | None, typer.Option("--to-roll", help="Roll to go to.")] = None
    circle: Annotated[
        str | None,
        typer.Option(
            "--circle", help="Once round a level circle of this radius about the pose, from its +x side.", metavar="RADIUS"
        ),
    ] = None
    path: Annotated[str | None, typer.Option("--path", help="A path file with [[poses]].", metavar="FILE.toml")] = None
    speed: Annotated[str | None, typer.Option("--speed", help="Limit of the centre's speed; 0.1 m/s by default.")] = None
    acceleration_limit: Annotated[
        str | None, typer.Option("--max-acceleration", help="Limit of its acceleration; 1 m/s^2 by default.")
    ] = None
    jerk: Annotated[str | None, typer.Option("--jerk", help="Limit of its jerk; 50 m/s^3 by default.")] = None
    angular_speed: Annotated[
        str | None, typer.Option("--angular-speed", help="Limit of the platform's turning; 1 rad/s by default.")
    ] = None
    duration: Annotated[
        str | None, typer.Option("--duration", help="Of the whole motion; as short as the limits allow by default.")
    ] = None
    samples: Annotated[
        int | None, typer.Option("--samples", help="Times at which the motion is looked at; a thousand, or 20 per pose.")
    ] = None
    step: Annotated[str | None, typer.Option("--step", help="Time between them, in place of their number.")] = None

    @property
    def is_given(self) -> bool:
        """Whether there is a path."""
        goal = (self.to, self.to_azimuth, self.to_tilt, self.to_roll)
        return any(text is not None for text in (*goal, self.circle, self.path))

    def limits(self) -> Limits:
        """How fast the platform may move."""
        from trivet.study.pathfile import GivenLimits

        return GivenLimits(**self._given_limits()).limits()

    def _given_limits(self) -> dict[str, float | None]:
        return {
            "speed": o.quantity("--speed", self.speed, "speed", "m/s", True),
            "acceleration": o.quantity("--max-acceleration", self.acceleration_limit, "acceleration", "m/s^2", True),
            "jerk": o.quantity("--jerk", self.jerk, "jerk", "m/s^3", True),
            "angular_speed": o.quantity("--angular-speed", self.angular_speed, "angular speed", "rad/s", True),
        }

    def trajectory(self, machine: Machine, at: At) -> Trajectory:
        """The platform's motion in time."""
        from trivet.errors import InputError
        from trivet.space.curve import circle, straight, timed
        from trivet.space.pose import zyz_frame
        from trivet.study.machines import pose_numbers
        from trivet.study.pathfile import read_path

        goal = At(self.to, self.to_azimuth, self.to_tilt, self.to_roll)
        if sum((goal.is_given, self.circle is not None, self.path is not None)) > 1:
            raise InputError("--to, --circle and --path: give one of them")
        duration = o.quantity("--duration", self.duration, "time", "s", True)
        if self.path is not None:
            if at.is_given or duration is not None or any(v is not None for v in self._given_limits().values()):
                raise InputError("--path: the file says where the path begins and how fast it is; leave the other options out")
            try:
                return read_path(self.path).trajectory(float(machine.characteristic_length) or 1.0)
            except InputError as error:
                named = str(error).startswith(self.path)
                raise error if named else InputError(f"{self.path}: {error}") from None
        start = at.frame(machine)
        if self.circle is not None:
            radius = o.quantity("--circle", self.circle, "length", "m", True)
            assert radius is not None
            return timed([circle(start, radius)], self.limits(), duration)
        place, (alpha, beta, gamma) = pose_numbers(machine, *at.numbers())
        own, a, b, c = goal.numbers()
        position = place if own is None else own
        end = zyz_frame(position, alpha if a is None else a, beta if b is None else b, gamma if c is None else c)
        return timed([straight(start, end)], self.limits(), duration)

    def require_none(self) -> None:
        """Raise InputError where something of a path is given without one."""
        from trivet.errors import InputError

        given = {"--speed": self.speed, "--max-acceleration": self.acceleration_limit, "--jerk": self.jerk}
        given |= {"--angular-speed": self.angular_speed, "--duration": self.duration}
        given |= {"--samples": None if self.samples is None else str(self.samples), "--step": self.step}
        for option, text in given.items():
            if text is not None:
                raise InputError(f"{option}: speaks of a motion; give --to, --circle or --path as well")

    def count(self, duration: float) -> int | None:
        """How many times are looked at."""
        from trivet.errors import InputError
        from trivet.study.motion import FEWEST, MOST

        step = o.quantity("--step", self.step, "time", "s", True)
        if step is None:
            return self.samples
        count = int(min(duration / step, 1e18)) + 1
        if count < FEWEST:
            raise InputError(
                f"--step: {step:g} s is too large for a motion of {duration:.4g} s, whose peaks it would miss; "
                f"at most {duration / (FEWEST - 1):.3g} s"
            )
        if count > MOST:
            raise InputError(
                f"--step: {step:g} s makes {count:.3g} times of {duration:.4g} s; at least {duration / (MOST - 1):.3g} s"
            )
        return count


def run(
    *,
    choice: Choice,
    at: At,
    mode: o.Mode = None,
    speeds: Speeds,
    acceleration: Annotated[
        str | None,
        typer.Option(
            "--acceleration", help="Of the platform centre in {O}, as in '0 m/s^2, 1 m/s^2, 0 m/s^2'.", metavar="X,Y,Z"
        ),
    ] = None,
    angular_acceleration: Annotated[
        str | None, typer.Option("--angular-acceleration", help="Of the platform in {O}, rad/s^2.", metavar="X,Y,Z")
    ] = None,
    acting: Acting,
    way: Way,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="How the forces change with every dimension (at one pose).")
    ] = False,
    anyway: o.Anyway = False,
    out: DataOutput,
) -> None:
    """Rigid-body dynamics: what the drives must give and the joints bear, in one state of motion or along a path."""
    chosen = choice.load()
    if way.is_given:
        _refuse_state(speeds, acceleration, angular_acceleration, sensitivity)
        out.check()
        with to.busy("laying out the path", out.as_json):
            trajectory = way.trajectory(chosen, at)
        _along(chosen, trajectory, way.count(trajectory.duration), acting, mode, anyway, out)
        return
    way.require_none()
    from trivet.errors import InputError
    from trivet.study.dynamics import dynamics_report
    from trivet.views import dynamics as view

    if out.data is not None or out.figure:
        raise InputError("--figure and --data: a motion can be drawn and saved; give --to, --circle or --path")
    none = (0.0, 0.0, 0.0)
    rise = o.triple("--acceleration", acceleration, "acceleration", "m/s^2")
    turn = o.triple("--angular-acceleration", angular_acceleration, "angular acceleration", "rad/s^2")
    (velocity, angular_velocity), loading = speeds.numbers(), acting.loading()
    out.check()
    with to.busy("working out forces", out.as_json):
        report = dynamics_report(
            chosen,
            *at.numbers(),
            velocity=velocity,
            angular_velocity=angular_velocity,
            acceleration=rise or none,
            angular_acceleration=turn or none,
            loading=loading,
            mode=mode,
            anyway=anyway,
        )
        slopes = report.slopes if sensitivity else None
        _ = report.reactions, report.shares
    out.give(report, view, slopes)


def _along(
    chosen: Machine,
    trajectory: Trajectory,
    samples: int | None,
    acting: Acting,
    mode: str | None,
    anyway: bool,
    out: DataOutput,
) -> None:
    from trivet.study.motion import motion
    from trivet.views import motion as view

    loading = acting.loading()
    out.check()
    with to.busy("working out forces along the path", out.as_json):
        report = motion(chosen, trajectory, loading=loading, mode=mode, samples=samples, anyway=anyway)
        _ = report.joint_sizing
    out.give(report, view)


def _refuse_state(speeds: Speeds, *others: Any) -> None:
    from trivet.errors import InputError

    if speeds.velocity or speeds.angular_velocity or any(others):
        raise InputError(
            "--velocity, --acceleration, --angular-… and --sensitivity speak of one state; along a path the path says how "
            "the platform moves"
        )
