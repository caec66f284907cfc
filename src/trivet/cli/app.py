"""The commands."""

from __future__ import annotations

import json
import os
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trivet.cli import options as o

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.space.frame import Frame
    from trivet.study.pose import PoseReport
    from trivet.study.stiffness_map import StiffnessMap

app = typer.Typer(
    name="trivet",
    help="Analysis and design of parallel kinematic machines: from a machine file to its stiffness, and which one is stiffer.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def version(show: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False) -> None:
    """Print the version."""
    if show:
        from importlib.metadata import version as installed

        typer.echo(f"trivet {installed('trivet')}")
        raise typer.Exit()


@app.command("list")
def list_machines(as_json: o.Json = False) -> None:
    """List the machines of the catalogue."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.model import catalogue, load

    machines = [load(name) for name in catalogue()]
    if as_json:
        _print_json([json_of.card(m) for m in machines])
    else:
        tables.print_catalogue(machines)


@app.command()
def show(
    machine: o.Machine,
    settings: o.Settings = None,
    locks: o.Locks = None,
    toml: Annotated[bool, typer.Option("--toml", help="Print the machine file, a start for your own.")] = False,
    position: o.Position = None,
    azimuth: o.Azimuth = None,
    tilt: o.Tilt = None,
    roll: o.Roll = None,
    mode: o.Mode = None,
    figure: o.FigureFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Show a machine: its chains, dimensions and where the numbers come from; with --figure a 3-D picture at any pose."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.errors import InputError
    from trivet.model import to_text

    chosen = _machine(machine, settings, locks=locks)
    frame = _frame(chosen, position, azimuth, tilt, roll)
    if not figure and any(option is not None for option in (position, azimuth, tilt, roll, mode)):
        raise InputError("--position, --azimuth, --tilt, --roll and --mode choose the pose of a picture; add --figure")
    if toml and as_json:
        raise InputError("--toml and --json: choose one of them")
    _free_to_write(figure, None, overwrite)
    if toml:
        # Published values speak of the catalogue's machine, not of the one which somebody makes of it.
        typer.echo(to_text(chosen.renamed(chosen.name)), nl=False)
    elif as_json:
        _print_json(json_of.machine_json(chosen))
    else:
        tables.print_machine(chosen)
    if figure:
        from trivet.show.drawing import draw

        for path in figure:
            draw(chosen, frame, mode, path=path, overwrite=overwrite)
            _wrote(path)


@app.command()
def pose(
    machine: o.Machine,
    position: o.Position = None,
    azimuth: o.Azimuth = None,
    tilt: o.Tilt = None,
    roll: o.Roll = None,
    mode: o.Mode = None,
    settings: o.Settings = None,
    locks: o.Locks = None,
    spherical: o.Spherical = None,
    guide: o.Guide = None,
    shear: o.Shear = None,
    force: Annotated[
        str | None, typer.Option("--force", help="Force at the tool tip in {O}, as in '0 N, 10 N, 0 N'.", metavar="X,Y,Z")
    ] = None,
    moment: Annotated[
        str | None,
        typer.Option("--moment", help="Moment at the tool tip in {O}, as in '0 N m, 0 N m, 1 N m'.", metavar="X,Y,Z"),
    ] = None,
    weight: Annotated[bool, typer.Option("--weight", help="Add the machine's own weight, gravity along -z.")] = False,
    anyway: o.Anyway = False,
    figure: o.FigureFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Everything about one pose: joints and limits, stiffness, what it is lost in, and the deflection under a load."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.study.pose import pose as at_pose

    chosen = _machine(machine, settings, spherical, guide, shear, locks)
    report = at_pose(
        chosen,
        o.triple("--position", position, "length", "m"),
        *_pose_angles(azimuth, tilt, roll),
        mode=mode,
        strict=not anyway,
    )
    load = _load(report, force, moment, weight)
    if as_json:
        _print_json(json_of.pose_json(report, load))
    else:
        tables.print_pose(report, load)
    _draw(report, figure, overwrite)


def _load(report: PoseReport, force: str | None, moment: str | None, weight: bool) -> Any:
    if force is None and moment is None and not weight:
        return None
    none = (0.0, 0.0, 0.0)
    return report.load(
        o.triple("--force", force, "force", "N") or none,
        o.triple("--moment", moment, "moment", "N m") or none,
        (0.0, 0.0, -9.80665) if weight else none,
    )


@app.command("map")
def map_stiffness(
    machine: o.Machine,
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
    steps: o.Steps = 10,
    radius: o.Radius = None,
    height: o.Height = None,
    rolls: Annotated[int | None, o.ROLLS] = None,
    settings: o.Settings = None,
    locks: o.Locks = None,
    spherical: o.Spherical = None,
    guide: o.Guide = None,
    shear: o.Shear = None,
    figure: o.FigureFile = None,
    data: o.DataFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Stiffness over the machine's workpiece hemisphere, with the best roll at every point; or singularities there."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.errors import InputError
    from trivet.statics.best_roll import ROLLS
    from trivet.study.datasets import save
    from trivet.study.singularity_map import SingularityMap, singularity_map
    from trivet.study.stiffness_map import stiffness_map, surface_of

    if roll is not None and quantity == "stiffness":
        raise InputError("--roll: the stiffness is mapped with its best roll; choose another --quantity")
    policy = _roll(roll, objective)
    if (objective or rolls) and quantity != "stiffness" and not str(policy).startswith("best"):
        raise InputError("--objective and --rolls choose the best roll; they do not go with another --roll")
    chosen = _machine(machine, settings, spherical, guide, shear, locks)
    surface = surface_of(
        chosen, steps, o.quantity("--radius", radius, "length", "m"), o.quantity("--height", height, "length", "m")
    )
    _free_to_write(figure, data, overwrite)
    result: StiffnessMap | SingularityMap
    with _progress(as_json) as bar:
        task = bar.add_task(chosen.name, total=len(surface))

        def advance(points: int) -> None:
            bar.update(task, completed=points)

        if quantity == "stiffness":
            result = stiffness_map(
                chosen, surface, objective=objective or "K_xx", mode=mode, rolls=rolls or ROLLS, progress=advance
            )
        else:
            result = singularity_map(
                chosen, surface, quantity=quantity, roll=policy, mode=mode, rolls=rolls or ROLLS, progress=advance
            )
    if as_json:
        _print_json(json_of.map_json(result))
    else:
        tables.print_map(result)
    _draw(result, figure, overwrite)
    if data:
        save(result, data, overwrite=overwrite)
        _wrote(data)


@app.command()
def compare(
    machines: o.Machines = None,
    objective: o.Objective = "K_xx",
    mode: o.Mode = None,
    steps: o.Steps = 10,
    radius: o.Radius = None,
    height: o.Height = None,
    rolls: o.Rolls = 360,
    finer: Annotated[
        int, typer.Option("--finer", help="Refinement of the lattice for the convergence check; 1 leaves it out.")
    ] = 2,
    settings: o.Settings = None,
    spherical: o.Spherical = None,
    guide: o.Guide = None,
    shear: o.Shear = None,
    figure: o.FigureFile = None,
    data: o.DataFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Compare machines: means and variances of the stiffness, Welch's tests, deviations from published values."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.study.comparison import PAPER_MACHINES
    from trivet.study.comparison import compare as compare_machines
    from trivet.study.datasets import save

    chosen = [_machine(m, settings, spherical, guide, shear) for m in machines or PAPER_MACHINES]
    _free_to_write(figure, data, overwrite)
    with _progress(as_json) as bar:
        tasks: dict[str, Any] = {}

        def advance(name: str, points: int) -> None:
            if name not in tasks:
                tasks[name] = bar.add_task(name, total=None)
            bar.update(tasks[name], completed=points)

        result = compare_machines(
            *chosen,
            objective=objective,
            mode=mode,
            steps=steps,
            radius=o.quantity("--radius", radius, "length", "m"),
            height=o.quantity("--height", height, "length", "m"),
            rolls=rolls,
            finer=finer,
            progress=advance,
        )
    if as_json:
        _print_json(json_of.comparison_json(result))
    else:
        tables.print_comparison(result)
    _draw(result, figure, overwrite)
    if data:
        save(result, data, overwrite=overwrite)
        _wrote(data)


@app.command()
def forward(
    machine: o.Machine,
    drives: Annotated[
        str | None,
        typer.Option("--drives", help="Coordinates of all drives in the order of Q, with their units, separated by commas."),
    ] = None,
    drive: Annotated[
        list[str] | None,
        typer.Option(
            "--drive",
            help="Coordinate of one drive, as in leg-1.slide='30 mm'; the others are as at the pose. May be repeated.",
            metavar="DRIVE=VALUE",
        ),
    ] = None,
    position: o.Position = None,
    azimuth: o.Azimuth = None,
    tilt: o.Tilt = None,
    roll: o.Roll = None,
    mode: o.Mode = None,
    settings: o.Settings = None,
    locks: o.Locks = None,
    anyway: o.Anyway = False,
    figure: o.FigureFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """All poses that the machine can take with its drives at given coordinates, or at those of a pose."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.study.forward import forward as assembly_modes
    from trivet.study.forward import parse_drives

    chosen = _machine(machine, settings, locks=locks)
    _free_to_write(figure, None, overwrite)
    given, start = parse_drives(chosen, drives, drive or []), _frame(chosen, position, azimuth, tilt, roll)
    with _busy("finding all poses", as_json):
        result = assembly_modes(chosen, given, start=start, mode=mode, anyway=anyway)
    if as_json:
        _print_json(json_of.forward_json(result))
    else:
        tables.print_forward(result)
    _draw(result, figure, overwrite)


@app.command()
def singularity(
    machine: o.Machine,
    position: o.Position = None,
    azimuth: o.Azimuth = None,
    tilt: o.Tilt = None,
    roll: o.Roll = None,
    mode: o.Mode = None,
    settings: o.Settings = None,
    locks: o.Locks = None,
    figure: o.FigureFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """How near a pose is to a singularity, what would go wrong there, and how well forces are transmitted."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.study.singularity import singularity_report

    chosen = _machine(machine, settings, locks=locks)
    _free_to_write(figure, None, overwrite)
    with _busy("looking for singularities", as_json):
        result = singularity_report(chosen, _frame(chosen, position, azimuth, tilt, roll), mode=mode)
    if as_json:
        _print_json(json_of.singularity_json(result))
    else:
        tables.print_singularity(result)
    _draw(result, figure, overwrite)


@app.command()
def export(
    machine: o.Machine,
    file: Annotated[str, typer.Argument(help="File to write: .xml, a MuJoCo model with its loops closed.", metavar="FILE.xml")],
    mode: o.Mode = None,
    settings: o.Settings = None,
    locks: o.Locks = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Write the machine at home as a MuJoCo model (MJCF): bodies with masses, joints with travel, closed loops."""
    from trivet.errors import InputError
    from trivet.interop.mjcf import write_mjcf

    if not file.endswith(".xml"):
        raise InputError(f'"{file}": a MuJoCo model ends in .xml')
    chosen = _machine(machine, settings, locks=locks)
    write_mjcf(chosen, file, mode=mode, overwrite=overwrite)
    if as_json:
        _print_json({"machine": chosen.name, "format": "mjcf", "file": file})
    _wrote(file)


@app.command()
def schema() -> None:
    """Print the JSON schema of machine files, with which editors complete and check them."""
    from trivet.model import schema as machine_schema

    _print_json(machine_schema())


def _machine(
    name: str,
    settings: list[str] | None,
    spherical: str | None = None,
    guide: str | None = None,
    shear: bool | None = None,
    locks: list[str] | None = None,
) -> Machine:
    from trivet.study.machines import choose, locked, parse_settings, switched

    return locked(switched(choose(name, parse_settings(settings or [])), spherical, guide, shear), locks or [])


def _pose_angles(azimuth: str | None, tilt: str | None, roll: str | None) -> tuple[float | None, ...]:
    options = (("--azimuth", azimuth), ("--tilt", tilt), ("--roll", roll))
    return tuple(o.quantity(name, text, "angle", "rad") for name, text in options)


def _frame(machine: Machine, position: str | None, azimuth: str | None, tilt: str | None, roll: str | None) -> Frame:
    """The platform frame that options choose; what they leave open is as at home."""
    from trivet.space.pose import zyz_frame
    from trivet.study.machines import pose_numbers

    place = o.triple("--position", position, "length", "m")
    place, angles = pose_numbers(machine, place, *_pose_angles(azimuth, tilt, roll))
    return zyz_frame(place, *angles)


def _roll(text: str | None, objective: str | None) -> str | float:
    """A policy for the roll as `singularity_map` takes it."""
    if text is None or text == "best":
        return f"best {objective or 'K_xx'}"
    if text == "-alpha" or text.startswith("best "):
        return text
    return o.quantity("--roll", text, "angle", "rad") or 0.0


def _free_to_write(figures: list[str] | None, data: str | None, overwrite: bool) -> None:
    """Refuse before the work, not after it, files that cannot be written."""
    from trivet.errors import InputError
    from trivet.files import check_writable
    from trivet.show.maps import check_suffix

    for path in figures or []:
        check_suffix(path)
    if data is not None and not data.endswith(".nc"):
        raise InputError(f'--data "{data}": a NetCDF file ends in .nc')
    paths = [*(figures or []), *([data] if data is not None else [])]
    places = [os.path.realpath(path) for path in paths]
    for path, place in zip(paths, places, strict=True):
        if places.count(place) > 1:
            raise InputError(f"{path}: given twice")
        check_writable(path, overwrite=overwrite)


def _draw(result: Any, paths: list[str] | None, overwrite: bool) -> None:
    if not paths:
        return
    from trivet.show.figure import figure

    for path in paths:
        figure(result, path, overwrite=overwrite)
        _wrote(path)


def _wrote(path: str) -> None:
    print(f"wrote {path}", file=sys.stderr)


def _print_json(value: Any) -> None:
    typer.echo(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))


def _busy(doing: str, quiet: bool) -> Any:
    """A sign of life for work that cannot say how far it is; the first run of a kind of machine compiles kernels."""
    from rich.console import Console

    return Console(stderr=True, quiet=quiet or not sys.stderr.isatty()).status(f"{doing} …")


def _progress(quiet: bool) -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("points"),
        TimeElapsedColumn(),
    )
    return Progress(*columns, console=Console(stderr=True), transient=True, disable=quiet or not sys.stderr.isatty())
