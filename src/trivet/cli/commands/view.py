"""trivet view."""

from __future__ import annotations

from typing import Annotated

import typer

from trivet.cli import options as o
from trivet.cli.groups import At, Model
from trivet.cli.output import say, warn_of_home


def run(
    *,
    machines: Annotated[
        list[str] | None,
        typer.Argument(help="One machine, or two side by side: names or files; azulay by default.", metavar="[MACHINE]..."),
    ] = None,
    at: At,
    mode: o.Mode = None,
    model: Model,
    settings: o.Settings = None,
    port: Annotated[int | None, typer.Option("--port", help="Of loopback; the first free one from 8080 by default.")] = None,
    dark: Annotated[bool, typer.Option("--dark", help="Light on dark.")] = False,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Say where the page is, but do not open it.")] = False,
) -> None:
    """A page in the browser: grab the platform, watch the chains follow, see where it gets soft or singular."""
    from trivet.study.machines import choose, parse_settings, pose_numbers
    from trivet.viewer.serve import serve
    from trivet.viewer.state import PoseNumbers, state_of

    own = parse_settings(settings or [])
    chosen = [model.of(choose(name, own)) for name in machines or ["azulay"]]
    modes = [mode, *(None for _ in chosen[1:])]
    for machine, signs in zip(chosen, modes, strict=True):
        warn_of_home(machine, signs)
    place, angles = pose_numbers(chosen[0], *at.numbers())
    state = state_of(chosen, modes, PoseNumbers(*place, *angles))
    serve(state, port, dark, not no_browser, say)
