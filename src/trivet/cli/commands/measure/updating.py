"""trivet measure update."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from trivet.cli import options as o
from trivet.cli import output
from trivet.cli.groups import Choice, DataOutput, Measurement, Model

if TYPE_CHECKING:
    from trivet.measure.machine.parameters import Free, Number
    from trivet.model import Machine
    from trivet.model.quantity import Quantity


Numbers = Annotated[
    list[str],
    typer.Option(
        "--free",
        help="A number that may change, and how well it is known: ball.stiffness (within a factor of 3), "
        "link.length='2 %', home.position.3='1 mm', loss_factor. May be repeated.",
        metavar="KEY[=SPREAD]",
    ),
]
Ends = Annotated[
    list[str] | None,
    typer.Option(
        "--bounds",
        help="Between which values it stays, as in ball.stiffness='50 N m/rad, 2000 N m/rad'. May be repeated.",
        metavar="KEY=LOW,HIGH",
    ),
]


def run(
    *,
    measured: o.MeasuredFile,
    choice: Choice,
    test: Measurement,
    free: Numbers,
    bounds: Ends = None,
    hold: Annotated[
        str | None,
        typer.Option("--hold", help="Points whose functions are compared, and not fitted, as in '3,4'.", metavar="POINTS"),
    ] = None,
    further: Annotated[bool, typer.Option("--next", help="Tell where to measure next.")] = False,
    write: Annotated[
        str | None,
        typer.Option("--write", help="Write the corrected machine, with the history of its numbers.", metavar="FILE.toml"),
    ] = None,
    model: Model,
    out: DataOutput,
) -> None:
    """Numbers of a machine corrected by measured responses: what they become, how sure they are, what cannot be told apart."""
    from trivet.files import check_writable
    from trivet.measure.files.by_suffix import read_functions
    from trivet.model import write as write_machine
    from trivet.study.update import update
    from trivet.views import update as view

    low, high = test.ends()
    out.check()
    if write is not None:
        check_writable(write, overwrite=out.overwrite)
    chosen, setup = choice.load(model), test.setup()
    wanted = _free(chosen, free, bounds or [], test.loss_factor)
    functions, fitted = read_functions(measured), test.modes()
    held = [point.strip() for point in hold.split(",")] if hold else ()
    with output.progress(out.as_json, "steps") as advance:
        found = update(
            chosen, setup, functions, wanted, fit=fitted, low=low, high=high, hold=held, loss_factor=test.loss_factor,
            progress=lambda steps: advance("correcting", steps),
        )  # fmt: skip
    if further:
        with output.busy("looking for places that would tell more", out.as_json):
            _ = found.next_points
    if write is not None:
        write_machine(found.machine, write, overwrite=out.overwrite)
        output.wrote(write)
    out.give(found, view, further)


def _free(machine: Machine, free: list[str], bounds: list[str], loss_factor: float) -> list[Free]:
    """What is free, from KEY[=SPREAD] and KEY=LOW,HIGH."""
    from trivet.errors import InputError
    from trivet.measure.machine.parameters import Free, look_up

    limits: dict[str, tuple[float, float]] = {}
    for text in bounds:
        path, _, ends = (part.strip() for part in text.partition("="))
        number, both = look_up(machine, path, loss_factor), ends.split(",")
        if len(both) != 2:
            raise InputError(f'--bounds "{text}": expected KEY=LOW,HIGH, both with their unit')
        low, high = (_in_si("--bounds", end, number.kind) for end in both)
        limits[number.path] = low, high
    found = []
    for text in free:
        path, _, known = (part.strip() for part in text.partition("="))
        number = look_up(machine, path, loss_factor)
        low, high = limits.pop(number.path, (-float("inf"), float("inf")))
        found.append(Free(number.path, _spread(known, number) if known else None, low, high))
    for path in limits:
        raise InputError(f"--bounds: {path} is not named by --free")
    return found


def _spread(text: str, number: Number) -> float:
    """How well a number is known: a share of it ("20 %"), or so much in its unit."""
    from trivet.errors import InputError

    if not text.endswith("%"):
        try:
            absolute = _in_si("--free", text, number.kind)
        except InputError as error:
            raise InputError(
                f"{error}; after = stands how well the number is known (a share, or so much in its unit); "
                "a value to start from is given by --set"
            ) from None
        return absolute / number.value if number.is_unsigned and number.value else absolute
    if not number.is_unsigned:
        raise InputError(f'--free "{number.path}={text}": may have either sign; say how well it is known in its unit')
    share = o.quantity("--free", text[:-1].strip(), "share", "")
    assert share is not None
    return share / 100


def _in_si(option: str, text: str, kind: Quantity) -> float:
    value = o.quantity(option, text.strip(), kind.dimension, kind.si)
    assert value is not None
    return value
