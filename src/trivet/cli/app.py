"""The commands."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trivet.cli import options as o

if TYPE_CHECKING:
    from trivet.model import Machine
    from trivet.study.pose import PoseReport

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

    chosen = _machine(machine, settings)
    place = o.triple("--position", position, "length", "m")
    given = [o.quantity(n, text, "angle", "rad") for n, text in (("--azimuth", azimuth), ("--tilt", tilt), ("--roll", roll))]
    if not figure and (place is not None or mode is not None or any(g is not None for g in given)):
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
        from trivet.space.pose import zyz_frame

        home = chosen.home
        angles = [h if g is None else g for g, h in zip(given, (home.azimuth, home.tilt, home.roll), strict=True)]
        for path in figure:
            draw(chosen, zyz_frame(home.position if place is None else place, *angles), mode, path=path, overwrite=overwrite)
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
    anyway: Annotated[bool, typer.Option("--anyway", help="Report the pose although a joint is outside its travel.")] = False,
    figure: o.FigureFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Everything about one pose: joints and limits, stiffness, what it is lost in, and the deflection under a load."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.study.pose import pose as at_pose

    chosen = _machine(machine, settings, spherical, guide, shear)
    report = at_pose(
        chosen,
        o.triple("--position", position, "length", "m"),
        o.quantity("--azimuth", azimuth, "angle", "rad"),
        o.quantity("--tilt", tilt, "angle", "rad"),
        o.quantity("--roll", roll, "angle", "rad"),
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
    objective: o.Objective = "K_xx",
    mode: o.Mode = None,
    steps: o.Steps = 10,
    radius: o.Radius = None,
    height: o.Height = None,
    rolls: o.Rolls = 360,
    settings: o.Settings = None,
    spherical: o.Spherical = None,
    guide: o.Guide = None,
    shear: o.Shear = None,
    figure: o.FigureFile = None,
    data: o.DataFile = None,
    overwrite: o.Overwrite = False,
    as_json: o.Json = False,
) -> None:
    """Stiffness over the machine's workpiece hemisphere, with the best roll at every point."""
    from trivet.cli import as_json as json_of
    from trivet.cli import tables
    from trivet.study.datasets import save
    from trivet.study.stiffness_map import stiffness_map, surface_of

    chosen = _machine(machine, settings, spherical, guide, shear)
    surface = surface_of(
        chosen, steps, o.quantity("--radius", radius, "length", "m"), o.quantity("--height", height, "length", "m")
    )
    _free_to_write(figure, data, overwrite)
    with _progress(as_json) as bar:
        task = bar.add_task(chosen.name, total=len(surface))
        result = stiffness_map(
            chosen, surface, objective=objective, mode=mode, rolls=rolls, progress=lambda n: bar.update(task, completed=n)
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
def schema() -> None:
    """Print the JSON schema of machine files, with which editors complete and check them."""
    from trivet.model import schema as machine_schema

    _print_json(machine_schema())


def _machine(
    name: str, settings: list[str] | None, spherical: str | None = None, guide: str | None = None, shear: bool | None = None
) -> Machine:
    from trivet.study.machines import choose, parse_settings, switched

    return switched(choose(name, parse_settings(settings or [])), spherical, guide, shear)


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
    for path in paths:
        if paths.count(path) > 1:
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
