"""A home that is not reached is told by its key, with what would reach it, by the first command that reads the file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from trivet import load, pose
from trivet.errors import NoResultError
from trivet.kinematics.mode import parse_mode
from trivet.study.home import nearest_height, require_home

KEY = "home.position"
TOLD = f"own: {KEY} 0 mm, 0 mm, 325 mm: the pose is not reached: leg-1 cannot close: "


@pytest.fixture
def own(trivet: Any, tmp_path: Path) -> str:
    """A copy of a machine of the catalogue whose home is far too high."""
    text = trivet("show", "azulay", "--toml")[1].replace('name = "azulay"', 'name = "own"').replace('"125 mm"', '"325 mm"')
    (tmp_path / "own.toml").write_text(text)
    return "own.toml"


@pytest.mark.parametrize("height", ["325 mm", "1.25 m", "12.5 mm"])
@pytest.mark.parametrize("name", ["azulay", "eclipse"])
def test_the_height_told_is_reached_and_none_nearer_is(name: str, height: str) -> None:
    machine = load(name, {KEY: f"0 mm, 0 mm, {height}"})
    z = float(machine.home.position[2])
    found = nearest_height(machine, parse_mode(machine))
    assert found is not None
    pose(machine, (0.0, 0.0, found))
    step = 10.0 ** int(f"{0.01 * z:e}".partition("e")[2])
    for nearer in (found + (z - found) * part for part in (0.0, 0.2, 0.5, 0.9)):
        if abs(nearer - found) >= step:
            with pytest.raises(NoResultError, match="not reached"):
                pose(machine, (0.0, 0.0, nearer))


def test_a_home_that_is_reached_is_fine() -> None:
    for name in ("azulay", "gough-stewart", "rmmt"):
        require_home(load(name))


def test_without_any_height_none_is_told() -> None:
    machine = load("azulay", {KEY: "0 mm, 300 mm, 125 mm"})
    with pytest.raises(NoResultError, match=r"leg-2\.slide at .* mm is above its limit of 65 mm$"):
        require_home(machine)
    require_home(machine, within_travel=False)


def test_another_pose_is_not_called_home() -> None:
    with pytest.raises(NoResultError, match=r"^azulay: the pose is not reached: [^;]*$"):
        pose("azulay", (0.0, 0.0, 0.325))


@pytest.mark.parametrize(
    "command",
    ["pose", "forward", "singularity", "modes", "show --figure m.png", "export m.xml"],
)
def test_commands_name_the_key(trivet: Any, own: str, command: str) -> None:
    name, *options = command.split()
    code, _, err = trivet(name, own, *options)
    assert code == 1
    assert err.startswith(f"trivet: {TOLD}")
    assert err.endswith("; with z at 160 mm it is\n")


def test_show_warns(trivet: Any, own: str) -> None:
    code, out, err = trivet("show", own)
    assert (code, "chain leg" in out) == (0, True)
    assert err.startswith(f"trivet: warning: {TOLD}")
    assert trivet("show", "azulay")[2] == ""
