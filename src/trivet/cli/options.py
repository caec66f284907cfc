"""Options which several commands share, and reading quantities on the command line."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.measure.files.suffixes import KINDS

Study = Annotated[str, typer.Argument(help="A study file: machines, what varies of them, what is asked.", metavar="STUDY.toml")]
Store = Annotated[
    str | None,
    typer.Option(
        "--store",
        help="Folder of the results, made or gone on with; the name of the study file with .zarr by default.",
        metavar="FOLDER",
    ),
]
Workers = Annotated[
    int, typer.Option("--workers", help="Processes to be started on this machine; 0 works in this one.", min=0, max=256)
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler", help="A dask scheduler whose workers are taken, such as tcp://127.0.0.1:8786.", metavar="ADDRESS"
    ),
]
Machine = Annotated[
    str,
    typer.Argument(
        help="Name in the catalogue, a .toml file, or either with settings: 'azulay@link.length=200 mm'.", metavar="MACHINE"
    ),
]
Machines = Annotated[
    list[str] | None,
    typer.Argument(help="Names in the catalogue or .toml files; the paper's four when none is named.", metavar="[MACHINE]..."),
]
_MEASURED = f"Measured responses: {', '.join(map(str, KINDS[:-1]))} or {KINDS[-1]}."
MeasuredFile = Annotated[str, typer.Argument(help=_MEASURED, metavar="MEASURED")]
MeasuredFiles = Annotated[list[str], typer.Argument(help=_MEASURED, metavar="MEASURED")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Change a dimension: KEY=VALUE with its unit, as in link.length='200 mm'. May be repeated.",
        metavar="KEY=VALUE",
    ),
]
Locks = Annotated[
    list[str] | None,
    typer.Option(
        "--lock",
        help="Hold a joint while the machine works, as in radial='30 mm' or leg-2.radial='30 mm'. May be repeated.",
        metavar="JOINT=VALUE",
    ),
]
Mode = Annotated[
    str | None, typer.Option("--mode", help="Working mode, signs per chain as in '++ +- ++'; the machine's own by default.")
]
Spherical = Annotated[
    str | None,
    typer.Option(
        "--spherical", help="Ball joints: free, clamped, or a stiffness such as '300 N m/rad'; what the file says by default."
    ),
]
Guide = Annotated[
    str | None,
    typer.Option(
        "--guide", help="Carriages on circular guides yield in translation or in rotation; what the file says by default."
    ),
]
Shear = Annotated[
    bool | None,
    typer.Option(
        "--shear/--no-shear", help="Beams with shear deflection (Timoshenko) or without; what the file says by default."
    ),
]
Drives = Annotated[
    str | None,
    typer.Option(
        "--drives", help="Drives rigid, or as-described in the file, which is the default.", metavar="rigid|as-described"
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in SI instead of tables.")]
FigureFile = Annotated[
    list[str] | None,
    typer.Option("--figure", help="Draw into this file: .png, or .html (self-contained). May be repeated.", metavar="FILE"),
]
DataFile = Annotated[str | None, typer.Option("--data", help="Write labelled NetCDF into this file.", metavar="FILE.nc")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that exist.")]
Position = Annotated[
    str | None,
    typer.Option("--position", help="Platform centre, as in '0 mm, 0 mm, 125 mm'; home by default.", metavar="X,Y,Z"),
]
Azimuth = Annotated[str | None, typer.Option("--azimuth", help="Direction alpha of the tilt, as in '30 deg'.")]
Tilt = Annotated[str | None, typer.Option("--tilt", help="Tilt beta of the platform normal.")]
Roll = Annotated[str | None, typer.Option("--roll", help="Roll gamma about the platform normal.")]
Velocity = Annotated[
    str | None,
    typer.Option("--velocity", help="Of the platform centre in {O}, as in '0 m/s, 0.1 m/s, 0 m/s'.", metavar="X,Y,Z"),
]
AngularVelocity = Annotated[
    str | None,
    typer.Option("--angular-velocity", help="Of the platform in {O}, as in '1 rad/s, 0 rad/s, 0 rad/s'.", metavar="X,Y,Z"),
]
Force = Annotated[
    str | None, typer.Option("--force", help="Force on the platform in {O}, as in '0 N, 10 N, 0 N'.", metavar="X,Y,Z")
]
Moment = Annotated[
    str | None, typer.Option("--moment", help="Moment on the platform in {O}, as in '0 N m, 0 N m, 1 N m'.", metavar="X,Y,Z")
]
Point = Annotated[
    str | None, typer.Option("--at", help="Where the force acts, in {E}; the tool tip by default.", metavar="X,Y,Z")
]
Gravity = Annotated[
    str | None,
    typer.Option(
        "--gravity", help="Acceleration of free fall in {O}; '0 m/s^2, 0 m/s^2, -9.80665 m/s^2' by default.", metavar="X,Y,Z"
    ),
]
Anyway = Annotated[bool, typer.Option("--anyway", help="Go on although a joint is outside its travel.")]
OBJECTIVE = typer.Option("--objective", help="What the roll maximises: K_xx, 1/C_zz, K_rx, 'K(1,0,1)', …")
Objective = Annotated[str, OBJECTIVE]
Steps = Annotated[int, typer.Option("--steps", help="Lattice steps from pole to rim; 10 gives the paper's 317 points.")]
ROLLS = typer.Option("--rolls", help="Rolls of the first grid.")
Rolls = Annotated[int, ROLLS]
Radius = Annotated[str | None, typer.Option("--radius", help="Radius of the hemisphere; the machine's workpiece by default.")]
Height = Annotated[
    str | None, typer.Option("--height", help="Height of its centre above {O}; the machine's workpiece by default.")
]


def store_of(study: str, store: str | None) -> str:
    """Where the results of a study go."""
    from pathlib import Path

    return store if store is not None else f"{Path(study).stem}.zarr"


def check_folder(option: str, path: str, overwrite: bool) -> None:
    """Refuse, before the work, a folder that cannot take files, or that has some already."""
    import os

    from trivet.errors import InputError

    if os.path.exists(path) and not os.path.isdir(path):
        raise InputError(f"{option} {path}: is not a folder")
    if os.path.isdir(path) and os.listdir(path) and not overwrite:
        raise InputError(f"{option} {path}: is not empty; choose another folder, or allow overwriting (--overwrite)")
    there = os.path.abspath(path)
    while not os.path.lexists(there):
        there = os.path.dirname(there)
    if not os.path.isdir(there):
        raise InputError(f"{option} {path}: cannot be made: {there} is not a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"{option} {path}: cannot be written: no permission in {there}, or it is read-only")


def quantity(option: str, text: str | None, dimension: str, si: str, positive: bool = False) -> float | None:
    """One number with its unit, in SI; None stays None.

    Raises:
        InputError: naming the option, the value and what was expected.
    """
    if text is None:
        return None
    from pydantic_core import PydanticCustomError

    from trivet.errors import InputError
    from trivet.model.quantity import Quantity

    try:
        return Quantity(dimension, si, _WRITTEN.get(si, si), positive).parse(text)
    except PydanticCustomError as error:
        raise InputError(f'{option} "{text}": {error.message()}') from None


_WRITTEN = {"m": "mm", "rad": "deg"}


def triple(option: str, text: str | None, dimension: str, si: str) -> tuple[float, float, float] | None:
    """Three numbers with their units, separated by commas, in SI."""
    if text is None:
        return None
    parts = text.split(",")
    if len(parts) != 3:
        from trivet.errors import InputError

        raise InputError(f'{option} "{text}": expected three values with their units, separated by commas')
    x, y, z = (quantity(option, part, dimension, si) or 0.0 for part in parts)
    return x, y, z
