"""Options in groups: a command takes a group as one parameter, and typer sees the options of the group one by one."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.errors import TrivetError

if TYPE_CHECKING:
    from trivet.measure.machine.setup import Setup
    from trivet.measure.modal.fitted import FittedModes
    from trivet.model import Machine
    from trivet.space.family import Family
    from trivet.space.frame import Frame
    from trivet.space.surface import Surface
    from trivet.study.dynamics import Loading


Triple = tuple[float, float, float]

_NONE: Triple = (0.0, 0.0, 0.0)


def expanded(command: Callable[..., None]) -> Callable[..., None]:
    """A command as typer takes it: every parameter whose type is one of the groups below spread into its options.

    A sign of life shows until it says something, unless that is for a program.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters: list[inspect.Parameter] = []
    for name, own in inspect.signature(command).parameters.items():
        single = own.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[name])
        parameters += _options(groups[name]) if name in groups else [single]

    def call(**values: Any) -> None:
        quiet = bool(values.get("as_json", False))
        made = {name: group(**{f.name: values.pop(f.name) for f in fields(group)}) for name, group in groups.items()}
        with output.starting(quiet):
            command(**made, **values)

    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {p.name: p.annotation for p in parameters}
    call.__doc__ = command.__doc__
    return call


def _options(group: Any) -> Iterator[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    for field in fields(group):
        default = inspect.Parameter.empty if field.default is MISSING else field.default
        yield inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hints[field.name])


def given(group: Any) -> list[str]:
    """The options of a group that are given, as people write them."""
    hints = get_type_hints(type(group), include_extras=True)
    changed = (field.name for field in fields(group) if getattr(group, field.name) != field.default)
    return [hints[name].__metadata__[0].default for name in changed]


@dataclass(frozen=True)
class Model:
    """Switches of the model of stiffness."""

    spherical: o.Spherical = None
    guide: o.Guide = None
    shear: o.Shear = None
    drives: o.Drives = None

    def of(self, machine: Machine) -> Machine:
        """The machine with the switches thrown."""
        from trivet.study.machines import switched

        return switched(machine, self.spherical, self.guide, self.shear, self.drives)

    def options(self) -> tuple[str, ...]:
        """What is given, as it stands on a command line."""
        words = {"--spherical": self.spherical, "--guide": self.guide, "--drives": self.drives}
        found = [word for name, value in words.items() if value is not None for word in (name, value)]
        return (*found, *(() if self.shear is None else ("--shear" if self.shear else "--no-shear",)))


@dataclass(frozen=True)
class Choice:
    """One machine, with changes."""

    machine: o.Machine
    settings: o.Settings = None
    locks: o.Locks = None

    def load(self, model: Model | None = None) -> Machine:
        """The machine."""
        from trivet.study.machines import choose, locked, parse_settings

        chosen = choose(self.machine, parse_settings(self.settings or []))
        return locked(chosen if model is None else model.of(chosen), self.locks or [])


@dataclass(frozen=True)
class At:
    """A pose; what is left open is as at home."""

    position: o.Position = None
    azimuth: o.Azimuth = None
    tilt: o.Tilt = None
    roll: o.Roll = None

    @property
    def is_given(self) -> bool:
        """Whether any of it is."""
        return any(text is not None for text in (self.position, self.azimuth, self.tilt, self.roll))

    def numbers(self) -> tuple[tuple[float, float, float] | None, float | None, float | None, float | None]:
        """Position (m) and alpha, beta, gamma (rad) as the studies take them."""
        angles = (("--azimuth", self.azimuth), ("--tilt", self.tilt), ("--roll", self.roll))
        alpha, beta, gamma = (o.quantity(name, text, "angle", "rad") for name, text in angles)
        return o.triple("--position", self.position, "length", "m"), alpha, beta, gamma

    def closing(self, machine: Machine, mode: str | None) -> Frame:
        """The platform frame for what needs all chains closed: a home at which one cannot is told by its key."""
        from trivet.study.home import require_home

        if not self.is_given:
            require_home(machine, mode, within_travel=False)
        return self.frame(machine)

    def frame(self, machine: Machine) -> Frame:
        """The platform frame."""
        from trivet.space.pose import zyz_frame
        from trivet.study.machines import pose_numbers

        place, angles = pose_numbers(machine, *self.numbers())
        return zyz_frame(place, *angles)


@dataclass(frozen=True)
class Speeds:
    """How the platform moves."""

    velocity: o.Velocity = None
    angular_velocity: o.AngularVelocity = None

    def numbers(self) -> tuple[Triple, Triple]:
        """Velocity (m/s) and angular velocity (rad/s) as the studies take them."""
        return (
            o.triple("--velocity", self.velocity, "speed", "m/s") or _NONE,
            o.triple("--angular-velocity", self.angular_velocity, "angular speed", "rad/s") or _NONE,
        )


@dataclass(frozen=True)
class Acting:
    """What acts on a machine in motion."""

    force: o.Force = None
    moment: o.Moment = None
    point: o.Point = None
    gravity: o.Gravity = None

    def loading(self) -> Loading:
        """Weight and load."""
        from trivet.errors import InputError
        from trivet.study.dynamics import Loading

        force = o.triple("--force", self.force, "force", "N") or _NONE
        moment = o.triple("--moment", self.moment, "moment", "N m") or _NONE
        gravity = o.triple("--gravity", self.gravity, "acceleration", "m/s^2")
        if self.point is not None and self.force is None:
            raise InputError("--at: says where a force acts; give --force as well")
        return Loading.of(
            Loading().gravity if gravity is None else gravity, force, moment, o.triple("--at", self.point, "length", "m")
        )


@dataclass(frozen=True)
class Hemisphere:
    """The check points of a map."""

    steps: o.Steps = 10
    radius: o.Radius = None
    height: o.Height = None

    def lengths(self) -> tuple[float | None, float | None]:
        """Radius and height (m); None is the machine's own."""
        return o.quantity("--radius", self.radius, "length", "m"), o.quantity("--height", self.height, "length", "m")

    def over(self, machine: Machine) -> Surface:
        """The surface over a machine."""
        from trivet.study.stiffness_map import surface_of

        return surface_of(machine, self.steps, *self.lengths())

    def family(self, machine: Machine) -> Family:
        """The same with what lies between its points."""
        from trivet.study.families import hemisphere_of

        return hemisphere_of(machine, self.steps, *self.lengths())


@dataclass(frozen=True)
class FrequencyRange:
    """Over which frequencies, and with which damping, a dynamic stiffness is least; as the study has it where none is given."""

    low: Annotated[str | None, typer.Option("--from", help="Of a dynamic stiffness.  [default: 5 Hz]", metavar="FREQUENCY")] = (
        None
    )
    high: Annotated[
        str | None, typer.Option("--to", help="Of a dynamic stiffness.  [default: 3000 Hz]", metavar="FREQUENCY")
    ] = None
    loss_factor: Annotated[
        float | None,
        typer.Option("--loss-factor", help="Of a dynamic stiffness: of all that has none of its own.  [default: 0.02]"),
    ] = None

    def numbers(self) -> dict[str, float]:
        """What is given of low and high (Hz) and loss_factor, as the studies take it."""
        ends = (("--from", self.low), ("--to", self.high))
        low, high = (o.quantity(option, text, "frequency", "Hz", True) for option, text in ends)
        known = {"low": low, "high": high, "loss_factor": self.loss_factor}
        return {name: value for name, value in known.items() if value is not None}


@dataclass(frozen=True)
class Measurement:
    """How a measurement is set beside a machine."""

    setup_file: Annotated[
        str,
        typer.Option(
            "--setup", help="A file of the test set-up: where the measured points lie on the machine.", metavar="FILE.toml"
        ),
    ]
    fit: Annotated[
        str | None, typer.Option("--fit", help="Modes fitted to them, as measure fit --data writes them.", metavar="FILE.nc")
    ] = None
    lowest: Annotated[
        str | None,
        typer.Option("--from", help="Lowest frequency that counts; all that were measured by default.", metavar="FREQUENCY"),
    ] = None
    highest: Annotated[str | None, typer.Option("--to", help="Highest frequency that counts.", metavar="FREQUENCY")] = None
    loss_factor: Annotated[
        float, typer.Option("--loss-factor", help="Of all parts that have none of their own; twice the damping ratio.")
    ] = 0.02

    def ends(self) -> tuple[float | None, float | None]:
        """Lowest and highest frequency (Hz)."""
        low = o.quantity("--from", self.lowest, "frequency", "Hz", positive=True)
        return low, o.quantity("--to", self.highest, "frequency", "Hz", positive=True)

    def setup(self) -> Setup:
        """Where the points lie."""
        from trivet.measure.machine.setup import read_setup

        return read_setup(self.setup_file)

    def modes(self) -> FittedModes | None:
        """The fitted modes, where there are any."""
        from trivet.measure.modal.fitted import read_fitted

        return None if self.fit is None else read_fitted(self.fit)


@dataclass(frozen=True)
class Output:
    """Where a result goes: tables or JSON on the terminal, figures."""

    figure: o.FigureFile = None
    overwrite: o.Overwrite = False
    as_json: o.Json = False

    def check(self) -> None:
        """Refuse before the work, not after it, files that cannot be written."""
        output.check_files(self.figure or [], None, self.overwrite)

    def say(self, result: Any, view: Any, *more: Any, wrapped: bool = False) -> None:
        """Print a result by its view: a module of `trivet.views`, `tables` and `as_json` of the result and of what is more;
        `wrapped` as of `print_parts`."""
        if self.as_json:
            output.print_json(view.as_json(result, *more))
        else:
            output.print_parts(view.tables(result, *more), wrapped=wrapped)

    def give(self, result: Any, view: Any, *more: Any, wrapped: bool = False) -> None:
        """Draw a result and print it, in this order: who reads may stop reading.  A file that fails costs no numbers."""
        try:
            self._write(result)
        except TrivetError:
            self.say(result, view, *more, wrapped=wrapped)
            raise
        self.say(result, view, *more, wrapped=wrapped)

    def _write(self, result: Any) -> None:
        output.draw(result, self.figure or [], self.overwrite, self.as_json)


@dataclass(frozen=True)
class DataOutput(Output):
    """Where a result goes that can be kept as data as well."""

    data: o.DataFile = None

    def check(self) -> None:
        output.check_files(self.figure or [], self.data, self.overwrite)

    def without_data(self) -> Output:
        """Where the rest goes."""
        return Output(self.figure, self.overwrite, self.as_json)

    def _write(self, result: Any) -> None:
        super()._write(result)
        if self.data is not None:
            output.save(result, self.data, self.overwrite)
